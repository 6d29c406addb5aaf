#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# steps -- where the time of a training step goes: its stages on one thread and on all, an estimate for more cores, and a roofline that compares
# each stage with the arithmetic and memory limits of a core.
#
#     python3 bench/steps.py DATA ITERATIONS [--gbtrace build/release/gbtrace] [--before OTHER] [--threads 2] [-- TRAIN OPTIONS]
#
# Runs of a fixed number of steps, one after the other: on one thread, on --threads, and by the program --before on --threads. The machine must be
# otherwise idle. The limits come from bench/machine.c: cc -O3 -march=native bench/machine.c -o build/machine (without it, no roofline).
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

own, train_options = (sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1 :]) if "--" in sys.argv else (sys.argv[1:], [])
parser = argparse.ArgumentParser()
parser.add_argument("data")
parser.add_argument("iterations", type=int)
parser.add_argument("--gbtrace", default="build/release/gbtrace")
parser.add_argument("--before")
parser.add_argument("--threads", type=int, default=2)
parser.add_argument("--machine", default="build/machine")
args = parser.parse_args(own)

WALL, WORK, SPAN, WAITING = "stage_ms_per_step", "stage_work_ms_per_step", "stage_span_ms_per_step", "stage_waiting_ms_per_step"
NETWORK_INPUTS, HIDDEN, FEATURES, OFFSETS = 36, 32, 32, 2


def train(program, threads):
    with tempfile.TemporaryDirectory() as folder:
        run = os.path.join(folder, "run")
        command = [program, "train", args.data, "-o", run, "--iterations", str(args.iterations), "--threads", str(threads), "--eval-split", "none"]
        done = subprocess.run(command + train_options, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr.strip().splitlines()[-1])
        with open(os.path.join(run, "train.json")) as f:
            return json.load(f)


def stage_table(one, all_threads, before):
    heads = ["stage", "1 thread: wall", f"{args.threads} threads: wall", "1 / " + str(args.threads), "work", "span", "waiting"]
    if before:
        heads.insert(1, f"before, {args.threads} threads")
    print("|" + "|".join(f" {h} " for h in heads) + "|\n|" + "---|" * len(heads))
    for stage, wall in one[WALL].items():
        cells = [wall, all_threads[WALL][stage], wall / max(all_threads[WALL][stage], 1e-9), all_threads[WORK][stage], all_threads[SPAN][stage], all_threads[WAITING][stage]]
        if before:
            cells.insert(0, before[WALL].get(stage, 0))
        print(f"| {stage} |" + "|".join(f" {c:.2f} " for c in cells) + "|")


# Bounds on the time of a step on p cores, from its work and its span: at least max(work / p, span), at most (work - span) / p + span for any
# greedy scheduler.
def core_table(runs):
    print("\n| threads | measured, ms | " + " | ".join(f"from {r['threads']}: least, most" for r in runs) + " |\n|---|---|" + "---|" * len(runs))
    measured = {r["threads"]: r[WALL]["all"] for r in runs}
    for cores in (1, 2, 4, 16, 64):
        cells = []
        for r in runs:
            work, span = r[WORK]["all"], r[SPAN]["all"]
            cells.append(f"{max(work / cores, span):.2f}, {(work - span) / cores + span:.2f}")
        print(f"| {cores} | " + (f"{measured[cores]:.2f}" if cores in measured else "") + " | " + " | ".join(cells) + " |")


# (bytes, floating-point operations) of each stage of a step, from means over the run; K = 2 Gaussians per anchor.
def counts_of(r):
    pixels, visible, gaussians, anchors = r["rays_per_step"], r["visible_per_view"], r["gaussians_per_view"], r["anchors_final"]
    rows = min(visible, gaussians / 1.6)  # visible anchors with Gaussians, which have 1.5 to 1.8 each in fox, castle and plush
    learned = FEATURES + 3 * OFFSETS + 6
    decode = 2 * (visible * (NETWORK_INPUTS * HIDDEN + HIDDEN * OFFSETS) + rows * (2 * NETWORK_INPUTS * HIDDEN + HIDDEN * 10 * OFFSETS))
    adjoint = 2 * rows * (3 * HIDDEN * (NETWORK_INPUTS + 1) + 3 * HIDDEN * FEATURES + 2 * HIDDEN * 11 * OFFSETS)
    again = 2 * rows * 3 * HIDDEN * NETWORK_INPUTS  # hidden layers, computed again because they are not kept
    inputs = 4 * (3 + FEATURES)
    hits = pixels * r["blended_per_ray"]
    return {
        "photo": (15 * pixels, 3 * pixels),
        "rays": (12 * pixels, 20 * pixels),
        "visible": (12 * pixels + 12 * anchors, 30 * pixels + 30 * anchors),
        "decode": ((visible + rows) * inputs + rows * 4 * (6 + 3 * OFFSETS) + 2 * 56 * gaussians, decode),
        "trace": (56 * gaussians + 12 * pixels, 70 * hits),
        "loss": (36 * pixels, 3 * 284 * pixels),
        "adjoint": (2 * 56 * gaussians + 24 * pixels, 150 * hits),
        "decode_adjoint": (rows * (inputs + 4 * 2 * learned) + 2 * 56 * gaussians, adjoint + again),
        "optimizer": (4 * 8 * (visible * FEATURES + anchors * (learned - FEATURES)), 14 * (visible * FEATURES + anchors * (learned - FEATURES))),
    }


def roofline(one):
    if not os.access(args.machine, os.X_OK):
        return
    text = subprocess.run([args.machine], capture_output=True, text=True).stdout
    peak = 2 * 16 * float(re.search(r"([0-9.]+) e9", text).group(1))
    rates = [float(n) for n in re.findall(r"([0-9.]+) GB/s", text)]
    memory = rates[-1]
    print(f"\nOne core: {peak:.0f} GFLOP/s in single precision, {memory:.0f} GB/s from memory.\n")
    print("| stage | MB | Mflop | ms | GB/s | GFLOP/s | ms at the limit | of the time |\n" + "|---" * 8 + "|")
    for stage, (moved, flops) in counts_of(one).items():
        ms = one[WALL][stage]
        double = 2 if stage == "loss" else 1  # computed in double precision, at half the rate
        least = 1e3 * max(moved / (1e9 * memory), double * flops / (1e9 * peak))
        print(f"| {stage} | {moved / 1e6:.2f} | {flops / 1e6:.1f} | {ms:.2f} | {moved / 1e6 / max(ms, 1e-9):.1f} | {flops / 1e6 / max(ms, 1e-9):.1f} | {least:.2f} | {100 * least / max(ms, 1e-9):.0f} % |")


one, all_threads = train(args.gbtrace, 1), train(args.gbtrace, args.threads)
before = train(args.before, args.threads) if args.before else None
print(f"{args.data}, {args.iterations} steps, {one['anchors_final']} anchors at the end, {one['visible_per_view']:.0f} of them and "
      f"{one['gaussians_per_view']:.0f} Gaussians in a view, {one['rays_per_step']:.0f} rays a step; milliseconds a step\n")
stage_table(one, all_threads, before)
core_table([one, all_threads])
roofline(one)
