"""Clients that ask as fast as they can and never read: the robot drives on, and others are heard."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from canhelm.aio import Client
from canhelm.errors import UsageError
from daemon.api.server import MAX_CLIENTS, Counters
from profiles.faults import CLEARABLE_CLIENTS
from vcan_tests.long_life.loop import run_with_sockets
from vcan_tests.robot import Robot, running_robot

DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 0.4}
BEGUN_S, GONE_S = 0.05, 0.1
"""Until all clients of a flood are there, and until the daemon has seen that they hung up."""


@asynccontextmanager
async def flooded(socket: Path, clients: int, **fields: Any) -> AsyncIterator[Robot]:
    """A robot that drives while its socket is flooded."""
    async with running_robot(socket=socket) as robot:
        driving = robot.begin("drive.parallel", **DRIVE)
        await robot.until(lambda: robot.speed_m_s > 0.2)
        await robot.call("simulation.fault", kind="client_flood", clients=clients, **fields)
        await asyncio.sleep(BEGUN_S)
        yield robot
        await driving


def counters(robot: Robot) -> Counters:
    assert robot.app.server is not None
    return robot.app.server.counters


def test_the_robot_drives_on(tmp_path: Path) -> None:
    async def drive() -> None:
        async with running_robot(socket=tmp_path / "socket") as robot:
            await robot.call("simulation.fault", kind="client_flood", clients=2)
            assert "motion" in await robot.call("drive.parallel", **DRIVE)
            assert robot.app.cycle.counters.late_cycles == 0
            assert counters(robot).refused > 500

    run_with_sockets(drive())


@pytest.mark.parametrize("clients", [1, CLEARABLE_CLIENTS, MAX_CLIENTS + 16])
def test_a_stop_of_another_client_comes_through(tmp_path: Path, clients: int) -> None:
    async def stop() -> None:
        async with flooded(tmp_path / "socket", clients, for_s=0.2) as robot:
            assert robot.speed_m_s > 0.2
            async with Client(tmp_path / "socket") as other:
                await other.stop()
            assert robot.speed_m_s < 0.02

    run_with_sockets(stop())


def test_somebody_finds_a_place_to_clear_a_flood_without_an_end(tmp_path: Path) -> None:
    async def clear() -> None:
        async with flooded(tmp_path / "socket", CLEARABLE_CLIENTS) as robot:
            async with Client(tmp_path / "socket") as other:
                assert await other.call("simulation.clear_faults") == {"cleared": 1}
            await asyncio.sleep(GONE_S)
            assert counters(robot).clients == 0

    run_with_sockets(clear())


def test_who_was_hung_up_on_comes_back(tmp_path: Path) -> None:
    async def come_back() -> None:
        async with flooded(tmp_path / "socket", 2) as robot:
            await robot.until(lambda: counters(robot).dropped_clients >= 2)
            await robot.until(lambda: counters(robot).clients == 2, 1.0)

    run_with_sockets(come_back())


async def clear(robot: Robot) -> None:
    await robot.call("simulation.clear_faults")


async def wait(_: Robot) -> None:
    await asyncio.sleep(0.2)


@pytest.mark.parametrize("end", [clear, wait])
@pytest.mark.parametrize("clients", [2, MAX_CLIENTS + 16])
def test_no_task_and_no_descriptor_is_left_of_it(
    tmp_path: Path, end: Callable[[Robot], Awaitable[None]], clients: int
) -> None:
    async def leave() -> None:
        async with running_robot(socket=tmp_path / "socket") as robot:
            await clear(robot)
            before = asyncio.all_tasks(), len(os.listdir("/proc/self/fd"))
            await robot.call("simulation.fault", kind="client_flood", clients=clients, for_s=0.15)
            await asyncio.sleep(BEGUN_S)
            await end(robot)
            await asyncio.sleep(GONE_S)
            assert (asyncio.all_tasks(), len(os.listdir("/proc/self/fd"))) == before

    run_with_sockets(leave())


def test_a_daemon_that_ends_takes_its_flood_with_it(tmp_path: Path) -> None:
    async def end() -> None:
        async with flooded(tmp_path / "socket", 3):
            assert len(asyncio.all_tasks()) > 3
        assert [task for task in asyncio.all_tasks() if "floods" in task.get_name()] == []

    run_with_sockets(end())


async def test_a_robot_without_a_socket_has_no_clients_to_flood_it() -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError, match="the daemon has no socket here") as refused:
            await robot.call("simulation.fault", kind="client_flood", clients=3)
    assert refused.value.remedy == "set it in `canhelm run --simulate`"
