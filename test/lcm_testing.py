"""Just enough of LCM to ask a process something: packets on UDP multicast, types by lcm-gen."""

import importlib
import socket
import struct
import subprocess
import sys
import time

from vog_testing import ROOT

GROUP = "239.255.76.67"
SHORT_MESSAGE = 0x4c433032


def import_types(folder):
    """The messages of lcmtypes as the Python package `vog`, made in `folder`."""
    subprocess.run(["lcm-gen", "--python", "--ppath", str(folder),
                    *map(str, sorted((ROOT / "lcmtypes").glob("*.lcm")))], check=True)
    sys.path.insert(0, str(folder))
    return importlib.import_module("vog")


def port_of(url):
    """Of an LCM address such as udpm://239.255.76.67:7667?ttl=0."""
    return int(url.rsplit(":", 1)[1].split("?")[0])


class Listener:
    """Says and hears short messages on one port of this machine."""

    def __init__(self, port):
        self.address = (GROUP, port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.socket.bind(self.address)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                               socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0"))

    def close(self):
        self.socket.close()

    def say(self, channel, message):
        self.socket.sendto(struct.pack(">II", SHORT_MESSAGE, 0) + channel.encode() + b"\0"
                           + message.encode(), self.address)

    def hear(self, channel, timeout_s):
        """The next short message on `channel`, or None."""
        end = time.monotonic() + timeout_s
        while (left_s := end - time.monotonic()) > 0:
            self.socket.settimeout(left_s)
            try:
                packet = self.socket.recv(1 << 16)
            except TimeoutError:
                return None
            name, _, content = packet[8:].partition(b"\0")
            if packet[:4] == struct.pack(">I", SHORT_MESSAGE) and name.decode() == channel:
                return content
        return None


LOG_SYNC = 0xEDA1DA01
# More than the largest event of a log has.
TAIL_BYTES = 200_000


def write_log(file, events):
    """A log of (time [s], channel, message)."""
    with open(file, "wb") as log:
        for number, (time_s, channel, message) in enumerate(events):
            content = message.encode()
            log.write(struct.pack(">IQQII", LOG_SYNC, number, round(1e6 * time_s), len(channel),
                                  len(content)) + channel.encode() + content)


def read_log(file):
    """Its events: (time [s], channel, bytes)."""
    content, at, events = file.read_bytes(), 0, []
    while at + 28 <= len(content):
        sync, _, utime_us, name_size, size = struct.unpack_from(">IQQII", content, at)
        assert sync == LOG_SYNC
        at += 28
        name, data = content[at:at + name_size], content[at + name_size:at + name_size + size]
        at += name_size + size
        events.append((1e-6 * utime_us, name.decode(), data))
    return events


def log_end_s(log):
    """The time of the newest event in a log that is being written; 0 before there is one."""
    if not log.exists():
        return 0
    with open(log, "rb") as file:
        file.seek(max(0, log.stat().st_size - TAIL_BYTES))
        tail = file.read()
    at = tail.rfind(struct.pack(">I", LOG_SYNC))
    return struct.unpack_from(">Q", tail, at + 12)[0] * 1e-6 if 0 <= at <= len(tail) - 20 else 0
