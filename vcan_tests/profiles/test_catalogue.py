"""The catalogue of motors, encoders and gears, and its use in a profile."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest

from canhelm.errors import ConfigError
from profiles.catalogue import Part, parts
from profiles.provenance import plain
from profiles.schema import DriveConfig, Motor
from vcan_tests.profiles.conftest import Mistakes, Robot

MOTORS = [part for part in parts().values() if part.kind == "motor"]
DRIVE_FIELDS = {field.name for field in msgspec.structs.fields(DriveConfig)}


@pytest.mark.parametrize("part", parts().values(), ids=lambda part: f"{part.order_number} {part.kind}")
def test_a_part_is_complete_and_has_a_source(part: Part) -> None:
    assert part.order_number.isdigit()
    assert part.source.startswith("maxon")
    if part.kind == "motor":
        assert msgspec.convert(plain(part.data), Motor)
    else:
        wanted = {"encoder": {"encoder_pulses_per_turn", "position_sensor"}, "gear": {"gear_ratio", "gear_efficiency"}}
        assert part.data.entries.keys() == wanted[part.kind]
        assert part.data.entries.keys() <= DRIVE_FIELDS


@pytest.mark.parametrize("part", MOTORS, ids=lambda part: part.name)
def test_a_motors_values_agree_with_each_other(part: Part) -> None:
    """Torque within 15 %; voltage within 20 %, because the nominal point holds for a warm winding."""
    motor = msgspec.convert(plain(part.data), Motor)
    torque = motor.torque_constant_n_m_a * (motor.nominal_current_a - motor.no_load_current_a)
    speed_rad_s = motor.nominal_speed_rpm * math.pi / 30.0
    voltage = motor.torque_constant_n_m_a * speed_rad_s + motor.resistance_ohm * motor.nominal_current_a
    assert torque == pytest.approx(motor.nominal_torque_n_m, rel=0.15)
    assert voltage == pytest.approx(motor.nominal_voltage_v, rel=0.2)


def test_a_profile_takes_a_motor_by_its_order_number(robot: Robot) -> None:
    lines = "drives: {rear_left: {motor: {extends: catalogue/268214}, continuous_current_a: 2.6}}"
    loaded = robot(lines)
    assert loaded.profile.drives["rear_left"].motor.type == "brushed_dc"
    assert "catalogue.yaml:" in loaded.origin["drives.rear_left.motor.resistance_ohm"]


def test_a_drive_is_laid_over_several_parts(robot: Robot) -> None:
    lines = "drives: {rear_left: {extends: [devices/max2d_wheel_drive, catalogue/225787, catalogue/203116]}}"
    drive = robot(lines).profile.drives["rear_left"]
    assert (drive.encoder_pulses_per_turn, drive.gear_ratio, drive.wheel_radius_m) == (1024, 15.1667, 0.1)


def test_what_is_assumed_in_the_catalogue_is_assumed_in_the_profile(robot: Robot) -> None:
    loaded = robot("drives: {rear_left: {extends: catalogue/203116}}")
    assert "drives.rear_left.gear_efficiency" in loaded.assumed


def test_an_unknown_number_is_told_with_its_line(mistakes: Mistakes) -> None:
    assert mistakes("drives: {rear_left: {extends: catalogue/1}}")[0].startswith(
        "lab.yaml:4: extends: the catalogue has no '1'; `canhelm profile catalogue` lists its parts"
    )


def test_a_list_with_something_else_than_names_is_a_mistake(mistakes: Mistakes) -> None:
    assert "is not a name" in mistakes("drives: {rear_left: {extends: [catalogue/203116, {a: 1}]}}")[0]


@pytest.mark.parametrize("text", ["", "[1]", "'1': 2", "'1': {kind: motor, name: a, data: {}}"])
def test_a_broken_catalogue_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "catalogue.yaml").write_text(text)
    with pytest.raises(ConfigError):
        parts(tmp_path / "catalogue.yaml")
