"""Devices, events, objects and the simulation on the page."""

from __future__ import annotations

import re
from typing import Any

import pytest

from vcan_tests.station.browser import CONNECTED, Operator
from vcan_tests.station.processes import UNHELD_S, Robot, Status, speeds

pytestmark = pytest.mark.station

ROBOTS = ("max2d",)
DRIVE = "front_left"
SLOW_RPM = 100.0
DRIVES = 4
CARD = f"article[aria-label='Drive {DRIVE}']"
FORWARD = f"{CARD} button.hold:last-of-type"
OBJECTS, SIMULATION = "[data-panel=objects]", "[data-panel=simulation]"
RAMP = "0x6083"
CONNECT_ANEW = "import('/page/station.js').then(({station}) => (station.choose(null), station.choose('max2d')))"

MANY_EVENTS = """import('/page/events.js').then(({EventLog}) => {
    const log = new EventLog();
    for (let at = 1; at <= 700; at++) log.add({time_s: at, source: "a", message: "b"}, "max2d", at);
    return log.events.map(({at_ms}) => at_ms);
})"""


def turning(status: Status) -> bool:
    """Whether the drive turns as fast as a jog asks for at first."""
    node = next(node for node in status["nodes"] if node["name"] == DRIVE)
    return bool(node["velocity_rpm"] > 0.8 * SLOW_RPM)


def sees_devices(operator: Operator) -> None:
    """Open the panel of devices; returns when all values are drawn, and no later one pushes the buttons down."""
    operator.go_to("devices")
    whole = operator.page.locator("article", has_text=re.compile(r"Velocity.*A continuous", re.DOTALL))
    operator.comes_to(whole.count, DRIVES)


def jogs(operator: Operator, robot: Robot) -> None:
    """Press the button that turns the motor, and wait until it turns."""
    sees_devices(operator)
    operator.page.locator(FORWARD).scroll_into_view_if_needed()
    operator.page.hover(FORWARD)
    operator.page.mouse.down()
    robot.comes_to(turning)


def test_a_drive_is_enabled_and_disabled_from_its_card(operator: Operator, robot: Robot) -> None:
    operator.go_to("devices")
    operator.page.click(f"{CARD} >> text=Enable")
    operator.sees(CARD, "enabled: power stage on")
    assert [node["name"] for node in robot.status()["nodes"] if node.get("state") == "enabled"] == [DRIVE]
    operator.page.click(f"{CARD} >> text=Disable")
    operator.sees(CARD, "disabled: power stage off")


def test_a_motor_turns_as_long_as_its_button_is_held(operator: Operator, robot: Robot) -> None:
    jogs(operator, robot)
    operator.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)


def test_a_button_that_is_pressed_again_at_once_turns_the_motor_again(operator: Operator, robot: Robot) -> None:
    jogs(operator, robot)
    first = robot.status()["motions"][0]["motion"]
    operator.page.mouse.up()
    operator.page.mouse.down()
    robot.comes_to(lambda status: turning(status) and status["motions"][0]["motion"] != first)
    operator.page.mouse.up()
    robot.comes_to_rest(UNHELD_S)
    operator.catches_up()
    assert operator.text("#alarms") == ""


def test_a_motor_that_is_jogged_stops_when_the_page_is_gone(operator: Operator, robot: Robot) -> None:
    jogs(operator, robot)
    operator.page.close()
    robot.comes_to_rest(UNHELD_S)


def test_a_motor_that_is_jogged_by_a_key_stops_when_the_focus_goes_elsewhere(operator: Operator, robot: Robot) -> None:
    sees_devices(operator)
    operator.page.focus(FORWARD)
    operator.page.keyboard.down("Enter")
    robot.comes_to(turning)
    operator.page.focus("#robot")
    robot.comes_to_rest(UNHELD_S)
    operator.page.keyboard.up("Enter")


def test_a_jog_that_is_too_fast_is_refused_in_words(operator: Operator, robot: Robot) -> None:
    sees_devices(operator)
    operator.page.fill(f"{CARD} input.number", "90000")
    operator.page.hover(FORWARD)
    operator.page.mouse.down()
    operator.sees("#alarms", "beyond the limit of front_left.*ask for less")
    operator.page.mouse.up()
    operator.catches_up()
    robot.stays_at_rest()


