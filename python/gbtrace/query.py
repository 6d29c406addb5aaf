# SPDX-License-Identifier: Apache-2.0
"""Balls and anchors by place."""

import ctypes as c
from dataclasses import dataclass
from operator import index as as_index

import numpy as np

from gbtrace import _library as lib


@dataclass(frozen=True, eq=False)
class Answers:
    """Answers of many queries: those of query i are index[first[i]:first[i + 1]], ascending. A sequence: answers[i], for which in answers."""

    first: np.ndarray  # (queries + 1,)
    index: np.ndarray  # which balls
    value: np.ndarray  # distance to the centre; of rays the t of the point of the segment that is nearest to the centre

    def __getitem__(self, i):
        """The balls that answer query i; of the last one for i = -1."""
        try:
            query = range(len(self))[as_index(i)]
        except IndexError:
            raise IndexError(f"query {i} (there are {len(self)})") from None
        return self.index[self.first[query]:self.first[query + 1]]

    def __len__(self):
        return len(self.first) - 1


class Balls:
    """Balls (points: radius 0) that answer exactly what is near, in double; docs/queries.md.

    Balls("RUN"), or a file of balls, a point cloud, a data set. Queries are arrays of many; they are converted to float64 where they are not.
    Queries may come from several threads at once.
    """

    def __init__(self, path):
        self._set("gbt_balls_open", lib.encode(path))

    @classmethod
    def from_arrays(cls, position, radius=None):
        """position (count, 3), radius (count,); copied."""
        balls = cls.__new__(cls)
        position = _rows(position, "position")
        radius = None if radius is None else _numbers(radius, "radius", len(position))
        balls._set("gbt_balls_from_arrays", _at(position), _at(radius), len(position))
        return balls

    def _set(self, name, *arguments):
        self._c = None
        handle = lib.pointer()
        lib.call(name, *arguments, c.byref(handle))
        self._c = handle
        view = lib.library.gbt_balls_get(handle)
        self.anchors = bool(view.anchors)  # whether each ball is an anchor of a run
        self.position = _copy(view.position, (view.count, 3), np.float64)
        self.radius = _copy(view.radius, (view.count,), np.float64) if view.radius else np.zeros(view.count)

    def __len__(self):
        return len(self.position)

    def __reduce_ex__(self, protocol):
        raise TypeError("a gbtrace.Balls cannot be copied or pickled (open it again)")

    def __del__(self):
        if getattr(self, "_c", None) is not None:
            lib.library.gbt_balls_free(self._c)

    def nearest(self, points, k=1, skip_same=False):
        """The k nearest centres of each point: index and distance, (count, k), nearest first, ties by index.

        Where there are fewer than k: 2**32 - 1 and infinity. skip_same: query i leaves ball i out.
        """
        points = _rows(points, "points")
        index, distance = np.empty((len(points), k), np.uint32), np.empty((len(points), k))
        lib.call("gbt_balls_nearest", self._c, _at(points), len(points), k, skip_same, _at(index), _at(distance))
        return index, distance

    def within(self, points, radius):
        """Centres within a radius (one, or one for each point)."""
        points = _rows(points, "points")
        radius = _numbers(radius, "radius", len(points))
        return self._ask("gbt_balls_within", _at(points), _at(radius), len(points))

    def containing(self, points):
        """Balls that contain a point."""
        points = _rows(points, "points")
        return self._ask("gbt_balls_containing", _at(points), len(points))

    def overlapping(self, points, radius):
        """Balls that overlap the ball of this radius around a point."""
        points = _rows(points, "points")
        radius = _numbers(radius, "radius", len(points))
        return self._ask("gbt_balls_overlapping", _at(points), _at(radius), len(points))

    def crossed(self, origins, directions, t_min=0, t_max=np.inf):
        """Balls that meet the segment origin + t direction, t_min <= t <= t_max."""
        origins = _rows(origins, "origins")
        directions = _rows(directions, "directions")
        if len(directions) != len(origins):
            raise ValueError(f"directions: {len(directions)} (wanted {len(origins)}, as many as origins)")
        t_min, t_max = _numbers(t_min, "t_min", len(origins)), _numbers(t_max, "t_max", len(origins))
        return self._ask("gbt_balls_crossed", _at(origins), _at(directions), _at(t_min), _at(t_max), len(origins))

    def _ask(self, name, *arguments):
        answers = lib.CAnswers()
        try:
            lib.call(name, self._c, *arguments, c.byref(answers))
            first = _copy(answers.first, (answers.count + 1,), np.intp)
            count = int(first[-1])
            return Answers(first, _copy(answers.index, (count,), np.uint32), _copy(answers.value, (count,), np.float64))
        finally:
            lib.library.gbt_answers_free(c.byref(answers))


def _rows(values, name):
    array = np.ascontiguousarray(values, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: shape {array.shape} (wanted (count, 3))")
    return array


def _numbers(values, name, count):
    array = np.asarray(values, np.float64)
    if array.shape not in ((), (count,)):
        raise ValueError(f"{name}: shape {array.shape} (wanted a number, or ({count},))")
    return np.ascontiguousarray(np.broadcast_to(array, (count,)))


def _at(array):
    return None if array is None else array.ctypes.data


def _copy(address, shape, kind):
    array = np.empty(shape, kind)
    if array.nbytes > 0:
        c.memmove(array.ctypes.data, address, array.nbytes)
    return array
