# SPDX-License-Identifier: Apache-2.0
"""A scene in memory: open it, render it into arrays, take gradients back."""

import ctypes as c
from typing import NamedTuple, Optional

import numpy as np

from gbtrace import _library as lib
from gbtrace.camera import Camera


class Gaussians(NamedTuple):
    """Plain Gaussians, or their gradients, as float32 arrays. Colour: max(0, 0.5 + sum_k sh_k Y_k(d))."""

    mean: Optional[np.ndarray]       # (count, 3)
    scale_log: Optional[np.ndarray]  # (count, 3), natural log of the std-devs
    quat: Optional[np.ndarray]       # (count, 4), w x y z
    opacity: Optional[np.ndarray]    # (count,), 0 to 1
    sh: Optional[np.ndarray]         # (count, 1 | 4 | 9 | 16, 3)


class Info(NamedTuple):
    """What a model is."""

    gaussians: int   # at most so many are drawn
    anchors: int     # 0: plain Gaussians
    sh_degree: int   # -1: networks make the colours
    iterations: int
    low: tuple       # box of all positions
    high: tuple


class Settings(NamedTuple):
    """How pictures are made; include/gbtrace/model.h says what each means."""

    background: tuple
    footprint: float
    t_near: float
    alpha_min: float
    alpha_max: float
    transmittance_min: float


class View(NamedTuple):
    """A view of the data set that a model was trained on."""

    name: str
    held_out: bool
    camera: Camera
    t_near: float  # for model.settings: of training, and of the program's render, for this photo


def _gaussians_struct(g):
    count, functions = (np.shape(a)[axis] if np.ndim(a) > axis else 0 for a, axis in ((g.mean, 0), (g.sh, 1)))
    degree = {1: 0, 4: 1, 9: 2, 16: 3}.get(functions)
    if degree is None:
        raise ValueError(f"sh: shape {np.shape(g.sh)} (wanted (count, 1, 4, 9 or 16, 3))")
    return lib.CGaussians(count, degree, lib.address(g.mean, "mean", (count, 3)), lib.address(g.scale_log, "scale_log", (count, 3)),
                          lib.address(g.quat, "quat", (count, 4)), lib.address(g.opacity, "opacity", (count,)),
                          lib.address(g.sh, "sh", (count, functions, 3)))


