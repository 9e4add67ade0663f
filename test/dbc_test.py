"""CAN databases become tables, and those that cannot be are refused with one line."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent


def generate(text):
    """Exit status, error text and header of a database."""
    with tempfile.TemporaryDirectory() as folder:
        source, header = pathlib.Path(folder, "x.dbc"), pathlib.Path(folder, "new/x.h")
        source.write_text(text)
        run = subprocess.run([sys.executable, ROOT / "cmake/dbc_to_cpp.py", source, header],
                             capture_output=True, text=True)
        return run.returncode, run.stderr, header.read_text() if header.exists() else ""


def message(*signals, head="BO_ 256 A_MESSAGE: 8 NODE"):
    return "\n".join([head] + [f" SG_ {signal} NODE" for signal in signals]) + "\n"


class DbcTest(unittest.TestCase):
    def test_tables(self):
        status, _, header = generate(
            message('a : 7|12@0- (0.5,-1) [-10|10] "m"', 'b : 16|8@1+ (1,0) [0|255] ""',
                    head="BO_ 2147483904 AN_EXTENDED: 8 NODE")
            + 'CM_ BO_ 2147483904 "Some\nwords.";\nCM_ SG_ 2147483904 a "A length.";\n')
        self.assertEqual(status, 0)
        for words in ("struct AnExtended", "kId = 0x100;", "kExtended = true;", "/// Some words.",
                      "double a = 0;  ///< [m] A length.",
                      "CanSignal{7, 12, true, true, 0.5, -1.0, -10.0, 10.0}",
                      "CanSignal{16, 8, false, false, 1.0, 0.0, 0.0, 255.0}"):
            self.assertIn(words, header)

    def test_our_own_has_words_and_checks_for_all(self):
        text = (ROOT / "hardware/nav_payload/vogmap.dbc").read_text()
        self.assertEqual(generate(text)[0], 0)
        for name in ("BO_ ", " SG_ counter : 52|4@1+", " SG_ crc : 56|8@1+", "CM_ BO_ "):
            self.assertEqual(text.count("\n" + name), text.count("\nBO_ "), name)

    def test_refuses_what_cannot_be(self):
        good = 'a : 0|8@1+ (1,0) [0|255] ""'
        for text, words in (
                (message(good, 'b : 7|8@1+ (1,0) [0|255] ""'), "overlaps"),
                (message('a : 60|8@1+ (1,0) [0|255] ""'), "beyond"),
                (message('a : 57|4@0+ (1,0) [0|15] ""'), "beyond"),
                (message('a : 0|54@1+ (1,0) [0|255] ""'), "53"),
                (message('a : 0|8@1+ (1,0) [0|256] ""'), "range"),
                (message('a : 0|8@1- (1,0) [-129|0] ""'), "range"),
                (message('a : 0|8@1+ (0,0) [0|0] ""'), "range"),
                (message(good) + message(good), "twice"),
                (message(good, head="BO_ 256 A_MESSAGE: 9 NODE"), "9 bytes"),
                (message("a : nonsense"), "not understood")):
            status, error, _ = generate(text)
            self.assertEqual((status, error.count("\n")), (1, 1), text)
            self.assertIn(words, error)


if __name__ == "__main__":
    unittest.main()
