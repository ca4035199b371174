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
    """A twist for a time, until stopped, or as a stream has it (``drive.set``), then rest.

    Args:
        law: of its own.
        senses: where the robot is.
        twist: what to do.
        duration_s: time after which it ends; None: until stopped.
        stream: of twists; the robot rests while the newest is too old.
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
        stream: Streamed[Twist] | None = None,
    ) -> None:
        super().__init__(kind, drives, lease, stream)
        self.target: Twist | None = twist
        self._law = law
        self._senses = senses
        self._remaining_s = math.inf if duration_s is None else duration_s

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """One step of the law; without a target it brings the robot to rest."""
        self.target = self.newest(self.target)
        if self.stop_reason or self._remaining_s < dt_s / 2:
            self.target = None
        self._remaining_s -= dt_s
        if self._senses.failure:
            raise DeviceFault(self._senses.failure, remedy=MEND)
        try:
            command = self._commanded(measurement, dt_s)
        except Exception as error:
            raise DeviceFault(failure_of(self._law, "step", error), remedy=MEND) from error
        at_rest = all(abs(speed) < AT_REST_M_S for speed in measurement.wheel_speed_m_s)
        if self.target is None and at_rest and not self.goes_on_at_rest:
            duration_s = round(measurement.time_s - self.begun_s, 3)
            self.finish({**place_and_heading(self._senses.pose), "duration_s": duration_s})
        return command

    def _commanded(self, measurement: Measurement, dt_s: float) -> Command:
        command = self._law.step(measurement, self.target, dt_s)
        if len(command.wheel_speed_m_s) != self._law.wheels:
            raise ValueError(f"{len(command.wheel_speed_m_s)} wheel speeds for {self._law.wheels} wheels")
        if len(command.release_brake) not in (0, self._law.brakes):
            raise ValueError(f"{len(command.release_brake)} brakes are commanded, there are {self._law.brakes}")
        return command

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
