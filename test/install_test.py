"""An installed Vogmap works away from its source tree: programs, library, messages, Debian package."""

import json
import os
import re
import shutil
import subprocess
import sys
import unittest

from vog_testing import ROOT, VogTest

BUILD = os.environ.get("VOG_BUILD", ROOT / "build")
HEADERS_MAIN = """
find_package(vogmap REQUIRED)
add_library(headers OBJECT headers.cc)
target_link_libraries(headers vogmap::vogmap)
target_compile_options(headers PRIVATE -Wall -Wextra -Werror)
"""


class InstallTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = cls.scratch / "prefix"
        subprocess.run(["cmake", "--install", BUILD, "--prefix", cls.prefix], check=True,
                       stdout=subprocess.DEVNULL)

    def fly(self, prefix, out):
        done = subprocess.run(
            [prefix / "bin/vog", "mission", prefix / "share/vogmap/config/mission/tank.toml",
             "--max-submaps", "1", "--out", self.scratch / out],
            capture_output=True, text=True, cwd=self.scratch, timeout=600)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.scratch / out

    def build(self, source, name):
        """Configures and builds a CMake project against what is installed."""
        folder = self.scratch / name
        for command in (["-S", source, "-B", folder, f"-DCMAKE_PREFIX_PATH={self.prefix}",
                         "-DCMAKE_BUILD_TYPE=Release"], ["--build", folder]):
            done = subprocess.run(["cmake", *command], capture_output=True, text=True, timeout=600)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return folder

    def test_the_installed_programs_fly_an_installed_mission(self):
        for program in ("vog-sim", "vog-slam", "vog-planner", "vog-controller", "vog-map-service",
                        "vog-nav-bridge", "vog-sonar-reader", "vog-viewer"):
            self.assertTrue((self.prefix / "bin" / program).is_file(), program)
        table = self.prefix / "share/vogmap/config/launch/hauv.pmd"
        subprocess.run([self.prefix / "bin/vog", "launch", table, "--validate"], check=True,
                       stdout=subprocess.DEVNULL)
        self.assertTrue((table.parent / "vogmap.service").is_file())
        self.fly(self.prefix, "out")

    def test_another_program_asks_a_map(self):
        # From a copy: it may not find anything of this tree by accident.
        example = self.scratch / "example"
        shutil.copytree(ROOT / "examples/clearance", example)
        program = self.build(example, "example-build") / "clearance"
        run = self.fly(self.prefix, "asked")
        start_m = ("-2", "-1.2", "0")
        told = subprocess.run([program, run / "map", *start_m], capture_output=True, text=True)
        self.assertEqual(told.returncode, 0, told.stderr)
        hits, nearest_m, direction = re.fullmatch(
            r"1 submaps, (\d+) of 2000 rays hit, nearest (\S+) m towards (.*)\n", told.stdout).groups()
        self.assertGreater(int(hits), 20)
        # The installed program says the same of that ray.
        ray = subprocess.run(
            [self.prefix / "bin/vog", "map", "raycast", run / "map", "--json", "--range", "10", "--origin",
             *start_m, "--direction", *direction.split()], capture_output=True, text=True, check=True)
        self.assertAlmostEqual(json.loads(ray.stdout)["range_m"], float(nearest_m),
                               delta=0.09)  # One tells where the voxel begins, the other its centre.
        wrong = subprocess.run([program, self.scratch / "none", *start_m], capture_output=True, text=True)
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("none", wrong.stderr)

    def test_every_installed_header_stands_alone(self):
        folder = self.scratch / "headers"
        folder.mkdir()
        root = self.prefix / "include/vogmap"
        headers = sorted(str(file.relative_to(root)) for file in root.rglob("*.h"))
        self.assertIn("lib/vogmap/vog_map.h", headers)
        self.assertFalse([name for name in headers if name.endswith("_testing.h")])
        (folder / "headers.cc").write_text("".join(f'#include "{name}"\n' for name in headers))
        (folder / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.20)\nproject(headers LANGUAGES CXX)\n" + HEADERS_MAIN)
        self.build(folder, "headers-build")

    def test_scripts_speak_the_messages(self):
        script = ("import vog; m = vog.waypoint_t(); m.position_m = [1, 2, 3]; m.yaw_rad = .5;"
                  "n = vog.waypoint_t.decode(m.encode()); print(*n.position_m, n.yaw_rad)")
        said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True,
                              env={**os.environ, "PYTHONPATH": str(self.prefix / "share/vogmap/python")})
        self.assertEqual(said.stdout, "1.0 2.0 3.0 0.5\n")

    @unittest.skipUnless(all(map(shutil.which, ("dpkg-deb", "dpkg-shlibdeps"))), "needs dpkg-dev")
    def test_the_debian_package_has_all_of_it(self):
        subprocess.run(["cpack", "--config", f"{BUILD}/CPackConfig.cmake", "-B", self.scratch / "package"],
                       check=True, stdout=subprocess.DEVNULL)
        package, = (self.scratch / "package").glob("*.deb")
        depends = subprocess.run(["dpkg-deb", "--field", package, "Depends"], capture_output=True, text=True,
                                 check=True).stdout
        for name in "liblcm1", "liboctomap", "libfcl":
            self.assertIn(name, depends)
        root = self.scratch / "root"
        subprocess.run(["dpkg-deb", "--extract", package, root], check=True)
        names = {str(file.relative_to(self.prefix)) for file in self.prefix.rglob("*") if file.is_file()}
        packed = {str(file.relative_to(root / "usr")) for file in root.rglob("*") if file.is_file()}
        self.assertEqual(packed, names)
        self.fly(root / "usr", "packaged")


if __name__ == "__main__":
    unittest.main()
