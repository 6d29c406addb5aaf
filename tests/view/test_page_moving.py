# SPDX-License-Identifier: Apache-2.0
"""tests/view/test_page_moving.py -- moving about in the page: keys after clicks, speed, fit, lines over the picture, sizes, fingers.

Usage: test_page_moving.py PROGRAM
"""
import json
import math
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import PageError  # noqa: E402
from page_support import CAMERA, STILL, TWO_FRAMES, box, check, make_run, middle, opened, run_tests  # noqa: E402

TO_SUBJECT = "Math.hypot(...gbtrace.camera.eye.map((v, i) => v - gbtrace.look.subject.middle[i]))"


def moves(page, code, key):
    """Whether the camera moves while a key is held."""
    before = json.dumps(page.run(CAMERA))
    page.key("keyDown", code, key)
    try:
        page.wait(f"{CAMERA} !== {before}", 10)
        return True
    except PageError:
        return False
    finally:
        page.key("keyUp", code, key)


def keys_after_clicks(page):
    page.run("window.prompt = () => null") # where the clipboard is closed
    page.press("KeyF", "f") # the photo's own lens has no slider
    for selector in ("#fov", "#next", "#home", "#back", "#copy", "input[value=depth] + span", "input[value=color] + span", "#speed",
                     "#grid + span", "#grid + span", "summary", "summary", "#render"):
        page.click(*middle(page, selector))
        page.wait(STILL)
        check(f"W A S D after {selector}", moves(page, "KeyD", "d"), page.run("document.activeElement.outerHTML"))
        check(f"arrows after {selector}", moves(page, "ArrowLeft", "ArrowLeft"), page.run("document.activeElement.outerHTML"))
    page.click(*middle(page, "#help-button"))
    page.wait("document.getElementById('help').open")
    page.click(*middle(page, "#help button"))
    check("W A S D after the help", moves(page, "KeyD", "d"), page.run("document.activeElement.outerHTML"))
    page.run("document.getElementById('view').focus()")
    before = page.run(CAMERA)
    page.key("keyDown", "KeyD", "d")
    page.run(TWO_FRAMES)
    page.key("keyUp", "KeyD", "d")
    check("a list that was reached by the keyboard keeps its keys", page.run(CAMERA) == before)
    page.run("document.activeElement.blur()")


def flying(page):
    page.press("KeyH", "h")
    page.wait(f"gbtrace.camera.view >= 0 && {STILL}")
    eye, far = page.run("gbtrace.camera.eye"), page.run(TO_SUBJECT)
    page.key("keyDown", "KeyW", "w")
    time.sleep(2)
    page.key("keyUp", "KeyW", "w")
    way = page.run(f"Math.hypot(...gbtrace.camera.eye.map((v, i) => v - {json.dumps(eye)}[i]))")
    check("two seconds of W stay in front of the subject", 0 < way < 0.8 * far, f"{way} of {far}")
    # Half a radius a second, and at most eight times that.
    page.run("""document.getElementById('speed').value = 3; window.fastest = 0;
        (() => { let at = gbtrace.camera.eye, before = performance.now(); setInterval(() => {
            const now = performance.now(), way = Math.hypot(...gbtrace.camera.eye.map((v, i) => v - at[i])) / gbtrace.look.subject.radius;
            window.fastest = Math.max(window.fastest, 1000 * way / (now - before));
            at = gbtrace.camera.eye, before = now; }, 400); })()""")
    page.key("keyDown", "KeyS", "s")
    try:
        page.wait("window.fastest > 1", 20)
    except PageError:
        check("the slider makes it faster", False, str(page.run("window.fastest")))
    page.key("keyUp", "KeyS", "s")


