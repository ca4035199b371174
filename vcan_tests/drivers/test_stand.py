"""Drives on a stand: simulated wheels in the air."""

from __future__ import annotations

import msgspec
import pytest

from canhelm.errors import ConfigError
from drivers.simulated.stand import StandWorld
from profiles.loader import load

TURTLE = load("turtle").profile


class Current:
    """A torque source of a constant current."""

    def __init__(self, current_a: float) -> None:
        self.current_a = current_a

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        return self.current_a


def test_one_wheel_turns_and_the_others_rest() -> None:
    world = StandWorld(TURTLE, TURTLE.drives)
    world.advance(0.0)
    world.axes["wheel_1"].torque_source = Current(1.0)
    world.advance(0.1)
    assert abs(world.axes["wheel_1"].speed_rad_s) > 10.0
    assert world.axes["wheel_2"].speed_rad_s == 0.0
    assert world.pose == (0.0, 0.0, 0.0)


def test_without_current_friction_brings_it_to_rest() -> None:
    world = StandWorld(TURTLE, ["wheel_1"])
    world.advance(0.0)
    world.axes["wheel_1"].torque_source = Current(1.0)
    world.advance(0.1)
    world.axes["wheel_1"].torque_source = None
    world.advance(30.0)
    assert world.axes["wheel_1"].speed_rad_s == 0.0


def test_drives_need_a_supply() -> None:
    with pytest.raises(ConfigError, match="section simulation") as refused:
        StandWorld(msgspec.structs.replace(TURTLE, simulation=None), TURTLE.drives)
    assert refused.value.remedy


def test_no_drives_need_none() -> None:
    world = StandWorld(load("nxt").profile, ())
    world.advance(1.0)
    assert not world.moving
