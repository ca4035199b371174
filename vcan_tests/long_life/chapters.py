"""What people and programs do to a robot all day: each chapter is one visit, and leaves the robot at rest."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Sequence
from random import Random
from typing import Any, Final

from canhelm import protocol
from vcan_tests.long_life.random_faults import random_fault
from vcan_tests.long_life.stage import Stage

Motion = tuple[str, dict[str, Any]]
MOST_VISITORS, MOST_QUESTIONS = 50, 80
"""Of a crowd, and of each one in it."""


def random_motion(random: Random) -> Motion:
    """A motion of the MAX2D, some of them beyond its limits."""
    speed = random.choice((-1.0, 1.0)) * random.uniform(0.02, 0.9)
    duration = random.uniform(0.2, 5.0)
    kinds: tuple[Motion, ...] = (
        ("drive.parallel", {"angle_deg": random.uniform(-90.0, 90.0), "speed_m_s": speed, "duration_s": duration}),
        ("drive.turn", {"rear_deg": random.uniform(-30.0, 30.0), "front_deg": random.uniform(-30.0, 30.0),
                        "speed_m_s": speed, "duration_s": duration}),
        ("steer", {"pair": random.choice(("front", "rear")), "angle_deg": random.uniform(-90.0, 90.0)}),
        ("drive.path", {"path": {"pieces": [{"line_m": 0.5}, {"arc_deg": 40.0, "radius_m": 1.5}]}, "speed_m_s": 0.4}),
        ("motor.velocity", {"node": "front_left", "velocity_rpm": random.uniform(-200.0, 200.0), "duration_s": 0.5}),
        ("motor.position", {"node": "rear_left", "position_qc": random.randint(-1500, 1500), "relative": True}),
    )  # fmt: skip
    return random.choices(kinds, (5, 5, 3, 1, 1, 1))[0]


async def drive(stage: Stage) -> None:
    """Somebody drives."""
    async with stage.client() as person:
        for _ in range(stage.random.randint(1, 3)):
            method, params = random_motion(stage.random)
            await stage.ask(person, method, **params)


async def stream(stage: Stage) -> None:
    """A program sends set-points, and then no more."""
    random = stage.random
    async with stage.client() as program:
        direction_deg = random.uniform(-60.0, 60.0)
        for _ in range(random.randint(5, 60)):
            point = {"direction_deg": direction_deg, "speed_m_s": random.uniform(0.1, 0.5), "valid_for_ms": 200.0}
            await stage.ask(program, "drive.set", **point)
            await asyncio.sleep(0.05)
    await asyncio.sleep(3.0)


async def interrupt(stage: Stage) -> None:
    """A motion that somebody stops, or whose client hangs up."""
    random = stage.random
    async with stage.client() as person, stage.client() as other:
        method, params = random_motion(random)
        moving = asyncio.create_task(stage.ask(person, method, **params))
        await asyncio.sleep(random.uniform(0.0, 2.0))
        how = random.choice(("stop", "estop", "hang up", "lease.close"))
        if how == "hang up":
            await person.close()
        else:
            await stage.ask(person if how == "lease.close" else other, how)
        await moving
    if how == "estop":
        await stage.recover("an emergency stop")


async def tinker(stage: Stage) -> None:
    """Somebody looks into devices, asks for what there is not, and works the brakes."""
    random = stage.random
    questions: tuple[Motion, ...] = (
        ("sdo.read", {"node": "front_left", "object": "0x6064"}),
        ("sdo.read", {"node": 9, "object": "0x1000"}),
        ("sdo.write", {"node": "front_left", "object": "0x6064", "value": 0}),
        ("config.dump", {"node": "rear_right"}),
        ("nodes.scan", {"first": 1, "last": 8}),
        ("brake.release", {"pair": "front"}),
        ("motor.enable", {"node": "rear_left"}),
        ("drive.rotate", {"rate_deg_s": 10.0}),
        ("no.method", {}),
        ("bus.frames", {}),
        ("simulation.look", {}),
    )
    async with stage.client() as person:
        for method, params in random.sample(questions, 5):
            await stage.ask(person, method, **params)
        await stage.ask(person, "motor.disable", node="rear_left")
        await stage.ask(person, "brake.engage")


async def watch(stage: Stage) -> None:
    """Somebody watches for a while; somebody else asks for samples and never reads one."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + stage.random.uniform(1.0, 15.0)
    _, deaf = await asyncio.open_unix_connection(stage.socket)
    deaf.transport.pause_reading()  # type: ignore[attr-defined]  # of a StreamWriter it is that of both directions
    deaf.write(protocol.make_request(1, "subscribe", {"rate_hz": 50.0}))
    async with stage.client() as person:
        async for _ in person.notifications(rate_hz=stage.random.uniform(1.0, 20.0)):
            if loop.time() > end_s:
                break
    deaf.transport.abort()


