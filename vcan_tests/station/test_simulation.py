"""The speed of time of a simulated robot."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot

pytestmark = pytest.mark.station

LOOK_S = 2.0


def test_time_passes_more_slowly_when_it_is_told_to(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.get_by_label("Time passes at").select_option("0.25")
    operator.sees("#notes", "0.25")
    begun_s = robot.status()["time_s"]
    operator.page.wait_for_timeout(LOOK_S * 1e3)
    assert robot.status()["time_s"] - begun_s < LOOK_S / 2
    operator.page.get_by_label("Time passes at").select_option("1")
    operator.sees("#notes", "at 1 ")
