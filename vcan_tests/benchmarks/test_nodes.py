"""What a node costs."""

from __future__ import annotations

import pytest

from benchmarks.nodes import fit


def test_costs_on_a_line_leave_no_residual() -> None:
    line = fit([2, 6, 16], [14.0, 22.0, 42.0])
    assert (line.each, line.none, line.residual) == pytest.approx((2.0, 10.0, 0.0))


def test_the_line_is_shown_beside_what_was_measured() -> None:
    line = fit([2, 6, 16], [14.0, 22.0, 42.0])
    assert line.at(10) == pytest.approx(30.0)


def test_the_residual_is_the_farthest_cost() -> None:
    assert fit([0, 1, 2], [0.0, 3.0, 0.0]).residual == pytest.approx(2.0)
