"""vog log export: what others read out of an MCAP file of a mission is what its log says."""

import json
import os
import pathlib
import struct
import subprocess
import unittest
import zlib

from lcm_testing import import_types
from vog_testing import ROOT, VogTest, config, contents, vog

BUILD = pathlib.Path(os.environ.get("VOG_BUILD", ROOT / "build"))
READER = ROOT / "test/export/mcap_reader.mjs"
SUBMAPS = 2

DRAWN = {
    "TRUTH": "foxglove.PoseInFrame", "VEHICLE_NAV": "foxglove.PoseInFrame",
    "NAV": "foxglove.PoseInFrame", "POSE": "foxglove.PoseInFrame",
    "SCAN": "foxglove.PointCloud", "PLAN": "foxglove.PosesInFrame",
    "SUBMAP_POSES": "foxglove.PosesInFrame", "GRAPH": "foxglove.SceneUpdate",
    "STATUS": "foxglove.Log"}
PLAIN = {
    "RUN": "vogmap.Run", "SONAR_RETURNS": "vogmap.SonarReturns", "SUBMAP": "vogmap.Chunk",
    "MAP_STATUS": "vogmap.MapStatus", "MISSION_STATUS": "vogmap.MissionStatus",
    "REVISITS": "vogmap.Revisits", "CONTROL": "vogmap.Control", "VEHICLE_COMMAND": "vogmap.Control"}


