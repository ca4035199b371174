"""The daemon's own share of the processor."""

from __future__ import annotations

import itertools

import pytest

from benchmarks import share
from benchmarks.load import load_of
from benchmarks.nodes import drives_only
from benchmarks.robots import STANDING


def test_each_tick_and_each_frame_that_the_daemon_is_given_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(share, "perf_counter", itertools.count().__next__)  # every timed call takes 1 s
    robot, cycle_hz = drives_only(2, 50.0), 50.0
    readings = 2
    guarding_answers = 2 * 1e3 / robot.network.guard_time_ms / cycle_hz
    found = load_of(robot, STANDING, 10.0, 0.5)
    assert found.daemon_us is not None
    assert found.daemon_us / 1e6 == pytest.approx(1 + readings + guarding_answers, abs=0.1)