class Model:
    """A trained model (a run's folder or its model.gbt), or plain Gaussians. One thread at a time may use it.

    Coordinates are those of the data set, or of the file or arrays.
    """

    __slots__ = ("_handle", "_size", "__weakref__")  # a misspelt name is an error

    def __init__(self, path):
        self._handle = c.c_void_p()
        lib.call("gbt_model_open", lib.encode(path), c.byref(self._handle))

    @classmethod
    def from_gaussians(cls, mean, scale_log, quat, opacity, sh):
        """Plain Gaussians from float32 arrays, shaped as in Gaussians. The model keeps a copy."""
        model = cls.__new__(cls)
        model._handle = c.c_void_p()
        struct = _gaussians_struct(Gaussians(mean, scale_log, quat, opacity, sh))
        lib.call("gbt_model_from_gaussians", c.byref(struct), c.byref(model._handle))
        return model

    def set_gaussians(self, mean, scale_log, quat, opacity, sh):
        """Other plain Gaussians for a model of such; settings stay."""
        struct = _gaussians_struct(Gaussians(mean, scale_log, quat, opacity, sh))
        lib.call("gbt_model_set_gaussians", self._open(), c.byref(struct))

    def __reduce_ex__(self, protocol):
        raise TypeError("a gbtrace.Model cannot be copied or pickled (open it again)")

    def gaussians(self):
        """Its plain Gaussians as they are drawn, in new arrays, in the form that set_gaussians() takes; those of a file are what gradient() is of."""
        g = Gaussians(*(np.empty(shape, np.float32) for shape in self._shapes()))
        lib.call("gbt_model_get_gaussians", self._open(), *(a.ctypes.data for a in g))
        return g

    def _shapes(self):
        i = self.info
        return Gaussians((i.gaussians, 3), (i.gaussians, 3), (i.gaussians, 4), (i.gaussians,), (i.gaussians, (i.sh_degree + 1) ** 2, 3))

    def close(self):
        """Give its memory back now. It cannot be used any more."""
        if getattr(self, "_handle", None):
            handle, self._handle = self._handle, c.c_void_p()  # before the call, which Ctrl-C can interrupt when all is freed
            lib.library.gbt_model_close(handle)

    __del__ = close

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()

    def _open(self):
        if not self._handle:
            raise ValueError("the model is closed")
        return self._handle

    @property
    def info(self):
        i = lib.library.gbt_model_get_info(self._open())
        return Info(i.gaussians, i.anchors, i.sh_degree, i.iterations, tuple(i.low), tuple(i.high))

    @property
    def settings(self):
        s = lib.library.gbt_model_get_settings(self._open())
        return Settings(tuple(s.background), s.footprint, s.t_near, s.alpha_min, s.alpha_max, s.transmittance_min)

    @settings.setter
    def settings(self, settings):
        lib.wanted(settings, "settings", Settings, ", as model.settings._replace(footprint=0)")
        if len(settings.background) != 3:
            raise ValueError(f"background: {settings.background!r} (wanted red, green and blue)")
        struct = lib.CModelSettings((c.c_float * 3)(*settings.background), *settings[1:])
        lib.call("gbt_model_set_settings", self._open(), c.byref(struct))

    def views(self, data=None):
        """The views of the data set it was trained on, or of the one in the folder `data`."""
        count, view = c.c_size_t(), lib.CModelView()
        lib.call("gbt_model_open_views", self._open(), lib.optional(data), c.byref(count))
        views = []
        for i in range(count.value):
            lib.call("gbt_model_get_view", self._open(), i, c.byref(view))
            views.append(View(view.name.decode("utf-8", "surrogateescape"), bool(view.held_out), Camera._of(view.camera), view.t_near))
        return views

    def render(self, camera, rgb=None, depth=None, transmittance=None, keep=False):
        """What a camera sees, as a float32 array (height, width, 3).

        `rgb`, `depth` and `transmittance` are float32 arrays that are written in place; without `rgb` a new one is made. `keep`:
        gradient() follows. Returns `rgb`.
        """
        lib.wanted(camera, "camera", Camera, "; that of a View is its .camera")
        size = (camera.height, camera.width)
        if rgb is None:
            rgb = np.empty((*size, 3), np.float32)
        picture = lib.CPicture(lib.address(rgb, "rgb", (*size, 3), True), *(None if a is None else lib.address(a, name, size, True)
                                                                            for a, name in ((depth, "depth"), (transmittance, "transmittance"))))
        self._size = None
        lib.call("gbt_model_render", self._open(), c.byref(camera._c), bool(keep), c.byref(picture))
        self._size = size
        return rgb

    def gradient(self, d_rgb, gaussians=False):
        """From dL/d(rgb) of the last render(keep=True) to dL/d(motion) of its camera (see Camera.moved), an array of six.

        `gaussians`: True to get the gradients of plain Gaussians too, or a Gaussians of arrays that are written in place (None in it: not
        wanted). Then the result is the pair of both.
        """
        size = getattr(self, "_size", None)
        if size is None:
            raise ValueError("gradient: there is no render to differentiate (wanted render(keep=True) before)")
        pose, struct = np.zeros(6), None
        at = lib.address(d_rgb, "d_rgb", (*size, 3))
        wants = gaussians is not None and gaussians is not False
        if wants:
            shapes = self._shapes()
            if gaussians is not True:
                lib.wanted(gaussians, "gaussians", Gaussians, ", or True")
            else:
                gaussians = Gaussians(*(np.empty(shape, np.float32) for shape in shapes))
            struct = lib.CGaussiansGradient(*(None if a is None else lib.address(a, name, shape, True)
                                              for a, name, shape in zip(gaussians, Gaussians._fields, shapes)))
        lib.call("gbt_model_gradient", self._open(), at, pose.ctypes.data_as(c.POINTER(c.c_double)), None if struct is None else c.byref(struct))
        return (pose, gaussians) if wants else pose
