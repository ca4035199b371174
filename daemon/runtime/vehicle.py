"""A vehicle as the supervisor sees it: devices in the order of its loops, and the motions that it has."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from enum import StrEnum
from operator import attrgetter
from typing import Any, Final

from canhelm.errors import LimitExceeded
from daemon.loops.limits import Gate
from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import Pose
from daemon.loops.turning_centre import Point
from daemon.runtime.motions import Motion
from daemon.runtime.streams import valid_for_s
from drivers.contract import Brake, BrakeState, Drive, SteeringEncoder
from profiles.schema import Limits, Profile

BRICK_DELAY_S: Final = 0.5
"""What a stop takes to reach a brick's motor, and its rest to come back, a few turnarounds of Bluetooth; assumed."""
_ROUNDING: Final = 1e-9
_SPEED, _POSITION, _HEADING = attrgetter("speed_m_s"), attrgetter("position_m"), attrgetter("heading_rad")


class VehicleState(StrEnum):
    """What the vehicle does, for people and programs."""

    WAITING = "waiting"
    BOOTING = "booting"
    IDLE = "idle"
    ACTIVE = "active"
    STOPPING = "stopping"
    FAULT = "fault"
    ESTOP = "estop"


Stick = tuple[float, float]
"""Least and largest value of a command that a stick gives, the latter at the end of its way."""


def both_ways(largest: float) -> Stick:
    """As far to the one side as to the other."""
    return (-largest, largest)


def require_at_most(what: str, value: float, limit: float, unit: str, name: str) -> None:
    """Raise LimitExceeded where a value that is asked for is beyond a limit of this name."""
    if value > limit * (1 + _ROUNDING):
        allowed = math.floor(limit * 1000 * (1 + _ROUNDING)) / 1000
        raise LimitExceeded(
            f"a {what} of {value:g} {unit} is beyond the limit",
            value=round(value, 6),
            limit=f"{name} {allowed:g}",
            remedy=f"ask for at most {allowed:g} {unit}",
        )


def require_near(distance_m: float, limits: Limits) -> None:
    """Raise LimitExceeded where a goal is farther away than a profile's limits allow."""
    require_at_most("distance to the goal", distance_m, limits.goal_distance_m, "m", "goal_distance_m")


