#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# renderers -- train the same scenes by ray tracing and by splatting: held-out PSNR and time, at equal iterations and at equal time.
#
#     python3 bench/renderers.py DATA... -o DIR [--gbtrace build/release/gbtrace] [--iterations 1500] [--seeds 0,1,2] [--downscale 1]
#
# Four runs per scene and seed: traced for N iterations; splatted for N iterations; splatted for the time that the traced run took; and, for
# the same time, splatted for the first 70 % and then traced. A run that is already in DIR is not repeated. Each model is scored with the
# renderer that trained it, and with the other one.
import argparse
import json
import os
import statistics
import subprocess

parser = argparse.ArgumentParser()
parser.add_argument("data", nargs="+")
parser.add_argument("-o", "--output", required=True)
parser.add_argument("--gbtrace", default="build/release/gbtrace")
parser.add_argument("--iterations", type=int, default=1500)
parser.add_argument("--seeds", default="0,1,2")
parser.add_argument("--downscale", type=float, default=1)
args = parser.parse_args()


def call(*words):
    subprocess.run([args.gbtrace, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def read(path):
    with open(path) as text:
        return json.load(text)


def train(data, run, seed, *settings):
    if not os.path.exists(os.path.join(run, "metrics.json")):
        call("train", data, "-o", run, "--seed", str(seed), "--downscale", str(args.downscale), *settings)
    if not os.path.exists(os.path.join(run, "crossed.json")):
        other = "trace" if "raster" in settings else "raster"
        call("eval", run, "--renderer", other, "--json", os.path.join(run, "crossed.json"))
    figures = read(os.path.join(run, "metrics.json"))
    figures["crossed"] = read(os.path.join(run, "crossed.json"))["psnr"]
    return figures


def show(values, digits):
    mean = statistics.mean(values)
    spread = statistics.stdev(values) if len(values) > 1 else 0
    return f"{mean:.{digits}f} ± {spread:.{digits}f}"


seeds = [int(s) for s in args.seeds.split(",")]
print("| scene | trained by | iterations | training, s | PSNR, dB | SSIM | drawn by the other, dB | anchors |")
print("|---|---|---|---|---|---|---|---|")
for data in args.data:
    scene = os.path.basename(os.path.normpath(data))
    rows = {"rays": [], "splats, equal iterations": [], "splats, equal time": [], "splats, then rays, equal time": []}
    for seed in seeds:
        place = os.path.join(args.output, f"{scene}-{seed}")
        os.makedirs(place, exist_ok=True)
        length = ("--iterations", str(args.iterations))
        traced = train(data, os.path.join(place, "traced"), seed, *length)
        budget = ("--budget", f"{traced['train_seconds']:.0f}s")
        rows["rays"].append(traced)
        rows["splats, equal iterations"].append(train(data, os.path.join(place, "splatted"), seed, "--renderer", "raster", *length))
        rows["splats, equal time"].append(train(data, os.path.join(place, "splatted-time"), seed, "--renderer", "raster", *budget))
        rows["splats, then rays, equal time"].append(train(data, os.path.join(place, "splats-first"), seed, "--splats-until", "0.7", *budget))
    for name, runs in rows.items():
        print(f"| {scene} | {name} | {show([r['iterations'] for r in runs], 0)} | {show([r['train_seconds'] for r in runs], 0)} "
              f"| {show([r['psnr'] for r in runs], 2)} | {show([r['ssim'] for r in runs], 4)} | {show([r['crossed'] for r in runs], 2)} "
              f"| {show([r['anchors_final'] for r in runs], 0)} |", flush=True)
