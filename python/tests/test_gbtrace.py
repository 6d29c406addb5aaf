# SPDX-License-Identifier: Apache-2.0
"""The Python package on a small model: GBT_MODEL is a run, GBT_INCLUDE the headers, GBT_SCRATCH a folder to write into."""
import copy
import ctypes
import os
import subprocess
import sys
import threading
import unittest
import unittest.mock
from pathlib import Path

import gbtrace
import numpy as np
from gbtrace import _library

MODEL, SCRATCH = os.environ["GBT_MODEL"], Path(os.environ["GBT_SCRATCH"])


def some_gaussians(count=50, degree=2, seed=1):
    random = np.random.default_rng(seed)
    return gbtrace.Gaussians(*(a.astype(np.float32) for a in (
        random.normal(0, 0.5, (count, 3)), random.normal(-1.5, 0.3, (count, 3)), random.normal(0, 1, (count, 4)), random.uniform(0.2, 0.9, count),
        random.normal(0, 0.3, (count, (degree + 1) ** 2, 3)))))


def a_camera(width=40, height=30):
    return gbtrace.Camera.pinhole(width, height, 50).looking_at((0.3, -0.4, -3), (0, 0, 0))


class Structs(unittest.TestCase):
    def test_every_field_is_where_c_has_it(self):
        lines = []
        for name, struct in _library.STRUCTS.items():
            lines.append(f'printf("%s. %zu\\n", "{name}", sizeof({name}));')
            lines += [f'printf("%s.%s %zu\\n", "{name}", "{field}", offsetof({name}, {field}));' for field, _ in struct._fields_]
        headers = "\n".join(f'#include "gbtrace/{h}.h"' for h in ("camera", "evaluate", "export", "model", "query", "status"))
        source, program = SCRATCH / "layout.c", SCRATCH / "layout"
        source.write_text(f"#include <stddef.h>\n#include <stdio.h>\n{headers}\nint main(void)\n{{\n" + "\n".join(lines) + "\nreturn 0;\n}\n")
        subprocess.run(["cc", "-I", os.environ["GBT_INCLUDE"], str(source), "-o", str(program)], check=True)
        got = []
        for name, struct in _library.STRUCTS.items():
            got.append(f"{name}. {ctypes.sizeof(struct)}")
            got += [f"{name}.{field} {getattr(struct, field).offset}" for field, _ in struct._fields_]
        self.assertEqual(subprocess.run([str(program)], check=True, capture_output=True, text=True).stdout.split("\n")[:-1], got)


