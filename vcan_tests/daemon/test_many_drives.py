"""Networks of many drives boot with the shipped guard times."""

from __future__ import annotations

import asyncio

import pytest

from benchmarks.nodes import drives_only
from benchmarks.robots import booted
from drivers.canopen.emcy import EMCY_COB_ID
from drivers.contract import NodeState


@pytest.mark.parametrize(("drives", "cycle_hz"), [(32, 100.0), (64, 20.0)])
async def test_many_drives_boot_and_none_of_them_misses_its_guarding(drives: int, cycle_hz: float) -> None:
    async with booted(drives_only(drives, cycle_hz)) as robot:
        await asyncio.sleep(1.0)
        app = robot.app
        assert app.medium is not None
        assert {device.node_state for device in app.devices.by_node.values()} == {NodeState.READY}
        assert app.master.counters.nodes_lost == 0
        assert [event["message"] for event in app.supervisor.log.events if event["severity"] != "info"] == []
        assert not app.medium.frames.keys() & range(EMCY_COB_ID + 1, EMCY_COB_ID + 128)


async def test_no_drive_is_told_to_be_absent_because_others_are_configured() -> None:
    async with booted(drives_only(32, 100.0)) as robot:
        told = [event["message"] for event in robot.app.supervisor.log.events]
        assert not [message for message in told if message.startswith("waiting for")]
