"""What goes wrong around a mission under way: lost packets, set clocks, second instances, a lost bottom.
What goes wrong on its wires: wire_test.py."""

import os
import pathlib
import shutil
import signal
import subprocess
import time
import unittest

from lcm_testing import import_types, read_log
from vog_testing import BIN, TIMEOUT_S, LiveMissionTest, children_of, config, may_mount

SUBMAPS = 6
PROGRAMS = ("vog-sim", "vog-planner", "vog-controller", "vog-slam", "vog-map-service",
            "vog-sonar-reader", "vog-nav-bridge")
FAKETIME = next(pathlib.Path("/usr/lib").glob("*/faketime/libfaketime.so.1"), None)

# Between LCM and the kernel: every tenth datagram from the bus is lost, that is, cut too short for
# LCM. Waiting for the next one instead would keep LCM's thread from ending.
LOSSY = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/socket.h>
ssize_t recvmsg(int socket, struct msghdr* message, int flags) {
  static ssize_t (*receive)(int, struct msghdr*, int);
  static unsigned seed;
  if (!receive) receive = (ssize_t(*)(int, struct msghdr*, int))dlsym(RTLD_NEXT, "recvmsg");
  ssize_t size = receive(socket, message, flags);
  int type = 0;
  socklen_t type_size = sizeof(type);
  getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &type_size);
  return size > 0 && type == SOCK_DGRAM && rand_r(&seed) % 10 == 0 ? 1 : size;
}
"""


class FaultsTest(LiveMissionTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.vog = import_types(cls.scratch)

    def start(self, *settings, **environment):
        self.out = self.scratch / self._testMethodName
        mission = self.start_mission(self.out, SUBMAPS, *settings, **environment)
        self.addCleanup(mission.wait)
        self.addCleanup(mission.kill)
        return mission

    def wait_for_submaps(self, mission, count):
        self.wait_for(lambda: self.saved_submaps(self.out) >= count, mission)

    def finish(self, mission):
        """Ends well, with a whole and right map; returns what was said on standard error."""
        _, errors = mission.communicate(timeout=TIMEOUT_S)
        self.assertEqual(mission.returncode, 0, errors)
        metrics = self.metrics(self.out)
        self.assertEqual(metrics["end_reason"], "max_submaps")
        self.assertGreaterEqual(metrics["submaps"], SUBMAPS)
        self.assertEqual(metrics["collisions"], 0)
        self.assertLess(metrics["rmse_m"]["vog"], 0.15)
        self.assertRegex(self.run_vog("map", "info", self.out / "map"), r"complete +true")
        return errors

    def messages(self, channel, kind):
        for _, name, content in read_log(self.out / "lcm.log"):
            if name == channel:
                yield getattr(self.vog, kind).decode(content)

    def healths(self, process):
        return {status.health for status in self.messages("STATUS", "status_t")
                if status.process == process}

    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler")
    def test_every_tenth_packet_lost(self):
        source, library = self.scratch / "lossy.c", self.scratch / "lossy.so"
        source.write_text(LOSSY)
        subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True)
        # The simulator goes on although a command was lost.
        mission = self.start("--set", "live.max_ahead_s=1", "--set", "live.stall_s=0.2",
                             LD_PRELOAD=str(library))
        self.finish(mission)
        missed = {}
        for status in self.messages("STATUS", "status_t"):
            missed[status.process] = {c.name: c.value for c in status.counter}["missed"]
        for process in "vog-planner", "vog-slam", "vog-map-service":
            self.assertGreater(missed[process], 10, "nothing was lost")

    @unittest.skipUnless(FAKETIME, "needs libfaketime")
    def test_the_machines_clock_is_set_an_hour_on_and_back(self):
        clock = self.scratch / "clock"
        clock.write_text("+0\n")
        mission = self.start(LD_PRELOAD=str(FAKETIME), FAKETIME_TIMESTAMP_FILE=str(clock),
                             FAKETIME_NO_CACHE="1", DONT_FAKE_MONOTONIC="1",
                             FAKETIME_DONT_FAKE_MONOTONIC="1", NO_FAKE_STAT="1")
        # Who is started again begins with the new clock.
        for submaps, offset_s, victim in (1, 3600, "vog-slam"), (3, -3600, "vog-planner"):
            self.wait_for_submaps(mission, submaps)
            clock.write_text(f"{offset_s:+d}\n")
            time.sleep(1)
            os.kill(children_of(mission.pid)[victim], signal.SIGKILL)
        errors = self.finish(mission)
        self.assertIn("vog-slam: killed", errors)
        self.assertIn("vog-planner: killed", errors)

    def test_second_instances_do_not_start(self):
        mission = self.start()
        self.wait_for_submaps(mission, 1)
        for program in PROGRAMS:
            second = subprocess.run(
                [BIN / program, "--config", config("propeller"), "--set", f"bus.url='{self.url}'",
                 "--set", f"map.directory='{self.scratch / 'second'}'"],
                capture_output=True, text=True, timeout=30)
            self.assertEqual(second.returncode, 1, program)
            self.assertRegex(second.stderr, f"^{program}: one runs already on the bus .*\n$")
        self.assertFalse((self.scratch / "second").exists())
        self.assertEqual(self.finish(mission), "")

    def test_the_bottom_lost_for_a_minute(self):
        """Nothing is mapped meanwhile; afterwards the map finds its place, and knows how well."""
        self.out = self.scratch / "lost"
        self.run_vog("mission", config("propeller"), "--seed", 1, "--max-submaps", 20, "--out", self.out,
                     "--set", "navigation.source=instruments", "--set", "simulation.navigation=sensors",
                     "--set", "navigation_faults.lock_lost_at_s=100", "--set",
                     "navigation_faults.lock_lost_s=60")
        metrics = self.metrics(self.out)
        self.assertEqual(metrics["submaps"], 20)
        self.assertEqual(metrics["collisions"], 0)
        self.assertLess(metrics["rmse_m"]["vog"], 0.15)
        self.assertLess(metrics["position_error_m"]["estimate"]["mean"],
                        metrics["position_error_m"]["odometry"]["mean"])
        self.assertLess(metrics["nees_per_dimension"], 3)
        self.assertIn("no bottom lock", self.healths("vog-nav-bridge"))
        scans = [message.header.utime_us for message in self.messages("NAV", "nav_t")]
        gap_s = max(b - a for a, b in zip(scans, scans[1:])) * 1e-6
        self.assertGreater(gap_s, 55)
        self.assertLess(gap_s, 62)

    @unittest.skipUnless(may_mount(), "needs root")
    def test_a_full_disk_is_survived_and_the_mission_not_judged(self):
        """The map is whole once there is room again; a log with gaps is no judge."""
        self.out = self.scratch / "full"
        self.out.mkdir()
        mount = f"mount -t tmpfs -o size=64m none '{self.out}' && exec \"$@\""
        mission = self.start_mission(self.out, SUBMAPS, wrap=("unshare", "-m", "sh", "-c", mount, "sh"))
        self.addCleanup(mission.wait)
        self.addCleanup(mission.kill)
        disk = pathlib.Path(f"/proc/{mission.pid}/root{self.out}")
        self.wait_for(lambda: self.saved_submaps(disk) >= 1, mission)
        with self.assertRaises(OSError), (disk / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(b"x" * 65536)
        self.assertIn("Messages are left out until there is room", mission.stderr.readline())
        time.sleep(2)
        (disk / "filler").unlink()
        # Its last line, in the same second as it unmounts the disk.
        keeper = os.open(disk, os.O_RDONLY)
        self.addCleanup(os.close, keeper)
        _, errors = mission.communicate(timeout=TIMEOUT_S)
        self.assertEqual(mission.returncode, 1, errors)
        self.assertIn("recording goes on in", errors)
        self.assertRegex(errors.splitlines()[-1],
                         "lcm.log: the disk was full: [1-9][0-9]* messages are missing, so the mission is not judged")
        kept = pathlib.Path(f"/proc/self/fd/{keeper}")
        self.assertFalse((kept / "metrics.json").exists())
        self.assertFalse([file for file in kept.rglob("*") if file.suffix == ".tmp"])
        copy = self.scratch / "kept"
        shutil.copytree(f"{kept}/", copy)
        self.assertRegex(self.run_vog("map", "info", copy / "map"), r"complete +true")
        self.run_vog("log", "merge", copy / "lcm.log", copy / "lcm.log.000", "--out", copy / "all.log")


if __name__ == "__main__":
    unittest.main()
