"""Saved maps after SIGKILL at any moment: the map of before, the new one, or none; never a mixture."""

import json
import random
import shutil
import signal
import subprocess
import time
import unittest

from vog_testing import BIN, IS_SANITIZED, VogTest, contents, vog

KILLS = 12 if IS_SANITIZED else 40


def write_clouds(folder, count, shift):
    """Clouds of a rough wall, a submap each."""
    folder.mkdir()
    noise = random.Random(shift)
    for number in range(count):
        points = [(2 + shift + 0.1 * noise.random(), 0.1 * i, 0.1 * k)
                  for i in range(30) for k in range(30)]
        (folder / f"{number}.pcd").write_text(
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
            f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT {shift} {0.3 * number} 0 1 0 0 0\n"
            f"POINTS {len(points)}\nDATA ascii\n"
            + "".join(f"{x} {y} {z}\n" for x, y, z in points))


class MapSaveTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.random = random.Random(1)
        for name, count, shift in (("a", 9, 0), ("b", 7, 5)):
            write_clouds(cls.scratch / f"clouds-{name}", count, shift)
            start = time.monotonic()
            cls.run_vog(cls(), *cls.build(name, cls.scratch / name))
            cls.duration_s = time.monotonic() - start
        cls.whole = {name: contents(cls.scratch / name) for name in ("a", "b")}

    @classmethod
    def build(cls, name, out):
        return ("map", "build", cls.scratch / f"clouds-{name}", "--voxel-size", 0.1,
                "--free-space", "rays", "--out", out)

    def kill_at_some_moment(self, *arguments):
        process = subprocess.Popen([BIN / "vog", *map(str, arguments)], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        time.sleep(1.2 * self.duration_s * self.random.random())
        process.send_signal(signal.SIGKILL)
        process.wait()

    def check_is_whole(self, folder, name):
        """`folder` holds exactly the map `name`, whatever else lies there."""
        self.assertEqual((folder / "map.toml").read_bytes(), self.whole[name]["map.toml"])
        info = json.loads(self.run_vog("map", "info", folder, "--json"))
        expected = json.loads(self.run_vog("map", "info", self.scratch / name, "--json"))
        self.assertEqual(info["faults"], [])
        for key in ("submaps", "known_voxels", "occupied_voxels", "min_W_m", "max_W_m"):
            self.assertEqual(info[key], expected[key])

    def test_a_killed_build_leaves_a_whole_map_or_none(self):
        out = self.scratch / "out"
        found = 0
        for kill in range(KILLS):
            name = "ab"[kill % 2]
            self.kill_at_some_moment(*self.build(name, out))
            if not (out / "map.toml").exists():
                self.refuse(2, "map", "info", out, says=["no map here"])
                continue
            found += 1
            self.check_is_whole(out, name)
            # The next one begins among all that this one left.
            (out / "map.toml").unlink()
        self.assertGreater(found, 0)
        self.run_vog(*self.build("b", out))
        self.check_is_whole(out, "b")
        for file, content in self.whole["b"].items():
            self.assertEqual((out / file).read_bytes(), content, file)
        self.assertEqual([file for file in contents(out)
                          if file.endswith(".tmp") or "-" in file], [])

    def test_a_killed_merge_leaves_a_whole_map_or_none(self):
        merge = ("map", "merge", self.scratch / "a", self.scratch / "b", "--out")
        self.run_vog(*merge, self.scratch / "merged")
        self.whole["merged"] = contents(self.scratch / "merged")
        for kill in range(KILLS // 2):
            out = self.scratch / f"merged-{kill}"
            self.kill_at_some_moment(*merge, out)
            if (out / "map.toml").exists():
                self.check_is_whole(out, "merged")
            shutil.rmtree(out, ignore_errors=True)
        for name in ("a", "b"):
            self.assertEqual(contents(self.scratch / name), self.whole[name])

    def test_a_killed_pack_harms_nothing(self):
        out = self.scratch / "packed"
        shutil.copytree(self.scratch / "a", out)
        for kill in range(KILLS // 2):
            if kill % 2:
                (out / "compact.bin").unlink(missing_ok=True)
            self.kill_at_some_moment("map", "pack", out)
            info = json.loads(self.run_vog("map", "info", out, "--json"))
            self.assertIn(info["compact_file"], ("valid", "missing"))
            self.check_is_whole(out, "a")
        self.run_vog("map", "pack", out)
        self.assertEqual((out / "compact.bin").read_bytes(), self.whole["a"]["compact.bin"])


if __name__ == "__main__":
    unittest.main()