def test_the_statusword_is_told_in_words_where_somebody_asks(operator: Operator) -> None:
    operator.go_to("devices")
    operator.page.click(f"{CARD} summary")
    operator.sees(f"{CARD} details", "statusword 0x1140: switch on disabled")


def test_a_fault_is_told_with_its_cure_and_counted_on_the_tab(
    operator: Operator, robot: Robot, expected_errors: list[str]
) -> None:
    expected_errors.append("over-temperature")
    operator.go_to("devices")
    robot.call("simulation.fault", kind="emcy", part=DRIVE, code=0x4210)
    operator.sees(CARD, "over-temperature.*what to do: let it cool down")
    operator.until(
        lambda: "new warnings or errors" in (operator.page.get_attribute("[data-tab=events]", "aria-label") or ""),
        lambda: "the tab tells of nothing new",
    )
    operator.go_to("events")
    operator.sees("ol.events", r"error\s+max2d: front_left\s+.*over-temperature")
    operator.comes_to(lambda: operator.page.get_attribute("[data-tab=events]", "data-unread"), None)


def test_a_node_without_power_is_told_as_lost_and_its_values_as_old(
    operator: Operator, robot: Robot, expected_errors: list[str]
) -> None:
    expected_errors.append("is lost")
    operator.go_to("simulation")
    operator.page.click(f"button[aria-label='Off: power of {DRIVE}']")
    operator.go_to("devices")
    operator.sees(CARD, "lost: not heard")
    operator.sees(CARD, "the last before it was lost")
    operator.comes_to(lambda: operator.page.is_disabled(FORWARD), True)
    operator.go_to("simulation")
    operator.page.click(f"button[aria-label='On: power of {DRIVE}']")
    operator.go_to("devices")
    operator.sees(CARD, "disabled: power stage off")


def test_events_are_filtered_by_words(operator: Operator) -> None:
    operator.go_to("events")
    operator.sees("[data-panel=events]", "configured, started and guarded")
    operator.page.fill("[data-panel=events] input[type=search]", "no such words")
    operator.sees("[data-panel=events]", "^(?!.*configured)(?s:.)*0 of")


def test_events_of_an_earlier_connection_are_kept_once(operator: Operator) -> None:
    operator.go_to("events")
    operator.sees("[data-panel=events]", "configured, started and guarded")
    operator.catches_up()
    before = operator.page.locator("ol.events li").count()
    operator.page.evaluate(CONNECT_ANEW)
    operator.sees("#connection", CONNECTED)
    operator.catches_up()
    assert operator.page.locator("ol.events li").count() == before


def test_the_newest_500_events_are_kept(operator: Operator) -> None:
    operator.go_to("events")
    times = operator.page.evaluate(MANY_EVENTS)
    assert times == list(range(700, 200, -1))


def chooses(operator: Operator, words: str) -> None:
    """Search an object, and choose the first that is found."""
    operator.go_to("objects")
    operator.page.select_option(f"{OBJECTS} select", DRIVE)
    operator.page.fill(f"{OBJECTS} input[type=search]", words)
    operator.page.click(f"{OBJECTS} tbody button >> nth=0")


def test_an_object_is_found_by_its_name_and_read(operator: Operator, robot: Robot) -> None:
    chooses(operator, "profile acceleration")
    operator.sees(f"{OBJECTS} .value", f"{robot.call('sdo.read', node=DRIVE, object=RAMP)['value']} rpm/s")


def test_an_object_that_can_only_be_read_has_no_field_for_a_value(operator: Operator) -> None:
    chooses(operator, "statusword")
    operator.sees(f"{OBJECTS} .value", "switch on disabled")
    operator.catches_up()
    assert not operator.page.is_visible(f"{OBJECTS} form")


