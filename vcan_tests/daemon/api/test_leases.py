"""A motion ends with the connection that asked for it, unless it was handed over."""

from __future__ import annotations

import os
import pwd

import pytest

from canhelm import protocol
from vcan_tests.daemon.api.raw_client import RawClient, until
from vcan_tests.daemon.fake_backend import FakeBackend

pytestmark = pytest.mark.real_time


async def test_a_motion_is_held_by_the_lease_of_its_connection(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    assert backend.calls[0][2] == "lease-1"


async def test_the_daemon_is_told_who_hands_a_motion_over(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01, wait=False)
    assert backend.calls[0][2] == "lease-1"


async def test_a_lease_is_opened_with_user_pid_and_command_of_the_client(
    client: RawClient, backend: FakeBackend
) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    (told,) = backend.clients
    assert (told["user"], told["pid"]) == (pwd.getpwuid(os.getuid()).pw_name, os.getpid())
    assert told["client"] == f"{told['user']} (pid {told['pid']}: {told['command']})"


async def test_a_client_takes_the_robot_over_with_the_lease_that_holds_its_next_motion(
    client: RawClient, backend: FakeBackend
) -> None:
    assert (await client.ask("lease.take"))["result"] == {"taken_from": "somebody"}
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    assert backend.taken == [backend.calls[0][2]]


async def test_a_motion_without_an_end_cannot_be_handed_over(client: RawClient) -> None:
    error = (await client.ask("motor.velocity", node=1, velocity_rpm=100, wait=False))["error"]
    assert error["data"]["object"] == "duration_s"


async def test_renewals_flow_while_a_motion_waits(client: RawClient, backend: FakeBackend) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    client.send(protocol.make_request(2, "lease.renew", {}))
    assert (await client.answer()) == {"jsonrpc": "2.0", "id": 2, "result": {"lease": "lease-1"}}


async def test_a_client_that_hangs_up_loses_its_lease(client: RawClient, backend: FakeBackend) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    await until(lambda: backend.calls)
    client.writer.close()
    await until(lambda: backend.stopped == ["lease-1"])


async def test_closing_the_lease_answers_after_the_motion_has_ended(client: RawClient) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 100}))
    client.send(protocol.make_request(2, "lease.close", {}))
    assert [(await client.answer())["id"], (await client.answer())["id"]] == [1, 2]


async def test_closing_the_lease_answers_after_a_streamed_motion_has_come_to_rest(
    client: RawClient, backend: FakeBackend
) -> None:
    backend.at_rest.clear()
    await client.ask("drive.set", speed_m_s=0.3, valid_for_ms=200)
    client.send(protocol.make_request(2, "lease.close", {}))
    client.send(protocol.make_request(3, "hello", {}))
    before = (await client.answer())["id"]
    backend.at_rest.set()
    assert (before, (await client.answer())["id"]) == (3, 2)


async def test_a_command_after_a_lease_ran_out_begins_a_new_one(client: RawClient, backend: FakeBackend) -> None:
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    backend.close_lease("lease-1")
    await client.ask("motor.velocity", node=1, velocity_rpm=100, duration_s=0.01)
    assert backend.calls[1][2] == "lease-2"


async def test_a_client_that_lets_go_of_its_motion_has_not_hung_up(backend: FakeBackend, client: RawClient) -> None:
    client.send(protocol.make_request(1, "motor.velocity", {"node": 1, "velocity_rpm": 5}))
    await client.ask("hello")
    client.send(protocol.make_request(2, "lease.close", {}))
    await client.answer()
    assert backend.stop_reasons == ["its client ended it"]
