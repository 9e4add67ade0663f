"""The page of vog-viewer in a real Chromium: during a mission, over a log, with a thousand submaps."""

import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

from browser_testing import Browser, Served
from lcm_testing import Listener, import_types, port_of
from thousand_submaps import write_thousand
from vog_testing import BIN, VogTest, config, free_url

SUBMAPS = 12       # Of the log.
LIVE_SUBMAPS = 300  # More than are needed: the mission goes on until the test has seen enough.
GOING_ON = "/exploring|revisiting/"
TOKEN = "a token for tests"
SHOWN = "[...vogmap.scene.clouds.values()].filter((cloud) => cloud.visible).length"
# Where each submap is drawn: its number -> x, y, z.
DRAWN = ("Object.fromEntries([...vogmap.scene.clouds].filter(([, cloud]) => cloud.visible)"
         ".map(([id, cloud]) => [id, cloud.matrix.elements.slice(12, 15)]))")


def is_open(page, timeout_s=180):
    page.wait("window.vogmap?.connection.state === 'open'", timeout_s)


class ViewerTest(VogTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.close)

    def serve(self, *command):
        served = Served(*command)
        self.addCleanup(served.stop)
        return served

    def viewer(self, url, *settings):
        arguments = [word for setting in (f"bus.url='{url}'", *settings) for word in ("--set", setting)]
        return self.serve(BIN / "vog-viewer", "--config", config("demo"), *arguments)

    def look(self, url, **options):
        page = self.browser.open(url, **options)
        self.addCleanup(page.close)
        return page

    def without_faults(self, page):
        self.assertEqual(page.faults(), [])


