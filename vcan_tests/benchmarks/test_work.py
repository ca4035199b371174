"""What a control cycle and an SDO upload take, in bytecodes, beside the same with plain structs on asyncio.

What is allowed is a little more than what it is. Where a change makes it less, lower it; where one makes it more, find
out why: ``bytecodes_of`` tells by function where they went.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass

import pytest

from benchmarks.cycle_canhelm import CanhelmCycle
from benchmarks.cycle_floors import AsyncioFloor
from benchmarks.sdo_canhelm import SdoCanhelm
from benchmarks.sdo_floors import SdoAsyncioFloor
from vcan_tests.benchmarks.work import usual_bytecodes

CYCLE, RECORDED_CYCLE, UPLOAD = 4.7, 6.3, 1.47
"""Times as many bytecodes as the floor of asyncio takes."""
OTHERS = 1.0 if sys.version_info[:2] == (3, 11) else 1.1
"""These were counted on Python 3.11; others have other bytecodes."""


@dataclass(frozen=True)
class NeedlessFrame:
    can_id: int
    data: bytes
    time_s: float


@pytest.fixture(scope="module")
def floor() -> float:
    with closing(AsyncioFloor()) as row:
        return usual_bytecodes(row.run)


@pytest.fixture
def driving() -> Iterator[CanhelmCycle]:
    with closing(CanhelmCycle(recording=False)) as row:
        yield row
        row.require_whole()


def test_a_control_cycle_takes_no_more_work_than_it_did(driving: CanhelmCycle, floor: float) -> None:
    assert usual_bytecodes(driving.run) / floor <= CYCLE * OTHERS


def test_nor_does_one_that_is_recorded(floor: float) -> None:
    with closing(CanhelmCycle(recording=True)) as row:
        assert usual_bytecodes(row.run) / floor <= RECORDED_CYCLE * OTHERS
        row.require_whole()


def test_an_object_for_each_frame_is_noticed(driving: CanhelmCycle, floor: float) -> None:
    receive = driving.bus.receiver
    assert receive is not None

    def with_an_object(can_id: int, data: bytes, time_s: float) -> None:
        frame = NeedlessFrame(can_id, data, time_s)
        receive(frame.can_id, frame.data, frame.time_s)

    driving.bus.receiver = with_an_object
    assert usual_bytecodes(driving.run) / floor > CYCLE


def test_an_sdo_upload_takes_no_more_work_than_it_did() -> None:
    with closing(SdoAsyncioFloor()) as least, closing(SdoCanhelm()) as upload:
        assert usual_bytecodes(upload.run) / usual_bytecodes(least.run) <= UPLOAD * OTHERS
