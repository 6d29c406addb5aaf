#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""bench/view_soak.py -- check that the memory of `gbtrace view` does not grow while a scene is orbited for a long time.

Requests pictures in all formats, of cameras on an orbit and of photos, and picks; some clients disconnect before their picture is ready. Prints
resident memory every 30 s. Exit code 1 if the mean of the last quarter is more than 5 % above that of the second quarter.

Usage: view_soak.py PROGRAM RUN [--minutes 10]
"""
import argparse
import json
import math
import signal
import socket
import subprocess
import sys
import time
import urllib.parse
import urllib.request


def resident_mb(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("run")
    parser.add_argument("--minutes", type=float, default=10)
    wanted = parser.parse_args()
    server = subprocess.Popen([wanted.program, "view", wanted.run, "--port", "0"], stdout=subprocess.PIPE, text=True)
    url = server.stdout.readline().strip()
    host, port = urllib.parse.urlparse(url).hostname, urllib.parse.urlparse(url).port
    begin, pictures, memory = time.monotonic(), 0, []
    try:
        while time.monotonic() - begin < 60 * wanted.minutes:
            angle = 0.03 * pictures
            camera = json.dumps({"origin": [3 * math.cos(angle), 3 * math.sin(angle), 1], "target": [0, 0, 0], "up": [0, 0, 1], "fov_x_deg": 50,
                                 "width": 160 + pictures % 7 * 40, "height": 120 + pictures % 5 * 40})
            shape = "camera=" + urllib.parse.quote(camera) if pictures % 3 else f"view={pictures % 2}"
            query = f"{shape}&format={('raw', 'jpeg', 'png')[pictures // 3 % 3]}&sample={pictures % 4}"
            if pictures % 10 == 9:
                with socket.create_connection((host, port)) as left:
                    left.sendall(f"GET /render?{query} HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode())
            else:
                urllib.request.urlopen(f"{url.rstrip('/')}/render?{query}").read()
            if pictures % 25 == 0:
                urllib.request.urlopen(f"{url.rstrip('/')}/pick?{shape}&x=10&y=10").read()
                urllib.request.urlopen(f"{url.rstrip('/')}/status").read()
            pictures += 1
            if time.monotonic() - begin >= 30 * len(memory):
                memory.append(resident_mb(server))
                print(f"{time.monotonic() - begin:.0f} s, {pictures} pictures, {memory[-1]:.1f} MB", flush=True)
    finally:
        server.send_signal(signal.SIGINT)
        code = server.wait()
    quarter = max(len(memory) // 4, 1)
    early, late = sum(memory[quarter:2 * quarter]) / quarter, sum(memory[-quarter:]) / quarter
    print(f"{pictures} pictures; second quarter {early:.1f} MB, last {late:.1f} MB; exit code {code}")
    return late > 1.05 * early or code != 0


if __name__ == "__main__":
    sys.exit(main())
