"""SLAM by itself: run anew on a saved map, with wrong registrations, and one pair of clouds."""

import json
import math
import os
import pathlib
import statistics
import unittest

from recordings import corner, write_pcd
from vog_testing import IS_SANITIZED, ROOT, VogTest, config, vog

REAL_SUBMAPS = pathlib.Path(os.environ.get("VOG_SHARED_DATA", ROOT / "../shared/data")) / "submaps/data"
SUBMAPS = 3 if IS_SANITIZED else 16


def planar(pose):
    """x, y and yaw of x y z qx qy qz qw."""
    x, y, _, qx, qy, qz, qw = pose
    return x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))


def relative(a, b):
    """b seen from a."""
    dx, dy, cos, sin = b[0] - a[0], b[1] - a[1], math.cos(a[2]), math.sin(a[2])
    return cos * dx + sin * dy, cos * dy - sin * dx, math.remainder(b[2] - a[2], 2 * math.pi)


def chi_square(error, covariance):
    """e^T P^-1 e of x, y and yaw, by Cramer's rule."""
    matrix = [[covariance[i][k] for k in (0, 1, 5)] for i in (0, 1, 5)]

    def determinant(m):
        return sum(m[0][i] * (m[1][i - 2] * m[2][i - 1] - m[1][i - 1] * m[2][i - 2])
                   for i in range(3))

    solved = [determinant([[error[r] if c == column else matrix[r][c] for c in range(3)]
                           for r in range(3)]) / determinant(matrix) for column in range(3)]
    return sum(e * s for e, s in zip(error, solved))


class SlamTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.mission = cls.scratch / "mission"
        cls("slam").run_vog("mission", config("tank"), "--max-submaps", SUBMAPS, "--out", cls.mission)

    def graph(self, folder):
        return [line.split() for line in (folder / "graph.g2o").read_text().splitlines()]

    def slam(self, *arguments):
        return json.loads(self.run_vog("slam", self.mission / "map", "--json", *arguments))

    def test_the_missions_settings_give_the_missions_map(self):
        out = self.scratch / "again"
        result = self.slam("--config", config("tank"), "--out", out)
        closures = self.metrics(self.mission)["loop_closures"]
        self.assertEqual(result["full"], closures["full"])
        self.assertEqual(result["partial"], closures["partial"])
        self.assertEqual(sum(result["rejected"].values()), closures["rejected"])
        first = self.run_vog("map", "info", self.mission / "map", "--json")
        self.assertEqual(json.loads(first)["submaps"],
                         json.loads(self.run_vog("map", "info", out, "--json"))["submaps"])
        for before, after in zip(self.graph(self.mission / "map"), self.graph(out), strict=True):
            self.assertEqual(before[0], after[0])
            for a, b in zip(before[1:], after[1:], strict=True):
                # Messages carry poses as quaternions.
                self.assertAlmostEqual(float(a), float(b), delta=1e-6 * max(1, abs(float(a))))
        self.assertEqual(len(result["poses"]), SUBMAPS)
        for pose in result["poses"][1:]:
            self.assertGreater(pose["covariance"][0][0], 0)

    def test_a_map_is_judged_as_the_mission_was(self):
        judged = self.slam("--config", config("tank"), "--run", self.mission)["metrics"]
        mission = self.metrics(self.mission)
        self.assertAlmostEqual(judged["rmse_m"], mission["rmse_m"]["vog"], delta=1e-4)
        self.assertAlmostEqual(judged["position_error_m"]["mean"],
                               mission["position_error_m"]["estimate"]["mean"], delta=1e-4)
        without = self.slam("--config", config("tank"), "--set", "slam.loop_closures=false", "--run",
                            self.mission)["metrics"]
        self.assertAlmostEqual(without["rmse_m"], mission["rmse_m"]["vog_no_lc"], delta=1e-4)

    def test_the_missions_consistency_is_that_of_these_covariances(self):
        truth = {}
        for line in (self.mission / "truth.tum").read_text().splitlines():
            time, *pose = map(float, line.split())
            truth[round(1e6 * time)] = planar(pose)
        poses = self.slam("--config", config("tank"))["poses"]
        first, *others = poses
        normalised = []
        for pose in others:
            error = relative(relative(planar(first["X_WM"]), planar(pose["X_WM"])),
                             relative(truth[first["first_utime_us"]], truth[pose["first_utime_us"]]))
            normalised.append(chi_square(error, pose["covariance"]))
        metrics = self.metrics(self.mission)
        self.assertAlmostEqual(metrics["nees_per_dimension"], sum(normalised) / len(normalised) / 3,
                               delta=2e-3 * metrics["nees_per_dimension"])
        self.assertAlmostEqual(metrics["nees_share_below_95"],
                               sum(value < 7.8147 for value in normalised) / len(normalised))

    def test_settings_change_what_comes_out(self):
        self.assertEqual(self.slam("--set", "slam.loop_closures=false")["rejected"], {})
        self.assertEqual(self.slam("--set", "loop_closure.max_candidates=0")["full"], 0)

    @unittest.skipIf(IS_SANITIZED, "too few submaps")
    def test_wrong_registrations_are_found(self):
        for group in 1, 4:
            result = self.slam("--faults", 0.4, "--fault-group", group)
            self.assertGreater(result["faults"], 5)
            self.assertLessEqual(result["faults_kept"], 0.04 * result["faults"])
            self.assertGreater(result["full"] + result["partial"], 5)

    def test_bad_arguments_are_refused(self):
        self.refuse(2, "slam", self.scratch / "nothing", says=["nothing"])
        self.refuse(2, "slam", self.mission / "map", "--set", "slam.node=last", says=["slam.node"])
        self.refuse(2, "slam", self.mission / "map", "--set", "slamm.node=first", says=["slamm"])
        self.refuse(2, "slam", self.mission / "map", "--faults", 2, says=["--faults"])
        self.refuse(2, "slam", self.mission / "map", "--out", self.mission / "map", says=["already"])