def test_an_object_is_written_when_old_and_new_value_were_seen(operator: Operator, robot: Robot) -> None:
    old = robot.call("sdo.read", node=DRIVE, object=RAMP)["value"]
    chooses(operator, RAMP)
    operator.page.fill(f"{OBJECTS} form input", "1234")
    operator.page.keyboard.press("Enter")
    operator.sees(f"{OBJECTS} .question", f"is {old} rpm/s.*Write 1234 rpm/s")
    assert robot.call("sdo.read", node=DRIVE, object=RAMP)["value"] == old
    operator.page.click("text=Write it")
    operator.sees(f"{OBJECTS} [role=status].value", "Written: 1234")
    assert robot.call("sdo.read", node=DRIVE, object=RAMP)["value"] == 1234
    robot.call("sdo.write", node=DRIVE, object=RAMP, value=old)


def test_a_value_that_does_not_fit_is_refused_in_the_daemons_words(operator: Operator) -> None:
    chooses(operator, RAMP)
    operator.page.fill(f"{OBJECTS} form input", "fast")
    operator.page.keyboard.press("Enter")
    operator.page.click("text=Write it")
    operator.sees(f"{OBJECTS} [role=status].value", "'fast' is no whole number.*takes a whole number")


def faults(robot: Robot) -> list[dict[str, Any]]:
    """The faults that were set, as the daemon tells them."""
    found: list[dict[str, Any]] = robot.call("simulation.faults")["faults"]
    return found


def test_all_wheels_are_put_on_ice_and_back(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.click("text=All wheels on ice")
    operator.sees(SIMULATION, "Take the ice from rear_left")
    wheels = ("front_left", "front_right", "rear_left", "rear_right")
    operator.comes_to(
        lambda: {fault["part"]: fault["friction"] for fault in faults(robot)}, dict.fromkeys(wheels, 0.02)
    )
    operator.page.click("text=Take all ice away")
    operator.sees(SIMULATION, "No fault is set")
    operator.comes_to(lambda: faults(robot), [])


def test_a_kind_of_fault_is_asked_for_what_it_takes_alone(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    form = f"{SIMULATION} form.fault-form"
    operator.page.select_option(f"{form} select >> nth=0", "ice")
    labels = operator.page.locator(f"{form} .field label")
    fields = ["part", "friction", "for", "at", "at"]
    operator.comes_to(lambda: [label.split()[0] for label in labels.all_text_contents()], fields)
    operator.page.select_option(f"{form} select >> nth=0", "encoder_jump")
    operator.page.select_option(f"{form} select >> nth=1", "front")
    operator.page.fill(f"{form} input >> nth=0", "1")
    operator.page.click("text=Set this fault")
    operator.sees(f"{SIMULATION} table:has-text('Faults that were set')", "encoder_jump\\s+angle_deg 1")
    (fault,) = faults(robot)
    assert (fault["kind"], fault["part"], fault["angle_deg"]) == ("encoder_jump", "front", 1.0)


def test_the_robot_is_put_onto_blocks(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.click("text=Put onto blocks")
    operator.sees(SIMULATION, "its wheels in the air")
    assert robot.call("simulation.look")["lifted"] is True
    operator.page.click("text=Put down")
    operator.sees(SIMULATION, "It stands on the floor")


def test_a_slope_rolls_a_robot_that_nobody_holds(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.fill(f"{SIMULATION} form[aria-label=Slope] input >> nth=0", "15")
    operator.page.click(f"{SIMULATION} >> text=Tilt")
    operator.sees(SIMULATION, "The floor has a slope of 15°")
    robot.comes_to(lambda status: max(speeds(status)) > 0.02)
    operator.page.click("text=Make level")
    operator.sees(SIMULATION, "The floor is level")


def test_the_speed_of_time_is_set_and_told_as_the_daemon_has_it(operator: Operator, robot: Robot) -> None:
    operator.go_to("simulation")
    operator.page.select_option("text=Time passes at", "2")
    operator.sees("#notes", "time passes at 2 × real time")
    assert robot.status()["pace"] == 2.0
    operator.go_to("drive")
    robot.call("simulation.pace", factor=1.0)
    operator.go_to("simulation")
    operator.comes_to(lambda: operator.page.input_value("text=Time passes at"), "1")
