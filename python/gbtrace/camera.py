# SPDX-License-Identifier: Apache-2.0
"""A posed camera: lens model, image size, pose."""

import ctypes as c
import math

import numpy as np

from gbtrace._library import ArgumentError, CCamera, library, wanted, whole_number

MODELS = {library.gbt_camera_model_name(i).decode(): i for i in map(library.gbt_camera_model_at, range(library.gbt_camera_model_count()))}

SHUTTERS = ("global", "rows", "columns")  # in the order of gbt_camera_shutter


class Camera:
    """COLMAP's axes (x right, y down, z forward), lens models and parameters; docs/cameras.md has them all.

    `rotation` (3 x 3, world to camera), `center`, `params` and `motion` are views of the camera's own memory: writing into them changes it.
    With `shutter` "rows" or "columns" the pose is that of the picture's middle, and `motion` how the camera moves (as `moved()` takes it)
    while the picture is read out, from its top or left edge on.
    """

    __slots__ = ("_c",)  # a misspelt name is an error

    def __init__(self, model="PINHOLE", width=0, height=0, params=(), rotation=None, center=(0, 0, 0)):
        if model not in MODELS:
            raise ValueError(f"model: {model!r} (wanted one of {', '.join(MODELS)})")
        count = library.gbt_camera_param_count(MODELS[model])
        if len(params) != count:
            names = library.gbt_camera_param_names(MODELS[model]).decode()
            raise ValueError(f"params: {len(params)} (wanted {count} for {model}: {names})")
        self._c = CCamera(MODELS[model], whole_number(width, "width", 0), whole_number(height, "height", 0))
        self.params = params
        self.rotation = np.eye(3) if rotation is None else rotation
        self.center = center

    @classmethod
    def pinhole(cls, width, height, fov_x_deg):
        """At the origin, looking along z."""
        if not 0 < fov_x_deg < 180:
            raise ValueError(f"fov_x_deg: {fov_x_deg} (wanted above 0 and below 180)")
        f = 0.5 * width / math.tan(math.radians(0.5 * fov_x_deg))
        return cls("PINHOLE", width, height, (f, f, 0.5 * width, 0.5 * height))

    @classmethod
    def _of(cls, struct):
        camera = cls.__new__(cls)
        camera._c = CCamera.from_buffer_copy(struct)
        return camera

    def __copy__(self):
        return Camera._of(self._c)

    @property
    def model(self):
        return library.gbt_camera_model_name(self._c.model).decode()

    @property
    def width(self):
        return self._c.width

    @property
    def height(self):
        return self._c.height

    @property
    def params(self):
        return np.ctypeslib.as_array(self._c.params)[:library.gbt_camera_param_count(self._c.model)]

    @params.setter
    def params(self, values):
        _fill(self.params, values, "params")

    @property
    def rotation(self):
        return np.ctypeslib.as_array(self._c.rotation).reshape(3, 3)

    @rotation.setter
    def rotation(self, values):
        _fill(self.rotation, values, "rotation")

    @property
    def center(self):
        return np.ctypeslib.as_array(self._c.center)

    @center.setter
    def center(self, values):
        _fill(self.center, values, "center")

    @property
    def shutter(self):
        return SHUTTERS[self._c.shutter]

    @shutter.setter
    def shutter(self, value):
        if value not in SHUTTERS:
            raise ValueError(f"shutter: {value!r} (wanted one of {', '.join(SHUTTERS)})")
        self._c.shutter = SHUTTERS.index(value)

    @property
    def motion(self):
        return np.ctypeslib.as_array(self._c.motion)

    @motion.setter
    def motion(self, values):
        _fill(self.motion, values, "motion")

    def looking_at(self, origin, target, up=(0, -1, 0)):
        """The same lens at `origin`, with `target` in the middle of its picture and `up` towards its top."""
        out = Camera._of(self._c)
        if not library.gbt_camera_look_at(_doubles(origin, 3), _doubles(target, 3), _doubles(up, 3), c.byref(out._c)):
            raise ArgumentError("camera: the target is at the origin, up is along the view, or a value is not finite")
        return out

    def moved(self, motion):
        """After a small motion: along its axes (right, down, forward), then the turn about them in radians. What pose gradients are taken for."""
        return Camera._of(library.gbt_camera_moved(c.byref(self._c), _doubles(motion, 6)))

    def resized(self, width, height):
        """The same camera for a picture of another size; where both axes share a focal length, one of the same shape within a pixel."""
        width, height = whole_number(width, "width", 1), whole_number(height, "height", 1)
        has_one_f = library.gbt_camera_param_names(self._c.model).startswith(b"f ")
        if has_one_f and abs(width * self.height - height * self.width) > max(self.width, self.height):
            raise ArgumentError(f"camera: {self.model} has one focal length, {self.width} x {self.height} pixels cannot become {width} x {height} "
                                "(wanted the same shape)")
        return Camera._of(library.gbt_camera_resized(c.byref(self._c), width, height))

    def distance(self, other):
        """How far apart two poses are: between the centres, and the angle in radians."""
        wanted(other, "other", Camera)
        cosine = 0.5 * (np.trace(self.rotation @ other.rotation.T) - 1)
        return float(np.linalg.norm(self.center - other.center)), float(np.arccos(np.clip(cosine, -1, 1)))

    def __repr__(self):
        return f"Camera({self.model!r}, {self.width}, {self.height}, params={self.params.tolist()}, center={self.center.tolist()})"


def _fill(array, values, name):
    """Without broadcasting: one number in place of three is a mistake."""
    values = np.asarray(values, dtype=np.float64)
    if values.shape != array.shape:
        raise ValueError(f"{name}: shape {values.shape} (wanted {array.shape})")
    array[:] = values


def _doubles(values, count):
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (count,):
        raise ValueError(f"shape {array.shape} (wanted ({count},))")
    return (c.c_double * count)(*array)
