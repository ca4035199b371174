"""How the service ends, in order and otherwise: the vehicle is at rest, its brakes are engaged, its drives are off."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from canhelm.errors import DaemonNotRunning
from vcan_tests.systemd.bench import PROFILE, SERVICE, Journal, Robot, told, until
from vcan_tests.systemd.figures import clean_up_of_a_turning_pair, one_life

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]
SAFE = "4 of 4 drives are stopped and off, their brakes engaged"


async def test_a_stop_in_mid_drive_brings_the_vehicle_to_rest_by_its_ramp(robot: Robot) -> None:
    await robot.drive()
    journal = Journal()
    told("systemctl", "stop", SERVICE)
    await journal.has("the vehicle is at rest and its drives are off")
    assert (robot.powered(), robot.released()) == ([], [])
    assert robot.show("Result") == "success"


async def test_a_stop_while_a_pair_turns_engages_its_brake(robot: Robot) -> None:
    await robot.turn_front_pair()
    told("systemctl", "stop", SERVICE)
    assert (robot.powered(), robot.released()) == ([], [])


def test_a_robot_that_was_stopped_is_not_started_by_a_question(robot: Robot) -> None:
    told("systemctl", "stop", SERVICE)
    with pytest.raises(DaemonNotRunning):
        robot.status()
    assert robot.show("ActiveState") == "inactive"


async def test_a_daemon_that_is_killed_in_mid_drive_is_cleaned_up_behind_and_comes_back(robot: Robot) -> None:
    await robot.drive()
    restarts, journal = robot.restarts, Journal()
    robot.send(signal.SIGKILL)
    await until(lambda: robot.restarts > restarts)
    await robot.until_state("idle")
    await journal.has("Scheduled restart job")
    said = journal.read()
    assert said.index("status=9/KILL") < said.index(SAFE) < said.index("Scheduled restart job")
    assert (robot.powered(), robot.released()) == ([], [])


@pytest.mark.real_time
async def test_the_brake_that_a_killed_daemon_has_released_is_engaged_by_the_service(
    robot: Robot, tmp_path: Path
) -> None:
    clean_up = await clean_up_of_a_turning_pair(robot, tmp_path)
    assert clean_up.engaged_s < min(5.0, clean_up.ready_s)
    assert robot.released() == []


async def test_a_daemon_that_hangs_is_ended_by_the_watchdog_and_comes_back(robot: Robot) -> None:
    restarts, journal = robot.restarts, Journal()
    robot.send(signal.SIGSTOP)
    await until(lambda: robot.restarts > restarts)
    await robot.until_state("idle")
    await journal.has("Scheduled restart job")
    said = journal.read()
    assert said.index("Watchdog timeout (limit 2s)") < said.index(SAFE) < said.index("Scheduled restart job")


async def test_a_daemon_that_hangs_in_mid_drive_leaves_a_vehicle_at_rest(robot: Robot) -> None:
    await robot.drive()
    restarts = robot.restarts
    robot.send(signal.SIGSTOP)
    await until(lambda: robot.restarts > restarts)
    assert (robot.powered(), robot.released()) == ([], [])


async def test_a_daemon_that_dies_again_and_again_is_given_up_with_a_safe_vehicle(robot: Robot) -> None:
    journal = Journal()
    await robot.drive()
    while robot.show("ActiveState") != "failed":
        await until(lambda: robot.pid or robot.show("ActiveState") == "failed")
        if robot.pid:
            robot.send(signal.SIGKILL)
    await journal.has("Start request repeated too quickly")
    assert robot.restarts <= 5
    assert (robot.powered(), robot.released()) == ([], [])


async def test_the_clean_up_knows_the_brakes_of_a_daemon_whose_profile_was_spoilt_since(robot: Robot) -> None:
    await robot.turn_front_pair()
    PROFILE.write_text("a person is about to write this\n")
    robot.send(signal.SIGKILL)
    await until(lambda: robot.show("ActiveState") == "failed")
    assert (robot.powered(), robot.released()) == ([], [])


async def test_one_life_reads_well_in_the_journal() -> None:
    journal = await one_life(Robot())
    chapters = (
        "waiting for node 1 (rear_right): no boot-up; is motor power on?",
        "node 1 (rear_right) is configured, started and guarded",
        "drive.parallel",
        "node 3 (front_left) has restarted",
        "node 3 (front_left) is configured, started and guarded",
        "reset by a person",
        "drive.parallel",
        "going down: stopping the vehicle",
        "the vehicle is at rest and its drives are off",
    )
    await journal.has(chapters[-1])
    said, place = journal.read(), 0
    for chapter in chapters:
        place = said.index(chapter, place)
