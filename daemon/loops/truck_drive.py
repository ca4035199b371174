"""The law of a truck that a person drives: a steering angle and a speed; it does not bend its trailer too far."""

from __future__ import annotations

import math
from dataclasses import dataclass

from daemon.loops.articulated import ArticulatedVehicle
from daemon.loops.geometry import clamp
from daemon.loops.motion_profile import ramp
from daemon.loops.path_driving import JACKKNIFE_RESERVE_RAD, REACTION_S, VehicleReading
from daemon.loops.steered_axle import SteeredAxleLaw
from profiles.schema import Limits
from profiles.steered import SteeredAxle

CREEP_M_S = 0.05
"""Speed at which a trailer that is bent too far may be straightened."""
JACKKNIFE = "jackknife"
LATERAL_ACCELERATION = "lateral_acceleration"


@dataclass(frozen=True, slots=True)
class TruckTarget:
    """What the truck shall do.

    Attributes:
        speed_m_s: of the driven axle; negative backwards.
        steering_rad: of the front axle.
    """

    speed_m_s: float
    steering_rad: float


@dataclass(frozen=True, slots=True)
class TruckRecord:
    """The terms of one step.

    Attributes:
        speed_m_s: commanded, of the driven axle.
        steering_rate_rad_s: commanded.
        steering_target_rad: asked of the axle; None while it is left where it is.
        limits_active: limits that hold the command back: ``jackknife``, ``lateral_acceleration``, those of the axle.
        failure: why the axle cannot be steered, or "".
    """

    speed_m_s: float
    steering_rate_rad_s: float
    steering_target_rad: float | None
    limits_active: tuple[str, ...]
    failure: str


class TruckLaw:
    """Steering, speed and the jackknife guard of one motion.

    The nearer the bending angle comes to its limit (backwards: where full steering no longer straightens the trailer;
    forwards: where truck and trailer touch), the slower the truck; at the limit it only rolls where that straightens.

    Args:
        vehicle: with one trailer.
        axle: the front axle.
        limits: of the vehicle.
    """

    def __init__(self, vehicle: ArticulatedVehicle, axle: SteeredAxle, limits: Limits) -> None:
        self._vehicle, self._limits = vehicle, limits
        self._axle = SteeredAxleLaw(axle)
        self._speed_m_s = 0.0

    def step(self, reading: VehicleReading, target: TruckTarget | None, dt: float) -> TruckRecord:
        """One cycle.

        Args:
            reading: the vehicle now.
            target: what to do; None comes to rest.
            dt: time since the last step [s].
        """
        axle = self._axle.step(None if target is None else target.steering_rad, reading.steering_rad, dt)
        active: list[str] = []
        wanted = 0.0 if target is None or axle.failure else self._within_limits(reading, target.speed_m_s, active)
        self._speed_m_s = ramp(self._speed_m_s, wanted, self._limits.acceleration_m_s2, dt)
        return TruckRecord(
            self._speed_m_s,
            axle.rate_rad_s,
            None if target is None else target.steering_rad,
            (*active, *axle.limits_active),
            axle.failure,
        )

    def _within_limits(self, reading: VehicleReading, wanted_m_s: float, active: list[str]) -> float:
        """The speed, no larger than the bend and the trailer allow."""
        curvature = abs(self._vehicle.curvature(reading.steering_rad))
        gripping = math.sqrt(self._limits.lateral_acceleration_m_s2 / curvature) if curvature else math.inf
        straightening = self._before_jackknife(reading, math.copysign(1.0, wanted_m_s))
        if abs(wanted_m_s) > gripping:
            active.append(LATERAL_ACCELERATION)
        if abs(wanted_m_s) > straightening:
            active.append(JACKKNIFE)
        return clamp(wanted_m_s, min(gripping, straightening))

    def _before_jackknife(self, reading: VehicleReading, direction: float) -> float:
        """The speed [m/s] from which the truck stops in time whatever the steering does meanwhile.

        With the margin m of the bending angle and its fastest growth g per metre, v t + v^2 / 2 a = m / g.
        """
        vehicle, bending, hitch = self._vehicle, reading.bending_rad[0], self._vehicle.hitches[0]
        outward = math.copysign(1.0, bending) * direction
        largest = max(outward * hitch.bending_rate(side * vehicle.max_curvature, bending) for side in (-1.0, 1.0))
        if largest <= 0.0:
            return math.inf
        touching = vehicle.max_bending_rad - abs(bending)
        margin = touching if direction > 0 else vehicle.jackknife_margin(reading.bending_rad)
        way, acceleration = max(0.0, margin - JACKKNIFE_RESERVE_RAD) / largest, self._limits.acceleration_m_s2
        speed = acceleration * (math.sqrt(REACTION_S * REACTION_S + 2 * way / acceleration) - REACTION_S)
        grows = outward * hitch.bending_rate(vehicle.curvature(reading.steering_rad), bending) > 0.0
        return speed if grows else max(speed, CREEP_M_S)
