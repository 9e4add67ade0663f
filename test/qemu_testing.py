"""A machine of Debian's stock kernel in QEMU, for what this machine's kernel has not: it boots a
folder of files from memory, runs one command as root and hands back the files that it left."""

import gzip
import lzma
import os
import pathlib
import re
import shutil
import stat
import subprocess
import tarfile
import time

from vog_testing import ROOT

CACHE = pathlib.Path(os.environ.get("VOG_BUILD", ROOT / "build")) / "test-kernel"
KEPT = re.compile(r"/vmlinuz-|/kernel/(drivers/)?net/(can|sched)/")
UNPACK = {".ko": bytes, ".xz": lzma.decompress, ".gz": gzip.decompress}
ARGUMENTS = "console=ttyS0 quiet panic=-1 nokaslr mitigations=off"
# With a KVM that works the machine has started within 2 s. Others start no machine at all, which is
# remembered until this machine is booted again.
KVM_LIMIT_S = 6
NO_KVM = CACHE / "no-kvm"
BOOT_ID = pathlib.Path("/proc/sys/kernel/random/boot_id")
INIT = """#!/bin/busybox sh
/bin/busybox mkdir -p /proc /sys /dev /tmp /run /out
/bin/busybox --install -s /bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev; mount -t tmpfs tmp /tmp
ln -sf /usr/bin/dash /bin/sh  # Busybox's takes its own ip and tc.
echo 8388608 >/proc/sys/net/core/rmem_max
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
echo TEST-BEGINS
for module in {modules}; do insmod /modules/$module.ko || echo "no module $module"; done
cd /out
{command}
echo "TEST-ENDS $?"
stty -F /dev/ttyS1 raw
tar cz . >/dev/ttyS1
poweroff -f
"""


class NoMachine(Exception):
    """Why there is no such machine here."""


def tool(name, package):
    path = shutil.which(name)
    if not path:
        raise NoMachine(f"needs {name} (package {package})")
    return path


def ask(*command, **options):
    done = subprocess.run(command, capture_output=True, timeout=300, **options)
    if done.returncode != 0:
        words = done.stderr.decode(errors="replace").strip().splitlines() or ["failed"]
        raise NoMachine(f"{' '.join(command)}: {words[-1]}")
    return done.stdout


def fetch_kernel(parts):
    """The newest stock kernel that apt knows, unpacked below the build folder: its image, and the
    modules whose paths match `parts`. It is not installed."""
    depends = ask("apt-cache", "--no-recommends", "depends", "linux-image-amd64").decode()
    package = re.search(r"Depends: (linux-image-\S+)", depends)
    if not package:
        raise NoMachine("apt knows no linux-image-amd64; apt-get update?")
    folder = CACHE / package.group(1)
    if not folder.is_dir():
        partial = CACHE / "partial"
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        ask("apt-get", "download", package.group(1), cwd=partial)
        archive = next(partial.glob("*.deb"))
        with subprocess.Popen(["dpkg", "--fsys-tarfile", archive],
                              stdout=subprocess.PIPE) as unpacking:
            with tarfile.open(fileobj=unpacking.stdout, mode="r|") as files:
                for member in files:
                    if member.isfile() and KEPT.search(member.name):
                        file = partial / pathlib.Path(member.name).name
                        file.write_bytes(files.extractfile(member).read())
        archive.unlink()
        partial.rename(folder)
    modules = {}
    for file in folder.glob("*.ko*"):
        modules[file.name.split(".")[0].replace("-", "_")] = file
    return next(folder.glob("vmlinuz-*")), load_order(modules, parts)


def load_order(modules, wanted):
    """(name, content) of the wanted modules and of those they depend on, these first."""
    order = {}

    def add(name):
        if name in order:
            return
        if name not in modules:
            raise NoMachine(f"the kernel has no module {name}")
        content = UNPACK[modules[name].suffix](modules[name].read_bytes())
        for other in re.search(rb"\0depends=([^\0]*)\0", content).group(1).decode().split(","):
            if other:
                add(other.replace("-", "_"))
        order[name] = content
    for name in wanted:
        add(name)
    return list(order.items())


