"""The speed of time of a simulated robot."""

from __future__ import annotations

import time

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot

pytestmark = pytest.mark.station

LOOK_S = 1.0


def test_time_passes_more_slowly_when_it_is_told_to(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.get_by_label("Time passes at").select_option("0.25")
    operator.sees("#notes", "0.25")
    outside_s, begun_s = time.monotonic(), robot.status()["time_s"]
    passed_s = robot.comes_to(lambda status: status["time_s"] - begun_s > LOOK_S)["time_s"] - begun_s
    assert time.monotonic() - outside_s > 2.0 * passed_s
    operator.page.get_by_label("Time passes at").select_option("1")
    operator.sees("#notes", "at 1 ")
