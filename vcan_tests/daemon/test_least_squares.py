"""Least squares for three unknowns, and the fit that is solved once for many values."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.least_squares import KEPT, Fits, Row, least_squares

numbers = st.floats(-10.0, 10.0)
WHEELS = [(math.cos(angle), math.sin(angle), 0.3) for angle in (0.2, 1.7, 3.1, 4.9)]


@given(st.lists(numbers, min_size=4, max_size=4))
def test_a_fit_answers_as_least_squares_do(values: list[float]) -> None:
    fit = Fits(lambda _: WHEELS).at(())
    assert fit.unknowns(values) == pytest.approx(least_squares(WHEELS, values), abs=1e-9)


@given(st.tuples(numbers, numbers, numbers))
def test_values_that_fit_exactly_give_their_unknowns(unknowns: Row) -> None:
    values = [sum(a * b for a, b in zip(row, unknowns, strict=True)) for row in WHEELS]
    assert least_squares(WHEELS, values) == pytest.approx(unknowns, abs=1e-8)


def test_values_that_are_left_out_are_zero() -> None:
    fit = Fits(lambda _: WHEELS).at(())
    assert fit.unknowns([1.0, 2.0]) == pytest.approx(least_squares(WHEELS, [1.0, 2.0, 0.0, 0.0]))


def test_rows_are_made_once_for_headings_that_come_again() -> None:
    asked: list[tuple[float, ...]] = []

    def rows_of(heading_rad: tuple[float, ...]) -> list[Row]:
        asked.append(heading_rad)
        return WHEELS

    fits = Fits(rows_of)
    for heading in (0.0, 0.1, 0.0, 0.1):
        fits.at((heading, 0.0))
    assert asked == [(0.0, 0.0), (0.1, 0.0)]


def test_only_some_headings_are_remembered() -> None:
    asked = 0

    def rows_of(_: tuple[float, ...]) -> list[Row]:
        nonlocal asked
        asked += 1
        return WHEELS

    fits = Fits(rows_of)
    for heading in range(KEPT + 1):
        fits.at((float(heading),))
    fits.at((0.0,))
    assert asked == KEPT + 2
