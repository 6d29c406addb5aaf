#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# kernel_tables -- print the tables of docs/performance.md from the .json files of bench/kernel_figures.
#
#     python3 bench/kernel_tables.py OUT
#
# Rows whose file is missing are left out.
import json
import os
import sys

MODELS = ("fox", "castle", "plush", "aerial", "courtyard", "vol10k", "vol100k", "surf200k")
LENSES = ("pinhole", "fisheye", "panorama")
VECTOR_OPERATIONS = 6.8e9  # of 16 floats, per second on one core: bench/machine.c on the machine of docs/performance.md


def load(name):
    path = os.path.join(sys.argv[1], name + ".json")
    if not os.path.exists(path):
        return None
    with open(path) as file:
        return json.load(file)["kernels"]


def table(title, heads, rows):
    print(f"\n{title}\n\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for row in rows:
        print(f"| {' | '.join(row)} |")


def forward(kernel):
    return kernel["build_core_us_per_ray"] + kernel["forward_core_us_per_ray"]


def passes(kernel):
    return f"{forward(kernel):.3f}, {kernel['adjoint_core_us_per_ray']:.3f}, {kernel['core_us_per_ray']:.3f}"


def build_and_passes(kernel):
    return f"{kernel['build_core_us_per_ray']:.3f}, {kernel['forward_core_us_per_ray']:.3f}, {kernel['adjoint_core_us_per_ray']:.3f}, {kernel['core_us_per_ray']:.3f}"


def ratio(kernel, other):
    return f"{kernel['core_us_per_ray'] / other['core_us_per_ray']:.2f}"


def rows_of(prefix, names, row):
    for name in names:
        kernels = load(f"{prefix}_{name}")
        if kernels:
            yield [name, *row(*kernels)]


def errors(*kernels):
    return ", ".join(f"{kernel['psnr_to_reference']:.0f}" for kernel in kernels)


def limits(kernel):
    """Vector operations for a packet of sixteen rays, forward and adjoint, counted by hand from the source; and the time that these alone would take."""
    evaluated, rows, steps = kernel["tests_per_ray"], kernel["rows_per_packet"], kernel["row_pairs_per_packet"]
    operations = 40 * evaluated + 34 * rows + rows * rows / 8 + 10 * steps + 140 * rows
    alone, measured = 1e6 * operations / VECTOR_OPERATIONS / 16, kernel["core_us_per_ray"]
    return (f"{evaluated:.0f}", f"{rows:.0f}, {steps:.0f}", f"{round(operations, -2):,.0f}", f"{alone:.3f}", f"{measured:.3f}", f"{100 * alone / measured:.0f} %")


table("Each ray in its own order, the default's cut-offs",
      ("scene", "blended per ray", "list: forward, adjoint, all", "tree: build, forward, adjoint, all", "splats, all", "tree / list", "list / splats", "dB: list, tree, splats"),
      rows_of("kernels", MODELS, lambda l, t, s: (f"{l['blended_per_ray']:.0f}", passes(l), build_and_passes(t), f"{s['core_us_per_ray']:.3f}", ratio(t, l), ratio(l, s), errors(l, t, s))))
table("As in the first 92.5 % of training",
      ("scene", "blended per ray", "list, all", "packet: forward, adjoint, all", "splats, all", "list / splats", "packet / splats", "dB: list, packet, splats"),
      rows_of("training", MODELS, lambda l, p, s: (f"{l['blended_per_ray']:.0f}", f"{l['core_us_per_ray']:.3f}", passes(p), f"{s['core_us_per_ray']:.3f}", ratio(l, s), ratio(p, s), errors(l, p, s))))
table("Lenses in vol100k", ("lens", "blended per ray", "list: forward, adjoint, all", "tree: build, forward, adjoint, all", "tree / list", "dB: list, tree"),
      rows_of("lens", LENSES, lambda l, t: (f"{l['blended_per_ray']:.0f}", passes(l), build_and_passes(t), ratio(t, l), errors(l, t))))
table("Embree's own traversal", ("scene", "list: forward, all", "embree: forward, all", "ratio, forward", "ratio, all"),
      rows_of("embree", MODELS, lambda l, e: (f"{forward(l):.3f}, {l['core_us_per_ray']:.3f}", f"{forward(e):.3f}, {e['core_us_per_ray']:.3f}",
                                              f"{forward(e) / forward(l):.1f}", ratio(e, l))))
table("Rays one by one", ("scene", "tree: forward", "single: forward", "single / tree"),
      rows_of("single", MODELS, lambda t, s: (f"{t['forward_core_us_per_ray']:.3f}", f"{s['forward_core_us_per_ray']:.3f}",
                                              f"{s['forward_core_us_per_ray'] / t['forward_core_us_per_ray']:.1f}")))
table("Instruction sets, fox", ("set", "list: forward, adjoint, all"),
      ([name, passes(kernels[0])] for name in ("avx512", "avx2", "plain") if (kernels := load(f"isa_{name}"))))
table("Limits, list", ("scene", "rows evaluated per packet of 16 rays", "rows with a hit, steps back", "vector operations per packet", "arithmetic alone, core-us/ray", "measured",
                       "arithmetic / measured"),
      rows_of("kernels", MODELS, lambda l, t, s: limits(l)))
