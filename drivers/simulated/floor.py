"""The floor under a simulated robot: friction that may differ by place and time."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from profiles.schema import FloorPatch


class Floor:
    """Friction of a floor with patches, the last one on top.

    Args:
        friction: coefficient of friction elsewhere.
        patches: by name.
    """

    def __init__(self, friction: float, patches: Mapping[str, FloorPatch]) -> None:
        self._friction = friction
        self._patches = tuple(_Patch(patch) for patch in reversed([*patches.values()]))

    def friction(self, x_m: float, y_m: float, time_s: float) -> float:
        """Coefficient of friction at a place and a time of the simulation."""
        for patch in self._patches:
            if patch.covers(x_m, y_m, time_s):
                return patch.friction
        return self._friction


class _Patch:
    __slots__ = ("_end_s", "_from_s", "_half_x_m", "_half_y_m", "_round", "_x_m", "_y_m", "friction")

    def __init__(self, patch: FloorPatch) -> None:
        self.friction = patch.friction
        self._round = patch.shape == "ellipse"
        self._x_m, self._y_m = patch.x_m, patch.y_m
        self._half_x_m, self._half_y_m = patch.length_m / 2.0, patch.width_m / 2.0
        self._from_s = patch.from_s
        self._end_s = inf if patch.until_s is None else patch.until_s

    def covers(self, x_m: float, y_m: float, time_s: float) -> bool:
        across_x = (x_m - self._x_m) / self._half_x_m
        across_y = (y_m - self._y_m) / self._half_y_m
        if not self._from_s <= time_s < self._end_s:
            return False
        if self._round:
            return across_x * across_x + across_y * across_y <= 1.0
        return -1.0 <= across_x <= 1.0 and -1.0 <= across_y <= 1.0