async def crowd(stage: Stage) -> None:
    """More clients at once than there are places, each with more questions than it may have, and one with nonsense."""
    visitors = stage.random.randint(5, MOST_VISITORS)
    await _come_at_once(stage, [stage.random.randint(1, MOST_QUESTIONS) for _ in range(visitors)])
    reader, stranger = await asyncio.open_unix_connection(stage.socket)
    stranger.write(stage.random.randbytes(100) * 2000)
    with contextlib.suppress(OSError):
        await asyncio.wait_for(reader.read(), 5.0)
    stranger.transport.abort()


async def opening(stage: Stage) -> None:
    """The largest crowd that can be, so that no later one takes memory that was never taken before."""
    await _come_at_once(stage, [MOST_QUESTIONS] * MOST_VISITORS)


async def _come_at_once(stage: Stage, questions: Sequence[int]) -> None:
    """A client for each number, with so many questions at once, of which it keeps no answer."""
    async with stage.patience("a crowd"):  # one timer, for a virtual clock keeps those that are not needed any more
        await asyncio.gather(*(_flood(stage, times) for times in questions))


async def _flood(stage: Stage, times: int) -> None:
    visitor = stage.client()

    async def question() -> None:
        await stage.answer(visitor, "status")

    await visitor.connect()
    await asyncio.gather(*(question() for _ in range(times)))
    await visitor.close()


async def tool(stage: Stage) -> None:
    """Another CANopen tool at the gateway."""
    reader, writer = await asyncio.open_unix_connection(stage.gateway)
    for line in (b"[1] 3 r 0x6041 0 u16\n", b"[2] info version\n", b"[3] 9 r 0x1000 0 u32\n", b"[4] nonsense\n"):
        writer.write(line)
        await asyncio.wait_for(reader.readline(), 30.0)
    writer.close()


async def pause(stage: Stage) -> None:
    """Nobody comes."""
    await asyncio.sleep(stage.random.uniform(1.0, 80.0))


async def fault(stage: Stage) -> None:
    """Something breaks, mostly while the robot moves; somebody mends it, and gets the robot going again."""
    random = stage.random
    broken = random_fault(stage.app.profile, random)
    async with stage.client() as person, stage.client() as mechanic:
        method, params = random_motion(random)
        moving = asyncio.create_task(stage.ask(person, method, **params))
        await asyncio.sleep(random.uniform(0.0, 3.0))
        await stage.ask(mechanic, "simulation.fault", **broken)
        await asyncio.sleep(random.uniform(0.1, 4.0))
        if random.random() < 0.3:
            method, params = random_motion(random)
            await stage.ask(mechanic, method, **params)
        await stage.ask(mechanic, "simulation.clear_faults")
        await moving
    stage.counts[broken["kind"]] += 1
    await stage.recover(f"{broken}")


PEACEFUL: Final[dict[Callable[[Stage], Awaitable[None]], int]] = {
    drive: 8,
    stream: 3,
    interrupt: 4,
    tinker: 2,
    watch: 2,
    crowd: 1,
    tool: 1,
    pause: 9,
}
"""Chapters in which the robot must not fault, and how often each comes."""
FAULTS: Final = 8
"""How often something breaks beside them."""


async def random_chapter(stage: Stage) -> None:
    """One chapter, chosen by chance."""
    chapter = stage.random.choices((*PEACEFUL, fault), (*PEACEFUL.values(), FAULTS))[0]
    stage.counts[chapter.__name__] += 1
    befall = stage.happen if chapter is fault else stage.peace
    await befall(chapter.__name__, chapter(stage))
