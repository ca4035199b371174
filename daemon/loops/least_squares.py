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
    return _solve(normal(rows), p, q, r)


class Normal(NamedTuple):
    """The normal equations' symmetric matrix, as what its inverse is made of.

    Attributes:
        aa, ab, ac, bb, bc, cc: upper half of the inverse, times the determinant.
        determinant: of the matrix.
        diagonal: product of its diagonal, which the determinant never exceeds; far below it the matrix is singular.
    """

    aa: float
    ab: float
    ac: float
    bb: float
    bc: float
    cc: float
    determinant: float
    diagonal: float


def normal(rows: Sequence[Row]) -> Normal:
    """The normal equations of some rows."""
    a = b = c = d = e = f = 0.0
    for x, y, z in rows:
        a, b, c = a + x * x, b + x * y, c + x * z
        d, e, f = d + y * y, e + y * z, f + z * z
    aa, ab, ac = d * f - e * e, c * e - b * f, b * e - c * d
    return Normal(aa, ab, ac, a * f - c * c, b * c - a * e, a * d - b * b, a * aa + b * ab + c * ac, a * d * f)


def _solve(equations: Normal, p: float, q: float, r: float) -> Row:
    aa, ab, ac, bb, bc, cc, determinant, _ = equations
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
    equations = normal(rows)
    solved = [_solve(equations, *row) for row in rows]
    return Fit(rows, ([x for x, _, _ in solved], [y for _, y, _ in solved], [z for _, _, z in solved]))