def may_have_kvm():
    return os.access("/dev/kvm", os.W_OK) and not (
        NO_KVM.is_file() and NO_KVM.read_text() == BOOT_ID.read_text())


def with_libraries(programs):
    """Files of the programs and of the shared libraries that they need: path -> content."""
    files = {}
    for program in map(str, programs):
        files[program] = pathlib.Path(program).read_bytes()
        listed = subprocess.run(["ldd", program], capture_output=True, text=True).stdout
        for library in re.findall(r"(/\S+) \(0x", listed):
            files[library] = pathlib.Path(library).read_bytes()
    return files


def cpio_of(files):
    """A cpio archive as the kernel unpacks it into memory; all files are executable."""
    out = bytearray()

    def add(name, mode, content):
        fields = (0, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(name) + 1, 0)
        out.extend(b"070701" + b"".join(b"%08X" % field for field in fields) + name.encode() + b"\0")
        out.extend(bytes(-len(out) % 4))
        out.extend(content)
        out.extend(bytes(-len(out) % 4))
    folders = {str(parent).lstrip("/") for name in files for parent in pathlib.PurePath(name).parents}
    for folder in sorted(folders - {"", "."}):
        add(folder, stat.S_IFDIR | 0o755, b"")
    for name, content in files.items():
        add(name.lstrip("/"), stat.S_IFREG | 0o755, content)
    add("TRAILER!!!", 0, b"")
    return bytes(out)


class Machine:
    def __init__(self, scratch, modules, memory_mb=1024):
        self.scratch, self.memory_mb = pathlib.Path(scratch), memory_mb
        self.qemu = tool("qemu-system-x86_64", "qemu-system-x86")
        self.busybox = tool("busybox", "busybox-static")
        self.kernel, self.modules = fetch_kernel(modules)
        self.console = self.scratch / "console.txt"

    def run(self, files, command, limit_s):
        """Boots with `files`, runs `command` in an empty folder; the status and that folder.
        @throws AssertionError with the console's last lines."""
        files = dict(files) | with_libraries(["/usr/bin/dash"])
        files["/bin/busybox"] = pathlib.Path(self.busybox).read_bytes()
        files["/init"] = INIT.format(modules=" ".join(name for name, _ in self.modules),
                                     command=command).encode()
        files |= {f"/modules/{name}.ko": content for name, content in self.modules}
        (self.scratch / "initramfs").write_bytes(cpio_of(files))
        if not (may_have_kvm() and self.boot("kvm", "host", limit_s)):
            self.boot("tcg", "max", limit_s)
        text = self.console.read_text(errors="replace")
        ended = re.search(r"^TEST-ENDS (\d+)", text, re.MULTILINE)
        if not ended:
            raise AssertionError("the machine did not end:\n" + "\n".join(text.splitlines()[-40:]))
        folder = self.scratch / "out"
        with tarfile.open(self.scratch / "out.tar.gz") as results:
            results.extractall(folder)
        return int(ended.group(1)), folder

    def boot(self, accelerator, cpu, limit_s):
        """Runs the machine until it is off; false where it does not start."""
        self.console.write_text("")
        command = [self.qemu, "-accel", accelerator, "-cpu", cpu, "-smp", "2", "-m",
                   str(self.memory_mb), "-nodefaults", "-no-reboot", "-display", "none",
                   "-serial", f"file:{self.console}", "-serial", f"file:{self.scratch}/out.tar.gz",
                   "-kernel", self.kernel, "-initrd", self.scratch / "initramfs",
                   "-append", ARGUMENTS]
        with open(self.scratch / "qemu.txt", "w") as words:
            machine = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=words, stderr=words)
        begin = time.monotonic()
        try:
            while machine.poll() is None and time.monotonic() - begin < limit_s:
                if accelerator == "kvm" and time.monotonic() - begin > KVM_LIMIT_S:
                    if not self.has_started():
                        NO_KVM.write_text(BOOT_ID.read_text())
                        return False
                time.sleep(0.05)
        finally:
            machine.kill()
            machine.wait()
        return self.has_started()

    def has_started(self):
        return b"TEST-BEGINS" in self.console.read_bytes()
