"""The law of a robot on omni-wheels: keeps it on the reference that a guide leads, and brings it to rest.

The wheels are commanded the reference's velocity, and on top of it a velocity in proportion to the distance from the
reference as it was when the wheels were last told; so a robot that follows as it should is not corrected.

A wheel that slips is held near the speed of the floor under it, where an accelerometer tells that.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from daemon.loops.accelerometer import Vector, rotated
from daemon.loops.measurement import Command
from daemon.loops.odometry import Pose
from daemon.loops.omni import Motion, OmniKinematics
from daemon.loops.omni_guide import Felt, Guidance, Guide, TwistGuide
from daemon.loops.omni_senses import OmniSenses
from daemon.loops.planner import PlanarLimits, PlanarState, Result
from daemon.loops.wheel_grip import WheelGrip

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


@dataclass(frozen=True, slots=True)
class OmniRecord:
    """The terms of one step.

    Attributes:
        guidance: what the guide decided.
        felt: of the robot.
        error: of the pose from the reference of that time: x, y [m], heading [rad].
        stopping: the guide was left, the robot is brought to rest.
        done: at rest at the end of the motion, or as near to its goal as it gets.
    """

    guidance: Guidance
    felt: Felt
    error: tuple[float, float, float]
    stopping: bool
    done: bool


class OmniLaw:
    """The law.

    Args:
        kinematics: of the wheels.
        guide: leads the reference.
        limits: for coming to rest when the motion is stopped.
        senses: of the robot, as it begins.
        holds_wheels: while they slip.
    """

    def __init__(
        self,
        kinematics: OmniKinematics,
        guide: Guide,
        limits: PlanarLimits,
        senses: OmniSenses,
        *,
        holds_wheels: bool = True,
    ) -> None:
        self._kinematics = kinematics
        self._guide = guide
        self._limits = limits
        self._grip = WheelGrip(len(kinematics.forward)) if holds_wheels else None
        self._reference = _state(senses.pose, senses.motion)
        self._passed: deque[PlanarState] = deque()
        self._commanded: Vector = (0.0, 0.0)
        self._stopping = False
        self._over_s = 0.0

    def stop(self) -> None:
        """Bring the robot to rest with all of the limits, and be done."""
        if not self._stopping:
            self._stopping = True
            self._guide = TwistGuide((0.0, 0.0, 0.0), self._limits)

    def step(self, senses: OmniSenses, dt: float) -> tuple[Command, OmniRecord]:
        """One cycle.

        Args:
            senses: of the robot, with this cycle's readings.
            dt: length of the cycle [s].
        """
        pose, measured = senses.pose, senses.acceleration
        fixed = None if measured is None else rotated(measured, pose.yaw_rad)
        felt = Felt(fixed, senses.slipping, senses.pushing)
        guidance = self._guide.step(self._reference, felt, self._commanded, dt)
        self._reference, self._commanded = guidance.next, guidance.acceleration_m_s2
        error = self._error(pose, dt)
        wheels = self._kinematics.wheel_speeds(self._motion(pose, error, dt))
        if self._grip and senses.centre and (seen := senses.observed):
            wheels = self._grip.step(wheels, seen.ground_m_s, seen.slipping, dt).wheel_speeds_m_s
        done = self._is_done(guidance, pose, dt)
        return Command(wheels), OmniRecord(guidance, felt, error, self._stopping, done)

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


def _state(pose: Pose, motion: Motion) -> PlanarState:
    vx, vy = rotated((motion[0], motion[1]), pose.yaw_rad)
    return PlanarState(pose.x_m, pose.y_m, pose.yaw_rad, vx, vy, motion[2])