def slow(page):
    """Pictures that take half a second are shown while the camera moves, not thrown away for newer ones."""
    page.press("KeyF", "f")
    page.wait(STILL)
    shown = page.run("""(async () => {
        const ask = window.fetch, show = gbtrace.pictures.show;
        let shown = 0;
        window.fetch = async (...what) => {
            const response = await ask(...what);
            await new Promise(done => setTimeout(done, String(what[0]).startsWith('render') ? 500 : 0));
            return response;
        };
        gbtrace.pictures.show = (...what) => { shown++; return show(...what); };
        const moves = setInterval(() => gbtrace.pictures.change(true), 16);
        await new Promise(done => setTimeout(done, 4000));
        clearInterval(moves);
        window.fetch = ask, gbtrace.pictures.show = show;
        gbtrace.changed();
        return shown;
    })()""")
    check("slow pictures are shown while the camera moves", shown >= 2, str(shown))
    page.wait(STILL)
    page.run("gbtrace.camera.view = -1")
    far, eye = page.run(TO_SUBJECT), page.run("gbtrace.camera.eye")
    page.run("""(stage => { for (const way of [-1, 1]) for (let i = 0; i < 400; i++)
        stage.dispatchEvent(new WheelEvent('wheel', { deltaY: 200 * way, bubbles: true, cancelable: true })); })(document.getElementById('stage'))""")
    page.wait(STILL)
    check("the wheel comes back from very near", page.run(TO_SUBJECT) > far / 2, f"{page.run(TO_SUBJECT)}, {far}, {eye}")


def fit_and_start(page):
    page.press("KeyH", "h")
    page.wait(f"gbtrace.camera.view >= 0 && {STILL}")
    start, far = page.run(CAMERA), page.run(TO_SUBJECT)
    page.run("gbtrace.camera.move(300, -200, 100); gbtrace.camera.view = -1; gbtrace.changed()")
    page.press("KeyF", "f")
    page.wait(STILL)
    again = page.run(TO_SUBJECT)
    ahead = page.run("gbtrace.camera.forward.reduce((s, v, i) => s + v * (gbtrace.look.subject.middle[i] - gbtrace.camera.eye[i]), 0)")
    check("F looks at the subject from as far as photos do", 0.3 * far < again < 3 * far and abs(ahead - again) < 1e-6 * again, f"{again}, {far}")
    page.press("KeyH", "h")
    page.wait(STILL)
    check("H is the start", page.run(CAMERA) == start)
    for key, hidden in (("f", True), ("h", False)):
        page.press("Key" + key.upper(), key)
        note = page.run("(e => [e.hidden, e.textContent])(document.getElementById('copy-note'))")
        check("at a photo it is said that a copied camera has not all of its lens", note[0] == hidden and "like the photo's lens" in note[1], str(note))
    page.wait(STILL)


def staying(page):
    """What moves nothing does not leave the photo's camera."""
    page.press("KeyH", "h")
    page.wait(f"gbtrace.camera.view >= 0 && {STILL}")
    wheel = "document.getElementById('stage').dispatchEvent(new WheelEvent('wheel', { deltaX: %d, deltaY: %d, bubbles: true, cancelable: true }))"
    page.run(wheel % (200, 0))
    check("a swipe to the side stays", page.run("gbtrace.camera.view") >= 0)
    page.run(f"""(async () => {{
        const send = kind => ['w', 's'].forEach(key => document.body.dispatchEvent(new KeyboardEvent(kind, {{ key, code: 'Key' + key.toUpperCase(), bubbles: true }})));
        send('keydown');
        await {TWO_FRAMES};
        send('keyup'); }})()""")
    check("W and S together stay", page.run("gbtrace.camera.view") >= 0)
    page.run("gbtrace.camera.pivot = gbtrace.camera.eye.map((v, i) => v + 1e-5 * gbtrace.look.subject.radius * gbtrace.camera.forward[i])")
    page.run(wheel % (0, -200))
    check("the wheel at its end stays", page.run("gbtrace.camera.view") >= 0)
    page.run(wheel % (0, 200))
    check("and leaves where it moves", page.run("gbtrace.camera.view") == -1)


def drawn(page):
    """How many points of the overlay are not empty."""
    return page.run("""(c => c.width && c.getContext('2d').getImageData(0, 0, c.width, c.height).data.filter((v, i) => i % 4 === 3 && v > 0).length)(
        document.getElementById('lines'))""")


