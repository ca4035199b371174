"""The highest rate that is kept."""

from __future__ import annotations

import pytest

from benchmarks.load import load_of
from benchmarks.rates import ALLOWED_LATE, HIGHEST_HZ, LOWEST_HZ, STEP_HZ, highest_kept, highest_of
from benchmarks.robots import STRAIGHT, robot_at
from daemon.board_bench import RateResult


@pytest.mark.parametrize("kept", [LOWEST_HZ, LOWEST_HZ + STEP_HZ, 530, HIGHEST_HZ - STEP_HZ, HIGHEST_HZ])
def test_the_highest_rate_is_found(kept: int) -> None:
    assert highest_kept(lambda hz: hz <= kept) == kept


def test_no_rate_may_be_kept() -> None:
    assert highest_kept(lambda _: False) is None


def test_a_rate_with_more_late_cycles_than_allowed_is_not_kept() -> None:
    def result(hz: float, late: int) -> RateResult:
        return RateResult(hz, 10_000, late, 0.0, 0.0, 0.0, 0, late == 0)

    allowed = int(10_000 * ALLOWED_LATE)
    assert highest_of([result(100.0, 0), result(200.0, allowed), result(300.0, allowed + 1)]) == 200.0


def test_a_robot_that_drives_at_half_of_the_bus_s_limit_is_never_late() -> None:
    found = load_of(robot_at(400.0), STRAIGHT, 0.5, 1.0)
    assert (found.late_cycles, found.lost_frames) == (0, 0)
