# SPDX-License-Identifier: Apache-2.0
"""gbtrace: neural Gaussian scenes by ray tracing, on the CPU.

    model = gbtrace.Model("RUN")
    picture = model.render(gbtrace.Camera.pinhole(640, 480, 60).looking_at((0, 0, -4), (0, 0, 0)))
"""

from gbtrace._library import ArgumentError, Error, FileError, FormatError, OutOfMemoryError, set_threads, version
from gbtrace.camera import Camera
from gbtrace.model import Gaussians, Info, Model, Settings, View
from gbtrace.query import Answers, Balls
from gbtrace.run import Comparison, compare, evaluate, export, train

__version__ = version()
__all__ = ["Answers", "ArgumentError", "Balls", "Camera", "Comparison", "Error", "FileError", "FormatError", "Gaussians", "Info", "Model", "OutOfMemoryError",
           "Settings", "View", "compare", "evaluate", "export", "set_threads", "train", "version"]
