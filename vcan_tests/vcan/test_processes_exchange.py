"""Boot, guarding and cyclic data between a simulated robot and its daemon in two processes, as candump sees them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import pytest

from vcan_tests.vcan.bench import Bench, bench, patient
from vcan_tests.vcan.witness import Frame

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

NODES = range(1, 7)
START, BOOT_UP = b"\x01", b"\x00"
OPERATIONAL = 5


STOOD_STILL = 0.2
"""Share of the cycles in which a busy machine may keep both processes waiting; the kernel's SYNC goes on meanwhile."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    folder = tmp_path_factory.mktemp("exchange")
    with bench(folder, patient(cycle_hz=25), options=("--record", str(folder / "recorded.log"))) as made:
        yield made


@pytest.fixture(scope="module")
def frames(robot: Bench) -> list[Frame]:
    """What was on the wire until some seconds after the robot was ready."""
    robot.daemon.wait_for(lambda status: status["cycle"]["cycles"] > 150)
    return robot.wire.frames()


def first(frames: list[Frame], can_id: int, data: bytes) -> int:
    """Where a data frame that begins so is first in the log."""
    return next(n for n, frame in enumerate(frames) if frame.can_id == can_id and frame.data.startswith(data))


@pytest.mark.parametrize("node", NODES)
def test_a_node_is_configured_between_its_boot_up_and_its_start(frames: list[Frame], node: int) -> None:
    started = first(frames, 0x000, START + bytes((node,)))
    guard_time_written = first(frames, 0x600 + node, b"\x2b\x0c\x10\x00")
    assert first(frames, 0x700 + node, BOOT_UP) < guard_time_written < started


def test_nodes_are_started_one_by_one(frames: list[Frame]) -> None:
    started = [frame.data[1] for frame in frames if frame.can_id == 0x000 and frame.data[:1] == START]
    assert sorted(started) == list(NODES)


@pytest.mark.parametrize("node", NODES)
def test_a_node_answers_its_guarding_with_a_bit_that_toggles(frames: list[Frame], node: int) -> None:
    started = first(frames, 0x000, START + bytes((node,)))
    guarding = [frame for frame in frames[started:] if frame.can_id == 0x700 + node]
    requests, answers = guarding[0::2], guarding[1::2]
    assert all(request.remote for request in requests)
    assert {answer.data[0] & 0x7F for answer in answers} == {OPERATIONAL}
    assert all(one.data != next_one.data for one, next_one in pairwise(answers))


def test_each_sync_brings_one_pdo_of_every_node_and_a_target_for_every_drive(frames: list[Frame]) -> None:
    last_start = max(first(frames, 0x000, START + bytes((node,))) for node in NODES)
    counts = Counter(frame.can_id for frame in frames[last_start:])
    cycles = counts[0x080]
    assert cycles > 50
    for can_id in (*range(0x181, 0x185), 0x285, 0x286, *range(0x201, 0x205)):
        assert counts[can_id] == pytest.approx(cycles, rel=STOOD_STILL)


def test_the_daemon_records_what_candump_sees_in_the_same_order(robot: Bench) -> None:
    robot.daemon.wait_for(lambda status: status["recording"]["frames"] > 2000)
    recorded = contents((robot.profile.parent / "recorded.log").read_text())
    assert recorded.count("\n") > 500
    assert recorded in contents(robot.wire.text())


def contents(log: str) -> str:
    """The frames of a log without times and interface, a line each."""
    return "\n".join(line.rpartition(" ")[2] for line in log.splitlines())
