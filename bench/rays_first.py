#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# rays_first -- compare training by rays from the first step with training that starts by splats, at equal time; and training on fisheyes,
# panoramas and rolling shutters with training on pinholes.
#
#     python3 bench/rays_first.py PHOTOS -o DIR [--budget 42s] [--seeds 3] [--iterations N] [--gbtrace build/release/gbtrace]
#
# PHOTOS holds the data sets plush, fox, castle and aerial. `gbtrace make-scene` makes the courtyard, also as 180-degree fisheyes, as panoramas
# and with moving cameras, all with the same number of pixels. Each run goes into DIR/NAME; a run that is already there is not repeated. Two
# tables go to stdout: for each scene the mean and range over seeds of PSNR, SSIM and steps; for each lens the same, and the time of a step. The
# machine must be otherwise idle: 5 scenes, 2 ways and 3 seeds at 42 s take 25 minutes, the lenses 15. With --iterations N the runs of the
# lenses have N steps instead of a time, so that their scores are at an equal number of pixels.
import argparse
import json
import os
import subprocess
import sys

parser = argparse.ArgumentParser()
parser.add_argument("photos")
parser.add_argument("-o", "--output", required=True)
parser.add_argument("--budget", default="42s")
parser.add_argument("--seeds", type=int, default=3)
parser.add_argument("--iterations", type=int, help="lenses only, in place of the budget")
parser.add_argument("--gbtrace", default="build/release/gbtrace")
args = parser.parse_args()
gbtrace = os.path.abspath(args.gbtrace)
os.makedirs(args.output, exist_ok=True)


def call(*words):
    subprocess.run([gbtrace, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=args.output)


def make_scene(name, *words):
    """Make the courtyard as photos, unless it is there; 76,800 pixels per photo with every lens."""
    last = "transforms.json" if "rolling" in words else "sparse/0/points3D.bin"  # the file that make-scene writes last
    if not os.path.exists(os.path.join(args.output, name, last)):
        call("make-scene", "courtyard", "-o", name, "--views", "100", *words)
    return name


def load(run, file):
    with open(os.path.join(args.output, run, file)) as text:
        return json.load(text)


def train(data, name, seed, *words):
    """Make a run, unless it is there. Returns its metrics.json and its train.json."""
    length = ("--iterations", str(args.iterations)) if args.iterations else ("--budget", args.budget)
    run = f"{name}_{length[1]}_{seed}"
    if not os.path.exists(os.path.join(args.output, run, "metrics.json")):
        print(run, file=sys.stderr)
        call("train", data, "-o", run, *length, "--seed", str(seed), "--overwrite", *words)
    return load(run, "metrics.json"), load(run, "train.json")


def cell(runs, value, form):
    values = [value(m, t) for m, t in runs]
    return f"{sum(values) / len(values):{form}} ({min(values):{form}} to {max(values):{form}})"


def row(name, way, runs):
    print(f"| {name} | {way} | {cell(runs, lambda m, t: m['psnr'], '.2f')} | {cell(runs, lambda m, t: m['ssim'], '.4f')} | "
          f"{cell(runs, lambda m, t: t['iterations'], ',.0f')} |", end="")


seeds = range(1, args.seeds + 1)
pinhole = make_scene("courtyard", "--width", "320", "--height", "240")
scenes = {name: os.path.abspath(os.path.join(args.photos, name)) for name in ("plush", "fox", "castle", "aerial")}
scenes["courtyard"] = pinhole
if not args.iterations:
    print("| scene | training | PSNR | SSIM | steps |\n|---|---|---|---|---|")
for scene, data in () if args.iterations else scenes.items():
    large = ("--downscale", "1.33333") if scene != "courtyard" else ()
    ways = {"rays from the first step": (), "splats first": ("--splats-until", "0.7")}
    runs = {way: [] for way in ways}
    for seed in seeds:  # taking turns, so that slow changes of the machine's speed affect both ways alike
        for way, words in ways.items():
            runs[way].append(train(data, f"{scene}_{way.split()[0]}", seed, *large, *words))
    for way in ways:
        row(scene, way, runs[way])
        print(flush=True)

lenses = {"pinhole": pinhole,
          "fisheye of 180 degrees": make_scene("courtyard_fisheye", "--lens", "fisheye", "--width", "277", "--height", "277"),
          "panorama": make_scene("courtyard_panorama", "--lens", "panorama", "--width", "392", "--height", "196"),
          "rolling shutter": make_scene("courtyard_rolling", "--lens", "rolling", "--width", "320", "--height", "240")}
print("\n| lens | training | PSNR | SSIM | steps | build, trace and adjoint, ms a step |\n|---|---|---|---|---|---|")
runs = {lens: [] for lens in lenses}
for seed in seeds:  # taking turns, so that slow changes of the machine's speed affect all lenses alike
    for lens, data in lenses.items():
        runs[lens].append(train(data, f"{os.path.basename(data)}_rays", seed))
for lens in lenses:
    row(lens, "rays from the first step", runs[lens])
    print(" " + cell(runs[lens], lambda m, t: sum(t["stage_ms_per_step"][s] for s in ("build", "trace", "adjoint")), ".1f") + " |", flush=True)
