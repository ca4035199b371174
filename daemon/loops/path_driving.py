"""Drives a path to its end: for each section set the steering, drive by a following law and a speed law, come to rest.

A section ends where the path does or where the driving direction changes. The reference point is the truck's rear axle
forwards and the last axle backwards. With a trailer a guard ends the drive while the steering can still straighten it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, NamedTuple

from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.cascade_following import CascadeFollower, CascadeTuning
from daemon.loops.motion_profile import ramp
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, wrap
from daemon.loops.path_following import (
    FollowingErrors,
    FollowingStep,
    FollowingTuning,
    PathFollower,
    SectionFollower,
)
from daemon.loops.path_speed import PathSpeed, SpeedLimit, SpeedTuning

STEERED_RAD: Final = math.radians(1.0)
"""At rest, a section begins once the steering is nearer than this to where it has to be."""
REST_M_S: Final = 0.005
REST_S: Final = 0.1
REACTION_S: Final = 0.03
"""From a measurement to what the drives make of it: two or three control cycles."""
STEERING_LAG_S: Final = 0.08
"""By which a steered axle with its drive is later than one that only has a rate; with a trailer the cascade looks so
much farther ahead."""
JACKKNIFE_RESERVE_RAD: Final = math.radians(3.0)
STRAYED_M: Final = 0.6
STRAYED_RAD: Final = math.radians(75)
REFERENCE_M_S: Final = 0.2
"""Speed that the thesis' look-ahead was tuned for."""


class Phase(StrEnum):
    """What is being done in a section."""

    STEERING = "steering"
    DRIVING = "driving"
    RESTING = "resting"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class VehicleReading:
    """The vehicle at one moment.

    Attributes:
        truck: pose of its rear axle.
        bending_rad: of its hitches, from the front.
        steering_rad: of its steered axle.
        speed_m_s: of its rear axle.
    """

    truck: Pose
    bending_rad: tuple[float, ...]
    steering_rad: float
    speed_m_s: float


class ErrorLimits(NamedTuple):
    """Errors beside a path at which the drive ends; ``bending_rad`` is None without a trailer."""

    position_m: float
    heading_rad: float
    bending_rad: float | None


@dataclass(frozen=True, slots=True)
class DrivingStep:
    """One step: what to command, and why.

    Attributes:
        phase: of the section.
        section: its number, from 0.
        speed_m_s: to command, of the truck's rear axle; negative backwards.
        steering_rad: to command.
        following: terms of the steering law.
        speed_limit: what limits the speed.
        failure: why the drive ends here, or "".
    """

    phase: Phase
    section: int
    speed_m_s: float
    steering_rad: float
    following: FollowingStep
    speed_limit: SpeedLimit
    failure: str = ""

    @property
    def limits_active(self) -> tuple[str, ...]:
        """Limits that are active in this step: of speed, and of the steering law."""
        steering = self.following.limit
        return (str(self.speed_limit),) if steering is None else (str(self.speed_limit), str(steering))


class PathDriver:
    """Drives one path.

    Args:
        vehicle: with at most one trailer.
        path: of the reference points, drivable by the vehicle.
        speed: limits of the speed.
        steering_rate_rad_s: how fast the steering turns.
        published: steer by the thesis' law, put right, instead of the cascade.

    Raises:
        ValueError: the vehicle's trailers cannot be steered backwards.
    """

    def __init__(
        self,
        vehicle: ArticulatedVehicle,
        path: Path,
        speed: SpeedTuning,
        steering_rate_rad_s: float,
        published: bool = False,
    ) -> None:
        self._vehicle, self._path, self._tuning = vehicle, path, speed
        self._speed_law = PathSpeed(path, speed)
        self._follower: SectionFollower
        self._law: Callable[[Pose, VehicleReading], FollowingStep]
        if published:
            self._follower, self._law = _thesis_law(vehicle, path)
        else:
            self._follower, self._law = _cascade_law(vehicle, path, steering_rate_rad_s)
        self._phase = Phase.STEERING
        self._commanded_m_s = 0.0
        self._steering_rad = 0.0
        self._at_rest_s = 0.0
        self._stopping = False
        self._failed = ""

    def stop(self) -> None:
        """From now on come to rest where the vehicle is."""
        self._stopping = True

    def fail(self, reason: str) -> None:
        """From now on come to rest; the last step tells the reason."""
        self._failed = self._failed or reason

    def step(self, reading: VehicleReading, dt: float) -> DrivingStep:
        """One control cycle.

        Args:
            reading: the vehicle now.
            dt: time since the last step [s].

        Raises:
            ValueError: a number is not finite.
        """
        backward = self._path.pieces[self._path.sections[self._follower.section][0]].backward
        unit = self._vehicle.poses(reading.truck, reading.bending_rad)[-1 if backward else 0]
        following = self._law(unit, reading)
        wanted, limit = self._speed_law.wanted(following)
        self.fail(self._failure(reading, following))
        if (self._failed or self._stopping) and self._phase is not Phase.DONE:
            self._phase = Phase.RESTING
        if self._phase is Phase.STEERING:
            self._steer(reading, following)
        elif self._phase is Phase.DRIVING:
            self._drive(following, wanted, dt)
        elif self._phase is Phase.RESTING:
            self._rest(reading, dt)
        return DrivingStep(
            self._phase, self._follower.section, self._commanded_m_s, self._steering_rad, following, limit, self._failed
        )

    def _steer(self, reading: VehicleReading, following: FollowingStep) -> None:
        self._steering_rad = following.steering_rad
        if abs(reading.steering_rad - following.steering_rad) < STEERED_RAD:
            self._phase = Phase.DRIVING

    def _drive(self, following: FollowingStep, wanted_m_s: float, dt: float) -> None:
        self._steering_rad = following.steering_rad
        signed = -wanted_m_s if following.backward else wanted_m_s
        self._commanded_m_s = ramp(self._commanded_m_s, signed, self._tuning.acceleration_m_s2, dt)
        if following.remaining_m <= abs(self._commanded_m_s) * REACTION_S:
            self._phase = Phase.RESTING

    def _rest(self, reading: VehicleReading, dt: float) -> None:
        """Ramp down; after a while at rest the next section begins, unless this was the last one."""
        self._commanded_m_s = ramp(self._commanded_m_s, 0.0, self._tuning.acceleration_m_s2, dt)
        rests = self._commanded_m_s == 0.0 and abs(reading.speed_m_s) < REST_M_S
        self._at_rest_s = self._at_rest_s + dt if rests else 0.0
        if self._at_rest_s >= REST_S:
            self._at_rest_s = 0.0
            more = not (self._failed or self._stopping) and self._follower.next_section()
            self._phase = Phase.STEERING if more else Phase.DONE

    def _failure(self, reading: VehicleReading, following: FollowingStep) -> str:
        """Why the vehicle must not drive on, or ""."""
        errors = following.errors
        if abs(errors.position_m) > STRAYED_M or abs(errors.heading_rad) > STRAYED_RAD:
            turned = math.degrees(errors.heading_rad)
            return f"strayed from the path: {abs(errors.position_m):.2f} m beside it, turned by {turned:.0f} degrees"
        if self._vehicle.hitches and self._jackknife_margin(reading, following.backward) < JACKKNIFE_RESERVE_RAD:
            bent = math.degrees(reading.bending_rad[0])
            limit = math.degrees(self._vehicle.bending_limits_rad[0])
            return f"jackknife guard: the bending angle of {bent:.1f} degrees comes too near to its limit {limit:.1f}"
        return ""

    def _jackknife_margin(self, reading: VehicleReading, backward: bool) -> float:
        """What is left of the bending angle once the vehicle has come to rest from its present motion."""
        speed = abs(self._commanded_m_s)
        way = speed * REACTION_S + speed * speed / (2 * self._tuning.acceleration_m_s2)
        bending = reading.bending_rad[0]
        rate = self._vehicle.hitches[0].bending_rate(self._vehicle.curvature(reading.steering_rad), bending)
        growth = math.copysign(1.0, bending) * rate * (-way if backward else way)
        return self._vehicle.jackknife_margin(reading.bending_rad) - max(0.0, growth)


