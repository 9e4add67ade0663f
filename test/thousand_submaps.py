"""A log of a thousand submaps that move many times a second, made from the submaps of a short run."""

import math
import zlib

from lcm_testing import read_log, write_log

CHUNK_BYTES = 32000
RUN_ID = 77


def submaps_of(vog, log):
    """The submap_t messages of a log."""
    parts = {}
    for _, channel, content in read_log(log):
        if channel == "SUBMAP":
            chunk = vog.chunk_t.decode(content)
            parts.setdefault(chunk.item, {})[chunk.part] = chunk.bytes
    return [vog.submap_t.decode(b"".join(part[i] for i in range(len(part))))
            for _, part in sorted(parts.items())]


class Sender:
    """Fills headers as one sender of all channels does."""

    def __init__(self):
        self.sequence = {}

    def head(self, message, channel, time_s):
        header = message.header
        header.utime_us, header.run_id, header.epoch = round(1e6 * time_s), RUN_ID, 1
        header.sender = "test"
        header.sequence = self.sequence[channel] = self.sequence.get(channel, -1) + 1
        return time_s, channel, message


def submap_events(vog, sender, submap, submap_id, time_s):
    submap.base.submap_id = submap_id
    submap.first_utime_us = submap.last_utime_us = submap.base.odometry.utime_us = round(1e6 * time_s)
    content = submap.encode()
    for part, at in enumerate(range(0, len(content), CHUNK_BYTES)):
        chunk = vog.chunk_t()
        chunk.item, chunk.version, chunk.part = submap_id, submap_id + 1, part
        chunk.parts = -(-len(content) // CHUNK_BYTES)
        chunk.crc32 = zlib.crc32(content)
        chunk.bytes = content[at:at + CHUNK_BYTES]
        chunk.size = len(chunk.bytes)
        yield sender.head(chunk, "SUBMAP", time_s)


def pose_of(vog, submap_id, phase):
    """On a spiral that breathes."""
    pose = vog.pose_t()
    angle, radius_m = 0.11 * submap_id, 4 + 0.03 * submap_id + 0.5 * math.sin(phase)
    pose.position_m = [radius_m * math.cos(angle), radius_m * math.sin(angle), 0.01 * submap_id]
    pose.quaternion_wxyz = [math.cos(angle / 2), 0, 0, math.sin(angle / 2)]
    return pose


def poses(vog, submaps, version):
    message = vog.submap_poses_t()
    message.version, message.count = version, submaps
    message.submap_id = list(range(submaps))
    message.X_WM = [pose_of(vog, i, 0.1 * version) for i in range(submaps)]
    message.covariance_WM = message.covariance_MN = [vog.covariance_t() for _ in range(submaps)]
    return message


def graph(vog, submaps):
    message = vog.graph_t()
    message.version = 1
    for i in range(submaps - 1):
        edge = vog.graph_edge_t()
        edge.from_id, edge.to_id, edge.kind = i, i + 1, vog.graph_edge_t.ODOMETRY
        message.edge.append(edge)
        if i + 57 < submaps and i % 3 == 0:  # To the next turn of the spiral.
            edge = vog.graph_edge_t()
            edge.from_id, edge.to_id, edge.kind = i, i + 57, vog.graph_edge_t.FULL_CLOSURE
            edge.directions = 6
            message.edge.append(edge)
    message.count = len(message.edge)
    return message


def write_thousand(vog, file, short_log, submaps=1000, versions=300, rate_hz=30):
    """Writes the log to `file`: the submaps in the first 5 s, then poses at `rate_hz`."""
    sender, templates, events = Sender(), submaps_of(vog, short_log), []
    for i in range(submaps):
        events += submap_events(vog, sender, templates[i % len(templates)], i, 5 * i / submaps)
    # Messages are encoded as they are written: the submaps are shared, and so are encoded at once.
    events = [(t, channel, Encoded(message)) for t, channel, message in events]
    events.append(sender.head(graph(vog, submaps), "GRAPH", 5))
    for version in range(1, versions + 1):
        time_s = 5 + version / rate_hz
        events.append(sender.head(poses(vog, submaps, version), "SUBMAP_POSES", time_s))
    write_log(file, events)


class Encoded:
    def __init__(self, message):
        self.content = message.encode()

    def encode(self):
        return self.content
