"""What a simulated robot takes in bytecodes, which no load of the machine changes; see ``test_work``."""

from __future__ import annotations

import asyncio
import copy
import sys

import pytest

from benchmarks.robots import STRAIGHT, begin, booted, robot_at
from drivers.simulated.tyre import Contact
from vcan_tests.benchmarks.work import counting

CYCLE_HZ, CYCLES = 100.0, 20
UNDER_WAY_S = 1.0
ALLOWED = 43_000
"""A cycle of the MAX2D that drives, daemon included: ten steps of physics, twelve frames. Counted on Python 3.11."""
OTHERS = 1.0 if sys.version_info[:2] == (3, 11) else 1.1


async def bytecodes_a_cycle() -> float:
    async with booted(robot_at(CYCLE_HZ)) as robot:
        await begin(robot, STRAIGHT)
        await asyncio.sleep(UNDER_WAY_S)
        with counting() as counted:
            await asyncio.sleep(CYCLES / CYCLE_HZ)
    return counted.total() / CYCLES


async def test_a_simulated_cycle_takes_no_more_work_than_it_did() -> None:
    assert await bytecodes_a_cycle() <= ALLOWED * OTHERS


async def test_a_needless_copy_of_each_tyre_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    deform = Contact.deform

    def deform_beside_a_copy(tyre: Contact, rim: float, roll: float, lateral: float, load: float, dt: float) -> None:
        copy.copy(tyre)
        deform(tyre, rim, roll, lateral, load, dt)

    monkeypatch.setattr(Contact, "deform", deform_beside_a_copy)
    assert await bytecodes_a_cycle() > ALLOWED
