"""Rows that are measured in turn, and what is told of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.bars import draw_bars
from benchmarks.interleaving import FEWEST_TURNS, Cost, Measured, measure, verdict


class Counting:
    def __init__(self, key: str, order: list[str]) -> None:
        self.name = self.key = key
        self._order = order

    def run(self, count: int) -> None:
        self._order.append(f"{self.key} {count}")

    def close(self) -> None:
        self._order.append(f"{self.key} closed")


def measured() -> Measured:
    """A machine that is half as fast in the second turn."""
    rows = [Counting("slow", []), Counting("fast", []), Counting("part", [])]
    turns = {"slow": [Cost(30, 31), Cost(60, 62)], "fast": [Cost(10, 10), Cost(20, 20)], "part": [Cost(5, 5)] * 2}
    return Measured(rows, turns)


def test_rows_take_turns_and_are_closed() -> None:
    order: list[str] = []
    measure([Counting("a", order), Counting("b", order)], 7, 0.0, lambda _: None)
    assert order == ["a 7", "b 7"] * (1 + FEWEST_TURNS) + ["a closed", "b closed"]


def test_rows_are_closed_where_one_fails() -> None:
    order: list[str] = []

    class Failing(Counting):
        def run(self, count: int) -> None:
            raise RuntimeError("no robot")

    with pytest.raises(RuntimeError, match="no robot"):
        measure([Counting("a", order), Failing("b", order)], 7, 0.0, lambda _: None)
    assert order[-2:] == ["a closed", "b closed"]


def test_a_ratio_is_that_of_neighbours_in_time() -> None:
    assert measured().ratio("slow", "fast") == pytest.approx(3.0)


def test_a_part_can_be_taken_off_before() -> None:
    assert measured().ratio("slow", "fast", "part") == pytest.approx((2.5 + 2.75) / 2)


def test_the_cost_is_the_median_of_the_turns() -> None:
    assert measured().cost("slow") == Cost(45, 46.5)


def test_the_table_has_a_row_for_each() -> None:
    table = measured().table("title", "fast", "part")
    assert [row[0] for row in table.rows] == ["slow", "fast", "part"]
    assert {len(row) for row in table.rows} == {len(table.heads)}


@pytest.mark.parametrize(("ratio", "told"), [(1.2, "met"), (1.3, "met"), (1.31, "missed")])
def test_a_ratio_is_judged_by_what_was_wanted(ratio: float, told: str) -> None:
    assert verdict(ratio, 1.3) == told


def test_every_row_is_closed_where_one_cannot_be() -> None:
    order: list[str] = []

    class Stuck(Counting):
        def close(self) -> None:
            raise RuntimeError("stuck")

    with pytest.raises(RuntimeError, match="stuck"):
        measure([Stuck("a", order), Counting("b", order)], 7, 0.0, lambda _: None)
    assert order[-1] == "b closed"


def test_bars_are_drawn(tmp_path: Path) -> None:
    assert draw_bars(measured(), "cost", tmp_path / "bars.png").stat().st_size > 1000