class Balls(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(3)
        self.position = random.uniform(-1, 1, (400, 3)) + (5e6, 0, 0)
        self.radius = random.uniform(0, 0.2, 400)
        self.points = random.uniform(-1, 1, (60, 3)) + (5e6, 0, 0)
        self.balls = gbtrace.Balls.from_arrays(self.position, self.radius)
        self.distance = np.linalg.norm(self.position[None] - self.points[:, None], axis=2)

    def test_nearest(self):
        index, distance = self.balls.nearest(self.points, k=5)
        np.testing.assert_array_equal(index, np.argsort(self.distance, axis=1)[:, :5])
        np.testing.assert_allclose(distance, np.sort(self.distance, axis=1)[:, :5], rtol=1e-12)
        self.assertFalse((self.balls.nearest(self.balls.position, skip_same=True)[0][:, 0] == np.arange(400)).any())
        index, distance = gbtrace.Balls.from_arrays(np.zeros((1, 3))).nearest([[0, 3, 4]], k=2)
        self.assertEqual((index.tolist(), distance.tolist()), ([[0, 2**32 - 1]], [[5, np.inf]]))

    def test_lists(self):
        for answers, wanted in ((self.balls.within(self.points, 0.4), self.distance <= 0.4),
                                (self.balls.containing(self.points), self.distance <= self.radius),
                                (self.balls.overlapping(self.points, 0.3), self.distance <= self.radius + 0.3)):
            self.assertEqual(len(answers), 60)
            for i in range(60):
                np.testing.assert_array_equal(answers[i], np.flatnonzero(wanted[i]))
                np.testing.assert_array_equal(answers[i - 60], answers[i])
            self.assertEqual([which.tolist() for which in answers], [answers[i].tolist() for i in range(60)])
            np.testing.assert_array_equal(np.repeat(np.arange(60), np.diff(answers.first)), np.nonzero(wanted)[0])
            for i in (60, -61):
                with self.assertRaisesRegex(IndexError, rf"query {i} \(there are 60\)"):
                    answers[i]

    def test_rays(self):
        m = self.position[None] - self.points[:, None]
        for t_max in (np.inf, 0.5):
            t = np.clip(m[:, :, 2], 0, t_max)
            away = np.linalg.norm(m - t[:, :, None] * (0, 0, 1), axis=2)
            answers = self.balls.crossed(self.points, np.tile((0.0, 0, 1), (60, 1)), t_max=t_max)
            for i in range(60):
                np.testing.assert_array_equal(answers[i], np.flatnonzero(away[i] <= self.radius))

    def test_anchors_of_a_run(self):
        balls, info = gbtrace.Balls(MODEL), gbtrace.Model(MODEL).info
        self.assertTrue(balls.anchors)
        self.assertEqual(len(balls), info.anchors)
        self.assertTrue((balls.radius > 0).all())
        np.testing.assert_array_equal(balls.position.min(axis=0), info.low)

    def test_no_copies(self):
        with self.assertRaisesRegex(TypeError, "a gbtrace.Balls cannot be copied or pickled"):
            copy.copy(self.balls)

    def test_what_is_refused(self):
        with self.assertRaisesRegex(ValueError, r"points: shape \(3,\) \(wanted \(count, 3\)\)"):
            self.balls.nearest([1, 2, 3])
        with self.assertRaisesRegex(gbtrace.ArgumentError, "query 1: points: bad query"):
            self.balls.containing([[0, 0, 0], [0, np.nan, 0]])
        with self.assertRaisesRegex(gbtrace.ArgumentError, "point 0: bad radius"):
            gbtrace.Balls.from_arrays(np.zeros((1, 3)), -1)
        with self.assertRaises(gbtrace.FileError):
            gbtrace.Balls("/nowhere/run")


class Library(unittest.TestCase):
    def said(self, library):
        """The last line of importing the package with another library."""
        got = subprocess.run([sys.executable, "-c", "import gbtrace"], env={**os.environ, "GBTRACE_LIBRARY": library}, capture_output=True, text=True)
        self.assertNotEqual(got.returncode, 0)
        return got.stderr.strip().split("\n")[-1]

    def test_an_older_library_is_said(self):
        source, library = SCRATCH / "old.c", SCRATCH / "libold.so"
        source.write_text('const char *gbt_version(void);\nconst char *gbt_version(void) { return "0.0.1"; }\n')
        subprocess.run(["cc", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
        self.assertRegex(self.said(str(library)), r"^ImportError: .*libold\.so: has no gbt_\w+ \(wanted the library of this package's version")

    def test_no_library_is_said(self):
        self.assertRegex(self.said("/nowhere/libgbtrace.so"), r"^ImportError: libgbtrace: /nowhere/libgbtrace\.so: .*GBTRACE_LIBRARY")


class Cameras(unittest.TestCase):
    def test_arrays_are_views(self):
        camera = a_camera()
        camera.center[2] = -5
        self.assertEqual(camera.center.tolist(), camera._c.center[:])
        self.assertEqual((camera.model, camera.width, camera.height, camera.params.shape), ("PINHOLE", 40, 30, (4,)))

    def test_parts_can_be_set(self):
        camera = a_camera()
        camera.center, camera.params, camera.rotation = (1, 2, 3), (30, 31, 20, 15), np.eye(3)[::-1]
        self.assertEqual((camera._c.center[:], camera._c.params[:4], camera._c.rotation[2]), ([1, 2, 3], [30, 31, 20, 15], 1))
        with self.assertRaisesRegex(AttributeError, "centre"):
            camera.centre = (1, 2, 3)
        before = bytes(camera._c)
        for name, value in (("center", 1), ("center", [1]), ("center", [[1, 2, 3]]), ("params", [30]), ("rotation", 1), ("rotation", [1, 0, 0]), ("motion", 0)):
            with self.assertRaisesRegex(ValueError, f"^{name}: shape .* .wanted "):
                setattr(camera, name, value)
        with self.assertRaisesRegex(ValueError, "^rotation: shape .3,. .wanted .3, 3.."):
            gbtrace.Camera("PINHOLE", 40, 30, (30, 30, 20, 15), rotation=[1, 0, 0])
        self.assertEqual(bytes(camera._c), before)

    def test_copies_have_their_own_memory(self):
        camera = a_camera()
        for made in (copy.copy(camera), copy.deepcopy(camera)):
            made.center[2] = 7
            self.assertEqual((made.width, made.params.tolist()), (40, camera.params.tolist()))
            self.assertNotEqual(camera.center[2], 7)

    def test_one_focal_length_keeps_the_shape(self):
        camera = gbtrace.Camera("SIMPLE_RADIAL", 640, 480, (500, 320, 240, 0.1))
        for width, height in ((320, 240), (213, 160)):
            self.assertEqual(camera.resized(width, height).width, width)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "SIMPLE_RADIAL has one focal length, 640 x 480 pixels cannot become 512 x 512"):
            camera.resized(512, 512)
        self.assertEqual(a_camera().resized(512, 512).height, 512)

    def test_moved_and_back(self):
        camera, motion = a_camera(), np.array([0.1, 0.2, 0.3, 0.1, -0.2, 0.05])
        moved = camera.moved(motion)
        np.testing.assert_allclose(moved.center, camera.center + camera.rotation.T @ motion[:3], atol=1e-14)
        np.testing.assert_allclose(moved.distance(camera)[1], np.linalg.norm(motion[3:]), atol=1e-12)
        np.testing.assert_allclose(moved.moved([0, 0, 0, *-motion[3:]]).rotation, camera.rotation, atol=1e-14)
        turned = camera.moved([0, 0, 0, 0, 0.1, 0])  # about down, right-handed: forward turns to the right
        self.assertGreater(turned.rotation[2] @ camera.rotation[0], 0.09)

    def test_a_rolling_shutter(self):
        """The middle row is what a still camera sees; the first is what it sees after half of the motion, backwards."""
        camera, motion = a_camera(), np.array([0.2, 0.1, -0.1, 0.02, 0.05, -0.03])
        self.assertEqual((camera.shutter, camera.motion.tolist()), ("global", [0] * 6))
        rolling = camera.moved([0] * 6)
        rolling.shutter, rolling.motion = "rows", motion
        self.assertEqual((rolling.shutter, rolling._c.motion[:]), ("rows", motion.tolist()))
        with gbtrace.Model(MODEL) as model:
            picture, rows = model.render(rolling), camera.height
            for row in (0, rows // 2, rows - 1):
                there = model.render(camera.moved(((row + 0.5) / rows - 0.5) * motion))
                self.assertLess(abs(picture[row] - there[row]).max(), 0.02)
            self.assertGreater(abs(picture[0] - model.render(camera)[0]).max(), 0.05)
        with self.assertRaisesRegex(ValueError, "wanted one of global, rows, columns"):
            rolling.shutter = "up"

    def test_what_is_wrong_is_said(self):
        with self.assertRaisesRegex(ValueError, "OPENCV_FISHEYE"):
            gbtrace.Camera("FISHY", 4, 4)
        with self.assertRaisesRegex(ValueError, "wanted 4 for PINHOLE"):
            gbtrace.Camera("PINHOLE", 4, 4, (1, 2))
        for width, height, says in ((2**32 + 4, 4, "width: 4294967300"), (4, -1, r"height: -1 \(wanted 0 to 2147483647\)")):
            with self.assertRaisesRegex(ValueError, says):
                gbtrace.Camera("PINHOLE", width, height, (1, 1, 1, 1))
        for angle in (0, -60, 180, np.nan):
            with self.assertRaisesRegex(ValueError, r"fov_x_deg: .* \(wanted above 0 and below 180\)"):
                gbtrace.Camera.pinhole(4, 4, angle)
        for width, height, says in ((0, 0, r"width: 0 \(wanted 1 to"), (4, -1, "height: -1"), (2**32 + 4, 4, "width: 4294967300")):
            with self.assertRaisesRegex(ValueError, says):
                a_camera().resized(width, height)
        self.assertEqual(a_camera().resized(np.int64(20), 15).width, 20)
        with self.assertRaisesRegex(ValueError, "target"):
            a_camera().looking_at((0, 0, 0), (0, 0, 0))
        with self.assertRaisesRegex(ValueError, "a value is not finite"):
            a_camera().looking_at((0, 0, np.nan), (0, 0, 0))
        with self.assertRaisesRegex(ValueError, "gaussians: 4294967296"):
            gbtrace.export("RUN", "scene.ply", gaussians=2**32)
        for threads in (0, 1025, 2**32):
            with self.assertRaisesRegex(ValueError, f"threads: {threads} .wanted 1 to 1024"):
                gbtrace.set_threads(threads)


class Trained(unittest.TestCase):
    def setUp(self):
        self.model = gbtrace.Model(MODEL)

    def test_info_and_views(self):
        info, views = self.model.info, self.model.views()
        self.assertTrue(info.anchors > 0 and info.sh_degree == -1 and info.gaussians >= info.anchors)
        self.assertTrue(all(low < high for low, high in zip(info.low, info.high)))
        self.assertTrue(any(v.held_out for v in views) and not all(v.held_out for v in views))
        self.assertEqual([v.name for v in views], sorted(v.name for v in views))
        self.assertTrue(all(0 < v.t_near <= self.model.settings.t_near for v in views))

    def test_no_copies(self):
        with self.assertRaisesRegex(TypeError, "a gbtrace.Model cannot be copied or pickled"):
            copy.copy(self.model)

    def test_an_interrupted_close_frees_once(self):
        handles = []

        def interrupted(handle):
            handles.append(handle.value)
            raise KeyboardInterrupt

        model = gbtrace.Model(MODEL)
        with unittest.mock.patch.object(_library.library, "gbt_model_close", interrupted):
            with self.assertRaises(KeyboardInterrupt):
                model.close()
            del model
        self.assertEqual(len(handles), 1)
        _library.library.gbt_model_close(handles[0])

    def test_arrays_are_written_in_place(self):
        camera = self.model.views()[0].camera
        rgb = np.full((camera.height, camera.width, 3), -1, np.float32)
        depth, clear = np.full(rgb.shape[:2], -1, np.float32), np.full(rgb.shape[:2], -1, np.float32)
        at = rgb.ctypes.data
        self.assertIs(self.model.render(camera, rgb, depth, clear), rgb)
        self.assertEqual(rgb.ctypes.data, at)
        self.assertEqual(_library.address(rgb, "rgb", rgb.shape), at)
        self.assertTrue((rgb >= 0).all() and (depth >= 0).all() and (clear >= 0).all() and (clear <= 1).all() and clear.min() < 0.1)
        np.testing.assert_array_equal(self.model.render(camera), rgb)

    def test_wrong_arrays(self):
        camera = a_camera()
        for array, error, says in ((np.zeros((30, 40, 3)), TypeError, "float64"), ([1], TypeError, "list"),
                                   (np.zeros((40, 30, 3), np.float32), ValueError, r"\(40, 30, 3\) \(wanted \(30, 40, 3\)"),
                                   (np.zeros((3, 40, 30), np.float32).transpose(2, 1, 0), ValueError, "contiguous")):
            with self.assertRaisesRegex(error, says):
                self.model.render(camera, array)
        frozen = np.zeros((30, 40, 3), np.float32)
        frozen.flags.writeable = False
        with self.assertRaisesRegex(ValueError, "read-only"):
            self.model.render(camera, frozen)

    def test_errors_are_the_library_s_one_line(self):
        with self.assertRaises(gbtrace.FileError) as caught:
            gbtrace.Model("/nowhere/model.gbt")
        self.assertIn("/nowhere/model.gbt", str(caught.exception))
        self.assertIsInstance(caught.exception, OSError)
        with self.assertRaisesRegex(ValueError, "keep"):
            self.model.gradient(np.zeros((30, 40, 3), np.float32))
        camera = a_camera()
        picture = self.model.render(camera, keep=True)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "networks"):
            self.model.gradient(picture, gaussians=True)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "finite"):
            self.model.gradient(picture * np.nan)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "networks"):
            self.model.gaussians()
        self.assertEqual(self.model.gradient(picture, gaussians=False).shape, (6,))
        with self.assertRaisesRegex(gbtrace.ArgumentError, "keep"):
            self.model.gradient(picture)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "camera"):
            self.model.render(gbtrace.Camera("PINHOLE", 4, 4, (0, 0, 0, 0)))
        self.model.close()
        with self.assertRaisesRegex(ValueError, "closed"):
            self.model.render(camera)

    def test_what_is_no_camera_or_path(self):
        view = self.model.views()[0]
        for wrong in (view, None, "camera.json", 0):
            with self.assertRaisesRegex(TypeError, r"camera: \w+ \(wanted a gbtrace\.Camera; that of a View is its \.camera\)"):
                self.model.render(wrong)
        with self.assertRaisesRegex(TypeError, r"other: View \(wanted a gbtrace\.Camera"):
            view.camera.distance(view)
        with self.assertRaisesRegex(TypeError, r"settings: dict \(wanted a gbtrace\.Settings, as model\.settings\._replace"):
            self.model.settings = {"footprint": 0}
        with self.assertRaisesRegex(AttributeError, "setings"):
            self.model.setings = self.model.settings
        for wrong in (gbtrace.Model, gbtrace.evaluate, gbtrace.export):
            with self.assertRaisesRegex(TypeError, "NoneType"):
                wrong(None)
            with self.assertRaisesRegex(ValueError, "a NUL in a path"):
                wrong(MODEL + "\0.bak")

    def test_settings(self):
        camera = a_camera(8, 8).looking_at((0, 0, 1e4), (0, 0, 2e4))  # nothing there
        self.model.settings = self.model.settings._replace(background=(0.25, 0.5, 1))
        np.testing.assert_array_equal(self.model.render(camera)[0, 0], np.float32((0.25, 0.5, 1)))
        with self.assertRaisesRegex(gbtrace.ArgumentError, "footprint"):
            self.model.settings = self.model.settings._replace(footprint=-1)
        for background in ((), (0.5, 0.5), (0, 0, 0, 1)):
            with self.assertRaisesRegex(ValueError, r"background: .* \(wanted red, green and blue\)"):
                self.model.settings = self.model.settings._replace(background=background)

    def test_models_on_threads(self):
        camera = self.model.views()[0].camera
        wanted, got = self.model.render(camera), {}

        def work(key):
            with gbtrace.Model(MODEL) as model:
                got[key] = model.render(camera)

        threads = [threading.Thread(target=work, args=(i,)) for i in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for picture in got.values():
            np.testing.assert_array_equal(picture, wanted)
        self.assertEqual(len(got), 3)


class Plain(unittest.TestCase):
    def test_gradients_go_into_arrays(self):
        g = some_gaussians()
        model, camera = gbtrace.Model.from_gaussians(*g), a_camera()
        self.assertEqual((model.info.gaussians, model.info.anchors, model.info.sh_degree), (50, 0, 2))
        model.render(camera, keep=True)
        d_rgb = np.random.default_rng(2).normal(0, 1, (30, 40, 3)).astype(np.float32)
        pose, gradient = model.gradient(d_rgb, gaussians=True)
        self.assertEqual([a.shape for a in gradient], [a.shape for a in g])
        self.assertTrue(all(np.isfinite(a).all() and np.abs(a).max() > 0 for a in gradient) and np.abs(pose).min() > 0)
        np.testing.assert_allclose((gradient.quat * g.quat).sum(1), 0, atol=1e-4)
        mean = np.full_like(g.mean, 7)
        model.render(camera, keep=True)
        again, filled = model.gradient(d_rgb, gbtrace.Gaussians(mean, None, None, None, None))
        self.assertIs(filled.mean, mean)
        np.testing.assert_array_equal(mean, gradient.mean)
        np.testing.assert_array_equal(again, pose)

    def test_wrong_gradients(self):
        model = gbtrace.Model.from_gaussians(*some_gaussians())
        d_rgb = np.ones_like(model.render(a_camera(), keep=True))
        with self.assertRaisesRegex(TypeError, r"gaussians: int \(wanted a gbtrace\.Gaussians, or True\)"):
            model.gradient(d_rgb, gaussians=5)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "range of float"):
            model.gradient(3e38 * d_rgb)

    def test_gaussians_can_be_had(self):
        g = some_gaussians()
        model, camera = gbtrace.Model.from_gaussians(*g), a_camera()
        picture, got = model.render(camera), model.gaussians()
        np.testing.assert_allclose(got.quat, g.quat / np.linalg.norm(g.quat, axis=1, keepdims=True), atol=1e-6)
        np.testing.assert_allclose(got.mean, g.mean, atol=1e-6)
        for name in ("scale_log", "opacity", "sh"):
            np.testing.assert_array_equal(getattr(got, name), getattr(g, name))
        model.set_gaussians(*got)
        np.testing.assert_allclose(model.render(camera), picture, atol=0.01)

    def test_descent_brings_the_picture_nearer(self):
        g, camera = some_gaussians(), a_camera()
        model = gbtrace.Model.from_gaussians(*g)
        wanted = gbtrace.Model.from_gaussians(*some_gaussians(seed=1)._replace(opacity=g.opacity * 0.5)).render(camera)
        losses = []
        for _ in range(20):
            difference = model.render(camera, keep=True) - wanted
            losses.append(float((difference**2).mean()))
            _, gradient = model.gradient(2 * difference, gaussians=True)
            g.opacity[:] = np.clip(g.opacity - 0.01 * np.sign(gradient.opacity), 0, 1)
            model.set_gaussians(*g)
        self.assertLess(losses[-1], 0.3 * losses[0])

    def test_wrong_gaussians(self):
        g = some_gaussians()
        for field, value, error, says in (("mean", g.mean[:7], ValueError, "scale_log: shape"), ("opacity", g.opacity + 2, gbtrace.ArgumentError, "opacity of Gaussian 0"),
                                          ("quat", g.quat * 0, gbtrace.ArgumentError, "quat of Gaussian 0"), ("sh", g.sh[:, :5], ValueError, "wanted .count, 1, 4, 9 or 16"),
                                          ("mean", g.mean * np.float32(np.nan), gbtrace.ArgumentError, "mean of Gaussian 0"), ("sh", g.sh.tolist(), TypeError, "sh: list"),
                                          ("mean", None, TypeError, "mean: NoneType"), ("opacity", 0.5, TypeError, "opacity: float")):
            with self.assertRaisesRegex(error, says):
                gbtrace.Model.from_gaussians(*g._replace(**{field: value}))


