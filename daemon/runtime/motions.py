"""Motions: each thing that somebody asked a vehicle or a motor to do, from its begin to its end."""

from __future__ import annotations

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

from canhelm.errors import CanhelmError, DeviceFault, Refused
from daemon.loops.measurement import Command, Measurement
from daemon.loops.path import Path
from daemon.runtime.following import Following
from daemon.runtime.streams import Streamed
from drivers.contract import Drive, DriveState

T = TypeVar("T")
REST_WITHIN_S = 5.0
"""Time in which a wheel has to come to rest after zero was commanded; ramps need less."""


class Motion(ABC):
    """One motion.

    The supervisor enables the drives it needs, calls :meth:`step` once a cycle until :attr:`ended` is set, and then
    leaves the drives as it found them.

    Args:
        kind: the method that asked for it (``drive.turn``).
        drives: names of the drives it moves.
        lease: who holds it; None for a finite motion that was handed to the daemon.
        stream: of a motion whose caller does not wait for it but goes on with new values, these.

    Attributes:
        identity: number by which clients name it.
        ended: holds the result, or the error that ended it.
        closed: set when its drives are at rest and as it found them.
        asked: parameters that it was asked for with.
        record: terms of its law's last step; None before the first, and where it has no law.
        path: that is followed; None where none is.
    """

    record: object | None = None
    path: Path | None = None

    def __init__(
        self, kind: str, drives: tuple[str, ...], lease: str | None, stream: Streamed[Any] | None = None
    ) -> None:
        self.identity = ""
        self.kind = kind
        self.drives = drives
        self.lease = lease
        self.stream = stream
        self.running = False
        self.stop_reason = ""
        self.begun_s = 0.0
        self.asked: dict[str, Any] = {}
        self.ended: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self.ended.add_done_callback(_observe)
        self.closed = asyncio.Event()

    @abstractmethod
    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One cycle: what the wheels shall do now. Calls :meth:`finish` or :meth:`fail` when it is over."""

    async def start(self) -> None:
        """Called once when the drives are enabled, before the first step."""

    def begin(self, now_s: float) -> None:
        """From now on :meth:`step` is called."""
        self.running = True
        self.begun_s = now_s

    def stop(self, reason: str) -> None:
        """Bring the motion to rest by its ramp and end it."""
        self.stop_reason = self.stop_reason or reason

    def newest(self, target: T | None) -> T | None:
        """What to do now: the stream's value, None where that is too old; without a stream the target as it is.

        A stream that is over stops the motion.
        """
        if self.stream is None:
            return target
        value: T | None = self.stream.newest()
        if not self.stop_reason and self.stream.over:
            self.stop("no new value came")
        return value

    @property
    def goes_on_at_rest(self) -> bool:
        """Whether rest is not its end: until it is stopped, a stream may bring a new value."""
        return self.stream is not None and not self.stop_reason

    def progress(self) -> dict[str, Any]:
        """How far it is, for ``status``."""
        return {}

    def following(self) -> Following | None:
        """How the vehicle stands to the path; None before the first step, and where no path is followed."""
        return None

    def summary(self) -> dict[str, Any]:
        """The motion for ``status``; of one that is over only that its drives are being stopped."""
        told = {"phase": "stopping"} if self.ended.done() else self._told()
        return {"motion": self.identity, "kind": self.kind, "drives": list(self.drives), **told}

    @property
    def terms(self) -> object:
        """What is recorded of its newest step: the terms of its law, or its progress where it has no law."""
        return self._told() if self.record is None else self.record

    def _told(self) -> dict[str, Any]:
        """Its progress, and the age of a stream's newest value."""
        age = {} if self.stream is None else {"value_age_ms": self.stream.age_ms}
        return {**self.progress(), **age}

    async def result(self) -> dict[str, Any]:
        """Wait until it is closed; its result. Raises the error that ended it."""
        await self.closed.wait()
        return self.ended.result()

    def finish(self, result: dict[str, Any]) -> None:
        """End well, or as stopped where a stop was asked for."""
        if self.ended.done():
            return
        if self.stop_reason:
            self.fail(Refused(f"the motion was stopped: {self.stop_reason}", value=self._told() or None))
        else:
            self.ended.set_result(result)

    def fail(self, error: CanhelmError) -> None:
        """End with an error."""
        if not self.ended.done():
            self.ended.set_exception(error)


def _observe(future: asyncio.Future[dict[str, Any]]) -> None:
    """Mark an error as seen: whoever waits for the motion hears of it, and often nobody does."""
    if not future.cancelled():
        future.exception()


class DriveVelocity(Motion):
    """What motions of one drive at a speed have in common: their end.

    Args:
        drive: the drive.
        duration_s: time from the begin after which it ends; None: until stopped.
    """

    AT_REST_M_S = 0.01

    def __init__(self, kind: str, drive: Drive, duration_s: float | None, lease: str | None) -> None:
        super().__init__(kind, (drive.name,), lease)
        self._drive = drive
        self._remaining_s = math.inf if duration_s is None else duration_s
        self._slowing_s = 0.0

    def _is_over(self, dt_s: float) -> bool:
        """Whether zero is commanded from now on; a drive that does not come to rest then fails the motion."""
        self._remaining_s -= dt_s
        if not self.stop_reason and self._remaining_s > 0.0:
            return False
        self._slowing_s += dt_s
        if self._slowing_s > REST_WITHIN_S:
            what = (
                f"{self._drive.name} does not come to rest: {self._drive.speed_m_s:.2f} m/s after {REST_WITHIN_S:g} s"
            )
            remedy = "look at its encoder and its direction, and at what turns it"
            self.fail(DeviceFault(what, node=self._drive.node, remedy=remedy))
        return True


