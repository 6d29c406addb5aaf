"""PSNR, SSIM and FLIP of pairs of PNG files by gbtrace, scikit-image and flip-evaluator; see bench/versus_metrics."""

import json
import pathlib
import subprocess
import sys
import tempfile

import flip_evaluator
import numpy
from scipy import ndimage
from skimage import io, metrics

# Largest difference that counts as the same. Of FLIP, 7e-4 between black and white, where constants of colour are rounded; else 1e-5.
LIMITS = {"psnr": 1e-6, "ssim_interior": 1e-6, "flip": 1e-3}
NAMES = {"psnr": "PSNR, dB", "ssim_interior": "SSIM", "flip": "FLIP"}


def picture(width, height, seed):
    """Smooth colours with edges, in [0, 1]."""
    random = numpy.random.default_rng(seed)
    smooth = ndimage.gaussian_filter(random.random((height, width, 3)), (3, 3, 0), mode="wrap")
    smooth = (smooth - smooth.min()) / (smooth.max() - smooth.min())
    y, x = numpy.mgrid[0:height, 0:width]
    smooth[(x // 24 + y // 18) % 5 == 0] *= 0.35
    return smooth


def made_pairs():
    """(name, picture, reference) of many kinds of difference."""
    random = numpy.random.default_rng(1)
    base = picture(320, 240, 2)
    for sigma in (0.002, 0.01, 0.05, 0.2):
        yield f"noise {sigma}", base + random.normal(0, sigma, base.shape), base
    for sigma in (0.5, 1, 3, 8):
        yield f"blur {sigma}", ndimage.gaussian_filter(base, (sigma, sigma, 0)), base
    yield "shift 1", numpy.roll(base, 1, axis=1), base
    yield "shift 7", numpy.roll(base, 7, axis=0), base
    yield "half as bright", base * 0.5, base
    yield "red and blue swapped", base[..., ::-1], base
    yield "another picture", picture(320, 240, 3), base
    yield "black, white", numpy.zeros_like(base), numpy.ones_like(base)
    yield "constant 0.6, one level more", numpy.full_like(base, 0.6), numpy.full_like(base, 0.6 + 1 / 255)
    yield "equal", base, base
    small = picture(11, 11, 4)
    yield "11 x 11", small + random.normal(0, 0.05, small.shape), small
    odd = picture(37, 23, 5)
    yield "37 x 23", odd + random.normal(0, 0.05, odd.shape), odd


def write(path, values):
    io.imsave(path, (numpy.clip(values, 0, 1) * 255 + 0.5).astype(numpy.uint8), check_contrast=False)


def theirs(path, reference):
    a, b = (io.imread(p)[..., :3].astype(numpy.float64) / 255 for p in (path, reference))
    mse = numpy.mean((a - b) ** 2)
    similarity = metrics.structural_similarity(
        b, a, channel_axis=2, data_range=1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    flip = flip_evaluator.evaluate(b.astype(numpy.float32), a.astype(numpy.float32), "LDR", applyMagma=False)[1]
    psnr = 100.0 if mse <= 1e-10 else metrics.peak_signal_noise_ratio(b, a, data_range=1)
    return {"psnr": float(psnr), "ssim_interior": float(similarity), "flip": float(flip)}


def ours(program, path, reference):
    done = subprocess.run([program, "compare", "--json", path, reference], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def run_pairs(folder):
    for photo in sorted(pathlib.Path(folder).glob("*.photo.png")):
        render = photo.with_name(photo.name.removesuffix(".photo.png") + ".png")
        yield f"{photo.parent}/{render.name}", str(render), str(photo)


def all_pairs(folders, scratch):
    for index, (name, values, reference) in enumerate(made_pairs()):
        paths = [f"{scratch}/{index}.png", f"{scratch}/{index}.photo.png"]
        write(paths[0], values)
        write(paths[1], reference)
        yield name, *paths
    for folder in folders:
        yield from run_pairs(folder)


def main():
    program, folders = sys.argv[1], sys.argv[2:]
    worst = dict.fromkeys(LIMITS, 0.0)
    count = 0
    print("| pair | " + " | ".join(f"{NAMES[m]}: gbtrace | other" for m in LIMITS) + " |\n|---" + "|--:" * 2 * len(LIMITS) + "|")
    with tempfile.TemporaryDirectory() as scratch:
        for name, path, reference in all_pairs(folders, scratch):
            mine, other = ours(program, path, reference), theirs(path, reference)
            for m in LIMITS:
                worst[m] = max(worst[m], abs(mine[m] - other[m]))
            print(f"| {name} | " + " | ".join(f"{mine[m]:.6f} | {other[m]:.6f}" for m in LIMITS) + " |")
            count += 1
    print(f"\nLargest difference in {count} pairs: " + "; ".join(f"{NAMES[m]} {worst[m]:.1e} (limit {LIMITS[m]:g})" for m in LIMITS) + ".")
    print("SSIM is the mean over the windows that lie wholly inside the picture, as scikit-image takes it; gbtrace's own figure, which")
    print("counts every pixel with zeros beyond the border as Scaffold-GS and 3DGS do, has no counterpart there.")
    sys.exit(any(not worst[m] <= LIMITS[m] for m in LIMITS))


main()
