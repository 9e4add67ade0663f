"""Documents do not rot: the commands that they print exist with those options and settings, and links lead
somewhere."""

import functools
import re
import shlex
import subprocess
import unittest

from vog_testing import ROOT, vog

DOCUMENTS = [file for pattern in ("*.md", "docs/*.md", "*/README.md", "*/*/README.md")
             for file in sorted(ROOT.glob(pattern)) if file.relative_to(ROOT).parts[0] != "build"]


@functools.cache
def help_of(*command):
    """(subcommands, options) of `vog COMMAND`."""
    text = vog(*command, "--help").stdout
    _, _, below = text.partition("\nSubcommands:\n")
    return (set(re.findall(r"^  ([a-z][a-z-]*) ", below, re.MULTILINE)),
            set(re.findall(r"^  (?:-\w,)?(--[a-z-]+)", text, re.MULTILINE)))


@functools.cache
def settings():
    """Every table.key there is."""
    keys, table = set(), ""
    for line in vog("config").stdout.splitlines():
        if head := re.match(r"\[\[?([\w.]+)\]\]?$", line):
            table = head[1]
        elif key := re.match(r"(\w+) = ", line):
            keys.add(f"{table}.{key[1]}")
    return keys


def commands(text):
    """The command lines of vog in code blocks: words after `vog`."""
    for block in re.findall(r"^```(?:sh|)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(r"&&|\||;", re.sub(r"(^|\s)#.*", "", line)):
                if "vog " not in part:
                    continue
                words = shlex.split(part)
                if words and words[0] in ("build/bin/vog", "vog"):
                    yield words[1:]


class DocsTest(unittest.TestCase):
    def check(self, words):
        """What is wrong with a command line; nothing if it is right."""
        path = []
        while words and words[0] in help_of(*path)[0]:
            path.append(words.pop(0))
        if not path and words and not words[0].startswith("-"):
            return f"no subcommand {words[0]}"
        subcommands, options = help_of(*path)
        is_set = False
        for word in words:
            if word.startswith("--"):
                name, is_set = word.split("=")[0], word == "--set"
                if name not in options:
                    return f"vog {' '.join(path)} has no option {name}"
            elif is_set and re.match(r"[a-z_]+(\.[a-z_0-9]+)+=", word):
                key = word.split("=")[0]
                if key not in settings() and not key.startswith("keep_out"):
                    return f"no setting {key}"
        return ""

    def test_commands_exist(self):
        checked = 0
        for file in DOCUMENTS:
            for words in commands(file.read_text()):
                checked += 1
                line = " ".join(words)
                with self.subTest(f"{file.relative_to(ROOT)}: vog {line}"):
                    self.assertEqual(self.check(words), "")
        self.assertGreater(checked, 60)

    def test_the_check_finds_what_is_wrong(self):
        for line, says in (("misson x.toml", "misson"), ("mission x.toml --sped 3", "--sped"),
                           ("map build x --outt y", "--outt"),
                           ("slam m --set registration.freedm=full", "registration.freedm")):
            self.assertIn(says, self.check(line.split()))
        self.assertEqual(self.check("mission x.toml --set planner.range_m=3 --live".split()), "")

    def test_the_message_reference_is_of_the_present_messages(self):
        done = subprocess.run([ROOT / "tools/message-reference", "--check"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_links_lead_somewhere(self):
        checked = 0
        for file in DOCUMENTS:
            for link in re.findall(r"\]\(([^)\s]+)\)", file.read_text()):
                if re.match(r"https?:|mailto:", link):
                    continue
                name, _, anchor = link.partition("#")
                target = (file.parent / name).resolve() if name else file
                checked += 1
                with self.subTest(f"{file.relative_to(ROOT)}: {link}"):
                    self.assertTrue(target.exists(), "no such file")
                    if anchor and target.suffix == ".md":
                        heads = re.findall(r"^#+ (.*)$", target.read_text(), re.MULTILINE)
                        slugs = {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}
                        self.assertIn(anchor, slugs)
        self.assertGreater(checked, 30)


if __name__ == "__main__":
    unittest.main()