def ask_reader(command, path):
    done = subprocess.run(["node", READER, BUILD / "export", command, path], capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def events(log):
    """Of an LCM event log: time in microseconds, channel, bytes."""
    content, at = log.read_bytes(), 0
    while at < len(content):
        _, _, utime_us, channel_bytes, data_bytes = struct.unpack_from(">IqqII", content, at)
        start = at + 28 + channel_bytes
        at = start + data_bytes
        yield utime_us, content[start - channel_bytes:start].decode(), content[start:at]


class ExportTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = vog("mission", config("tank"), "--max-submaps", str(SUBMAPS), "--out", cls.scratch / "run")
        assert done.returncode == 0, done.stderr
        cls.log = cls.scratch / "run/lcm.log"
        cls.mcap = cls.scratch / "run.mcap"
        done = vog("log", "export", cls.log, "--mcap", cls.mcap)
        assert done.returncode == 0, done.stderr
        cls.said = done.stdout
        cls.read = ask_reader("read", cls.mcap)
        cls.channels = cls.read["channels"]
        cls.types = import_types(cls.scratch)

    def counts(self):
        return {channel: found["messages"] for channel, found in
                json.loads(self.run_vog("log", "info", self.log, "--json")).items()}

    def last_of(self, channel, kind):
        """The last message of a channel in the log, and the time of its event."""
        *_, (utime_us, data) = ((utime_us, data) for utime_us, name, data in events(self.log)
                                if name == channel)
        return kind.decode(data), utime_us

    def test_every_message_is_there_and_decoded(self):
        counts = self.counts()
        self.assertEqual(self.said, f"{sum(counts.values())} messages written\n")
        topics = {topic: found["messages"] for topic, found in self.channels.items()}
        self.assertEqual({topic: topics[topic] for topic in counts}, counts)
        fields = {f"{channel}/fields": counts[channel] for channel in DRAWN}
        self.assertEqual({topic: topics[topic] for topic in fields}, fields)
        self.assertEqual(set(topics), {*counts, *fields, "tf", "tf/submaps", "SUBMAP/voxels"})
        self.assertEqual(topics["tf"], counts["NAV"] + counts["POSE"])
        self.assertEqual(topics["tf/submaps"], counts["SUBMAP_POSES"])
        self.assertEqual(topics["SUBMAP/voxels"], SUBMAPS)
        self.assertEqual(self.read["statistics"]["messages"], sum(topics.values()))
        self.assertEqual(self.read["streamed"], sum(topics.values()), "by its indexes and without")
        self.assertGreater(self.read["statistics"]["chunks"], 1)

    def test_schemas_are_those_that_others_draw(self):
        schemas = {topic: found["schema"] for topic, found in self.channels.items()}
        frames = {"tf": "foxglove.FrameTransform", "tf/submaps": "foxglove.FrameTransforms"}
        for topic, schema in {**DRAWN, **PLAIN, **frames}.items():
            self.assertEqual(schemas[topic], schema)
        self.assertEqual(schemas["NAV/fields"], "vogmap.Nav")
        self.assertEqual({found["messageEncoding"] for found in self.channels.values()}, {"protobuf"})
        self.assertEqual(self.read["header"]["profile"], "")

    def test_our_copies_of_foxgloves_schemas_are_foxgloves(self):
        found = ask_reader("schemas", ROOT / "lib/foxglove/foxglove")
        self.assertEqual(found["differing"], [])
        self.assertGreater(found["compared"], 20)

    def test_data_have_their_check_sum(self):
        end = self.read["dataEnd"]
        self.assertEqual(end["crc32"], zlib.crc32(self.mcap.read_bytes()[:end["at"]]))

    def test_values_are_those_of_the_log(self):
        truth, utime_us = self.last_of("TRUTH", self.types.truth_t)
        last = self.channels["TRUTH"]["last"]
        self.assertEqual(int(last["logTime"]), 1000 * utime_us)
        self.assertEqual(int(last["publishTime"]), 1000 * truth.header.utime_us)
        pose = last["content"]["pose"]
        for axis, value in zip("xyz", truth.X_WB.position_m):
            self.assertAlmostEqual(pose["position"][axis], value, 9)
        for axis, value in zip("wxyz", truth.X_WB.quaternion_wxyz):
            self.assertAlmostEqual(pose["orientation"][axis], value, 9)
        fields = self.channels["TRUTH/fields"]["last"]["content"]
        self.assertEqual(fields["velocity_B_m_s"], list(truth.velocity_B_m_s))

        mission, _ = self.last_of("MISSION_STATUS", self.types.mission_status_t)
        told = self.channels["MISSION_STATUS"]["last"]["content"]
        self.assertEqual(told["state"], mission.state)
        self.assertEqual(told["end_reason"], "max_submaps")
        self.assertEqual(told["submaps"], mission.submaps)
        self.assertEqual(told["explored_m3"], mission.explored_m3)

        status, _ = self.last_of("STATUS", self.types.status_t)
        told = self.channels["STATUS/fields"]["last"]["content"]
        self.assertEqual({counter["name"]: counter["value"] for counter in told["counter"]},
                         {counter.name: counter.value for counter in status.counter})
        self.assertEqual(self.channels["STATUS"]["last"]["content"]["name"], status.process)

    def test_scans_and_the_graph_can_be_drawn(self):
        scan, _ = self.last_of("SCAN", self.types.scan_t)
        cloud = self.channels["SCAN"]["last"]["content"]
        self.assertEqual(cloud["frame_id"], "B")
        self.assertEqual([field["name"] for field in cloud["fields"]], ["x", "y", "z", "strength"])
        poses, _ = self.last_of("SUBMAP_POSES", self.types.submap_poses_t)
        graph, _ = self.last_of("GRAPH", self.types.graph_t)
        lines = self.channels["GRAPH"]["last"]["content"]["entities"][0]["lines"]
        self.assertEqual(sum(len(line["points"]) for line in lines), 2 * graph.count)
        self.assertEqual(graph.edge[0].kind, self.types.graph_edge_t.ODOMETRY)
        for point, submap in zip(lines[0]["points"], (graph.edge[0].from_id, graph.edge[0].to_id)):
            self.assertEqual([point[axis] for axis in "xyz"], list(poses.X_WM[submap].position_m))
        self.assertEqual(self.channels["SCAN/fields"]["last"]["content"]["beams"], scan.beams)

    def test_voxels_hang_on_their_submaps_frames(self):
        poses, _ = self.last_of("SUBMAP_POSES", self.types.submap_poses_t)
        frames = self.channels["tf/submaps"]["last"]["content"]["transforms"]
        self.assertEqual([frame["child_frame_id"] for frame in frames],
                         [f"M{submap}" for submap in poses.submap_id])
        for frame, X_WM in zip(frames, poses.X_WM):
            self.assertEqual(frame["parent_frame_id"], "W")
            self.assertEqual([frame["translation"][axis] for axis in "xyz"], list(X_WM.position_m))
        entity = self.channels["SUBMAP/voxels"]["last"]["content"]["entities"][0]
        self.assertEqual(entity["frame_id"], f"M{SUBMAPS - 1}")
        self.assertTrue(entity["frame_locked"])
        # The octree that the mission saved holds them all.
        listed = self.run_vog("map", "query", self.scratch / "run/map", "--points", self.centres(entity, poses))
        states = [line.split()[3] for line in listed.splitlines() if not line.startswith("#")]
        self.assertGreater(len(states), 100)
        self.assertGreater(states.count("occupied") / len(states), 0.8)

    def centres(self, entity, poses):
        """The cubes' centres in W, in a file. The last submap may lie in others that saw free water."""
        w, x, y, z = poses.X_WM[SUBMAPS - 1].quaternion_wxyz
        path = self.scratch / "centres.txt"
        lines = []
        for cube in entity["cubes"]:
            p = [cube["pose"]["position"][axis] for axis in "xyz"]
            cross = [y * p[2] - z * p[1], z * p[0] - x * p[2], x * p[1] - y * p[0]]
            again = [y * cross[2] - z * cross[1], z * cross[0] - x * cross[2], x * cross[1] - y * cross[0]]
            lines.append(" ".join(repr(o + a + 2 * (w * c + d)) for o, a, c, d in
                                  zip(poses.X_WM[SUBMAPS - 1].position_m, p, cross, again)))
        path.write_text("\n".join(lines) + "\n")
        return path

    def test_equal_logs_give_equal_bytes(self):
        again = self.scratch / "again.mcap"
        self.run_vog("log", "export", self.log, "--mcap", again)
        self.assertEqual(again.read_bytes(), self.mcap.read_bytes())

    def test_what_cannot_be_is_refused_and_leaves_nothing(self):
        folder = self.scratch / "refused"
        folder.mkdir()
        text = folder / "text"
        text.write_text("no log")
        out = folder / "out.mcap"
        self.refuse(2, "log", "export", folder / "nosuch.log", "--mcap", out, says=["no such log"])
        self.refuse(2, "log", "export", text, "--mcap", out, says=["not an LCM event log"])
        self.refuse(2, "log", "export", text, "--mcap", text, says=["not an LCM event log"])
        self.refuse(2, "log", "export", self.log, "--mcap", self.log, says=["is read"])
        self.refuse(1, "log", "export", self.log, "--mcap", folder / "no/out.mcap", says=["no/out"])
        self.refuse(1, "log", "export", self.log, "--mcap", "/dev/full/x", says=["/dev/full/x"])
        self.refuse(1, "log", "export", self.log, "--mcap", folder, says=[folder])
        self.assertEqual(set(contents(folder)), {"text"})


if __name__ == "__main__":
    unittest.main()