def error_limits(vehicle: ArticulatedVehicle, errors: FollowingErrors, reading: VehicleReading) -> ErrorLimits:
    """Errors at which a drive ends that is slow; that of the bending angle is the jackknife guard's, nearer side.

    Args:
        vehicle: that drives.
        errors: of it now.
        reading: of it now.
    """
    bending = None
    if vehicle.hitches and errors.bending_rad is not None:
        wanted_rad = reading.bending_rad[0] - errors.bending_rad
        bending = max(0.0, vehicle.bending_limits_rad[0] - JACKKNIFE_RESERVE_RAD - abs(wanted_rad))
    return ErrorLimits(STRAYED_M, STRAYED_RAD, bending)


Law = Callable[[Pose, VehicleReading], FollowingStep]


def _cascade_law(vehicle: ArticulatedVehicle, path: Path, rate_rad_s: float) -> tuple[SectionFollower, Law]:
    tuning = CascadeTuning()
    if vehicle.hitches:
        tuning = replace(tuning, lead_s=tuning.lead_s + STEERING_LAG_S)
    follower = CascadeFollower(vehicle, path, tuning, rate_rad_s)

    def law(unit: Pose, reading: VehicleReading) -> FollowingStep:
        return follower.step(unit, _bending(reading), reading.steering_rad, reading.speed_m_s)

    return follower, law


def _thesis_law(vehicle: ArticulatedVehicle, path: Path) -> tuple[SectionFollower, Law]:
    """The look-ahead grows with the speed, and is cut, to half at most, where the section ends."""
    tuning = FollowingTuning()
    follower = PathFollower(vehicle, path, tuning)
    remaining_m = math.inf

    def law(unit: Pose, reading: VehicleReading) -> FollowingStep:
        nonlocal remaining_m
        longest = tuning.look_ahead_m * max(1.0, abs(reading.speed_m_s) / REFERENCE_M_S)
        look_ahead_m = max(tuning.look_ahead_m / 2, min(longest, remaining_m))
        step = follower.step(unit, _bending(reading), look_ahead_m)
        remaining_m = step.remaining_m
        return step

    return follower, law


def _bending(reading: VehicleReading) -> float:
    return reading.bending_rad[0] if reading.bending_rad else 0.0


def at_begin(vehicle: ArticulatedVehicle, path: Path, truck: Pose, bending_rad: tuple[float, ...]) -> str:
    """Why a drive cannot begin where the vehicle is, or ""."""
    piece = path.pieces[0]
    unit = vehicle.poses(truck, bending_rad)[-1 if piece.backward else 0]
    away = math.dist((piece.x_m, piece.y_m), (unit.x_m, unit.y_m))
    turned = wrap(unit.yaw_rad - piece.heading(0.0))
    if away <= STRAYED_M and abs(turned) <= STRAYED_RAD:
        return ""
    return (
        f"the path begins {away:.2f} m away, and the vehicle is turned against it by {math.degrees(turned):.0f} degrees"
    )
