#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# refined_poses -- how well --refine-poses corrects wrong poses: held-out PSNR with the poses of the data set, and with perturbed ones.
#
#     python3 bench/refined_poses.py DATA... -o DIR [--gbtrace build/release/gbtrace] [--iterations 1200] [--seeds 0,1] [--degrees 0.5] [--part 0.01]
#                                    [more options of train]
#
# DATA is a COLMAP data set (images.bin). Every camera, held out or not, is rotated by --degrees about a random axis, and moved in a random
# direction by the share --part of the extent of all cameras; points stay. Four runs per scene and seed: with given and with perturbed poses,
# each fixed and refined. Refined runs score a held-out photo from the pose at which the model fits it best. A run that is already in DIR is
# not repeated.
import argparse
import json
import math
import os
import random
import statistics
import struct
import subprocess

parser = argparse.ArgumentParser()
parser.add_argument("data", nargs="+")
parser.add_argument("-o", "--output", required=True)
parser.add_argument("--gbtrace", default="build/release/gbtrace")
parser.add_argument("--iterations", type=int, default=1200)
parser.add_argument("--seeds", default="0,1")
parser.add_argument("--degrees", type=float, default=0.5)
parser.add_argument("--part", type=float, default=0.01)
args, more = parser.parse_known_args()


def direction(rng):
    v = [rng.gauss(0, 1) for _ in range(3)]
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def product(a, b):
    """Product of two quaternions, real part first."""
    return [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]]


def turned(q, v):
    return product(product(q, [0, *v]), [q[0], -q[1], -q[2], -q[3]])[1:]


def inverse(q):
    return [q[0], -q[1], -q[2], -q[3]]


def disturb(source, out, seed):
    """Copy a data set, with other poses."""
    sparse = os.path.join(source, "sparse", "0")
    target = os.path.join(out, "sparse", "0")
    os.makedirs(target, exist_ok=True)
    for folder, name in ((source, "images"), (source, "masks"), (sparse, "cameras.bin"), (sparse, "points3D.bin")):
        link = os.path.join(out if folder == source else target, name)
        if os.path.exists(os.path.join(folder, name)) and not os.path.lexists(link):
            os.symlink(os.path.realpath(os.path.join(folder, name)), link)
    with open(os.path.join(sparse, "images.bin"), "rb") as file:
        data = bytearray(file.read())
    count, at, places, poses = struct.unpack_from("<Q", data)[0], 8, [], []
    for _ in range(count):
        values = struct.unpack_from("<4d3d", data, at + 4)
        places.append(at + 4)
        poses.append((values[:4], [-x for x in turned(inverse(values[:4]), values[4:])]))
        name_end = data.index(b"\0", at + 64)
        at = name_end + 9 + 24 * struct.unpack_from("<Q", data, name_end + 1)[0]
    mean = [statistics.mean(center[k] for _, center in poses) for k in range(3)]
    extent = 1.1 * max(math.dist(center, mean) for _, center in poses)
    rng = random.Random(seed)
    half = math.radians(args.degrees) / 2
    for place, (q, center) in zip(places, poses):
        q = product([math.cos(half), *(math.sin(half) * x for x in direction(rng))], q)
        center = [c + args.part * extent * x for c, x in zip(center, direction(rng))]
        struct.pack_into("<4d3d", data, place, *q, *(-x for x in turned(q, center)))
    with open(os.path.join(target, "images.bin"), "wb") as file:
        file.write(data)
    return out


def train(data, run, seed, *settings):
    if not os.path.exists(os.path.join(run, "metrics.json")):
        subprocess.run([args.gbtrace, "train", data, "-o", run, "--overwrite", "--save-every", "0", "--seed", str(seed),
                        "--iterations", str(args.iterations), *more, *settings], check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(run, "metrics.json")) as text:
        return json.load(text)


def show(runs, key, digits):
    values = [r[key] for r in runs]
    return f"{statistics.mean(values):.{digits}f}" + (f" ± {statistics.stdev(values):.{digits}f}" if len(values) > 1 else "")


print("| scene | poses | training | PSNR, dB | SSIM | training, s |")
print("|---|---|---|---|---|---|")
for data in args.data:
    scene = os.path.basename(os.path.normpath(data))
    rows = {}
    for seed in (int(s) for s in args.seeds.split(",")):
        place = os.path.join(args.output, f"{scene}-{seed}")
        os.makedirs(place, exist_ok=True)
        wrong = disturb(data, os.path.join(place, "data"), seed)
        for poses, source in (("given", data), ("disturbed", wrong)):
            for training, settings in (("as they are", ()), ("refined", ("--refine-poses",))):
                run = os.path.join(place, f"{poses} {training}".replace(" ", "-"))
                rows.setdefault((poses, training), []).append(train(source, run, seed, *settings))
    for (poses, training), runs in rows.items():
        print(f"| {scene} | {poses} | {training} | {show(runs, 'psnr', 2)} | {show(runs, 'ssim', 4)} | {show(runs, 'train_seconds', 0)} |", flush=True)
