"""Finding, extending and loading profiles."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from canhelm.errors import ConfigError
from profiles.loader import SHIPPED, ProfileError, available, find, load
from vcan_tests.profiles.conftest import HEAD, Mistakes, Robot

YAML_PIECES = st.lists(
    st.sampled_from(
        [
            *("schema_version", "name", "extends", "drives", "limits", "vehicle", "network", "node", "simulation"),
            *(": ", "\n", "\n  ", "\n    ", "- ", "{", "}", "[", "]", ", ", "!assumed ", "!!int ", "&a ", "*a", "<<"),
            *(
                "max2d",
                "devices/ec40",
                "1",
                "0",
                "-1e999",
                "9" * 30,
                ".nan",
                "~",
                "true",
                "'",
                '"',
                "#",
                "|",
                "\x00",
                "é",
            ),
        ]
    ),
    max_size=25,
).map("".join)


def test_the_shipped_robot_loads_by_name() -> None:
    assert load("max2d").profile.drives["rear_left"].total_ratio == 28.0


def test_every_shipped_robot_loads_without_a_warning() -> None:
    warnings = {path.stem: load(path).warnings for path in available([SHIPPED / "robots"])}
    assert warnings.keys() >= {"max2d", "nxt", "turtle"}
    assert not any(warnings.values()), warnings


def test_a_robot_of_this_machine_goes_before_the_shipped_one(tmp_path: Path) -> None:
    (tmp_path / "max2d.yaml").write_text("extends: max2d\nname: ours\n")
    assert load("max2d", [tmp_path, SHIPPED / "robots"]).profile.name == "ours"


def test_own_values_win_over_extended_ones(robot: Robot) -> None:
    assert robot("drives: {rear_left: {wheel_radius_m: 0.09}}").profile.drives["rear_left"].wheel_radius_m == 0.09


def test_what_is_not_overridden_is_inherited(robot: Robot) -> None:
    assert robot("drives: {rear_left: {wheel_radius_m: 0.09}}").profile.drives["rear_left"].gear_ratio == 14


def test_a_nested_mapping_may_extend_a_file_beside_its_own(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "motor.yaml").write_text("extends: devices/ec40\npole_pairs: 7\n")
    assert robot("drives: {rear_left: {motor: {extends: motor}}}").profile.drives["rear_left"].motor.pole_pairs == 7


def test_the_calibration_beside_a_robot_is_merged_last(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "lab.calibration.yaml").write_text("encoders: {rear: {zero_counts: 77}}\n")
    assert robot("encoders: {rear: {zero_counts: 5}}").profile.encoders["rear"].zero_counts == 77


def test_a_calibration_is_no_robot_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "lab.calibration.yaml").write_text("encoders: {}\n")
    assert available([tmp_path]) == []


def test_an_own_value_knows_its_file_and_line(robot: Robot, tmp_path: Path) -> None:
    loaded = robot("limits:\n  speed_m_s: 0.5\n")
    assert loaded.origin["limits.speed_m_s"] == f"{tmp_path}/lab.yaml:5"


def test_an_inherited_value_knows_its_file_and_line(robot: Robot) -> None:
    line = (SHIPPED / "devices/ec40.yaml").read_text().splitlines().index("resistance_ohm: !assumed 1.2") + 1
    assert robot("").origin["drives.rear_left.motor.resistance_ohm"] == f"{SHIPPED}/devices/ec40.yaml:{line}"


def test_a_tagged_value_is_listed_as_assumed(robot: Robot) -> None:
    assert "drives.rear_left.wheel_radius_m" in robot("").assumed


def test_a_measured_value_in_place_of_an_assumed_one_is_not_assumed(robot: Robot) -> None:
    assert "drives.rear_left.wheel_radius_m" not in robot("drives: {rear_left: {wheel_radius_m: 0.1}}").assumed


def test_a_tagged_mapping_marks_everything_in_it_as_assumed(robot: Robot) -> None:
    assert "limits.speed_m_s" in robot("limits: !assumed {speed_m_s: 0.5}").assumed


def test_an_unused_device_is_a_warning(robot: Robot, tmp_path: Path) -> None:
    warnings = robot("encoders:\n  spare: {node: 9, counts_per_turn: 4096}\n").warnings
    assert [warning.removeprefix(f"{tmp_path}/") for warning in warnings] == [
        "lab.yaml:5: encoders.spare: is not named in vehicle.encoders; the vehicle's motions do not use it"
    ]


def test_mistakes_of_every_kind_are_reported_at_once(mistakes: Mistakes) -> None:
    found = mistakes(
        "drives:\n  rear_right: {node: 200}\n  rear_left: {node: 3, colour: red}\n  front_left: {gear_ratio: 0}\n"
    )
    assert [mistake.partition(";")[0].partition(" (")[0] for mistake in found] == [
        "lab.yaml:5: drives.rear_right.node: is 200",
        "lab.yaml:6: drives.rear_left.colour: is an unknown key",
        "lab.yaml:6: drives.rear_left.node: node id 3 is taken by drives.front_left.node",
        "lab.yaml:7: drives.front_left.gear_ratio: is 0",
    ]


def test_mistakes_make_exit_code_7(robot: Robot) -> None:
    with pytest.raises(ConfigError) as caught:
        robot("drives: {rear_left: {node: 0}}")
    assert caught.value.exit_code == 7


def test_a_mistake_in_a_file_that_four_drives_extend_is_reported_once(robot: Robot, tmp_path: Path) -> None:
    (tmp_path / "wheel.yaml").write_text("gear_ratio: 0\n")
    names = ("rear_right", "rear_left", "front_left", "front_right")
    with pytest.raises(ProfileError) as caught:
        robot("drives:\n" + "".join(f"  {name}: {{extends: wheel}}\n" for name in names))
    assert len(caught.value.mistakes) == 1


def test_an_unknown_name_is_answered_with_a_close_one() -> None:
    with pytest.raises(ConfigError, match="did you mean max2d"):
        load("maxd2")


def test_a_missing_file_is_named() -> None:
    with pytest.raises(ConfigError, match=r"no profile file nowhere/lab\.yaml"):
        find("nowhere/lab.yaml")


def test_a_folder_is_no_profile(tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        load(tmp_path)


def test_a_missing_extended_file_is_a_mistake_with_its_line(mistakes: Mistakes) -> None:
    assert mistakes("drives:\n  rear_left: {extends: devices/ec4}\n") == [
        "lab.yaml:5: extends: there is no file 'devices/ec4'; did you mean devices/ec40?"
    ]


def test_keys_that_an_unreadable_file_would_give_are_not_missing_too(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("schema_version: 1\nextends: nothing\n")
    with pytest.raises(ProfileError) as caught:
        load(tmp_path / "lab.yaml")
    assert [mistake.field for mistake in caught.value.mistakes] == ["extends"]


def test_files_that_extend_each_other_are_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("extends: b\n")
    (tmp_path / "b.yaml").write_text("extends: a\n")
    with pytest.raises(ProfileError, match=r"b\.yaml:1: extends: goes in a circle: a -> b -> a"):
        load(tmp_path / "a.yaml")


def test_a_file_that_extends_itself_is_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("extends: a\n")
    with pytest.raises(ProfileError, match="goes in a circle: a -> a"):
        load(tmp_path / "a.yaml")


@pytest.mark.parametrize("text", ["~", "[]", "[[max2d]]", "''", "7"])
def test_extends_wants_a_name(mistakes: Mistakes, text: str) -> None:
    assert mistakes(f"network: {{extends: {text}}}")[0].startswith("lab.yaml:4: extends: is not a name")


def test_of_very_many_mistakes_the_first_hundred_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("extends: max2d\n" + "".join(f"key{number}: 1\n" for number in range(500)))
    with pytest.raises(ProfileError) as caught:
        load(tmp_path / "a.yaml")
    told = str(caught.value).splitlines()
    assert (told[0], len(told), told[-1]) == (f"profile {tmp_path}/a.yaml has 500 mistakes:", 102, "  ...")


def test_a_long_value_is_told_by_its_beginning(mistakes: Mistakes) -> None:
    assert mistakes(f"network: {'a' * 5000}")[0].startswith(f"lab.yaml:4: network: is '{'a' * 37}...'; write")


def test_a_file_that_is_no_mapping_is_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("# robots\n- max2d\n")
    with pytest.raises(ProfileError, match=r"a\.yaml:2: is not a mapping"):
        load(tmp_path / "a.yaml")


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.one_of(YAML_PIECES, YAML_PIECES.map(HEAD.__add__), st.text(max_size=60)))
def test_any_text_loads_or_is_a_configuration_error(tmp_path: Path, text: str) -> None:
    path = tmp_path / "lab.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        loaded = load(path)
    except ConfigError:
        return
    assert loaded.profile.drives


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=40))
def test_any_bytes_load_or_are_a_configuration_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "lab.yaml"
    path.write_bytes(content)
    with pytest.raises(ConfigError):
        load(path)


@pytest.mark.parametrize(("line", "name"), [("", "lab7"), ("name: ours\n", "ours")])
def test_a_robot_is_called_as_it_says_or_else_like_its_file(tmp_path: Path, line: str, name: str) -> None:
    (tmp_path / "lab7.yaml").write_text(f"extends: max2d\n{line}")
    assert load(tmp_path / "lab7.yaml").profile.name == name


def test_a_file_whose_name_is_none_for_a_robot_is_told(tmp_path: Path) -> None:
    (tmp_path / "7 up.yaml").write_text("extends: max2d\n")
    with pytest.raises(ConfigError, match=r"7 up\.yaml:1: name: is '7 up'; write a text that matches"):
        load(tmp_path / "7 up.yaml")
