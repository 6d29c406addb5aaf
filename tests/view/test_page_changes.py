# SPDX-License-Identifier: Apache-2.0
"""tests/view/test_page_changes.py -- what changes under an open page: another run in the viewer's place, no photo, other pages, a first model.

Usage: test_page_changes.py PROGRAM
"""
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from page_support import STILL, TWO_FRAMES, check, make_run, middle, opened, run_tests, start, stop  # noqa: E402

PHOTO = "(c => String(c.getContext('2d').getImageData(0, 0, c.width, c.height).data))(document.getElementById('photo'))"

MESSAGE = "document.getElementById('message').textContent"
FACTS = "document.getElementById('facts').textContent"


def another_viewer(page, path):
    """On the same port; until the page has noticed that the old one ended, and shows the new one."""
    port = page.address.rstrip("/").rpartition(":")[2]
    stop(page.server)
    page.wait("gbtrace.training.gone")
    page.server, _ = start(path, port=port)
    page.wait("!gbtrace.training.gone")


def unseen_viewer(page, path):
    """The same between two polls of the page."""
    port = page.address.rstrip("/").rpartition(":")[2]
    page.run("gbtrace.training.poll = () => { gbtrace.training.waits = true; }")
    page.wait("gbtrace.training.waits")
    stop(page.server)
    page.server, _ = start(path, port=port)
    page.run("delete gbtrace.training.poll; gbtrace.training.poll()")


def other_photos(work):
    """Fewer, then more of them; and the log is the other run's, from its begin."""
    for run in ("/run", "/run_few"):  # a row each second, on a slow machine more than one
        with open(work + run + "/log.csv", encoding="utf-8") as log:
            lines = log.readlines()
        with open(work + run + "/log.csv", "w", encoding="utf-8") as log:
            log.writelines([lines[0], lines[-1]])
    with open(work + "/run_few/log.csv", "a", encoding="utf-8") as log:
        log.write(log_row(work + "/run_few").replace("60,", "61,", 1) * 3)
    with opened(work + "/run") as page:
        page.run("document.getElementById('view').value = 8; document.getElementById('view').dispatchEvent(new Event('change'))")
        page.wait(f"gbtrace.look.view === 8 && gbtrace.look.photo && {STILL}")
        for path, views, rows in (("/run_few", 4, 4), ("/run", 9, 1)):
            another_viewer(page, work + path)
            page.wait(f"gbtrace.look.scene.views.length === {views} && gbtrace.look.photo && {STILL}")
            size = page.run("[document.getElementById('photo').width, gbtrace.look.scene.views[gbtrace.look.view].width]")
            check(path + ": a photo of it is shown", size[0] == size[1] and page.run("document.getElementById('message').hidden"), str(size))
            page.wait(f"gbtrace.training.rows.length === {rows}")
        check("one row is a dot", page.run("document.querySelectorAll('#chart circle.train').length") == 1)
        unseen_viewer(page, work + "/run_few")
        page.wait(f"gbtrace.look.scene.views.length === 4 && gbtrace.training.rows.length === 4 && {STILL}")
        check("a viewer that was started again between two polls is noticed", page.run("document.querySelectorAll('#chart circle.train').length") == 0)
        page.press("KeyF", "f")
        page.wait(STILL)
        page.errors = []  # of the time between them


def other_pixels(work):
    """In a photo of the same name."""
    with opened(work + "/run") as page:
        page.wait("gbtrace.look.photo !== null")
        before = page.run(PHOTO)
        name = page.run("gbtrace.look.scene.views[gbtrace.look.view].name")
        others = [file for file in os.listdir(work + "/scene/images") if not name.endswith(file)]
        path = f"{work}/scene/images/{os.path.basename(name)}"
        os.rename(path, work + "/kept")
        with open(f"{work}/scene/images/{others[0]}", "rb") as other, open(path, "wb") as file:
            file.write(other.read())
        another_viewer(page, work + "/run")
        page.wait(f"{PHOTO} !== {before!r}")
        os.rename(work + "/kept", path)
        page.errors = []


def no_photo(work):
    """It is said; the difference to nothing is not drawn; R tries again."""
    name, note = "gbtrace.look.scene.views[gbtrace.look.view].name", "document.getElementById('compare-note').textContent"
    with opened(work + "/run") as page:
        page.run("document.querySelector('input[name=compare][value=difference]').click()")
        page.wait(f"{STILL} && gbtrace.look.psnr > 10")
        os.rename(work + "/scene/images", work + "/scene/gone")
        page.run("document.getElementById('next').click()")
        page.wait(f"{note}.startsWith('No photo: ') && {note}.includes({name}) && gbtrace.look.psnr === null && {STILL}")
        page.run("document.querySelector('input[name=compare][value=beside]').click()")
        page.wait(f"{STILL} && {note}.startsWith('No photo: ')")
        check("the render is alone", page.run("document.getElementById('photo-box').hidden && gbtrace.look.about.width > 96"))
        os.rename(work + "/scene/gone", work + "/scene/images")
        page.press("KeyR", "r")
        page.wait(f"{STILL} && !document.getElementById('photo-box').hidden && !{note}.includes('No photo')")
        page.errors = []  # "Failed to load resource"


