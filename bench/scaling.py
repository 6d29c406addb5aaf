#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# scaling -- 10 thousand to 1 million Gaussians with the same number of hits per ray: core time per ray, build time, bytes.
#
#     python3 bench/scaling.py [--gbtrace build/release/gbtrace] [--sizes 1600,512] [--counts 10000,100000,1000000]      (needs numpy)
#
# The Gaussians fill a cube evenly. Their size is proportional to the inverse square root of their number, so that a ray always crosses about
# 30. In a picture of 1600 x 1600 pixels, the size of a photo, a million Gaussians are a few pixels wide each; at 512 x 512 there are four
# Gaussians per ray.
import argparse
import json
import os
import subprocess
import tempfile

import numpy as np

parser = argparse.ArgumentParser()
parser.add_argument("--gbtrace", default="build/release/gbtrace")
parser.add_argument("--sizes", default="1600,512", help="pixels across and down")
parser.add_argument("--counts", default="10000,100000,1000000")
parser.add_argument("--repeats", type=int, default=5)
args = parser.parse_args()

FIELDS = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]


def write_cloud(path, count):
    random = np.random.default_rng(count)
    half = 10.0
    size = 0.8 * np.sqrt(45 * (2 * half) ** 2 / (count * np.pi * 9))
    rows = np.empty((count, len(FIELDS)), "<f4")
    rows[:, 0:3] = random.uniform(-half, half, (count, 3))
    rows[:, 3:6] = random.normal(0, 1, (count, 3))
    rows[:, 6] = random.normal(-0.7, 1, count)  # logit
    rows[:, 7:10] = np.log(size) + 0.45 * random.normal(size=(count, 1)) + 0.45 * random.normal(size=(count, 3))
    turn = random.normal(size=(count, 4))
    rows[:, 10:14] = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n" + "".join(f"property float {name}\n" for name in FIELDS) + "end_header\n"
    with open(path, "wb") as out:
        out.write(header.encode())
        out.write(rows.tobytes())


def bench(model, size, folder):
    camera, result = os.path.join(folder, "camera.json"), os.path.join(folder, "result.json")
    with open(camera, "w") as out:
        json.dump({"origin": [0, -38, 9], "target": [0, 0, 0], "up": [0, 0, 1], "fov_x_deg": 38.0, "width": size, "height": size}, out)
    subprocess.run([args.gbtrace, "bench", "trace", "--model", model, "--camera", camera, "--repeats", str(args.repeats), "--json", result],
                   check=True, stdout=subprocess.DEVNULL)
    with open(result) as text:
        return json.load(text)


print("| picture | Gaussians | hits | blended | forward, core-us/ray | to the first | adjoint, core-us/ray | build, ms | bytes per Gaussian |")
print("|---|---|---|---|---|---|---|---|---|")
with tempfile.TemporaryDirectory() as folder:
    counts = [int(c) for c in args.counts.split(",")]
    for count in counts:
        write_cloud(os.path.join(folder, f"{count}.ply"), count)
    for size in [int(s) for s in args.sizes.split(",")]:
        first = None
        for count in counts:
            r = bench(os.path.join(folder, f"{count}.ply"), size, folder)
            forward = r["forward_core_us_per_ray"]
            first = first or forward
            print(f"| {size} x {size} | {count:,} | {r['hits_per_ray']:.1f} | {r['blended_per_ray']:.1f} | {forward:.3f} | {forward / first:.2f} "
                  f"| {r['adjoint_core_us_per_ray']:.3f} | {r['build_ms']:.0f} | {(r['tree_bytes'] + r['list_bytes'] + r['record_bytes']) / count:.0f} |")
