"""viewer_pictures.py [RUN]: makes the pictures of docs/viewer.md and README anew, of a run's folder or else
of the demo mission, flown for it. Needs Debian's python3-pil."""

import pathlib
import subprocess
import sys
import tempfile

from PIL import Image

from browser_testing import Browser, Served
from vog_testing import BIN, ROOT, config

DOCS = ROOT / "docs"


def opened(browser, served, theme, **size):
    page = browser.open(f"{served.url}?theme={theme}", **size)
    page.wait("window.vogmap?.store.hello && vogmap.store.loading === 1", 300)
    page.wait("vogmap.scene.stats.points > 0")
    return page


def look(page, minutes, script="", settle_s=8):
    """Brings the page to a time of the run and waits until all of it is drawn."""
    page.run(f"vogmap.timeline.goTo(vogmap.store.firstTime + {6e7 * minutes})")
    page.wait("vogmap.store.past !== null")
    if script:
        page.run(script)
    page.run(f"new Promise((done) => setTimeout(done, {1000 * settle_s}))")


def film(page, path, frames=30):
    """The whole run as a moving picture."""
    minutes = page.run("(vogmap.store.newestTime - vogmap.store.firstTime) / 6e7")
    with tempfile.TemporaryDirectory() as folder:
        shots = []
        for frame in range(1, frames + 1):
            look(page, 0.999 * minutes * frame / frames, settle_s=2)
            shots.append(pathlib.Path(folder) / f"{frame}.png")
            page.shot(path=str(shots[-1]))
        first, *others = [Image.open(shot).convert("RGB") for shot in shots]
        first.save(path, save_all=True, append_images=others, duration=[200] * (frames - 1) + [2000],
                   loop=0, quality=60, method=4)


def take(run):
    served, browser = Served(BIN / "vog", "view", run, "--port", "0"), Browser()
    try:
        page = opened(browser, served, "dark")
        look(page, 5)
        page.shot(path=str(DOCS / "viewer.png"))
        page = opened(browser, served, "light")
        page.press(key="r")
        look(page, 8, "(() => { document.getElementById('colour-by').value = 'sigma';"
                      " document.getElementById('colour-by').dispatchEvent(new Event('change')); })()")
        page.shot(path=str(DOCS / "viewer-light.png"))
        film(opened(browser, served, "dark", width=1080, height=640), DOCS / "viewer.webp")
        page = opened(browser, served, "dark", width=390, height=780, touch=True)
        look(page, 7)
        page.shot(path=str(DOCS / "viewer-phone.png"))
    finally:
        browser.close()
        served.stop()


def main():
    if len(sys.argv) > 1:
        return take(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        run = pathlib.Path(folder) / "run"
        subprocess.run([BIN / "vog", "mission", config("demo"), "--out", run], check=True,
                       stdout=subprocess.DEVNULL)
        take(run)


if __name__ == "__main__":
    main()
