"""A pad drives from the page as it does by ``canhelm drive joystick``."""

from __future__ import annotations

import random
from typing import Any

import pytest

from daemon.gamepad.mapping import Mapping
from vcan_tests.station.browser import Operator

pytestmark = pytest.mark.station

STEPS = 300
SET_POINTS = """async ([sticks, taken, fastest, steps]) => {
    const mapping = await import("/page/mapping.js");
    const kept = new mapping.TakenAtRest(taken);
    return steps.map(axes => {
        const given = ([name, stick]) => [name, mapping.stickValue(stick, axes[stick.axis])];
        const values = Object.entries(sticks).map(given);
        return mapping.parametersOf(kept.apply(Object.fromEntries(values)), fastest);
    });
}"""


def stick(axis: str, least: float, full: float, unit: str) -> dict[str, Any]:
    """As ``drive.gamepad`` tells it."""
    return {
        "axis": axis, "sign": -1, "dead_zone": 0.12, "exponent": 1.6, "least": least, "full": full, "unit": unit
    }  # fmt: skip


OMNI = {
    "speed": stick("ABS_Y", -1.2, 1.2, "m/s"),
    "sideways": stick("ABS_X", -1.2, 1.2, "m/s"),
    "yaw_rate": stick("ABS_RX", -90.0, 90.0, "deg/s"),
}
PAIRED = {
    "speed": stick("ABS_Y", -1.2, 1.2, "m/s"),
    "steering": stick("ABS_RX", -30.0, 30.0, "deg"),
    "direction": stick("ABS_X", -90.0, 90.0, "deg"),
}
TRUCK = {"speed": stick("ABS_Y", -0.2, 0.4, "m/s"), "steering": stick("ABS_RX", -35.0, 35.0, "deg")}


def told(sticks: dict[str, Any], taken: list[str]) -> dict[str, Any]:
    """A result of ``drive.gamepad``."""
    buttons = {"dead_man": "BTN_TL", "stop": "BTN_SOUTH", "emergency_stop": "BTN_EAST"}
    return {"sticks": sticks, "buttons": buttons, "taken_at_rest": taken, "silence_s": 5.0, "rest_s": 1.0}


@pytest.mark.parametrize(
    ("sticks", "taken"), [(OMNI, []), (PAIRED, ["direction", "steering"]), (TRUCK, [])], ids=["omni", "paired", "truck"]
)
def test_the_page_commands_what_the_joystick_command_does(
    operator: Operator, sticks: dict[str, Any], taken: list[str]
) -> None:
    dice = random.Random(4)
    steps = [{each["axis"]: dice.uniform(-1.0, 1.0) for each in sticks.values()} for _ in range(STEPS)]
    mapping, fastest = Mapping(told(sticks, taken)), sticks["speed"]["full"]
    shown = operator.page.evaluate(SET_POINTS, [sticks, taken, fastest, steps])
    compared = 0
    for axes, theirs in zip(steps, shown, strict=True):
        ours = mapping.parameters(mapping.commands(axes.__getitem__))
        if ours["speed_m_s"]:
            assert theirs == pytest.approx(ours)
            compared += 1
    assert compared > STEPS / 2
