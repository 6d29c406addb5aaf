# SPDX-License-Identifier: Apache-2.0
"""bench/versus_mitsuba.py -- measure and print the tables; bench/versus_mitsuba prepares the environment and calls this."""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
import mitsuba_scene as peer # imported only now: it needs the variant

MODES = {
    "defaults": (False, [], "Each at its own settings. Mitsuba: proxies of 3 standard deviations, stop at T <= 0.01. gbtrace: responses down to 1/255 "
                 "(up to 3.33 standard deviations), stop before T < 1e-4: it does more work per ray than Mitsuba here, and takes alpha up to 0.99, "
                 "Mitsuba up to 0.9999."),
    "same-cuts": (True, ["--alpha-min", str(peer.ALPHA_MIN), "--alpha-max", str(peer.ALPHA_MAX), "--t-min", str(peer.T_MIN)],
                  "The same cuts for both: responses down to 0.01 (Mitsuba's adaptive clamping), alpha up to 0.9999, T down to 0.01 (Mitsuba stops after the hit that passes it, gbtrace "
                  "before)."),
}


def progress(text):
    print(text, file=sys.stderr, flush=True)


def cpu_us_per_ray(work, rays):
    begin = time.process_time()
    work()
    return 1e6 * (time.process_time() - begin) / rays


class Gbtrace:
    def __init__(self, program, folder, camera, options, scratch):
        self.command = [program, "bench", "trace", "--model", os.path.join(folder, "scene.ply"), *options]
        self.camera, self.scratch = camera, scratch

    def run(self, width, height, *more):
        camera_file, result = os.path.join(self.scratch, "camera.json"), os.path.join(self.scratch, "result.json")
        with open(camera_file, "w") as file:
            json.dump(dict(self.camera, width=width, height=height), file)
        done = subprocess.run([*self.command, "--camera", camera_file, "--json", result, *more], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise SystemExit(done.stderr.strip() or f"error: {self.command[0]}: ended with {done.returncode}")
        with open(result) as file:
            return json.load(file)


def rounds(count, first, second):
    """Median results of two functions, after one warm-up call of each. They alternate in going first."""
    first(), second()
    taken = ([], [])
    for i in range(count):
        for which in ((0, 1) if i % 2 == 0 else (1, 0)):
            taken[which].append((first, second)[which]())
    return [statistics.median(values) for values in taken]


def mitsuba_error(arrays, adaptive, camera, image, ray_count):
    """PSNR and largest error of Mitsuba's image on a regular grid of pixels, against its own equation in double."""
    height, width = image.shape[:2]
    side = max(1, round(ray_count ** 0.5))
    xs, ys = ((np.arange(side) + 0.5) * width / side).astype(int), ((np.arange(side) + 0.5) * height / side).astype(int)
    pixels = np.stack(np.meshgrid(np.unique(xs), np.unique(ys)), -1).reshape(-1, 2)
    want = peer.evaluate(arrays, adaptive, *peer.pixel_rays(camera, width, height, pixels))
    error = np.abs(image[pixels[:, 1], pixels[:, 0]].astype(np.float64) - want)
    return -10 * np.log10(max((error ** 2).mean(), 1e-20)), error.max()


def measure(folder, mode, options):
    adaptive, cuts, _ = MODES[mode]
    name = os.path.basename(os.path.normpath(folder))
    camera, arrays = peer.load_camera(folder), peer.load_arrays(folder)
    width, height, small = camera["width"], camera["height"], options.adjoint_size
    scene, integrator = peer.make_scene(arrays, adaptive), peer.make_integrator()
    sensor, small_sensor = peer.make_sensor(camera, width, height), peer.make_sensor(camera, small, small)
    with tempfile.TemporaryDirectory() as scratch:
        gbtrace = Gbtrace(options.gbtrace, folder, camera, cuts, scratch)
        passes = ("--repeats", str(options.repeats))
        progress(f"{name}, {mode}: forward")
        forward = rounds(options.repeats, lambda: cpu_us_per_ray(lambda: peer.render(scene, sensor, integrator), width * height),
                         lambda: gbtrace.run(width, height, *passes)["forward_core_us_per_ray"])
        progress(f"{name}, {mode}: forward and backward")
        step = peer.Step(scene, small_sensor, integrator)
        if not all(gradient.numpy().any() for gradient in step.run()):
            raise SystemExit(f"error: {folder}: Mitsuba's gradients are all 0")

        def gbtrace_step():
            figures = gbtrace.run(small, small, *passes)
            return figures["forward_core_us_per_ray"] + figures["adjoint_core_us_per_ray"]

        both = rounds(options.repeats, lambda: cpu_us_per_ray(step.run, small * small), gbtrace_step)
        progress(f"{name}, {mode}: errors")
        checked = gbtrace.run(width, height, "--repeats", "1", "--check")
    image = peer.render(scene, sensor, integrator).numpy()
    psnr, largest = mitsuba_error(arrays, adaptive, camera, image, options.check_rays)
    return (f"| {name} | {len(arrays[0]):,} | {forward[0]:.2f} | {forward[1]:.2f} | {forward[0] / forward[1]:.1f} "
            f"| {both[0]:.1f} | {both[1]:.2f} | {both[0] / both[1]:.1f} "
            f"| {psnr:.1f} dB, {largest:.1e} | {checked['psnr_to_reference']:.1f} dB, {checked['max_error']:.1e} |")


def main():
    parser = argparse.ArgumentParser(prog="bench/versus_mitsuba")
    parser.add_argument("--gbtrace", required=True)
    parser.add_argument("--mode", choices=[*MODES, "both"], default="both")
    parser.add_argument("--repeats", type=int, choices=range(1, 101), metavar="N", default=3)
    parser.add_argument("--adjoint-size", type=int, choices=range(16, 4097), metavar="N", default=256)
    parser.add_argument("--check-rays", type=int, choices=range(1, 1_000_001), metavar="N", default=1024)
    parser.add_argument("scene", nargs="+")
    options = parser.parse_args()
    for folder in options.scene:
        for needed in ("scene.ply", "camera.json"):
            if not os.path.exists(os.path.join(folder, needed)):
                raise SystemExit(f"error: {folder}/{needed}: is not there")
    print(f"Core-microseconds per ray: process CPU time / rays, median of {options.repeats} rounds after a warm-up, the two taking turns, "
          f"{dr.thread_count()} threads. Mitsuba {mi.__version__} (`volprim_rf_basic`, `ellipsoids`, `llvm_ad_rgb`), SH degree 0. Forward at the size of "
          f"the camera file, forward and backward together at {options.adjoint_size} x {options.adjoint_size}. Building the trees is not counted for "
          "either. Errors, PSNR and largest: Mitsuba against its own equation in double (order by entry into the proxy), gbtrace against its own double "
          "reference (order by depth of the peak).")
    for mode in MODES if options.mode == "both" else [options.mode]:
        print(f"\n{MODES[mode][2]}\n")
        print("| scene | Gaussians | Mitsuba fwd, us | gbtrace fwd, us | ratio | Mitsuba fwd+bwd, us | gbtrace fwd+adjoint, us | ratio | Mitsuba error | gbtrace error |")
        print("|---|---|---|---|---|---|---|---|---|---|")
        for folder in options.scene:
            print(measure(folder, mode, options), flush=True)


if __name__ == "__main__":
    sys.exit(main())
