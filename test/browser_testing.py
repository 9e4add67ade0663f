"""A real Chromium, driven from Python through test/browser.mjs."""

import json
import os
import pathlib
import shutil
import subprocess

from vog_testing import ROOT

BUILD = pathlib.Path(os.environ.get("VOG_BUILD", ROOT / "build"))


class Page:
    def __init__(self, browser, number):
        self.browser, self.number = browser, number

    def __getattr__(self, command):
        """page.press(key="t"): see the commands in browser.mjs."""
        return lambda **values: self.browser.tell(command, page=self.number, **values)

    def run(self, script):
        """The value of a JavaScript expression in the page."""
        return self.browser.tell("run", page=self.number, script=script)

    def wait(self, script, timeout_s=180):
        """Until a JavaScript expression is true."""
        self.browser.tell("wait", page=self.number, script=script, timeout_s=timeout_s)


class Browser:
    def __init__(self):
        self.process = subprocess.Popen(
            ["node", ROOT / "test/browser.mjs", BUILD / "web", shutil.which("chromium")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def tell(self, command, **values):
        self.process.stdin.write(json.dumps({"command": command, **values}) + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            raise AssertionError(f"{command} {values}: {answer['error']}")
        return answer["value"]

    def open(self, url, width=1440, height=900, touch=False):
        return Page(self, self.tell("open", url=str(url), width=width, height=height, touch=touch))

    def close(self):
        self.process.stdin.close()
        self.process.wait(timeout=30)
        self.process.stdout.close()


class Served:
    """A process that serves the page: `vog view` or vog-viewer. Its address is in `url`."""

    def __init__(self, *command):
        self.process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True)
        line = self.process.stdout.readline()
        if "http://" not in line:
            raise AssertionError(f"{command}: {line}")
        self.url = line[line.index("http://"):].strip()

    def stop(self):
        self.process.terminate()
        self.process.communicate(timeout=30)
