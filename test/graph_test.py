"""Pose graphs of others: .g2o files read, optimised, checked and written."""

import json
import math
import os
import pathlib
import random
import unittest

from recordings import two_laps
from vog_testing import VogTest, vog

# A folder with published graphs, graphs/NAME.g2o; tests that need it are skipped without.
DATA = pathlib.Path(os.environ.get("VOG_DATA", "nosuch")) / "graphs"
# Optima that Rosen et al. 2019 certify.
CERTIFIED = {"sphere2500": 1687.0, "parking-garage": 1.2625, "smallGrid3D": 1025.4}

INFORMATION = "100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 400 0 0 400 0 400"
SQUARE = f"""# A square driven once, with a closure.
VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1
VERTEX_SE3:QUAT 1 1.1 0 0 0 0 0.7071068 0.7071068
VERTEX_SE3:QUAT 2 1 1.2 0 0 0 1 0
VERTEX_SE3:QUAT 3 0 1 0.1 0 0 0.7071068 -0.7071068
FIX 0
EDGE_SE3:QUAT 0 1 1 0 0 0 0 0.7071068 0.7071068 {INFORMATION}
EDGE_SE3:QUAT 1 2 1 0 0 0 0 0.7071068 0.7071068 {INFORMATION}
EDGE_SE3:QUAT 2 3 1 0 0 0 0 0.7071068 0.7071068 {INFORMATION}
EDGE_SE3:QUAT 3 0 1 0.1 0 0 0 0.7071068 0.7071068 {INFORMATION}
"""
PLANAR = """VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1.2 0 1.5
VERTEX_SE2 2 1 1 3
EDGE_SE2 0 1 1 0 1.5707963 50 0 0 50 0 200
EDGE_SE2 1 2 1 0 1.5707963 50 0 0 50 0 200
EDGE_SE2 0 2 1.1 1 3.1 50 0 0 50 0 200
"""


