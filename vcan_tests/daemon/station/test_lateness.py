"""A command that hung in the network moves nothing; one that is quick does, whatever the page's clock says."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.station.lateness import LATE_S, Lateness

CLOCKS_S = st.floats(-1e9, 1e9)


def heard(offset_s: float, *messages: tuple[float, float]) -> Lateness:
    """What is known after messages that were sent at a time, by a clock beside the station's, and took a while."""
    lateness = Lateness()
    for sent_s, took_s in messages:
        lateness.look(1e3 * (sent_s + offset_s), sent_s + took_s)
    return lateness


@given(CLOCKS_S)
def test_a_drive_that_was_held_up_is_refused_whatever_the_clocks_say(offset_s: float) -> None:
    lateness = heard(offset_s, (100.0, 0.01), (100.1, 5.0))
    refused = lateness.refusal("drive.set")
    assert refused is not None
    assert "5.0 s" in refused.message


@given(CLOCKS_S)
def test_a_drive_that_is_hardly_later_than_others_is_let_through(offset_s: float) -> None:
    assert heard(offset_s, (100.0, 0.01), (100.1, LATE_S - 0.1)).refusal("drive.set") is None


def test_a_whole_burst_after_a_pause_of_minutes_is_refused() -> None:
    lateness = heard(0.0, (100.0, 0.01), (101.0, 300.0))
    assert lateness.refusal("drive.set")
    lateness.look(1e3 * 101.1, 401.01)
    assert lateness.refusal("drive.set")


def test_the_next_quick_message_is_let_through() -> None:
    assert heard(0.0, (100.0, 0.01), (101.0, 20.0), (122.0, 0.02)).refusal("drive.set") is None


def test_a_clock_that_drifts_for_hours_is_followed() -> None:
    lateness = Lateness()
    for second in range(4 * 3600):
        lateness.look(1e3 * second * 0.9999, float(second))
        assert lateness.late_s < 0.01


@pytest.mark.parametrize("name", ["stop", "estop", "motion.stop", "motor.disable", "brake.engage", "status"])
def test_what_stops_or_looks_is_never_too_late(name: str) -> None:
    assert heard(0.0, (100.0, 0.01), (100.1, 60.0)).refusal(name) is None


@pytest.mark.parametrize("name", ["motor.velocity", "drive.path", "motor.enable", "brake.release", "reset"])
def test_what_moves_or_lets_move_may_be_too_late(name: str) -> None:
    assert heard(0.0, (100.0, 0.01), (100.1, 60.0)).refusal(name)


@pytest.mark.parametrize("sent_ms", [None, "soon", True, float("nan"), float("inf"), 10**400, [1]])
def test_who_tells_no_time_is_not_judged(sent_ms: Any) -> None:
    lateness = heard(0.0, (100.0, 0.01), (100.1, 60.0))
    lateness.look(sent_ms, 161.0)
    assert lateness.refusal("drive.set") is None
