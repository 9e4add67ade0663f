"""vog sonar: ranges found in images and recordings, what a recording holds, frames as images."""

import json
import struct
import unittest
import zlib

from recordings import BEAMS, BINS, ddf, frame_samples, pgm
from vog_testing import VogTest, vog

def png(samples):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    rows = b"".join(b"\0" + samples[i * BEAMS:(i + 1) * BEAMS] for i in range(BINS))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", BEAMS, BINS, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class SonarCommandTest(VogTest):
    def write(self, name, content):
        file = self.scratch / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
        return file

    def expect_wall(self, lines, name):
        """The wall's beams have their bins, others nothing."""
        found = {}
        for line in lines:
            file, beam, range_bin, strength = line.split()
            self.assertEqual(file, name)
            self.assertTrue(0 < float(strength) <= 1)
            found[int(beam)] = int(range_bin)
        self.assertEqual(sorted(found), list(range(20, 80)))
        for beam, range_bin in found.items():
            self.assertLessEqual(abs(range_bin - (200 + beam // 4)), 1)

    def test_images_and_recordings_say_the_same(self):
        samples = frame_samples()
        for name, content, told in (("a.pgm", pgm(samples), "a.pgm"), ("a.png", png(samples), "a.png"),
                                    ("a.ddf", ddf([samples]), "a.ddf:0")):
            with self.subTest(name):
                file = self.write(name, content)
                self.expect_wall(self.run_vog("sonar", "detect", file).splitlines(), told)

    def test_folders_are_read_in_order(self):
        for name in ("c.pgm", "a.pgm", "b.pgm"):
            self.write(f"many/{name}", pgm(frame_samples()))
        self.write("many/notes.txt", b"not a frame")
        lines = self.run_vog("sonar", "detect", self.scratch / "many", "--format", "pgm", "--window",
                             2.25, 11.25).splitlines()
        names = [line.split()[0] for line in lines]
        self.assertEqual(sorted(set(names)), ["a.pgm", "b.pgm", "c.pgm"])
        self.assertEqual(names, sorted(names))

    def test_json(self):
        file = self.write("j.pgm", pgm(frame_samples()))
        frames = json.loads(self.run_vog("sonar", "detect", file, "--window", 1, 6.12, "--json"))["frames"]
        self.assertEqual(len(frames), 1)
        self.assertEqual(frames[0]["file"], "j.pgm")
        first = frames[0]["returns"][0]
        self.assertEqual(first["beam"], 20)
        self.assertAlmostEqual(first["range_m"], 1 + 0.01 * (first["range_bin"] + 0.5), places=5)

    def test_empty_frames_say_nothing(self):
        file = self.write("dark.pgm", pgm(bytes(BEAMS * BINS)))
        self.assertEqual(self.run_vog("sonar", "detect", file), "")

    def test_options(self):
        file = self.write("o.pgm", pgm(frame_samples()))
        deaf = self.run_vog("sonar", "detect", file, "--set", "range_detector.least_loudness=999")
        self.assertEqual(deaf, "")

    def test_info(self):
        file = self.write("i.ddf", ddf([frame_samples(i) for i in range(3)]))
        info = json.loads(self.run_vog("sonar", "info", file, "--json"))
        self.assertEqual((info["format"], info["frames"], info["beams"], info["bins"]),
                         ("DDF_04", 3, BEAMS, BINS))
        self.assertEqual((info["min_range_m"], info["max_range_m"]), (2.25, 11.25))
        self.assertEqual(info["last_utime_us"] - info["first_utime_us"], 200000)
        self.assertAlmostEqual(info["measured_rate_hz"], 10, places=3)
        self.assertEqual(info["fault"], "")
        self.assertIn("DDF_04", self.run_vog("sonar", "info", file))

    def test_exported_images_are_read_back(self):
        file = self.write("e.ddf", ddf([frame_samples(1), frame_samples(2)]))
        out = self.scratch / "images"
        self.run_vog("sonar", "export", file, "--out", out)
        self.assertEqual((out / "frame_000001.pgm").read_bytes(), pgm(frame_samples(2)))
        strip = [line.split()[1:] for line in self.run_vog("sonar", "detect", out).splitlines()]
        self.assertEqual(strip, [line.split()[1:] for line in
                                 self.run_vog("sonar", "detect", file).splitlines()])

    def test_a_cut_recording_gives_its_whole_frames(self):
        file = self.write("cut.ddf", ddf([frame_samples(1), frame_samples(2)])[:-5])
        done = vog("sonar", "detect", file)
        self.assertEqual(done.returncode, 0)
        self.expect_wall(done.stdout.splitlines(), "cut.ddf:0")
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("ends within a frame", done.stderr)

    def test_bad_input(self):
        empty = self.scratch / "empty"
        empty.mkdir()
        noise = self.write("noise.png", b"this is no image")
        for arguments, says in (
                (("detect", self.scratch / "no.pgm"), ["no.pgm", "no such file"]),
                (("detect", empty), ["empty", ".pgm"]),
                (("detect", empty, "--format", "tiff"), ["tiff"]),
                (("detect", noise), ["noise.png", "not a PGM or PNG"]),
                (("detect", noise, "--format", "ddf"), ["noise.png", "not a sonar recording"]),
                (("detect", self.write("cut.png", png(frame_samples())[:900])), ["cut.png"]),
                (("detect", self.write("zero.pgm", b"")), ["zero.pgm", "empty"]),
                (("detect", self.write("wide.pgm", b"P5\n5000 2\n255\n" + bytes(10000))),
                 ["wide.pgm", "5000"]),
                (("detect", self.write("x.txt", b"x")), ["x.txt", "--format"]),
                (("detect", noise, "--window", 5, 2), ["--window"]),
                (("detect", noise, "--set", "range_detector.no=1"), ["range_detector.no"]),
                (("info", noise), ["noise.png", "not a sonar recording"]),
                (("info", empty), ["empty", "folder"]),
                (("info", self.write("short.ddf", ddf([frame_samples()])[:2000])), ["short.ddf"]),
                (("export", noise, "--out", self.scratch / "y"), ["noise.png"]),
                (("export", self.write("g.ddf", ddf([frame_samples()])), "--out", noise),
                 ["noise.png"]),
                ((), ["--help"])):
            with self.subTest(arguments):
                self.refuse(2, "sonar", *arguments, says=says)

    def test_help_teaches(self):
        self.assertIn("file beam range_bin strength", vog("sonar", "detect", "--help").stdout)


if __name__ == "__main__":
    unittest.main()
