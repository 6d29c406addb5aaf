# SPDX-License-Identifier: Apache-2.0
"""libgbtrace as ctypes sees it: structs, functions, statuses to exceptions. Fields are as in include/gbtrace/*.h; tests hold them to it."""

import ctypes as c
import os
from operator import index
from pathlib import Path


class Error(Exception):
    """What the library says, in one line."""


class ArgumentError(Error, ValueError):
    pass


class FormatError(Error, ValueError):
    pass


class FileError(Error, OSError):
    pass


class OutOfMemoryError(Error, MemoryError):
    pass


INTERRUPTED = 5
EXCEPTIONS = {1: ArgumentError, 2: FormatError, 3: FileError, 4: OutOfMemoryError}


class CError(c.Structure):
    _fields_ = [("status", c.c_int), ("text", c.c_char * 512)]


class CCamera(c.Structure):
    _fields_ = [("model", c.c_int), ("width", c.c_int), ("height", c.c_int), ("params", c.c_double * 16), ("rotation", c.c_double * 9),
                ("center", c.c_double * 3), ("shutter", c.c_int), ("motion", c.c_double * 6)]


class CGaussians(c.Structure):
    _fields_ = [("count", c.c_size_t), ("sh_degree", c.c_int), ("mean", c.c_void_p), ("scale_log", c.c_void_p), ("quat", c.c_void_p),
                ("opacity", c.c_void_p), ("sh", c.c_void_p)]


class CGaussiansGradient(c.Structure):
    _fields_ = [("mean", c.c_void_p), ("scale_log", c.c_void_p), ("quat", c.c_void_p), ("opacity", c.c_void_p), ("sh", c.c_void_p)]


class CModelInfo(c.Structure):
    _fields_ = [("gaussians", c.c_size_t), ("anchors", c.c_size_t), ("sh_degree", c.c_int), ("iterations", c.c_uint64), ("low", c.c_double * 3),
                ("high", c.c_double * 3)]


class CModelSettings(c.Structure):
    _fields_ = [("background", c.c_float * 3), ("footprint", c.c_float), ("t_near", c.c_float), ("alpha_min", c.c_float), ("alpha_max", c.c_float),
                ("transmittance_min", c.c_float)]


class CModelView(c.Structure):
    _fields_ = [("name", c.c_char_p), ("held_out", c.c_bool), ("camera", CCamera), ("t_near", c.c_float)]


class CPicture(c.Structure):
    _fields_ = [("rgb", c.c_void_p), ("depth", c.c_void_p), ("transmittance", c.c_void_p)]


class CComparison(c.Structure):
    _fields_ = [("width", c.c_int), ("height", c.c_int), ("psnr", c.c_double), ("ssim", c.c_double), ("ssim_interior", c.c_double), ("flip", c.c_double),
                ("lpips", c.c_double), ("lpips_01", c.c_double)]


class CEvaluateDef(c.Structure):
    _fields_ = [("data", c.c_char_p), ("json", c.c_char_p), ("renderer", c.c_int), ("downscale", c.c_double), ("report", c.c_bool),
                ("preset", c.c_int), ("tensorboard", c.c_bool), ("lpips", c.c_char_p), ("after_training", c.c_bool), ("cookie_", c.c_uint32)]


class CExportDef(c.Structure):
    _fields_ = [("sh_degree", c.c_int), ("refine_steps", c.c_int), ("gaussians", c.c_int), ("backdrop", c.c_bool), ("data", c.c_char_p), ("json", c.c_char_p), ("lpips", c.c_char_p),
                ("cookie_", c.c_uint32)]


class CBallsView(c.Structure):
    _fields_ = [("count", c.c_size_t), ("position", c.c_void_p), ("radius", c.c_void_p), ("anchors", c.c_bool)]


class CAnswers(c.Structure):
    _fields_ = [("count", c.c_size_t), ("first", c.c_void_p), ("index", c.c_void_p), ("value", c.c_void_p)]


STRUCTS = {"gbt_error": CError, "gbt_camera": CCamera, "gbt_gaussians": CGaussians, "gbt_gaussians_gradient": CGaussiansGradient,
           "gbt_model_info": CModelInfo, "gbt_model_settings": CModelSettings, "gbt_model_view": CModelView, "gbt_picture": CPicture,
           "gbt_comparison": CComparison, "gbt_evaluate_def": CEvaluateDef, "gbt_export_def": CExportDef,
           "gbt_balls_view": CBallsView, "gbt_answers": CAnswers}

