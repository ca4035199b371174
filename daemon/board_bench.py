"""How fast a control cycle this machine keeps: the daemon at growing rates, late cycles, latency and lost frames."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

from msgspec.structs import replace

from canhelm.errors import Timeout
from daemon.app import App
from daemon.runtime.vehicle import VehicleState
from drivers.canopen.nmt import SYNC_COB_ID
from profiles.schema import Profile

RATES_HZ = (50.0, 100.0, 150.0, 200.0, 300.0, 400.0, 500.0)
BOOT_DEADLINE_S = 20.0
SPEED_SHARE = 0.5
"""Of the vehicle's largest speed, at which a simulated robot drives meanwhile."""


@dataclass(frozen=True, slots=True)
class RateResult:
    """How the control cycle fared at one rate.

    Attributes:
        hz: the rate.
        cycles: cycles measured.
        late_cycles: of these, how many ended after their period.
        worst_jitter_ms: largest difference between the time from one SYNC to the next and the period.
        latency_ms, worst_latency_ms: from SYNC on the wire to the new targets, at the median and at worst.
        lost_frames: frames that were not sent in time, or for which there was no room.
        safe: none was late, and none was lost.
    """

    hz: float
    cycles: int
    late_cycles: int
    worst_jitter_ms: float
    latency_ms: float
    worst_latency_ms: float
    lost_frames: int
    safe: bool


class _Stopwatch:
    """Times from each SYNC to the next, and to the end of its control step."""

    def __init__(self, app: App) -> None:
        self.latencies_s: list[float] = []
        self.intervals_s: list[float] = []
        self._loop = asyncio.get_running_loop()
        self._sync_s = math.nan
        self._stepped = True
        app.bus.taps.append(self._on_frame)
        app.supervisor.observers.append(self._on_step)

    def _on_frame(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        if can_id == SYNC_COB_ID:
            if not math.isnan(self._sync_s):
                self.intervals_s.append(timestamp_s - self._sync_s)
            self._sync_s = timestamp_s
            self._stepped = False

    def _on_step(self) -> None:
        if not self._stepped:
            self._stepped = True
            self.latencies_s.append(self._loop.time() - self._sync_s)


async def bench(profile: Profile, bus: str, duration_s: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Run the daemon at one rate after the other until one is not safe.

    A simulated robot drives straight on meanwhile; a real one stands with its drives off.

    Args:
        profile: the robot.
        bus: SPEC of its bus.
        duration_s: for all rates together, without the boot-ups.
        tell: hears a sentence at each rate.

    Returns:
        ``highest_safe_hz`` (None where not even the lowest one is), and ``rates``.

    Raises:
        Timeout: the robot did not boot at the lowest rate; at another one that rate is not safe.
        UsageError: the bus SPEC means nothing.
    """
    results: list[RateResult] = []
    for hz in RATES_HZ:
        tell(f"{hz:g} cycles a second for {duration_s / len(RATES_HZ):.1f} s")
        try:
            results.append(await measure_rate(profile, bus, hz, duration_s / len(RATES_HZ)))
        except Timeout as error:
            if not results:
                raise
            tell(error.message)
            break
        if not results[-1].safe:
            break
    safe = [result.hz for result in results if result.safe]
    return {"highest_safe_hz": max(safe, default=None), "bus": bus, "rates": [asdict(result) for result in results]}


async def measure_rate(profile: Profile, bus: str, hz: float, duration_s: float) -> RateResult:
    """Run the daemon at one rate; arguments and errors as in :func:`bench`."""
    app = App(replace(profile, network=replace(profile.network, cycle_hz=hz)), bus)
    await app.start()
    try:
        await _boot(app)
        if app.network is not None and "drive.parallel" in app.vehicle.methods:
            speed = SPEED_SHARE * profile.limits.speed_m_s
            params = {"angle_deg": 0.0, "speed_m_s": speed, "duration_s": duration_s + 10.0, "wait": False}
            await app.service.call("drive.parallel", params, None)
        return await _watch(app, hz, duration_s)
    finally:
        await app.close()


async def _boot(app: App) -> None:
    """Wait until the vehicle is idle. Raises Timeout."""
    loop = asyncio.get_running_loop()
    ready = loop.create_future()

    def look() -> None:
        if app.supervisor.state is VehicleState.IDLE and not ready.done():
            ready.set_result(None)

    app.supervisor.observers.append(look)
    try:
        async with asyncio.timeout(BOOT_DEADLINE_S):
            await ready
    except TimeoutError:
        message = f"the robot did not boot in {BOOT_DEADLINE_S:g} s: {app.supervisor.message}"
        raise Timeout(message, remedy="switch its power on; another daemon on this bus must not run") from None
    finally:
        app.supervisor.observers.remove(look)


async def _watch(app: App, hz: float, duration_s: float) -> RateResult:
    counters, sent = app.cycle.counters, app.bus.counters
    stopwatch = _Stopwatch(app)
    before = (counters.cycles, counters.late_cycles, sent.dropped_stale + sent.dropped_full)
    await asyncio.sleep(duration_s)
    after = (counters.cycles, counters.late_cycles, sent.dropped_stale + sent.dropped_full)
    cycles, late, lost = (now - then for now, then in zip(after, before, strict=True))
    latencies_ms = [1e3 * latency for latency in stopwatch.latencies_s] or [math.nan]
    jitters_ms = [1e3 * abs(interval - 1 / hz) for interval in stopwatch.intervals_s] or [math.nan]
    stopped = app.supervisor.state in (VehicleState.FAULT, VehicleState.ESTOP)
    return RateResult(
        hz,
        cycles,
        late,
        round(max(jitters_ms), 3),
        round(median(latencies_ms), 3),
        round(max(latencies_ms), 3),
        lost,
        late == lost == 0 and not stopped and cycles > 0,
    )
