"""tests/view/test_page.py -- the page in headless Chromium: it draws, refines, moves, compares, saves what `gbtrace render` draws too. Usage: test_page.py PROGRAM"""
import base64
import json
import os
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import browser  # noqa: E402

SKIPPED = 77
program = sys.argv[1]
checks = {"passed": 0, "failed": 0}


def check(name, fine, details=""):
    checks["passed" if fine else "failed"] += 1
    if not fine:
        print(f"FAILED: {name}: {details}")


def gbtrace(*arguments):
    return subprocess.run([program, *arguments], check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True).stdout


def check_same(name, a, b):
    psnr = json.loads(gbtrace("compare", "--json", a, b))["psnr"]
    check(name, psnr == 100, f"{psnr} dB")


STILL = "gbtrace.look.done && gbtrace.look.done.generation === gbtrace.pictures.generation && gbtrace.look.done.scale === 1"


def saved_picture(page, path):
    with open(path, "wb") as file:
        file.write(base64.b64decode(page.run("document.getElementById('render').toDataURL().split(',')[1]")))


def choose(page, name, value):
    page.run(f"document.querySelector('input[name={name}][value={value}]').click()")


def middle(page):
    return page.run("(() => { const b = document.getElementById('render').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")


def first_picture(page, work):
    page.wait("gbtrace.look.done.samples === 16 && document.getElementById('numbers').textContent.includes('16 rays/pixel')") # the line is written in the frame after
    check("views are listed", page.run("document.getElementById('view').options.length") == 9)
    page.run("document.getElementById('samples').value = '1'; gbtrace.changed()")
    page.wait(STILL)
    view = page.run("gbtrace.look.scene.views[gbtrace.camera.view].name")
    gbtrace("render", work + "/run", "-o", work + "/drawn", "--split", "all")
    saved_picture(page, work + "/shown.png")
    check_same("a photo's camera shows what render draws", work + "/shown.png", f"{work}/drawn/{view}")


def moving(page, work):
    before = page.run("JSON.stringify(gbtrace.camera.file(8, 8))")
    x, y = middle(page)
    page.drag((x, y), (60, 20))
    page.wait(STILL)
    after = page.run("JSON.stringify(gbtrace.camera.file(8, 8))")
    check("a drag moves the camera", before != after and page.run("gbtrace.camera.view") == -1)
    distance = "Math.hypot(...gbtrace.camera.eye.map((v, i) => v - gbtrace.camera.pivot[i]))"
    far = page.run(distance)
    page.mouse("mouseWheel", x, y, deltaX=0, deltaY=-200)
    page.wait(f"{distance} < {far} * 0.9")
    check("the wheel keeps the view", True)
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
    for output in ("depth", "normal", "transmittance", "hits", "anchor", "color"):
        choose(page, "output", output)
        page.wait(f"{STILL} && gbtrace.look.done.output === '{output}'")
        check("output " + output, page.run("document.getElementById('message').hidden"))
        check("legend of " + output, page.run("document.getElementById('legend').hidden") == (output in ("normal", "anchor", "color")))


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
    choose(page, "compare", "slider")
    page.wait(STILL)
    box = page.run("(() => { const b = document.getElementById('handle').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")
    page.drag(box, (40, 0))
    check("the slider slides", page.run("gbtrace.look.split") > 0.5 and page.run("gbtrace.camera.view") >= 0)
    choose(page, "compare", "beside")
    page.wait(STILL)
    check("beside", not page.run("document.getElementById('photo-box').hidden"))
    choose(page, "compare", "off")
    before = page.run("gbtrace.look.view")
    page.run("document.getElementById('next').click()")
    page.wait(f"gbtrace.look.view === {before + 1} && gbtrace.look.photo && {STILL}")


def main():
    chromium = browser.find()
    if chromium is None:
        print("skipped: no Chromium")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="gbt_page_") as work:
        gbtrace("make-scene", "tabletop", "-o", work + "/scene", "--width", "96", "--height", "72", "--views", "9", "--samples", "1", "--points", "300")
        gbtrace("train", work + "/scene", "-o", work + "/run", "--iterations", "60")
        server = subprocess.Popen([program, "view", work + "/run", "--port", "0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        page = browser.Browser(chromium, 1200, 800)
        try:
            page.open(server.stdout.readline().strip())
            first_picture(page, work)
            moving(page, work)
            lenses_and_outputs(page)
            back_to_the_photo(page)
            picking(page)
            comparing(page)
            check("the run's log is drawn", page.run("document.querySelectorAll('#chart polyline, #training-now').length > 0"))
            server.send_signal(signal.SIGINT)
            check("Ctrl-C ends with 0", server.wait() == 0, str(server.returncode))
            page.wait("document.getElementById('message').textContent.includes('has ended')")
            check("no errors in the page", all("ERR_CONNECTION_REFUSED" in e for e in page.errors), str(page.errors))
        except browser.PageError as error:
            check("the page", False, str(error))
        finally:
            page.close()
            if server.poll() is None:
                server.kill()
            server.wait()
    print(f"{checks['passed']} passed, {checks['failed']} failed")
    return 1 if checks["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
