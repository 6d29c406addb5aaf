# SPDX-License-Identifier: Apache-2.0
"""bench/versus_metrics.py -- PSNR, SSIM, FLIP and LPIPS of pairs of PNG files, by gbtrace and by other programs; see bench/versus_metrics."""

import json
import pathlib
import subprocess
import sys
import tempfile

import flip_evaluator
import numpy
import onnx
import onnxruntime
import safetensors.numpy
from scipy import ndimage
from skimage import io, metrics

# Largest difference that counts as equal. FLIP differs by 7e-4 between black and white, because of rounded colour constants, and else by 1e-5.
LIMITS = {"psnr": 1e-6, "ssim_interior": 1e-6, "flip": 1e-3, "lpips": 1e-5, "lpips_01": 1e-5}
NAMES = {"psnr": "PSNR, dB", "ssim_interior": "SSIM", "flip": "FLIP", "lpips": "LPIPS", "lpips_01": "LPIPS of [0, 1]"}
SMALLEST = 16  # side of the smallest picture that VGG16 accepts, pixels

# Channels of VGG16's convolutions; "M": max pooling. LPIPS compares the output of the last convolution before each "M", and of the last one.
VGG = [64, 64, "M", 128, 128, "M", 256, 256, 256, "M", 512, 512, 512, "M", 512, 512, 512]


class Vgg:
    """VGG16 with random weights, as a graph for ONNX Runtime and as the file that gbtrace reads."""

    def __init__(self, path):
        random, state = numpy.random.default_rng(6), {}
        nodes, outputs, value, channels, slice_number = [], [], "x", 3, 1
        self.lin = []
        module = 0
        for index, width in enumerate(VGG):
            if width == "M":
                nodes.append(onnx.helper.make_node("MaxPool", [value], [f"p{index}"], kernel_shape=[2, 2], strides=[2, 2]))
                value, module, slice_number = f"p{index}", module + 1, slice_number + 1
                continue
            name = f"net.slice{slice_number}.{module}"
            state[f"{name}.weight"] = random.normal(0, (2 / (9 * channels)) ** 0.5, (width, channels, 3, 3)).astype(numpy.float32)
            state[f"{name}.bias"] = random.uniform(-0.1, 0.1, width).astype(numpy.float32)
            nodes.append(onnx.helper.make_node("Conv", [value, f"{name}.weight", f"{name}.bias"], [f"c{index}"], pads=[1, 1, 1, 1]))
            nodes.append(onnx.helper.make_node("Relu", [f"c{index}"], [f"r{index}"]))
            value, channels, module = f"r{index}", width, module + 2
            if index + 1 == len(VGG) or VGG[index + 1] == "M":
                self.lin.append(random.uniform(0, 1 / 5, width).astype(numpy.float32))
                state[f"lin{len(self.lin) - 1}.model.1.weight"] = self.lin[-1].reshape(1, width, 1, 1)
                outputs.append(onnx.helper.make_tensor_value_info(value, onnx.TensorProto.FLOAT, [1, width, None, None]))
        safetensors.numpy.save_file(state, path)
        picture = onnx.helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, [1, 3, None, None])
        weights = [onnx.numpy_helper.from_array(array, name) for name, array in state.items() if name.startswith("net.")]
        graph = onnx.helper.make_graph(nodes, "vgg", [picture], outputs, weights)
        model = onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 13)], ir_version=8)
        self.session = onnxruntime.InferenceSession(model.SerializeToString())
        self.path = path

    def features(self, picture, low):
        shift, scale = numpy.array([-0.030, -0.088, -0.188]), numpy.array([0.458, 0.448, 0.450])
        fed = (low + (1 - low) * picture - shift) / scale
        found = self.session.run(None, {"x": fed.transpose(2, 0, 1)[None].astype(numpy.float32)})
        return [f[0] / (numpy.sqrt((f[0].astype(numpy.float64) ** 2).sum(axis=0)) + 1e-10) for f in found]

    def distance(self, a, b, low):
        pairs = zip(self.features(a, low), self.features(b, low), self.lin)
        return sum((weight[:, None, None] * (x - y) ** 2).sum(axis=0).mean() for x, y, weight in pairs)


def picture(width, height, seed):
    """Smooth colours with edges, in [0, 1]."""
    random = numpy.random.default_rng(seed)
    smooth = ndimage.gaussian_filter(random.random((height, width, 3)), (3, 3, 0), mode="wrap")
    smooth = (smooth - smooth.min()) / (smooth.max() - smooth.min())
    y, x = numpy.mgrid[0:height, 0:width]
    smooth[(x // 24 + y // 18) % 5 == 0] *= 0.35
    return smooth


def made_pairs():
    """Triples (name, picture, reference) that differ in many ways."""
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


def theirs(path, reference, vgg):
    a, b = (io.imread(p)[..., :3].astype(numpy.float64) / 255 for p in (path, reference))
    mse = numpy.mean((a - b) ** 2)
    similarity = metrics.structural_similarity(
        b, a, channel_axis=2, data_range=1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    flip = flip_evaluator.evaluate(b.astype(numpy.float32), a.astype(numpy.float32), "LDR", applyMagma=False)[1]
    psnr = 100.0 if mse <= 1e-10 else metrics.peak_signal_noise_ratio(b, a, data_range=1)
    scores = {"psnr": float(psnr), "ssim_interior": float(similarity), "flip": float(flip)}
    if min(a.shape[:2]) >= SMALLEST:
        scores |= {"lpips": vgg.distance(a, b, -1), "lpips_01": vgg.distance(a, b, 0)}
    return scores


def ours(program, path, reference, network):
    command = [program, "compare", "--json", path, reference] + (["--lpips", network] if network else [])
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


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
        vgg = Vgg(f"{scratch}/vgg.safetensors")
        for name, path, reference in all_pairs(folders, scratch):
            other = theirs(path, reference, vgg)
            mine = ours(program, path, reference, vgg.path if "lpips" in other else None)
            for m in other:
                worst[m] = max(worst[m], abs(mine[m] - other[m]))
            print(f"| {name} | " + " | ".join(f"{mine[m]:.6f} | {other[m]:.6f}" if m in other else " | " for m in LIMITS) + " |")
            count += 1
    print(f"\nLargest difference in {count} pairs: " + "; ".join(f"{NAMES[m]} {worst[m]:.1e} (limit {LIMITS[m]:g})" for m in LIMITS) + ".")
    print("SSIM is the mean over the windows that lie wholly inside the picture, as scikit-image takes it; gbtrace's own figure, which")
    print("counts every pixel with zeros beyond the border as Scaffold-GS and 3DGS do, has no counterpart there.")
    sys.exit(any(not worst[m] <= LIMITS[m] for m in LIMITS))


main()
