# SPDX-License-Identifier: Apache-2.0
"""tests/view/test_page.py -- the page in headless Chromium: it draws, refines, moves, compares, saves what `gbtrace render` draws too. Usage: test_page.py PROGRAM"""
import base64
import json
import os
import signal
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from page_support import CAMERA, STILL, check, gbtrace, make_run, middle, opened, run_tests  # noqa: E402


def check_same(name, a, b):
    psnr = json.loads(gbtrace("compare", "--json", a, b))["psnr"]
    check(name, psnr == 100, f"{psnr} dB")


def saved_picture(page, path):
    with open(path, "wb") as file:
        file.write(base64.b64decode(page.run("document.getElementById('render').toDataURL().split(',')[1]")))


def choose(page, name, value):
    page.run(f"document.querySelector('input[name={name}][value={value}]').click()")


def first_picture(page, work):
    page.wait("gbtrace.look.done.samples === 16 && document.getElementById('numbers').textContent.includes('16 rays/pixel')") # the line is written in the frame after
    check("views are listed", page.run("document.getElementById('view').options.length") == 9)
    page.run("document.getElementById('samples').value = '1'; gbtrace.changed()")
    choose(page, "compare", "slider")
    page.wait(f"{STILL} && gbtrace.look.done.samples === 1")
    view = page.run("gbtrace.look.scene.views[gbtrace.camera.view].name")
    gbtrace("render", work + "/run", "-o", work + "/drawn", "--split", "all")
    saved_picture(page, work + "/shown.png")
    check_same("beside its photo the picture is what render draws", work + "/shown.png", f"{work}/drawn/{view}")
    choose(page, "compare", "off")
    page.wait(STILL)
    page.run("document.getElementById('size').value = '1'; gbtrace.changed()")
    page.wait(STILL)
    saved_picture(page, work + "/shown.png")
    check_same("so it is alone, in that size", work + "/shown.png", f"{work}/drawn/{view}")
    page.run("document.getElementById('size').value = 'window'; gbtrace.changed()")
    page.wait(STILL)


def moving(page, work):
    before = page.run(CAMERA)
    x, y = middle(page)
    page.drag((x, y), (60, 20))
    page.wait(STILL)
    after = page.run(CAMERA)
    check("a drag moves the camera", before != after and page.run("gbtrace.camera.view") == -1)
    distance = "Math.hypot(...gbtrace.camera.eye.map((v, i) => v - gbtrace.camera.pivot[i]))"
    far = page.run(distance)
    page.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200)
    page.wait(f"{distance} < {far} * 0.9")
    eye = page.run("gbtrace.camera.eye")
    page.key("keyDown", "KeyW", "w")
    page.wait(f"Math.hypot(...gbtrace.camera.eye.map((v, i) => v - {json.dumps(eye)}[i])) > 0.01")
    page.key("keyUp", "KeyW", "w")
    page.wait(STILL)
    camera = page.run("JSON.stringify(gbtrace.camera.file(gbtrace.look.about.width, gbtrace.look.about.height))")
    with open(work + "/free.json", "w", encoding="utf-8") as file:
        file.write(camera)
    gbtrace("render", work + "/run", "-o", work + "/drawn", "--camera", work + "/free.json")
    saved_picture(page, work + "/shown.png")
    check_same("the copied camera shows what render draws", work + "/shown.png", work + "/drawn/free.png")


def lenses_and_outputs(page):
    for lens in ("fisheye", "orthographic", "equirectangular", "pinhole"):
        page.run(f"(e => {{ e.value = '{lens}'; e.dispatchEvent(new Event('change')); }})(document.getElementById('model'))")
        page.wait(STILL)
        check(lens, page.run("document.getElementById('message').hidden && gbtrace.camera.model") == lens)
        page.run("document.getElementById('samples').value = '4'; gbtrace.changed()")
        page.wait(f"{STILL} && gbtrace.look.done.samples === 4")
        page.run("document.getElementById('samples').value = '1'; gbtrace.changed()")
        page.wait(f"{STILL} && gbtrace.look.done.samples === 1")
    for output in ("depth", "normal", "transmittance", "hits", "anchor", "color"):
        choose(page, "output", output)
        page.wait(f"{STILL} && gbtrace.look.done.output === '{output}'")
        check("output " + output, page.run("document.getElementById('message').hidden"))
        check("legend of " + output, page.run("document.getElementById('legend').hidden") == (output in ("normal", "anchor", "color")))


