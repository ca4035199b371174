"""How measured values are summed up."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.spread import histogram, log_edges, spread

TIMES = st.lists(st.floats(0.01, 1e6), min_size=1)
MANY_TIMES = st.lists(st.floats(0.01, 1e6), min_size=100, max_size=300)


def test_a_percentile_is_the_least_value_that_so_many_do_not_exceed() -> None:
    found = spread([float(number) for number in range(200, 0, -1)])
    assert (found.p50, found.p90, found.p99, found.worst) == (100.0, 180.0, 198.0, 200.0)


@given(MANY_TIMES)
def test_percentiles_are_in_their_order(times: list[float]) -> None:
    found = spread(times)
    assert found.p90 is not None
    assert found.p99 is not None
    assert min(times) <= found.p50 <= found.p90 <= found.p99 <= found.worst == max(times)


@pytest.mark.parametrize(("count", "known"), [(9, (False, False)), (10, (True, False)), (100, (True, True))])
def test_a_percentile_that_nothing_could_be_beyond_is_left_out(count: int, known: tuple[bool, bool]) -> None:
    found = spread([1.0] * count)
    assert (found.p90 is not None, found.p99 is not None) == known


def test_edges_are_equally_far_apart_on_a_logarithmic_scale() -> None:
    assert log_edges(1.0, 100.0, 2) == pytest.approx([1.0, 10**0.5, 10.0, 10**1.5, 100.0])


@given(TIMES)
def test_a_histogram_loses_no_value(times: list[float]) -> None:
    assert sum(histogram(times, log_edges(1.0, 1000.0, 3))) == len(times)


def test_a_value_on_an_edge_is_in_the_bin_that_begins_there() -> None:
    assert histogram([0.5, 1.0, 2.0, 3.0, 4.0, 9.0], [1.0, 2.0, 4.0]) == [2, 4]
