"""A long mission of the real processes over LCM: does memory stay, are all maps the same?

    python3 test/endurance.py --hours 8 --speed 15 --out out/endurance

Not among the tests: eight hours of the vehicle's time take half an hour or more. Prints a table, a line an
hour of the vehicle's time: the resident memory of each process, and whether the maps of map service, SLAM
and planner have the same digest ("under way": one of them waits for the newest submap).
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

from vog_testing import BIN, children_of, config, free_url

SAMPLE_S = 3600
REPLICAS = "vog-map-service", "vog-slam", "vog-planner"


def resident_kb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1])
    return 0


def counters_now(url):
    """What each process counts, by its name."""
    told = subprocess.run([BIN / "vog", "status", "--once", "--json", "--url", url], capture_output=True,
                          text=True, timeout=60)
    return {name: process["counters"] for name, process in json.loads(told.stdout)["processes"].items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=8)
    parser.add_argument("--speed", type=float, default=15)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    url = free_url()
    mission = subprocess.Popen(
        [BIN / "vog", "mission", config("propeller"), "--live", "--speed", str(arguments.speed), "--seed",
         str(arguments.seed), "--max-submaps", "1000000", "--set", "mission.when_done=revisit", "--set",
         f"mission.max_duration_s={arguments.hours * 3600}", "--set", f"bus.url='{url}'", "--out",
         arguments.out])
    next_s = 0
    while mission.poll() is None:
        time.sleep(5)
        try:
            counters = counters_now(url)
            vehicle_s = counters["vog-sim"]["vehicle_time_s"]
            kb = {name: resident_kb(pid) for name, pid in children_of(mission.pid).items()}
        except (KeyError, ValueError, OSError, subprocess.TimeoutExpired):
            continue
        if vehicle_s < next_s:
            continue
        next_s += SAMPLE_S
        digests = {counters.get(name, {}).get("map_digest") for name in REPLICAS}
        row = ", ".join(f"{name.removeprefix('vog-')} {value / 1024:.1f}" for name, value in sorted(kb.items()))
        print(f"{vehicle_s} s, {counters['vog-map-service']['submaps']} submaps; MB: {row}; maps "
              f"{'the same' if len(digests) == 1 else 'under way'}", flush=True)
    return mission.returncode


if __name__ == "__main__":
    sys.exit(main())