def backgrounds(page):
    """Behind everything, far from the scene."""
    look_away = "gbtrace.camera.eye = [0, 0, 900]; gbtrace.camera.forward = [0, 0, 1]; gbtrace.camera.up = [0, 1, 0]; gbtrace.changed()"
    page.run(look_away)
    for color, value in (("ffffff", 255), ("808080", 128), ("000000", 0)):
        page.run(f"(e => {{ e.value = '{color}'; e.dispatchEvent(new Event('change')); }})(document.getElementById('background'))")
        page.wait(STILL)
        shown = page.run("[...document.getElementById('render').getContext('2d').getImageData(9, 9, 1, 1).data]")
        check("background " + color, shown == [value, value, value, 255], str(shown))


def back_to_the_photo(page):
    page.key("keyDown", "KeyR", "r")
    page.key("keyUp", "KeyR", "r")
    page.wait(f"gbtrace.camera.view >= 0 && gbtrace.look.photo && {STILL}")


def picking(page):
    """Where the scene is opaque, a double click sets what orbits go around."""
    choose(page, "output", "transmittance")
    page.wait(f"{STILL} && gbtrace.look.done.output === 'transmittance'")
    at = page.run("""(() => { const v = gbtrace.look.values, i = v.values.indexOf(v.values.reduce((a, b) => Math.min(a, b)));
        const b = document.getElementById('render').getBoundingClientRect();
        return [b.x + (i % v.width + 0.5) * b.width / v.width, b.y + (Math.floor(i / v.width) + 0.5) * b.height / v.height]; })()""")
    page.run("gbtrace.camera.pivot = [99, 99, 99]")
    page.double_click(*at)
    page.wait("gbtrace.camera.pivot[0] !== 99")
    check("a double click keeps the picture", page.run("gbtrace.camera.view") >= 0)
    choose(page, "output", "color")
    page.wait(STILL)


def comparing(page):
    choose(page, "compare", "difference")
    page.wait(f"{STILL} && gbtrace.look.psnr > 10 && gbtrace.look.psnr < 60")
    page.run("gbtrace.look.marks.fill(0); gbtrace.changed()")
    page.wait(f"{STILL} && gbtrace.look.psnr === null")
    page.run("gbtrace.look.marks.fill(255); gbtrace.changed()")
    page.wait(f"{STILL} && gbtrace.look.psnr > 10 && gbtrace.look.psnr < 60")
    choose(page, "compare", "slider")
    page.wait(STILL)
    page.drag(middle(page, "#handle"), (40, 0))
    check("the slider slides", page.run("gbtrace.look.split") > 0.5 and page.run("gbtrace.camera.view") >= 0)
    page.run("document.getElementById('handle').focus()")
    for key, split in (("End", 1), ("ArrowDown", 0.98), ("Home", 0), ("ArrowUp", 0.02)):
        page.press(key, key)
        check("the slider by " + key, abs(page.run("gbtrace.look.split") - split) < 1e-6, str(page.run("gbtrace.look.split")))
    check("keys of the slider move no camera", page.run("gbtrace.camera.view") >= 0)
    choose(page, "compare", "beside")
    page.wait(STILL)
    check("beside", not page.run("document.getElementById('photo-box').hidden"))
    note = "document.getElementById('compare-note').textContent"
    check("it is said that they have one size", "pixel for pixel" in page.run(note), page.run(note))
    page.run("(e => { e.value = 'equirectangular'; e.dispatchEvent(new Event('change')); })(document.getElementById('model'))")
    page.wait(STILL)
    shapes = [page.run(f"(b => b.width / b.height)(document.getElementById('{name}').getBoundingClientRect())") for name in ("photo", "render")]
    check("but not of a panorama", page.run(note) == "", page.run(note))
    check("a panorama beside the photo: each in its shape", abs(shapes[0] - 4 / 3) < 0.02 and abs(shapes[1] - 2) < 0.02, str(shapes))
    choose(page, "compare", "off")
    photo = "document.getElementById('photo').getContext('2d').getImageData(0, 0, 103, 77).data"
    page.run(f"window.rawPhoto = {photo}; (e => {{ e.value = 'jpeg'; e.dispatchEvent(new Event('change')); }})(document.getElementById('transfer'))")
    page.wait(f"{photo}.some((v, i) => v !== window.rawPhoto[i])")
    far = page.run(f"{photo}.reduce((sum, v, i) => sum + Math.abs(v - window.rawPhoto[i]), 0) / window.rawPhoto.length")
    check("a photo comes as pictures do", far < 16, str(far))
    page.run("(e => { e.value = 'raw'; e.dispatchEvent(new Event('change')); })(document.getElementById('transfer'))")
    page.wait(f"{photo}.every((v, i) => v === window.rawPhoto[i])")
    before = page.run("gbtrace.look.view")
    page.run("document.getElementById('next').click()")
    page.wait(f"gbtrace.look.view === {before + 1} && gbtrace.look.photo && {STILL}")


