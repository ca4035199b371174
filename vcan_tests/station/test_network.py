"""The network between page and station is lost in mid-drive, the station dies, the daemon dies: at rest, told, back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from vcan_tests.station.browser import CONNECTED, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import REST_M_S, UNHELD_S, Fleet, Robot, Status, speeds
from vcan_tests.station.stick import drives
from vcan_tests.station.wire import Wire, wire_to

pytestmark = pytest.mark.station

LOST = (r"WebSocket connection", r"^failed: ", r"console error: Failed to load resource", r"^50\d: ")
"""What a browser itself tells of a connection that is lost."""


def moving(status: Status) -> bool:
    """Whether every wheel turns."""
    return min(speeds(status)) > 0.1


@pytest.fixture
def wire(fleet: Fleet) -> Iterator[Wire]:
    """The network between the page and the station."""
    with wire_to(fleet.station.port) as wire:
        yield wire


@pytest.fixture
def driver(meet: Meet, wire: Wire, robot: Robot) -> Operator:
    """Somebody who drives over that network, and holds the stick."""
    operator = meet(wire.url)
    operator.expects(*LOST)
    operator.open(robot.name)
    drives(operator, robot, moving)
    return operator


@contextmanager
def at_rest_from_now_on(robot: Robot) -> Iterator[None]:
    """The robot comes to rest, and stands all the time while the ``with`` block lasts."""
    robot.comes_to_rest(UNHELD_S)
    with robot.watched() as fastest:
        yield
    assert fastest.speed_m_s < REST_M_S


def test_a_network_that_is_cut_stops_the_robot_and_the_page_comes_back_by_itself(
    driver: Operator, wire: Wire, robot: Robot
) -> None:
    wire.cut()
    with at_rest_from_now_on(robot):
        driver.sees("#connection", "reconnecting")
        wire.mend()
        driver.sees("#connection", CONNECTED)
        driver.sees("#notes", "connection to the robot is lost")
        driver.catches_up()
    driver.page.mouse.up()


def test_a_network_that_is_frozen_stops_the_robot_and_the_page_says_that_its_values_are_old(
    driver: Operator, wire: Wire, robot: Robot
) -> None:
    wire.freeze()
    with at_rest_from_now_on(robot):
        driver.sees("#connection", "stale|reconnecting")
        driver.comes_to(lambda: driver.page.get_attribute("body", "data-stale"), "true")
        wire.thaw()
        driver.sees("#connection", CONNECTED)
        driver.comes_to(lambda: driver.page.get_attribute("body", "data-stale"), None)
        driver.catches_up()
    driver.page.mouse.up()


def test_a_network_that_loses_only_what_the_page_sends_stops_the_robot_and_the_page_says_so(
    driver: Operator, wire: Wire, robot: Robot
) -> None:
    wire.freeze("up")
    with at_rest_from_now_on(robot):
        driver.sees("#notes", "let go, and hold it again to drive")
        driver.sees("#state", "idle")
        wire.thaw()
        driver.catches_up()
    driver.page.mouse.up()


def test_a_network_that_is_frozen_for_long_is_given_up_and_comes_back(
    driver: Operator, wire: Wire, robot: Robot
) -> None:
    wire.freeze()
    with at_rest_from_now_on(robot):
        driver.sees("#connection", "reconnecting")
        wire.thaw()
        driver.sees("#connection", CONNECTED)
        driver.catches_up()
    driver.page.mouse.up()


def test_after_the_network_is_back_the_robot_drives_when_the_stick_is_let_go_of_and_held_again(
    driver: Operator, wire: Wire, robot: Robot
) -> None:
    wire.cut()
    robot.comes_to_rest(UNHELD_S)
    wire.mend()
    driver.sees("#connection", CONNECTED)
    driver.page.mouse.up()
    drives(driver, robot, moving)
    driver.page.mouse.up()


def test_a_stop_without_a_connection_is_said_not_to_have_been_sent(driver: Operator, wire: Wire, robot: Robot) -> None:
    wire.cut()
    driver.sees("#connection", "reconnecting")
    driver.page.mouse.up()
    driver.page.click("#stop")
    driver.sees("#alarms", "NOT SENT")
    wire.mend()
    driver.sees("#connection", CONNECTED)


def test_a_station_that_dies_leaves_the_robot_at_rest_and_the_page_finds_it_again(
    driver: Operator, fleet: Fleet, robot: Robot
) -> None:
    fleet.station.kill()
    with at_rest_from_now_on(robot):
        driver.sees("#connection", "reconnecting")
        fleet.station.begin_again()
        driver.sees("#connection", CONNECTED)
    driver.page.mouse.up()


def test_a_daemon_that_dies_is_told_of_and_found_again(driver: Operator, robot: Robot) -> None:
    robot.kill()
    driver.sees("#connection", "reconnecting")
    driver.comes_to(lambda: driver.page.get_attribute("body", "data-stale"), "true")
    robot.begin_again()
    robot.wait_until_ready()
    driver.sees("#connection", CONNECTED)
    driver.sees("#state", "idle")
    driver.page.mouse.up()
    driver.catches_up()
    robot.stays_at_rest()


def test_a_daemon_that_is_stopped_in_mid_air_makes_the_values_stale(
    driver: Operator, robot: Robot, expected_errors: list[str]
) -> None:
    driver.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)
    with robot.suspended():
        driver.sees("#connection", "stale|reconnecting")
        driver.sees("#stale", "old")
    driver.sees("#connection", CONNECTED)
