"""What a client calls itself, and who is told that."""

from __future__ import annotations

import os
import re

import pytest

from vcan_tests.daemon.api.raw_client import RawClient
from vcan_tests.daemon.fake_backend import FakeBackend
from vcan_tests.robot import running_robot

pytestmark = pytest.mark.real_time

PAGE = "page 482 at 192.168.1.7"
DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 5.0, "wait": False}


async def test_a_client_that_has_a_name_is_told_by_it(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("client.name", name=PAGE)
    await client.ask("drive.parallel", angle_deg=0.0, speed_m_s=0.1, duration_s=0.1)
    assert backend.clients[0]["name"] == PAGE
    assert backend.clients[0]["client"].startswith(f"{PAGE} by {backend.clients[0]['user']} (pid ")


async def test_hello_tells_a_client_its_name(client: RawClient) -> None:
    assert (await client.ask("hello"))["result"]["name"] == ""
    await client.ask("client.name", name=f" {PAGE} ")
    assert (await client.ask("hello"))["result"]["name"] == PAGE


@pytest.mark.parametrize("name", ["", "  ", "x" * 61, "page\n4", "\x1b[1m"])
async def test_a_name_that_people_could_not_read_is_refused(client: RawClient, name: str) -> None:
    error = (await client.ask("client.name", name=name))["error"]
    assert error["data"]["object"] == "name"
    assert "1 to 60" in error["data"]["remedy"]


async def test_a_stop_that_ends_a_motion_is_an_event_that_tells_how_it_came() -> None:
    async with running_robot() as robot:
        await robot.call("drive.parallel", **DRIVE)
        await robot.call("stop", reason=f"pressed on {PAGE}")
        told = [event["message"] for event in robot.app.service.status()["events"]]
    assert told.count(f"stop was pressed on {PAGE}") == 1


async def test_a_stop_without_a_reason_tells_by_whom_it_was_commanded(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("stop")
    assert re.fullmatch(rf"commanded by \S+ \(pid {os.getpid()}: .+\)", backend.calls[-1][1]["reason"])
    await client.ask("client.name", name=PAGE)
    await client.ask("stop")
    assert backend.calls[-1][1]["reason"].startswith(f"commanded by {PAGE} by ")


async def test_a_stop_keeps_the_reason_that_it_came_with(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("stop", reason="pressed")
    assert backend.calls[-1][1]["reason"] == "pressed"


async def test_a_stop_of_a_robot_that_does_nothing_is_no_event() -> None:
    async with running_robot() as robot:
        await robot.call("stop")
        told = [event["message"] for event in robot.app.service.status()["events"]]
    assert not [message for message in told if message.startswith("stop was")]