def lines(page):
    page.press("KeyF", "f")
    page.wait(STILL)
    check("no lines at first", drawn(page) == 0)
    page.press("KeyG", "g")
    check("a grid", drawn(page) > 1000, str(drawn(page)))
    page.press("KeyG", "g")
    page.press("KeyC", "c")
    check("cameras", drawn(page) > 200, str(drawn(page)))
    page.run("gbtrace.camera.zoom(3); gbtrace.camera.view = -1; gbtrace.changed()")
    page.wait(STILL)
    check("all cameras are in view from afar", page.run("gbtrace.lines.eyes.length") == 9, str(page.run("gbtrace.lines.eyes")))
    fov = page.run("gbtrace.camera.fov")
    page.run("gbtrace.camera.fov = 5; gbtrace.changed()")
    page.wait(STILL)
    width, height = box(page, "#lines")[2:]
    eyes = page.run("gbtrace.lines.eyes")
    check("no camera beside the picture can be clicked", len(eyes) < 9 and all(0 <= e["x"] <= width and 0 <= e["y"] <= height for e in eyes), str(eyes))
    page.run(f"gbtrace.camera.fov = {fov}; gbtrace.changed()")
    page.wait(STILL)
    eye = page.run("gbtrace.lines.eyes[4]")
    left, top, _, _ = box(page, "#lines")
    page.mouse("mouseMoved", left + eye["x"], top + eye["y"])
    name = page.run("document.getElementById('name').textContent")
    check("the camera under the mouse is named", name == page.run(f"gbtrace.look.scene.views[{eye['index']}].name"), name)
    nearest = page.run(f"gbtrace.lines.cameraAt({left + eye['x']}, {top + eye['y']})")
    page.click(left + eye["x"], top + eye["y"])
    page.wait(f"gbtrace.camera.view === {nearest} && {STILL}")
    check("a click goes to that photo", nearest == eye["index"] and page.run("document.getElementById('view').value") == str(nearest))
    for lens in ("fisheye", "orthographic", "equirectangular", "pinhole"):
        page.run("gbtrace.camera.fit(gbtrace.look.subject); gbtrace.camera.zoom(2)")
        page.run(f"(e => {{ e.value = '{lens}'; e.dispatchEvent(new Event('change')); }})(document.getElementById('model'))")
        page.wait(STILL)
        check("lines for " + lens, drawn(page) > 100, str(drawn(page)))
        off = page.run("""(async () => {
            const { lensOf } = await import('./lines.js'), shot = gbtrace.look.done.shot, lens = lensOf(shot), far = [];
            for (const [x, y] of [[0.4, 0.45], [0.5, 0.5], [0.55, 0.6]].map(p => [p[0] * shot.width, p[1] * shot.height])) {
                const found = await (await fetch('pick?' + new URLSearchParams({ camera: JSON.stringify(shot), x, y }))).json();
                if (found.hit)
                    far.push(Math.hypot(...(lens.flat || lens.round)(lens.turn(found.point)).map((v, i) => v - [x, y][i])));
            }
            return far; })()""")
        check("lines are where the picture has their points: " + lens, len(off) > 0 and max(off) < 0.05, str(off))
    page.press("KeyC", "c")
    check("and none again", drawn(page) == 0)


def spread(page):
    """Tangents of half the shown picture's angles, and of half the photo's."""
    shown = page.run("gbtrace.look.done.shot")
    photo = page.run("gbtrace.look.scene.views[gbtrace.look.view]")
    x, photo_x = math.tan(math.radians(shown["fov_x_deg"] / 2)), math.tan(math.radians(photo["fov_x_deg"] / 2))
    return [x, x * shown["height"] / shown["width"]], [photo_x, photo_x * photo["height"] / photo["width"]]


def sizes(page):
    for width, height, scale in ((1200, 800, 1), (1500, 500, 1), (1000, 700, 2)):
        name = f"window of {width} x {height}, {scale} pixels each"
        page.resize(width, height, scale)
        page.run("gbtrace.pictures.cost = { fixed: 1, pixel: 1e-9 }; gbtrace.pictures.learn = () => {}") # as on a fast machine
        page.press("KeyH", "h")
        page.wait(f"gbtrace.camera.view >= 0 && window.devicePixelRatio === {scale} && {STILL}")
        room = [round(v * scale) for v in box(page, "#stage")[2:]]
        page.wait(f"gbtrace.look.about.height >= {room[1]} - 1 || gbtrace.look.about.width >= {room[0]} - 1")
        photo = page.run("gbtrace.look.scene.views[gbtrace.look.view]")
        size = page.run("[gbtrace.look.about.width, gbtrace.look.about.height]")
        begin = [v * scale for v in box(page, "#render")[:2]]
        check(name + ": on the screen's own pixels", all(abs(v - round(v)) < 1e-3 for v in begin), str(begin))
        fits = size[0] <= room[0] and size[1] <= room[1]
        check(name + ": the photo's shape", fits and abs(size[0] / size[1] - photo["width"] / photo["height"]) < 0.01, f"{size} in {room}")
        page.run("gbtrace.camera.view = -1; gbtrace.changed()")
        page.wait(STILL)
        size = page.run("[gbtrace.look.about.width, gbtrace.look.about.height]")
        check(name + ": all of it, when the camera is free", all(abs(a - b) <= 1 for a, b in zip(size, room)), f"{size} in {room}")
        shown, wanted = spread(page)
        shares = [a / b for a, b in zip(shown, wanted)]
        check(name + ": all that the photo sees, and no more than it takes", abs(min(shares) - 1) < 0.005, str(shares))
    page.run("const show = gbtrace.pictures.show; window.sizes = [];"
             "gbtrace.pictures.show = (picture, done) => { window.sizes.push(picture.about.width * picture.about.height); return show(picture, done); };"
             "gbtrace.pictures.cost = { fixed: 1, pixel: 0.01 }; gbtrace.changed()") # as on a slow one
    page.wait(STILL)
    drawn_sizes = page.run("window.sizes")
    # One that was on its way when the machine became slow may be shown before.
    check("on a slow machine a picture of fewer pixels comes first, then all", min(drawn_sizes) < 60000 < drawn_sizes[-1], str(drawn_sizes))


