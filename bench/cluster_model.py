#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Predict the time of a training step on N machines, from one run on one machine.

Usage: bench/cluster_model.py RUN [VIEW_MS REST_MS]

RUN was trained with one view per step and one process. Each of N machines would render one view of a step:

    step(N) = view + rest + bytes(N) / bandwidth + messages(N) * latency

`view` is the time for one view, of which each process has its own (photo, rays, decode, tree, trace, loss, adjoints), `rest` the time for
work that every process repeats (Adam, growth); both come from train.json unless they are given. Processes exchange rows: the index of an
anchor and its values (gradient, statistics). A view sees the share p of all A anchors, so a process sends (N - 1) / N of its pA rows, and
receives as many at the same time. Then it receives the same share of the sums: A (1 - (1 - p)^N) rows if views were independent, which is an
upper bound because views overlap. The switch is assumed not to be a limit. A message takes 50 us, and each of six calls needs log2 N messages.
"""
import csv
import json
import math
import sys

LATENCY = 50e-6
CALLS = 6


def read(run):
    train = json.load(open(f"{run}/train.json"))
    stages = train["stage_ms_per_step"]
    rest = (stages["optimizer"] + stages["adjust"]) / 1e3
    view = stages["all"] / 1e3 - rest
    rows = list(csv.DictReader(open(f"{run}/log.csv")))
    anchors = [float(r["anchors"]) for r in rows if r["visible_anchors"]]
    seen = [float(r["visible_anchors"]) for r in rows if r["visible_anchors"]]
    return view, rest, sum(anchors) / len(anchors), sum(seen) / len(seen)


def offsets_of(run):
    for line in open(f"{run}/config"):
        if line.startswith("offsets ="):
            return int(line.split("=")[1])


def main():
    run = sys.argv[1]
    view, rest, anchors, seen = read(run)
    if len(sys.argv) > 3:
        view, rest = float(sys.argv[2]) / 1e3, float(sys.argv[3]) / 1e3
    k = offsets_of(run)
    row = 4 * (1 + 32 + 3 * k + 6 + 3 + 2 * k)
    networks = 4 * 4200
    print(f"{1e3 * view:.1f} ms a view, {1e3 * rest:.1f} ms for all; {anchors:.0f} anchors, {seen:.0f} in a view, {row} bytes a row\n")
    print("| machines | MB a step | ms, 1 Gbit/s | ms, 10 Gbit/s | times one machine, 1 Gbit/s | 10 Gbit/s |\n|---|---|---|---|---|---|")
    for n in (2, 4, 8, 16, 32, 64):
        union = anchors * (1 - (1 - seen / anchors) ** n)
        size = (n - 1) / n * ((seen + union) * row + 2 * networks)
        sent = [size * 8 / (gbit * 1e9) + CALLS * math.log2(n) * LATENCY for gbit in (1, 10)]
        times = [n * (view + rest) / (view + rest + s) for s in sent]
        print(f"| {n} | {size / 1e6:.1f} | {1e3 * sent[0]:.0f} | {1e3 * sent[1]:.0f} | {times[0]:.1f} | {times[1]:.1f} |")


if __name__ == "__main__":
    main()
