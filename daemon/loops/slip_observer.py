"""Slip of every wheel: the encoders against the body, whose motion the motors' currents or an accelerometer tell.

A wheel's rim, of the rotating mass m_w seen there, obeys m_w du/dt = F_drive - F_friction - F_floor whether it slips
or not. Current and encoder so give the force of the floor, the sum of these forces the acceleration of the body, and
its integral a motion that no slip falsifies. Wheels that grip keep it from drifting; what a wheel's rim is faster than
the body above it is slip. With an accelerometer its reading takes the place of the forces, and where both differ,
something else pushes.

A wheel is a row (c, s, l): its rim rolls at c vx + s vy + l w where the body moves at (vx, vy) and turns at w. The
small difference of large forces that turns a robot is a good sign of w only where currents are exact. Where vx and vy
are known, each wheel tells w, too, and the median is right as long as most of them grip.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Final

from daemon.loops.least_squares import least_squares
from profiles.schema import DriveConfig, TractionConfig

Row = tuple[float, float, float]
Motion = tuple[float, float, float]
"""Forward, to the left, counter-clockwise: speeds [m/s, rad/s] or accelerations [m/s2, rad/s2]."""

BREAKAWAY_M_S: Final = 0.01
"""Rim speed from which dry friction is all there; of a standing wheel it takes what it can of the motor's force."""
MISSED_PART: Final = 0.4
"""Part of a gentle acceleration that a sample may miss where drives ramp to each new target in a part of the cycle."""
SWEEPS: Final = 4
"""Times that the impulses of all rows are computed a cycle; what is left, the next cycle takes."""


@dataclass(frozen=True, slots=True)
class RimDrive:
    """A motor and its gear, seen at the wheel's rim.

    Attributes:
        force_per_a: of the motor without losses: ratio times torque constant over wheel radius [N/A].
        mass_kg: moment of inertia of wheel and rotor over the square of the wheel radius.
        friction_n: dry friction of motor, gear and rolling.
        efficiency: of the gear.
    """

    force_per_a: float
    mass_kg: float
    friction_n: float = 0.0
    efficiency: float = 1.0

    def floor_force(self, current_a: float, speed_m_s: float, acceleration_m_s2: float) -> float:
        """Force of the floor on the wheel along its direction [N], forward where it drives the robot forward."""
        motor = self.force_per_a * current_a
        part = min(1.0, abs(speed_m_s) / BREAKAWAY_M_S)
        moving = motor * (self.efficiency if motor * speed_m_s >= 0 else 1 / self.efficiency)
        moving -= math.copysign(self.friction_n, speed_m_s)
        standing = motor * self.efficiency
        standing -= max(-self.friction_n, min(self.friction_n, standing))
        return part * moving + (1 - part) * standing - self.mass_kg * acceleration_m_s2


@dataclass(frozen=True, slots=True)
class Body:
    """Mass [kg] and moment of inertia about the vertical axis [kg m2] of the robot."""

    mass_kg: float
    yaw_inertia_kg_m2: float

    def acceleration(self, rows: Sequence[Row], forces: Sequence[float]) -> Motion:
        """What forces along the wheels' directions [N] make of the body."""
        x = math.fsum(row[0] * force for row, force in zip(rows, forces, strict=True))
        y = math.fsum(row[1] * force for row, force in zip(rows, forces, strict=True))
        turn = math.fsum(row[2] * force for row, force in zip(rows, forces, strict=True))
        return (x / self.mass_kg, y / self.mass_kg, turn / self.yaw_inertia_kg_m2)


@dataclass(frozen=True, slots=True)
class ObserverTuning:
    """What suits a robot.

    Attributes:
        smoothing_s: time constant of wheel speeds and currents before they are compared.
        trust_s: time constant with which the observed motion follows wheels that grip.
        distrust_s: the same for wheels that slip: errors of the model do not add up for ever.
        slip_m_s: rim speed above the body's at which slip begins.
        slip_ratio: part of the body's speed that is added to it; tyres creep when they pull.
        missed_m_s2: what samples of the acceleration may miss of it while wheels change their speed; the error of the
            observed motion that comes of it is added instead, where it is larger.
        grip_part: slip ends below this part of what begins it while no wheel changes its speed.
        turning_by_wheels: the median of what the wheels say of the yaw rate counts, not what forces say.
    """

    smoothing_s: float = 0.015
    trust_s: float = 0.7
    distrust_s: float = 3.0
    slip_m_s: float = 0.06
    slip_ratio: float = 0.06
    missed_m_s2: float = 0.0
    grip_part: float = 0.6
    turning_by_wheels: bool = False


