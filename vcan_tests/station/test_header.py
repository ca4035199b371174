"""What is always in sight: presses that are meant, stops that fail, a daemon that is gone."""

from __future__ import annotations

import pytest

from vcan_tests.station.browser import CONNECTED, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Fleet, Robot, speeds
from vcan_tests.station.test_network import LOST
from vcan_tests.station.wire import Wire, wire_to

pytestmark = pytest.mark.station

CLOCK = r"\d\d:\d\d:\d\d"


@pytest.fixture
def latched(operator: Operator, robot: Robot, expected_errors: list[str]) -> Operator:
    """Somebody before a robot whose emergency stop is latched."""
    expected_errors.append("emergency stop")
    operator.page.click("#estop")
    operator.sees("#state", "emergency stop")
    return operator


def test_a_double_click_does_not_reset(latched: Operator, robot: Robot) -> None:
    latched.page.dblclick("#reset")
    latched.sees("#reset", "It is safe")
    latched.catches_up()
    assert robot.status()["state"] == "estop"


def test_enter_that_is_held_down_does_not_reset(latched: Operator, robot: Robot) -> None:
    latched.page.focus("#reset")
    for _ in range(8):
        latched.page.keyboard.down("Enter")
        latched.page.wait_for_timeout(200.0)
    latched.page.keyboard.up("Enter")
    latched.sees("#reset", "It is safe")
    latched.catches_up()
    assert robot.status()["state"] == "estop"


def test_two_presses_reset(latched: Operator, robot: Robot) -> None:
    latched.page.click("#reset")
    latched.page.click("#reset")
    latched.sees("#state", "idle")


def test_a_double_click_takes_the_robot_over_and_does_not_give_it_back(operator: Operator, robot: Robot) -> None:
    robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=60.0, wait=False)
    operator.sees("#holder", "has the robot")
    operator.page.dblclick("#takeover")
    robot.comes_to_rest(10.0)
    operator.sees("#takeover", "Give back")
    operator.catches_up()
    assert robot.status()["holder"] is not None
    operator.page.click("#takeover")
    operator.sees("#holder", "^$")


def test_an_emergency_stop_is_told_once_and_names_the_button_that_ends_it(latched: Operator) -> None:
    latched.sees("#latched-why", "emergency stop: .*“Reset”")
    latched.catches_up()
    assert latched.text("#message") == ""
    assert "emergency stop" not in latched.text("#notices")
    assert "canhelm reset" not in latched.text("body")


def stops_in_vain(operator: Operator, wire: Wire, robot: Robot) -> Operator:
    """Somebody presses the stop when the network is gone."""
    operator.expects(*LOST)
    operator.open(robot.name)
    wire.cut()
    operator.sees("#connection", "reconnecting")
    operator.page.click("#stop")
    return operator


def test_a_stop_that_was_not_sent_says_when_and_how_often_and_is_settled_when_the_robot_stands(
    meet: Meet, fleet: Fleet, robot: Robot
) -> None:
    with wire_to(fleet.station.port) as wire:
        operator = stops_in_vain(meet(wire.url), wire, robot)
        operator.sees("#alarms", f"stop NOT SENT at {CLOCK}: no connection")
        operator.page.keyboard.press("Space")
        operator.sees("#alarms", rf"stop NOT SENT at {CLOCK} \(2 times since {CLOCK}\)")
        wire.mend()
        operator.sees("#connection", CONNECTED)
        operator.sees("#alarms", "^$")


def test_a_stop_that_was_not_sent_stays_told_while_the_robot_moves_until_one_gets_through(
    meet: Meet, fleet: Fleet, robot: Robot
) -> None:
    with wire_to(fleet.station.port) as wire:
        operator = stops_in_vain(meet(wire.url), wire, robot)
        robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.2, duration_s=60.0, wait=False)
        robot.comes_to(lambda status: min(speeds(status)) > 0.1)
        wire.mend()
        operator.sees("#connection", CONNECTED)
        operator.sees("#state", "active")
        operator.catches_up()
        assert "NOT SENT" in operator.text("#alarms")
        operator.page.click("#stop")
        operator.sees("#alarms", "^$")
        robot.comes_to_rest(10.0)


def test_a_dead_daemon_leaves_the_last_known_state_with_its_age_and_says_how_to_start_it(
    operator: Operator, robot: Robot
) -> None:
    operator.expects(*LOST)
    robot.kill()
    operator.sees("#state", r"last: idle, \d+ s ago")
    operator.sees("#stale", f"canhelm run --profile {robot.name} .*systemctl start canhelm@{robot.name}")
    robot.begin_again()
    robot.wait_until_ready()
    operator.sees("#state", "^. idle$")