class WheelVelocity(DriveVelocity):
    """One wheel at a speed, for a time or until stopped.

    Args:
        wheel: index of the wheel in the vehicle's order.
        drive: its drive.
        speed_m_s: target speed at the rim.
        duration_s: time from the begin after which it ends; None: until stopped.
        wheel_count: number of wheels of the vehicle.
    """

    def __init__(
        self,
        kind: str,
        drive: Drive,
        wheel: int,
        wheel_count: int,
        speed_m_s: float,
        duration_s: float | None,
        lease: str | None,
    ) -> None:
        super().__init__(kind, drive, duration_s, lease)
        self._wheel = wheel
        self._count = wheel_count
        self._speed_m_s = speed_m_s
        self._travel_m: float | None = None

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """The target until the time is over, then zero until the wheel is at rest."""
        travel = measurement.wheel_travel_m[self._wheel]
        self._travel_m = travel if self._travel_m is None else self._travel_m
        over = self._is_over(dt_s)
        speed = measurement.wheel_speed_m_s[self._wheel]
        if over and abs(speed) < self.AT_REST_M_S:
            self.finish({"wheel_travel_m": round(travel - self._travel_m, 6)})
        wheels = [0.0] * self._count
        wheels[self._wheel] = 0.0 if over else self._speed_m_s
        return Command(tuple(wheels))

    def progress(self) -> dict[str, Any]:
        """Target and measured speed, and the time left."""
        left = max(0.0, round(self._remaining_s, 3)) if math.isfinite(self._remaining_s) else None
        return {
            "target_velocity_rpm": round(self._drive.rpm_from_speed(self._speed_m_s), 1),
            "velocity_rpm": round(self._drive.rpm_from_speed(self._drive.speed_m_s), 1),
            "remaining_s": left,
        }


class AsideVelocity(DriveVelocity):
    """A drive that moves nothing of the vehicle at a speed, for a time or until stopped; its own ramp takes it there.

    Args:
        drive: the drive.
        wheel_count: number of wheels of the vehicle.
        speed_m_s: target speed at the rim.
        duration_s: time from the begin after which it ends; None: until stopped.
    """

    def __init__(
        self, kind: str, drive: Drive, wheel_count: int, speed_m_s: float, duration_s: float | None, lease: str | None
    ) -> None:
        super().__init__(kind, drive, duration_s, lease)
        self._zero = Command((0.0,) * wheel_count)
        self._speed_m_s = speed_m_s
        self._from_m = drive.position_m

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """The target until the time is over, then zero until the drive is at rest."""
        over = self._is_over(dt_s)
        self._drive.command_speed(0.0 if over else self._speed_m_s)
        if over and abs(self._drive.speed_m_s) < self.AT_REST_M_S:
            self.finish({"wheel_travel_m": round(self._drive.position_m - self._from_m, 6)})
        return self._zero

    def progress(self) -> dict[str, Any]:
        """Target and measured speed."""
        return {
            "target_velocity_rpm": round(self._drive.rpm_from_speed(self._speed_m_s), 1),
            "velocity_rpm": round(self._drive.rpm_from_speed(self._drive.speed_m_s), 1),
        }


class DriveMove(Motion):
    """A move that the drive carries out itself: profile position, homing, or current for a time.

    Args:
        drive: the drive.
        wheel_count: number of wheels of the vehicle.
        command: commands the move to the drive.
        duration_s: time after which it ends; None: when the drive reports its target reached (or until stopped, with
            ``until_stopped``).
        until_stopped: the move has no end of its own.
    """

    SETTLE_CYCLES = 3

    def __init__(
        self,
        kind: str,
        drive: Drive,
        wheel_count: int,
        lease: str | None,
        command: Callable[[], Awaitable[None]],
        *,
        duration_s: float | None = None,
        until_stopped: bool = False,
    ) -> None:
        super().__init__(kind, (drive.name,), lease)
        self._drive = drive
        self._zero = Command((0.0,) * wheel_count)
        self._remaining_s = duration_s
        self._until_stopped = until_stopped
        self._settled = 0
        self._command = command

    async def start(self) -> None:
        """Command the move, unless it was stopped before it began."""
        if not self.stop_reason:
            await self._command()

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """Watch the drive: over when its target is reached, or when it obeys the quick stop of a move cut short."""
        if self._remaining_s is not None:
            self._remaining_s -= dt_s
        elif not self._until_stopped:
            self._settled = self._settled + 1 if self._drive.at_target else 0
        over = self._settled >= self.SETTLE_CYCLES
        if self.stop_reason or (self._remaining_s is not None and self._remaining_s <= 0.0):
            over = self._drive.state is not DriveState.ENABLED
            if not over:
                self._drive.quick_stop()
        if over:
            self.finish({"position_m": round(self._drive.position_m, 6)})
        return self._zero

    def progress(self) -> dict[str, Any]:
        """Measured position, speed and current."""
        return {
            "position_m": round(self._drive.position_m, 6),
            "velocity_rpm": round(self._drive.rpm_from_speed(self._drive.speed_m_s), 1),
            "current_a": round(self._drive.current_a, 3),
        }
