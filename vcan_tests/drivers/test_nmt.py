"""NMT and error control: bytes, and what a person's NMT command does."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.codes import NmtCommand
from drivers.canopen.nmt import make_nmt, parse_error_control
from drivers.contract import NodeState
from vcan_tests.drivers.bench import bench


def test_a_start_of_node_2_is_two_bytes() -> None:
    assert make_nmt(NmtCommand.START, 2) == b"\x01\x02"


@given(st.integers(0, 1), st.integers(0, 127))
def test_toggle_and_state_come_back(toggle: int, state: int) -> None:
    assert parse_error_control(bytes((toggle << 7 | state,))) == (toggle, state)


@pytest.mark.parametrize("data", [b"", b"\x05\x00"])
def test_other_lengths_are_no_error_control(data: bytes) -> None:
    assert parse_error_control(data) is None


async def test_a_stopped_node_is_held_until_it_is_started() -> None:
    async with bench() as b:
        b.master.nmt(NmtCommand.STOP, 3)
        await asyncio.sleep(2.0)
        assert b.drive().node_state is NodeState.ABSENT
        assert "held by command" in b.drive().status_sentence
        b.master.nmt(NmtCommand.START, 3)
        await asyncio.sleep(0.5)
        assert b.drive().node_state is NodeState.READY


async def test_a_node_that_is_held_while_it_is_configured_is_not_started() -> None:
    async with bench(powered=False) as b:
        b.network.power_on()
        await asyncio.sleep(0.16)
        drive = b.drive("rear_left")
        assert drive.node_state is NodeState.CONFIGURING
        b.master.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, drive.node)
        await asyncio.sleep(1.0)
        assert "held by command" in drive.status_sentence


async def test_a_start_of_all_starts_no_node_that_is_not_configured() -> None:
    async with bench(powered=False) as b:
        frames: list[tuple[int, bytes]] = []
        b.port.taps.append(lambda can_id, data, _: frames.append((can_id, data)))
        b.master.nmt(NmtCommand.START, 0)
        await asyncio.sleep(0.05)
        assert (0, b"\x01\x00") not in frames


async def test_a_reset_node_is_configured_again() -> None:
    async with bench() as b:
        b.master.nmt(NmtCommand.RESET_NODE, 3)
        await asyncio.sleep(1.0)
        assert b.kinds(3)[-2:] == ["rebooted", "ready"]


async def test_a_node_that_somebody_else_stopped_is_configured_again() -> None:
    async with bench() as b:
        b.intruder.send(0, make_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 3))
        await asyncio.sleep(0.5)
        lost = next(event for event in b.events if event.kind == "lost")
        assert "no longer operational but pre-operational" in lost.message
        assert b.drive().node_state is NodeState.READY