def dragging(page):
    """What is shown meanwhile."""
    page.run("""window.seen = [];
        (show => gbtrace.pictures.show = async (p, d) => { window.seen.push([p.about.width, p.about.height]); await show(p, d); })(gbtrace.pictures.show)""")
    for _ in range(20):
        page.drag(middle(page), (150, 30), steps=60, pause=0.02)
        seen = page.run("window.seen")
        if len(seen) > 3:
            break
    check("no mosaic while it is dragged", len(seen) > 3 and all(max(size) >= 240 for size in seen), str(seen))
    page.wait(STILL)


def fingers(work):
    with opened(work + "/run", width=390, height=844, scale=3, phone=True) as page:
        _, top, _, height = box(page, "#stage")
        picture = box(page, "#render")
        check("the status is below the picture", box(page, "#status")[1] >= top + height and picture[1] + picture[3] <= top + height + 0.5)
        check("the page is no wider than the phone", page.run("document.documentElement.scrollWidth") <= 390)
        page.run("document.querySelector('input[value=beside]').click()")
        page.wait(f"{STILL} && gbtrace.look.photo && !document.getElementById('photo-box').hidden")
        photo, picture = box(page, "#photo"), box(page, "#render")
        apart = photo[1] + photo[3] <= picture[1] and abs(photo[0] - picture[0]) < 1
        check("beside is above where it is higher than wide", apart and picture[1] + picture[3] <= top + height + 0.5, f"{photo} {picture}")
        page.run("document.querySelector('input[value=off]').click()")
        page.wait(STILL)
        x, y = middle(page)
        before = page.run("gbtrace.camera.distance()")
        page.fingers([(x, y)], [(x + 60, y + 10)])
        page.wait(STILL)
        check("one finger orbits", page.run("gbtrace.camera.view") == -1 and abs(page.run("gbtrace.camera.distance()") / before - 1) < 1e-6)
        page.fingers([(x - 30, y), (x + 30, y)], [(x - 60, y), (x + 60, y)])
        page.wait(STILL)
        far, pivot = page.run("gbtrace.camera.distance()"), page.run("gbtrace.camera.pivot")
        check("two fingers apart bring it closer", abs(far / before * 2 - 1) < 0.2, f"{far} of {before}")
        page.fingers([(x - 30, y), (x + 30, y)], [(x + 20, y), (x + 80, y)])
        page.wait(STILL)
        moved = page.run(f"Math.hypot(...gbtrace.camera.pivot.map((v, i) => v - {json.dumps(pivot)}[i]))")
        shot = page.run("gbtrace.look.done.shot")
        wanted = 50 / 390 * 2 * far * math.tan(math.radians(shot["fov_x_deg"] / 2))
        check("two fingers shift it with them", abs(moved / wanted - 1) < 0.15, f"{moved}, {wanted}")
        check("and keep its distance", abs(page.run("gbtrace.camera.distance()") / far - 1) < 0.1)


def tests(work):
    make_run(work, 72, 96)
    with opened(work + "/run") as page:
        keys_after_clicks(page)
        flying(page)
        slow(page)
    with opened(work + "/run", dark=True) as page:
        fit_and_start(page)
        staying(page)
        lines(page)
        dragging(page)
        sizes(page)
    fingers(work)


if __name__ == "__main__":
    sys.exit(run_tests(tests))
