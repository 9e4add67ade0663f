"""The vehicle's link on a real CAN interface (vcan0): the links' tests, then the bridge and a
simulated vehicle, while the bus is disturbed. In this machine where its kernel has CAN, else in a
machine in QEMU. What was on the bus is read with a decoder of its own, not the program's."""

import collections
import math
import os
import re
import shutil
import subprocess
import unittest

from lcm_testing import import_types, read_log, write_log
from qemu_testing import Machine, NoMachine, tool, with_libraries
from vog_testing import BIN, IS_SANITIZED, ROOT, VogTest, config

LIMIT_S = 300
MODULES = ("can_raw", "vcan", "sch_tbf")
TOOLS = {"candump": "can-utils", "cansend": "can-utils", "cangen": "can-utils", "ip": "iproute2",
         "tc": "iproute2", "lcm-logger": "liblcm-bin", "lcm-logplayer": "liblcm-bin"}
PROGRAMS = ("link_test", "vog-nav-bridge", "vog-sim")
SCENARIO = ROOT / "test/can_scenario.sh"
SETTINGS = ("simulation.navigation=sensors", "navigation.source=instruments", "sonar.beams=8",
            "sonar.rate_hz=1", "sim_vehicle_link.url=can:vcan0", "sim_vehicle_link.protocol=can",
            "vehicle_link.url=can:vcan0", "vehicle_link.protocol=can",
            # The simulator goes on for 1 s of its time without a command, which is longer than the
            # bridge's watchdog waits, and then stands still.
            "live.speed=1", "live.max_ahead_s=1", "live.stall_s=600")

PERIOD_S = 0.1
# (begin, end, velocity, yaw rate) of the commands, by the vehicle's time; the second is too fast.
# After a pause another log has the third.
PHASES = ((1.2, 3.2, (0.2, 0, 0), 0.05), (3.2, 5.2, (3, 4, 0), -1), (7.2, 22.2, (0.1, 0, 0), 0))
TIMEOUT_S, MAX_SPEED_M_S, MAX_YAW_RATE_RAD_S = 0.5, 0.3, 0.2

Frame = collections.namedtuple("Frame", "time_s id extended kind data")
Message = collections.namedtuple("Message", "time_s name values")


def parse_dbc(text):
    """Identifier -> (name, size, [(signal, start, length, signed, scale, offset, low, high)])."""
    messages = {}
    for line in text.splitlines():
        if head := re.match(r"BO_ (\d+) (\w+): (\d+)", line):
            signals = []
            messages[int(head[1])] = (head[2], int(head[3]), signals)
        elif signal := re.match(r" SG_ (\w+) : (\d+)\|(\d+)@1([+-]) \((\S+),(\S+)\) \[(\S+)\|(\S+)\]",
                                line):
            signals.append((signal[1], int(signal[2]), int(signal[3]), signal[4] == "-",
                            *map(float, signal.groups()[4:])))
    return messages


def check_of(frame_id, data):
    """CRC-8H2F of the identifier and 7 bytes."""
    check = 0xFF
    for byte in frame_id.to_bytes(2, "little") + data[:7]:
        check ^= byte
        for _ in range(8):
            check = (check << 1 ^ (0x2F if check & 0x80 else 0)) & 0xFF
    return check ^ 0xFF


def decode(dbc, frame):
    """The message in a frame; None where it is damaged or says a number out of range."""
    name, size, signals = dbc[frame.id]
    if frame.kind != "classic" or len(frame.data) != size or frame.data[7] != check_of(frame.id,
                                                                                      frame.data):
        return None
    bits, values = int.from_bytes(frame.data, "little"), {}
    for signal, start, length, is_signed, scale, offset, low, high in signals:
        raw = bits >> start & (1 << length) - 1
        if is_signed and raw >> length - 1:
            raw -= 1 << length
        values[signal] = value = offset + scale * raw
        if not low - scale / 2 <= value <= high + scale / 2:
            return None
    return Message(frame.time_s, name, values)


def parse_candump(line):
    time_s, identifier, rest = re.match(r"\((\S+)\) vcan0 ([0-9A-F]+)#(.*)", line).groups()
    number, kind = int(identifier, 16), "classic"
    if rest.startswith("#"):
        kind, rest = "fd", rest[2:]
    elif rest.startswith("R"):
        kind, rest = "remote", ""
    if number & 0x20000000 and len(identifier) == 8:
        kind = "error"
    return Frame(float(time_s), number, len(identifier) == 8, kind, bytes.fromhex(rest))


