"""Driving by hand: stick, keys, gamepad; whoever lets go, hides the page or looks elsewhere leaves a robot at rest."""

from __future__ import annotations

import math
from typing import Any

import pytest

from vcan_tests.station.browser import CONNECTED, PHONE, Operator
from vcan_tests.station.conftest import Meet
from vcan_tests.station.processes import UNHELD_S, Fleet, Robot, speeds
from vcan_tests.station.stick import drives

pytestmark = pytest.mark.station

ROBOTS = ("max2d", "semitrailer")
FAKE_PAD = """(() => {
    const buttons = Array.from({length: 17}, () => ({pressed: false, touched: false, value: 0}));
    const pad = {id: "a pad of the test", index: 0, connected: true, mapping: "standard", timestamp: 0,
                 axes: [0, 0, 0, 0], buttons};
    window.pad = pad;
    navigator.getGamepads = () => (pad.timestamp = performance.now(), [pad, null, null, null]);
})()"""
HIDE = """hidden => {
    Object.defineProperty(document, "hidden", {value: hidden, configurable: true});
    Object.defineProperty(document, "visibilityState", {value: hidden ? "hidden" : "visible", configurable: true});
    document.dispatchEvent(new Event("visibilitychange"));
}"""
"""What a browser does when another tab is chosen; a headless one shows all its tabs."""
SET_PAD = """([button, down, axis, value]) => {
    window.pad.buttons[button].pressed = down;
    window.pad.axes[axis] = value;
}"""
DEAD_MAN, STOP_BUTTON, SPEED_AXIS = 4, 0, 1


def moving(speed_m_s: float) -> Any:
    """Whether all wheels are at least so fast."""
    return lambda status: min(speeds(status)) > speed_m_s


@pytest.fixture
def driver(operator: Operator) -> Operator:
    """Somebody at the panel for driving."""
    operator.take_seat()
    return operator


def test_another_vehicle_is_chosen_and_shows_itself(meet: Meet, fleet: Fleet) -> None:
    operator = meet()
    operator.open("max2d")
    operator.comes_to(lambda: operator.page.is_visible("#slider-yaw_rate"), False)
    operator.choose("semitrailer")
    operator.sees("#state", "idle")
    operator.go_to("devices")
    operator.sees("[data-panel=devices]", "bending_angle")
    assert "rear_right" not in operator.text("[data-panel=devices]")


def test_the_stick_drives_and_the_robot_is_at_rest_within_the_lease_when_it_is_let_go_of(
    driver: Operator, robot: Robot
) -> None:
    driven = drives(driver, robot, moving(0.3), up=0.9)
    assert driven["motions"][0]["kind"] == "drive.set"
    driver.sees("#commanded", "speed 0.[3-9]")
    driver.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)
    driver.sees("#commanded", "nothing")


def test_the_stick_goes_aside_and_back(driver: Operator, robot: Robot) -> None:
    backward = drives(driver, robot, moving(0.2), up=-0.9)
    driver.page.mouse.up()
    assert all(node["speed_m_s"] < 0.0 for node in backward["nodes"] if node.get("speed_m_s") is not None)
    robot.comes_to_rest(UNHELD_S)


def test_keys_drive_while_they_are_held_and_only_when_they_are_switched_on(driver: Operator, robot: Robot) -> None:
    driver.page.keyboard.down("w")
    driver.page.keyboard.up("w")
    driver.catches_up()
    assert robot.status()["motions"] == []
    driver.page.get_by_role("button", name="Keyboard is off").click()
    driver.page.keyboard.down("w")
    robot.comes_to(moving(0.2))
    driver.page.keyboard.up("w")
    robot.comes_to_rest(UNHELD_S)


def test_the_stick_is_held_by_arrow_keys_when_it_has_the_focus(driver: Operator, robot: Robot) -> None:
    driver.page.focus(".stick")
    driver.page.keyboard.down("ArrowUp")
    robot.comes_to(moving(0.2))
    driver.page.keyboard.up("ArrowUp")
    robot.comes_to_rest(UNHELD_S)


@pytest.mark.parametrize("hand", [".stick", "#slider-speed"])
def test_no_key_drives_by_what_a_mouse_has_used(driver: Operator, robot: Robot, hand: str) -> None:
    driver.pulls(hand, right=0.0, up=0.3)
    driver.page.mouse.up()
    robot.comes_to(lambda status: not status["motions"])
    for key in ("ArrowUp", "ArrowRight", "w"):
        driver.page.keyboard.down(key)
        driver.catches_up()
        assert (key, robot.status()["motions"]) == (key, [])
        driver.page.keyboard.up(key)


def test_letters_drive_by_no_stick_that_has_the_focus_but_by_the_keyboard_that_is_on(
    driver: Operator, robot: Robot
) -> None:
    driver.page.focus(".stick")
    driver.sees(".stick", "the arrow keys drive")
    driver.page.keyboard.down("w")
    driver.catches_up()
    assert robot.status()["motions"] == []
    driver.page.keyboard.up("w")
    driver.page.get_by_role("button", name="Keyboard is off").click()
    driver.page.focus(".stick")
    driver.page.keyboard.down("w")
    robot.comes_to(moving(0.2))
    driver.page.keyboard.up("w")
    robot.comes_to_rest(UNHELD_S)


