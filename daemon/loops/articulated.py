"""Kinematics of a truck with any number of trailers: motion, stable motion, limits of steering and bending.

Unit 1 is the truck with a steerable front axle; each further unit is pulled at the hitch of the one in front. Every
axle rolls without slipping sideways ("bike model"). Lengths and signs are those of the semi-trailer thesis
(section 2.1): a hitch behind its axle has a positive offset, the bending angle is the heading of the unit behind minus
that of the unit in front, steering to the left and speed forward are positive. In stable motion all axles move about
one centre and the bending angles stay (section 2.2). Curvatures stand where the thesis has radii, so that straight
motion and a hitch above the axle are ordinary cases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from daemon.loops.odometry import Pose


class Motion(NamedTuple):
    """What the units do at one moment, from the truck to the last trailer; ``bending`` has one entry a hitch."""

    speed_m_s: tuple[float, ...]
    yaw_rate_rad_s: tuple[float, ...]
    bending_rate_rad_s: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Hitch:
    """The joint between two units.

    Attributes:
        offset_m: of the hitch, behind the axle of the unit in front (M of the thesis); negative: ahead of it.
        length_m: from the hitch back to the axle of the unit behind (L of the thesis).
    """

    offset_m: float
    length_m: float

    @property
    def turning_curvature(self) -> float:
        """Curvature of the front unit at which the rear one turns on the spot (eq. 2.23 over L1).

        Infinite with a hitch further behind its axle than the trailer is long: then the front unit is the tighter one.
        """
        return self.front_curvature(math.inf)

    @property
    def turning_bending_rad(self) -> float:
        """Size of the bending angle where normal stable motion ends (eq. 2.25): a unit turns on the spot."""
        ratio = self.offset_m / self.length_m
        return math.pi / 2 + math.asin(ratio if ratio < 1 else 1 / ratio)

    def bending_rate(self, curvature: float, bending_rad: float) -> float:
        """Change of the bending angle per metre of the front axle [rad/m] (eq. 2.14)."""
        lever = self.offset_m * math.cos(bending_rad) / self.length_m
        return -curvature - math.sin(bending_rad) / self.length_m - curvature * lever

    def speed_ratio(self, curvature: float, bending_rad: float) -> float:
        """Speed of the rear axle over that of the front one (eq. 2.4)."""
        return math.cos(bending_rad) - self.offset_m * curvature * math.sin(bending_rad)

    def holding_curvature(self, bending_rad: float) -> float:
        """Curvature of the front unit that keeps this bending angle (eq. 2.15 over L1)."""
        return -math.sin(bending_rad) / (self.length_m + self.offset_m * math.cos(bending_rad))

    def rear_curvature(self, curvature: float) -> float | None:
        """Curvature of the rear unit in normal stable motion; None where the front one turns too tightly for it."""
        return _transferred(curvature, self.offset_m * self.offset_m - self.length_m * self.length_m)

    def front_curvature(self, rear_curvature: float) -> float:
        """Curvature of the front unit when the rear one moves with ``rear_curvature`` in normal stable motion.

        Infinite where no front unit can be that tight: with a hitch further from its axle than the trailer is long.
        """
        front = _transferred(rear_curvature, self.length_m * self.length_m - self.offset_m * self.offset_m)
        return math.copysign(math.inf, rear_curvature) if front is None else front

    def stable_bending(self, curvature: float, extreme: bool = False) -> float | None:
        """The bending angle that stays while the front unit moves with ``curvature`` (eq. 2.16, 2.26 to 2.31).

        Args:
            curvature: of the front unit [1/m].
            extreme: the second solution, beyond the turning angle, where the units move in opposite directions.

        Returns:
            The angle [rad]; None when the curvature exceeds ``turning_curvature``: then nothing is stable.
        """
        rear = self.rear_curvature(curvature)
        if rear is None:
            return None
        swing = math.atan(self.length_m * rear)
        trailing = math.copysign(math.pi, curvature) - swing if extreme else swing
        return -trailing - math.atan(self.offset_m * curvature)

    def bending_for(self, rear_curvature: float) -> float:
        """Bending angle with which the rear unit moves with ``rear_curvature`` in normal stable motion (eq. 3.8)."""
        front = self.front_curvature(rear_curvature)
        return -math.atan(self.offset_m * front) - math.atan(self.length_m * rear_curvature)


def _transferred(curvature: float, radius_change_m2: float) -> float | None:
    """The curvature whose squared radius differs by this from that of ``curvature``; None when it gets negative."""
    if abs(curvature) < 1:
        part, under = curvature, 1 + curvature * curvature * radius_change_m2
    else:
        part, under = math.copysign(1.0, curvature), 1 / (curvature * curvature) + radius_change_m2
    if under < 0:
        return None
    return part / math.sqrt(under) if under else math.copysign(math.inf, curvature)


def hitch_point(pose: Pose, hitch: Hitch) -> tuple[float, float]:
    """Where the hitch of the unit at ``pose`` is."""
    offset, heading = hitch.offset_m, pose.yaw_rad
    return (pose.x_m - offset * math.cos(heading), pose.y_m - offset * math.sin(heading))


@dataclass(frozen=True, slots=True)
class ArticulatedVehicle:
    """A truck and its trailers.

    Attributes:
        wheelbase_m: of the truck (L1 of the thesis).
        hitches: from the truck to the last trailer; empty for a truck alone.
        max_steering_rad: the steering angle's limit to both sides.
        max_bending_rad: bending angle at which units touch.
    """

    wheelbase_m: float
    hitches: tuple[Hitch, ...]
    max_steering_rad: float
    max_bending_rad: float = math.pi

    def __post_init__(self) -> None:
        if not (self.wheelbase_m > 0 and all(hitch.length_m > 0 for hitch in self.hitches)):
            raise ValueError("wheelbase and trailers need positive lengths")
        if any(hitch.offset_m <= -hitch.length_m for hitch in self.hitches):
            raise ValueError("a hitch lies further ahead of its axle than the trailer is long")
        if not (0 < self.max_steering_rad < math.pi / 2 and 0 < self.max_bending_rad <= math.pi):
            raise ValueError("steering limit must lie within a quarter turn, bending limit within half a turn")

    @property
    def max_curvature(self) -> float:
        """Curvature of the truck's rear axle at full steering [1/m]."""
        return math.tan(self.max_steering_rad) / self.wheelbase_m

    @property
    def straight_lead_m(self) -> float:
        """From the last axle ahead to the truck's rear axle when the vehicle is straight."""
        return sum(hitch.offset_m + hitch.length_m for hitch in self.hitches)

    def curvature(self, steering_rad: float) -> float:
        """Curvature of the truck's rear axle (eq. 2.12)."""
        return math.tan(steering_rad) / self.wheelbase_m

    def steering(self, curvature: float) -> float:
        """Steering angle for a curvature of the truck's rear axle (eq. 3.7), not limited."""
        return math.atan(self.wheelbase_m * curvature)

    def front_axle_speed(self, steering_rad: float, speed_m_s: float) -> float:
        """Speed of the steered axle (eq. 2.9)."""
        return speed_m_s / math.cos(steering_rad)

    def motion(self, steering_rad: float, bending_rad: Sequence[float], speed_m_s: float) -> Motion:
        """Speeds and yaw rates of all units (eq. 2.3, 2.4, 2.12 to 2.14).

        Args:
            steering_rad: of the truck.
            bending_rad: one a hitch.
            speed_m_s: of the truck's rear axle.
        """
        speed, yaw_rate = speed_m_s, speed_m_s * self.curvature(steering_rad)
        speeds, yaw_rates, bending_rates = [speed], [yaw_rate], []
        for hitch, bending in zip(self.hitches, bending_rad, strict=True):
            cos, sin = math.cos(bending), math.sin(bending)
            across = hitch.offset_m * yaw_rate
            trailing = -(speed * sin + across * cos) / hitch.length_m
            bending_rates.append(trailing - yaw_rate)
            speed, yaw_rate = speed * cos - across * sin, trailing
            speeds.append(speed)
            yaw_rates.append(yaw_rate)
        return Motion(tuple(speeds), tuple(yaw_rates), tuple(bending_rates))

    def poses(self, truck: Pose, bending_rad: Sequence[float]) -> tuple[Pose, ...]:
        """Axle midpoints and headings of all units (eq. 2.1, 2.2); headings are not wrapped."""
        pose, poses = truck, [truck]
        for hitch, bending in zip(self.hitches, bending_rad, strict=True):
            heading = pose.yaw_rad + bending
            x, y = hitch_point(pose, hitch)
            pose = Pose(x - hitch.length_m * math.cos(heading), y - hitch.length_m * math.sin(heading), heading)
            poses.append(pose)
        return tuple(poses)

    @property
    def stable_curvature(self) -> float:
        """Highest curvature of the truck with stable motion of all units within steering and bending limits [1/m]."""
        curvature = math.inf
        for hitch in reversed(self.hitches):
            curvature = min(hitch.front_curvature(curvature), self._bent_curvature(hitch))
        return min(curvature, self.max_curvature)

    @property
    def stable_rear_curvature(self) -> float:
        """Curvature of the last unit at ``stable_curvature``: the tightest path for driving backwards [1/m]."""
        curvature: float | None = self.stable_curvature
        for hitch in self.hitches:
            curvature = math.inf if curvature is None else hitch.rear_curvature(curvature)
        return math.inf if curvature is None else curvature

    def _bent_curvature(self, hitch: Hitch) -> float:
        """Curvature at which a hitch reaches the bending limit in normal stable motion; infinite when it cannot."""
        reached = self.max_bending_rad < hitch.turning_bending_rad
        return hitch.holding_curvature(-self.max_bending_rad) if reached else math.inf

    @property
    def bending_limits_rad(self) -> tuple[float, ...]:
        """How far each hitch may bend and still be straightened backwards by full steering, held.

        The hitches in front are taken to be in the stable motion of that steering. The limit is where units touch when
        the steering is strong enough for any angle.
        """
        limits: list[float] = []
        curvature: float | None = self.max_curvature
        for hitch in self.hitches:
            stable = None if curvature is None else hitch.stable_bending(curvature)
            limits.append(self.max_bending_rad if stable is None else min(self.max_bending_rad, -stable))
            curvature = None if stable is None or curvature is None else hitch.rear_curvature(curvature)
        return tuple(limits)

    def jackknife_margin(self, bending_rad: Sequence[float]) -> float:
        """What is left to the nearest of ``bending_limits_rad``; negative: no steering straightens it backwards."""
        limits = zip(self.bending_limits_rad, bending_rad, strict=True)
        return min((limit - abs(bending) for limit, bending in limits), default=math.inf)
