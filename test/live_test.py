"""The real processes over LCM: a mission, kills, a late logger's log driving them again."""

import os
import shutil
import signal
import subprocess
import unittest

from vog_testing import (BIN, INPUTS, IS_SANITIZED, TIMEOUT_S, LiveMissionTest, catches, children_of,
                         config, vog)

PROGRAMS = ("vog-planner", "vog-controller", "vog-slam", "vog-map-service", "vog-sonar-reader",
            "vog-nav-bridge")


class LiveTest(LiveMissionTest):
    SPEED = 5 if IS_SANITIZED else 15

    def test_a_mission_survives_kill_9_of_each_process_in_turn(self):
        out, submaps = self.scratch / "killed", 4 if IS_SANITIZED else 16
        mission = self.start_mission(out, submaps)
        for number, program in enumerate(PROGRAMS):
            # Spread over the mission.
            target = 1 + number * (submaps - 3) // len(PROGRAMS)
            self.wait_for(lambda: self.saved_submaps(out) >= target, mission)
            self.wait_for(lambda: program in children_of(mission.pid), mission)
            os.kill(children_of(mission.pid)[program], signal.SIGKILL)
        _, errors = mission.communicate(timeout=TIMEOUT_S)
        self.assertEqual(mission.returncode, 0, errors)
        for program in PROGRAMS:
            self.assertIn(f"{program}: killed", errors)
        metrics = self.metrics(out)
        self.assertGreaterEqual(metrics["submaps"], submaps)
        self.assertEqual(metrics["collisions"], 0)
        self.assertLess(metrics["rmse_m"]["vog"], 0.15)
        info = self.run_vog("map", "info", out / "map")
        self.assertRegex(info, r"complete +true")
        self.assertRegex(info, r"faults +\[\]")
        self.assertTrue((out / "report.html").is_file())

    def test_an_interrupted_mission_leaves_no_process_and_a_map_that_loads(self):
        out = self.scratch / "interrupted"
        mission = self.start_mission(out, 50)
        self.wait_for(lambda: self.saved_submaps(out) >= 1, mission)
        children = children_of(mission.pid)
        self.assertEqual(set(children), {*PROGRAMS, "vog-sim"})
        mission.send_signal(signal.SIGINT)
        mission.communicate(timeout=60)
        self.assertEqual(mission.returncode, 1)
        for pid in children.values():
            self.assertFalse(os.path.exists(f"/proc/{pid}"))
        self.run_vog("map", "info", out / "map")

    @unittest.skipUnless(shutil.which("lcm-logplayer"), "needs lcm-logplayer (liblcm-bin)")
    def test_a_log_played_to_live_processes_gives_a_whole_map(self):
        flown, submaps = self.scratch / "flown", 3
        self.run_vog("mission", config("propeller"), "--max-submaps", submaps, "--out", flown)
        (self.scratch / "run.toml").write_text(self.run_vog("config", config("propeller")))
        run_id = "0"  # Each process takes the run of the first message it hears.
        played = self.scratch / "played"
        processes = [subprocess.Popen(
            [BIN / program, "--config", self.scratch / "run.toml", "--set", f"bus.url='{self.url}'",
             "--set", "bus.clock=message", "--set", f"bus.run_id={run_id}", "--set",
             f"mission.max_submaps={submaps}", "--set", f"map.directory='{played}'"],
            stderr=subprocess.PIPE, text=True) for program in PROGRAMS]
        try:
            for process in processes:
                self.wait_for(lambda: catches(process.pid, signal.SIGINT), process)
            # Nobody says a lost message again.
            speed = self.SPEED / 2 if IS_SANITIZED else self.SPEED
            subprocess.run(["lcm-logplayer", f"--speed={speed}", f"--lcm-url={self.url}",
                            f"--regexp={INPUTS}", flown / "lcm.log"], check=True,
                           stdout=subprocess.DEVNULL, timeout=TIMEOUT_S)
            self.wait_for(lambda: len(list((played / "submaps").glob("*.ot"))) >= submaps,
                          processes[0], limit_s=300)
        finally:
            for process in processes:
                process.send_signal(signal.SIGINT)
            errors = [process.communicate(timeout=60)[1] for process in processes]
        self.assertEqual(errors, [""] * len(processes))
        self.assertEqual([process.returncode for process in processes], [0] * len(processes))
        played_info, flown_info = (vog("map", "info", folder).stdout
                                   for folder in (played, flown / "map"))
        for key in ("submaps", "scans", "known_voxels"):
            pick = [line for line in played_info.splitlines() if line.startswith(key)]
            self.assertIn(pick[0], flown_info.splitlines())


if __name__ == "__main__":
    unittest.main()
