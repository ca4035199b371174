"""Driving a robot on two wheels by a stream of speeds and yaw rates."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from daemon.loops.differential_twist import DifferentialTwistLaw
from daemon.loops.measurement import Command, Measurement
from daemon.runtime.motions import Motion
from daemon.runtime.rest import AT_REST_M_S
from daemon.runtime.streams import Streamed


class SetPoint(NamedTuple):
    """What is wanted of the robot's body."""

    forward_m_s: float
    yaw_rate_rad_s: float


STANDING = SetPoint(0.0, 0.0)


class DifferentialStream(Motion):
    """Driving by a stream of values (``drive.set``); the robot comes to rest when the last one is too old.

    Args:
        law: of its own.
        stream: of set points.
    """

    def __init__(
        self,
        kind: str,
        drives: tuple[str, ...],
        lease: str | None,
        law: DifferentialTwistLaw,
        stream: Streamed[SetPoint],
    ) -> None:
        super().__init__(kind, drives, lease, stream)
        self._law = law

    def step(self, measurement: Measurement, dt_s: float) -> Command:
        """Follow the newest value, or come to rest where it is too old or the motion was stopped."""
        wanted: SetPoint = self.newest(None) or STANDING
        command = self._law.step(*(STANDING if self.stop_reason else wanted), dt_s)
        rests = all(abs(speed) < AT_REST_M_S for speed in measurement.wheel_speed_m_s)
        if self.stop_reason and rests and not any(command.wheel_speed_m_s):
            self.finish({})
        return command

    def progress(self) -> dict[str, Any]:
        """What is commanded."""
        return {
            "phase": "stopping" if self.stop_reason else "driving",
            "speed_m_s": round(self._law.forward_m_s, 4),
            "yaw_rate_deg_s": round(math.degrees(self._law.yaw_rate_rad_s), 2),
        }
