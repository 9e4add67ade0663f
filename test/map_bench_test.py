"""The map's benchmark: its answers agree, its rows are whole, its map depends on the seed alone."""

import json
import unittest

from vog_testing import IS_SANITIZED, VogTest

METHODS = ["cached", "direct", "algorithm1", "incremental_merge"]
SIZES = [1, 2] if IS_SANITIZED else [3, 6]
CHECKS = 2000 if IS_SANITIZED else 20000
FIGURES = {"overlap", "octomap_search_ns", "query_ns", "ray_5m_ns", "planning_step_ms",
           "planning_step_after_closure_ms", "planning_step_after_10_moved_ms",
           "planning_step_rays", "insert_mbeams_s", "octomap_insert_mbeams_s", "kb_per_submap",
           "octomap_kb_per_submap", "collision_us", "collision_broad_us"}


class MapBenchTest(VogTest):
    def bench(self, *arguments):
        return json.loads(self.run_vog("map", "bench", "--submaps", ",".join(map(str, SIZES)),
                                       "--checks", CHECKS, "--json", *arguments))

    def content(self, *arguments):
        """What a run says about the map itself, without times."""
        rows = self.bench("--methods", "cached", *arguments)["rows"]
        return [(row["submaps"], row["overlap"], row["kb_per_submap"]) for row in rows]

    def test_all_methods_are_measured_in_both_scenes(self):
        for scene in "tank", "propeller":
            report = self.bench("--scene", scene)
            self.assertEqual(report["scene"], scene)
            self.assertGreaterEqual(report["checks"], CHECKS)
            self.assertEqual(report["differences"], 0)
            self.assertEqual(report["insert_differences"], 0)
            self.assertEqual([(row["submaps"], row["method"]) for row in report["rows"]],
                             [(size, method) for size in SIZES for method in METHODS])
            for row in report["rows"]:
                self.assertEqual(set(row), FIGURES | {"method", "submaps"})
                for figure in FIGURES:
                    self.assertGreater(row[figure], 0, (row["method"], figure))

    def test_the_seed_alone_makes_the_map(self):
        first = self.content("--seed", 1)
        self.assertEqual(self.content("--seed", 1), first)
        for same, other in zip(first, self.content("--seed", 2)):
            self.assertNotEqual(same[1:], other[1:])

    def test_the_table_names_methods_and_checks(self):
        table = self.run_vog("map", "bench", "--submaps", 2, "--checks", 1000)
        self.assertRegex(table, r"^checks \d+, differences 0\n")
        for method in METHODS:
            self.assertRegex(table, rf"\n +2 {method} ")

    def test_wrong_choices_are_refused(self):
        self.refuse(2, "map", "bench", "--methods", "guess", says=["--methods"])
        self.refuse(2, "map", "bench", "--scene", "moon", says=["--scene"])
        self.refuse(2, "map", "bench", "--submaps", "0", says=["--submaps"])


if __name__ == "__main__":
    unittest.main()
