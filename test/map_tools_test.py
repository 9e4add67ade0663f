"""Maps from recorded data of others, questions to them, and exports that others open."""

import json
import math
import random
import shutil
import signal
import subprocess
import unittest

from lcm_testing import Listener, import_types
from recordings import wall, write_graph, write_pcd
from vog_testing import BIN, VogTest, contents, vog


class MapToolsTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        clouds = cls.scratch / "clouds"
        clouds.mkdir()
        # Ten clouds, so that the order by number differs from that by name.
        for number in range(11):
            write_pcd(clouds / f"{number}.pcd", wall(2.05 - 0.1 * number),
                      (0.1 * number, 0, 0, 1, 0, 0, 0))
        cls.map = cls.scratch / "map"
        cls.run_vog(cls(), "map", "build", clouds, "--voxel-size", 0.1, "--free-space", "rays",
                    "--out", cls.map)

    def query(self, *points, method="direct"):
        file = self.scratch / "points.txt"
        file.write_text("# x y z\n" + "".join(f"{x} {y} {z}\n" for x, y, z in points))
        lines = self.run_vog("map", "query", self.map, "--points", file, "--method", method)
        return [line.split() for line in lines.splitlines()]

    def test_clouds_become_submaps_in_the_order_of_their_numbers(self):
        info = json.loads(self.run_vog("map", "info", self.map, "--json"))
        self.assertEqual(info["submaps"], 11)
        self.assertEqual(info["faults"], [])
        vertices = [line.split() for line in (self.map / "graph.g2o").read_text().splitlines()
                    if line.startswith("VERTEX")]
        self.assertEqual([int(v[1]) for v in vertices], list(range(11)))
        for number, vertex in enumerate(vertices):
            self.assertAlmostEqual(float(vertex[2]), 0.1 * number)

    def test_points(self):
        for method in ("direct", "cached", "algorithm1", "incremental_merge"):
            answers = self.query((2.05, 0.05, 0.05), (1.05, 0.05, 0.05), (-5, 0, 0), method=method)
            self.assertEqual([answer[3] for answer in answers], ["occupied", "free", "unknown"])
            self.assertTrue(math.isnan(float(answers[2][4])))
            self.assertGreater(float(answers[0][4]), 1)
        self.assertEqual(self.query((2.06, 0.01, 0.09), method="cached")[0][:3],
                         ["2.05", "0.05", "0.05"])
        self.refuse(2, "map", "query", self.map, "--points", self.scratch / "no", says=["no"])
        (self.scratch / "bad.txt").write_text("1 2 3\n1 2\n")
        self.refuse(2, "map", "query", self.map, "--points", self.scratch / "bad.txt",
                    says=["bad.txt:2"])

    def test_points_from_standard_input(self):
        done = vog("map", "query", self.map, input="2.05 0.05 0.05\n")
        self.assertIn("occupied", done.stdout)

    def test_rays(self):
        for method in ("cached", "direct", "algorithm1", "incremental_merge"):
            answer = json.loads(self.run_vog(
                "map", "raycast", self.map, "--origin", 0.05, 0.05, 0.05, "--direction", 1, 0, 0,
                "--range", 5, "--method", method, "--json"))
            self.assertTrue(answer["hit"], method)
            self.assertAlmostEqual(answer["range_m"], 2.0, delta=0.051)
            self.assertEqual(answer["ray"][-1]["state"], "occupied")
        nothing = json.loads(self.run_vog(
            "map", "raycast", self.map, "--origin", 0.05, 0.05, 0.05, "--direction", -1, 0, 0,
            "--range", 5, "--json"))
        self.assertFalse(nothing["hit"])
        self.refuse(2, "map", "raycast", self.map, "--origin", 0, 0, 0, "--direction", 1, 0, 0,
                    "--range", 5, "--method", "nosuch", says=["nosuch", "incremental_merge"])

    def test_exports(self):
        for kind in ("ot", "bt", "ply", "pcd", "vtk"):
            self.run_vog("map", "export", self.map, self.scratch / f"out.{kind}")
        occupied = sum(answer[3] == "occupied" for answer in self.query(*wall(2.05)))
        self.assertEqual(occupied, 400)
        ply = (self.scratch / "out.ply").read_bytes()
        self.assertGreaterEqual(int(ply.split(b"element vertex ")[1].split()[0]), 400)
        if shutil.which("convert_octree"):
            done = subprocess.run(["convert_octree", self.scratch / "out.ot",
                                   self.scratch / "theirs.bt"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertEqual((self.scratch / "theirs.bt").read_bytes(),
                             (self.scratch / "out.bt").read_bytes())
        self.refuse(2, "map", "export", self.map, self.scratch / "out.xyz", says=["out.xyz", ".vtk"])
        self.refuse(1, "map", "export", self.map, "/proc/nosuch/out.ot", says=["/proc/nosuch"])

    def test_scan_logs_of_octomap(self):
        file, out = self.scratch / "scans.graph", self.scratch / "scans"
        write_graph(file, [((0, 0, 0), wall(2.05)), ((0.5, 0, 0), wall(1.55))])
        self.run_vog("map", "build", file, "--voxel-size", 0.1, "--scans-per-submap", 1, "--out",
                     out)
        info = json.loads(self.run_vog("map", "info", out, "--json"))
        self.assertEqual((info["submaps"], info["scans"]), (2, 2))
        done = vog("map", "query", out, input="2.05 0.05 0.05\n1.05 0.05 0.05\n")
        self.assertEqual([line.split()[3] for line in done.stdout.splitlines()],
                         ["occupied", "free"])

    def test_z_down_data_is_turned(self):
        clouds, out = self.scratch / "down", self.scratch / "down-map"
        clouds.mkdir()
        write_pcd(clouds / "0.pcd", [(1.05, 2.05, 3.05)], (0, 0, 1, 1, 0, 0, 0))
        self.run_vog("map", "build", clouds, "--z-down", "--voxel-size", 0.1, "--out", out)
        done = vog("map", "query", out, "--method", "direct", input="1.05 -2.05 -4.05\n")
        self.assertIn("occupied", done.stdout)

    def test_octrees_of_octomap(self):
        for kind in ("ot", "bt"):
            file, out = self.scratch / f"whole.{kind}", self.scratch / f"from-{kind}"
            self.run_vog("map", "export", self.map, file)
            self.run_vog("map", "build", file, "--out", out)
            info = json.loads(self.run_vog("map", "info", out, "--json"))
            self.assertEqual((info["submaps"], info["voxel_size_m"]), (1, 0.1))
            done = vog("map", "query", out, input="2.05 0.05 0.05\n1.05 0.05 0.05\n-5 0 0\n")
            self.assertEqual([line.split()[3] for line in done.stdout.splitlines()],
                             ["occupied", "free", "unknown"])
            bad = self.scratch / f"bad.{kind}"
            for length in (0, 10, 100, len(file.read_bytes()) - 1):
                bad.write_bytes(file.read_bytes()[:length])
                self.refuse(2, "map", "build", bad, "--out", self.scratch / "n", says=[bad])
        self.assertFalse((self.scratch / "n").exists())

    def test_merged_maps(self):
        other, out = self.scratch / "other", self.scratch / "merged"
        clouds = self.scratch / "other-clouds"
        clouds.mkdir()
        for number in range(2):
            write_pcd(clouds / f"{number}.pcd", wall(2.05), (20, number, 0, 1, 0, 0, 0))
        build = ("map", "build", clouds, "--out")
        self.run_vog(*build, other, "--voxel-size", 0.1)
        before = contents(self.map)
        self.run_vog("map", "merge", self.map, other, "--out", out)
        info = json.loads(self.run_vog("map", "info", out, "--json"))
        self.assertEqual((info["submaps"], info["faults"], info["compact_file"]),
                         (13, [], "valid"))
        done = vog("map", "query", out, input="2.05 0.05 0.05\n22.05 0.05 0.05\n10 0 0\n")
        self.assertEqual([line.split()[3] for line in done.stdout.splitlines()],
                         ["occupied", "occupied", "unknown"])
        lines = [line.split() for line in (out / "graph.g2o").read_text().splitlines()]
        self.assertEqual([line[1] for line in lines if line[0].startswith("VERTEX")],
                         [str(number) for number in range(13)])
        self.assertEqual([line[1] for line in lines if line[0] == "FIX"], ["0", "11"])
        edges = [(int(line[1]), int(line[2])) for line in lines if line[0].startswith("EDGE")]
        self.assertEqual(edges, [(n, n + 1) for n in range(10)] + [(11, 12)])
        self.assertEqual(contents(self.map), before)
        self.refuse(2, "map", "merge", self.map, "--out", out, says=["already"])
        self.run_vog(*build, self.scratch / "coarse", "--voxel-size", 0.2)
        self.refuse(2, "map", "merge", self.map, self.scratch / "coarse", "--out",
                    self.scratch / "n", says=["coarse", "voxels"])
        self.refuse(1, "map", "merge", self.map, "--out", "/proc/nosuch/map", says=["/proc"])

    def test_compact_files(self):
        copy = self.scratch / "copy"
        shutil.copytree(self.map, copy)

        def state():
            return json.loads(self.run_vog("map", "info", copy, "--json"))["compact_file"]

        self.assertEqual(state(), "valid")
        self.assertEqual(json.loads(self.run_vog("map", "info", copy, "--json"))["bytes_on_disk"],
                         sum(len(content) for content in contents(copy).values()))
        good = (copy / "compact.bin").read_bytes()
        (copy / "compact.bin").write_bytes(good[:-1])
        self.assertEqual(state(), "damaged")
        (copy / "compact.bin").unlink()
        self.assertEqual(state(), "missing")
        self.run_vog("map", "pack", copy)
        self.assertEqual((copy / "compact.bin").read_bytes(), good)
        with (copy / "map.toml").open("a") as file:
            file.write("# edited\n")
        self.assertEqual(state(), "stale")
        self.run_vog("map", "pack", copy)
        self.assertEqual(state(), "valid")
        self.refuse(2, "map", "pack", self.scratch / "nosuch", says=["nosuch"])

    def test_a_saved_map_answers_over_lcm(self):
        port = random.randrange(20000, 30000)
        types = import_types(self.scratch / "types")
        before = contents(self.map)
        server = subprocess.Popen(
            [BIN / "vog", "map", "serve", self.map, "--set",
             f"bus.url=udpm://239.255.76.67:{port}?ttl=0"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            if "serving" not in server.stdout.readline():
                error = server.stderr.read()
                if "multicast" in error:
                    self.skipTest(error)
                self.fail(error)
            listener = Listener(port)
            self.addCleanup(listener.close)
            request = types.map_request_t()
            request.header.sender = "test"
            request.request_id = 7
            request.kind, request.method = "points", "direct"
            request.points = 2
            request.point_W_m = [[2.05, 0.05, 0.05], [-5, 0, 0]]
            listener.say("MAP_REQUEST", request)
            chunk = types.chunk_t.decode(listener.hear("MAP_REPLY", timeout_s=30))
            reply = types.map_reply_t.decode(bytes(chunk.bytes))
            self.assertEqual((reply.request_id, reply.error, reply.count), (7, "", 2))
            self.assertGreater(reply.log_odds[0], 1)
            self.assertTrue(math.isnan(reply.log_odds[1]))
            server.send_signal(signal.SIGINT)
            self.assertEqual(server.wait(timeout=30), 0)
        finally:
            server.kill()
            server.communicate()
        self.assertEqual(contents(self.map), before)
        self.refuse(2, "map", "serve", self.scratch / "nosuch", says=["nosuch"])

    def test_damaged_maps(self):
        damaged = self.scratch / "damaged"
        shutil.copytree(self.map, damaged)
        file = damaged / "submaps/000003.ot"
        file.write_bytes(file.read_bytes()[:-20])
        info = json.loads(self.run_vog("map", "info", damaged, "--json"))
        self.assertEqual(info["submaps"], 10)
        self.assertEqual(len(info["faults"]), 1)
        self.assertIn("000003.ot", info["faults"][0])
        done = vog("map", "query", damaged, input="2.05 0.05 0.05\n")
        self.assertEqual(done.returncode, 0)
        self.assertIn("000003.ot", done.stderr)
        (damaged / "map.toml").write_text("voxel")
        self.refuse(2, "map", "info", damaged, says=["map.toml:1"])
        self.refuse(2, "map", "info", self.scratch / "nosuch", says=["nosuch"])

    def test_damaged_sources(self):
        clouds = self.scratch / "bad-clouds"
        clouds.mkdir()
        self.refuse(2, "map", "build", clouds, "--out", self.scratch / "n", says=["no .pcd"])
        write_pcd(clouds / "0.pcd", wall(1), (0, 0, 0, 1, 0, 0, 0))
        text = (clouds / "0.pcd").read_text()
        (clouds / "0.pcd").write_text(text[:len(text) // 2])
        self.refuse(2, "map", "build", clouds, "--out", self.scratch / "n", says=["0.pcd"])
        whole = self.scratch / "whole.graph"
        write_graph(whole, [((0, 0, 0), wall(2.05)[:3])])
        for length in range(0, len(whole.read_bytes()) - 4):
            (self.scratch / "bad.graph").write_bytes(whole.read_bytes()[:length])
            self.refuse(2, "map", "build", self.scratch / "bad.graph", "--out", self.scratch / "n",
                        says=["bad.graph"])
        self.assertFalse((self.scratch / "n").exists())
        self.refuse(2, "map", "build", clouds, "--out", self.map, says=["already"])


if __name__ == "__main__":
    unittest.main()
