"""The bus's limit: arithmetic beside the frames of the simulated bus."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import bus_limit
from benchmarks.bus_limit import cycle_bits
from benchmarks.load import load_of
from benchmarks.nodes import drives_only
from benchmarks.robots import STANDING
from drivers.bus.wire_time import frame_bits


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_every_frame_is_as_long_as_the_bounds_say(can_id: int, data: bytes) -> None:
    least, most = bus_limit.frame_bits(len(data))
    assert least <= frame_bits(can_id, data) <= most


def test_a_frame_of_equal_bits_is_nearly_as_long_as_any() -> None:
    assert bus_limit.frame_bits(8).most - frame_bits(0x000, bytes(8)) <= 8


def test_a_cycle_has_a_sync_and_two_frames_a_drive_and_one_an_encoder() -> None:
    assert cycle_bits(4, 2).least == 47 + 4 * (47 + 64) + 4 * (47 + 48) + 2 * (47 + 32)


@pytest.mark.parametrize("count", [1, 3])
def test_a_cycle_on_the_simulated_bus_is_within_the_bounds(count: int) -> None:
    least, most = cycle_bits(count)
    assert least < load_of(drives_only(count, 20.0), STANDING, 0.5, 0.5).bits < most
