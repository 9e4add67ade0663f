"""vog launch: a whole system from a cold start, kills, its end, and what it refuses."""

import os
import re
import signal
import subprocess
import time
import unittest

from lcm_testing import Listener, port_of
from vog_testing import BIN, ROOT, VogTest, children_of, free_url

PROGRAMS = {"vog-sim", "vog-nav-bridge", "vog-sonar-reader", "vog-map-service", "vog-slam",
            "vog-planner", "vog-controller", "vog-viewer"}


class LaunchTest(VogTest):
    def setUp(self):
        self.url = free_url()
        self.out = self.scratch / self._testMethodName

    def write(self, text, name="t.pmd"):
        file = self.scratch / name
        file.write_text(text)
        return file

    def launch(self, file, *arguments):
        process = subprocess.Popen(
            [BIN / "vog", "launch", file, "--url", self.url, "--output", self.out, *arguments],
            stderr=subprocess.PIPE, text=True, env={**os.environ, "VOG_CONFIG": str(ROOT / "config")})
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def simulation(self):
        """config/launch/sim.pmd on this test's URL."""
        text = (ROOT / "config/launch/sim.pmd").read_text()
        url = f"bus.url=\\\"'{self.url}'\\\""
        text = text.replace("--set bus.clock=message", f"--set bus.clock=message {url}")
        text = text.replace("exec = \"vog-viewer", "exec = \"vog-viewer --set viewer.port=0")
        return self.write(text.replace('propeller.toml";', f'propeller.toml --set {url}";'))

    def wait_for(self, what, limit_s):
        start = time.monotonic()
        while not what():
            self.assertLess(time.monotonic() - start, limit_s, "waited too long")
            time.sleep(0.01)
        return time.monotonic() - start

    def end(self, process):
        """Ctrl-C; returns what it has said."""
        children = children_of(process.pid)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
        for name, pid in children.items():
            self.assertFalse(os.path.exists(f"/proc/{pid}"), name)
        return errors

    def test_a_simulation_starts_survives_kills_and_ends_clean(self):
        listener = Listener(port_of(self.url))
        self.addCleanup(listener.close)
        start = time.monotonic()
        process = self.launch(self.simulation())
        self.assertIsNotNone(listener.hear("PLAN", 60))
        print(f"from cold to the first PLAN: {time.monotonic() - start:.2f} s")
        slowest_s = 0
        for program in PROGRAMS - {"vog-sim"}:
            killed = children_of(process.pid)[program]
            os.kill(killed, signal.SIGKILL)
            back_s = self.wait_for(
                lambda: children_of(process.pid).get(program, killed) != killed, 20)
            slowest_s = max(slowest_s, back_s)
        print(f"back after kill -9: {slowest_s:.3f} s at most")
        self.assertEqual(set(children_of(process.pid)), PROGRAMS)
        time.sleep(2)  # They live.
        self.assertEqual(set(children_of(process.pid)), PROGRAMS)
        errors = self.end(process)
        self.assertEqual(process.returncode, 0, errors)
        self.assertEqual(errors.count("killed by Killed"), len(PROGRAMS) - 1)
        ends = re.findall(r"vog: (\S+): exit status 0", errors)
        self.assertEqual(ends, ["sim", "viewer", "controller", "planner", "slam", "map-service",
                                "sonar-reader", "nav-bridge"])
        self.assertEqual([file for file in self.out.rglob("*.tmp")], [])

    def test_a_second_one_of_the_same_name_is_refused(self):
        file = self.write('cmd "a" { exec = "sleep 1000"; }')
        first = self.launch(file)
        self.wait_for(lambda: "sleep" in children_of(first.pid), 30)
        second = self.launch(self.write('cmd "b" { exec = "sleep 1000"; }', "b.pmd"))
        _, errors = second.communicate(timeout=60)
        self.assertEqual(second.returncode, 1)
        self.assertRegex(errors, r'^vog: a deputy of the name ".*" runs already; [^\n]*\n$')
        third = self.launch(file, "--deputy", "another")
        self.wait_for(lambda: "sleep" in children_of(third.pid), 30)
        self.assertIn("sleep", children_of(first.pid))
        for process in (third, first):
            self.end(process)
            self.assertEqual(process.returncode, 0)

    def test_what_dies_again_and_again_is_given_up_and_the_rest_goes_on(self):
        process = self.launch(self.write("""
            cmd "good" { exec = "sleep 1000"; }
            cmd "loop" { exec = "sh -c 'echo why >&2; exit 3'"; auto_respawn = "true"; }"""))
        lines = []
        while not any("given up" in line for line in lines):
            lines.append(process.stderr.readline())
            self.assertNotEqual(lines[-1], "", lines)
        self.assertEqual(lines[-1], "vog: loop: given up: 20 quick deaths in a row\n")
        self.assertEqual(set(children_of(process.pid)), {"sleep"})
        self.assertEqual((self.out / "loop.txt").read_text(), "why\n" * 20)
        self.end(process)
        self.assertEqual(process.returncode, 0)

    def test_a_failed_start_leaves_nothing(self):
        for text, says in (
                ('cmd "b" { exec = "vog-nosuch"; auto_respawn = "true"; }',
                 "b: given up: vog-nosuch: no such program"),
                ('cmd "b" { exec = "vog-slam --config /nosuch.toml"; }', "b: exit status 2"),
                ('cmd "b" { exec = "sh $NO_SUCH_VARIABLE"; }', "NO_SUCH_VARIABLE")):
            with self.subTest(text):
                start = time.monotonic()
                process = self.launch(self.write('cmd "a" { exec = "sleep 1000"; }\n' + text))
                _, errors = process.communicate(timeout=60)
                self.assertEqual(process.returncode, 1)
                self.assertIn(says, errors.splitlines()[-1])
                self.assertIn(str(self.out), errors.splitlines()[-1])
                self.assertLess(time.monotonic() - start, 20)
                self.assertIn("vog: a: killed by Interrupt", errors)

    def test_a_deputy_alone_stops_what_it_was_ordered(self):
        sheriff = self.launch(self.write("""
            cmd "far" { exec = "sh -c 'trap \\"echo bye; exit 0\\" INT; while :; do sleep 0.1; done'";
                        host = "far"; }"""))
        deputy = subprocess.Popen([BIN / "vog", "launch", "--deputy", "far", "--url", self.url,
                                   "--output", self.out / "far"], stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: deputy.poll() is None and deputy.kill())
        self.wait_for(lambda: "sh" in children_of(deputy.pid), 30)
        time.sleep(0.5)  # Until its trap is set.
        self.end(deputy)
        self.assertEqual(deputy.returncode, 0)
        self.assertEqual((self.out / "far/far.txt").read_text(), "bye\n")
        self.end(sheriff)

    def test_kill_9_of_the_launcher_takes_all_with_it(self):
        process = self.launch(self.write('cmd "a" { exec = "sleep 1000"; }'))
        self.wait_for(lambda: "sleep" in children_of(process.pid), 30)
        child = children_of(process.pid)["sleep"]
        process.kill()
        process.communicate()
        self.wait_for(lambda: not os.path.exists(f"/proc/{child}"), 20)

    def test_validate(self):
        shown = self.run_vog("launch", ROOT / "config/launch/hauv.pmd", "--validate")
        self.assertIn('cmd "nav-bridge" {', shown)
        self.assertEqual(self.run_vog("launch", self.write(shown), "--validate"), shown)
        bad = self.write('cmd "a" {\n  exec = "x";\n  nice = "1";\n}\n', "bad.pmd")
        self.refuse(2, "launch", bad, "--validate", says=[f"{bad}:3", "nice", "known: exec"])
        self.refuse(2, "launch", bad, says=[f"{bad}:3"])
        self.refuse(2, "launch", self.scratch / "nosuch.pmd", says=["nosuch.pmd"])
        self.refuse(2, "launch", "--validate", says=["needs a file"])
        good = self.write('cmd "a" { exec = "x"; }')
        self.refuse(2, "launch", good, "--script", "nosuch", says=["nosuch"])


if __name__ == "__main__":
    unittest.main()
