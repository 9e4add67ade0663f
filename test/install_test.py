"""An installed Vogmap works away from its source tree."""

import os
import subprocess
import unittest

from vog_testing import VogTest

BUILD = os.environ.get("VOG_BUILD", "build")


class InstallTest(VogTest):
    def test_the_installed_programs_fly_an_installed_mission(self):
        prefix = self.scratch / "prefix"
        subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix], check=True,
                       stdout=subprocess.DEVNULL)
        for program in ("vog-sim", "vog-slam", "vog-planner", "vog-controller", "vog-map-service",
                        "vog-nav-bridge", "vog-sonar-reader", "vog-viewer"):
            self.assertTrue((prefix / "bin" / program).is_file(), program)
        table = prefix / "share/vogmap/config/launch/hauv.pmd"
        subprocess.run([prefix / "bin/vog", "launch", table, "--validate"], check=True,
                       stdout=subprocess.DEVNULL)
        self.assertTrue((table.parent / "vogmap.service").is_file())
        done = subprocess.run(
            [prefix / "bin/vog", "mission", prefix / "share/vogmap/config/mission/tank.toml",
             "--max-submaps", "1", "--out", self.scratch / "out"],
            capture_output=True, text=True, cwd=self.scratch, timeout=600)
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
