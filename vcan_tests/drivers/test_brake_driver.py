"""The brake driver against the twin's outputs."""

from __future__ import annotations

import asyncio

import msgspec
import pytest

from canhelm.errors import NodeAbsent, Refused
from drivers.contract import BrakeState
from profiles.schema import Profile
from vcan_tests.drivers.bench import bench, max2d


def wired(**values: object) -> Profile:
    """The profile with other wiring of the front brake."""
    profile = max2d()
    brakes = {**profile.brakes, "front": msgspec.structs.replace(profile.brakes["front"], **values)}
    return msgspec.structs.replace(profile, brakes=brakes)


async def test_a_brake_is_engaged_when_its_drive_is_ready() -> None:
    async with bench() as b:
        assert b.brake().state is BrakeState.ENGAGED
        assert b.network.brakes["front"].engaged


async def test_releasing_takes_the_opening_time() -> None:
    async with bench() as b:
        begun = asyncio.get_running_loop().time()
        releasing = asyncio.ensure_future(b.brake().release())
        await asyncio.sleep(0.02)
        assert b.brake().state is BrakeState.RELEASING
        await releasing
        assert asyncio.get_running_loop().time() - begun >= 0.05
        assert b.brake().state is BrakeState.RELEASED
        assert not b.network.brakes["front"].engaged


async def test_engaging_brings_it_back() -> None:
    async with bench() as b:
        await b.brake().release()
        await b.brake().engage()
        assert b.brake().state is BrakeState.ENGAGED
        assert b.network.brakes["front"].engaged


async def test_a_brake_that_is_energised_to_engage_gets_the_opposite_level() -> None:
    async with bench(wired(energise_to_release=False)) as b:
        assert b.network.brakes["front"].engaged
        await b.brake().release()
        assert not b.network.brakes["front"].engaged


async def test_only_its_own_bit_is_masked_and_switched() -> None:
    async with bench() as b:
        twin = b.network.drives["front_left"].dictionary
        before = twin.number("digital_output_functions_state")
        await b.brake().release()
        assert twin.number("digital_output_functions_mask") == 0x1000
        assert twin.number("digital_output_functions_state") == before & ~0x1000


async def test_two_brakes_on_one_drive_do_not_disturb_each_other() -> None:
    profile = max2d()
    rear = msgspec.structs.replace(profile.brakes["rear"], drive="front_left", output=3, output_bit=13)
    async with bench(msgspec.structs.replace(profile, brakes={**profile.brakes, "rear": rear})) as b:
        await asyncio.gather(b.brake("front").release(), b.brake("rear").release())
        await b.brake("rear").engage()
        assert (b.network.brakes["front"].engaged, b.network.brakes["rear"].engaged) == (False, True)


async def test_the_last_command_wins_and_the_other_caller_hears_of_it() -> None:
    async with bench() as b:
        releasing = asyncio.ensure_future(b.brake().release())
        await asyncio.sleep(0.02)
        await b.brake().engage()
        with pytest.raises(Refused, match="other way"):
            await releasing
        assert b.brake().state is BrakeState.ENGAGED


async def test_two_callers_may_wait_for_the_same_release() -> None:
    async with bench() as b:
        await asyncio.gather(b.brake().release(), b.brake().release())
        assert b.brake().state is BrakeState.RELEASED


async def test_without_its_drive_its_state_is_unknown_and_it_cannot_be_switched() -> None:
    async with bench() as b:
        b.network.power_off(3)
        await asyncio.sleep(0.3)
        assert b.brake().state is BrakeState.UNKNOWN
        with pytest.raises(NodeAbsent):
            await b.brake().release()


async def test_after_a_restart_of_its_drive_it_is_engaged() -> None:
    async with bench() as b:
        await b.brake().release()
        b.network.power_off(3)
        await asyncio.sleep(0.5)
        b.network.power_on(3)
        await asyncio.sleep(1.0)
        assert b.brake().state is BrakeState.ENGAGED


async def test_closing_engages_it() -> None:
    async with bench() as b:
        await b.brake().release()
        await b.devices.close()
        assert b.brake().state is BrakeState.ENGAGED
        assert b.network.brakes["front"].engaged