def busy(work):
    """Other pages have their pictures drawn, for six seconds."""
    with opened(work + "/run") as page:
        page.run("""(ask => { window.refused = 0; window.ask = ask;
            window.fetch = async (what, how) => what.startsWith('render') ? (window.refused++, new Response('', { status: 503 })) : ask(what, how); })(window.fetch)""")
        page.press("KeyF", "f")
        page.wait("window.refused > 40")
        check("it goes on asking", page.run("document.getElementById('message').hidden"), page.run(MESSAGE))
        page.run("gbtrace.camera.zoom(2); gbtrace.changed(); window.fetch = window.ask")
        page.wait(STILL)
        check("and gets what is wanted last", page.run("gbtrace.look.done.shot.origin.join() === gbtrace.camera.eye.join()"))


def before_the_first_model(work):
    """What is pressed does no harm; files that are no models are named."""
    os.mkdir(work + "/run_new")
    shutil.copy(work + "/run/config", work + "/run_new")
    with opened(work + "/run_new", until=f"{MESSAGE}.includes('not saved a model')") as page:
        for code, key in (("KeyW", "w"), ("KeyG", "g"), ("KeyG", "g"), ("KeyC", "c"), ("KeyR", "r"), ("KeyF", "f"), ("KeyH", "h"), ("BracketRight", "]")):
            page.key("keyDown", code, key)
            page.run(TWO_FRAMES)
            page.key("keyUp", code, key)
        page.drag(middle(page, "#stage"), (40, 10))
        x, y = middle(page, "#stage")
        page.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200)
        page.double_click(*middle(page, "#stage"))
        for button in ("#copy", "#save", "#cameras", "#cameras"):
            page.run(f"window.prompt = () => null; document.querySelector('{button}').click()")
        check("no errors before there is a model", not page.errors, str(page.errors))
        put(work + "/run/config", work + "/run_new/model.gbt")
        page.wait(f"{MESSAGE}.includes('not a gbtrace file')")
        put(work + "/run/model.gbt", work + "/run_new/model.gbt")
        page.wait(f"{STILL} && !{FACTS}.includes('not a gbtrace file')")
        put(work + "/run/config", work + "/run_new/model.gbt")
        page.wait(f"{FACTS}.includes('anchors') && {FACTS}.includes('not a gbtrace file')")
        before = page.run("gbtrace.camera.eye.join()")
        page.key("keyDown", "KeyW", "w")
        page.wait(f"gbtrace.camera.eye.join() !== '{before}'")
        page.key("keyUp", "KeyW", "w")


def another_log(work):
    """Of another program: without our columns. And one that is too long to be the arguments of a function."""
    shutil.copytree(work + "/run", work + "/foreign")
    with open(work + "/foreign/log.csv", "w", encoding="utf-8") as log:
        log.write("iteration,loss\n1,0.5\n")
    shutil.copytree(work + "/run", work + "/long")
    row = log_row(work + "/run")
    with open(work + "/long/log.csv", "a", encoding="utf-8") as log:
        log.write(row * 200000)
    for run, hidden in (("/foreign", True), ("/long", False)):
        with opened(work + run) as page:
            page.wait(STILL)
            page.wait(f"document.getElementById('training-part').hidden === {str(hidden).lower()}")
            check(run + ": pictures, and no message", page.run("document.getElementById('message').hidden"), page.run(MESSAGE))


def a_score_in_the_log(work):
    """Right after a row it has no means."""
    shutil.copytree(work + "/run", work + "/scored")
    with open(work + "/scored/log.csv", "r+", encoding="utf-8") as log:
        names, *_, last = [line.rstrip("\n").split(",") for line in log]
        known = {"test_psnr": "21.5", **{name: value for name, value in zip(names, last) if name in ("step", "seconds", "progress", "anchors")}}
        log.write(",".join(known.get(name, "") for name in names) + "\n")
    with opened(work + "/scored") as page:
        page.wait("!document.getElementById('training-part').hidden")
        now = page.run("document.getElementById('training-now').textContent")
        check("the line has the last measured PSNR", " dB" in now and "NaN" not in now, now)
        check("the score is a dot", page.run("document.querySelectorAll('#chart circle.test').length") == 1)


def refused_scene(work):
    """The server's line is shown until it answers again."""
    with opened(work + "/run") as page:
        page.run("""(ask => { window.ask = ask;
            window.fetch = async (what, how) => what === 'scene' ? new Response('error: not now\\n', { status: 503 }) : ask(what, how); })(window.fetch);
            gbtrace.training.version = -1""")
        page.wait(f"{MESSAGE} === 'error: not now' && !document.getElementById('message').hidden")
        page.run("window.fetch = window.ask")
        page.wait(f"document.getElementById('message').hidden && {STILL}")


def put(file, place):
    """At once, as training does."""
    shutil.copy(file, place + ".new")
    os.rename(place + ".new", place)


def log_row(run):
    with open(run + "/log.csv", encoding="utf-8") as log:
        return log.readlines()[-1]


def tests(work):
    make_run(work, 96, 72)
    make_run(work, 64, 48, 4, "_few")
    other_photos(work)
    other_pixels(work)
    no_photo(work)
    another_log(work)
    a_score_in_the_log(work)
    busy(work)
    refused_scene(work)
    before_the_first_model(work)


if __name__ == "__main__":
    sys.exit(run_tests(tests))
