"""Commissioning: whatever is wired wrong in a simulated robot is found by name, and put right in its profile."""

from __future__ import annotations

from pathlib import Path

import pytest

from canhelm.errors import Interlock, Refused
from daemon.commissioning.session import changes_of
from profiles.loader import load
from profiles.side_file import write_values
from vcan_tests.daemon.workshop import robot_file, robot_of, workshop

MISWIRED = {
    "wheel reversed": ("drives: {rear_left: {direction: -1}}", "reversed: rear_left rolls backward"),
    "wheels swapped": (
        "drives: {rear_left: {node: 4}, front_right: {node: 2}}",
        "swapped: drive rear_left (node 2) turns wheel front_right",
    ),
    "encoders swapped": (
        "encoders: {rear: {node: 6}, front: {node: 5}}",
        "swapped: encoder front (node 6) tells of the rear pair",
    ),
    "encoder reversed": ("encoders: {rear: {direction: -1}}", "reversed: the encoder of the rear pair"),
    "brake reversed": ("brakes: {front: {energise_to_release: false}}", "reversed: the front brake releases"),
    "brakes swapped": (
        "brakes: {front: {drive: rear_right}, rear: {drive: front_left}}",
        "swapped: the front brake is at the output of the rear brake",
    ),
    "wrong counts": ("drives: {front_right: {encoder_pulses_per_turn: 512}}", "counts: front_right has an encoder"),
    "wrong gear": ("drives: {front_right: {belt_ratio: 2.5}}", "gear: front_right has 35 motor turns"),
    "wrong radius": ("drives: {rear_right: {wheel_radius_m: 0.095}}", "radius: rear_right has 95 mm, not 100 mm"),
}
"""How a robot may be built otherwise than its profile says, and by which name it is found."""


@pytest.mark.parametrize("fault", MISWIRED)
async def test_what_is_wired_wrong_is_found_by_name_and_put_right(fault: str, tmp_path: Path) -> None:
    text, words = MISWIRED[fault]
    mine, built = robot_file(tmp_path / "mine"), robot_file(tmp_path / "built", text)
    async with workshop(mine, built) as shop:
        shop.person.labels = {"front_right": 512} if fault == "wrong counts" else {}
        shop.person.diameters = {"rear_right": 190.0} if fault == "wrong radius" else {}
        findings = await shop.commission()
    assert findings.unsolved == []
    assert any(words in sentence for sentence in findings.wrong), findings.wrong
    write_values(mine, findings.values)
    found, true = load(mine).profile, load(built).profile
    assert (found.drives, found.encoders, found.brakes) == (true.drives, true.encoders, true.brakes)
    assert found.setup == "done"


async def test_everything_wrong_at_once_is_put_right(tmp_path: Path) -> None:
    text = """
drives:
  rear_right: {node: 2, direction: 1}
  rear_left: {node: 1, direction: 1}
  front_left: {encoder_pulses_per_turn: 512}
encoders: {rear: {node: 6, direction: -1}, front: {node: 5}}
brakes:
  rear: {drive: front_left, energise_to_release: false}
  front: {drive: rear_left}
"""
    mine, built = robot_file(tmp_path / "mine"), robot_file(tmp_path / "built", text)
    async with workshop(mine, built) as shop:
        shop.person.labels = {"front_left": 512}
        findings = await shop.commission()
    write_values(mine, findings.values)
    found, true = load(mine).profile, load(built).profile
    assert (found.drives, found.encoders, found.brakes) == (true.drives, true.encoders, true.brakes)


