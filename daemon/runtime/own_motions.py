"""Motions of a vehicle of one's own kind, from their begin to rest."""

from __future__ import annotations

import inspect
import math
import traceback
from typing import Any, Protocol

from canhelm.errors import DeviceFault
from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import Pose
from daemon.loops.own_vehicle import OwnVehicle, Twist
from daemon.runtime.motions import Motion
from daemon.runtime.poses import place_and_heading
from daemon.runtime.rest import AT_REST_M_S
from daemon.runtime.streams import Streamed

MEND = "mend the class, then start the daemon anew; the traceback is in the log"


def failure_of(law: OwnVehicle, method: str, error: Exception) -> str:
    """What failed in a law of one's own: its class and method, the error, and the line of the class's file."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename == inspect.getsourcefile(type(law))]
    place = f" ({own[-1].filename}:{own[-1].lineno})" if own else ""
    name = f"{type(law).__module__}:{type(law).__qualname__}"
    return f"{method} of {name} failed: {type(error).__name__}: {error}{place}"


class Senses(Protocol):
    """What the vehicle knows of its own motion."""

    pose: Pose
    failure: str


class OwnMotion(Motion):
    """A twist for a time, or until stopped, then rest.

    Args:
        law: of its own.
        senses: where the robot is.
        twist: what to do.
        duration_s: time after which it ends; None: until stopped.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        law: OwnVehicle,
        senses: Senses,
        twist: Twist,
        duration_s: float | None = None,
    ) -> None:
        super().__init__(kind, drives, lease)
        self.target: Twist | None = twist
        self._law = law
        self._senses = senses
        self._remaining_s = math.inf if duration_s is None else duration_s

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law; without a target it brings the robot to rest."""
        if self.stop_reason or self._remaining_s < dt_s / 2:
            self.target = None
        self._remaining_s -= dt_s
        if self._senses.failure:
            raise DeviceFault(self._senses.failure, remedy=MEND)
        try:
            command = self._commanded(measurement, dt_s)
        except Exception as error:
            raise DeviceFault(failure_of(self._law, "step", error), remedy=MEND) from error
        if self.target is None and all(abs(speed) < AT_REST_M_S for speed in measurement.wheel_speed_m_s):
            self.on_rest(measurement)
        return command

    def _commanded(self, measurement: Measurement, dt_s: float) -> Command:
        command = self._law.step(measurement, self.target, dt_s)
        if len(command.wheel_speed_m_s) != self._law.wheels:
            raise ValueError(f"{len(command.wheel_speed_m_s)} wheel speeds for {self._law.wheels} wheels")
        if len(command.release_brake) not in (0, self._law.brakes):
            raise ValueError(f"{len(command.release_brake)} brakes are commanded, there are {self._law.brakes}")
        return command

    def on_rest(self, measurement: Measurement) -> None:
        """At rest without a target."""
        duration_s = round(measurement.time_s - self.begun_s, 3)
        self.finish({**place_and_heading(self._senses.pose), "duration_s": duration_s})

    def progress(self) -> dict[str, Any]:
        """The target, and the time left."""
        forward, left, rate = self.target or Twist(0.0, 0.0, 0.0)
        return {
            "phase": "stopping" if self.target is None else "driving",
            "forward_m_s": round(forward, 4),
            "left_m_s": round(left, 4),
            "yaw_rate_deg_s": round(math.degrees(rate), 3),
            "remaining_s": max(0.0, round(self._remaining_s, 3)) if math.isfinite(self._remaining_s) else None,
        }


class OwnStream(OwnMotion):
    """Driving by a stream of twists (``drive.set``); the robot comes to rest when the last one is too old.

    Args:
        valid_for_s: age at which the first value is too old.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        law: OwnVehicle,
        senses: Senses,
        twist: Twist,
        valid_for_s: float,
    ) -> None:
        super().__init__(kind, drives, lease, law, senses, twist)
        self.stream: Streamed[Twist] = Streamed(twist, valid_for_s)

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """Follow the newest value, or come to rest where it is too old."""
        self.target = self.newest(self.stream, measurement.time_s)
        return super().step(measurement, dt_s)

    def on_rest(self, measurement: Measurement) -> None:
        """At rest: over only when it was stopped."""
        if self.stop_reason:
            super().on_rest(measurement)

    def progress(self) -> dict[str, Any]:
        """As of any motion, and the age of the last value."""
        return {**super().progress(), "value_age_ms": self.stream.age_ms}
