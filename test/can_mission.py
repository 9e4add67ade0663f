"""Five minutes of a mission over CAN, in a machine in QEMU where this one's kernel has no CAN.

    python3 test/can_mission.py --submaps 15 --out out/can-mission

Not among the tests: it takes ten minutes. All processes fly config/mission/propeller-wire.toml with the vehicle
on vcan0 and candump listening; then the same mission is flown here without a wire. Prints both metrics, the
frames that candump saw, and what bridge and reader counted.
"""

import argparse
import collections
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

from lcm_testing import import_types, read_log
from qemu_testing import Machine, tool, with_libraries
from vog_testing import BIN, config, free_url

PROGRAMS = ("vog", "vog-sim", "vog-nav-bridge", "vog-sonar-reader", "vog-map-service", "vog-slam",
            "vog-planner", "vog-controller")
COUNTED = {"vog-nav-bridge": ("rejected_frames", "stray_frames", "lost_records", "link_dropped", "link_errors"),
           "vog-sonar-reader": ("frames_incomplete", "datagrams_lost", "link_dropped")}
COMMAND = """ip link set lo up; ip link set lo multicast on; ip route add 239.0.0.0/8 dev lo
ip link add vcan0 type vcan; ip link set vcan0 up
candump -L -D -r 4194304 vcan0 >can.log 2>candump.txt &
{bin}/vog mission /in/mission.toml --live --speed 1 --seed 1 --max-submaps {submaps} --out run >vog.txt 2>&1
status=$?
kill %1
( exit $status )"""


def fly_in_machine(scratch, submaps):
    """The folder that the machine left."""
    settings = ["vehicle_link.url='can:vcan0'", "vehicle_link.protocol=can", "sim_vehicle_link.url='can:vcan0'",
                "sim_vehicle_link.protocol=can"]
    mission = subprocess.run([BIN / "vog", "config", config("propeller-wire"),
                              *(part for setting in settings for part in ("--set", setting))],
                             capture_output=True, text=True, check=True).stdout
    programs = [BIN / name for name in PROGRAMS]
    programs += [tool("candump", "can-utils"), tool("ip", "iproute2")]
    files = with_libraries(programs) | {"/in/mission.toml": mission.encode()}
    machine = Machine(scratch, ("can_raw", "vcan"), memory_mb=3072)
    status, folder = machine.run(files, COMMAND.format(bin=BIN, submaps=submaps), limit_s=3000)
    # That machine has no gnuplot: no report, which is made last.
    if status != 0 and not (folder / "run/metrics.json").exists():
        sys.exit(f"the mission failed: {(folder / 'vog.txt').read_text()[-2000:]}")
    return folder


def most_counted(log, types):
    most = collections.defaultdict(int)
    for _, channel, content in read_log(log):
        if channel != "STATUS":
            continue
        status = types.status_t.decode(content)
        for counter in status.counter:
            if counter.name in COUNTED.get(status.process, ()):
                key = f"{status.process} {counter.name}"
                most[key] = max(most[key], counter.value)
    return dict(most)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--submaps", type=int, default=15)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        types = import_types(pathlib.Path(scratch))
        folder = fly_in_machine(scratch, arguments.submaps)
        shutil.copytree(folder, arguments.out / "machine")
    direct = arguments.out / "direct"
    subprocess.run([BIN / "vog", "mission", config("propeller-wire"), "--live", "--speed", "8", "--seed", "1",
                    "--max-submaps", str(arguments.submaps), "--out", direct, "--set", f"bus.url='{free_url()}'",
                    *(part for link in ("vehicle_link", "sonar_link", "sim_vehicle_link", "sim_sonar_link")
                      for part in ("--set", f"{link}.url=''"))],
                   check=True, stdout=subprocess.DEVNULL)
    for name, run in ("CAN", arguments.out / "machine/run"), ("direct", direct):
        metrics = json.loads((run / "metrics.json").read_text())
        print(f"{name}: {metrics['submaps']} submaps, {metrics['scans']} scans, {metrics['vehicle_time_s']:.0f} s, "
              f"rmse_m {metrics['rmse_m']['vog']:.4f}, collisions {metrics['collisions']}, "
              f"end {metrics['end_reason']}")
    with open(arguments.out / "machine/can.log", "rb") as log:
        print(f"frames on the bus: {sum(1 for _ in log)}")
    print(most_counted(arguments.out / "machine/run/lcm.log", types))


if __name__ == "__main__":
    main()
