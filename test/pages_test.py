"""The command blocks of README and of "start in 5 minutes", run from the pages: those that need no set-up.
tools/check-docs runs all of them in a fresh Debian."""

import os
import pathlib
import unittest

from pages import Reader, commands_of
from vog_testing import ROOT, VogTest

PAGES = ("README.md", "docs/start.md")
BUILD = pathlib.Path(os.environ.get("VOG_BUILD", ROOT / "build"))


class PagesTest(VogTest):
    def folder(self, name):
        """What a clone looks like after set-up."""
        folder = self.scratch / name
        folder.mkdir()
        for entry in ROOT.iterdir():
            if entry.name not in ("build", "out", ".git"):
                (folder / entry.name).symlink_to(entry)
        (folder / "build").symlink_to(BUILD)
        return folder

    def test_commands_run_as_printed(self):
        reader, count = Reader(self.folder("clone")), 0
        for page in PAGES:
            for command in commands_of(page, (ROOT / page).read_text()):
                if command.is_set_up:
                    continue
                count += 1
                with self.subTest(f"{page}:{command.line}: {command.text}"):
                    self.assertEqual(reader.run(command), "")
        self.assertGreater(count, 45)

    def test_what_is_wrong_is_found(self):
        reader = Reader(self.folder("wrong"))
        text = ("```\nbuild/bin/vog misson x.toml\nfalse | true   # until Ctrl-C\nsleep 60   # until Ctrl-C\n"
                "build/bin/vog --version  # good\n```\n")
        faults = [reader.run(command) for command in commands_of("page", text)]
        self.assertIn("status 2", faults[0])
        self.assertIn("ended by itself", faults[1])
        self.assertIn("status -2", faults[2])  # It does not end well by Ctrl-C.
        self.assertEqual(faults[3], "")

    def test_notes_above_a_block(self):
        page = ("<!-- run: set-up -->\n```\ntools/setup  # why\n```\n"
                "<!-- run: never, it takes hours -->\n```\nvog campaign x\n```\n"
                "<!-- run: vog mission with --max-submaps 3; vog view with --port 0 -->\n"
                "```sh\nvog mission a --max-submaps 20 --seed 1\n# a remark\nvog mission b\nvog view a\n```\n"
                "```toml\n[mission]\n```\n")
        found = commands_of("page", page)
        self.assertEqual([(one.line, one.text, one.is_set_up) for one in found],
                         [(3, "tools/setup", True),
                          (11, "vog mission a --max-submaps 3 --seed 1", False),
                          (13, "vog mission b --max-submaps 3", False),
                          (14, "vog view a --port 0", False)])


if __name__ == "__main__":
    unittest.main()
