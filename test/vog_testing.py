"""What the tests that span rooms share: running `vog`, missions in scratch folders, free ports."""

import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = pathlib.Path(os.environ.get("VOG_BIN", ROOT / "build/bin"))
# Sanitized programs are slow: they fly shorter missions, judged by the same rules.
IS_SANITIZED = bool(os.environ.get("VOG_SANITIZE"))
INPUTS = "RUN|VEHICLE_NAV|DVL|IMU|DEPTH|SONAR_RETURNS|SONAR_FRAME|TRUTH"
TIMEOUT_S = 1500


def vog(*arguments, **options):
    """Runs vog; returns the finished process with its text."""
    return subprocess.run([BIN / "vog", *map(str, arguments)], capture_output=True, text=True,
                          timeout=TIMEOUT_S, **options)


def config(name):
    return ROOT / "config/mission" / f"{name}.toml"


def contents(folder):
    """All files below `folder`: name -> bytes."""
    return {file.relative_to(folder).as_posix(): file.read_bytes()
            for file in sorted(pathlib.Path(folder).rglob("*")) if file.is_file()}


def campaign_tables(folder):
    """A campaign's tables and its report, but for the planning times: what depends on the missions alone."""
    report = re.sub(r'<section id="timing".*?</section>', "", (folder / "campaign.html").read_text(),
                    flags=re.DOTALL)
    return [(folder / "campaign.json").read_text(), (folder / "campaign.txt").read_text(), report]


def free_url():
    """An LCM address that no other test uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return f"udpm://239.255.76.67:{probe.getsockname()[1]}?ttl=0"


def children_of(pid):
    """Running children: name -> pid."""
    found = {}
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        try:
            with open(f"/proc/{entry}/stat") as stat:
                fields = stat.read().rsplit(")", 1)[1].split()
            with open(f"/proc/{entry}/cmdline", "rb") as command:
                name = os.path.basename(command.read().split(b"\0")[0].decode())
        except (OSError, IndexError):
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found[name] = int(entry)
    return found


def catches(pid, number):
    """Whether a process handles a signal. Ours handle SIGINT from when they hear their bus."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt:"))
    return bool(int(caught.split()[1], 16) >> (number - 1) & 1)


def may_mount():
    """Whether a small disk can be made that nobody else sees."""
    return subprocess.run(["unshare", "-m", "mount", "-t", "tmpfs", "none", "/mnt"],
                          capture_output=True).returncode == 0


class VogTest(unittest.TestCase):
    """Gives each test class a scratch folder."""

    @classmethod
    def setUpClass(cls):
        cls.scratch = pathlib.Path(tempfile.mkdtemp(prefix="vog-test-"))
        cls.addClassCleanup(shutil.rmtree, cls.scratch, ignore_errors=True)

    def run_vog(self, *arguments):
        done = vog(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def refuse(self, status, *arguments, says=(), **options):
        """Expects one clear line on standard error and the exit status."""
        done = vog(*arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}: {done.stderr}")
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("vog: "), done.stderr)
        for text in says:
            self.assertIn(str(text), done.stderr)
        return done

    def metrics(self, folder):
        return json.loads((pathlib.Path(folder) / "metrics.json").read_text())


class LiveMissionTest(VogTest):
    """Missions of real processes over LCM, each test on a bus of its own."""

    SPEED = 8

    def setUp(self):
        self.url = free_url()

    def start_mission(self, out, submaps, *settings, wrap=(), **environment):
        return subprocess.Popen(
            [*wrap, BIN / "vog", "mission", config("propeller"), "--live", "--speed", str(self.SPEED),
             "--max-submaps", str(submaps), "--set", f"bus.url='{self.url}'", "--out", out, *settings],
            env={**os.environ, **environment}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def saved_submaps(self, out):
        return len(list(out.glob("map/submaps/*.ot")))

    def wait_for(self, what, process, limit_s=TIMEOUT_S):
        end = time.monotonic() + limit_s
        while not what():
            self.assertIsNone(process.poll(), "it ended early")
            self.assertLess(time.monotonic(), end, "waited too long")
            time.sleep(0.02)
