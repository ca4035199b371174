"""From sticks to set-points: properties of the shape, and what each kind of vehicle is asked."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.gamepad.mapping import Buttons, Mapping, Stick

SHARES = st.floats(-1.0, 1.0)
STICKS = st.builds(
    Stick,
    axis=st.just("ABS_Y"),
    sign=st.sampled_from((-1, 1)),
    dead_zone=st.floats(0.0, 0.9),
    exponent=st.floats(0.2, 5.0),
    least=st.floats(-3.0, 0.0),
    full=st.floats(0.1, 3.0),
    unit=st.just("m/s"),
)


def stick(axis: str, full: float, least: float | None = None) -> dict[str, Any]:
    least = -full if least is None else least
    shape = {"sign": -1, "dead_zone": 0.1, "exponent": 1.0, "unit": "m/s"}
    return {"axis": axis, "least": least, "full": full, **shape}


def mapping(sticks: dict[str, dict[str, Any]], taken_at_rest: tuple[str, ...] = ()) -> Mapping:
    buttons = {"dead_man": "BTN_TL", "stop": None, "emergency_stop": None}
    rest = {"taken_at_rest": list(taken_at_rest), "silence_s": None, "rest_s": 1.0}
    return Mapping({"sticks": sticks, "buttons": buttons, **rest})


def parameters(mapping: Mapping, **positions: float) -> dict[str, float]:
    return mapping.parameters(mapping.commands(lambda axis: positions.get(axis, 0.0)))


@given(STICKS, SHARES)
def test_a_value_stays_between_the_ends(stick: Stick, position: float) -> None:
    assert stick.least - 1e-12 <= stick.value(position) <= stick.full + 1e-12


@given(STICKS, SHARES, SHARES)
def test_more_of_the_way_never_gives_less(stick: Stick, one: float, other: float) -> None:
    low, high = sorted((one * stick.sign, other * stick.sign))
    assert stick.value(low * stick.sign) <= stick.value(high * stick.sign) + 1e-12


@given(STICKS)
def test_the_ends_of_the_way_give_the_ends_of_the_range(stick: Stick) -> None:
    ends = stick.value(-float(stick.sign)), stick.value(float(stick.sign))
    assert ends == pytest.approx((stick.least, stick.full))


@given(STICKS, SHARES)
def test_in_the_dead_zone_and_only_there_it_rests(stick: Stick, position: float) -> None:
    assert stick.rests(position) == (abs(position) <= stick.dead_zone)
    assert stick.value(position) == 0.0 or not stick.rests(position)


@given(STICKS)
def test_there_is_no_jump_at_the_edge_of_the_dead_zone(stick: Stick) -> None:
    """One millionth of what is left of the way, at the least exponent of 0.2, gives a sixteenth of the end."""
    edge = stick.dead_zone + 1e-6 * (1.0 - stick.dead_zone)
    assert abs(stick.value(edge * stick.sign)) <= stick.full * 1e-6**0.2 * 1.01


def test_forward_is_away_from_the_person_and_steering_left_is_positive() -> None:
    car = mapping({"speed": stick("ABS_Y", 2.0, 0.0), "steering": stick("ABS_RX", 45.0)})
    assert parameters(car, ABS_Y=-1.0, ABS_RX=-1.0) == {"speed_m_s": 2.0, "steering_deg": 45.0}


def test_a_car_without_a_reverse_gear_is_never_asked_to_drive_backward() -> None:
    car = mapping({"speed": stick("ABS_Y", 2.0, 0.0)})
    assert parameters(car, ABS_Y=1.0)["speed_m_s"] == 0.0


OMNI = {"speed": stick("ABS_Y", 1.2), "sideways": stick("ABS_X", 1.2), "yaw_rate": stick("ABS_RX", 90.0)}


@pytest.mark.parametrize(
    ("x", "y", "direction_deg"), [(0, -1, 0), (-1, 0, 90), (-1, -1, 45), (1, 1, -135), (0, 1, 180), (1, 0, -90)]
)
def test_on_omni_wheels_the_left_stick_points_where_it_goes(x: float, y: float, direction_deg: float) -> None:
    asked = parameters(mapping(OMNI), ABS_X=x, ABS_Y=y)
    assert asked == pytest.approx({"speed_m_s": 1.2, "direction_deg": direction_deg, "yaw_rate_deg_s": 0.0})


@given(SHARES, SHARES)
def test_both_ways_at_once_are_no_faster_than_the_limit(x: float, y: float) -> None:
    asked = parameters(mapping(OMNI), ABS_X=x, ABS_Y=y)
    assert 0.0 <= asked["speed_m_s"] <= 1.2
    assert -180.0 <= asked["direction_deg"] <= 180.0


def paired() -> Mapping:
    sticks = {"speed": stick("ABS_Y", 1.2), "direction": stick("ABS_X", 85.0), "steering": stick("ABS_RX", 25.0)}
    return mapping(sticks, ("direction", "steering"))


def test_a_robot_that_stands_to_steer_keeps_the_direction_of_the_moment_at_which_it_began() -> None:
    robot = paired()
    assert parameters(robot, ABS_X=-1.0)["direction_deg"] == 0.0
    assert parameters(robot, ABS_X=-1.0, ABS_Y=-0.5)["direction_deg"] == 85.0
    assert parameters(robot, ABS_X=0.3, ABS_Y=-1.0, ABS_RX=1.0) == pytest.approx(
        {"speed_m_s": 1.2, "direction_deg": 85.0, "steering_deg": 0.0}
    )


def test_its_next_direction_counts_after_the_speed_was_zero() -> None:
    robot = paired()
    parameters(robot, ABS_X=-1.0, ABS_Y=-0.5)
    assert parameters(robot, ABS_X=1.0)["direction_deg"] == 85.0
    assert parameters(robot, ABS_X=1.0, ABS_Y=0.5)["direction_deg"] == -85.0


@given(st.lists(st.tuples(SHARES, SHARES), max_size=20))
def test_while_it_rolls_its_direction_never_changes(moves: list[tuple[float, float]]) -> None:
    robot, last = paired(), (0.0, 0.0)
    for x, y in moves:
        asked = parameters(robot, ABS_X=x, ABS_Y=y)
        if last[0] and asked["speed_m_s"]:
            assert asked["direction_deg"] == last[1]
        last = asked["speed_m_s"], asked["direction_deg"]


@given(SHARES, SHARES, SHARES)
def test_neutral_sticks_ask_for_nothing(x: float, y: float, turn: float) -> None:
    robot, positions = mapping(OMNI), {"ABS_X": x, "ABS_Y": y, "ABS_RX": turn}
    asked = parameters(robot, **positions)
    still = asked["speed_m_s"] == 0.0 and asked["yaw_rate_deg_s"] == 0.0
    assert still or not robot.neutral(lambda axis: positions[axis])
    assert math.isfinite(sum(asked.values()))


def test_the_commands_are_told_with_their_units() -> None:
    assert mapping({"speed": stick("ABS_Y", 2.0)}).words({"speed": 0.5}) == "speed 0.50 m/s"


@pytest.mark.parametrize(
    ("stop", "emergency_stop", "told"),
    [
        ("BTN_SOUTH", "BTN_EAST", "BTN_SOUTH stops, BTN_EAST is the emergency stop"),
        (None, "BTN_EAST", "BTN_EAST is the emergency stop"),
        (None, None, "no button stops"),
    ],
)
def test_the_legend_names_no_button_that_is_not_there(stop: str | None, emergency_stop: str | None, told: str) -> None:
    robot = mapping({"speed": stick("ABS_Y", 2.0)})
    robot.buttons = Buttons("BTN_TL", stop, emergency_stop)
    assert robot.legend() == f"ABS_Y speed; {told}"
