"""What bash offers after `vog ...` and Tab."""

import subprocess
import unittest

from vog_testing import BIN, ROOT

SCRIPT = ROOT / "tools/vog/completion.bash"


def offered(*words):
    """For the last word, as bash would call it."""
    quoted = " ".join(f"'{word}'" for word in (BIN / "vog", *words))
    # compopt works inside of a completion alone.
    program = (f"compopt() {{ :; }}; source '{SCRIPT}'; COMP_WORDS=({quoted}); COMP_CWORD={len(words)}; _vog;"
               ' printf "%s\\n" "${COMPREPLY[@]}"')
    done = subprocess.run(["bash", "-c", program], capture_output=True, text=True, timeout=60)
    return done.stdout.split(), done.stderr


class CompletionTest(unittest.TestCase):
    def expect(self, words, *wanted):
        found, errors = offered(*words)
        self.assertEqual(errors, "")
        self.assertEqual(found, list(wanted), words)

    def test_subcommands(self):
        self.expect(["mi"], "mission")
        self.expect(["map", "ray"], "raycast")
        self.expect(["graph", "opt"], "optimize")
        found, _ = offered("")
        self.assertIn("campaign", found)
        self.assertIn("replay", found)
        self.assertNotIn("A", found)

    def test_options(self):
        self.expect(["mission", "config/mission/tank.toml", "--max"], "--max-submaps")
        self.expect(["map", "build", "--z"], "--z-down")
        self.expect(["--ver"], "--version")

    def test_settings(self):
        self.expect(["mission", "x.toml", "--set", "planner.range"], "planner.range_m=")
        self.expect(["slam", "map", "--set", "scene.propeller.hub_r"], "scene.propeller.hub_radius_m=")

    def test_files_are_left_to_bash(self):
        self.expect(["mission", "config/mis"])


if __name__ == "__main__":
    unittest.main()
