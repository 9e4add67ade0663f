"""Every shipped configuration file is read, and every setting is described."""

import json
import re
import tomllib
import unittest

from vog_testing import ROOT, VogTest, vog


class ConfigFilesTest(VogTest):
    def test_all_shipped_files_are_good(self):
        files = sorted((ROOT / "config").rglob("*.toml"))
        self.assertGreater(len(files), 8)
        for file in files:
            with self.subTest(file.name):
                if file.parent.name == "campaign":  # Read, and found good, before the folder is made.
                    self.refuse(1, "campaign", file, "--out", "/proc/nosuch",
                                says=["/proc/nosuch", "cannot create"])
                else:
                    self.run_vog("config", file)

    def test_the_shipped_values_arrive(self):
        shown = json.loads(self.run_vog("config", ROOT / "config/mission/tank.toml", "--json"))
        self.assertEqual(shown["mission"]["max_submaps"]["value"], "105")
        self.assertEqual(shown["sonar"]["rate_hz"]["value"], "10")
        self.assertEqual(shown["scene"]["kind"]["value"], '"tank"')

    def test_each_generated_scene_has_its_mission(self):
        allowed = json.loads(self.run_vog("config", "--json"))["scene"]["kind"]["allowed"]
        for kind in re.findall(r'"(\w+)"', allowed):
            if kind == "mesh":
                continue
            with self.subTest(kind):
                mission = ROOT / f"config/mission/{kind}.toml"
                shown = json.loads(self.run_vog("config", mission, "--json"))
                self.assertEqual(shown["scene"]["kind"]["value"], f'"{kind}"')
                self.assertEqual(shown["mission"]["name"]["value"], f'"{kind}"')

    def test_output_is_a_configuration_file_with_the_same_values(self):
        text = self.run_vog("config", ROOT / "config/mission/propeller.toml")
        copy = self.scratch / "copy.toml"
        copy.write_text(text)
        self.assertEqual(self.run_vog("config", copy), text)

    def test_values_keep_all_their_digits(self):
        shown = tomllib.loads(self.run_vog("config", "--set", "sonar.max_range_m=5.630000001"))
        self.assertEqual(shown["sonar"]["max_range_m"], 5.630000001)

    def test_every_table_is_described(self):
        done = vog("config", "--set", "nosuch.key=1")
        self.assertEqual(done.returncode, 2)
        known = set(re.search(r"known tables: (.*)", done.stderr).group(1).split())
        described = set(re.findall(r"^\[+(.*?)\]+$", self.run_vog("config"), re.MULTILINE))
        self.assertEqual(described, known)

    def test_every_setting_is_explained_and_refuses_nonsense(self):
        tables = json.loads(self.run_vog("config", "--json"))
        for table, settings in tables.items():
            for key, setting in settings.items():
                with self.subTest(f"{table}.{key}"):
                    self.assertGreater(len(setting["help"]), 3)
        # One of each type.
        for assignment in ("mission.seed=1.5", "sonar.rate_hz='fast'", "exploration.min_m=[1,2]",
                           "sonar.tilt='wobble'", "planner.range_m=-1"):
            self.refuse(2, "config", "--set", assignment, says=[assignment.split("=")[0]])


if __name__ == "__main__":
    unittest.main()
