"""Missions that go on from the map of an earlier one: one map of both flights, as good as that of one
flight."""

import math
import os
import shutil
import signal
import subprocess
import unittest

from vog_testing import (BIN, INPUTS, IS_SANITIZED, TIMEOUT_S, LiveMissionTest, VogTest, children_of,
                         config, contents, free_url, vog)

FIRST = 2 if IS_SANITIZED else 12
BUDGET = 4 if IS_SANITIZED else 105
SHORT = 4 if IS_SANITIZED else 20


class ResumeTest(VogTest):
    @classmethod
    def fly(cls, name, *arguments, budget=BUDGET):
        out = cls.scratch / name
        cls.run_vog(cls(), "mission", config("tank"), "--max-submaps", budget, "--out", out, *arguments)
        return out

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.old = cls.fly("old", budget=FIRST)
        cls.old_files = contents(cls.old)
        cls.new = cls.fly("new", "--resume", cls.old)

    def test_one_map_holds_both_flights(self):
        metrics = self.metrics(self.new)
        self.assertEqual(metrics["earlier_submaps"], {"all": FIRST, "judged": FIRST})
        self.assertGreater(metrics["submaps"], FIRST)
        self.assertEqual(metrics["collisions"], 0)
        self.assertGreater(metrics["vehicle_time_s"], self.metrics(self.old)["vehicle_time_s"])
        info = self.run_vog("map", "info", self.new / "map")
        self.assertRegex(info, r"complete +true")
        self.assertRegex(info, rf"first_of_flight +{FIRST}\n")
        poses = (self.new / "truth.tum").read_text().splitlines()
        times = [float(pose.split()[0]) for pose in poses]
        self.assertEqual(times, sorted(times))
        self.assertEqual(len(poses), metrics["scans"])
        self.assertGreater(len(poses), self.metrics(self.old)["scans"])

    def test_the_earlier_submaps_and_the_earlier_run_stay_as_they_are(self):
        self.assertEqual(contents(self.old), self.old_files)
        for number in range(FIRST):
            octree = f"map/submaps/{number:06}.ot"
            self.assertEqual((self.new / octree).read_bytes(), self.old_files[octree])
        self.assertEqual(contents(self.new / "earlier/map"), contents(self.old / "map"))

    @unittest.skipIf(IS_SANITIZED, "slow: whole missions")
    def test_the_map_is_as_good_as_that_of_one_flight(self):
        resumed, whole = self.metrics(self.new), self.metrics(self.fly("whole"))
        for metrics in (resumed, whole):
            self.assertEqual(metrics["end_reason"], "nothing_to_gain")
            self.assertTrue(metrics["is_home"])
        self.assertLess(resumed["rmse_m"]["vog"], 1.3 * whole["rmse_m"]["vog"])
        self.assertLess(resumed["rmse_m"]["vog"], 0.7 * resumed["rmse_m"]["vog_no_lc"])
        for of in ("surface", "volume"):
            self.assertGreater(resumed["coverage"][of], whole["coverage"][of] - 0.02)
        self.assertLess(resumed["position_error_m"]["estimate"]["mean"], 0.15)
        # The vehicle was put in some decimetres from where it was thought to be. (Later the drift
        # may take it back by chance.)
        put_in = self.metrics(self.old)["scans"]
        of_odometry_m, of_estimate_m = (self.position_error_m(self.new, of, put_in)
                                        for of in ("odometry", "estimate"))
        self.assertGreater(of_odometry_m, 2 * of_estimate_m)

    @staticmethod
    def positions(folder, of, first, count):
        """Of `count` scans from number `first` on."""
        lines = (folder / f"{of}.tum").read_text().splitlines()[first:first + count]
        return [[float(number) for number in line.split()[1:4]] for line in lines]

    def position_error_m(self, folder, of, first, count=100):
        """Mean over those scans."""
        return sum(map(math.dist, self.positions(folder, of, first, count),
                       self.positions(folder, "truth", first, count))) / count

    def test_equal_resumptions_and_replays_give_equal_bytes(self):
        new = self.fly("short", "--resume", self.old, budget=SHORT)
        again = self.fly("again", "--resume", self.old / "map", budget=SHORT)  # Its log lies beside it.
        for name in ("lcm.log", "metrics.json", "timeseries.json"):
            self.assertEqual((again / name).read_bytes(), (new / name).read_bytes(), name)
        self.assertEqual(contents(again / "map"), contents(new / "map"))
        replayed, inputs = self.scratch / "replayed", self.scratch / "in.log"
        self.run_vog("log", "cut", new / "lcm.log", "--channels", INPUTS, "--out", inputs)
        self.refuse(2, "replay", inputs, "--out", replayed, says=["went on from a map", "--resume"])
        self.assertFalse(replayed.exists())
        for arguments in ((new / "lcm.log",), (inputs, "--resume", self.old)):
            self.run_vog("replay", *arguments, "--out", replayed)
            self.assertEqual(contents(replayed / "map"), contents(new / "map"))
            self.assertEqual(self.metrics(replayed), self.metrics(new))
        built = self.scratch / "built"
        self.run_vog("map", "build", new / "lcm.log", "--out", built)
        self.assertEqual(contents(built), contents(new / "map"))

    def test_the_noise_of_the_flights_differs(self):
        def errors(folder, first, count=50):
            pairs = [self.positions(folder, of, first, count) for of in ("truth", "odometry")]
            return [[round((a - b) - (a0 - b0), 6) for a, b, a0, b0 in
                     zip(truth[:2], reckoned[:2], pairs[0][0], pairs[1][0])]
                    for truth, reckoned in zip(*pairs)]
        first = errors(self.new, 0)
        self.assertNotEqual(first, errors(self.new, self.metrics(self.old)["scans"]))
        self.assertEqual(first, errors(self.old, 0))

    @unittest.skipIf(IS_SANITIZED, "slow: whole missions")
    def test_a_finished_mission_ends_soon(self):
        before = self.metrics(self.new)
        after = self.metrics(self.fly("finished", "--resume", self.new))
        self.assertEqual(after["end_reason"], "nothing_to_gain")
        # From where it was put in it may see a little more.
        self.assertLess(after["submaps"], 1.5 * before["submaps"])
        self.assertEqual(after["earlier_submaps"]["judged"], before["submaps"])
        self.assertGreater(after["coverage"]["surface"], before["coverage"]["surface"] - 0.01)

    def test_a_map_alone_is_gone_on_from_and_the_new_flight_judged(self):
        alone, out = self.scratch / "alone", self.scratch / "from-map"
        shutil.copytree(self.old / "map", alone)
        # As one of an older version.
        text = (alone / "map.toml").read_text()
        begin = text.index("[end]")
        (alone / "map.toml").write_text(text[:begin] + text[text.index("[[submap]]"):])
        done = vog("mission", config("tank"), "--max-submaps", FIRST + 2, "--resume", alone, "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("does not tell where its mission ended", done.stderr)
        self.assertIn(f"the first {FIRST} submaps are not judged", done.stderr)
        metrics = self.metrics(out)
        self.assertEqual(metrics["earlier_submaps"], {"all": FIRST, "judged": 0})
        self.assertEqual(metrics["submaps"], FIRST + 2)
        self.assertEqual(metrics["scans"], 200)
        self.assertLess(metrics["rmse_m"]["vog"], 0.2)

    def test_the_vehicle_may_be_put_in_elsewhere(self):
        # With room to turn: a start takes that for free.
        for name, place in (("start", ["put_in.place=start"]),
                            ("place", ["put_in.place=place", "put_in.position_m=[1.2, 1.6, 0.0]"])):
            with self.subTest(name):
                metrics = self.metrics(self.fly(name, "--resume", self.old, "--set", *place,
                                                budget=FIRST + 2))
                self.assertEqual(metrics["submaps"], FIRST + 2)
                self.assertEqual(metrics["collisions"], 0)
                self.assertLess(metrics["rmse_m"]["vog"], 0.15)

    def test_what_cannot_be_gone_on_from_is_refused(self):
        damaged, out = self.scratch / "damaged", self.scratch / "refused"
        shutil.copytree(self.old, damaged)
        for name in ("map/submaps/000001.ot", "map/compact.bin"):
            (damaged / name).write_bytes(b"no octree")
        broken = self.scratch / "broken"
        shutil.copytree(self.old, broken)
        (broken / "map/map.toml").write_text("format = 2\n[[submap]\n")
        (self.scratch / "empty").mkdir()
        mission = ("mission", config("tank"), "--out", out, "--resume")
        for arguments, says in (
                ((self.scratch / "nowhere",), "no map here"),
                ((self.scratch / "empty",), "no map here"),
                ((damaged,), "000001.ot: the check sum does not match"),
                ((broken,), "map.toml:2"),
                ((self.old, "--set", "submap.voxel_size_m=0.1"), "its voxels are of 0.095 m"),
                ((self.old, "--set", "sensor_model.hit_probability=0.8"), "another [sensor_model]"),
                ((self.old, "--max-submaps", FIRST), f"it has {FIRST} submaps"),
                ((self.old, "--mode", "standard"), "mode standard"),
                ((self.old, "--set", "put_in.place=place", "put_in.position_m=[50.0, 0.0, 0.0]"),
                 "no room for the vehicle")):
            self.refuse(2, *mission, *arguments, says=[says])
            self.assertFalse(out.exists(), says)
        self.refuse(2, "mission", config("tank"), "--resume", self.old, "--out", self.old,
                    says=["choose another folder"])
        self.assertEqual(contents(self.old), self.old_files)
        self.refuse(2, "replay", self.old / "lcm.log", "--resume", self.old, "--out", out,
                    says=["did not go on from another one"])

    def test_the_vehicles_map_service_refuses_it_too(self):
        out = self.scratch / "vehicle"
        done = subprocess.run(
            [BIN / "vog-map-service", "--config", config("tank"), "--set", f"bus.url='{free_url()}'",
             f"map.directory='{out}'", f"map.resume='{self.old / 'map'}'", "submap.voxel_size_m=0.1"],
            capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn("its voxels are of 0.095 m", done.stderr)
        self.assertFalse(out.exists())

    def test_the_other_tools_cope(self):
        self.assertIn("SUBMAP", self.run_vog("log", "info", self.new / "lcm.log"))
        report = self.scratch / "report.html"
        self.run_vog("report", self.new, "--out", report)
        self.assertTrue(report.is_file())
        merged = self.scratch / "merged.log"
        self.run_vog("log", "merge", self.new / "earlier/lcm.log", self.new / "lcm.log", "--out", merged)
        slam = self.run_vog("slam", self.new / "map", "--out", self.scratch / "slam", "--run", self.new)
        self.assertIn("submaps", slam)


class LiveResumeTest(LiveMissionTest):
    def test_a_resumed_mission_survives_kill_9_of_the_map_service(self):
        old, out = self.scratch / "old", self.scratch / "live"
        first, submaps = (1, 3) if IS_SANITIZED else (4, 9)
        self.run_vog("mission", config("propeller"), "--max-submaps", first, "--out", old)
        mission = self.start_mission(out, submaps, "--resume", old)

        def put_in():
            toml = out / "map/map.toml"
            return toml.is_file() and "[put_in]" in toml.read_text()
        for is_time in (put_in, lambda: self.saved_submaps(out) >= first + 1):
            self.wait_for(is_time, mission)
            self.wait_for(lambda: "vog-map-service" in children_of(mission.pid), mission)
            os.kill(children_of(mission.pid)["vog-map-service"], signal.SIGKILL)
        _, errors = mission.communicate(timeout=TIMEOUT_S)
        self.assertEqual(mission.returncode, 0, errors)
        self.assertEqual(errors.count("vog-map-service: killed"), 2)
        metrics = self.metrics(out)
        self.assertEqual(metrics["earlier_submaps"], {"all": first, "judged": first})
        self.assertGreaterEqual(metrics["submaps"], submaps)
        self.assertEqual(metrics["collisions"], 0)
        self.assertLess(metrics["rmse_m"]["vog"], 0.15)
        for number in range(first):
            octree = f"map/submaps/{number:06}.ot"
            self.assertEqual((out / octree).read_bytes(), (old / octree).read_bytes())
        self.assertRegex(self.run_vog("map", "info", out / "map"), r"complete +true")


if __name__ == "__main__":
    unittest.main()
