# SPDX-License-Identifier: Apache-2.0
"""bench/mitsuba_scene.py -- load one scene folder as arrays and into Mitsuba, and evaluate single rays in double by Mitsuba's own equation."""
import json
import os

import drjit as dr
import mitsuba as mi
import numpy as np

SH0 = 0.28209479177387814
EXTENT = 3.0           # radius of the proxies in standard deviations
ALPHA_MIN = 0.01       # with adaptive clamping the proxy ends where the response falls to this value
ALPHA_MAX = 0.9999     # this and the next three are constants of Mitsuba's source
T_MIN = 0.01
STEP = 1e-4
NEAR = 0.01


def read_ply(path):
    """The vertex properties of a binary 3DGS file, by name."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    lines = data[:end].decode("ascii").split("\n")
    if "format binary_little_endian 1.0" not in lines:
        raise SystemExit(f"error: {path}: wanted a binary_little_endian PLY")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex "))
    names = [line.split()[2] for line in lines if line.startswith("property float ")]
    if len(names) != sum(line.startswith("property ") for line in lines):
        raise SystemExit(f"error: {path}: wanted only properties of type float")
    values = np.frombuffer(data, "<f4", count * len(names), end).reshape(count, len(names))
    return {name: values[:, i] for i, name in enumerate(names)}


def load_arrays(folder):
    """centers [N,3], scales [N,3] (linear), quats [N,4] (x, y, z, w), opacities [N,1], sh [N,3] of degree 0; float32."""
    names = ("centers", "scales", "quats_xyzw", "opacities", "sh3")
    files = [os.path.join(folder, name + ".npy") for name in names]
    if all(os.path.exists(file) for file in files):
        centers, scales, quats, opacities, sh = (np.load(file) for file in files)
        sh = sh[:, :3]
    else:
        ply = read_ply(os.path.join(folder, "scene.ply"))

        def columns(*wanted):
            return np.stack([ply[name] for name in wanted], 1).astype(np.float64)

        centers, scales = columns("x", "y", "z"), np.exp(columns("scale_0", "scale_1", "scale_2"))
        quats = columns("rot_1", "rot_2", "rot_3", "rot_0")
        quats /= np.linalg.norm(quats, axis=1, keepdims=True)
        opacities, sh = 1 / (1 + np.exp(-columns("opacity"))), columns("f_dc_0", "f_dc_1", "f_dc_2")
    return tuple(np.ascontiguousarray(array, np.float32) for array in (centers, scales, quats, opacities.reshape(-1, 1), sh))


def load_camera(folder):
    with open(os.path.join(folder, "camera.json")) as file:
        return json.load(file)


def make_scene(arrays, adaptive):
    centers, scales, quats, opacities, sh = (mi.TensorXf(array) for array in arrays)
    return mi.load_dict({"type": "scene", "gaussians": {
        "type": "ellipsoids", "centers": centers, "scales": scales, "quaternions": quats, "opacities": opacities, "sh_coeffs": sh,
        "extent": EXTENT, "extent_adaptive_clamping": adaptive}})


def make_sensor(camera, width, height):
    to_world = mi.ScalarTransform4f().look_at(origin=camera["origin"], target=camera["target"], up=camera["up"])
    return mi.load_dict({
        "type": "perspective", "fov": camera["fov_x_deg"], "fov_axis": "x", "near_clip": NEAR, "far_clip": 1e4, "to_world": to_world,
        "sampler": {"type": "stratified", "sample_count": 1, "jitter": False},
        "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb", "component_format": "float32",
                 "rfilter": {"type": "box"}}})


def make_integrator():
    return mi.load_dict({"type": "volprim_rf_basic", "max_depth": -1, "srgb_primitives": False})


def render(scene, sensor, integrator):
    image = mi.render(scene, integrator=integrator, sensor=sensor, spp=1, seed=0)
    dr.eval(image)
    dr.sync_thread()
    return image


class Step:
    """Render, and compute the gradients of the squared error: the work of a training step."""

    def __init__(self, scene, sensor, integrator):
        self.scene, self.sensor, self.integrator = scene, sensor, integrator
        self.params = mi.traverse(scene)
        self.keys = [key for key in self.params.keys() if key.split(".")[-1] in ("data", "opacities", "sh_coeffs")]

    def run(self):
        for key in self.keys:
            dr.enable_grad(self.params[key])
        image = mi.render(self.scene, self.params, integrator=self.integrator, sensor=self.sensor, spp=1, seed=0)
        dr.backward(dr.mean(dr.square(image - 0.25), axis=None))
        gradients = [dr.grad(self.params[key]) for key in self.keys]
        dr.eval(gradients)
        dr.sync_thread()
        for key in self.keys:
            dr.disable_grad(self.params[key])
        return gradients


def pixel_rays(camera, width, height, pixels):
    """Rays of Mitsuba's camera through the centres of `pixels` [n,2] (x right, y down): origins on the near plane, unit directions."""
    origin, target, up = (np.array(camera[key], np.float64) for key in ("origin", "target", "up"))
    forward = (target - origin) / np.linalg.norm(target - origin)
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    tan = np.tan(np.radians(camera["fov_x_deg"]) / 2)
    side = (2 * (pixels[:, :1] + 0.5) / width - 1) * tan
    down = (2 * (pixels[:, 1:] + 0.5) / height - 1) * tan * height / width
    direction = forward - side * left - down * np.cross(forward, left)
    near = origin + direction * NEAR
    return near, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def evaluate(arrays, adaptive, origins, directions):
    """Colours [n,3] in double, as Mitsuba intends: blend by entry distance, skip entries within STEP behind another one, stop at T_MIN."""
    centers, scales, quats, opacities, sh = (array.astype(np.float64) for array in arrays)
    x, y, z, w = quats.T
    rotation = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                         2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1).reshape(-1, 3, 3)
    opacity = opacities[:, 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        extent = np.sqrt(2 * np.log(opacity / ALPHA_MIN)) * EXTENT / 3 if adaptive else np.full(len(opacity), EXTENT)
    extent = np.nan_to_num(extent)
    color = np.maximum(0, 0.5 + SH0 * sh)
    reach2 = (extent * scales.max(1)) ** 2 * 1.0001 + 1e-12
    out = np.zeros((len(origins), 3))
    for begin in range(0, len(origins), 16): # a few rays at a time, since [rays, Gaussians] must fit into memory
        to_center = centers - origins[begin] # the near plane is so close that one origin will do for choosing candidates
        distance2 = (to_center ** 2).sum(1)
        slack = np.linalg.norm(origins[begin:begin + 16] - origins[begin], axis=1).max()
        along = directions[begin:begin + 16] @ to_center.T
        near = distance2 - along ** 2 <= (np.sqrt(reach2) + slack) ** 2
        for k, who in enumerate(near):
            i = np.flatnonzero(who)
            origin, direction = origins[begin + k], directions[begin + k]
            o = np.einsum("nji,nj->ni", rotation[i], origin - centers[i]) / scales[i]
            d = np.einsum("nji,j->ni", rotation[i], direction) / scales[i]
            dd = (d * d).sum(1)
            peak = -(o * d).sum(1) / dd
            d2 = ((o + peak[:, None] * d) ** 2).sum(1)
            inside = d2 < extent[i] ** 2
            i, d2, entry = i[inside], d2[inside], peak[inside] - np.sqrt((extent[i[inside]] ** 2 - d2[inside]) / dd[inside])
            alpha = np.minimum(opacity[i] * np.exp(-0.5 * d2), ALPHA_MAX)
            transmittance, start = 1.0, 0.0
            for hit in np.argsort(entry, kind="stable"):
                if entry[hit] < start:
                    continue
                out[begin + k] += transmittance * alpha[hit] * color[i[hit]]
                transmittance *= 1 - alpha[hit]
                start = entry[hit] + STEP
                if transmittance <= T_MIN:
                    break
    return out
