"""The law of a robot on omni-wheels: keeps it on the reference that a guide leads, and brings it to rest.

The wheels are commanded the reference's velocity, and on top of it a velocity in proportion to the distance from the
reference as it was when the wheels were last told; so a robot that follows as it should is not corrected.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import MAX_STEP_M, Pose, moved_along_arc
from daemon.loops.omni import Motion, OmniKinematics, OmniWheel
from daemon.loops.omni_guide import Guidance, Guide, TwistGuide, Vector, rotated
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from profiles.schema import OmniGeometry

GAIN_1_S: Final = 5.0
"""Velocity of correction per distance."""
MOST_CORRECTION: Final = 0.3
"""Largest velocity of correction [m/s, rad/s]."""
LAG_S: Final = 0.02
"""Time from a reference to a reading that shows it: a cycle to the drive, a cycle for its ramp and regulator."""
NEAR_M: Final = 0.002
"""So near to its goal the robot has arrived."""
NEAR_RAD: Final = 0.005
"""The same for its heading."""
PATIENCE_S: Final = 1.0
"""Time after which it has arrived where it is."""


def omni_kinematics(geometry: OmniGeometry) -> OmniKinematics:
    """Kinematics of a profile's wheels. Raises ValueError where they leave a motion undetermined."""
    wheels = geometry.wheels.values()
    return OmniKinematics([OmniWheel(math.radians(wheel.direction_deg), wheel.lever_m) for wheel in wheels])


class OmniOdometry:
    """Adds up what omni-wheels have rolled.

    Attributes:
        pose: where the robot's centre is.
        motion: of the body in its own frame, by the wheels' speeds.
        skipped: readings that were not used because they cannot be true.
    """

    def __init__(self, kinematics: OmniKinematics) -> None:
        self._kinematics = kinematics
        self._last: tuple[float, ...] | None = None
        self.pose = Pose()
        self.motion: Motion = (0.0, 0.0, 0.0)
        self.skipped = 0

    def update(self, measurement: Measurement) -> Pose:
        """Take one cycle's wheel travel; the first one only sets the start."""
        last, self._last = self._last, measurement.wheel_travel_m
        self.motion = self._kinematics.body_motion(measurement.wheel_speed_m_s)
        if last is None or last == self._last:
            return self.pose
        rolled = [new - old for new, old in zip(self._last, last, strict=True)]
        if not all(abs(way) <= MAX_STEP_M for way in rolled):
            self.skipped += 1
            return self.pose
        self.pose = moved_along_arc(self.pose, *self._kinematics.body_motion(rolled))
        return self.pose


@dataclass(frozen=True, slots=True)
class OmniRecord:
    """The terms of one step.

    Attributes:
        guidance: what the guide decided.
        measured_m_s2: acceleration of the centre in the fixed frame, None without an accelerometer.
        error: of the pose from the reference of that time: x, y [m], heading [rad].
        stopping: the guide was left, the robot is brought to rest.
        done: at rest at the end of the motion, or as near to its goal as it gets.
    """

    guidance: Guidance
    measured_m_s2: Vector | None
    error: tuple[float, float, float]
    stopping: bool
    done: bool


class OmniLaw:
    """The law.

    Args:
        kinematics: of the wheels.
        guide: leads the reference.
        limits: for coming to rest when the motion is stopped.
        pose: where the robot is at the begin.
        motion: its velocity in its own frame then.
    """

    def __init__(
        self, kinematics: OmniKinematics, guide: Guide, limits: PlanarLimits, pose: Pose, motion: Motion
    ) -> None:
        vx, vy = rotated((motion[0], motion[1]), pose.yaw_rad)
        self._kinematics = kinematics
        self._guide = guide
        self._limits = limits
        self._reference = PlanarState(pose.x_m, pose.y_m, pose.yaw_rad, vx, vy, motion[2])
        self._passed: deque[PlanarState] = deque()
        self._commanded: Vector = (0.0, 0.0)
        self._stopping = False
        self._over_s = 0.0

    def stop(self) -> None:
        """Bring the robot to rest with all of the limits, and be done."""
        if not self._stopping:
            self._stopping = True
            self._guide = TwistGuide((0.0, 0.0, 0.0), self._limits)

    def step(self, pose: Pose, centre_m_s2: Vector | None, dt: float) -> tuple[Command, OmniRecord]:
        """One cycle.

        Args:
            pose: by odometry.
            centre_m_s2: acceleration of the robot's centre in its own frame; None without an accelerometer.
            dt: length of the cycle [s].
        """
        measured = None if centre_m_s2 is None else rotated(centre_m_s2, pose.yaw_rad)
        guidance = self._guide.step(self._reference, measured, self._commanded, dt)
        self._reference, self._commanded = guidance.next, guidance.acceleration_m_s2
        error = self._error(pose, dt)
        wheels = self._kinematics.wheel_speeds(self._motion(pose, error, dt))
        done = self._is_done(guidance, pose, dt)
        return Command(wheels), OmniRecord(guidance, measured, error, self._stopping, done)

    def _error(self, pose: Pose, dt: float) -> tuple[float, float, float]:
        """Distance from the reference of the time at which the robot could know it."""
        self._passed.append(self._reference)
        while len(self._passed) > 1 + round(LAG_S / dt):
            self._passed.popleft()
        then = self._passed[0]
        return then.x - pose.x_m, then.y - pose.y_m, math.remainder(then.heading - pose.yaw_rad, math.tau)

    def _motion(self, pose: Pose, error: tuple[float, float, float], dt: float) -> Motion:
        """Motion of the body to command, in its frame in the middle of the coming cycle."""
        reference = self._reference
        x, y, turn = (GAIN_1_S * part for part in error)
        share = min(1.0, MOST_CORRECTION / max(math.hypot(x, y), MOST_CORRECTION))
        forward, left = rotated(
            (reference.vx + share * x, reference.vy + share * y), -(pose.yaw_rad + reference.rate * (LAG_S - dt / 2))
        )
        return forward, left, reference.rate + max(-MOST_CORRECTION, min(MOST_CORRECTION, turn))

    def _is_done(self, guidance: Guidance, pose: Pose, dt: float) -> bool:
        """Whether the guide has arrived, and the robot where the reference rests; past a moving end as it follows."""
        if guidance.result is not Result.ARRIVED:
            return False
        end = guidance.next
        self._over_s += dt
        if math.hypot(end.vx, end.vy) > NEAR_M or abs(end.rate) > NEAR_RAD:
            return self._over_s >= LAG_S
        if self._over_s > PATIENCE_S:
            return True
        near = math.hypot(end.x - pose.x_m, end.y - pose.y_m) < NEAR_M
        return near and abs(math.remainder(end.heading - pose.yaw_rad, math.tau)) < NEAR_RAD
