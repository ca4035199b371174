"""What becomes of a robot when its daemon, or its network, is killed or suspended."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from vcan_tests.vcan.bench import Bench, Daemon, Simulator, bench, patient, speeds
from vcan_tests.vcan.pauses import PauseWatch, watched_for_pauses
from vcan_tests.vcan.stethoscope import (
    BRAKE_ENGAGED,
    DRIVES,
    LIFE_GUARDING,
    OUTPUTS,
    STATUSWORD,
    at_rest_after,
    emergencies_after,
    listen,
    read,
    stop_s,
)

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

SPEED_M_S, STEERING_M_S = 0.5, 0.05
SLOW_STEERING = f"limits: {{steering_rim_speed_m_s: {STEERING_M_S}}}\n"
"""So that a turn of a pair lasts long enough to be interrupted."""
GUARDED = "network: {guard_time_ms: 250, life_time_factor: 4, boot_deadline_s: 20, sdo_timeout_s: 1, cycle_hz: 20}\n"
LIFE_TIME_S, MARGIN_S = 1.0, 0.3
"""Longer than a machine's pauses; figures.py measures the shipped 0.3 s and the margin of 0.05 s on a quiet one."""
LISTENED_S = 2.5
REAR_RIGHT, FRONT_LEFT = 1, 3
"""The drives with the brakes."""
POWER_STAGE = 1 << 4
"""Voltage enabled, in the statusword."""


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Bench]:
    with bench(tmp_path, SLOW_STEERING + GUARDED) as made:
        yield made


@pytest.fixture
def patient_robot(tmp_path: Path) -> Iterator[Bench]:
    with bench(tmp_path, SLOW_STEERING + patient()) as made:
        yield made


@pytest.fixture
def pauses(tmp_path: Path) -> Iterator[PauseWatch]:
    """What the machine itself stands still is no delay of the drives."""
    with watched_for_pauses(tmp_path / "pauses") as watch:
        yield watch


@pytest.mark.real_time
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_without_its_daemon_a_driving_robot_is_stopped_by_its_drives(
    robot: Bench, pauses: PauseWatch, number: signal.Signals
) -> None:
    robot.drive(SPEED_M_S)
    struck_s = robot.daemon.signal(number)
    listen(LISTENED_S)
    brakes = [read(node, OUTPUTS) & BRAKE_ENGAGED for node in (REAR_RIGHT, FRONT_LEFT)]
    frames = robot.wire.frames(struck_s)
    within_s = stop_s(SPEED_M_S, LIFE_TIME_S) + MARGIN_S + sum(pauses.between(struck_s, struck_s + LISTENED_S))
    for node in DRIVES:
        assert at_rest_after(frames, node, struck_s) < within_s
        assert [code for code, _ in emergencies_after(frames, node, struck_s)] == [LIFE_GUARDING]
    assert all(brakes)


@pytest.mark.real_time
def test_a_pair_that_turns_is_stopped_too_and_its_brake_stays_released_until_somebody_makes_it_safe(
    robot: Bench, pauses: PauseWatch
) -> None:
    robot.turn_pair(STEERING_M_S)
    struck_s = robot.daemon.signal(signal.SIGKILL)
    listen(LISTENED_S)
    frames = robot.wire.frames(struck_s)
    within_s = stop_s(STEERING_M_S, LIFE_TIME_S) + MARGIN_S + sum(pauses.between(struck_s, struck_s + LISTENED_S))
    assert max(at_rest_after(frames, node, struck_s) for node in DRIVES) < within_s
    assert not read(FRONT_LEFT, OUTPUTS) & BRAKE_ENGAGED
    made_safe = robot.daemon.canhelm("make-safe", "--profile", str(robot.profile), "--bus", "socketcan:vcan0")
    assert made_safe.returncode == 0, made_safe.stderr
    assert read(FRONT_LEFT, OUTPUTS) & BRAKE_ENGAGED
    assert not any(read(node, STATUSWORD) & POWER_STAGE for node in DRIVES)


def test_the_next_daemon_engages_the_brake_that_a_killed_one_had_released(patient_robot: Bench) -> None:
    robot = patient_robot
    robot.turn_pair(STEERING_M_S)
    robot.daemon.signal(signal.SIGKILL)
    robot.daemon.end()
    robot.daemon = Daemon(robot.profile)
    robot.daemon.wait_for_state("idle")
    assert read(FRONT_LEFT, OUTPUTS) & BRAKE_ENGAGED
    assert robot.daemon.canhelm("steer", "front", "5").returncode == 0


def test_a_suspended_daemon_that_goes_on_tells_of_the_stop_and_drives_again_after_a_reset(robot: Bench) -> None:
    robot.drive(SPEED_M_S)
    robot.daemon.signal(signal.SIGSTOP)
    listen(LISTENED_S)
    robot.daemon.signal(signal.SIGCONT)
    assert "life guarding" in robot.daemon.wait_for_state("fault")
    assert robot.daemon.canhelm("reset").returncode == 0
    robot.daemon.wait_for_state("idle")
    assert robot.daemon.canhelm("steer", "front", "5").returncode == 0


def test_a_robot_whose_network_is_killed_is_in_fault_and_ready_again_with_the_next_one(patient_robot: Bench) -> None:
    robot = patient_robot
    robot.drive(SPEED_M_S)
    robot.simulator.process.kill()
    assert "no node answers" in robot.daemon.wait_for_state("fault")
    robot.simulator.end()
    robot.simulator = Simulator(robot.profile)
    robot.daemon.wait_for(lambda status: {node["node_state"] for node in status["nodes"]} == {"ready"})
    assert robot.daemon.canhelm("reset").returncode == 0
    assert max(speeds(robot.daemon.status())) == 0.0
    assert (
        robot.daemon.canhelm("drive", "parallel", "--angle", "0", "--speed", "0.3", "--duration", "0.3").returncode == 0
    )