class Vehicle(ABC):
    """Drives, encoders and brakes in the order of the loops, and the motions that the vehicle has.

    Args:
        profile: the robot.
        drives, encoders, brakes: its devices, in the order of the loops.
        wheel_acceleration_m_s2: what the gate allows the wheels; None: what the vehicle's centre may do.

    Attributes:
        methods: names of the ``drive.*`` methods and of others that this vehicle has.
        zero: the command that moves nothing and leaves the brakes as they are.
        aside: drives of the profile that no law moves, each for itself.
        steers_at_rest: whether it has to stand to change its direction or its steering.
    """

    methods: tuple[str, ...] = ()
    steers_at_rest = False

    def __init__(
        self,
        profile: Profile,
        drives: tuple[Drive, ...],
        encoders: tuple[SteeringEncoder, ...] = (),
        brakes: tuple[Brake, ...] = (),
        wheel_acceleration_m_s2: float | None = None,
    ) -> None:
        self.profile = profile
        self.drives = drives
        self.encoders = encoders
        self.brakes = brakes
        self.aside: tuple[Drive, ...] = ()
        self.zero = Command((0.0,) * len(drives))
        signed = drives if profile.traction else ()
        self._currents = [(profile.drives[drive.name].direction, drive) for drive in signed]
        self._gate = Gate(profile.limits, profile.vehicle, wheel_acceleration_m_s2)

    def measure(self, now_s: float) -> Measurement:
        """The newest readings of all devices."""
        return self._readings(now_s)

    def _readings(self, now_s: float, acceleration_m_s2: tuple[float, float] | None = None) -> Measurement:
        drives, brakes, engaged, released = self.drives, self.brakes, BrakeState.ENGAGED, BrakeState.RELEASED
        return Measurement(
            now_s,
            tuple(map(_SPEED, drives)),
            tuple(map(_POSITION, drives)),
            tuple(map(_HEADING, self.encoders)),
            tuple([brake.state is engaged for brake in brakes]),
            tuple([brake.state is released for brake in brakes]),
            acceleration_m_s2,
            tuple([sign * drive.current_a for sign, drive in self._currents]),
        )

    def gate(
        self, command: Command, measurement: Measurement, previous: Command, dt_s: float
    ) -> tuple[Command, tuple[str, ...]]:
        """The command that may be sent, and the names of the limits that changed it."""
        return self._gate.apply(command, measurement, previous, dt_s)

    @abstractmethod
    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """The motion that a method asks for. Raises LimitExceeded, Refused or UsageError."""

    def update(
        self, method: str, params: dict[str, Any], lease: str | None, motions: list[Motion]
    ) -> dict[str, Any] | None:
        """Take a new value of ``drive.set`` into this holder's stream; None where the method begins a motion."""
        for motion in motions if method == "drive.set" else ():
            if motion.stream is not None and motion.lease == lease and not motion.stop_reason:
                motion.stream.take(self.set_point(params), valid_for_s(params))
                return {"motion": motion.identity}
        return None

    def set_point(self, params: dict[str, Any]) -> object:
        """What ``drive.set`` asks for, on vehicles that have it. Raises LimitExceeded, Refused or UsageError."""
        raise AssertionError("drive.set")

    def sticks(self) -> dict[str, Stick]:
        """What a gamepad may give: speed, sideways [m/s], yaw_rate [deg/s], steering, direction [deg]."""
        return {}

    def ramp_s(self) -> float:
        """Time from the largest values of ``drive.set`` to rest, by the law's own ramps."""
        limits = self.profile.limits
        turning_s = limits.yaw_rate_deg_s / limits.yaw_acceleration_deg_s2 if "yaw_rate" in self.sticks() else 0.0
        return max(limits.speed_m_s / limits.acceleration_m_s2, turning_s)

    @property
    def place(self) -> Pose | None:
        """Where it is by its odometry; None where it has none."""
        return None

    def wheel_headings(self) -> dict[str, float]:
        """Heading of each wheel in the frame of its part [rad], by the names of ``vehicle.shape``."""
        return {}

    @property
    def turning_centre(self) -> Point | None:
        """Instantaneous centre of rotation in the body's frame; None where it moves straight, or is not known."""
        return None

    def observe(self, measurement: Measurement) -> None:
        """Told of every cycle's measurement (odometry)."""

    @property
    def pushing(self) -> bool:
        """Whether it knows that something holds it which it may push: much current is not in vain then."""
        return False

    def require_free(self, motion: Motion) -> None:
        """Raise Interlock where a brake stands against the motion, NotReady where a device that it needs is away."""

    def wheel_of(self, name: str) -> tuple[int, int]:
        """Index of a drive in the order of the loops, and the number of drives."""
        return [drive.name for drive in self.drives].index(name), len(self.drives)

    def wheel_limit_m_s(self, name: str) -> float:
        """Largest rim speed of a drive: the smaller one of its own limit and, for a wheel, the vehicle's."""
        own = self.profile.wheels[name].max_speed_m_s
        return own if name in {drive.name for drive in self.aside} else min(own, self.profile.limits.wheel_speed_m_s)

    def current_limit_a(self, name: str) -> float:
        """Largest current that may be commanded to a drive; a motor without current control refuses any."""
        drive = self.profile.drives.get(name)
        return drive.continuous_current_a if drive else math.inf

    def stopping_time_s(self) -> float:
        """Time that the slowest quick-stop ramp needs from the present speeds, until its end is known."""
        ramps = {name: drive.quick_stop_m_s2 for name, drive in self.profile.wheels.items()}
        delays = {name: 0.0 if name in self.profile.drives else BRICK_DELAY_S for name in ramps}
        drives = (*self.drives, *self.aside)
        return max((abs(drive.speed_m_s) / ramps[drive.name] + delays[drive.name] for drive in drives), default=0.0)

    def status(self) -> dict[str, Any]:
        """The vehicle for ``status``."""
        return {"type": None, "methods": list(self.methods)}


class BareDrives(Vehicle):
    """No vehicle, only drives: every motor on its own."""

    def motion(self, method: str, params: dict[str, Any], lease: str | None) -> Motion:
        """Never called: there are no methods."""
        raise AssertionError(method)
