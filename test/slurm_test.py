"""Campaigns on a Slurm cluster: a real one of two nodes on this machine, of which one dies. Without Slurm's
programs the tests that need them are skipped, and say why."""

import json
import os
import resource
import shutil
import signal
import subprocess
import time
import unittest

from slurm_testing import Cluster, NoCluster, read
from vog_testing import BIN, ROOT, TIMEOUT_S, VogTest, campaign_tables, config, vog

SMOKE = ROOT / "config/campaign/smoke.toml"
MISSIONS = [f"{case}/{seed}" for case in ("tank", "tank-random-walk") for seed in (1, 2)]
# A cluster whose nodes do not see the campaign's folder, and one that takes arrays alone.
BLIND = {"sbatch": 'echo 7', "squeue": "exit 0", "scancel": "exit 0"}
PROUD = {**BLIND, "sbatch": 'case "$*" in *dependency*) echo "sbatch: error: QOSMaxSubmit" >&2; exit 1;; esac; echo 7'}


class WithoutSlurmTest(VogTest):
    """What needs no cluster."""

    def out(self):
        return self.scratch / self.id().rsplit(".", 1)[-1]

    def commands(self, scripts):
        """An environment in which Slurm's commands are these scripts."""
        folder = self.out().with_suffix(".bin")
        folder.mkdir()
        for name, script in scripts.items():
            (folder / name).write_text(f"#!/bin/sh\n{script}\n")
            (folder / name).chmod(0o755)
        return {**os.environ, "PATH": f"{folder}:/usr/bin:/bin"}

    def refuse_slurm(self, status, *arguments, says, **options):
        self.refuse(status, "campaign", SMOKE, "--engine", "slurm", "--out", self.out(), *arguments,
                    says=says, **options)

    def test_no_slurm(self):
        self.refuse_slurm(2, says=["sbatch", "PATH", "--engine local"],
                          env={**os.environ, "PATH": "/nosuch"})
        self.assertFalse(self.out().exists())

    def test_arguments_of_the_other_engine(self):
        for name, value in (("--sbatch", "--time=5"), ("--per-task", "3")):
            self.refuse(2, "campaign", SMOKE, "--out", self.out(), f"{name}={value}",
                        says=[name, "--engine slurm"])
        self.assertFalse(self.out().exists())

    def test_bad_arguments(self):
        environment = self.commands(BLIND)
        self.refuse_slurm(2, "--per-task", "0", says=["--per-task"], env=environment)
        for words in ("--comment='x", "--comment=$(id)", "--comment=$NO_SUCH_VARIABLE", "--time=5; id"):
            self.refuse_slurm(2, f"--sbatch={words}", says=["--sbatch", words], env=environment)

    def test_options_of_jobs_are_not_for_people(self):
        for option in ("--slurm-task", "--slurm-close"):
            self.assertNotIn(option, vog("campaign", "--help").stdout)
        self.refuse(2, "campaign", "--out", self.out(), "--slurm-task", "1", says=["Slurm"])

    def test_a_folder_that_the_nodes_do_not_see(self):
        environment = self.commands(BLIND)
        self.refuse_slurm(1, says=["job 7", "file system that all nodes share", self.out()],
                          env=environment)

    def test_a_program_that_does_not_run_on_the_nodes(self):
        log = self.out() / "slurm/round-1.log"
        environment = self.commands({**BLIND, "sbatch": f"echo 'no libfcl.so' >> '{log}'; echo 7"})
        self.refuse_slurm(1, says=["job 7", "flew no mission", "no libfcl.so", log], env=environment)

    def test_a_cluster_without_an_answer(self):
        environment = self.commands({**BLIND, "squeue": "echo 'slurm_load_jobs error: away' >&2; exit 1"})
        self.refuse_slurm(1, says=["squeue: away"], env=environment)
        environment = self.commands_again(BLIND, sbatch="echo hello")
        self.refuse_slurm(1, says=["sbatch", "hello"], env=environment)

    def commands_again(self, scripts, **changes):
        shutil.rmtree(self.out().with_suffix(".bin"))
        return self.commands({**scripts, **changes})

    def begin(self):
        """A campaign's folder, of which nothing is flown yet."""
        self.refuse_slurm(1, says=["share"], env=self.commands(BLIND))

    def test_nothing_to_fly_asks_nothing(self):
        self.begin()
        for mission in MISSIONS:
            (self.out() / mission).mkdir()
            (self.out() / mission / "metrics.json").write_text("{}")
        environment = self.commands_again(BLIND, sbatch="exit 1", squeue="exit 1")
        done = vog("campaign", SMOKE, "--engine", "slurm", "--out", self.out(), env=environment)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_two_nodes_that_fly_one_mission(self):
        self.begin()
        flights = [subprocess.Popen([BIN / "vog", "campaign", "--out", self.out(), "--fly", "tank/1"],
                                    env={**os.environ, "SLURM_JOB_ID": str(job)},
                                    stderr=subprocess.PIPE, text=True) for job in (7, 8)]
        for flight in flights:
            self.assertEqual(flight.communicate(timeout=TIMEOUT_S)[1], "")
            self.assertEqual(flight.returncode, 0)
        self.assertEqual([file.name for file in (self.out() / "tank").iterdir()], ["1"])
        self.assertEqual({file.name for file in (self.out() / "tank/1").iterdir()},
                         {"metrics.json", "timing.json", "timeseries.json"})

    def test_a_task_that_takes_its_nodes_along(self):
        self.begin()
        task = {**os.environ, "SLURM_ARRAY_TASK_ID": "1", "SLURM_RESTART_COUNT": "4"}
        self.refuse(1, "campaign", "--out", self.out(), "--slurm-task", "1", says=["began 4 times"],
                    env=task)
        self.refuse(2, "campaign", "--out", self.out(), "--slurm-task", "1", says=["no task 99"],
                    env={**task, "SLURM_ARRAY_TASK_ID": "99", "SLURM_RESTART_COUNT": "0"})
        (self.out() / "slurm/round.json").write_text('{"round": ')
        self.refuse_slurm(2, says=["round.json: damaged"],
                          env={**os.environ, "PATH": f"{self.out().with_suffix('.bin')}:/bin"})

    def test_a_closing_job_that_is_refused_is_told_and_nothing_more(self):
        done = vog("campaign", SMOKE, "--engine", "slurm", "--out", self.out(), env=self.commands(PROUD))
        first, second = done.stderr.splitlines()
        self.assertIn("only while this command waits: sbatch: QOSMaxSubmit", first)
        self.assertIn("share", second)


class SlurmTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        try:
            cls.cluster = Cluster(cls.scratch / "cluster")
        except NoCluster as reason:
            raise unittest.SkipTest(f"no Slurm: {reason}") from reason
        cls.addClassCleanup(cls.cluster.stop)
        os.environ["SLURM_CONF"] = str(cls.cluster.config)
        cls.addClassCleanup(os.environ.pop, "SLURM_CONF")
        cls.local = cls.scratch / "local"
        cls.run_vog(cls("run_vog"), "campaign", SMOKE, "--out", cls.local)

    def setUp(self):
        self.out = self.scratch / self.id().rsplit(".", 1)[-1]

    # --- campaigns ---

    def start(self, *arguments):
        process = subprocess.Popen(
            [BIN / "vog", "campaign", SMOKE, "--engine", "slurm", "--out", self.out, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for clean in (process.stdout.close, process.stderr.close, process.kill):
            self.addCleanup(clean)
        return process

    def wait_for(self, what, limit_s=300):
        end = time.monotonic() + limit_s
        while not what():
            self.assertLess(time.monotonic(), end, f"waited too long; {self.queue()}")
            time.sleep(0.1)

    def queue(self):
        log = "".join(file.read_text() for file in self.out.glob("slurm/round-*.log"))
        return f"{self.cluster.ask('squeue', '--array')}\n{self.cluster.ask('sinfo')}\n{log}"

    def finish(self, process):
        said, errors = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(errors, "", self.queue())
        self.assertEqual(process.returncode, 0)
        return said

    def flies_on(self, node):
        return any(b"--fly" in read(pid, "cmdline") for pid in self.cluster.processes_of(node))

    def lose_node(self):
        """A node dies while it flies, and is back after the test."""
        self.wait_for(lambda: self.flies_on("n2"))
        self.addCleanup(self.cluster.start_node, "n2")
        self.cluster.kill_node("n2")

    def round(self):
        return json.loads((self.out / "slurm/round.json").read_text())

    def expect_whole(self):
        """The table and each mission's numbers are those of a campaign on one machine."""
        self.assertEqual(campaign_tables(self.out), campaign_tables(self.local))
        for mission in MISSIONS:
            for name in ("metrics.json", "timeseries.json"):
                self.assertEqual((self.out / mission / name).read_bytes(),
                                 (self.local / mission / name).read_bytes())
        for case in ("tank", "tank-random-walk"):
            self.assertEqual({file.name for file in (self.out / case).iterdir()}, {"1", "2"})

    def jobs_of(self, name):
        return [job for job in self.cluster.ended_jobs() if job["Name"] == name]

    def name_of(self, message):
        return message.split("scancel --name=")[1].split()[0]

    # --- tests ---

    def test_a_node_that_is_lost(self):
        process = self.start()
        self.lose_node()
        said = self.finish(process)
        self.assertEqual(said, (self.local / "campaign.txt").read_text())
        self.expect_whole()
        self.assertEqual(self.round()["round"], 1)  # Slurm itself began the task anew.
        self.assertIn("NODE_FAIL", [job["JobState"] for job in self.cluster.ended_jobs()])

    def test_jobs_go_on_alone_with_another_round_for_what_is_lost(self):
        process = self.start("--sbatch", "--no-requeue --comment='a b'", "--per-task", "2")
        self.wait_for(lambda: self.flies_on("n2"))
        process.send_signal(signal.SIGINT)
        errors = process.communicate(timeout=60)[1]
        self.assertEqual(process.returncode, 1)
        self.assertEqual(errors.count("\n"), 1, errors)
        self.assertIn("the jobs go on", errors)
        self.assertEqual(len(self.cluster.tasks()), 2)
        self.lose_node()
        self.wait_for((self.out / "campaign.html").exists)  # Written last.
        self.expect_whole()
        self.assertEqual(self.round()["round"], 2)
        self.wait_for(self.cluster.is_idle)
        states = [job["JobState"] for job in self.jobs_of(self.name_of(errors))]
        self.assertEqual(states.count("NODE_FAIL"), 1, states)
        self.assertEqual(states.count("COMPLETED"), 1 + 1 + 1 + 1, states)  # Tasks and closing jobs.

    def test_the_same_command_comes_back_to_its_jobs(self):
        process = self.start("--jobs", "1")
        self.wait_for(lambda: self.cluster.tasks("RUNNING"))
        tasks = self.cluster.tasks()
        self.assertEqual(len(tasks), len(MISSIONS))
        process.kill()
        process.wait()
        again = self.start("--jobs", "1")
        while again.poll() is None:
            self.assertLessEqual(len(self.cluster.tasks("RUNNING")), 1)
            self.assertLessEqual(set(self.cluster.tasks()), set(tasks))
            time.sleep(0.2)
        self.finish(again)
        self.expect_whole()

    def test_cancelled_jobs_stay_so_until_the_command_comes_again(self):
        process = self.start("--seeds", "1")
        self.wait_for(lambda: self.flies_on("n1") or self.flies_on("n2"))
        job = self.round()["job"]
        self.cluster.ask("scancel", job)
        errors = process.communicate(timeout=120)[1]
        self.assertEqual(process.returncode, 1)
        self.assertEqual(errors.count("\n"), 1, errors)
        self.assertIn(f"job {job} was cancelled; the same command flies what is missing", errors)
        self.assertTrue(self.cluster.is_idle())
        self.finish(self.start())
        self.expect_whole()

    def test_a_mission_that_fails_is_told_as_on_one_machine(self):
        file = self.scratch / "failing.toml"
        file.write_text("".join(
            f'[[case]]\nname = "{name}"\nmission = "{config("tank")}"\nset = ["mission.max_submaps={submaps}"]\n'
            for name, submaps in (("long", 40), ("short", 1))))
        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (700_000, 700_000))

        # The program's copy would not fit onto that disk: it is there already.
        self.refuse(1, "campaign", file, "--seeds", "5", "--out", self.out, "--engine", "slurm",
                    "--sbatch=--partition=nosuch", says=["partition"])
        tables = []
        for out, engine in ((self.scratch / "failing", "local"), (self.out, "slurm")):
            done = vog("campaign", file, "--seeds", "5", "--out", out, "--engine", engine,
                       preexec_fn=small_disk)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn("1 of 2 missions failed", done.stderr)
            tables.append((out / "campaign.json").read_text())
        self.assertIn("killed by File size limit exceeded", tables[0])
        self.assertEqual(*tables)
        self.assertEqual(self.round()["round"], 1 + 3)  # One was refused.

    def test_sbatch_refuses(self):
        script = self.scratch / "job.sh"
        script.write_text("#!/bin/sh\n")
        for words, says in (("--partition=nosuch", "partition"), ("--no-such-option", "no-such-option"),
                            (script, "wrap")):
            self.refuse(1, "campaign", SMOKE, "--engine", "slurm", "--out", self.out,
                        f"--sbatch={words}", says=["sbatch: ", says])
        self.assertTrue(self.cluster.is_idle())


if __name__ == "__main__":
    unittest.main(verbosity=2)  # Says why it is skipped.
