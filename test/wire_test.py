"""Missions through the wire: Bluefin's sentences on a serial line, a DIDSON's datagrams; good days and
bad ones."""

import os
import signal
import socket
import subprocess
import time
import unittest

from lcm_testing import import_types, log_end_s, read_log
from vog_testing import BIN, IS_SANITIZED, TIMEOUT_S, VogTest, children_of, config, free_url
from wire_relay import DatagramRelay, SerialRelay

SPEED = 2 if IS_SANITIZED else 8
# Of the vehicle's time, that a fault lasts.
PULLED_S, SILENT_S = 10, 30


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class WireTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.vog = import_types(cls.scratch)

    def start(self, out, submaps, *settings, relays=False):
        self.device, reader = self.scratch / f"{out}-sim", self.scratch / f"{out}-reader"
        self.sonar_from, sonar_to = free_port(), free_port()
        links = []
        if relays:
            links = [SerialRelay(self.device, reader), DatagramRelay(self.sonar_from, sonar_to)]
            for link in links:
                self.addCleanup(link.close)
        mission = subprocess.Popen(
            [BIN / "vog", "mission", config("propeller-wire"), "--live", "--speed", str(SPEED),
             "--max-submaps", str(submaps), "--out", self.scratch / out, "--set",
             f"bus.url='{free_url()}'",
             f"sim_vehicle_link.url='pty:{self.device}'",
             f"vehicle_link.url='serial:{reader if relays else self.device}?baud=115200'",
             f"sim_sonar_link.url='udp:{free_port()}?peer=127.0.0.1:"
             f"{self.sonar_from if relays else sonar_to}'",
             f"sonar_link.url='udp:{sonar_to}'", *settings],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        return mission, links

    def finish(self, mission):
        _, errors = mission.communicate(timeout=TIMEOUT_S)
        self.assertEqual(mission.returncode, 0, errors)

    def messages(self, out, channel, kind):
        for _, name, content in read_log(self.scratch / out / "lcm.log"):
            if name == channel:
                yield getattr(self.vog, kind).decode(content)

    def statuses(self, out, process):
        """[(health, counters)] as the process told them."""
        return [(status.health, {counter.name: counter.value for counter in status.counter})
                for status in self.messages(out, "STATUS", "status_t")
                if status.process == process]

    def most(self, out, process, counter):
        return max(counters[counter] for _, counters in self.statuses(out, process))

    def test_a_mission_through_the_wire_loses_nothing(self):
        mission, _ = self.start("clean", 3)
        self.finish(mission)
        metrics = self.metrics(self.scratch / "clean")
        self.assertLess(metrics["rmse_m"]["vog"], 0.1)
        self.assertEqual(metrics["collisions"], 0)
        self.assertEqual(metrics["submaps"], 3)
        for counter in ("link_dropped", "frames_incomplete", "datagrams_lost",
                        "datagrams_malformed", "other_windows"):
            self.assertEqual(self.most("clean", "vog-sonar-reader", counter), 0, counter)
        for counter in ("rejected_sentences", "garbage_bytes"):
            self.assertEqual(self.most("clean", "vog-nav-bridge", counter), 0, counter)
        # What was said before the simulator was there is lost.
        dropped = [counters["link_dropped"] for health, counters in
                   self.statuses("clean", "vog-nav-bridge") if health == "ok"]
        self.assertEqual(dropped[0], dropped[-1])
        self.assertEqual(self.most("clean", "vog-sim", "rejected_sentences"), 0)

    def wait_until(self, out, mission, time_s):
        """Until the log under way tells of that time of the vehicle."""
        end = time.monotonic() + 300
        log = self.scratch / out / "lcm.log"
        while log_end_s(log) < time_s:
            self.assertIsNone(mission.poll(), "the mission ended early")
            self.assertLess(time.monotonic(), end, "the vehicle's time does not go on")
            time.sleep(0.2)

    def test_a_bad_day_is_survived_and_told(self):
        out, submaps = "bad", 6
        mission, (serial, sonar) = self.start(out, submaps, relays=True)
        # Noise on both wires for the whole mission.
        serial.garbage, serial.damage, serial.repeat = 0.02, 0.02, 0.02
        sonar.loss, sonar.repeat, sonar.swap, sonar.garbage = 0.005, 0.01, 0.02, 0.01
        self.wait_until(out, mission, 20)
        serial.pulled = True
        time.sleep(PULLED_S)  # Without commands the simulator's time is real time.
        serial.pulled = False
        self.wait_until(out, mission, 50)
        sonar.silent = True
        self.wait_until(out, mission, 50 + SILENT_S)
        sonar.silent = False
        self.wait_until(out, mission, 90)
        for program in ("vog-nav-bridge", "vog-sonar-reader"):
            os.kill(children_of(mission.pid)[program], signal.SIGKILL)
            time.sleep(1)
        self.finish(mission)
        metrics = self.metrics(self.scratch / out)
        self.assertEqual(metrics["collisions"], 0)
        self.assertGreaterEqual(metrics["submaps"], submaps)
        self.assertLess(metrics["rmse_m"]["vog"], 0.15)
        bridge, reader = (self.statuses(out, name) for name in
                          ("vog-nav-bridge", "vog-sonar-reader"))
        self.assertIn("no navigation", [health for health, _ in bridge])
        self.assertIn("no sonar", [health for health, _ in reader])
        self.assertGreater(self.most(out, "vog-nav-bridge", "rejected_sentences"), 0)
        self.assertGreater(self.most(out, "vog-nav-bridge", "garbage_bytes"), 0)
        for counter in ("frames_incomplete", "datagrams_lost", "datagrams_twice",
                        "datagrams_malformed"):
            self.assertGreater(self.most(out, "vog-sonar-reader", counter), 0, counter)


if __name__ == "__main__":
    unittest.main()
