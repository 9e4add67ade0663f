"""Bad input: one clear line, the right exit status, nothing half-written."""

import resource
import signal
import subprocess
import unittest

from vog_testing import BIN, VogTest, config, vog

PROPELLER = config("propeller")


class BadInputTest(VogTest):
    def refuse_mission(self, *arguments, says=()):
        out = self.scratch / "refused"
        done = self.refuse(2, "mission", *arguments, "--out", out, says=says)
        self.assertFalse(out.exists(), f"{arguments} left {out}")
        return done

    def write(self, name, text):
        file = self.scratch / name
        file.write_text(text)
        return file

    def test_settings(self):
        for setting, says in (
                ("planner.foo=1", ["planner.foo", "range_m"]),
                ("planer.range_m=1", ["planer", "planner"]),
                ("mission.seed=abc", ["mission.seed", "integer"]),
                ("sonar.max_range_m=0", ["sonar.max_range_m"]),
                ("sonar=3", ["sonar"]),
                ("scene.propelle.hub_radius_m=1", ["scene.propelle", "scene.propeller"]),
                ("nonsense", ["nonsense"])):
            with self.subTest(setting):
                self.refuse_mission(PROPELLER, "--set", setting, says=says)

    def test_files(self):
        bad = self.write("bad.toml", "[mission]\nname = 'x'\n\n[planner]\nrange_m = 'far'\n")
        self.refuse_mission(bad, says=[f"{bad}:5", "planner.range_m", "far"])
        self.refuse_mission(self.write("syntax.toml", "[mission\n"), says=["syntax.toml:1"])
        self.refuse_mission(self.write("loop.toml", 'include = ["loop.toml"]\n'),
                            says=["loop.toml"])
        self.refuse_mission(self.write("lost.toml", 'include = ["nosuch.toml"]\n'),
                            says=["nosuch.toml"])
        self.refuse_mission(self.scratch / "nosuch.toml", says=["nosuch.toml"])
        self.refuse_mission(self.scratch, says=[self.scratch])

    def test_scenes(self):
        self.refuse_mission(PROPELLER, "--scene", self.scratch / "no.stl", says=["no.stl"])
        empty = self.write("empty.stl", "solid x\nendsolid x\n")
        self.refuse_mission(PROPELLER, "--scene", empty, says=["empty.stl"])
        self.refuse_mission(PROPELLER, "--scene", self.write("noise.ply", "ply\nno header"),
                            says=["noise.ply"])

    def test_places(self):
        self.refuse_mission(PROPELLER, "--set", "simulation.start_position_m=[0,0,0]",
                            says=["inside an obstacle"])
        self.refuse_mission(PROPELLER, "--set", "simulation.start_position_m=[0,-30,0]",
                            says=["outside of the exploration box"])
        self.refuse_mission(PROPELLER, "--set", "exploration.min_m=[-0.1,-0.1,-0.1]", "--set",
                            "exploration.max_m=[0.1,0.1,0.1]", says=["fits nowhere"])
        self.refuse_mission(PROPELLER, "--set", "exploration.min_m=[9,-3.5,-1.75]",
                            says=["exploration.max_m"])

    def test_navigation_that_nobody_would_hear(self):
        self.refuse_mission(PROPELLER, "--set", "navigation.source=instruments",
                            says=["simulation.navigation"])
        self.refuse_mission(PROPELLER, "--set", "simulation.navigation=sensors",
                            says=["navigation.source"])

    def test_arguments(self):
        self.refuse(2, says=["--help"])
        self.refuse(2, "nosuch", says=["--help"])
        self.refuse(2, "mission", PROPELLER, says=["--out"])
        self.refuse(2, "mission", PROPELLER, "--out", self.scratch / "x", "--mode", "foo",
                    says=["foo", "vog-no-lc"])
        for command in ("mission", "campaign", "replay", "map", "graph", "log", "config", "report",
                        "sonar", "launch", "status", "spy"):
            self.assertIn("Usage", vog(command, "--help").stdout)

    def test_logs(self):
        text = self.write("text.log", "this is no log")
        self.refuse(2, "log", "info", text, says=["text.log", "not an LCM event log"])
        self.refuse(2, "log", "info", self.scratch / "no.log", says=["no.log"])
        self.refuse(2, "replay", text, "--out", self.scratch / "y", says=["text.log"])
        self.refuse(2, "log", "cut", text, "--channels", "(", "--out", self.scratch / "z",
                    says=["regular expression"])
        empty = self.write("empty.log", "")
        self.refuse(2, "replay", empty, "--out", self.scratch / "y", says=["RUN"])
        self.assertFalse((self.scratch / "y").exists())

    def test_unwritable_places(self):
        self.refuse(1, "mission", PROPELLER, "--out", "/proc/nosuch", says=["/proc/nosuch"])
        (self.scratch / "file").write_text("")
        self.refuse(1, "mission", PROPELLER, "--out", self.scratch / "file/x", says=["file/x"])

    def test_a_full_disk_is_told_and_leaves_a_map_that_loads(self):
        def small_disk():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000))

        out = self.scratch / "full"
        done = vog("mission", PROPELLER, "--max-submaps", 6, "--out", out, preexec_fn=small_disk)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn("disk full", done.stderr)
        self.assertFalse((out / "metrics.json").exists())
        if (out / "map").exists():
            self.run_vog("map", "info", out / "map")

    def test_processes_refuse_too(self):
        for program in ("vog-sim", "vog-slam", "vog-planner", "vog-controller", "vog-map-service",
                        "vog-nav-bridge", "vog-sonar-reader"):
            for arguments in (["--config", "nosuch.toml"], [], ["--nosuch"],
                              ["--config", PROPELLER, "--set", "planer.x=1"]):
                with self.subTest(f"{program} {arguments}"):
                    done = subprocess.run([BIN / program, *arguments], capture_output=True,
                                          text=True, timeout=60)
                    self.assertEqual(done.returncode, 2)
                    self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                    self.assertTrue(done.stderr.startswith(program), done.stderr)


if __name__ == "__main__":
    unittest.main()