def plain_gaussians(work):
    gbtrace("export", work + "/run", work + "/plain.ply", "--refine", "0")
    with opened(work + "/plain.ply") as page:
        page.run("document.getElementById('help').showModal()")
        words = page.run("""[...document.querySelectorAll('body *')].filter(e => e.checkVisibility() && e.closest('option') === null)
            .flatMap(e => [...e.childNodes].filter(n => n.nodeType === 3).map(n => n.data)).join(' ')""")
        check("the page has words", "Gaussians" in words and "orbit" in words, words)
        check("nothing is said of photos where there are none", "photo" not in words.lower(), words)
        page.run("document.getElementById('help').close()")
        before = page.run(CAMERA)
        for code, key in (("KeyR", "r"), ("KeyC", "c"), ("BracketLeft", "["), ("BracketRight", "]")):
            page.press(code, key)
        check("keys of photos do nothing", page.run(CAMERA) == before and not page.run("document.getElementById('cameras').checked"))
        page.press("KeyG", "g")
        page.wait(f"{STILL} && document.getElementById('grid').checked")


def from_another_device(work):
    with opened(work + "/run", "--host", "0.0.0.0") as page:
        check("the token is printed", "/?token=" in page.address, page.address)
        check("it leaves the address bar", page.run("location.href") == page.address.partition("?")[0], page.run("location.href"))
        check("no script can read it", page.run("document.cookie") == "")
        page.open(page.address.partition("?")[0])
        page.wait(STILL)
        check("the browser keeps it", page.run("fetch('status').then(r => r.status)") == 200)
        page.call("Network.clearBrowserCookies")
        check("nobody is answered without", page.run("fetch('status').then(r => r.status)") == 403)
        page.errors = []


def tests(work):
    make_run(work, 103, 77) # width by height times height is a little less than this width
    with opened(work + "/run") as page:
        first_picture(page, work)
        moving(page, work)
        lenses_and_outputs(page)
        backgrounds(page)
        back_to_the_photo(page)
        picking(page)
        comparing(page)
        check("the run's log is drawn", page.run("!document.getElementById('training-part').hidden && document.querySelector('#chart .train') !== null"))
        check("no errors in the page", not page.errors, str(page.errors))
        page.server.send_signal(signal.SIGINT)
        check("Ctrl-C ends with 0", page.server.wait() == 0, str(page.server.returncode))
        page.wait("document.getElementById('message').textContent.includes('has ended')")
    plain_gaussians(work)
    from_another_device(work)


if __name__ == "__main__":
    sys.exit(run_tests(tests))
