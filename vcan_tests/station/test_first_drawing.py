"""What a panel shows before the daemon has answered, and that nothing jumps when it has."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest

from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import Robot

if TYPE_CHECKING:
    from playwright.sync_api import WebSocketRoute

pytestmark = pytest.mark.station

PLACES = "() => [...document.querySelectorAll('[data-panel=devices] .card')].map(card => card.offsetTop).join()"


def withhold(socket: WebSocketRoute, method: str) -> None:
    """Carry everything, but no request for this method."""
    server = socket.connect_to_server()
    socket.on_message(lambda message: server.send(message) if json.loads(message)["method"] != method else None)


def test_the_stick_is_disabled_until_its_limits_are_known(meet: Meet, robot: Robot) -> None:
    operator = meet()
    operator.page.route_web_socket(re.compile("/ws/"), lambda socket: withhold(socket, "drive.gamepad"))
    operator.open(robot.name)
    operator.go_to("drive")
    operator.sees("#why-drive", "its limits are being asked for")
    assert operator.page.get_attribute(".stick", "aria-disabled") == "true"
    assert operator.page.is_disabled("#slider-speed")


def test_the_cards_of_the_devices_stay_where_they_are_when_the_limits_of_their_currents_are_known(
    meet: Meet, robot: Robot
) -> None:
    operator = meet()
    operator.page.route_web_socket(re.compile("/ws/"), lambda socket: withhold(socket, "sdo.read"))
    operator.open(robot.name)
    operator.go_to("devices")
    operator.sees("[data-panel=devices]", "of – A continuous")
    before = operator.page.evaluate(PLACES)
    known = meet()
    known.open(robot.name)
    known.go_to("devices")
    known.sees("[data-panel=devices]", r"of \d+\.\d\d A continuous")
    assert known.page.evaluate(PLACES) == before
