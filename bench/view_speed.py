#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""bench/view_speed.py -- pictures per second of `gbtrace view` in headless Chromium while the scene is turned, and where the time goes.

Milliseconds are wall time; the last column is CPU time of the server per picture.

Usage: view_speed.py PROGRAM RUN [--size 480x640] [--window 1280x900] [--seconds 10] [--screenshots FOLDER]
"""
import argparse
import os
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "tests", "view"))
import browser  # noqa: E402

STILL = "gbtrace.look.done && gbtrace.look.done.generation === gbtrace.pictures.generation && gbtrace.look.done.still"
PARTS = ("prepare", "trace", "encode", "transfer", "draw")


def choose(page, name, value):
    page.run(f"""(e => {{ if (![...e.options].some(o => o.value === '{value}')) e.append(new Option('{value}'));
        e.value = '{value}'; e.dispatchEvent(new Event('change')); }})(document.getElementById('{name}'))""")


def turn(page, seconds):
    """Drag to and fro; returns the pictures received meanwhile."""
    page.run("window.seen = []")
    x, y = page.run("(() => { const b = document.getElementById('render').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()")
    page.mouse("mousePressed", x, y, button="left", clickCount=1)
    begin = now = time.monotonic()
    while now - begin < seconds:
        way = (now - begin) * 60 % 240
        page.mouse("mouseMoved", x + (way if way < 120 else 240 - way) - 60, y + way / 12, button="left")
        time.sleep(0.015)
        now = time.monotonic()
    page.mouse("mouseReleased", x, y, button="left", clickCount=1)
    seen = page.run("window.seen.filter(a => a.draw_ms !== undefined)")
    page.wait(STILL)
    return seen, now - begin


def core_ms(process):
    """CPU time of all threads of a process so far: less noisy than wall time on a shared machine."""
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
        words = file.read().rpartition(")")[2].split()
    return 1000 * (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("run")
    parser.add_argument("--size", default="480x640")
    parser.add_argument("--window", default="1280x900")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--screenshots")
    wanted = parser.parse_args()
    width, height = map(int, wanted.window.split("x"))
    server = subprocess.Popen([wanted.program, "view", wanted.run, "--port", "0"], stdout=subprocess.PIPE, text=True)
    page = browser.Browser(browser.find(), width, height)
    try:
        page.open(server.stdout.readline().strip())
        page.wait(STILL)
        page.run("""(learn => gbtrace.pictures.learn = about => { window.seen.push(about); learn.call(gbtrace.pictures, about); })(gbtrace.pictures.learn)""")
        page.run("window.seen = []")
        choose(page, "samples", "1")
        print("| pixels as | while moving | pictures/s | mean size | " + " | ".join(f"{p} ms" for p in PARTS) + " | core ms of the server |")
        print("|---" * (len(PARTS) + 5) + "|")
        for transfer, moving, size in (("raw", "full", wanted.size), ("jpeg", "full", wanted.size), ("png", "full", wanted.size), ("raw", "auto", "window")):
            choose(page, "size", size)
            choose(page, "transfer", transfer)
            choose(page, "moving", moving)
            turn(page, 1)
            before = core_ms(server)
            seen, seconds = turn(page, wanted.seconds)
            used = (core_ms(server) - before) / len(seen)
            mean = {name: sum(a[name] for a in seen) / len(seen) for name in [p + "_ms" for p in PARTS] + ["width", "height"]}
            size = f"{mean['width']:.0f} x {mean['height']:.0f}"
            parts = " | ".join(f"{mean[p + '_ms']:.1f}" for p in PARTS)
            print(f"| {transfer} | {moving} | {len(seen) / seconds:.1f} | {size} | {parts} | {used:.0f} |", flush=True)
            if wanted.screenshots:
                page.screenshot(os.path.join(wanted.screenshots, f"{transfer}_{moving}.png"))
    finally:
        page.close()
        server.send_signal(signal.SIGINT)
        server.wait()


if __name__ == "__main__":
    main()
