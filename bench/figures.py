#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# figures -- make the figures and screenshots of README.md, docs/results.md and docs/first-ten-minutes.md again, from new runs.
#
#     python3 bench/figures.py PHOTOS -o DIR [--gbtrace build/release/gbtrace]
#
# PHOTOS holds the data sets plush, fox, castle and aerial. The demo and, for each data set, runs of 42 and 84 seconds with three seeds go into
# DIR; a run that is already there is not repeated. Then docs/figures.txt is written, with one line per figure: a page, a colon, and the text
# that the page must contain, which the test `figures` checks. The screenshots in docs/images are made too, if bench/viewers has installed its
# browser packages. The pages themselves are edited by hand. Takes about 30 minutes on two cores.
import argparse
import csv
import json
import os
import socket
import subprocess
import time

parser = argparse.ArgumentParser()
parser.add_argument("photos")
parser.add_argument("-o", "--output", required=True)
parser.add_argument("--gbtrace", default="build/release/gbtrace")
args = parser.parse_args()
top = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
titles = {"plush": "plush, a toy on a bed", "fox": "fox, a mounted head", "castle": "castle, a courtyard"}


def make(run, *words):
    """Make a run, unless it is there. Its path is relative to DIR, so that its report shows no path of this machine."""
    path = os.path.join(args.output, run, "metrics.json")
    if not os.path.exists(path):
        subprocess.run([gbtrace, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=args.output)
    with open(path) as text:
        return json.load(text)


def blended_at_the_end(run):
    """Gaussians blended per ray, mean over the last tenth of training."""
    with open(os.path.join(args.output, run, "log.csv")) as rows:
        values = [float(row["blended_per_ray"]) for row in csv.DictReader(rows) if float(row["progress"]) > 0.9]
    return sum(values) / len(values)


def mean(runs, key):
    return sum(m[key] for m in runs) / len(runs)


def mean_and_range(runs, key):
    values = [m[key] for m in runs]
    return f"{mean(runs, key):.2f} ({max(values) - min(values):.2f})"


def row_of_results(budget, runs):
    """A row of docs/results.md, from its column of budgets on: means over the seeds, with ranges in brackets."""
    return (f"{budget} s | {mean_and_range(runs, 'psnr')} | {mean_and_range(runs, 'psnr_fitted')} | {mean(runs, 'ssim'):.4f} | "
            f"{mean(runs, 'iterations'):,.0f} | {mean(runs, 'anchors_initial'):,.0f}, {mean(runs, 'anchors_final'):,.0f} | "
            f"{mean(runs, 'blended'):.0f} | {mean(runs, 'model_bytes') / 1000:,.0f} kB |")


def shot(url, size, out, click=""):
    modules = os.path.join(top, "build/viewers-env")
    if os.path.exists(os.path.join(modules, "complete")):
        picture = os.path.join(top, "docs/images", out)
        subprocess.run(["node", os.path.join(top, "bench/screenshot.cjs"), modules, url, size, picture, *([click] if click else [])], check=True)


def shot_of_viewer(run, out):
    viewer = subprocess.Popen([gbtrace, "view", run, "--port", "8479", "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while viewer.poll() is None:  # until the viewer answers
            try:
                socket.create_connection(("127.0.0.1", 8479)).close()
                break
            except OSError:
                time.sleep(0.2)
        shot("http://127.0.0.1:8479/", "1100x760", out, "input[name=compare][value=slider]")
    finally:
        viewer.terminate()
        viewer.wait()


gbtrace = os.path.abspath(args.gbtrace)
os.makedirs(args.output, exist_ok=True)
lines = []
m = make("demo/run", "demo")
says = f"{m['psnr']:.1f} dB"
lines.append(f"README.md: 2 minutes of training on two cores, {says} on photos that were held out")
lines.append(f"docs/results.md: `gbtrace demo` (6,000 points, 320 x 240, 2 minutes, {m['iterations']:,} steps): {says}")
for name in ("plush", "fox", "castle", "aerial"):
    scores = {42: [], 84: []}
    for budget, seed in ((b, s) for s in (1, 2, 3) for b in scores):
        run, data = f"{name}_{budget}_{seed}", os.path.abspath(os.path.join(args.photos, name))
        m = make(run, "train", data, "-o", run, "--downscale", "1.33333", "--budget", f"{budget}s", "--seed", str(seed))
        scores[budget].append({**m, "blended": blended_at_the_end(run)})
    lines += ["docs/results.md: " + row_of_results(budget, runs) for budget, runs in scores.items()]
    if name in titles:
        lines.append(f"README.md: | {mean(scores[42], 'psnr'):.1f} | {mean(scores[84], 'psnr'):.1f} dB | {mean(scores[84], 'model_bytes') / 1000:.0f} kB |")
with open(os.path.join(top, "docs/figures.txt"), "w") as text:
    text.write("\n".join(lines) + "\n")
shot("file://" + os.path.abspath(os.path.join(args.output, "demo/run/report.html")), "1080x960", "report.png")
shot_of_viewer(os.path.join(args.output, "fox_84_1"), "view.png")
