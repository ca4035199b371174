"""Least squares for three unknowns: a motion of a body in the plane, or a place and a direction.

Normal equations by Cramer's rule.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import mul
from typing import Final, NamedTuple

Row = tuple[float, float, float]
KEPT: Final = 16
"""Headings whose fit is remembered: where brakes hold two axes, their encoders tell few different ones."""


def least_squares(rows: Sequence[Row], values: Sequence[float]) -> Row:
    """The three unknowns that fit the equations ``row . unknowns = value`` best."""
    p = q = r = 0.0
    for (x, y, z), value in zip(rows, values, strict=True):
        p, q, r = p + x * value, q + y * value, r + z * value
    return _solve(_normal(rows), p, q, r)


_Normal = tuple[float, float, float, float, float, float, float]
"""The inverse of the normal equations' matrix times its determinant, row by row of the upper half, and that."""


def _normal(rows: Sequence[Row]) -> _Normal:
    a = b = c = d = e = f = 0.0
    for x, y, z in rows:
        a, b, c = a + x * x, b + x * y, c + x * z
        d, e, f = d + y * y, e + y * z, f + z * z
    minor_a, minor_b, minor_c = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * minor_a + b * minor_b + c * minor_c
    return minor_a, minor_b, minor_c, a * f - c * c, b * c - a * e, a * d - b * b, determinant


def _solve(normal: _Normal, p: float, q: float, r: float) -> Row:
    aa, ab, ac, bb, bc, cc, determinant = normal
    return (
        (aa * p + ab * q + ac * r) / determinant,
        (ab * p + bb * q + bc * r) / determinant,
        (ac * p + bc * q + cc * r) / determinant,
    )


class Fit(NamedTuple):
    """The least-squares answer for rows that stay while the values change.

    Attributes:
        rows: of the equations.
        parts: for each unknown, what every value adds to it, for one of 1.
    """

    rows: Sequence[Row]
    parts: tuple[Sequence[float], Sequence[float], Sequence[float]]

    def unknowns(self, values: Sequence[float]) -> Row:
        """The answer for the values of the first rows; those of the others are 0."""
        first, second, third = self.parts
        return sum(map(mul, values, first)), sum(map(mul, values, second)), sum(map(mul, values, third))


class Fits:
    """Fits for the headings of wheels: the newest ones are remembered.

    Args:
        rows_of: makes the rows for headings [rad].
    """

    def __init__(self, rows_of: Callable[[tuple[float, ...]], Sequence[Row]]) -> None:
        self._rows_of = rows_of
        self._known: dict[tuple[float, ...], Fit] = {}

    def at(self, heading_rad: tuple[float, ...]) -> Fit:
        """The fit for these headings."""
        fit = self._known.get(heading_rad)
        if fit is None:
            if len(self._known) == KEPT:
                self._known.clear()
            fit = self._known[heading_rad] = _fit(self._rows_of(heading_rad))
        return fit


def _fit(rows: Sequence[Row]) -> Fit:
    normal = _normal(rows)
    solved = [_solve(normal, *row) for row in rows]
    return Fit(rows, ([x for x, _, _ in solved], [y for _, y, _ in solved], [z for _, _, z in solved]))
