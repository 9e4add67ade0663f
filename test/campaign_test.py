"""Campaigns: every mission's result, the table, and what a kill, a stop or a failure leaves."""

import json
import math
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import time
import unittest

from browser_testing import Browser
from vog_testing import BIN, IS_SANITIZED, VogTest, campaign_tables, config, contents, vog

SUBMAPS = 1 if IS_SANITIZED else 2
CASES = ("tank", "propeller-walk")
SEEDS = (1, 2)
TABLES = ("campaign.json", "campaign.txt", "campaign.html")


def case(name, mission, *settings):
    return (f'[[case]]\nname = "{name}"\nmission = "{config(mission)}"\n'
            f"set = {json.dumps(list(settings))}\n")


def processes_of(folder):
    """The processes that fly missions of the campaign in `folder`."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        try:
            line = (entry / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if b"--fly" in line and str(folder).encode() in line:
            found.append(int(entry.name))
    return found


def wait_for(condition):
    end = time.monotonic() + 600
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError
        time.sleep(0.02)


class CampaignTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        budget = f"mission.max_submaps={SUBMAPS}"
        cls.file = cls.scratch / "small.toml"
        cls.file.write_text(
            '[campaign]\nname = "small"\nseeds = "1..2"\nkeep = ["map"]\n' +
            case("tank", "tank", budget) +
            case("propeller walk", "propeller", budget, "drift.scaling=random_walk"))
        cls.flown = cls.scratch / "flown"
        cls.run_vog(cls("campaign"), "campaign", cls.file, "--out", cls.flown, "--jobs", 2)

    def campaign(self, out, *arguments):
        return self.run_vog("campaign", self.file, "--out", out, *arguments)

    def start(self, out, *arguments):
        process = subprocess.Popen([BIN / "vog", "campaign", self.file, "--out", out, *arguments],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for clean in (process.stdout.close, process.stderr.close, process.kill):
            self.addCleanup(clean)
        return process

    def assert_same_tables(self, out):
        self.assertEqual(campaign_tables(out), campaign_tables(self.flown))

    def numbers(self, name, *keys):
        """One number of each mission of a case."""
        values = []
        for seed in SEEDS:
            value = self.metrics(self.flown / name / str(seed))
            for key in keys:
                value = value[key]
            values.append(value)
        return values

    def summary(self, out):
        return {one["name"].replace(" ", "-"): one
                for one in json.loads((out / "campaign.json").read_text())["cases"]}

    # --- results ---

    def test_a_mission_is_what_vog_mission_flies(self):
        out = self.scratch / "single"
        self.run_vog("mission", config("propeller"), "--seed", 2, "--max-submaps", SUBMAPS, "--set",
                     "drift.scaling=random_walk", "--out", out)
        result = self.flown / "propeller-walk/2"
        self.assertEqual((result / "metrics.json").read_bytes(), (out / "metrics.json").read_bytes())
        self.assertEqual(contents(result / "map"), contents(out / "map"))

    def test_what_is_kept(self):
        for name in CASES:
            self.assertEqual({file.name for file in (self.flown / name).iterdir()}, {"1", "2"})
            for seed in SEEDS:
                self.assertEqual({file.name for file in (self.flown / name / str(seed)).iterdir()},
                                 {"metrics.json", "timing.json", "timeseries.json", "map"})
        self.assertEqual({file.name for file in self.flown.iterdir()},
                         {*CASES, *TABLES, "missions.json", "campaign.lock"})

    def test_the_table_follows_from_the_missions(self):
        for name, summary in self.summary(self.flown).items():
            self.assertEqual(summary["missions"], 2)
            self.assertEqual(summary["failed"], [])
            for keys in (("rmse_m", "vog"), ("rmse_m", "standard"), ("coverage", "surface"),
                         ("position_error_m", "odometry", "mean"), ("collisions",), ("submaps",)):
                figure = summary["figures"]
                for key in keys:
                    figure = figure[key]
                a, b = self.numbers(name, *keys)
                half = 12.706204736432095 * abs(a - b) / 2  # Student's t for one degree of freedom.
                self.assertEqual(figure["n"], 2)
                self.assertAlmostEqual(figure["mean"], (a + b) / 2, delta=1e-12)
                self.assertAlmostEqual(figure["standard_deviation"], abs(a - b) / math.sqrt(2),
                                       delta=1e-12)
                self.assertAlmostEqual(figure["interval_95"][0], (a + b) / 2 - half, delta=1e-9)
                self.assertAlmostEqual(figure["interval_95"][1], (a + b) / 2 + half, delta=1e-9)
            vog_m, standard_m = (self.numbers(name, "rmse_m", map_name)
                                 for map_name in ("vog", "standard"))
            ratio = summary["ratios"]["rmse_m_vog_to_standard"]
            self.assertAlmostEqual(ratio["value"], sum(vog_m) / sum(standard_m), delta=1e-12)
            self.assertAlmostEqual(ratio["interval_95"][0],
                                   min(v / s for v, s in zip(vog_m, standard_m)), delta=1e-12)
            errors = zip(self.numbers(name, "position_error_m", "estimate", "mean"),
                         self.numbers(name, "position_error_m", "odometry", "mean"), SEEDS)
            self.assertEqual(summary["closures_against_none"]["position_error_m"]["worse_seeds"],
                             [seed for estimate, odometry, seed in errors
                              if estimate > odometry + 1e-9])

    def test_one_job_gives_the_same_bytes(self):
        out = self.scratch / "one-job"
        self.assertEqual(self.campaign(out, "--jobs", 1), (self.flown / "campaign.txt").read_text())
        mine, theirs = contents(out), contents(self.flown)
        for files in (mine, theirs):
            for name in [name for name in files if name.endswith("timing.json")]:
                del files[name]
            del files["campaign.html"]
        self.assertEqual(mine, theirs)
        self.assert_same_tables(out)

    def test_other_seeds_of_the_same_missions(self):
        out = self.scratch / "other-seeds"
        shutil.copytree(self.flown, out)
        before = (out / "tank/2/metrics.json").stat().st_mtime_ns
        told = json.loads(self.campaign(out, "--seeds", "2", "--json"))
        self.assertEqual(told, json.loads((out / "campaign.json").read_text()))
        figure = told["cases"][0]["figures"]["rmse_m"]["vog"]
        self.assertEqual((figure["n"], figure["interval_95"]), (1, None))
        self.assertEqual((out / "tank/2/metrics.json").stat().st_mtime_ns, before)

    def test_some_of_the_cases(self):
        out = self.scratch / "some-cases"
        told = json.loads(self.campaign(out, "--seeds", "1", "--json", "--cases", "walk"))
        self.assertEqual([one["name"] for one in told["cases"]], ["propeller walk"])
        self.assertEqual([file.name for file in (out / "tank").iterdir()], [])
        mine, theirs = (folder / "propeller-walk/1/metrics.json" for folder in (out, self.flown))
        self.assertEqual(mine.read_bytes(), theirs.read_bytes())
        self.campaign(out)  # The same folder's others.
        self.assert_same_tables(out)

    def test_without_gnuplot_there_is_no_report(self):
        out = self.scratch / "no-gnuplot"
        shutil.copytree(self.flown, out)
        done = vog("campaign", self.file, "--out", out, env={**os.environ, "PATH": "/nosuch"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("gnuplot-nox", done.stderr)
        self.assertFalse((out / "campaign.html").exists())
        self.assertEqual((out / "campaign.txt").read_text(), (self.flown / "campaign.txt").read_text())

    def test_reports_that_are_kept_are_led_to(self):
        file, out = self.scratch / "reports.toml", self.scratch / "reports"
        file.write_text('[campaign]\nname = "<b>&"\nkeep = ["report"]\n' +
                        case("tank", "tank", "mission.max_submaps=1"))
        self.run_vog("campaign", file, "--seeds", 3, "--out", out)
        page = (out / "campaign.html").read_text()
        self.assertIn("<h1>Campaign &lt;b&gt;&amp;</h1>", page)
        for link in re.findall(r'href="([^"]+)"', page):
            self.assertTrue((out / link).is_file(), link)
        self.assertIn('href="tank/3/report.html"', page)

    @unittest.skipIf(shutil.which("chromium") is None, "needs chromium")
    def test_reports_in_a_browser(self):
        """Campaign and mission, wide and narrow: nothing fails to load, all pictures are there."""
        file, out = self.scratch / "looked-at.toml", self.scratch / "looked-at"
        file.write_text('[campaign]\nname = "looked at"\nkeep = ["report"]\n' +
                        case("tank", "tank", "mission.max_submaps=3"))
        self.run_vog("campaign", file, "--seeds", "1..2", "--out", out)
        browser = Browser()
        self.addCleanup(browser.close)
        for width in 1440, 390:
            page = browser.open((out / "campaign.html").as_uri(), width=width)
            self.check_looks(page, "Campaign looked at", pictures=3)
            page.click(selector='a[href="tank/2/report.html"]')
            page.wait("document.querySelector('h1').textContent.includes('tank')")
            self.check_looks(page, "tank", pictures=5)

    def check_looks(self, page, heading, pictures):
        self.assertIn(heading, page.run("document.querySelector('h1').textContent"))
        images = page.run("""[...document.querySelectorAll('img, svg')].map((image) =>
            image.complete === false || image.naturalWidth === 0 ? 0 : image.getBoundingClientRect().width)""")
        self.assertGreaterEqual(len(images), pictures)
        self.assertGreater(min(images), 0)
        self.assertLessEqual(page.run("document.documentElement.scrollWidth - window.innerWidth"), 0)
        # It is whole: nothing comes from elsewhere.
        self.assertEqual(page.run("performance.getEntriesByType('resource').filter((r) => "
                                  "!r.name.startsWith('data:')).map((r) => r.name)"), [])
        self.assertEqual(page.faults(), [])

    # --- breaking off ---

    def test_killed_missions_and_campaigns_go_on_to_the_same_table(self):
        out = self.scratch / "killed"
        killed = self.start(out, "--jobs", "1")
        wait_for(lambda: (out / "tank/1").exists())
        self.refuse(1, "campaign", self.file, "--out", out, says=["another", out])
        wait_for(lambda: (out / "tank/2.part/lcm.log").exists())
        killed.kill()
        killed.wait()
        wait_for(lambda: not processes_of(out))  # They die with it.
        self.assertFalse((out / "campaign.json").exists())
        first = (out / "tank/1/metrics.json").stat().st_mtime_ns
        again = self.start(out, "--jobs", "1")
        wait_for(lambda: (out / "tank/2.part/lcm.log").exists() and processes_of(out))
        os.kill(processes_of(out)[0], signal.SIGKILL)
        self.assertEqual(again.communicate(timeout=1500)[1], "")
        self.assertEqual(again.returncode, 0)
        self.assertEqual((out / "tank/1/metrics.json").stat().st_mtime_ns, first)
        self.assert_same_tables(out)

    def test_a_stop_leaves_nothing_running(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            out = self.scratch / f"stopped-{number}"
            process = self.start(out, "--jobs", "2")
            wait_for(lambda: len(processes_of(out)) == 2)
            process.send_signal(number)
            error = process.communicate(timeout=60)[1]
            self.assertEqual(process.returncode, 1)
            self.assertEqual(error.count("\n"), 1, error)
            self.assertIn("the same command goes on", error)
            self.assertEqual(processes_of(out), [])
            self.assertFalse((out / "campaign.json").exists())

    def test_a_mission_that_fails_is_told_and_the_others_fly(self):
        file, out = self.scratch / "failing.toml", self.scratch / "failing"
        file.write_text(case("long", "tank", "mission.max_submaps=40") +
                        case("short", "tank", "mission.max_submaps=1"))

        def small_disk():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))

        done = vog("campaign", file, "--seeds", "5", "--out", out, preexec_fn=small_disk)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn("1 of 2 missions failed", done.stderr)
        self.assertIn("failed: long, seed 5: long/5.part/lcm.log", done.stdout)
        summary = self.summary(out)
        self.assertEqual([failure["seed"] for failure in summary["long"]["failed"]], [5])
        self.assertIsNone(summary["long"]["figures"]["rmse_m"]["vog"])
        self.assertEqual(summary["short"]["figures"]["rmse_m"]["vog"]["n"], 1)
        self.assertFalse((out / "long/5").exists())

    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler")
    def test_a_file_system_without_locks(self):
        source, library = self.scratch / "no_locks.c", self.scratch / "no_locks.so"
        source.write_text("#include <errno.h>\n"
                          "int flock(int fd, int how) { (void)fd; (void)how; errno = ENOSYS; return -1; }\n")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
        out = self.scratch / "no-locks"
        shutil.copytree(self.flown, out)
        done = vog("campaign", self.file, "--out", out, env={**os.environ, "LD_PRELOAD": str(library)})
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    # --- refusals ---

    def refuse_file(self, text, *says, out="refused"):
        file = self.scratch / "bad.toml"
        file.write_text(text)
        self.refuse(2, "campaign", file, "--out", self.scratch / out, says=says)
        self.assertFalse((self.scratch / "refused").exists())

    def test_bad_files(self):
        good = case("tank", "tank")
        self.refuse_file("[campaign]\n", "bad.toml", "[[case]]")
        self.refuse_file("[case]\nname = 'x'\n", "bad.toml:1", "[[case]]")
        self.refuse_file("[campaign]\nseeds = '5..2'\n" + good, "bad.toml:2", "A..B", "5..2")
        self.refuse_file("[campaign]\nkeep = ['maps']\n" + good, "bad.toml:2", "maps", '"map"')
        self.refuse_file("[campaign]\nkeep = 'map'\n" + good, "bad.toml:2", "list of strings")
        self.refuse_file("[campaign]\nseed = '1'\n" + good, "bad.toml:2", "campaign.seed", "seeds")
        self.refuse_file("[[case]]\nname = 'a/b'\n", "bad.toml:2", "letters", "a/b")
        self.refuse_file("[[case]]\nname = 'x'\n", "bad.toml:2", "mission")
        self.refuse_file("[[case]]\nname = 'x'\nmission = 'no.toml'\n", "bad.toml:2", "no.toml")
        self.refuse_file(good + good, "bad.toml:6", "already")
        self.refuse_file(case("x", "tank", "planer.x=1"), "bad.toml:2", "planer.x=1", "planner")
        self.refuse_file(case("x", "tank", "mission.seed=3"), "bad.toml:2", "seeds")
        self.refuse_file(case("x", "tank", "simulation.start_position_m=[0,0,90]"), "bad.toml:2",
                         "start")
        self.refuse_file("[[case]]\nname = 'x'\nmission = '%s'\nscene = 'no.stl'\n" % config("tank"),
                         "bad.toml:2", "no.stl")

    def test_folders_of_others(self):
        before = contents(self.flown)
        for change, says in ((("max_submaps=", "max_submaps=1"), "max_submaps"),
                             (("keep = [\"map\"]", "keep = []"), "map"),  # "map": true there, "map": false here
                             (("name = \"small\"", "name = \"big\""), "big")):
            self.refuse_file(self.file.read_text().replace(*change), "other settings", says,
                             out="flown")
        self.assertEqual(contents(self.flown), before)
        full = self.scratch / "full"
        full.mkdir()
        (full / "thesis.tex").write_text("")
        self.refuse(2, "campaign", self.file, "--out", full, says=["thesis.tex"])
        self.assertEqual([file.name for file in full.iterdir()], ["thesis.tex"])

    def test_bad_arguments(self):
        out = self.scratch / "refused"
        self.refuse(2, "campaign", "--out", out, says=["campaign file", "--help"])
        self.refuse(2, "campaign", self.file, "--out", out, "--seeds", "1-3", says=["--seeds", "A..B"])
        self.refuse(2, "campaign", self.file, "--out", out, "--cases", "tank", "wreck",
                    says=["--cases", "'wreck'", "'tank', 'propeller walk'"])
        self.refuse(2, "campaign", self.file, "--out", out, "--jobs", 0, says=["--jobs"])
        self.refuse(2, "campaign", self.file, "--out", out, "--engine", "x", says=["local"])
        self.refuse(2, "campaign", "--fly", "tank/1", "--out", out, says=["no campaign"])
        self.refuse(2, "campaign", "--fly", "nosuch/1", "--out", self.flown, says=["nosuch/1"])
        self.assertFalse(out.exists())
        self.assertIn("[[case]]", vog("campaign", "--help").stdout)


if __name__ == "__main__":
    unittest.main()