class LiveTest(ViewerTest):
    def test_a_mission_is_watched_by_two_while_the_server_is_restarted(self):
        url = free_url()
        first = self.viewer(url, "viewer.port=0")
        port = first.url.rsplit(":", 1)[1].strip("/")
        page = self.look(first.url)
        is_open(page)
        page.wait("!document.getElementById('empty').hidden")
        mission = subprocess.Popen(
            [BIN / "vog", "mission", config("demo"), "--live", "--speed", "10", "--max-submaps",
             str(LIVE_SUBMAPS), "--set", "mission.when_done=revisit", f"bus.url='{url}'", "--out",
             self.scratch / "run"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(mission.communicate)
        self.addCleanup(mission.terminate)
        page.wait("vogmap.scene.vehicle.visible && vogmap.scene.fan.visible", 120)
        page.wait("vogmap.store.live.plan?.tree.length > 1 && vogmap.scene.lines.best.visible")
        page.wait(f"{SHOWN} >= 2", 120)
        page.wait("vogmap.scene.lines.odometryEdge.visible && vogmap.scene.lines.truth.visible")
        self.a_closure_moves_submaps(page)
        other = self.look(first.url, width=390, height=780, touch=True)
        other.wait(f"{SHOWN} >= 2")
        other.tap(selector="[data-panel=state]")
        other.wait("document.getElementById('facts').textContent.includes('Submaps')")
        self.without_faults(page)
        self.without_faults(other)

        first.stop()
        page.wait("vogmap.connection.state === 'closed'")
        self.assertIn("trying again", page.run("document.getElementById('connection').textContent"))
        known = page.run("vogmap.store.submaps.size")
        self.assertGreater(known, 0, "the picture stays while nobody serves")
        self.viewer(url, f"viewer.port={port}")
        for watcher in (page, other):
            is_open(watcher)
            # The new server has asked the map service for what was said before its time.
            watcher.wait(f"vogmap.store.hello !== null && {SHOWN} >= {known}")
            watcher.wait(f"{GOING_ON}.test(vogmap.store.live.mission?.state)")
            # The browser itself tells of refused connections; nothing else may be wrong.
            self.assertEqual([fault for fault in watcher.faults() if "WebSocket" not in fault], [])
        page.wait(f"{SHOWN} > {known}", 120)
        page.wait(f"{GOING_ON}.test(document.getElementById('facts').textContent)")
        self.without_faults(page)

    def a_closure_moves_submaps(self, page):
        """Waits until a submap stands elsewhere than it did, by a graph with a closure."""
        before = page.run(DRAWN)
        end = time.monotonic() + 300
        while time.monotonic() < end:
            now = page.run(DRAWN)
            moved = [max(abs(a - b) for a, b in zip(now[number], before[number]))
                     for number in now if number in before]
            closures = page.run("vogmap.store.live.graph.edges.filter(({kind}) => kind === 1 || kind === 2).length")
            if closures > 0 and max(moved, default=0) > 0.005:
                return
            before.update({number: at for number, at in now.items() if number not in before})
            time.sleep(0.2)
        self.fail("no submap moved")


class OperatorTest(ViewerTest):
    def test_orders_need_the_token_and_arrive(self):
        url = free_url()
        served = self.viewer(url, "viewer.port=0", "viewer.operators=true", f"viewer.token='{TOKEN}'")
        vog = import_types(pathlib.Path(tempfile.mkdtemp(dir=self.scratch)))
        hearer = Listener(port_of(url))
        self.addCleanup(hearer.close)
        page = self.look(served.url)
        page.wait("document.getElementById('token').open")
        self.assertTrue(page.run("document.getElementById('operator').hidden"))
        page.fill(selector="#token-text", text="not the token")
        page.press(key="Enter")
        page.wait("vogmap.connection.state === 'locked' && document.getElementById('token').open")
        page.fill(selector="#token-text", text=TOKEN)
        page.press(key="Enter")
        is_open(page)
        page.wait("!document.getElementById('operator').hidden")
        page.click(selector="[data-command=pause]")
        self.assertEqual(vog.operator_command_t.decode(hearer.hear("OPERATOR", 20)).command, "pause")
        page.click(selector="[data-command=abort]")
        page.wait("document.getElementById('confirm').open")
        page.click(selector="#confirm [value=cancel]")
        self.assertIsNone(hearer.hear("OPERATOR", 1), "not without a second yes")
        page.click(selector="[data-command=abort]")
        page.click(selector="#confirm [value=ok]")
        self.assertEqual(vog.operator_command_t.decode(hearer.hear("OPERATOR", 20)).command, "abort")
        linked = self.look(f"{served.url}#token={TOKEN.replace(' ', '%20')}")
        is_open(linked)
        self.assertNotIn("token", linked.run("location.href"))
        self.without_faults(page)

    def test_without_operators_there_are_no_buttons(self):
        page = self.look(self.viewer(free_url(), "viewer.port=0").url)
        is_open(page)
        page.wait("vogmap.store.hello !== null")
        self.assertTrue(page.run("document.getElementById('operator').hidden"))

    def test_a_page_open_to_the_network_is_refused(self):
        done = subprocess.run([BIN / "vog-viewer", "--config", config("demo"), "--set",
                               "viewer.bind=0.0.0.0"], capture_output=True, text=True, timeout=30)
        self.assertEqual(done.returncode, 2)
        self.assertIn("viewer.token", done.stderr)
        self.refuse(2, "view", self.scratch, "--bind", "0.0.0.0", says=["neither"])


class LogTest(ViewerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_folder = cls.scratch / "run"
        subprocess.run([BIN / "vog", "mission", config("demo"), "--max-submaps", str(SUBMAPS), "--out",
                        cls.run_folder], check=True, capture_output=True, timeout=600)

    def open(self, path, **options):
        page = self.look(self.serve(BIN / "vog", "view", path, "--port", "0").url, **options)
        is_open(page)
        page.wait("vogmap.store.hello !== null && vogmap.store.loading === 1", 120)
        page.wait(f"{SHOWN} >= {SUBMAPS}")
        return page

    def test_the_slider_goes_through_the_run(self):
        page = self.open(self.run_folder)
        self.assertEqual(page.run("document.getElementById('connection').textContent"), "Log")
        page.run("vogmap.timeline.goTo(vogmap.store.firstTime + 62e6)")
        page.wait("vogmap.store.past !== null")
        page.wait(f"{SHOWN} === 3")
        self.assertLess(page.run("vogmap.store.past.graph.edges.length"),
                        page.run("vogmap.store.live.graph.edges.length"))
        age_us = page.run("vogmap.store.past.t - vogmap.store.past.estimate.t")
        self.assertGreaterEqual(age_us, 0)
        self.assertLess(age_us, 0.2e6)
        page.press(key="ArrowLeft")  # Back to 52 s.
        page.wait(f"{SHOWN} === 2")
        page.press(key=" ")
        page.wait(f"{SHOWN} >= 5")  # It plays.
        page.press(key="l")
        page.wait(f"vogmap.store.past === null && {SHOWN} === {SUBMAPS}")
        # By hand: a third of the way along.
        page.run("(() => { const s = document.getElementById('slider'); s.value = 333;"
                 " s.dispatchEvent(new Event('input')); })()")
        page.wait(f"vogmap.store.past !== null && {SHOWN} < {SUBMAPS}")
        self.without_faults(page)

    def test_layers_colours_and_themes(self):
        page = self.open(self.run_folder / "lcm.log")
        for key, drawn in (("s", "cloudGroup.visible"), ("g", "nodes.visible"),
                           ("r", "lines.rejected.visible"), ("p", "treeNodes.visible")):
            before = page.run(f"vogmap.scene.{drawn}")
            page.press(key=key)
            self.assertNotEqual(page.run(f"vogmap.scene.{drawn}"), before, key)
        page.press(key="s")
        for colour in ("height", "sigma", "trueError"):
            page.press(key="c")
            self.assertEqual(page.run("document.getElementById('colour-by').value"), colour)
        tones = page.run("[...vogmap.scene.clouds.values()].map((c) => c.material.uniforms.tone.value)")
        self.assertAlmostEqual(max(tones), 1, places=5)
        self.assertGreater(len(set(tones)), SUBMAPS // 2)
        theme = page.run("document.documentElement.dataset.theme")
        page.press(key="t")
        self.assertNotEqual(page.run("document.documentElement.dataset.theme"), theme)
        page.wait("[...vogmap.store.frontiers.values()].some(({ voxels }) => voxels.length > 0)")
        page.click(selector="[data-layer=frontiers]")
        self.assertGreater(page.run("vogmap.scene.frontierGroup.children.length"), 5)
        page.press(key="?")
        page.wait("document.getElementById('help').open")
        self.without_faults(page)

    def test_the_picture_is_not_empty(self):
        page = self.open(self.run_folder)
        # The share of the picture's points that differ from its ground.
        share = page.run("""new Promise((done) => requestAnimationFrame(() => {
            const { renderer, scene, camera } = vogmap.scene;
            renderer.render(scene, camera);
            const gl = renderer.getContext();
            const bytes = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight);
            gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
            let drawn = 0;
            for (let i = 0; i < bytes.length; i += 4)
              drawn += Math.abs(bytes[i] - bytes[0]) + Math.abs(bytes[i + 1] - bytes[1]) > 30;
            done(4 * drawn / bytes.length);
          }))""")
        self.assertGreater(share, 0.05)

    def test_a_map_alone_is_shown_too(self):
        page = self.open(self.run_folder / "map")
        page.wait("vogmap.store.live.graph !== undefined")
        self.assertGreaterEqual(page.run("vogmap.store.live.graph.edges.length"), SUBMAPS - 1)
        self.without_faults(page)

    def test_what_is_no_run_is_a_line(self):
        self.refuse(2, "view", self.scratch / "nosuch", says=["nosuch"])
        (self.scratch / "empty").mkdir()
        self.refuse(2, "view", self.scratch / "empty", says=["lcm.log"])

    def test_a_thousand_submaps_move_twenty_times_a_second(self):
        submaps, rate_hz = 1000, 30
        log, url = self.scratch / "thousand.log", free_url()
        vog = import_types(pathlib.Path(tempfile.mkdtemp(dir=self.scratch)))
        write_thousand(vog, log, self.run_folder / "lcm.log", submaps, 300, rate_hz)
        page = self.look(self.viewer(url, "viewer.port=0").url)
        is_open(page)

        def play(*part):
            player = subprocess.Popen([BIN / "vog", "replay", log, "--live", "--url", url, *part],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            self.addCleanup(player.wait)
            self.addCleanup(player.terminate)

        # The other poses come when all submaps are there, however long the page takes for them. A
        # log sends nothing again that a busy machine has lost, and so is played slowly.
        play("--to", "5.3", "--speed", "0.25")
        page.wait(f"{SHOWN} === {submaps}", 120)
        play("--from", "5.3")
        page.wait("vogmap.store.counts.poses > 40", 60)
        counts = ("(() => ({ t: performance.now() / 1000, frames: vogmap.store.counts.poses,"
                  " bytes: vogmap.connection.counts.bytes, drawn: vogmap.scene.stats.drawn }))()")
        begin = page.run(counts)
        before = page.run(DRAWN)
        time.sleep(4)
        after, end = page.run(DRAWN), page.run(counts)
        moved = [number for number in before if before[number] != after[number]]
        self.assertEqual(len(moved), submaps)
        seconds = end["t"] - begin["t"]
        rate = (end["frames"] - begin["frames"]) / seconds
        megabytes = (end["bytes"] - begin["bytes"]) / 1e6 / seconds
        print(f"{rate:.1f} frames/s of {submaps} poses, {megabytes:.2f} MB/s, "
              f"{(end['drawn'] - begin['drawn']) / seconds:.1f} pictures/s drawn in software")
        self.assertGreaterEqual(rate, 20)
        self.assertLess(megabytes, 4, "poses travel, not maps")
        self.assertEqual(page.run("vogmap.store.submaps.size"), submaps)
        self.without_faults(page)


if __name__ == "__main__":
    if shutil.which("chromium") is None:
        raise SystemExit("needs chromium; tools/setup installs it")
    unittest.main()
