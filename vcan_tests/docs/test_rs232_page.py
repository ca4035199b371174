"""The figures of the page on the serial line are those that the program computes for the MAX2D."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from drivers.epos.serial_plan import (
    facts,
    serial_profile,
    stopping_time_s,
    stopping_turn_rad,
    stopping_way_m,
)
from profiles.loader import load

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "rs232.md").read_text("utf-8")
MAX2D = load("max2d").profile
BAUDS = (115200, 38400)
SPEED = re.compile(r"^[|] (\d+) [|] ([\d.]+) m/s [|] .* [|] ([^|]*) [|]$", re.M)
PAIR = re.compile(r"^[|] (\d+) [|] turned a pair [|] .* [|] ([^|]*) [|]$", re.M)


@pytest.mark.parametrize("baud", BAUDS)
def test_rate_and_speed_limit_of_the_page_are_those_of_the_plan(baud: int) -> None:
    planned = facts(MAX2D, baud)
    assert f"| {baud} | {planned['planned_hz']} | {planned['speed_limit_m_s']} m/s |" in PAGE


@pytest.mark.parametrize("baud", BAUDS)
def test_what_the_doctor_says_of_a_pulled_cable_stands_on_the_page(baud: int) -> None:
    planned = facts(MAX2D, baud)
    assert f"{planned['silent_line_stop_s']} s and {planned['silent_line_stop_m']} m at {baud} baud" in PAGE


def test_the_formula_is_worked_out_for_each_speed() -> None:
    rows = SPEED.findall(PAGE)
    assert {int(baud) for baud, _, _ in rows} == set(BAUDS)
    for baud, speed, told in rows:
        profile = serial_profile(MAX2D, int(baud))
        computed = stopping_time_s(profile, float(speed)), stopping_way_m(profile, float(speed))
        assert told == "{:.2f} s, {:.2f} m".format(*computed)


def test_the_formula_is_worked_out_for_a_pair_that_is_turned() -> None:
    rows = PAIR.findall(PAGE)
    assert {int(baud) for baud, _ in rows} == set(BAUDS)
    for baud, told in rows:
        profile = serial_profile(MAX2D, int(baud))
        took_s, turn_rad = stopping_time_s(profile, profile.limits.steering_rim_speed_m_s), stopping_turn_rad(profile)
        assert turn_rad is not None
        assert told == f"{took_s:.2f} s, {math.degrees(turn_rad):.0f} degrees"
