"""One client has the robot at a time; another one takes it over where everybody can see it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest

from canhelm.errors import Interlock, Refused
from daemon.runtime.rest import AT_REST_M_S
from vcan_tests.robot import Robot, running_robot

DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 5.0, "wait": True}
ALICE = {"user": "alice", "pid": 77, "command": "canhelm drive parallel"}


class Driver:
    """One more client of a robot, with a lease that it renews."""

    def __init__(self, robot: Robot, name: str, **details: Any) -> None:
        self._service = robot.app.service
        self.lease = self._service.open_lease(name, details)
        self._renewing = asyncio.create_task(self._renew())

    async def _renew(self) -> None:
        with suppress(Refused):
            while True:
                await asyncio.sleep(0.5)
                self._service.renew_lease(self.lease)

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """Ask for something."""
        return await self._service.call(method, params, self.lease)

    async def take(self) -> str | None:
        """Take the robot over."""
        return await self._service.take_lease(self.lease)

    async def hang_up(self) -> None:
        """Go away."""
        self._renewing.cancel()
        await asyncio.wait([self._renewing])
        self._service.close_lease(self.lease)


@asynccontextmanager
async def two_people() -> AsyncIterator[tuple[Robot, Driver, Driver]]:
    """A robot, and two people who may drive it."""
    async with running_robot() as robot:
        alice, bob = Driver(robot, "alice", **ALICE), Driver(robot, "bob")
        yield robot, alice, bob
        await alice.hang_up()
        await bob.hang_up()


async def driving(driver: Driver) -> asyncio.Task[dict[str, Any]]:
    """A drive that has been under way for a second."""
    task = asyncio.create_task(driver.call("drive.parallel", **DRIVE))
    task.add_done_callback(lambda done: done.exception())
    await asyncio.sleep(1.0)
    return task


async def test_the_status_tells_who_has_the_robot() -> None:
    async with two_people() as (robot, alice, _):
        assert robot.app.service.status()["holder"] is None
        await driving(alice)
        assert robot.app.service.status()["holder"] == {"client": "alice", "lease": "lease-1", **ALICE}
        await robot.app.service.call("stop", {}, None)
        assert robot.app.service.status()["holder"] is None


async def test_who_does_not_have_the_robot_is_told_who_has_it_and_what_to_do() -> None:
    async with two_people() as (_, alice, bob):
        drive = await driving(alice)
        with pytest.raises(Refused, match="alice has the robot") as refused:
            await bob.call("drive.parallel", **DRIVE)
        assert "--takeover" in str(refused.value.remedy)
        assert not drive.done()


async def test_who_has_the_robot_is_told_to_somebody_with_a_path() -> None:
    async with two_people() as (_, alice, bob):
        await driving(alice)
        with pytest.raises(Refused, match="alice has the robot") as refused:
            await bob.call("drive.path", path={"pieces": [{"line_m": 1}]})
        assert "--takeover" in str(refused.value.remedy)


async def test_a_motion_that_would_be_handed_to_the_daemon_is_refused_likewise() -> None:
    async with two_people() as (_, alice, bob):
        await driving(alice)
        with pytest.raises(Refused, match="alice has the robot"):
            await bob.call("drive.parallel", **DRIVE | {"wait": False})


async def test_anybody_stops_a_robot_that_somebody_else_has() -> None:
    async with two_people() as (robot, alice, bob):
        drive = await driving(alice)
        await bob.call("stop")
        assert robot.app.service.status()["motions"] == []
        assert isinstance(drive.exception(), Refused)


async def test_a_takeover_brings_the_robot_to_rest_and_both_learn_of_it() -> None:
    async with two_people() as (robot, alice, bob):
        events: list[dict[str, Any]] = []
        robot.app.service.events.append(events.append)
        drive = await driving(alice)
        assert await bob.take() == "alice"
        assert robot.speed_m_s < 2 * AT_REST_M_S
        with pytest.raises(Refused, match="bob has taken the robot over"):
            await drive
        assert "bob has taken the robot over from alice" in [event["message"] for event in events]
        assert robot.app.service.status()["holder"]["client"] == "bob"


async def test_who_lost_the_robot_does_not_get_it_back_while_the_other_one_is_there() -> None:
    async with two_people() as (robot, alice, bob):
        await driving(alice)
        await bob.take()
        with pytest.raises(Refused, match="bob has the robot"):
            await alice.call("drive.set", direction_deg=0.0, speed_m_s=0.3, valid_for_ms=200.0)
        assert (await bob.call("drive.parallel", **DRIVE | {"duration_s": 1.0}))["motion"] == "2"
        robot.app.service.close_lease(bob.lease)
        assert (await alice.call("drive.parallel", **DRIVE | {"duration_s": 1.0}))["motion"] == "3"


async def test_the_robot_is_taken_back_from_who_took_it() -> None:
    async with two_people() as (_, alice, bob):
        await driving(alice)
        await bob.take()
        assert await alice.take() == "bob"
        with pytest.raises(Refused, match="alice has the robot"):
            await bob.call("drive.parallel", **DRIVE)


async def test_a_takeover_ends_what_was_handed_to_the_daemon_and_an_event_says_so() -> None:
    async with two_people() as (robot, alice, bob):
        events: list[dict[str, Any]] = []
        robot.app.service.events.append(events.append)
        await alice.call("drive.parallel", **DRIVE | {"wait": False})
        await asyncio.sleep(1.0)
        assert await bob.take() == "the daemon (motion 1)"
        assert "bob has taken the robot over from the daemon (motion 1)" in [event["message"] for event in events]
        assert robot.app.service.status()["motions"] == []


async def test_the_status_tells_that_the_daemon_has_a_motion_that_was_handed_to_it() -> None:
    async with two_people() as (robot, alice, _):
        await alice.call("drive.parallel", **DRIVE | {"wait": False})
        assert robot.app.service.status()["holder"] == {"client": "the daemon (motion 1)"}
        await robot.app.service.call("stop", {}, None)
        assert robot.app.service.status()["holder"] is None


async def test_a_takeover_that_is_not_renewed_runs_out() -> None:
    async with running_robot() as robot:
        bob = robot.app.service.open_lease("bob")
        await robot.app.service.take_lease(bob)
        await asyncio.sleep(robot.app.service.lease_timeout_s + 0.1)
        assert robot.app.service.status()["holder"] is None


async def test_a_setup_is_not_taken_over() -> None:
    async with two_people() as (_, alice, bob):
        await alice.call("setup.begin")
        with pytest.raises(Interlock, match="a setup is under way"):
            await bob.take()
        await alice.call("setup.end")