class Runs(unittest.TestCase):
    def test_evaluate_writes_where_it_is_told(self):
        path = SCRATCH / "scores.json"
        gbtrace.evaluate(MODEL, json=path)
        self.assertEqual(path.read_bytes(), (Path(MODEL) / "metrics.json").read_bytes())

    def test_export_and_open_again(self):
        path = SCRATCH / "plain.ply"
        gbtrace.export(MODEL, path, refine_steps=0, sh_degree=1)
        model = gbtrace.Model(path)
        self.assertEqual((model.info.anchors, model.info.sh_degree), (0, 1))
        camera = gbtrace.Model(MODEL).views()[0].camera
        trained = gbtrace.Model(MODEL)
        model.settings = trained.settings  # the background that files of plain Gaussians do not keep
        both = gbtrace.compare(model.render(camera), trained.render(camera))
        self.assertGreater(both.psnr, 28)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "xyz"):
            gbtrace.export(MODEL, SCRATCH / "scene.xyz")

    def test_compare(self):
        a = np.random.default_rng(3).uniform(0, 1, (20, 24, 3)).astype(np.float32)
        self.assertEqual(gbtrace.compare(a, a), (100, 1, 1, 0))
        self.assertLess(gbtrace.compare(a, np.float32(1) - a).psnr, 10)
        with self.assertRaisesRegex(ValueError, "reference: shape"):
            gbtrace.compare(a, a[:10])
        b = a.copy()
        b[3, 5, 1] = np.nan
        with self.assertRaisesRegex(ValueError, "reference: nan at pixel 5, 3"):
            gbtrace.compare(a, b)

    def test_settings_of_training_are_checked(self):
        with self.assertRaisesRegex(gbtrace.FormatError, "settings:1"):
            gbtrace.train("/nowhere", SCRATCH / "run", no_such_setting=3)
        with self.assertRaises(gbtrace.Error):
            gbtrace.train("/nowhere", SCRATCH / "run", iterations=3)
        with self.assertRaisesRegex(gbtrace.ArgumentError, "train: no data given"):
            gbtrace.train(None, SCRATCH / "without", iterations=3)
        self.assertFalse((SCRATCH / "without").exists())
        for settings in ({"init": "gb\niterations = 5"}, {"init": "gb\0"}, {"init = gb\niterations": 5}):
            with self.assertRaisesRegex(ValueError, "wanted one line, without NUL"):
                gbtrace.train("/nowhere", SCRATCH / "run", **settings)

    def test_train(self):
        model = gbtrace.train(os.environ["GBT_DATA"], SCRATCH / "run", iterations=3, downscale=2, grow=np.False_)
        self.assertEqual(model.info.iterations, 3)

    def test_a_stopped_training_is_resumed(self):
        run = SCRATCH / "stopped"
        with self.assertRaises(KeyboardInterrupt):
            gbtrace.train(os.environ["GBT_DATA"], run, iterations=5, stop_at_step=2)
        self.assertEqual(gbtrace.train(None, run, resume=True).info.iterations, 5)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=1)
