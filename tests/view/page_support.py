# SPDX-License-Identifier: Apache-2.0
"""tests/view/page_support.py -- what the tests of the page share: checks, a tiny run, the viewer with a browser in front of it."""
import contextlib
import os
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import browser  # noqa: E402

SKIPPED = 77
STILL = "gbtrace.look.done && gbtrace.look.done.generation === gbtrace.pictures.generation && gbtrace.look.done.still && gbtrace.look.done.scale === 1"
CAMERA = "JSON.stringify(gbtrace.camera.file(8, 8))"
program = sys.argv[1]
checks = {"passed": 0, "failed": 0}


def check(name, fine, details=""):
    checks["passed" if fine else "failed"] += 1
    if not fine:
        print(f"FAILED: {name}: {details}")


def gbtrace(*arguments):
    return subprocess.run([program, *arguments], check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True).stdout


def make_run(work, width, height):
    """A scene of 9 views, and a run on it: work/run."""
    size = ("--width", str(width), "--height", str(height))
    gbtrace("make-scene", "tabletop", "-o", work + "/scene", *size, "--views", "9", "--samples", "1", "--points", "300")
    gbtrace("train", work + "/scene", "-o", work + "/run", "--iterations", "60")


@contextlib.contextmanager
def opened(path, *options, width=1200, height=800, dark=False, scale=1, phone=False):
    """The page of `gbtrace view PATH`; page.server and page.address are the viewer's."""
    server = subprocess.Popen([program, "view", path, "--port", "0", *options], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    page = browser.Browser(browser.find(), width, height, dark, scale, phone)
    page.server, page.address = server, server.stdout.readline().strip()
    try:
        page.open(page.address)
        page.wait(STILL)
        yield page
        if server.poll() is None:
            check("no errors in the page", not page.errors, str(page.errors))
    except browser.PageError as error:
        check("the page", False, str(error))
    finally:
        page.close()
        if server.poll() is None:
            server.send_signal(signal.SIGINT)
        server.wait()


def box(page, selector):
    """x, y, width, height on the page."""
    return page.run(f"(b => [b.x, b.y, b.width, b.height])(document.querySelector('{selector}').getBoundingClientRect())")


def middle(page, selector="#render"):
    x, y, width, height = box(page, selector)
    return [x + width / 2, y + height / 2]


def run_tests(run):
    """run(folder) with a folder to work in; the exit code."""
    if browser.find() is None:
        print("skipped: no Chromium")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="gbt_page_") as work:
        run(work)
    print(f"{checks['passed']} passed, {checks['failed']} failed")
    return 1 if checks["failed"] else 0
