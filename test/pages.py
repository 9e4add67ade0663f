"""The command blocks of a page, and running them as a reader would: in order, in one folder, as printed.

A page says in a comment above a block what a reader knows without being told:

    <!-- run: set-up -->                             installs or builds: in a fresh system alone
    <!-- run: never, it needs a vehicle -->          and why
    <!-- run: vog mission with --max-submaps 3 -->   smaller: the commands in which this stands

Several are parted by semicolons. A command whose remark says "until Ctrl-C" is left alone for a while, and
stopped so.
"""

import argparse
import dataclasses
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import time

from recordings import (corner, ddf, frame_samples, pgm, two_laps, wall, write_boxes, write_graph,
                        write_pcd)

BLOCK = re.compile(r"(?:^<!-- run: (?P<notes>[^\n]*?) -->\n)?^```(?:sh)?\n(?P<body>.*?)^```$",
                   re.MULTILINE | re.DOTALL)


def write_clouds(folder):
    folder.mkdir()
    for number in range(4):
        write_pcd(folder / f"{number}.pcd", wall(2.05 - 0.1 * number), (0.1 * number, 0, 0, 1, 0, 0, 0))


def write_frames(folder):
    folder.mkdir()
    for number in range(2):
        (folder / f"{number}.pgm").write_bytes(pgm(frame_samples(number)))


# What pages take as their reader's own, and how it is made: here, or by a command.
OWN = {
    "my_pier.stl": lambda file: write_boxes(file, ((0, 0, -2), 1, False), ((4, 0, -2), 1, False)),
    "a.log": "cp out/a/lcm.log a.log",
    "b.log": "cp out/c/lcm.log b.log",
    "clouds": write_clouds,
    "scans.graph": lambda file: write_graph(file, [((0, 0, 0), wall(2.05)), ((0.5, 0, 0), wall(1.55))]),
    "whole.bt": "build/bin/vog map export out/a/map whole.bt",
    "source.pcd": lambda file: write_pcd(file, corner((-0.2, 0.1))),
    "target.pcd": lambda file: write_pcd(file, corner()),
    "in.g2o": lambda file: file.write_text(two_laps()),
    "frames": write_frames,
    "dive.ddf": lambda file: file.write_bytes(ddf([frame_samples(i) for i in range(3)])),
}
# How long a command that runs until Ctrl-C has to show that it does.
SHOWS_S = 4
TIMEOUT_S = 3600


@dataclasses.dataclass
class Command:
    page: str
    line: int  # Of the page, from 1 on.
    text: str  # As printed, without its remark.
    is_set_up: bool
    is_endless: bool


def smaller(text, notes):
    """The command with the options of those notes that name it."""
    for note in notes:
        name, option, value = re.fullmatch(r"(.+) with (--\S+) (\S+)", note).groups()
        if name not in text:
            continue
        given = re.compile(rf"{option} \S+")
        text = given.sub(f"{option} {value}", text) if given.search(text) else f"{text} {option} {value}"
    return text


def commands_of(page, text):
    """What a page has its readers run, in order."""
    found = []
    for block in BLOCK.finditer(text):
        notes = [note for note in (block["notes"] or "").split("; ") if note]
        if any(note.startswith("never, ") for note in notes):
            continue
        is_set_up = "set-up" in notes
        changes = [note for note in notes if note != "set-up"]
        first = text.count("\n", 0, block.start("body")) + 1
        for number, printed in enumerate(block["body"].splitlines(), first):
            command, _, remark = re.sub(r"(^|\s+)#", "\0", printed, count=1).partition("\0")
            if command.strip():
                found.append(Command(page, number, smaller(command.strip(), changes), is_set_up,
                                     "until Ctrl-C" in remark))
    return found


class Reader:
    """Runs commands in `folder`; `inside` is what a command is put behind to run in another system, where the
    folder has the name `folder_inside`."""

    def __init__(self, folder, inside=(), folder_inside=None):
        self.folder, self.inside = pathlib.Path(folder), list(inside)
        self.folder_inside = folder_inside or self.folder

    def make_own(self, text):
        """What a command takes as its reader's own."""
        for name in sorted(set(re.findall(r"[\w.]+", text)) & OWN.keys()):
            if (self.folder / name).exists():
                continue
            if callable(OWN[name]):
                OWN[name](self.folder / name)
            elif fault := self.execute(OWN[name]):
                raise RuntimeError(f"{OWN[name]}: {fault}")

    def run(self, command):
        """What went wrong; nothing if all went well."""
        self.make_own(command.text)
        return self.execute(command.text, command.is_endless)

    def execute(self, text, is_endless=False):
        """The same of a bare command."""
        line = f"set -e; cd {shlex.quote(str(self.folder_inside))}; {'exec ' if is_endless else ''}{text}"
        process = subprocess.Popen([*self.inside, "bash", "-c", line], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   errors="replace",
                                   preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
        try:
            said, _ = process.communicate(timeout=SHOWS_S if is_endless else TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT if is_endless else signal.SIGKILL)
            said = self.wait_for_end(process)
        else:
            if is_endless:
                return f"ended by itself:\n{said}"
        return "" if process.returncode == 0 else f"status {process.returncode}:\n{said[-4000:]}"

    @staticmethod
    def wait_for_end(process):
        try:
            return process.communicate(timeout=60)[0]
        except subprocess.TimeoutExpired:
            process.kill()
            return "does not stop\n" + process.communicate()[0]


def main():
    parser = argparse.ArgumentParser(description="Runs the command blocks of pages, set-up included.")
    parser.add_argument("pages", nargs="+", help="relative to the folder")
    parser.add_argument("--folder", type=pathlib.Path, required=True, help="a clone of the tree")
    parser.add_argument("--root", type=pathlib.Path, help="a system's root around it, to run in")
    arguments = parser.parse_args()
    inside, name = [], arguments.folder
    if arguments.root:
        inside, name = ["chroot", arguments.root], "/" / arguments.folder.relative_to(arguments.root)
    reader, failed = Reader(arguments.folder, inside, name), 0
    for page in arguments.pages:
        for command in commands_of(page, (arguments.folder / page).read_text()):
            start = time.monotonic()
            fault = reader.run(command)
            failed += bool(fault)
            print(f"{page}:{command.line}: {'FAILED' if fault else 'ok'}, {time.monotonic() - start:.0f} s: "
                  f"{command.text}{chr(10) + fault if fault else ''}", flush=True)
    if failed:
        sys.exit(f"{failed} commands failed")


if __name__ == "__main__":
    main()
