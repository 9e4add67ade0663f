"""Small files such as others have: meshes, clouds, scan logs, pose graphs, sonar frames and recordings."""

import itertools
import math
import random
import struct

BEAMS, BINS = 96, 512


def write_pcd(file, points, viewpoint=(0, 0, 0, 1, 0, 0, 0)):
    header = ("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
              f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT {' '.join(map(str, viewpoint))}\n"
              f"POINTS {len(points)}\nDATA ascii\n")
    file.write_text(header + "".join(f"{x} {y} {z}\n" for x, y, z in points))


def write_graph(file, scans):
    """An OctoMap scan log: scans is a list of (position, points)."""
    def vector(*values):
        return struct.pack(f"<I{len(values)}d", len(values), *values)

    out = struct.pack("<I", len(scans))
    for number, (position, points) in enumerate(scans):
        out += struct.pack("<I", len(points)) + b"".join(vector(*point) for point in points)
        out += vector(*position) + vector(1, 0, 0, 0) + struct.pack("<I", number)
    out += struct.pack("<I", 0)  # No edges.
    file.write_bytes(out)


def wall(x):
    """Points of a wall across the x axis."""
    return [(x, 0.1 * i + 0.05, 0.1 * k + 0.05) for i in range(-10, 10) for k in range(-10, 10)]


def corner(shift=(0, 0), count=4000):
    """Points of two walls and a box, moved."""
    draw = random.Random(1)
    points = []
    for _ in range(count):
        a, z = draw.uniform(-2, 2), draw.uniform(-1, 1)
        points.append(draw.choice([(3, a, z), (a, 2.5, z), (1.5, a / 4, z)]))
    return [(x + shift[0], y + shift[1], z) for x, y, z in points]


def frame_samples(seed=1):
    """A wall over beams 20-79 in quiet noise; beam b's echo begins at bin 200 + b // 4."""
    chance = random.Random(seed)
    samples = bytearray(min(20, int(chance.expovariate(1 / 5))) if chance.random() < .4 else 0
                        for _ in range(BEAMS * BINS))
    for beam in range(20, 80):
        for i, level in enumerate((150, 170, 160, 120, 90, 60)):
            samples[(200 + beam // 4 + i) * BEAMS + beam] = level
    return bytes(samples)


def pgm(samples):
    return b"P5\n%d %d\n255\n" % (BEAMS, BINS) + samples


def ddf(frames):
    """A .ddf file of version 4: classic window 2.25-11.25 m, a frame each 0.1 s."""
    master = bytearray(1024)
    struct.pack_into("<4sIIIII", master, 0, b"DDF\x04", len(frames), 10, 1, BEAMS, 0)
    struct.pack_into("<I", master, 24, BINS)
    whole = bytes(master)
    for i, samples in enumerate(frames):
        header = bytearray(1024)
        struct.pack_into("<I", header, 0, i)
        struct.pack_into("<III", header, 48, 3, 6, 3)
        struct.pack_into("<I", header, 192, 1)
        struct.pack_into("<d", header, 268, 1468966347 + 0.1 * i)
        whole += bytes(header) + samples
    return whole


def write_boxes(file, *boxes):
    """Closed boxes (centre, half side, whether it is a hollow: its surface faces inwards) as ASCII
    STL."""
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    lines = ["solid boxes"]
    for centre_m, half_m, is_hollow in boxes:
        corners = [tuple(c + half_m * sign for c, sign in zip(centre_m, signs))
                   for signs in itertools.product((-1, 1), repeat=3)]
        for a, b, c, d in quads:
            for triangle in ((a, b, c), (a, c, d)):
                lines += ["facet normal 0 0 0", "outer loop"]
                lines += ["vertex {} {} {}".format(*corners[i])
                          for i in (triangle[::-1] if is_hollow else triangle)]
                lines += ["endloop", "endfacet"]
    file.write_text("\n".join(lines + ["endsolid boxes"]) + "\n")


def two_laps(nodes_per_lap=40):
    """A circle driven twice, with small errors, and a closure from each node to the one a lap on."""
    chance = random.Random(1)
    nodes = 2 * nodes_per_lap
    turn = 2 * math.pi / nodes_per_lap
    step = 2 * 10 * math.sin(turn / 2)

    def edge(i, k, x, y, yaw):
        x, y, yaw = x + chance.gauss(0, .02), y + chance.gauss(0, .02), yaw + chance.gauss(0, .002)
        return f"EDGE_SE2 {i} {k} {x} {y} {yaw} 2500 0 0 2500 0 250000"

    vertices = [f"VERTEX_SE2 {i} {10 * math.sin(i * turn)} {10 - 10 * math.cos(i * turn)} "
                f"{math.remainder(i * turn, 2 * math.pi)}" for i in range(nodes)]
    odometry = [edge(i, i + 1, step * math.cos(turn / 2), step * math.sin(turn / 2), turn)
                for i in range(nodes - 1)]
    closures = [edge(i, i + nodes_per_lap, 0, 0, 0) for i in range(nodes_per_lap)]
    return "\n".join(vertices + odometry + closures) + "\n"