class RegisterTest(VogTest):
    def cloud(self, name, points):
        file = self.scratch / name
        write_pcd(file, points)
        return file

    def test_a_shift_is_found_and_told_with_its_uncertainty(self):
        source, target = self.cloud("s.pcd", corner((-0.2, 0.1))), self.cloud("t.pcd", corner())
        result = json.loads(self.run_vog("register", source, target, "--json"))
        self.assertTrue(result["usable"])
        x, y, z, qx, qy, qz, qw = result["X_target_source"]
        self.assertLess(math.dist((x, y, z), (0.2, -0.1, 0)), 0.02)
        self.assertEqual(result["degenerate_directions"], 0)
        self.assertGreater(result["overlap"], 0.8)
        self.assertLess(result["covariance"][0][0], 0.05 ** 2)
        self.assertIn("signal to noise", self.run_vog("register", source, target))

    def test_a_wall_alone_leaves_a_direction_open(self):
        wall = [p for p in corner() if p[0] == 3]
        file = self.cloud("wall.pcd", wall)
        result = json.loads(self.run_vog("register", file, file, "--initial", *"0.1 0 0 0 0 0 1".split(),
                                         "--json"))
        self.assertEqual(result["degenerate_directions"], 1)
        self.assertEqual(len(result["measured_directions"]), 2)

    def test_what_cannot_be_registered_is_refused(self):
        cloud = self.cloud("a.pcd", corner())
        far = self.cloud("far.pcd", corner((100, 0)))
        self.assertEqual(vog("register", far, cloud).returncode, 2)
        self.refuse(2, "register", cloud, self.scratch / "none.pcd", says=["none.pcd"])
        self.refuse(2, "register", cloud, cloud, "--initial", *"0 0 0 0 0 0 0".split(),
                    says=["--initial"])


def rotated(pose, point):
    """A point in the frame in which x y z qx qy qz qw is the pose of its own."""
    x, y, z, qx, qy, qz, qw = pose
    px, py, pz = point
    # q p q^-1 = p + 2 qw (v x p) + 2 v x (v x p)
    tx, ty, tz = (2 * (qy * pz - qz * py), 2 * (qz * px - qx * pz), 2 * (qx * py - qy * px))
    return (x + px + qw * tx + qy * tz - qz * ty, y + py + qw * ty + qz * tx - qx * tz,
            z + pz + qw * tz + qx * ty - qy * tx)


def near(a, b, farthest=1.0):
    """Distances from every fifth point of a to the nearest of b, where that is not farther."""
    cells = {}
    for point in b:
        cells.setdefault(tuple(math.floor(c / farthest) for c in point), []).append(point)
    for point in a[::5]:
        i, k, m = (math.floor(c / farthest) for c in point)
        least = min((math.dist(point, other) for x in (i - 1, i, i + 1) for y in (k - 1, k, k + 1)
                     for z in (m - 1, m, m + 1) for other in cells.get((x, y, z), ())),
                    default=math.inf)
        yield min(least, farthest)


@unittest.skipIf(IS_SANITIZED, "slow")
@unittest.skipUnless(REAL_SUBMAPS.is_dir(), "needs the recordings")
class RealSubmapsTest(VogTest):
    """Five submaps of a ship's stern from a real sonar, at dead-reckoned poses."""

    OVERLAPPING = (0, 4), (1, 3), (1, 2), (2, 3)

    def clouds(self):
        for number in range(5):
            text = (REAL_SUBMAPS / f"{number}.pcd").read_text().split("DATA ascii\n")[1]
            rows = ([float(value) for value in line.split()[:3]] for line in text.splitlines())
            yield [(x, -y, -z) for x, y, z in rows]

    def between(self, clouds, poses):
        """Median distances between the clouds that overlap, both ways; those of a metre and more
        count as a metre."""
        placed = [[rotated(pose, point) for point in cloud]
                  for cloud, pose in zip(clouds, poses, strict=True)]
        return {pair: statistics.median([*near(placed[pair[0]], placed[pair[1]]),
                                         *near(placed[pair[1]], placed[pair[0]])])
                for pair in self.OVERLAPPING}

    def test_slam_makes_no_pair_of_them_worse(self):
        made = self.scratch / "map"
        self.run_vog("map", "build", REAL_SUBMAPS, "--z-down", "--out", made)
        slam = lambda *sets: json.loads(self.run_vog("slam", made, "--json", *sets))
        odometry = slam("--set", "slam.loop_closures=false")
        result = slam("--set", "registration.freedom=full")
        self.assertGreaterEqual(result["full"] + result["partial"], 1)
        clouds = list(self.clouds())
        before = self.between(clouds, [pose["X_WM"] for pose in odometry["poses"]])
        after = self.between(clouds, [pose["X_WM"] for pose in result["poses"]])
        for pair in self.OVERLAPPING:
            self.assertLessEqual(after[pair], before[pair] + 0.001, pair)
        self.assertLess(after[1, 3], 0.9 * before[1, 3])


if __name__ == "__main__":
    unittest.main()
