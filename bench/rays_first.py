#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# rays_first -- training by rays from the first step beside splats first, at equal time; and training on fisheyes, panoramas and rolling
# shutters beside pinholes.
#
#     python3 bench/rays_first.py PHOTOS -o DIR [--budget 42s] [--seeds 3] [--iterations N] [--gbtrace build/release/gbtrace]
#
# PHOTOS holds the data sets plush, fox, castle and aerial; the courtyard is made by `gbtrace make-scene`, also as a fisheye of 180 degrees, as
# a panorama and by moving cameras, with as many pixels. Each run goes into DIR/NAME and is not repeated when it is there. Two tables go to stdout: per scene the
# mean and the range over seeds of PSNR, SSIM and steps; per lens the same, and what a step cost. Let nothing else run meanwhile: 5 scenes, 2
# ways, 3 seeds at 42 s take 25 minutes, the lenses 15. With --iterations N the lenses' runs are of so many steps: scores at equal pixels.
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
    """The courtyard as photos; 76,800 pixels each, whatever the lens."""
    last = "transforms.json" if "rolling" in words else "sparse/0/points3D.bin"  # of what make-scene writes
    if not os.path.exists(os.path.join(args.output, name, last)):
        call("make-scene", "courtyard", "-o", name, "--views", "100", *words)
    return name


def load(run, file):
    with open(os.path.join(args.output, run, file)) as text:
        return json.load(text)


def train(data, name, seed, *words):
    """Scores of a run, and what is in its train.json."""
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
    for seed in seeds:  # in turns, so that both ways see the same drift of the machine
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
for seed in seeds:  # in turns, so that all lenses see the same drift of the machine
    for lens, data in lenses.items():
        runs[lens].append(train(data, f"{os.path.basename(data)}_rays", seed))
for lens in lenses:
    row(lens, "rays from the first step", runs[lens])
    print(" " + cell(runs[lens], lambda m, t: sum(t["stage_ms_per_step"][s] for s in ("build", "trace", "adjoint")), ".1f") + " |", flush=True)