class GraphTest(VogTest):
    def write(self, text, name="graph.g2o"):
        file = self.scratch / name
        file.write_text(text)
        return file

    def optimize(self, file, *arguments, out="out.g2o"):
        return json.loads(self.run_vog("graph", "optimize", file, "--out", self.scratch / out,
                                       "--json", *arguments))

    def test_optimises_and_writes_what_it_reads(self):
        result = self.optimize(self.write(SQUARE))
        self.assertEqual(list(result), ["nodes", "edges", "initial_cost", "final_cost",
                                        "iterations", "seconds", "rejected"])
        self.assertEqual((result["nodes"], result["edges"], result["rejected"]), (4, 4, 0))
        self.assertLess(result["final_cost"], result["initial_cost"])
        first = (self.scratch / "out.g2o").read_bytes()
        again = self.optimize(self.scratch / "out.g2o", out="again.g2o")
        self.assertAlmostEqual(again["initial_cost"], result["final_cost"], places=9)
        self.assertAlmostEqual(again["final_cost"], again["initial_cost"], places=9)
        self.optimize(self.write(SQUARE))
        self.assertEqual((self.scratch / "out.g2o").read_bytes(), first)

    def test_chordal_cost_is_that_of_the_formula(self):
        """Of two vertices: F = tau |t|^2 + kappa |dR|_F^2 at the file's poses."""
        angle = 0.3
        text = ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 2 3 0 0 "
                f"{math.sin(angle / 2)} {math.cos(angle / 2)}\n"
                "EDGE_SE3:QUAT 0 1 0 0 0 0 0 0 1 1 0 0 0 0 0 2 0 0 0 0 4 0 0 0 8 0 0 16 0 32\n")
        tau = 3 / (1 + 1 / 2 + 1 / 4)
        kappa = 3 / (2 * (1 / 8 + 1 / 16 + 1 / 32))
        result = self.optimize(self.write(text), "--objective", "chordal")
        expected = tau * 14 + kappa * 4 * (1 - math.cos(angle))
        self.assertAlmostEqual(result["initial_cost"], expected, places=9)
        self.assertLess(result["final_cost"], 1e-9)
        half = self.optimize(self.write(text), "--objective", "chordal", "--rotation-information",
                             "g2o")
        self.assertAlmostEqual(half["initial_cost"],
                               tau * 14 + kappa / 4 * 4 * (1 - math.cos(angle)), places=9)

    def test_planar_files_stay_planar(self):
        for objective in ("geodesic", "chordal"):
            result = self.optimize(self.write(PLANAR), "--objective", objective)
            self.assertLess(result["final_cost"], result["initial_cost"])
            lines = (self.scratch / "out.g2o").read_text().splitlines()
            self.assertEqual([line.split()[0] for line in lines],
                             ["VERTEX_SE2"] * 3 + ["EDGE_SE2"] * 3)
            for written, read in zip(lines[3:], PLANAR.splitlines()[3:]):
                for a, b in zip(written.split()[1:], read.split()[1:]):
                    self.assertAlmostEqual(float(a), float(b), places=12)
        info = json.loads(self.run_vog("graph", "info", self.write(PLANAR), "--json"))
        self.assertEqual((info["dimensions"], info["nodes"], info["edges"]), (2, 3, 3))

    def test_bad_files(self):
        vertices = SQUARE.splitlines()[:5]
        out = self.scratch / "refused.g2o"
        for line, says in (
                ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1", ["vertex 0", "already"]),
                ("VERTEX_SE3:QUAT 9 0 0 0 0 0 0 2", ["norm 2", "1 is allowed"]),
                ("VERTEX_SE3:QUAT 9 0 0 0 0 0 0 0", ["norm 0"]),
                ("VERTEX_SE3:QUAT 9 0 0 nan 0 0 0 1", ["finite"]),
                ("VERTEX_SE3:QUAT 9 0 0 1e999 0 0 0 1", ["1e999", "number"]),
                ("VERTEX_SE3:QUAT 9 0 0 x 0 0 0 1", ["'x'", "number"]),
                ("VERTEX_SE3:QUAT 9 0 0 0 0 0 0", ["ends before"]),
                ("VERTEX_SE3:QUAT 9 0 0 0 0 0 0 1 7", ["'7'"]),
                ("VERTEX_SE3:QUAT -1 0 0 0 0 0 0 1", ["-1", "from 0 on"]),
                ("VERTEX_SE3:QUAT 99999999999 0 0 0 0 0 0 1", ["99999999999", "integer"]),
                ("VERTEX_SE2 9 0 0 0", ["SE2", "SE3"]),
                (f"EDGE_SE3:QUAT 0 17 1 0 0 0 0 0 1 {INFORMATION}", ["vertex 17", "missing"]),
                (f"EDGE_SE3:QUAT 1 1 1 0 0 0 0 0 1 {INFORMATION}", ["itself"]),
                ("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 -" + INFORMATION, ["eigenvalue -100"]),
                ("FIX 17", ["vertex 17", "missing"])):
            with self.subTest(line):
                bad = self.write("\n".join(vertices + [line]) + "\n", "bad.g2o")
                self.refuse(2, "graph", "optimize", bad, "--out", out, says=[f"{bad}:6: ", *says])
                self.refuse(2, "graph", "info", bad, says=[f"{bad}:6: "])
                checked = vog("graph", "check", bad, "--json")
                self.assertEqual(checked.returncode, 1)
                self.assertIn(f"{bad}:6: ", json.loads(checked.stdout)["problems"][0])
        self.assertFalse(out.exists())
        self.refuse(2, "graph", "info", self.scratch / "nosuch.g2o", says=["nosuch.g2o"])
        good = self.write(SQUARE)
        self.refuse(1, "graph", "optimize", good, "--out", "/proc/nosuch.g2o", says=["/proc"])
        self.refuse(2, "graph", "optimize", good, "--out", out, "--robust", "magic", says=["dcs"])
        self.refuse(2, "graph", "optimize", good, "--out", out, "--objective", "x",
                    says=["chordal"])

    def test_unknown_lines_are_told_and_left_out(self):
        file = self.write(SQUARE + "VERTEX_XY 5 0 0\nVERTEX_XY 6 0 0\n")
        done = vog("graph", "info", file, "--json")
        self.assertIn("2 lines VERTEX_XY", done.stderr)
        info = json.loads(done.stdout)
        self.assertEqual((info["unknown"], info["comments"]), ({"VERTEX_XY": 2}, 1))

    def test_check_finds_parts_and_the_worst_edge(self):
        file = self.write(SQUARE)
        result = json.loads(self.run_vog("graph", "check", file, "--worst", 1, "--json"))
        self.assertEqual((result["problems"], result["parts"]), ([], 1))
        self.assertEqual(len(result["worst_edges"]), 1)
        lonely = self.write(SQUARE + "VERTEX_SE3:QUAT 8 9 9 9 0 0 0 1\n", "lonely.g2o")
        done = vog("graph", "check", lonely, "--json")
        self.assertEqual(done.returncode, 1)
        self.assertIn("2 parts", done.stderr)
        self.assertEqual(self.optimize(lonely)["nodes"], 5)

    def test_bench_adds_wrong_closures_and_finds_them(self):
        file = self.write(two_laps())

        def bench(*arguments):
            report = json.loads(self.run_vog(
                "graph", "bench", file, "--closures", 30, "--seeds", "1..3", "--outliers",
                "0,0.2,0.5", "--resolved", 10, "--json", *arguments))
            for row in report["outliers"]:
                del row["seconds"]
            return report

        single = bench()
        self.assertEqual([row["wrong"] for row in single["outliers"]], [0, 24, 90])
        for row in single["outliers"] + bench("--group", 3)["outliers"]:
            self.assertEqual(row["wrong_kept"], 0, row)
            self.assertGreater(row["least_right_kept"], 0.9, row)
            self.assertLess(row["worst_max_m"], 0.1, row)
        self.assertEqual(single["outliers"], bench()["outliers"])
        self.assertEqual(single["resolve"]["closures"], 10)
        self.assertLess(single["resolve"]["largest_cost_difference"], 1e-6)
        self.assertIn("right", self.run_vog("graph", "bench", file, "--seeds", 1, "--resolved", 1))
        chain = self.write("\n".join(line for line in two_laps().splitlines()
                                     if not line.startswith("EDGE")
                                     or int(line.split()[2]) - int(line.split()[1]) == 1))
        self.refuse(2, "graph", "bench", chain, says=["closures"])
        self.refuse(2, "graph", "bench", file, "--outliers", 1.5, says=["--outliers"])

    def test_empty_files(self):
        result = self.optimize(self.write(""))
        self.assertEqual((result["nodes"], result["final_cost"]), (0, 0))

    def published(self, name):
        file = DATA / f"{name}.g2o"
        if not file.exists():
            self.skipTest(f"{file} is not there; VOG_DATA names the folder with graphs/{name}.g2o")
        return file

    def test_published_graphs_reach_their_certified_optima(self):
        for name, optimum in CERTIFIED.items():
            with self.subTest(name):
                result = self.optimize(self.published(name), "--objective", "chordal")
                self.assertLess(abs(result["final_cost"] / optimum - 1), 1e-4)

    def test_wrong_closures_of_the_published_garage(self):
        lines = self.published("parking-garage").read_text().splitlines()
        edges = [line for line in lines if line.startswith("EDGE")]
        is_closure = [abs(int(edge.split()[1]) - int(edge.split()[2])) > 1 for edge in edges]
        closures = [edge for edge, closure in zip(edges, is_closure) if closure]
        base = [line for line in lines if line.startswith("VERTEX")] + [
            edge for edge, closure in zip(edges, is_closure) if not closure]
        nodes = sum(line.startswith("VERTEX") for line in lines)
        for share in (0.1, 0.5, 0.8):
            for seed in range(1, 4):
                chance = random.Random(f"{share} {seed}")
                right = chance.sample(closures, 100)
                wrong = []
                while len(wrong) < round(100 * share / (1 - share)):
                    i, k = chance.sample(range(nodes), 2)
                    if abs(i - k) > 1:
                        yaw = chance.uniform(-math.pi, math.pi) / 2
                        wrong.append(
                            f"EDGE_SE3:QUAT {i} {k} {chance.uniform(-40, 40)} "
                            f"{chance.uniform(-40, 40)} {chance.uniform(-5, 5)} 0 0 "
                            f"{math.sin(yaw)} {math.cos(yaw)} "
                            + "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 4 0 0 4 0 4")
                self.optimize(self.write("\n".join(base + right)), out="clean.g2o")
                result = self.optimize(self.write("\n".join(base + right + wrong)), "--robust",
                                       "dcs")
                clean, robust = (self.read(name) for name in ("clean.g2o", "out.g2o"))
                kept = robust["edges"] & {tuple(line.split()[1:3]) for line in wrong}
                kept -= {tuple(line.split()[1:3]) for line in base + right}
                with self.subTest(f"{share} {seed}"):
                    self.assertEqual(kept, set())
                    self.assertLessEqual(result["rejected"], len(wrong) + 3)
                    self.assertLess(self.rmse_m(clean["poses"], robust["poses"]), 0.1)

    def read(self, name):
        lines = [line.split() for line in (self.scratch / name).read_text().splitlines()]
        return {"poses": {line[1]: [float(number) for number in line[2:5]]
                          for line in lines if line[0].startswith("VERTEX")},
                "edges": {tuple(line[1:3]) for line in lines if line[0].startswith("EDGE")}}

    @staticmethod
    def rmse_m(a, b):
        return math.sqrt(sum(math.dist(a[node], b[node]) ** 2 for node in a) / len(a))


if __name__ == "__main__":
    unittest.main()