@dataclass(frozen=True, slots=True)
class Observed:
    """The terms of one step.

    Attributes:
        motion: of the body, whatever the wheels do.
        acceleration: of the body.
        wheel_forces_n: of the floor, along each wheel.
        outside_m_s2: what the forces accelerate the body more than is measured: an obstacle pushes back.
        ground_m_s: speed of the floor under each wheel, along it.
        slip_m_s: rim speed minus that.
        slipping: for each wheel.
    """

    motion: Motion
    acceleration: Motion
    wheel_forces_n: tuple[float, ...]
    outside_m_s2: tuple[float, float]
    ground_m_s: tuple[float, ...]
    slip_m_s: tuple[float, ...]
    slipping: tuple[bool, ...]


class SlipObserver:
    """Motion of the body and slip of the wheels.

    Args:
        body: that the wheels move.
        drives: of the wheels.
        rows: of the wheels.
        still: rows along which the robot cannot move at all (across wheels that do not roll sideways): there the floor
            gives whatever impulse that takes.
        tuning: of the robot.
    """

    def __init__(
        self,
        body: Body,
        drives: Sequence[RimDrive],
        rows: Sequence[Row],
        still: Sequence[Row] = (),
        tuning: ObserverTuning | None = None,
    ) -> None:
        self._body = body
        self._drives = tuple(drives)
        self._rows = tuple(rows)
        self._still = tuple(still)
        self._tuning = ObserverTuning() if tuning is None else tuning
        self._weight = tuple(1 / max(math.fsum(row[axis] ** 2 for row in self._rows), 1e-9) for axis in range(3))
        self.restart()

    def restart(self) -> None:
        """Forget everything, and believe the wheels at the next step."""
        none, rest = (0.0,) * len(self._rows), (0.0, 0.0, 0.0)
        self._last = Observed(rest, rest, none, (0.0, 0.0), none, none, (False,) * len(self._rows))
        self._speeds: tuple[float, ...] = ()
        self._currents: tuple[float, ...] = ()
        self._doubt_m_s = 0.0

    def step(
        self,
        wheel_speeds: Sequence[float],
        currents_a: Sequence[float],
        dt: float,
        measured: tuple[float, float] | None = None,
    ) -> Observed:
        """One cycle; a cycle with a reading that is none changes nothing.

        Args:
            wheel_speeds: at the rims [m/s].
            currents_a: of the motors, positive where they drive forward.
            dt: time since the last step [s].
            measured: acceleration of the body's centre in its frame [m/s2], where an accelerometer tells it.
        """
        if not all(map(math.isfinite, (*wheel_speeds, *currents_a, *(measured or ())))):
            return self._last
        if not self._speeds:
            self._begin(wheel_speeds, currents_a)
        slopes = self._smooth(wheel_speeds, currents_a, dt)
        self._doubt_m_s = self._doubted(max(map(abs, slopes)), dt)
        readings = zip(self._drives, self._currents, self._speeds, slopes, strict=True)
        forces = tuple(drive.floor_force(current, speed, slope) for drive, current, speed, slope in readings)
        x, y, turn = self._body.acceleration(self._rows, forces)
        acceleration = (x, y, turn) if measured is None else (*measured, turn)
        outside = x - acceleration[0], y - acceleration[1]
        motion = self._corrected(self._integrated(acceleration, wheel_speeds, dt), wheel_speeds, dt)
        ground = tuple(_rolling(row, motion) for row in self._rows)
        slip = tuple(speed - floor for speed, floor in zip(wheel_speeds, ground, strict=True))
        self._last = Observed(motion, acceleration, forces, outside, ground, slip, self._judged(motion, slip))
        return self._last

    def _begin(self, speeds: Sequence[float], currents: Sequence[float]) -> None:
        """Believe the wheels at first."""
        self._speeds, self._currents = tuple(speeds), tuple(currents)
        motion = least_squares([*self._rows, *self._still], [*speeds, *[0.0] * len(self._still)])
        self._last = replace(self._last, motion=motion)

    def _smooth(self, speeds: Sequence[float], currents: Sequence[float], dt: float) -> list[float]:
        """Filter speeds and currents alike; returns the slopes of the speeds."""
        part = 1 - math.exp(-dt / self._tuning.smoothing_s)
        changes = [part * (new - old) for new, old in zip(speeds, self._speeds, strict=True)]
        self._speeds = tuple(old + change for old, change in zip(self._speeds, changes, strict=True))
        self._currents = tuple(old + part * (new - old) for new, old in zip(currents, self._currents, strict=True))
        return [change / dt for change in changes]

    def _doubted(self, acceleration: float, dt: float) -> float:
        """Speed by which samples may have led the observed motion astray, as far as wheels have not put it right."""
        missed = min(self._tuning.missed_m_s2, MISSED_PART * acceleration)
        return (self._doubt_m_s + missed * dt) * math.exp(-dt / self._tuning.trust_s)

    def _integrated(self, acceleration: Motion, speeds: Sequence[float], dt: float) -> Motion:
        """In the body's frame, which turns: dv/dt = a - w x v."""
        vx, vy, rate = self._last.motion
        ax, ay, turn = acceleration
        vx, vy = vx + (ax + rate * vy) * dt, vy + (ay - rate * vx) * dt
        return (vx, vy, self._turning(vx, vy, speeds) if self._tuning.turning_by_wheels else rate + turn * dt)

    def _turning(self, vx: float, vy: float, speeds: Sequence[float]) -> float:
        """Yaw rate that most wheels tell where the body moves at (vx, vy)."""
        told = zip(self._rows, speeds, strict=True)
        return median((speed - cos * vx - sin * vy) / lever for (cos, sin, lever), speed in told if lever)

    def _corrected(self, motion: Motion, speeds: Sequence[float], dt: float) -> Motion:
        """A little nearer to what the wheels say, and less so where they slip."""
        gain = 1 - math.exp(-dt / self._tuning.trust_s)
        less = 1 - math.exp(-dt / self._tuning.distrust_s)
        x = y = turn = 0.0
        gains = [less if slipping else gain for slipping in self._last.slipping]
        for row, speed, weight in zip(self._rows, speeds, gains, strict=True):
            missing = weight * (speed - _rolling(row, motion))
            x, y, turn = x + row[0] * missing, y + row[1] * missing, turn + row[2] * missing
        of_x, of_y, of_turn = self._weight
        return self._held(motion[0] + of_x * x, motion[1] + of_y * y, motion[2] + of_turn * turn)

    def _held(self, vx: float, vy: float, rate: float) -> Motion:
        """The motion after the impulses that the floor gives across the wheels, one row after the other."""
        per_mass, per_inertia = 1 / self._body.mass_kg, 1 / self._body.yaw_inertia_kg_m2
        for cos, sin, lever in self._still * SWEEPS:
            mobility = per_mass * (cos * cos + sin * sin) + per_inertia * lever * lever
            impulse = (cos * vx + sin * vy + lever * rate) / mobility
            vx, vy = vx - per_mass * cos * impulse, vy - per_mass * sin * impulse
            rate -= per_inertia * lever * impulse
        return (vx, vy, rate)

    def _judged(self, motion: Motion, slip: Sequence[float]) -> tuple[bool, ...]:
        tuning = self._tuning
        creep = tuning.slip_ratio * math.hypot(motion[0], motion[1])
        begins = tuning.slip_m_s + max(creep, self._doubt_m_s)
        ends = tuning.grip_part * (tuning.slip_m_s + creep)
        return tuple(abs(now) > (ends if was else begins) for now, was in zip(slip, self._last.slipping, strict=True))


def _rolling(row: Row, motion: Motion) -> float:
    return row[0] * motion[0] + row[1] * motion[1] + row[2] * motion[2]


def rim_drive(drive: DriveConfig, traction: TractionConfig) -> RimDrive:
    """A drive of the profile as the observer wants it."""
    ratio, radius, motor = drive.total_ratio, drive.wheel_radius_m, drive.motor
    force_per_a = ratio * motor.torque_constant_n_m_a / radius
    inertia = traction.wheel_inertia_kg_m2 + ratio * ratio * motor.rotor_inertia_kg_m2
    friction = force_per_a * motor.no_load_current_a + traction.rolling_resistance_n
    return RimDrive(force_per_a, inertia / radius**2, friction, drive.gear_efficiency)
