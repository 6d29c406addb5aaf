# SPDX-License-Identifier: Apache-2.0
"""What takes whole folders: training, scoring, exporting, comparing."""

import ctypes as c
from typing import NamedTuple

import numpy as np

from gbtrace import _library as lib
from gbtrace.model import Model


class Comparison(NamedTuple):
    """Two pictures compared."""

    psnr: float           # dB, at most 100
    ssim: float           # windows see 0 beyond the border
    ssim_interior: float  # windows that lie wholly inside; NaN below 11 x 11 pixels
    flip: float


def train(data, run, **settings):
    """Train on the posed photos in the folder `data`, write everything into the folder `run`, open the model.

    Settings have the names of RUN/config, with _ for -: train("photos", "run", iterations=2000, downscale=2). Progress goes to stderr.
    SIGINT (Ctrl-C), SIGTERM and stop_at_step save a checkpoint and raise KeyboardInterrupt. train(None, "run", resume=True, iterations=4000)
    goes on with a run, here to 4000 steps.

    It leaves a large model.gbt without scores. What the program does then: `gbtrace compress RUN -o RUN/model.gbt` makes it small, evaluate()
    makes scores, renders and the report.
    """
    lines = "".join(_setting(key.replace("_", "-"), int(value) if isinstance(value, (bool, np.bool_)) else value) for key, value in settings.items())
    lib.call("gbt_train_with", lib.optional(data), lib.encode(run), lines.encode())
    return Model(run)


def _setting(name, value):
    line = f"{name} = {value}\n"
    if line.count("\n") != 1 or "\0" in line:
        raise ValueError(f"{name}: {value!r} (wanted one line, without NUL)")
    return line


def evaluate(run, data=None, lpips=None, json=None):
    """Score the held-out views of a run; RUN/metrics.json and RUN/report.html have the figures, and the file `json` too.

    On another data set than the run's own, `json` alone. lpips: the file of a network (docs/metrics.md).
    """
    settings = lib.library.gbt_evaluate_def_default()
    settings.data, settings.lpips, settings.json = lib.optional(data), lib.optional(lpips), lib.optional(json)
    lib.call("gbt_evaluate", lib.encode(run), c.byref(settings))


def export(path, *outputs, sh_degree=3, refine_steps=500, gaussians=0, backdrop=True, data=None):
    """Write a trained model, or plain Gaussians, as plain Gaussians, in the format of each name's ending (docs/exporting.md)."""
    settings = lib.library.gbt_export_def_default()
    settings.sh_degree = lib.whole_number(sh_degree, "sh_degree", 0)
    settings.refine_steps = lib.whole_number(refine_steps, "refine_steps", 0)
    settings.gaussians, settings.backdrop = lib.whole_number(gaussians, "gaussians", 0), backdrop
    settings.data = lib.optional(data)
    names = (c.c_char_p * len(outputs))(*(lib.encode(name) for name in outputs))
    lib.call("gbt_export", lib.encode(path), c.byref(settings), names, len(outputs), None)


def compare(picture, reference):
    """PSNR, SSIM and FLIP of two pictures, rounded to 8 bit: float32 arrays (height, width, 3), or image files."""
    out = lib.CComparison()
    if isinstance(picture, np.ndarray) or isinstance(reference, np.ndarray):
        if getattr(picture, "ndim", 0) != 3:
            raise TypeError("picture: wanted two arrays (height, width, 3), or two files")
        height, width = picture.shape[:2]
        lib.call("gbt_compare_pictures", lib.address(picture, "picture", (height, width, 3)), lib.address(reference, "reference", (height, width, 3)),
                 width, height, c.byref(out))
    else:
        lib.call("gbt_compare_images", lib.encode(picture), lib.encode(reference), None, c.byref(out))
    return Comparison(out.psnr, out.ssim, out.ssim_interior, out.flip)
