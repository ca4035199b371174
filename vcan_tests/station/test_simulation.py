"""The speed of time of a simulated robot, the time of day beside it, and which of its drives roll on a floor."""

from __future__ import annotations

import re
import time

import pytest

from vcan_tests.station.browser import Operator
from vcan_tests.station.processes import Robot

pytestmark = pytest.mark.station

ROBOTS = ("max2d", "semitrailer")
LOOK_S = 1.0
AHEAD_S = 8.0
"""By the robot's clock while its time passes four times as fast."""
DATES = "times => times.map(time => Date.parse(time.dateTime) / 1000)"


def test_time_passes_more_slowly_when_it_is_told_to(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.get_by_label("Time passes at").select_option("0.25")
    operator.sees("#notes", "0.25")
    outside_s, begun_s = time.monotonic(), robot.status()["time_s"]
    passed_s = robot.comes_to(lambda status: status["time_s"] - begun_s > LOOK_S)["time_s"] - begun_s
    assert time.monotonic() - outside_s > 2.0 * passed_s
    operator.page.get_by_label("Time passes at").select_option("1")
    operator.sees("#notes", "at 1 ")


def test_events_are_dated_by_the_time_of_day_however_time_has_passed(operator: Operator, robot: Robot) -> None:
    begun_s = robot.status()["time_s"]
    robot.call("simulation.pace", factor=4.0)
    robot.comes_to(lambda status: status["time_s"] - begun_s > AHEAD_S)
    robot.call("simulation.pace", factor=1.0)
    operator.go_to("events")
    operator.page.reload()
    told = [event["unix_s"] for event in reversed(robot.status()["events"])]
    shown = operator.page.locator("ol.events time")
    operator.comes_to(lambda: shown.evaluate_all(DATES), pytest.approx(told, abs=0.002))


def test_the_drive_of_a_steered_axle_is_not_put_on_ice(operator: Operator) -> None:
    operator.choose("semitrailer")
    operator.go_to("simulation")
    ice = operator.page.get_by_role("button", name=re.compile("^Put .* on ice$"))
    operator.comes_to(ice.all_inner_texts, ["Put drive on ice"])
