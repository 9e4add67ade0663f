"""The house keeps its rooms: fails when a file includes a room or library that test/rooms.toml does
not allow it, or uses a word that is not pure."""

import fnmatch
import pathlib
import re
import tomllib
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
RULES = tomllib.loads((ROOT / "test/rooms.toml").read_text())
TOPS = ("lib", "procs", "hardware", "sim", "tools")
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')


def room_of(path):
    parts = path.split("/")
    return "lcmtypes" if parts[0] == "vog" else "/".join(parts[:2][:len(parts) - 1])


def matches(path, patterns):
    return any(fnmatch.fnmatch(path, pattern) for pattern in patterns)


def allowed_rooms(room):
    rooms = [room]
    for name in RULES["rooms"][room]:
        rooms += RULES["groups"].get(name, [name])
    return rooms


def faults(path, text):
    """What a file at `path` (from the root) does that it may not, a line each."""
    room = room_of(path)
    if room not in RULES["rooms"]:
        return [f"{path}: room {room} is not in test/rooms.toml"]
    found = []
    is_test = path.endswith(("_test.cc", "_testing.h", "_benchmark.cc"))
    for number, line in enumerate(text.splitlines(), 1):
        include = INCLUDE.match(line)
        if include:
            target = include.group(1)
            if target.split("/")[0] in TOPS + ("vog",):
                if not is_test and not matches(room_of(target), allowed_rooms(room)):
                    found.append(f"{path}:{number}: {room} may not include {room_of(target)}")
            for library, places in RULES["libraries"].items():
                if target.startswith(library) and not matches(path, places):
                    found.append(f"{path}:{number}: {library} may not be included here")
        for words, places in RULES["impure"].items():
            word = re.search(words, line.split("//")[0])
            if word and not matches(path, places):
                found.append(f"{path}:{number}: {word.group(0)} may not be used here")
    return found


class RoomsTest(unittest.TestCase):
    def test_all_files_keep_the_rules(self):
        found = []
        files = [file for top in TOPS for file in sorted((ROOT / top).rglob("*"))
                 if file.suffix in (".h", ".cc")]
        self.assertGreater(len(files), 100)
        for file in files:
            found += faults(file.relative_to(ROOT).as_posix(), file.read_text())
        self.assertEqual(found, [])

    def test_every_ruled_room_is_there(self):
        for room in RULES["rooms"]:
            self.assertTrue((ROOT / room).is_dir(), room)

    def test_rooms_of_the_library_make_no_cycle(self):
        def visit(room, path):
            self.assertNotIn(room, path, "cycle")
            for pattern in RULES["rooms"][room]:
                for other in RULES["rooms"]:
                    if other != room and not pattern.endswith("*") and other == pattern:
                        visit(other, path + [room])
        for room in RULES["rooms"]:
            visit(room, [])

    def test_wrong_arrows_are_found(self):
        for path, line in (
                ("lib/base/x.h", '#include "lib/bus/bus.h"'),
                ("lib/planner/x.cc", '#include "lib/vogmap/vog_map.h"'),
                ("lib/slam/x.cc", '#include "lib/bus/bus.h"'),
                ("procs/slam/x.cc", '#include "procs/planner/planner_node.h"'),
                ("sim/world/x.cc", '#include "lib/slam/slam.h"'),
                ("lib/slam/x.h", '#include "vog/graph_t.hpp"'),
                ("lib/collision/x.h", "#include <fcl/fcl.h>"),
                ("procs/viewer/x.cc", '#include "foxglove/Pose.pb.h"'),
                ("lib/slam/x.cc", "auto t = std::chrono::steady_clock::now();"),
                ("procs/sim/x.cc", "std::random_device seed;"),
                ("lib/nosuch/x.h", "")):
            self.assertEqual(len(faults(path, line)), 1, (path, line))

    def test_right_arrows_are_left_alone(self):
        for path, line in (
                ("lib/slam/x.cc", '#include "lib/posegraph/pose_graph.h"'),
                ("lib/collision/x.cc", "#include <fcl/fcl.h>"),
                ("lib/bus/x.cc", "std::chrono::steady_clock::now()"),
                ("procs/slam/x.cc", '#include "vog/graph_t.hpp"'),
                ("lib/slam/x.cc", "int i;  // steady_clock")):
            self.assertEqual(faults(path, line), [])


if __name__ == "__main__":
    unittest.main()
