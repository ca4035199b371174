"""Types, ranges, missing and unknown keys."""

from __future__ import annotations

import pytest

from vcan_tests.profiles.conftest import Mistakes, Robot


@pytest.mark.parametrize(
    ("yaml", "mistake"),
    [
        ("drives: {rear_left: {node: 0}}", "drives.rear_left.node: is 0; write a whole number from 1 to 127"),
        ("drives: {rear_left: {node: 200}}", "drives.rear_left.node: is 200; write a whole number from 1 to 127"),
        ("drives: {rear_left: {node: two}}", "drives.rear_left.node: is 'two'; write a whole number from 1 to 127"),
        ("drives: {rear_left: {node: true}}", "drives.rear_left.node: is true; write a whole number from 1 to 127"),
        ("drives: {rear_left: {node: 2.0}}", "drives.rear_left.node: is 2.0; write a whole number from 1 to 127"),
        ("drives: {rear_left: {gear_ratio: 0}}", "drives.rear_left.gear_ratio: is 0; write a number greater than 0"),
        (
            "drives: {rear_left: {gear_efficiency: 1.2}}",
            "drives.rear_left.gear_efficiency: is 1.2; write a number greater than 0 and to 1",
        ),
        ("drives: {rear_left: {direction: 2}}", "drives.rear_left.direction: is 2; write one of -1, 1"),
        ("drives: {rear_left: {direction: true}}", "drives.rear_left.direction: is true; write one of -1, 1"),
        ("drives: {rear_left: {motor: 5}}", "drives.rear_left.motor: is 5; write a mapping with the keys type, "),
        ("drives: 4", "drives: is 4; write a mapping"),
        ("drives: {9: {}}", "a key is not a text"),
        ("drives: {r-2 d2: {}}", "drives.r-2 d2: is not a name; use a text that matches "),
        ("brakes: {rear: {energise_to_release: 1}}", "brakes.rear.energise_to_release: is 1; write true or false"),
        ("vehicle: {mass_kg: }", "vehicle.mass_kg: is empty; write a number greater than 0"),
        ("vehicle: {mass_kg: [28]}", "vehicle.mass_kg: is a list of 1; write a number greater than 0"),
        ("vehicle: {mass_kg: {a: 1}}", "vehicle.mass_kg: is a mapping; write a number greater than 0"),
        ("vehicle: {wheels: [rear_left]}", "vehicle.wheels: is a list of 1; write a list of 4"),
        (
            "vehicle: {max_heading_deg: 90}",
            "vehicle.max_heading_deg: is 90; write a number greater than 0 and below 90",
        ),
        (
            "drives: {rear_left: {wheel_radius_m: 100}}",
            "drives.rear_left.wheel_radius_m: is 100; write a number from 0.001 to 1",
        ),
        ("vehicle: {wheelbase_m: 450}", "vehicle.wheelbase_m: is 450; write a number greater than 0 and to 20"),
        ("vehicle: {contact_offset_m: 75}", "vehicle.contact_offset_m: is 75; write a number from 0 to 5"),
        ("vehicle: {contact_lead_m: -10}", "vehicle.contact_lead_m: is -10; write a number from -5 to 5"),
        ("network: {bit_rate: 123456}", "network.bit_rate: is 123456; write one of 20000, 50000, 125000, "),
        ("encoders: {rear: {total_counts: few}}", "encoders.rear.total_counts: is 'few'; write a whole number from 1 "),
        ("description: 5", "description: is 5; write a text"),
        ("limits: {sped_m_s: 1}", "limits.sped_m_s: is an unknown key; did you mean speed_m_s?"),
        ("limits: {zz: 1}", "limits.zz: is an unknown key; known keys: speed_m_s, "),
        (
            "encoders: {new: {counts_per_turn: 1}}",
            "encoders.new.node: is missing; write node: with a whole number from 1",
        ),
    ],
)
def test_a_value_of_the_wrong_shape_is_a_mistake_on_its_line(mistakes: Mistakes, yaml: str, mistake: str) -> None:
    assert [found for found in mistakes(yaml) if found.startswith(f"lab.yaml:4: {mistake}")]


def test_a_length_in_millimetres_is_the_only_mistake_that_is_told(mistakes: Mistakes) -> None:
    assert len(mistakes("drives: {rear_left: {wheel_radius_m: 100}}")) == 1


def test_an_optional_value_may_be_empty(robot: Robot) -> None:
    assert robot("encoders: {rear: {total_counts: }}").profile.encoders["rear"].total_counts is None


def test_a_whole_number_will_do_for_a_number(robot: Robot) -> None:
    assert robot("vehicle: {mass_kg: 27}").profile.vehicle is not None
