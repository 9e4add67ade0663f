"""What an operator has: vog status, vog replay --live, vog log record, cut and merge, vog spy."""

import fcntl
import json
import os
import pathlib
import pty
import shutil
import signal
import subprocess
import termios
import time
import unittest
import zipfile

from vog_testing import BIN, VogTest, catches, config, free_url, may_mount, vog

LCM_JARS = (*map(pathlib.Path, os.environ.get("CLASSPATH", "").split(":")),
            pathlib.Path("/usr/share/java/lcm.jar"))
HAS_JDK = (all(map(shutil.which, ("javac", "jar", "lcm-gen")))
           and any(jar.name == "lcm.jar" and jar.exists() for jar in LCM_JARS))


class OperateTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        flown = cls.scratch / "flown"
        done = vog("mission", config("propeller"), "--max-submaps", "1", "--out", flown)
        assert done.returncode == 0, done.stderr
        cls.log = flown / "lcm.log"

    def setUp(self):
        self.url = free_url()
        self.folder = self.scratch / self._testMethodName
        self.folder.mkdir()

    def start(self, *arguments, wrap=(), **options):
        process = subprocess.Popen([*wrap, BIN / "vog", *map(str, arguments), "--url", self.url],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   **options)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def end(self, process):
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, errors)
        return out, errors

    def wait_for(self, what, limit_s=60):
        end = time.monotonic() + limit_s
        while not what():
            self.assertLess(time.monotonic(), end, "waited too long")
            time.sleep(0.02)

    def counts(self, log):
        return {channel: found["messages"] for channel, found in
                json.loads(self.run_vog("log", "info", log, "--json")).items()}

    # vog log record, vog replay --live

    def record(self, *arguments, **options):
        recorder = self.start("log", "record", "--out", self.folder / "x.log", *arguments, **options)
        self.wait_for(lambda: catches(recorder.pid, signal.SIGINT))
        return recorder

    def test_what_is_played_is_recorded(self):
        recorder = self.record("--channels", "inputs")
        start = time.monotonic()
        self.run_vog("replay", self.log, "--live", "--speed", "4", "--from", "2", "--to", "10",
                     "--channels", "VEHICLE_NAV|RUN|STATUS|DVL", "--url", self.url)
        took_s = time.monotonic() - start
        self.assertGreater(took_s, 1.9)
        self.assertLess(took_s, 20)
        out, _ = self.end(recorder)
        cut = self.folder / "cut.log"
        self.run_vog("log", "cut", self.log, "--from", "2", "--to", "10", "--channels",
                     "VEHICLE_NAV|RUN", "--out", cut)
        self.assertEqual(self.counts(self.folder / "x.log"), self.counts(cut))
        self.assertEqual(out, f"{sum(self.counts(cut).values())} messages kept\n")
        self.refuse(2, "log", "record", "--out", self.folder / "x.log", says=["is there already"])

    def test_an_endless_replay_goes_on_until_it_is_stopped(self):
        recorder = self.record()
        player = self.start("replay", self.log, "--live", "--speed", "10", "--to", "1", "--loop",
                            "--channels", "VEHICLE_NAV")
        time.sleep(1.5)
        self.end(player)
        self.end(recorder)
        once = self.folder / "once.log"
        self.run_vog("log", "cut", self.log, "--to", "1", "--channels", "VEHICLE_NAV", "--out", once)
        recorded = self.counts(self.folder / "x.log")
        self.assertEqual(set(recorded), {"VEHICLE_NAV"})  # And no bus's test of itself.
        self.assertGreater(recorded["VEHICLE_NAV"], 2 * self.counts(once)["VEHICLE_NAV"])

    def test_keys_on_a_terminal(self):
        controller, terminal = pty.openpty()
        self.addCleanup(os.close, controller)
        player = self.start("replay", self.log, "--live", stdin=terminal, start_new_session=True,
                            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
        os.close(terminal)
        os.set_blocking(player.stderr.fileno(), False)
        said = ""

        def shows(text):
            nonlocal said
            try:
                said += os.read(player.stderr.fileno(), 65536).decode()
            except BlockingIOError:
                pass
            return text in said.rsplit("\r", 1)[-1]

        self.wait_for(lambda: shows("x 1 "))
        os.write(controller, b"+++")
        self.wait_for(lambda: shows("x 2 "))
        os.write(controller, b" ")
        self.wait_for(lambda: shows("paused"))
        position_s = float(said.rsplit("\r\033[K", 1)[-1].split(" s")[0])
        os.write(controller, b"\033[C")
        self.wait_for(lambda: shows(f"{position_s + 10:.1f} s"))
        os.write(controller, b"s")
        os.write(controller, b" ")
        self.wait_for(lambda: not shows("paused"))
        os.write(controller, b"q")
        self.assertEqual(player.wait(timeout=30), 0)

    def test_rotation(self):
        recorder = self.record("--max-mb", "0.01", "--keep", "3")
        self.run_vog("replay", self.log, "--live", "--speed", "20", "--url", self.url)
        self.end(recorder)
        files = sorted(self.folder.glob("x.log.*"))
        self.assertEqual(len(files), 3)
        self.assertGreater(int(files[-1].suffix[1:]), 3)
        for file in files[:-1]:
            self.assertGreaterEqual(file.stat().st_size, 10_000)
        merged = self.folder / "merged.log"
        self.run_vog("log", "merge", *files, "--out", merged)
        self.assertEqual(sum(self.counts(merged).values()),
                         sum(sum(self.counts(file).values()) for file in files))
        self.refuse(2, "log", "merge", *files, "--out", files[0], says=["is read"])
        self.refuse(2, "log", "record", "--out", "y", "--keep", "3", says=["--max-mb"])

    @unittest.skipUnless(may_mount(), "needs root")
    def test_a_full_disk_is_said_once_and_recording_goes_on_when_there_is_room(self):
        mount = f"mount -t tmpfs -o size=1536k none '{self.folder}' && exec \"$@\""
        recorder = self.record(wrap=("unshare", "-m", "sh", "-c", mount, "sh"))
        disk = pathlib.Path(f"/proc/{recorder.pid}/root{self.folder}")
        filler = disk / "filler"
        filler.write_bytes(b"x" * 1_500_000)
        player = self.start("replay", self.log, "--live", "--speed", "10", "--loop")
        self.assertIn("Messages are left out", recorder.stderr.readline())
        time.sleep(2)
        filler.unlink()
        self.assertIn("recording goes on in", recorder.stderr.readline())
        time.sleep(2)  # It hears more, and hands it to the system.
        self.end(player)
        copies = self.scratch / "copies"
        shutil.copytree(disk, copies)
        out, errors = self.end(recorder)
        self.assertEqual(errors, "")
        self.assertRegex(out, "^[1-9][0-9]* messages kept\n$")
        self.assertEqual(sorted(file.name for file in copies.iterdir()), ["x.log", "x.log.000"])
        self.assertGreater(sum(self.counts(copies / "x.log.000").values()), 0)

    @unittest.skipUnless(may_mount(), "needs root")
    def test_on_a_full_disk_the_oldest_file_goes_where_that_is_allowed(self):
        mount = f"mount -t tmpfs -o size=4m none '{self.folder}' && exec \"$@\""
        recorder = self.record("--max-mb", "1.2", "--keep", "99",
                               wrap=("unshare", "-m", "sh", "-c", mount, "sh"))
        disk = pathlib.Path(f"/proc/{recorder.pid}/root{self.folder}")
        player = self.start("replay", self.log, "--live", "--speed", "50", "--loop")
        self.assertIn("Messages are left out", recorder.stderr.readline())
        self.assertIn("x.log.000 is removed to make room", recorder.stderr.readline())
        self.assertIn("recording goes on in", recorder.stderr.readline())
        self.wait_for(lambda: "x.log.006" in os.listdir(disk))
        self.end(player)
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=60)
        self.assertEqual(recorder.returncode, 0)

    def test_refusals(self):
        for arguments, says in (
                (["replay", self.log], "--out"),
                (["replay", self.log, "--out", "x", "--live"], "--out"),
                (["replay", self.log, "--out", "x", "--from", "3"], "--live"),
                (["replay", self.log, "--live", "--speed", "0"], "--speed"),
                (["replay", self.log, "--live", "--channels", "("], "regular expression"),
                (["replay", self.log, "--live", "--from", "1e6"], "no message"),
                (["replay", self.scratch / "nosuch.log", "--live"], "nosuch.log"),
                (["log", "cut", self.log, "--out", self.log], "is read"),
                (["log", "record", "--out", self.folder / "y", "--channels", "["], "regular")):
            with self.subTest(arguments):
                self.refuse(2, *arguments, says=[says])
        self.refuse(1, "log", "record", "--out", "/nosuch/y", says=["/nosuch/y"])

    # vog status

    def test_status_of_a_played_run(self):
        self.refuse(1, "status", "--once", "--url", self.url, says=["nothing is heard", self.url])
        self.start("replay", self.log, "--live", "--loop")
        seen = json.loads(self.run_vog("status", "--once", "--json", "--url", self.url))
        self.assertIn("vog-slam", seen["processes"])
        self.assertFalse(seen["processes"]["vog-slam"]["silent"])
        self.assertIn("received", seen["processes"]["vog-slam"]["counters"])
        self.assertGreater(seen["channels"]["VEHICLE_NAV"]["rate_hz"], 5)
        self.assertLess(seen["channels"]["VEHICLE_NAV"]["rate_hz"], 40)
        text = self.run_vog("status", "--once", "--url", self.url)
        self.assertRegex(text, r"vog-map-service +ok")
        self.assertRegex(text, r"map +0 submaps")
        self.assertNotIn("\033", text)

    def test_status_of_a_deputy_and_silence(self):
        table = self.folder / "t.pmd"
        table.write_text('cmd "a" { exec = "sleep 1000"; }\n'
                         'cmd "b" { exec = "sh -c \'exit 3\'"; }\nscript "start" { start everything; }')
        launcher = self.start("launch", table, "--deputy", "me", "--output", self.folder / "out")
        status = self.start("status", "--json")

        def line_that(says):
            for line in status.stdout:
                seen = json.loads(line)
                if says(seen):
                    return seen["deputies"]["me"]
            self.fail("never said")

        deputy = line_that(lambda seen: seen["deputies"].get("me", {}).get("commands", {}).get(
            "b", {}).get("exit_status") == 3 << 8)
        self.assertEqual(deputy["commands"]["b"]["state"], "exit status 3")
        self.assertGreater(deputy["commands"]["a"]["pid"], 0)
        self.end(launcher)
        line_that(lambda seen: seen["deputies"]["me"]["silent"])
        self.end(status)

    # vog spy

    def spy(self, **variables):
        return subprocess.run([BIN / "vog", "spy", "--jar"], capture_output=True, text=True,
                              env={**os.environ, "XDG_CACHE_HOME": str(self.folder), **variables})

    @unittest.skipUnless(HAS_JDK, "needs a JDK and liblcm-java")
    def test_spys_types_are_compiled_once(self):
        done = self.spy()
        self.assertEqual(done.returncode, 0, done.stderr)
        jar = pathlib.Path(done.stdout.strip())
        names = zipfile.ZipFile(jar).namelist()
        self.assertIn("vog/status_t.class", names)
        self.assertIn("bot_procman/info2_t.class", names)
        self.assertEqual(os.listdir(jar.parent), [jar.name])
        made = jar.stat().st_mtime_ns
        self.assertEqual(self.spy(PATH="/nosuch").stdout, done.stdout)
        self.assertEqual(jar.stat().st_mtime_ns, made)

    def test_spy_names_the_package_that_is_missing(self):
        done = self.spy(PATH="/nosuch", JAVA_HOME="")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr, "vog: lcm-spy needs the program lcm-gen; on Debian: apt-get "
                                      "install liblcm-bin\n")


if __name__ == "__main__":
    unittest.main()
