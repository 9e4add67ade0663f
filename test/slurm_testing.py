"""A Slurm cluster of two nodes on this machine: munged, slurmctld and two slurmd of the user's own, in a
folder of their own, on ports of their own."""

import contextlib
import getpass
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

PACKAGE = "slurm-wlm"
DAEMONS = ("munged", "slurmctld", "slurmd")
NODES = ("n1", "n2")
START_LIMIT_S = 60
# An address for a machine that has the loopback's alone (RFC 5737, for documents): Slurm's daemons
# ask the resolver for one that others could reach, and do not start where there is none.
ADDRESS = "192.0.2.1/32"
CONFIG = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser={user}
SlurmdUser={user}
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobCompType=jobcomp/filetxt
JobCompLoc={folder}/jobs.txt
MpiDefault=none
ReturnToService=2
SlurmdTimeout=3
MessageTimeout=2
KillWait=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE
"""


class NoCluster(Exception):
    """Why there is no Slurm here."""


def find(program):
    path = shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin:/sbin")
    if not path:
        raise NoCluster(f"needs {program} (package {PACKAGE})")
    return path


def free_ports(count):
    with contextlib.ExitStack() as stack:
        probes = [stack.enter_context(socket.socket()) for _ in range(count)]
        for probe in probes:
            probe.bind(("127.0.0.1", 0))
        return [probe.getsockname()[1] for probe in probes]


def has_address():
    try:
        socket.getaddrinfo(None, "1", family=socket.AF_INET, type=socket.SOCK_STREAM,
                           flags=socket.AI_ADDRCONFIG | socket.AI_PASSIVE)
        return True
    except socket.gaierror:
        return False


def read(pid, name):
    try:
        return pathlib.Path("/proc", str(pid), name).read_bytes()
    except OSError:
        return b""


def parent_of(pid):
    stat = read(pid, "stat").rsplit(b")", 1)[-1].split()
    return int(stat[1]) if len(stat) > 1 else 0


def kill(pid):
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


class Cluster:
    """@throws NoCluster, with the reason and nothing left running."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.daemons = {}
        self.has_added_address = False
        # Jobs of this cluster alone have it in their environment.
        self.config = self.folder / "slurm.conf"
        self.environment = {**os.environ, "SLURM_CONF": str(self.config)}
        try:
            self.start()
        except NoCluster:
            self.stop()
            raise

    # --- daemons ---

    def start(self):
        programs = {name: find(name) for name in DAEMONS}
        for name in ("sbatch", "squeue", "sinfo", "scontrol", "scancel"):
            find(name)
        if not has_address():
            self.add_address()
        for name in ("state", *NODES):
            (self.folder / name).mkdir(parents=True)
        self.folder.chmod(0o755)
        self.config.write_text(CONFIG.format(host=socket.gethostname(), user=getpass.getuser(),
                                             folder=self.folder, ports=free_ports(3)))
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        self.start_daemon("munged", programs["munged"], "--foreground", "--force",
                          f"--socket={self.folder}/munge.socket", f"--key-file={key}",
                          f"--log-file={self.folder}/munged.log", f"--pid-file={self.folder}/munged.pid",
                          f"--seed-file={self.folder}/munged.seed")
        self.wait((self.folder / "munge.socket").exists, "munged")
        self.start_daemon("slurmctld", programs["slurmctld"], "-D", "-c")
        for node in NODES:
            self.start_node(node)
        self.wait(lambda: self.ask("sinfo", "--noheader", "--states=idle", "--format=%D") == "2",
                  "slurmctld", *NODES)

    def add_address(self):
        done = subprocess.run(["ip", "address", "add", ADDRESS, "dev", "lo"], capture_output=True,
                              text=True)
        if done.returncode != 0:
            raise NoCluster("this machine has the loopback's address alone, and no other may be "
                            "added: " + done.stderr.strip())
        self.has_added_address = True

    def start_daemon(self, name, *command):
        with open(self.folder / f"{name}.out", "ab") as output:
            # They end with the test, however that ends.
            self.daemons[name] = subprocess.Popen(("setpriv", "--pdeathsig", "TERM", *command),
                                                  env=self.environment, stdout=output,
                                                  stderr=output, stdin=subprocess.DEVNULL,
                                                  start_new_session=True)

    def start_node(self, node):
        self.start_daemon(node, find("slurmd"), "-D", "-N", node)

    def wait(self, condition, *names):
        end = time.monotonic() + START_LIMIT_S
        while not condition():
            for name in names:
                if self.daemons[name].poll() is not None or time.monotonic() > end:
                    said = (self.folder / f"{name}.out").read_text().strip().splitlines()
                    raise NoCluster(f"{name} does not start: {(said or ['no word'])[-1]}")
            time.sleep(0.1)

    # --- what happens to nodes ---

    def processes_of(self, node):
        """The processes of jobs on a node, those that watch over them first."""
        jobs = []
        for entry in os.listdir("/proc"):
            if entry.isdigit():
                variables = read(entry, "environ").split(b"\0")
                if (f"SLURM_CONF={self.config}".encode() in variables and
                        f"SLURMD_NODENAME={node}".encode() in variables):
                    jobs.append(int(entry))
        watchers = {parent_of(pid) for pid in jobs}
        return [pid for pid in watchers if read(pid, "cmdline").startswith(b"slurmstepd")] + jobs

    def kill_node(self, node):
        """As if its power failed: no process of it says a last word."""
        daemon = self.daemons.pop(node)
        daemon.kill()
        daemon.wait()
        while processes := self.processes_of(node):
            for pid in processes:
                kill(pid)
            time.sleep(0.02)

    # --- questions ---

    def ask(self, *command):
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=60)
        return done.stdout.strip() if done.returncode == 0 else f"failed: {done.stderr.strip()}"

    def tasks(self, *states):
        """Array tasks in the queue, as "JOB_TASK"."""
        lines = self.ask("squeue", "--array", "--noheader", "--format=%F %K %T").splitlines()
        return [f"{job}_{task}" for job, task, state in map(str.split, lines)
                if task != "N/A" and (not states or state in states)]

    def is_idle(self):
        return self.ask("squeue", "--noheader") == ""

    def ended_jobs(self):
        """What jobcomp/filetxt tells of each job that has ended: field -> text."""
        file = self.folder / "jobs.txt"
        lines = file.read_text().splitlines() if file.exists() else []
        return [dict(field.split("=", 1) for field in line.split(" ") if "=" in field)
                for line in lines]

    def stop(self):
        if "slurmctld" in self.daemons and self.daemons["slurmctld"].poll() is None:
            self.ask("scancel", "--user=" + getpass.getuser())
        for node in NODES:
            if node in self.daemons:
                self.kill_node(node)
        for daemon in self.daemons.values():
            daemon.terminate()
            try:
                daemon.wait(timeout=10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        self.daemons.clear()
        if self.has_added_address:
            subprocess.run(["ip", "address", "del", ADDRESS, "dev", "lo"], check=False)
