# SPDX-License-Identifier: Apache-2.0
"""tests/view/browser.py -- headless Chromium by its debugging pipe (no package beside Chromium and Python): pages, scripts, mice, pictures."""
import base64
import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time


def find():
    """The program, or None."""
    for name in (os.environ.get("GBT_CHROMIUM"), "chromium", "chromium-browser", "google-chrome"):
        if name and shutil.which(name):
            return shutil.which(name)
    return None


class PageError(Exception):
    pass


class Browser:
    """One tab. `phone`: touched, not clicked. Errors of the page (exceptions, refused resources, console.error) are kept in `errors`."""

    def __init__(self, program, width, height, dark=False, scale=1, phone=False):
        self.profile = tempfile.mkdtemp(prefix="gbt_browser_")
        low_read, self.to = os.pipe()
        self.come, low_write = os.pipe()
        to_read, to_write = [fcntl.fcntl(fd, fcntl.F_DUPFD, 10) for fd in (low_read, low_write)]
        arguments = [program, "--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio",
                     "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic", "--hide-scrollbars", f"--window-size={width},{height}",
                     "--user-data-dir=" + self.profile, "about:blank"]
        # Chromium reads from descriptor 3 and writes to 4, whatever numbers the pipes have here.
        line = f'exec "$@" 3<&{to_read} 4>&{to_write} {to_read}<&- {to_write}>&-'
        self.process = subprocess.Popen(["bash", "-c", line, "browser"] + arguments, pass_fds=(to_read, to_write), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for fd in (low_read, low_write, to_read, to_write):
            os.close(fd)
        self.rest, self.number, self.session, self.errors = b"", 0, None, []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(domain + ".enable")
        self.resize(width, height, scale, phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=phone, maxTouchPoints=5 if phone else 1)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def resize(self, width, height, scale=1, phone=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone)

    def receive(self):
        while b"\0" not in self.rest:
            bytes_come = os.read(self.come, 1 << 20)
            if not bytes_come:
                raise PageError("the browser has ended")
            self.rest += bytes_come
        text, self.rest = self.rest.split(b"\0", 1)
        message = json.loads(text)
        if message.get("method") == "Runtime.exceptionThrown":
            details = message["params"]["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
            self.errors.append(message["params"]["entry"]["text"] + " " + message["params"]["entry"].get("url", ""))
        return message

    def call(self, method, **parameters):
        self.number += 1
        request = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            request["sessionId"] = self.session
        os.write(self.to, json.dumps(request).encode() + b"\0")
        while True:
            message = self.receive()
            if message.get("id") == self.number:
                if "error" in message:
                    raise PageError(f"{method}: {message['error']['message']}")
                return message["result"]

    def open(self, address):
        self.call("Page.navigate", url=address)

    def run(self, script):
        """The value of an expression; promises are awaited."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True)
        if "exceptionDetails" in result:
            raise PageError(result["exceptionDetails"].get("exception", {}).get("description", script))
        return result["result"].get("value")

    def wait(self, script, seconds=60):
        """Until an expression is true; it may throw before that."""
        end, why = time.monotonic() + seconds, "it stayed false"
        while time.monotonic() < end:
            try:
                if self.run(script):
                    return
            except PageError as error:
                why = str(error)
            time.sleep(0.05)
        raise PageError(f"waited {seconds} s for: {script}: {why}; page errors: {self.errors}")

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, start, way, steps=10, pause=0.0, button="left", modifiers=0):
        x, y = start
        self.mouse("mousePressed", x, y, button=button, clickCount=1, modifiers=modifiers)
        for i in range(1, steps + 1):
            self.mouse("mouseMoved", x + way[0] * i / steps, y + way[1] * i / steps, button=button, modifiers=modifiers)
            time.sleep(pause)
        self.mouse("mouseReleased", x + way[0], y + way[1], button=button, clickCount=1, modifiers=modifiers)

    def double_click(self, x, y):
        for count in (1, 2):
            for kind in ("mousePressed", "mouseReleased"):
                self.mouse(kind, x, y, button="left", clickCount=count)

    def click(self, x, y):
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1)

    def fingers(self, starts, ends, steps=8):
        """All of them at once, along straight lines."""
        def points(share):
            return [{"x": a[0] + (b[0] - a[0]) * share, "y": a[1] + (b[1] - a[1]) * share, "id": i} for i, (a, b) in enumerate(zip(starts, ends))]
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=points(0))
        for i in range(1, steps + 1):
            self.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=points(i / steps))
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def key(self, kind, code, key):
        self.call("Input.dispatchKeyEvent", type=kind, code=code, key=key)

    def press(self, code, key):
        self.key("keyDown", code, key)
        self.key("keyUp", code, key)

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        try:
            os.write(self.to, json.dumps({"id": 0, "method": "Browser.close"}).encode() + b"\0")
            self.process.wait(20)
        except (OSError, subprocess.TimeoutExpired):
            self.process.kill()
        self.process.wait()
        os.close(self.to)
        os.close(self.come)
        shutil.rmtree(self.profile, ignore_errors=True)
