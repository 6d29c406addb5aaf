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
TWO_FRAMES = "new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame)).then(() => true)"
program = sys.argv[1]
checks = {"passed": 0, "failed": 0}


def check(name, fine, details=""):
    checks["passed" if fine else "failed"] += 1
    if not fine:
        print(f"FAILED: {name}: {details}")


def gbtrace(*arguments):
    return subprocess.run([program, *arguments], check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True).stdout


def make_run(work, width, height, views=9, name=""):
    """A scene, and a run on it: work/run."""
    scene, run, size = f"{work}/scene{name}", f"{work}/run{name}", ("--width", str(width), "--height", str(height))
    gbtrace("make-scene", "tabletop", "-o", scene, *size, "--views", str(views), "--samples", "1", "--points", "300")
    gbtrace("train", scene, "-o", run, "--iterations", "60")


def start(path, *options, port="0"):
    """The viewer, when it listens, and the page's address."""
    server = subprocess.Popen([program, "view", path, "--port", port, *options], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return server, server.stdout.readline().strip()


def stop(server):
    if server.poll() is None:
        server.send_signal(signal.SIGINT)
    server.wait()


@contextlib.contextmanager
def opened(path, *options, width=1200, height=800, dark=False, scale=1, phone=False, until=STILL):
    """The page of `gbtrace view PATH`; page.server and page.address are the viewer's."""
    server, address = start(path, *options)
    page = browser.Browser(browser.find(), width, height, dark, scale, phone)
    page.server, page.address = server, address
    try:
        page.open(page.address)
        page.wait(until)
        yield page
        if page.server.poll() is None:
            check("no errors in the page", not page.errors, str(page.errors))
    except browser.PageError as error:
        check("the page", False, str(error))
    finally:
        page.close()
        stop(page.server)


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