# name: result, arguments. "status": the last argument is the error, which call() adds.
pointer, text, number = c.c_void_p, c.c_char_p, c.c_size_t
FUNCTIONS = {
    "gbt_version": (text, []),
    "gbt_set_threads": (None, [c.c_int]),
    "gbt_camera_model_count": (c.c_int, []),
    "gbt_camera_model_at": (c.c_int, [c.c_int]),
    "gbt_camera_model_name": (text, [c.c_int]),
    "gbt_camera_param_names": (text, [c.c_int]),
    "gbt_camera_param_count": (c.c_int, [c.c_int]),
    "gbt_camera_look_at": (c.c_bool, [c.c_double * 3, c.c_double * 3, c.c_double * 3, c.POINTER(CCamera)]),
    "gbt_camera_moved": (CCamera, [c.POINTER(CCamera), c.c_double * 6]),
    "gbt_camera_resized": (CCamera, [c.POINTER(CCamera), c.c_int, c.c_int]),
    "gbt_model_open": ("status", [text, c.POINTER(pointer)]),
    "gbt_model_from_gaussians": ("status", [c.POINTER(CGaussians), c.POINTER(pointer)]),
    "gbt_model_set_gaussians": ("status", [pointer, c.POINTER(CGaussians)]),
    "gbt_model_get_gaussians": ("status", [pointer, pointer, pointer, pointer, pointer, pointer]),
    "gbt_model_close": (None, [pointer]),
    "gbt_model_get_info": (CModelInfo, [pointer]),
    "gbt_model_get_settings": (CModelSettings, [pointer]),
    "gbt_model_set_settings": ("status", [pointer, c.POINTER(CModelSettings)]),
    "gbt_model_open_views": ("status", [pointer, text, c.POINTER(number)]),
    "gbt_model_get_view": ("status", [pointer, number, c.POINTER(CModelView)]),
    "gbt_model_render": ("status", [pointer, c.POINTER(CCamera), c.c_bool, c.POINTER(CPicture)]),
    "gbt_model_gradient": ("status", [pointer, pointer, c.POINTER(c.c_double), c.POINTER(CGaussiansGradient)]),
    "gbt_balls_open": ("status", [text, c.POINTER(pointer)]),
    "gbt_balls_from_arrays": ("status", [pointer, pointer, number, c.POINTER(pointer)]),
    "gbt_balls_free": (None, [pointer]),
    "gbt_balls_get": (CBallsView, [pointer]),
    "gbt_balls_nearest": ("status", [pointer, pointer, number, number, c.c_bool, pointer, pointer]),
    "gbt_balls_within": ("status", [pointer, pointer, pointer, number, c.POINTER(CAnswers)]),
    "gbt_balls_containing": ("status", [pointer, pointer, number, c.POINTER(CAnswers)]),
    "gbt_balls_overlapping": ("status", [pointer, pointer, pointer, number, c.POINTER(CAnswers)]),
    "gbt_balls_crossed": ("status", [pointer, pointer, pointer, pointer, pointer, number, c.POINTER(CAnswers)]),
    "gbt_answers_free": (None, [c.POINTER(CAnswers)]),
    "gbt_train_with": ("status", [text, text, text]),
    "gbt_evaluate_def_default": (CEvaluateDef, []),
    "gbt_evaluate": ("status", [text, c.POINTER(CEvaluateDef)]),
    "gbt_export_def_default": (CExportDef, []),
    "gbt_export": ("status", [text, c.POINTER(CExportDef), c.POINTER(text), number, pointer]),
    "gbt_compare_images": ("status", [text, text, text, c.POINTER(CComparison)]),
    "gbt_compare_pictures": ("status", [pointer, pointer, c.c_int, c.c_int, c.POINTER(CComparison)]),
}


def _load():
    """The library in GBTRACE_LIBRARY, else the one in this package, else the system's."""
    own = Path(__file__).with_name("libgbtrace.so")
    path = os.environ.get("GBTRACE_LIBRARY") or (str(own) if own.exists() else "libgbtrace.so.1")
    try:
        library = c.CDLL(path)
    except OSError as error:
        raise ImportError(f"libgbtrace: {error} (wanted gbtrace's Debian package, or the path of libgbtrace.so in GBTRACE_LIBRARY)") from None
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(library, name, None)
        if function is None:
            raise ImportError(f"{path}: has no {name} (wanted the library of this package's version, got an older one or another library)")
        failing = result == "status"
        function.restype = c.c_int if failing else result
        function.argtypes = arguments + [c.POINTER(CError)] if failing else arguments
    return library


library = _load()


def call(name, *arguments):
    """Call a function that returns a status; raise what it says."""
    error = CError()
    status = getattr(library, name)(*arguments, c.byref(error))
    if status == INTERRUPTED:
        raise KeyboardInterrupt(error.text.decode("utf-8", "replace"))
    if status != 0:
        raise EXCEPTIONS.get(status, Error)(error.text.decode("utf-8", "replace") or name + " failed")


def encode(path):
    """A path as C has it, which ends at the first NUL."""
    encoded = os.fsencode(path)
    if b"\0" in encoded:
        raise ValueError(f"{path!r}: a NUL in a path")
    return encoded


def optional(path):
    """A path that may be None."""
    return None if path is None else encode(path)


def wanted(value, name, kind, hint=""):
    """TypeError unless `value` is a `kind`."""
    if not isinstance(value, kind):
        raise TypeError(f"{name}: {type(value).__name__} (wanted a gbtrace.{kind.__name__}{hint})")
    return value


def address(array, name, shape, writable=False):
    """Where an array's floats are. It is used in place, so it has to be what the library reads: nothing is converted behind your back."""
    import numpy as np

    if not isinstance(array, np.ndarray) or array.dtype != np.float32:
        raise TypeError(f"{name}: {getattr(array, 'dtype', type(array).__name__)} (wanted a NumPy array of float32)")
    if array.shape != tuple(shape):
        raise ValueError(f"{name}: shape {array.shape} (wanted {tuple(shape)})")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name}: not contiguous (wanted C order; numpy.ascontiguousarray() copies it)")
    if not array.flags.aligned:
        raise ValueError(f"{name}: not aligned (its .copy() is)")
    if writable and not array.flags.writeable:
        raise ValueError(f"{name}: read-only")
    return array.ctypes.data


def version():
    """The version of the library that runs."""
    return library.gbt_version().decode()


def whole_number(value, name, least, most=2**31 - 1):
    """As C's int, which ctypes would take modulo 2^32."""
    if not least <= index(value) <= most:
        raise ValueError(f"{name}: {value} (wanted {least} to {most})")
    return index(value)


def set_threads(threads):
    """Threads for everything that follows, 1 to 1024; without this, all processors of this process."""
    library.gbt_set_threads(whole_number(threads, "threads", 1, 1024))
