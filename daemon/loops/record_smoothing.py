"""Takes the scatter out of a recorded way, where it is large against what a fit may be off.

Scanners and trackers tell a pose with noise; lines and arcs that go through each of its poses are mostly noise, too.
Scatter is how far a pose lies beside its neighbours, more than on a smooth way; each pose is then replaced by that of
the parabolas, over the way, that fit best to those around it (local regression; Savitzky & Golay, Analytical Chemistry
36, 1964).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from statistics import fmean, median
from typing import Final

from daemon.loops.odometry import Pose
from daemon.loops.path import wrap

HARMLESS: Final = 0.3
"""Scatter, as a part of the tolerance, that a fit copes with."""
WANTED: Final = 0.1
"""Part of the tolerance that may be left of it."""
WIDEST: Final = 20
"""Most poses to each side that a parabola is fitted to."""
ARM_M: Final = 0.2
"""Way over which an error of the heading becomes one of position: a short piece."""
_MEDIAN: Final = 1.4826
"""Standard deviation over the median of the sizes, of a normal distribution."""
_BESIDE: Final = 1.5
"""Variance of b - (a + c) / 2, in variances of one of them."""


def smoothed(poses: Sequence[Pose], tolerance_m: float) -> list[Pose]:
    """The poses without their scatter; as they are where it is harmless.

    Args:
        poses: one after the other, about equally far apart.
        tolerance_m: what a fit may be off.
    """
    headings = _unwrapped([pose.yaw_rad for pose in poses])
    scatter_m = max(_scatter(_beside(poses)), ARM_M * _scatter(_between(headings)))
    if scatter_m <= HARMLESS * tolerance_m:
        return list(poses)
    # The middle of a parabola through n values has 9 / (4 n) of their variance.
    count = 2.25 * (scatter_m / (WANTED * tolerance_m)) ** 2
    half = min(WIDEST, math.ceil(count / 2))
    rows = ([pose.x_m for pose in poses], [pose.y_m for pose in poses], headings)
    ways = _ways(poses)
    return [Pose(*pose) for pose in zip(*(_parabolas(ways, row, half) for row in rows), strict=True)]


def _unwrapped(angles: list[float]) -> list[float]:
    turned = angles[:1]
    for before, after in pairwise(angles):
        turned.append(turned[-1] + wrap(after - before))
    return turned


def _ways(poses: Sequence[Pose]) -> list[float]:
    """Way of each pose from the first one, along the headings."""
    steps = (
        abs((b.x_m - a.x_m) * math.cos(a.yaw_rad) + (b.y_m - a.y_m) * math.sin(a.yaw_rad)) for a, b in pairwise(poses)
    )
    return list(accumulate(steps, initial=0.0))


def _beside(poses: Sequence[Pose]) -> list[float]:
    """How far poses lie beside the line through those before and after them."""
    offsets = []
    for a, b, c in zip(poses, poses[1:], poses[2:], strict=False):
        dx, dy = c.x_m - a.x_m, c.y_m - a.y_m
        offsets.append(abs(dx * (b.y_m - a.y_m) - dy * (b.x_m - a.x_m)) / (math.hypot(dx, dy) or math.inf))
    return offsets


def _between(values: Sequence[float]) -> list[float]:
    """How far values lie from the mean of those before and after them."""
    return [abs(b - (a + c) / 2) for a, b, c in zip(values, values[1:], values[2:], strict=False)]


def _scatter(sizes: list[float]) -> float:
    return _MEDIAN * median(sizes) / math.sqrt(_BESIDE) if sizes else 0.0


def _parabolas(ways: Sequence[float], values: Sequence[float], half: int) -> list[float]:
    """Each value by the parabola of those up to ``half`` beside it; at the ends by the outermost whole one."""
    width = min(2 * half + 1, len(values))
    if width < 4:
        return list(values)
    fitted = []
    for index, way in enumerate(ways):
        begin = min(max(0, index - half), len(values) - width)
        fitted.append(_parabola_at(way, ways[begin : begin + width], values[begin : begin + width]))
    return fitted


def _parabola_at(way: float, ways: Sequence[float], values: Sequence[float]) -> float:
    """The value at ``way`` of the parabola with the least squares, by polynomials that are orthogonal on ``ways``."""
    middle = fmean(ways)
    steps = [one - middle for one in ways]
    squares = sum(step * step for step in steps) or 1.0
    lean, mean_square = sum(step**3 for step in steps) / squares, squares / len(steps)
    bends = [step * step - lean * step - mean_square for step in steps]
    slope = sum(step * value for step, value in zip(steps, values, strict=True)) / squares
    bend = sum(b * value for b, value in zip(bends, values, strict=True)) / (sum(b * b for b in bends) or 1.0)
    at = way - middle
    return fmean(values) + slope * at + bend * (at * at - lean * at - mean_square)
