"""The port of the live page speaks Foxglove's protocol: Foxglove's own client watches a mission."""

import json
import math
import subprocess
import unittest

from browser_testing import Served
from export_test import BUILD, DRAWN, PLAIN
from vog_testing import BIN, ROOT, VogTest, config, free_url

CLIENT = ROOT / "test/export/foxglove_client.mjs"
SUBPROTOCOLS = ("foxglove.websocket.v1", "foxglove.sdk.v1")
TOKEN = "a token for tests"
SUBMAPS = 3
FRAMES = {"tf": "foxglove.FrameTransform", "tf/submaps": "foxglove.FrameTransforms",
          "SUBMAP/voxels": "foxglove.SceneUpdate"}
# What is said again and again; the others are said when something happens.
STEADY = ("NAV", "POSE", "SCAN", "STATUS", "TRUTH", "NAV/fields", "tf", "CONTROL", "MAP_STATUS")


class FoxgloveTest(VogTest):
    def serve(self, *command):
        served = Served(*command)
        self.addCleanup(served.stop)
        return served.url.replace("http:", "ws:")

    def viewer(self, bus, *settings):
        words = [word for setting in (f"bus.url='{bus}'", "viewer.port=0", *settings)
                 for word in ("--set", setting)]
        return self.serve(BIN / "vog-viewer", "--config", config("demo"), *words)

    def listen(self, url, subprotocol, seconds):
        client = subprocess.Popen(["node", CLIENT, BUILD / "export", url, subprotocol, str(seconds)],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(client.communicate)
        self.addCleanup(client.kill)
        return client

    def heard(self, client):
        out, error = client.communicate(timeout=120)
        self.assertEqual(client.returncode, 0, error)
        return json.loads(out)

    def topics(self, heard):
        """Topic -> how many messages; nothing may have gone wrong."""
        self.assertEqual(heard["errors"], [])
        self.assertEqual(heard["statuses"], [])
        self.assertEqual(heard["serverInfo"]["capabilities"], ["time"])
        for topic, channel in heard["channels"].items():
            self.assertEqual(channel["encoding"], "protobuf")
            self.assertEqual(channel["schema"], {**DRAWN, **PLAIN, **FRAMES}.get(topic, channel["schema"]))
        return {topic: channel["messages"] for topic, channel in heard["channels"].items()}

    def has_the_map(self, heard, submaps):
        """Submap -> how many cubes."""
        scenes = heard["channels"]["SUBMAP/voxels"]["contents"]
        entities = {entity["id"]: entity for scene in scenes for entity in scene["entities"]}
        self.assertEqual(set(entities), {f"M{number}" for number in range(submaps)})
        # What a single submap sees depends on the machine's load.
        cubes = {name: len(entity["cubes"]) for name, entity in entities.items()}
        self.assertGreater(min(cubes.values()), 0)
        self.assertGreater(sum(cubes.values()), 150)
        frames = heard["channels"]["tf/submaps"]["contents"][-1]["transforms"]
        self.assertEqual({frame["child_frame_id"] for frame in frames}, set(entities))
        return cubes

    def test_a_mission_is_watched_by_two_and_by_one_who_comes_late(self):
        bus = free_url()
        url = self.viewer(bus)
        mission = subprocess.Popen(
            [BIN / "vog", "mission", config("demo"), "--live", "--speed", "5", "--max-submaps", str(SUBMAPS),
             "--set", f"bus.url='{bus}'", "--out", self.scratch / "run"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(mission.communicate)
        self.addCleanup(mission.terminate)
        watchers = [self.listen(url, name, 30) for name in SUBPROTOCOLS]
        for watcher, name in zip(watchers, SUBPROTOCOLS):
            heard = self.heard(watcher)
            topics = self.topics(heard)
            self.assertEqual(heard["subprotocol"], name)
            self.assertLessEqual({*DRAWN, *PLAIN, *FRAMES}, set(topics))
            self.assertGreater(min(topics.values()), 0, topics)
            for topic in STEADY:
                self.assertGreater(topics[topic], 5, topic)
            self.assertEqual(heard["times"], sorted(heard["times"]))
            self.assertGreater(len(heard["times"]), 50)
        _, error = mission.communicate(timeout=300)
        self.assertEqual(mission.returncode, 0, error)
        late = self.heard(self.listen(url, SUBPROTOCOLS[0], 5))
        cubes = self.has_the_map(late, SUBMAPS)
        topics = self.topics(late)
        for topic in ("GRAPH", "SUBMAP_POSES", "MISSION_STATUS", "RUN", "tf", "SUBMAP"):
            self.assertGreater(topics[topic], 0, topic)
        lines = late["channels"]["GRAPH"]["contents"][-1]["entities"][0]["lines"]
        self.assertGreaterEqual(sum(len(line["points"]) for line in lines), 2 * (SUBMAPS - 1))
        for quaternion in (frame["rotation"] for frame in late["channels"]["tf"]["contents"]):
            self.assertAlmostEqual(math.hypot(*quaternion.values()), 1, 9)
        # A finished run and its map alone are served on the same port, too.
        for shown in (self.scratch / "run", self.scratch / "run/map"):
            found = self.heard(self.listen(self.serve(BIN / "vog", "view", shown, "--port", "0"),
                                           SUBPROTOCOLS[1], 8))
            self.topics(found)
            self.assertEqual(self.has_the_map(found, SUBMAPS), cubes)

    def test_the_token_is_in_the_address(self):
        url = self.viewer(free_url(), f"viewer.token='{TOKEN}'")
        told = self.heard(self.listen(f"{url}?token={TOKEN.replace(' ', '%20')}", SUBPROTOCOLS[1], 2))
        self.assertEqual(told["errors"], [])
        self.assertIn("Vogmap", told["serverInfo"]["name"])
        refused = self.heard(self.listen(f"{url}?token=another", SUBPROTOCOLS[1], 2))
        self.assertIn("401", refused["errors"][0])
        self.assertNotIn("serverInfo", refused)


if __name__ == "__main__":
    unittest.main()
