"""What control cycles load: the wire, and the processor with the daemon's share of it. On virtual time."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from benchmarks.robots import Scene, begin, booted
from benchmarks.share import DaemonShare
from daemon.demo_robot import DemoRobot
from daemon.runtime.clock import run_virtual
from drivers.bus.wire_time import frame_bits
from profiles.schema import Profile

TIMES, LEAST_CYCLES = 10, 2
UNSEEN_SHARE = 0.1
FIRST_SERVICE_ID = 0x580
"""Identifiers from here on are not of the control cycle: SDO, guarding."""


@dataclass(frozen=True)
class Load:
    """What the control cycles of one robot load.

    Attributes:
        cycles: measured.
        late_cycles: of these, those that ended after their period.
        incomplete_cycles: of these, those whose step ran without some reading.
        lost_frames: those that were not sent in time, or for which there was no room.
        bits: of SYNC and PDOs in a cycle, with their stuff bits.
        wire_share: share of the time that the wire was busy, guarding included.
        daemon_us: the daemon's time in a cycle, the least of several measurements; None where it was not seen: more
            than one step in ten was begun by the clock, because readings were late.
        boot_s: from the daemon's start until all nodes are operational.
    """

    cycles: int
    late_cycles: int
    incomplete_cycles: int
    lost_frames: int
    bits: float
    wire_share: float
    daemon_us: float | None
    boot_s: float


class CycleBits:
    """Counts bits of SYNC and PDOs. Add :meth:`see` to a bus' taps."""

    def __init__(self) -> None:
        self.bits = 0

    def see(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        """Take a frame."""
        if can_id < FIRST_SERVICE_ID:
            self.bits += frame_bits(can_id, data)


def load_of(profile: Profile, scene: Scene, seconds: float, settle_s: float) -> Load:
    """Run a robot on virtual time, so long after its boot-up, for so long. Raises Timeout where it does not boot."""
    return run_virtual(_load_of(profile, scene, seconds, settle_s))


async def _load_of(profile: Profile, scene: Scene, seconds: float, settle_s: float) -> Load:
    share, loop = DaemonShare(), asyncio.get_running_loop()
    begun_s = loop.time()
    with share.of_ticks():
        async with booted(profile) as robot:
            boot_s = loop.time() - begun_s
            share.of_frames(robot.app)
            await begin(robot, scene)
            await asyncio.sleep(settle_s)
            return await _watch(robot, share, seconds, boot_s)


async def _watch(robot: DemoRobot, share: DaemonShare, seconds: float, boot_s: float) -> Load:
    app, medium, counted, spans_us = robot.app, robot.app.medium, CycleBits(), []
    assert medium is not None
    app.bus.taps.append(counted.see)
    before, busy_s = _counts(robot), medium.busy_s
    span_s = max(seconds / TIMES, LEAST_CYCLES * app.cycle.period_s)
    for _ in range(TIMES):
        begun, spent_s = app.cycle.counters.cycles, share.spent_s
        await asyncio.sleep(span_s)
        spans_us.append(1e6 * (share.spent_s - spent_s) / (app.cycle.counters.cycles - begun))
    cycles, late, incomplete, lost = (now - then for now, then in zip(_counts(robot), before, strict=True))
    wire_share = (medium.busy_s - busy_s) / (TIMES * span_s)
    daemon_us = min(spans_us) if incomplete <= UNSEEN_SHARE * cycles else None
    return Load(cycles, late, incomplete, lost, counted.bits / cycles, wire_share, daemon_us, boot_s)


def _counts(robot: DemoRobot) -> tuple[int, int, int, int]:
    cycle, sent = robot.app.cycle.counters, robot.app.bus.counters
    return cycle.cycles, cycle.late_cycles, cycle.incomplete, sent.dropped_stale + sent.dropped_full