def commands(lcm_types):
    """CONTROL as the controller would say it."""
    events = []
    for begin_s, end_s, velocity, yaw_rate in PHASES:
        for i in range(round((end_s - begin_s) / PERIOD_S)):
            message = lcm_types.control_t()
            message.header.utime_us = round(1e6 * (begin_s + PERIOD_S * i))
            message.header.epoch, message.header.sequence = 1, len(events)
            message.header.sender = "vog-controller"
            message.velocity_B_m_s, message.yaw_rate_rad_s = list(velocity), yaw_rate
            events.append((begin_s + PERIOD_S * i, "CONTROL", message))
    return events


def host_has_can():
    """Whether a network of our own can have a vcan interface."""
    if shutil.which("modprobe"):
        subprocess.run(["modprobe", "-a", "vcan", "can-raw"], capture_output=True)
    probe = "ip link add vcan0 type vcan && ip link set vcan0 up && candump -T 1 vcan0"
    return subprocess.run(["unshare", "--net", "sh", "-c", probe], capture_output=True).returncode == 0


def run_here(scratch, inputs):
    out = scratch / "out"
    out.mkdir()
    done = subprocess.run(["unshare", "--net", "--pid", "--fork", "--kill-child", "sh", SCENARIO, BIN,
                           inputs], cwd=out, capture_output=True, text=True, timeout=LIMIT_S)
    return done.returncode, out, done.stdout + done.stderr


def run_in_qemu(scratch, inputs):
    machine = Machine(scratch, MODULES)
    programs = [tool(name, package) for name, package in TOOLS.items()]
    files = with_libraries(programs + [BIN / name for name in PROGRAMS])
    files = {str(name).replace(str(BIN), "/bin-of-test", 1): content
             for name, content in files.items()}
    files["/inputs/can_scenario.sh"] = SCENARIO.read_bytes()
    files |= {f"/inputs/{file.name}": file.read_bytes() for file in inputs.iterdir()}
    status, out = machine.run(files, "/bin/sh /inputs/can_scenario.sh /bin-of-test /inputs", LIMIT_S)
    return status, out, machine.console.read_text(errors="replace")


class CanTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.types = import_types(cls.scratch / "types")
        inputs = cls.scratch / "inputs"
        inputs.mkdir()
        settings = [word for setting in SETTINGS for word in ("--set", setting)]
        (inputs / "run.toml").write_text(subprocess.run(
            [BIN / "vog", "config", config("mine"), *settings], check=True, capture_output=True,
            text=True).stdout)
        cls.sent = commands(cls.types)
        for name, is_late in (("control-1.log", False), ("control-2.log", True)):
            write_log(inputs / name, [event for event in cls.sent
                                      if (event[0] >= PHASES[2][0]) == is_late])
        try:
            for name, package in TOOLS.items():
                tool(name, package)
            if host_has_can():
                status, cls.out, words = run_here(cls.scratch, inputs)
            elif IS_SANITIZED:
                raise NoMachine("sanitized programs are too slow in an emulated machine")
            else:
                status, cls.out, words = run_in_qemu(cls.scratch, inputs)
        except NoMachine as reason:
            raise unittest.SkipTest(f"no CAN here, and no machine with it: {reason}") from None
        cls.addClassCleanup(shutil.rmtree, cls.out, ignore_errors=True)
        if keep := os.environ.get("VOG_KEEP"):
            shutil.copytree(cls.out, keep, dirs_exist_ok=True)
        if status != 0:
            raise AssertionError("the scenario failed:\n" + words[-4000:] + cls.said("bridge.txt")
                                 + cls.said("sim.txt"))
        cls.read_results()

    @classmethod
    def said(cls, name):
        file = cls.out / name
        return file.read_text(errors="replace") if file.is_file() else ""

    @classmethod
    def read_results(cls):
        cls.dbc = parse_dbc((ROOT / "hardware/nav_payload/vogmap.dbc").read_text())
        cls.frames = [parse_candump(line) for line in cls.said("can.log").splitlines()]
        cls.marks = {frame.data[0]: frame.time_s for frame in cls.frames
                     if frame.id == 0x7F0 and not frame.extended}
        cls.known = [frame for frame in cls.frames if frame.id in cls.dbc and not frame.extended]
        cls.messages = [message for frame in cls.known if (message := decode(cls.dbc, frame))]
        cls.heard = read_log(cls.out / "lcm.log")

    def on_bus(self, name):
        return [message for message in self.messages if message.name == name]

    def on_lcm(self, channel, kind):
        return [(time_s, kind.decode(data)) for time_s, name, data in self.heard if name == channel]

    def counters(self, process):
        """Of its last STATUS."""
        last = [status for _, status in self.on_lcm("STATUS", self.types.status_t)
                if status.process == process][-1]
        return {counter.name: counter.value for counter in last.counter}

    def commands_on_bus(self):
        """(time, answered [s], velocity, yaw rate)."""
        times, velocities = self.on_bus("COMMAND_TIME"), self.on_bus("VELOCITY_COMMAND")
        return [(b.time_s, 1e-6 * a.values["utime_us"],
                 [b.values[f"velocity_{axis}_B_m_s"] for axis in "xyz"], b.values["yaw_rate_rad_s"])
                for a, b in zip(times, velocities)]

    def test_the_links_own_tests_pass(self):
        text = self.said("link_test.txt")
        self.assertIn("[  PASSED  ]", text)
        self.assertNotIn("FAILED", text, text)
        skipped = set(re.findall(r"\[  SKIPPED \] (\w+\.\w+)$", text, re.MULTILINE))
        self.assertEqual(skipped, {"SocketCanLinkWithoutCanTest.IsRefusedWithAReason"}, text)
        self.assertGreater(text.count("[       OK ]"), 9)

    def test_nothing_complained(self):
        for name in ("bridge.txt", "sim.txt"):  # LCM warns of small buffers there.
            self.assertNotIn("vog-", self.said(name))
        self.assertNotIn("drop", self.said("candump.txt").lower())

    def test_all_records_are_on_the_bus_and_numbered(self):
        groups = {"DVL_TIME": 3, "IMU_TIME": 3, "DEPTH_TIME": 2, "NAV_TIME": 6, "COMMAND_TIME": 2,
                  "PAYLOAD_HEARTBEAT": 1}
        for first, size in groups.items():
            begin = next(number for number, (name, *_) in self.dbc.items() if name == first)
            for is_undisturbed, from_s, to_s in ((True, 0, self.marks[2]),
                                                 (False, self.marks[4], math.inf)):
                # Marks may come within a record: this one begins with the first whole one.
                start = next((i for i, frame in enumerate(self.known)
                              if frame.id == begin and frame.time_s > from_s), len(self.known))
                counters = []
                for part in range(begin, begin + size):
                    decoded = [decode(self.dbc, frame) for frame in self.known[start:]
                               if frame.id == part and frame.time_s < to_s]
                    self.assertNotIn(None, decoded, hex(part))
                    counters.append([int(message.values["counter"]) for message in decoded])
                whole = len(counters[-1])  # And the last record may be in part.
                self.assertLessEqual(len(counters[0]) - whole, 1, first)
                for others in counters:
                    self.assertEqual(others[:whole], counters[-1], first)
                if is_undisturbed:
                    self.assertGreater(whole, 0, first)
                    self.assertEqual(counters[-1], [i % 16 for i in range(whole)], first)

    def test_the_bridge_tells_what_the_bus_says(self):
        quiet_end = self.marks[2]
        for first, channel, kind, pairs in (
                ("DVL", "DVL", "dvl_t", [("DVL_VELOCITY", f"velocity_{axis}_B_m_s",
                                          lambda m, i=i: m.velocity_B_m_s[i])
                                         for i, axis in enumerate("xyz")]),
                ("IMU", "IMU", "imu_t", [("IMU_ATTITUDE", "roll_rad", lambda m: m.roll_rad),
                                         ("IMU_ATTITUDE", "pitch_rad", lambda m: m.pitch_rad)] +
                 [("IMU_RATES", f"rate_{axis}_B_rad_s",
                   lambda m, i=i: m.angular_velocity_B_rad_s[i]) for i, axis in enumerate("xyz")]),
                ("DEPTH", "DEPTH", "depth_t", [("DEPTH", "depth_m", lambda m: m.depth_m)])):
            told = {message.header.utime_us: message
                    for _, message in self.on_lcm(channel, getattr(self.types, kind))}
            times = [round(message.values["utime_us"]) for message in self.on_bus(f"{first}_TIME")
                     if message.time_s < quiet_end]
            self.assertGreater(len(times), 20, first)
            for name, signal, value in pairs:
                values = [message.values[signal] for message in self.on_bus(name)]
                for utime_us, on_bus in zip(times, values):
                    self.assertAlmostEqual(value(told[utime_us]), on_bus, places=9)

    def test_navigation_is_told_before_during_and_after(self):
        times = [time_s for time_s, _ in self.on_lcm("NAV", self.types.nav_t)]
        for begin, end in ((1, 2), (2, 3), (4, 5)):
            count = sum(self.marks[begin] < time_s < self.marks[end] for time_s in times)
            self.assertGreater(count, 20, f"between marks {begin} and {end}")

    def test_commands_are_on_the_bus_within_limits(self):
        sent = {message.header.utime_us: message for _, _, message in self.sent}
        checked = 0
        for _, answered_s, velocity, yaw_rate in self.commands_on_bus():
            self.assertLessEqual(math.hypot(*velocity), MAX_SPEED_M_S + 1e-3)
            self.assertLessEqual(abs(yaw_rate), MAX_YAW_RATE_RAD_S + 1e-3)
            wanted = sent.get(round(1e6 * answered_s))
            if not wanted or not any(velocity):
                continue
            speed = math.hypot(*wanted.velocity_B_m_s)
            cut = min(1, MAX_SPEED_M_S / speed)
            for asked, got in zip(wanted.velocity_B_m_s, velocity):
                self.assertAlmostEqual(cut * asked, got, delta=6e-4)
            limit = MAX_YAW_RATE_RAD_S
            self.assertAlmostEqual(max(-limit, min(limit, wanted.yaw_rate_rad_s)), yaw_rate,
                                   delta=3e-4)
            checked += 1
        # All but those of the outage.
        self.assertGreater(checked, len(self.sent) - 10 * (3 + 7))

    def test_the_vehicle_obeys(self):
        fixes = [message.values["velocity_x_B_m_s"] for message in self.on_bus("DVL_VELOCITY")]
        self.assertGreater(max(fixes), 0.15)
        self.assertAlmostEqual(sum(fixes[-5:]) / 5, 0, delta=0.05)

    def test_the_watchdog_stops_the_vehicle_when_commands_stop(self):
        stops = [answered_s for _, answered_s, velocity, yaw_rate in self.commands_on_bus()
                 if not any(velocity) and yaw_rate == 0]
        # After the outage commands are held until there is bottom lock again: they answer what was sent.
        sent = {message.header.utime_us for _, _, message in self.sent}
        held = [stop_s for stop_s in stops if round(1e6 * stop_s) in sent]
        counters = self.counters("vog-nav-bridge")
        self.assertLessEqual(len(held), counters["held_commands"])
        self.assertEqual(counters["watchdog_stops"], len(stops) - len(held))
        for end_s in (PHASES[1][1], PHASES[2][1]):
            since_last_s = [stop_s - (end_s - PERIOD_S) for stop_s in stops]
            self.assertTrue(any(TIMEOUT_S < since_s < TIMEOUT_S + 0.3 for since_s in since_last_s),
                            since_last_s)

    def test_garbage_is_counted_and_harmless(self):
        counters = self.counters("vog-nav-bridge")
        bad = sum(decode(self.dbc, frame) is None for frame in self.known)
        self.assertGreater(bad, 1900)
        self.assertEqual(counters["rejected_frames"], bad)
        self.assertEqual(self.counters("vog-sim")["rejected_frames"], bad)
        self.assertEqual(counters["malformed"], 0)
        self.assertEqual(counters["navigation_jumps"], 0)

    def test_an_outage_is_counted_and_ends(self):
        for process in ("vog-nav-bridge", "vog-sim"):
            counters = self.counters(process)
            # After the interface that went down and after the controller that was off.
            self.assertEqual(counters["link_reconnects"], 2, process)
            self.assertGreater(counters["link_dropped"], 0, process)
            # The interface, and cansend's two error frames.
            self.assertEqual(counters["link_errors"], 3, process)
        self.assertGreater(self.marks[4] - self.marks[3], 9)
        for name in ("IMU_TIME", "COMMAND_TIME"):
            first_s = min(message.time_s for message in self.on_bus(name)
                          if message.time_s > self.marks[4])
            self.assertLess(first_s - self.marks[4], 5.5, name)


if __name__ == "__main__":
    unittest.main(verbosity=2)  # Says why it is skipped.
