"""Whether the parts of a profile fit together."""

from __future__ import annotations

from pathlib import Path

import pytest

from canhelm.errors import ConfigError
from profiles.loader import SHIPPED, load
from vcan_tests.profiles.conftest import Mistakes, Robot


@pytest.mark.parametrize(
    ("yaml", "mistake"),
    [
        ("drives: {rear_right: {node: 2}}", "drives.rear_right.node: node id 2 is taken by drives.rear_left.node ("),
        ("drives: {front_left: {node: 2}}", "drives.front_left.node: node id 2 is taken by drives.rear_left.node ("),
        ("encoders: {rear: {node: 1}}", "encoders.rear.node: node id 1 is taken by drives.rear_right.node ("),
        (
            "vehicle: {wheels: [rear_right, rear_left, front_left, middle]}",
            "vehicle.wheels[3]: drives has no 'middle'; use one of: rear_right, rear_left, front_left, front_right",
        ),
        (
            "vehicle: {wheels: [rear_right, rear_left, front_left, rear_left]}",
            "vehicle.wheels[3]: 'rear_left' stands here twice; name each of drives once",
        ),
        ("vehicle: {encoders: [rear, bow]}", "vehicle.encoders[1]: encoders has no 'bow'; use one of: rear, front"),
        ("vehicle: {brakes: [stern, front]}", "vehicle.brakes[0]: brakes has no 'stern'; use one of: rear, front"),
        ("brakes: {rear: {drive: middle}}", "brakes.rear.drive: drives has no 'middle'; use one of: rear_right"),
        ("brakes: {rear: {output: 3}}", "brakes.rear.output_bit: bit 12 does not drive output 3; write output_bit: 13"),
        (
            "brakes: {rear: {output_bit: 15}}",
            "brakes.rear.output_bit: bit 15 does not drive output 4; write output_bit: 12",
        ),
        ("brakes: {rear: {drive: front_left}}", "brakes.rear: output 4 of front_left already switches brakes.front ("),
        (
            "encoders: {rear: {total_counts: 4000}}",
            "encoders.rear.total_counts: is 4000, less than one turn; write 4096",
        ),
        (
            "encoders: {rear: {zero_counts: 4096}}",
            "encoders.rear.zero_counts: is 4096, outside the range; write 0 to 4095",
        ),
    ],
)
def test_parts_that_do_not_fit_are_a_mistake(mistakes: Mistakes, yaml: str, mistake: str) -> None:
    assert [found for found in mistakes(yaml) if f": {mistake}" in found]


@pytest.mark.parametrize(
    "yaml",
    ["drives: ", "brakes: {rear: {output: 99}}", "encoders: {rear: {counts_per_turn: 0}}", "encoders: 5"],
)
def test_one_mistake_is_told_once_and_draws_no_others(mistakes: Mistakes, yaml: str) -> None:
    assert len(mistakes(yaml)) == 1


@pytest.mark.parametrize(("version", "remedy"), [(0, "write schema_version: 1"), (2, "install a newer canhelm")])
def test_another_schema_version_is_a_mistake(tmp_path: Path, version: int, remedy: str) -> None:
    (tmp_path / "lab.yaml").write_text(f"extends: max2d\nschema_version: {version}\n")
    with pytest.raises(ConfigError, match=rf"lab\.yaml:2: schema_version: is {version}, .*; {remedy}"):
        load(tmp_path / "lab.yaml")


def test_two_brakes_on_two_outputs_of_one_drive_fit(robot: Robot) -> None:
    loaded = robot("brakes: {rear: {drive: front_left, output: 3, output_bit: 13}}")
    assert loaded.profile.brakes["rear"].output == 3


def test_a_weak_output_for_a_brake_is_a_warning(robot: Robot) -> None:
    assert "carries 100 mA only" in robot("brakes: {rear: {output: 3, output_bit: 13}}").warnings[0]


def test_a_limited_jerk_where_nothing_limits_it_is_a_warning(robot: Robot) -> None:
    (warning,) = robot("limits: {jerk_m_s3: 5}").warnings
    assert "lab.yaml:4: limits.jerk_m_s3: has no effect on a vehicle of type paired_steer" in warning


def test_omni_wheels_may_have_a_limited_jerk(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("schema_version: 1\nextends: turtle\nlimits: {jerk_m_s3: 5}\n")
    assert not [warning for warning in load(tmp_path / "lab.yaml").warnings if "jerk" in warning]


def test_a_clash_with_an_inherited_value_is_blamed_on_the_own_file(mistakes: Mistakes) -> None:
    shipped = (SHIPPED / "robots/max2d.yaml").read_text().splitlines()
    line = next(number for number, text in enumerate(shipped, 1) if "node: !assumed 5" in text)
    assert mistakes("drives: {rear_left: {node: 5}}") == [
        "lab.yaml:4: drives.rear_left.node: node id 5 is taken by encoders.rear.node "
        f"({SHIPPED}/robots/max2d.yaml:{line}); give each its own"
    ]