async def test_half_a_turn_by_hand_is_doubted_with_both_gears_and_turned_again(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        shop.person.mistaken = {"turn wheel": "180", "was it exactly one whole turn": "n"}
        findings = await shop.commission("rear_left")
        assert (findings.wrong, findings.values) == ([], {})
        assert "that is 14 motor turns a turn of rear_left, and the profile says 28" in shop.person.heard


async def test_a_gear_within_a_tenth_of_the_profiles_is_not_doubted(tmp_path: Path) -> None:
    built = robot_file(tmp_path / "built", "drives: {rear_left: {belt_ratio: 2.1}}")
    async with workshop(robot_file(tmp_path / "mine"), built) as shop:
        findings = await shop.commission("rear_left")
        assert list(findings.values) == [("drives", "rear_left", "belt_ratio")]
        assert not any(heard.startswith("was it exactly") for heard in shop.person.heard)


@pytest.mark.parametrize(
    ("question", "wrong", "told"),
    [
        ("diameter", "2000", "2000 mm do not go with the profile: drives.rear_left."),
        ("pulses", "0.3", "'0.3' is no number from 16 to 7500"),
    ],
)
async def test_what_the_profile_cannot_take_is_told_at_the_question_and_asked_for_again(
    question: str, wrong: str, told: str, tmp_path: Path
) -> None:
    built = robot_file(tmp_path / "built", "drives: {rear_left: {encoder_pulses_per_turn: 512}}")
    async with workshop(robot_file(tmp_path / "mine"), built) as shop:
        shop.person.labels, shop.person.mistaken = {"rear_left": 512}, {question: wrong}
        findings = await shop.commission("rear_left")
        assert findings.values == {("drives", "rear_left", "encoder_pulses_per_turn"): 512}
        assert any(heard.startswith(told) for heard in shop.person.heard)


async def test_a_robot_that_is_built_as_its_profile_says_changes_nothing(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        findings = await shop.commission()
        assert (findings.wrong, findings.unsolved) == ([], [])
        assert changes_of(shop.profile, findings.values) == {"setup": ("needed", "done")}


STEERED = {
    "encoder reversed": (
        "encoders: {steering_angle: {direction: -1}}",
        "reversed: the encoder of the steering_angle pair counts the other way",
    ),
    "motor reversed": ("drives: {steering: {direction: -1}}", "reversed: steering steers to the right"),
    "wrong gear": ("drives: {steering: {belt_ratio: 1.5}}", "gear: steering has"),
    "as it should be": ("", ""),
}
"""How a steered axle may be built otherwise than its profile says, and by which name it is found."""


@pytest.mark.parametrize("robot", ["ackermann", "semitrailer"])
@pytest.mark.parametrize("fault", STEERED)
async def test_an_axle_that_a_motor_steers_is_found_and_put_right(fault: str, robot: str, tmp_path: Path) -> None:
    text, words = STEERED[fault]
    mine, built = robot_of(tmp_path / "mine", robot, ""), robot_of(tmp_path / "built", robot, text)
    async with workshop(mine, built) as shop:
        findings = await shop.commission()
    assert findings.unsolved == []
    assert all(words in sentence for sentence in findings.wrong), findings.wrong
    assert len(findings.wrong) == bool(words)
    write_values(mine, findings.values)
    found, true = load(mine).profile, load(built).profile
    assert found.setup == "done"
    assert found.encoders == true.encoders
    assert found.drives["steering"].direction == true.drives["steering"].direction
    assert found.drives["steering"].total_ratio == pytest.approx(true.drives["steering"].total_ratio, rel=0.05)


async def test_the_steered_axle_can_be_looked_at_alone(tmp_path: Path) -> None:
    async with workshop(robot_of(tmp_path / "mine", "ackermann", "")) as shop:
        findings = await shop.commission("steering")
        assert (findings.wrong, findings.unsolved, findings.values) == ([], [], {})
        assert not any(heard.startswith("turn wheel") for heard in shop.person.heard)


HELD = """
brakes:
  parking: {kind: holding, drive: rear_left, output: 3, output_bit: 13, open_time_s: 0.03, close_time_s: 0.02}
"""


async def test_a_wheel_with_a_holding_brake_is_looked_at_with_the_brake_released(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path, HELD)) as shop:
        findings = await shop.commission("rear_left")
        assert (findings.wrong, findings.unsolved, findings.values) == ([], [], {})
        assert shop.robot.network.brakes["parking"].engaged


async def test_a_holding_brake_that_is_wired_the_other_way_round_is_found_before_its_motor_turns(
    tmp_path: Path,
) -> None:
    mine = robot_file(tmp_path / "mine", HELD)
    built = robot_file(tmp_path / "built", HELD.replace("output: 3", "energise_to_release: false, output: 3"))
    async with workshop(mine, built) as shop:
        findings = await shop.commission()
    assert findings.wrong == ["reversed: the parking brake releases when it shall lock"]
    assert findings.values == {("brakes", "parking", "energise_to_release"): False}


async def test_motors_at_a_brick_are_not_looked_at_and_that_is_told(tmp_path: Path) -> None:
    file = tmp_path / "lab1.yaml"
    file.write_text("schema_version: 1\nname: lab1\nextends: robots/nxt\nsetup: needed\n")
    async with workshop(file) as shop:
        with pytest.raises(Refused, match="at an NXT brick") as refusal:
            await shop.commission()
        assert "write setup: done" in str(refusal.value.remedy)


@pytest.mark.parametrize("robot", ["max2d", "turtle", "semitrailer", "ackermann", "nxt"])
async def test_no_robot_is_driven_before_its_setup(robot: str, tmp_path: Path) -> None:
    async with workshop(robot_of(tmp_path / "mine", robot, "")) as shop:
        methods = shop.robot.app.service.status()["vehicle"]["methods"]
        assert any(method.startswith("drive.") for method in methods)
        for method in methods:
            with pytest.raises(Interlock, match="was not set up"):
                await shop.call(method)


@pytest.mark.parametrize("what", ["done", "waived"])
async def test_a_robot_is_driven_after_its_setup(what: str, tmp_path: Path) -> None:
    file = robot_file(tmp_path)
    write_values(file, {("setup",): what})
    async with workshop(file) as shop:
        await shop.call("simulation.lift", lifted=False)
        await shop.call("drive.parallel", angle_deg=0.0, speed_m_s=0.1, duration_s=1.0)
