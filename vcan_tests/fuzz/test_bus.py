"""Any frames at any time on the bus of a running robot: it goes on, stops when it is told, and boots again."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable
from functools import cache

from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import CanhelmError
from daemon.runtime.clock import run_virtual
from drivers.bus.candump import LogFrame, make_line, parse_line
from drivers.bus.contract import RTR_FLAG
from drivers.contract import NodeState
from vcan_tests.fuzz.target import Target, few
from vcan_tests.robot import Robot, running_robot

BOOTED_S, DRIVEN_S, LONGEST_S = 0.4, 1.5, 3.0
"""When the robot begins to drive, for how long, and how long frames come."""
MOST_FRAMES = 60
RECOVERY_S = 30.0
SENDERS = ("drive", "encoder", "master")
BASES = (0x000, 0x080, 0x100, 0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500, 0x580, 0x600, 0x700, 0x7E4)


@cache
def usual_frames() -> tuple[LogFrame, ...]:
    """What goes over the bus while the robot boots, drives and stops; each kind of frame a few times."""
    heard: dict[tuple[int, bytes], LogFrame] = {}

    def tap(can_id: int, data: bytes, time_s: float) -> None:
        heard.setdefault((can_id, data[:4]), LogFrame(time_s, "vcan0", can_id, data))

    async def scenario() -> None:
        async with running_robot(booted=False) as robot:
            robot.app.bus.taps.append(tap)
            await asyncio.sleep(BOOTED_S)
            await drive(robot)

    run_virtual(scenario())
    return tuple(heard.values())


async def drive(robot: Robot) -> None:
    """A turn, as far as it gets."""
    with contextlib.suppress(CanhelmError):
        await robot.call("drive.turn", rear_deg=8, front_deg=-16, speed_m_s=0.4, duration_s=DRIVEN_S)


IDS = st.one_of(
    st.builds(int.__add__, st.sampled_from(BASES), st.integers(0, 8)).map(lambda number: min(number, 0x7FF)),
    st.integers(0, 0x7FF),
)
NOISE = st.tuples(IDS, st.binary(max_size=8)) | IDS.map(lambda number: (number | RTR_FLAG, b""))


@st.composite
def nearly_usual(draw: st.DrawFn) -> tuple[int, bytes]:
    """A frame that the bus really carries, at another time, from another node, or with other data."""
    frame = draw(st.sampled_from(usual_frames()))
    data, can_id = bytearray(frame.data), frame.can_id
    for _ in range(draw(st.integers(0, 2)) if data else 0):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    size = draw(st.sampled_from((len(data), len(data), len(data), 0, 1, 4, 8)))
    if draw(st.integers(0, 4)) == 0:
        can_id = can_id & ~0x7F & 0x7FF | draw(st.integers(0, 8))
    return can_id, bytes(data.ljust(size, b"\0")[:size])


@st.composite
def logs(draw: st.DrawFn) -> bytes:
    """Frames with the times at which they come, as a log of candump."""
    times = sorted(draw(st.lists(st.floats(0.0, LONGEST_S), min_size=1, max_size=MOST_FRAMES)))
    frames = [(time_s, *draw(nearly_usual() | NOISE)) for time_s in times]
    return "\n".join(make_line(time_s, "vcan0", can_id, data) for time_s, can_id, data in frames).encode()


def attempt(content: bytes) -> None:
    frames = filter(None, map(parse_line, content.decode("ascii", "replace").splitlines()))
    run_virtual(disturbed_life(sorted(frames)))


async def disturbed_life(frames: Iterable[LogFrame]) -> None:
    async with running_robot(booted=False, expect_errors=True) as robot:
        driving = asyncio.create_task(begin_driving(robot))
        await send(robot, frames)
        await stops(robot)
        await driving
        await boots_again(robot)


async def begin_driving(robot: Robot) -> None:
    await asyncio.sleep(BOOTED_S)
    await drive(robot)


async def send(robot: Robot, frames: Iterable[LogFrame]) -> None:
    """Let a stranger on the bus send the frames at their times."""
    assert robot.app.medium is not None
    port, loop = robot.app.medium.port("stranger"), asyncio.get_running_loop()
    for frame in frames:
        await asyncio.sleep(max(0.0, min(frame.timestamp_s, LONGEST_S) - loop.time()))
        port.send(frame.can_id, frame.data)
    await asyncio.sleep(max(0.0, LONGEST_S - loop.time()))
    await port.close()


async def stops(robot: Robot) -> None:
    """The emergency stop is answered, and everything comes to rest."""
    await robot.call("estop")
    await robot.until(lambda: robot.fastest_wheel_m_s < 1e-3, RECOVERY_S)


async def boots_again(robot: Robot) -> None:
    """With its power switched off and on it is as it was."""
    robot.network.power_off()
    await asyncio.sleep(1.0)
    robot.network.power_on()
    nodes = robot.app.devices.by_node.values()
    await robot.until(lambda: all(node.node_state is NodeState.READY for node in nodes), RECOVERY_S)
    await robot.call("reset")
    await robot.until(lambda: robot.state == "idle", RECOVERY_S)


BUS = Target("bus", logs(), attempt)


@few(6)
@given(BUS.inputs)
def test_no_frames_bring_a_running_robot_down(content: bytes) -> None:
    BUS.check(content)


def test_a_robot_that_nobody_disturbs_passes() -> None:
    BUS.check(b"")
