"""Lock-step missions judged by their metrics, repeated and replayed to the same bytes."""

import json
import re
import statistics
import unittest

from recordings import write_boxes
from vog_testing import INPUTS, IS_SANITIZED, ROOT, VogTest, config, contents

SUBMAPS = 3 if IS_SANITIZED else 24
REPEATED = 1 if IS_SANITIZED else 3


class MissionTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_folder = cls.scratch / "a"
        cls.run_vog(cls(), "mission", config("propeller"), "--seed", 1, "--max-submaps", SUBMAPS,
                    "--out", cls.run_folder)

    def test_the_map_is_right(self):
        metrics = self.metrics(self.run_folder)
        self.assertEqual(metrics["submaps"], SUBMAPS)
        self.assertEqual(metrics["end_reason"], "max_submaps")
        self.assertEqual(metrics["collisions"], 0)
        self.assertGreater(metrics["min_clearance_m"], 0.05)
        self.assertLess(metrics["rmse_m"]["vog"], 0.1)
        if IS_SANITIZED:
            return
        self.assertLess(metrics["rmse_m"]["vog"], 0.8 * metrics["rmse_m"]["vog_no_lc"])
        self.assertLess(metrics["rmse_m"]["vog"], 0.8 * metrics["rmse_m"]["standard"])
        self.assertLess(metrics["point_error_m"]["estimate"],
                        0.6 * metrics["point_error_m"]["odometry"])
        errors_m = {name: error["mean"] for name, error in metrics["position_error_m"].items()}
        self.assertLess(errors_m["estimate"], errors_m["odometry"])
        self.assertLess(errors_m["within_submaps"], 0.7 * errors_m["odometry"])
        self.assertGreater(errors_m["within_submaps"], 0.01)
        self.assertGreater(metrics["coverage"]["surface"], 0.35)
        self.assertGreater(metrics["coverage"]["volume"], 0.5)
        self.assertGreater(metrics["loop_closures"]["full"] + metrics["loop_closures"]["partial"],
                           10)

    def test_all_files_are_there(self):
        for name in ("metrics.json", "timing.json", "timeseries.json", "report.html", "lcm.log",
                     "truth.tum", "odometry.tum", "estimate.tum", "scene.ply", "map/map.toml",
                     "map/graph.g2o", "map/submaps/000000.ot", "reconstruction_truth.ply",
                     "reconstruction_vog.ply", "reconstruction_vog_no_lc.ply",
                     "reconstruction_standard.ply"):
            self.assertTrue((self.run_folder / name).is_file(), name)
        lines = (self.run_folder / "submap_places.csv").read_text().splitlines()
        places = [[float(number) for number in line.split(",")] for line in lines[1:]]
        self.assertEqual(len(places), self.metrics(self.run_folder)["submaps"])
        column = lines[0].split(",").index
        of_x, to_newest = column("covariance_WM_x_x"), column("covariance_MN_x_x")
        self.assertGreater(places[-1][of_x], places[0][of_x])
        self.assertGreater(places[0][to_newest], places[-1][to_newest])
        poses = (self.run_folder / "estimate.tum").read_text().splitlines()
        self.assertEqual(len(poses), self.metrics(self.run_folder)["scans"])
        self.assertEqual(len(poses[0].split()), 8)

    def test_consistency_is_told_submap_by_submap(self):
        metrics = self.metrics(self.run_folder)
        series = json.loads((self.run_folder / "timeseries.json").read_text())["nees_per_dimension"]
        self.assertEqual(len(series), metrics["submaps"] - 1)  # Each relative to the first.
        self.assertAlmostEqual(statistics.mean(nees for _, nees in series),
                               metrics["nees_per_dimension"], delta=1e-9)
        times = [time for time, _ in series]
        self.assertEqual(times, sorted(times))

    def test_the_report_lists_every_closure(self):
        page = (self.run_folder / "report.html").read_text()
        closures = re.search(r'<section id="closures".*?</section>', page, re.DOTALL)[0]
        told = self.metrics(self.run_folder)["loop_closures"]
        self.assertEqual(closures.count('<th scope="row">'), sum(told.values()))
        self.assertEqual(closures.count("<td>holds</td>"), told["full"] + told["partial"])
        self.assertIn("before and after registration", closures)

    def test_the_log_replayed_gives_the_map_byte_for_byte(self):
        inputs, out = self.scratch / "in.log", self.scratch / "replayed"
        self.run_vog("log", "cut", self.run_folder / "lcm.log", "--channels", INPUTS, "--out",
                     inputs)
        kept = self.run_vog("log", "info", inputs)
        self.assertIsNone(re.search("^(SUBMAP|NAV|POSE|PLAN) ", kept, re.MULTILINE))
        self.run_vog("replay", inputs, "--out", out)
        self.assertEqual(contents(out / "map"), contents(self.run_folder / "map"))
        self.assertEqual(self.metrics(out), self.metrics(self.run_folder))

    def test_a_log_that_breaks_off_gives_a_map(self):
        broken, out = self.scratch / "broken.log", self.scratch / "broken-map"
        whole = (self.run_folder / "lcm.log").read_bytes()
        broken.write_bytes(whole[:len(whole) // 2 + 17])
        self.run_vog("map", "build", broken, "--out", out)
        self.assertRegex(self.run_vog("map", "info", out), r"complete +true")


class ExampleLogTest(VogTest):
    def test_replays_to_a_whole_map(self):
        """If messages or the simulator change: docs/start.md says how the file is made."""
        log, out = ROOT / "examples/logs/tank.log", self.scratch / "example"
        self.run_vog("replay", log, "--out", out)
        metrics = self.metrics(out)
        self.assertEqual(metrics["submaps"], 3)
        self.assertLess(metrics["rmse_m"]["vog"], 0.06)
        self.assertRegex(self.run_vog("map", "info", out / "map"), r"complete +true")


class RepeatTest(VogTest):
    def fly(self, name, *arguments, mission="propeller"):
        out = self.scratch / name
        self.run_vog("mission", config(mission), "--max-submaps", REPEATED, "--out", out, *arguments)
        return out

    def test_equal_seeds_give_equal_bytes_and_others_do_not(self):
        first, again = self.fly("first"), self.fly("again")
        other = self.fly("other", "--seed", 2)
        for name in ("lcm.log", "metrics.json", "timeseries.json"):
            self.assertEqual((first / name).read_bytes(), (again / name).read_bytes(), name)
            self.assertNotEqual((first / name).read_bytes(), (other / name).read_bytes(), name)
        self.assertEqual(contents(first / "map"), contents(again / "map"))
        self.assertNotEqual(contents(first / "map"), contents(other / "map"))

    def test_a_second_mission_into_a_folder_leaves_nothing_of_the_first(self):
        out = self.fly("twice", "--set", "mission.max_submaps=4")
        self.fly("twice", "--seed", 3)
        fresh = self.fly("fresh", "--seed", 3)
        self.assertEqual(contents(out / "map"), contents(fresh / "map"))

    def test_modes_and_missions(self):
        for mission in ("tank", "pier", "wreck", "seafloor", "mine", "propeller-paper",
                        "tank-paper"):
            for mode in ("vog", "vog-no-lc", "standard"):
                if mission != "tank" and mode != "vog":
                    continue
                with self.subTest(f"{mission} {mode}"):
                    metrics = self.metrics(self.fly(f"{mission}-{mode}", "--mode", mode,
                                                    mission=mission))
                    self.assertEqual(metrics["mode"], mode)
                    self.assertEqual(metrics["submaps"], REPEATED)
                    if not mission.endswith("paper"):  # A fixed fan is blind above and below.
                        self.assertEqual(metrics["collisions"], 0)

    @unittest.skipIf(IS_SANITIZED, "slow: nothing is remembered")
    def test_what_the_map_remembers_changes_nothing(self):
        run = ("--set", "bus.run_id=1")  # Else derived from the settings, which differ.
        cached = self.fly("cached", *run)
        direct = self.fly("direct", *run, "--set", "map.method=direct")
        self.assertEqual(contents(cached / "map"), contents(direct / "map"))

    def test_a_structure_of_ones_own(self):
        folder = self.scratch / "own"
        folder.mkdir()
        write_boxes(folder / "box.stl", ((0, 0, 0), 1.0, False))
        free = self.fly("free", "--scene", folder / "box.stl")
        self.assertEqual(self.metrics(free)["scene"], "box")
        self.assertEqual(self.metrics(free)["collisions"], 0)
        self.assertGreater(self.metrics(free)["coverage"]["surface"], 0.05)
        # A mesh beside the mission file is found from anywhere, also by the log's replay.
        mission = folder / "mission.toml"
        mission.write_text(f'include = ["{config("tank")}"]\n[scene]\nkind = "mesh"\n'
                           'mesh = "box.stl"\n[simulation]\nstart_position_m = [-2.5, 0.0, 0.0]\n')
        flown, replayed = self.scratch / "flown", self.scratch / "replayed"
        self.run_vog("mission", mission, "--max-submaps", 1, "--out", flown)
        self.run_vog("replay", flown / "lcm.log", "--out", replayed)
        self.assertEqual(contents(flown / "map"), contents(replayed / "map"))
        self.assertEqual(self.metrics(flown), self.metrics(replayed))

    def test_instruments_and_intensity_frames(self):
        out = self.fly("instruments", "--set", "simulation.navigation=sensors", "--set",
                       "navigation.source=instruments", "--set", "sonar_model.emits=frames")
        metrics = self.metrics(out)
        self.assertEqual(metrics["submaps"], REPEATED)
        self.assertLess(metrics["point_error_m"]["odometry"], 0.5)
        self.assertLess(metrics["rmse_m"]["vog"], 0.2)


@unittest.skipIf(IS_SANITIZED, "slow: whole missions")
class EndTest(VogTest):
    """Where there is little or nothing to explore a mission ends by itself, and says why."""

    def mission(self, name, boxes, min_m, max_m):
        write_boxes(self.scratch / f"{name}.stl", *boxes)
        file = self.scratch / f"{name}.toml"
        file.write_text(f'include = ["{config("tank")}"]\n[scene]\nkind = "mesh"\n'
                        f'mesh = "{name}.stl"\n[simulation]\nstart_position_m = [0, 0, 0]\n'
                        f'[exploration]\nmin_m = {min_m}\nmax_m = {max_m}\n')
        return file

    def fly(self, name, *mission):
        out = self.scratch / name
        self.run_vog("mission", self.mission(name, *mission), "--out", out)
        metrics = self.metrics(out)
        self.assertEqual(metrics["end_reason"], "nothing_to_gain")
        self.assertEqual(metrics["collisions"], 0)
        self.assertTrue(metrics["is_home"])
        unseen = metrics["unseen_voxels"]
        self.assertLessEqual(0, unseen["looked_at_in_vain"])
        self.assertLessEqual(unseen["looked_at_in_vain"], unseen["all"])
        return metrics

    def test_nothing_within_the_sonars_range(self):
        metrics = self.fly("empty", [((40, 0, 0), 1, False)], [-2, -2, -1], [2, 2, 1])
        self.assertEqual(metrics["coverage"]["surface"], 0)
        self.assertGreater(metrics["coverage"]["volume"], 0.95)

    def test_a_start_walled_in(self):
        room = [((0, 0, 0), 1.6, False), ((0, 0, 0), 1.3, True)]
        metrics = self.fly("enclosed", room, [-3, -3, -1.5], [3, 3, 1.5])
        self.assertGreater(metrics["coverage"]["surface"], 0.5)

    def test_a_pocket_that_nobody_can_look_into(self):
        shell = [((2.5, 0, 0), 1, False), ((2.5, 0, 0), 0.8, True)]
        metrics = self.fly("pocket", shell, [-1.5, -2.2, -1.2], [4, 2.2, 1.2])
        self.assertGreater(metrics["coverage"]["surface"], 0.6)
        self.assertGreater(metrics["unseen_voxels"]["all"], 0)

    def test_boxes_without_room_or_without_the_vehicle_are_refused(self):
        block = [((3, 0, 0), 1.5, False)]
        inside = self.mission("inside", block, [2, -0.8, -0.8], [4, 0.8, 0.8])
        elsewhere = self.mission("elsewhere", block, [38, -2, -1.5], [42, 2, 1.5])
        for mission, says in ((inside, "the vehicle fits nowhere into the exploration box"),
                              (elsewhere, "would start outside of the exploration box")):
            out = self.scratch / "refused"
            self.refuse(2, "mission", mission, "--out", out, says=[says])
            self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