def test_a_slider_drives_only_while_it_is_held(driver: Operator, robot: Robot) -> None:
    box = driver.page.locator("#slider-speed").bounding_box()
    assert box is not None
    driver.page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + box["height"] / 2)
    driver.page.mouse.down()
    driver.page.mouse.move(box["x"] + box["width"] * 0.75, box["y"] + box["height"] / 2, steps=3)
    robot.comes_to(moving(0.2))
    driver.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)
    driver.comes_to(lambda: driver.page.input_value("#slider-speed"), "0")


def test_a_page_that_is_hidden_lets_go_and_does_not_go_on_when_it_is_seen_again(driver: Operator, robot: Robot) -> None:
    drives(driver, robot, moving(0.2), up=0.9)
    driver.page.evaluate(HIDE, True)
    robot.comes_to_rest(UNHELD_S)
    driver.page.evaluate(HIDE, False)
    driver.sees("#connection", CONNECTED)
    driver.catches_up()
    robot.stays_at_rest()
    driver.page.mouse.up()


def test_another_panel_lets_go(driver: Operator, robot: Robot) -> None:
    drives(driver, robot, moving(0.2), up=0.9)
    driver.page.evaluate("() => { location.hash = '#devices'; }")
    robot.comes_to_rest(UNHELD_S)
    driver.page.mouse.up()


def test_a_page_that_freezes_leaves_a_robot_at_rest(driver: Operator, robot: Robot) -> None:
    drives(driver, robot, moving(0.2), up=0.9)
    driver.page.evaluate("() => void setTimeout(() => { const end = Date.now() + 2500; while (Date.now() < end); })")
    robot.comes_to_rest(UNHELD_S)
    driver.page.mouse.up()


@pytest.fixture
def pad_driver(meet: Meet, robot: Robot) -> Operator:
    """Somebody with a gamepad."""
    operator = meet()
    operator.context.add_init_script(FAKE_PAD)
    operator.open(robot.name)
    operator.take_seat()
    operator.sees("[data-panel=drive]", "Hold BTN_TL to drive")
    return operator


def test_a_gamepad_drives_while_its_dead_man_button_is_held(pad_driver: Operator, robot: Robot) -> None:
    pad_driver.page.evaluate(SET_PAD, [DEAD_MAN, True, SPEED_AXIS, 0.0])
    pad_driver.sees("[data-panel=drive]", "Driving by gamepad")
    pad_driver.page.evaluate(SET_PAD, [DEAD_MAN, True, SPEED_AXIS, -0.9])
    robot.comes_to(moving(0.2))
    pad_driver.page.evaluate(SET_PAD, [DEAD_MAN, False, SPEED_AXIS, -0.9])
    robot.comes_to_rest(UNHELD_S)


def test_a_gamepad_whose_stick_is_off_its_middle_does_not_begin_to_drive(pad_driver: Operator, robot: Robot) -> None:
    pad_driver.page.evaluate(SET_PAD, [DEAD_MAN, True, SPEED_AXIS, -0.9])
    pad_driver.sees("[data-panel=drive]", "Let the sticks go back to their middle")
    pad_driver.catches_up()
    assert robot.status()["motions"] == []


def test_a_button_of_the_gamepad_stops_the_robot_that_somebody_else_drives(pad_driver: Operator, robot: Robot) -> None:
    robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.3, duration_s=60.0, wait=False)
    robot.comes_to(moving(0.2))
    pad_driver.page.evaluate(SET_PAD, [STOP_BUTTON, True, SPEED_AXIS, 0.0])
    robot.comes_to_rest(UNHELD_S)


def test_what_the_vehicle_has_not_got_is_left_out(meet: Meet, fleet: Fleet) -> None:
    operator = meet()
    operator.open("semitrailer")
    operator.take_seat()
    operator.comes_to(lambda: operator.page.is_enabled("#slider-steering"), True)
    for part in (
        "#slider-yaw_rate",
        "form[data-motion='drive.rotate']",
        "form[data-motion='steer']",
        "#slider-direction",
    ):
        assert (part, operator.page.is_visible(part)) == (part, False)
    assert "brake" not in operator.text("[data-panel=drive]").lower()


def test_the_semi_trailer_steers_by_the_stick(meet: Meet, fleet: Fleet) -> None:
    truck = fleet.robots["semitrailer"]
    operator = meet()
    operator.open("semitrailer")
    operator.take_seat()
    operator.sees("[data-panel=drive]", "aside: steering")
    operator.pulls(".stick", right=-0.7, up=0.7)
    driven = truck.comes_to(lambda status: status["vehicle"]["steering_deg"] > 5.0 and max(speeds(status)) > 0.05)
    operator.page.mouse.up()
    truck.comes_to_rest(UNHELD_S)
    assert not math.isclose(driven["vehicle"]["pose"]["x_m"], truck.status()["vehicle"]["pose"]["x_m"])


def test_a_thumb_on_a_phone_drives(meet: Meet, robot: Robot) -> None:
    operator = meet(**PHONE)
    operator.open(robot.name)
    operator.take_seat()
    operator.page.locator(".stick").scroll_into_view_if_needed()
    box = operator.page.locator(".stick").bounding_box()
    assert box is not None
    touch = operator.context.new_cdp_session(operator.page)
    place = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
    up = {"x": place["x"], "y": place["y"] - 0.4 * box["height"]}
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [place]})
    touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [up]})
    robot.comes_to(moving(0.2))
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    robot.comes_to_rest(UNHELD_S)
