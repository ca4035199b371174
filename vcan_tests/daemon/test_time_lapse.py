"""Simulated time that passes faster or slower: no jumps, no timer late, and clients that live outside of it."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import msgspec
import pytest

from canhelm.errors import Refused
from daemon.api.methods import METHODS
from daemon.api.parameters import Role
from daemon.runtime.clock import PatientLoop, outside_s, pace, run_patient
from daemon.runtime.leases import Leases
from daemon.runtime.streams import Streamed
from daemon.runtime.time_lapse import LONGEST_DEBT_S, TimeLapse
from profiles.loader import load
from vcan_tests.robot import running_robot

PROFILE = load("turtle").profile
PATIENT = msgspec.structs.replace(
    PROFILE, network=msgspec.structs.replace(PROFILE.network, guard_time_ms=1000, life_time_factor=4)
)
"""Its drives forgive a machine that has other things to do."""


def slept(lapse: TimeLapse, clock_s: float, timeout_s: float) -> tuple[float, float]:
    """Sleep for a timer; the clock and loop time after it."""
    clock_s += lapse.sleep_s(timeout_s)
    lapse.slept(clock_s, timeout_s)
    return clock_s, lapse.computed(clock_s)


@pytest.mark.parametrize("factor", [0.1, 0.5, 2.0, 4.0])
def test_a_process_that_only_sleeps_keeps_the_pace(factor: float) -> None:
    lapse, clock_s = TimeLapse(factor, 100.0, 7.0), 100.0
    for _ in range(50):
        clock_s, loop_s = slept(lapse, clock_s, 0.02)
    assert loop_s == pytest.approx(8.0)
    assert clock_s == pytest.approx(100.0 + 1.0 / factor)


def test_what_is_computed_counts_no_faster_than_the_clock() -> None:
    lapse = TimeLapse(4.0, 0.0, 0.0)
    assert lapse.computed(0.01) == pytest.approx(0.01)


def test_sleep_catches_up_with_what_was_lost_in_computing() -> None:
    lapse, clock_s = TimeLapse(4.0, 0.0, 0.0), 0.0
    for _ in range(100):
        clock_s, loop_s = slept(lapse, clock_s, 0.02)
        clock_s += 0.001
        lapse.computed(clock_s)
    assert loop_s / clock_s == pytest.approx(4.0, rel=0.02)


def test_in_slow_motion_computing_is_slow_too() -> None:
    assert TimeLapse(0.1, 0.0, 0.0).computed(1.0) == pytest.approx(0.1)


def test_a_machine_that_cannot_follow_makes_no_timer_late() -> None:
    lapse, clock_s, loop_s = TimeLapse(4.0, 0.0, 0.0), 0.0, 0.0
    for _ in range(100):
        due_s = loop_s + 0.02
        clock_s, loop_s = slept(lapse, clock_s, 0.02)
        assert loop_s == pytest.approx(due_s)
        clock_s += 0.01
        loop_s = lapse.computed(clock_s)


def test_a_debt_that_is_too_large_is_given_up() -> None:
    lapse, clock_s = TimeLapse(4.0, 0.0, 0.0), 0.0
    for _ in range(100):
        lapse.slept(clock_s, 0.0)
        clock_s += 0.01
        loop_s = lapse.computed(clock_s)
    clock_s += 0.01
    lapse.slept(clock_s, None)
    assert lapse.computed(clock_s) - loop_s <= LONGEST_DEBT_S + 0.1


def test_a_sleep_that_a_message_ends_early_counts_as_far_as_it_went() -> None:
    lapse = TimeLapse(2.0, 0.0, 0.0)
    lapse.slept(0.1, 1.0)
    assert lapse.computed(0.1) == pytest.approx(0.2)


def test_time_goes_on_from_where_it_was_whenever_the_pace_is_changed() -> None:
    async def change() -> list[float]:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, PatientLoop)
        jumps = []
        for factor in (4.0, 0.1, 1.0, 2.0):
            await asyncio.sleep(0.01)
            before = loop.time()
            loop.set_pace(factor)
            jumps.append(loop.time() - before)
        return jumps

    assert all(0.0 <= jump < 0.005 for jump in run_patient(change()))


@pytest.mark.parametrize(("factor", "sleep_s"), [(4.0, 2.0), (0.25, 0.1)])
def test_a_sleep_takes_as_much_less_or_more(factor: float, sleep_s: float) -> None:
    async def sleep() -> tuple[float, float, float]:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, PatientLoop)
        loop.set_pace(factor)
        begin, outside, machine = loop.time(), outside_s(), time.monotonic()
        await asyncio.sleep(sleep_s)
        return loop.time() - begin, outside_s() - outside, time.monotonic() - machine

    inside_s, told_s, machine_s = run_patient(sleep())
    assert inside_s == pytest.approx(sleep_s, rel=0.05)
    assert told_s == pytest.approx(sleep_s / factor, rel=0.1)
    assert machine_s > 0.9 * sleep_s / factor


def test_at_the_machines_pace_time_outside_is_the_loops() -> None:
    async def look() -> tuple[float, float, float]:
        return outside_s(), asyncio.get_running_loop().time(), pace()

    outside, inside, factor = run_patient(look())
    assert inside == pytest.approx(outside, abs=0.01)
    assert factor == 1.0


async def live(factor: float, for_s: float, lease_s: float, valid_s: float) -> tuple[bool, bool]:
    """Whether a lease and a set-point are good after some time outside."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, PatientLoop)
    leases, stream = Leases(lease_s), Streamed("on", valid_s)
    lease = leases.open("somebody", {})
    loop.set_pace(factor)
    await asyncio.sleep(for_s * factor)
    leases.expired()
    return leases.alive(lease), stream.newest() is not None


@pytest.mark.parametrize("factor", [0.1, 4.0])
def test_leases_and_set_points_last_as_long_for_their_client_at_any_pace(factor: float) -> None:
    assert run_patient(live(factor, 0.1, 0.2, 0.2)) == (True, True)
    assert run_patient(live(factor, 0.3, 0.2, 0.2)) == (False, False)


def test_whoever_drives_may_set_the_pace() -> None:
    assert METHODS["simulation.pace"].role is Role.DRIVE


def test_a_simulated_robot_drives_at_another_pace_without_late_cycles() -> None:
    async def drive(factor: float) -> tuple[float, float, dict[str, Any]]:
        async with running_robot(PATIENT) as robot:
            await robot.call("simulation.pace", factor=factor)
            begin = outside_s()
            result = await robot.call("drive.to", x_m=0.5, y_m=0.0, heading_deg=0.0)
            return outside_s() - begin, result["duration_s"], robot.app.service.status()

    took_s, driven_s, status = run_patient(drive(3.0))
    assert took_s < 0.8 * driven_s
    assert status["pace"] == 3.0
    assert status["state"] == "idle"


async def test_virtual_time_has_no_pace_to_be_set() -> None:
    async with running_robot(PROFILE) as robot:
        with pytest.raises(Refused, match="time of this simulation"):
            await robot.call("simulation.pace", factor=2.0)
