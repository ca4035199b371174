"""Modes of operation of the simulated EPOS 24/5 as the torque source of its axis.

Source: maxon EPOS Firmware Specification chapter 9 (modes) and 14.1 (objects). Angles and speeds are those of the motor
shaft; quad counts (qc) appear where objects carry them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi
from typing import Protocol

from drivers.epos.state_machine import Mode
from drivers.simulated.epos_profile import PositionProfile, Regulator, SpeedRamp
from drivers.simulated.world import Axis
from profiles.schema import DriveConfig

SOFTWARE_PARAMETER = 0x6320
FOLLOWING_ERROR = 0x8611
OVER_SPEED = 0xFF05
POSITION_LIMIT = 0xFF09

TARGET_REACHED, BIT_12, BIT_13 = 1 << 10, 1 << 12, 1 << 13
_SPEED_ZERO_RAD_S = 10.0 * 2.0 * pi / 60.0
"""Speed below which statusword bit 12 says "speed is zero" in mode 3 (assumed: 10 rpm)."""

Law = Callable[[float, float, float], float]


@dataclass(slots=True)
class Parameters:
    """Objects that shape motions: rad/s, rad/s2 and quad counts; written by the drive when one of them changes."""

    profile_speed: float = 0.0
    max_speed: float = inf
    acceleration: float = 0.0
    deceleration: float = 0.0
    quick_stop: float = 0.0
    following_error_qc: int = 0
    min_position_qc: int = 0
    max_position_qc: int = 0
    max_speed_in_current_mode: float = inf


@dataclass(slots=True)
class SetValues:
    """What the modes run after: rad/s, A and quad counts."""

    target_velocity: float = 0.0
    velocity: float = 0.0
    position_qc: int = 0
    current_a: float = 0.0


class HomingLaw(Protocol):
    """What mode 6 adds."""

    def hold(self) -> None:
        """Come to rest and wait for the start bit."""
        ...

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """Demand of motor current [A] for the coming step."""
        ...

    def status_bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword."""
        ...


@dataclass(frozen=True, slots=True)
class SetPoint:
    """A profile position move as it was accepted."""

    position_qc: int
    relative: bool
    speed: float
    acceleration: float
    deceleration: float


class Motion:
    """The torque source of one axis.

    Args:
        config: the drive of the profile (motor and encoder as they are mounted).
        axis: the motor's shaft.
        raise_fault: called with an EMCY code when a supervision of the motion trips.
        ramp_ended: called in each step at the end of the quick-stop ramp.

    Attributes:
        homing: the law of mode 6, set by who builds both.
        demand_speed: speed demand [rad/s], from ramp or position regulator.
        powered: the power stage is on.
        cable_off: the motor is not connected: no current flows.
        halted: the halt bit is set.
        acknowledged: the last set-point of mode 1 was taken.
    """

    homing: HomingLaw

    def __init__(
        self, config: DriveConfig, axis: Axis, raise_fault: Callable[[int], None], ramp_ended: Callable[[], None]
    ) -> None:
        self.axis = axis
        self.parameters = Parameters()
        self.set_values = SetValues()
        self.ramp = SpeedRamp()
        self.profile = PositionProfile()
        self.regulator = Regulator(config.motor)
        self.qc_per_rad = config.qc_per_motor_turn / (2.0 * pi)
        self.mode = Mode.PROFILE_POSITION
        self.demand_speed = 0.0
        self.powered = self.halted = self.acknowledged = self.following_error = self.cable_off = False
        self._raise_fault = raise_fault
        self._ramp_ended = ramp_ended
        self._stopping = self._set_point_bit = False
        self._zero_qc = 0
        self._law: Law = self._follow_ramp
        self._set_point: SetPoint | None = None
        self._next: SetPoint | None = None
        self._off_since_s = 0.0

    # Position

    @property
    def counts(self) -> int:
        """Position in quad counts as the encoder counts it now: whole, from where the counter was zeroed."""
        axis = self.axis
        return int((axis.position_rad + axis.speed_rad_s * axis.ahead_s) * self.qc_per_rad // 1.0) - self._zero_qc

    def set_counts(self, counts: int) -> None:
        """Let the present position have this count (power-up, homing)."""
        self._zero_qc -= counts - self.counts

    def angle_of(self, position_qc: float) -> float:
        """Shaft angle [rad] of a position in quad counts."""
        return (position_qc + self._zero_qc) / self.qc_per_rad

    def qc_of(self, angle_rad: float) -> float:
        """Position in quad counts, not rounded, of a shaft angle."""
        return angle_rad * self.qc_per_rad - self._zero_qc

    # Power stage, mode, stops

    def start(self, now_s: float) -> None:
        """Power stage on: take over the shaft's motion and follow the mode's set value."""
        self.regulator.restart(now_s - self._off_since_s)
        self.powered = True
        self.following_error = False
        self.axis.torque_source = self
        self.resume()

    def stop(self, now_s: float) -> None:
        """Power stage off: the axis coasts."""
        if self.powered:
            self._off_since_s = now_s
            self.powered = self._stopping = False
            self.demand_speed = self.ramp.speed = self.profile.speed = 0.0
            self._drop_set_points()
            self.axis.torque_source = None

    def quick_stop(self) -> None:
        """Brake by the quick-stop ramp to standstill and hold there, in every mode."""
        self._take_over()
        self._stopping = True
        self.update()

    def resume(self) -> None:
        """Follow the mode's set value, from the shaft's present motion."""
        self._take_over()
        self._stopping = False
        self.update()

    def change_mode(self, mode: Mode) -> None:
        """Take another mode of operation; its set value acts at once."""
        if mode is not self.mode:
            self.mode = mode
            if self.powered and not self._stopping:
                self.resume()

    def set_halt(self, halted: bool) -> None:
        """Halt bit of the controlword; without meaning in modes -1, -2 and -3."""
        if halted is not self.halted:
            self.halted = halted
            self.update()

    def _take_over(self) -> None:
        """Begin ramp and profile with the shaft's present motion."""
        self._drop_set_points()
        self.ramp.speed = self.profile.speed = self.axis.speed_rad_s
        self.profile.position = self.profile.end = self.axis.position_rad
        self.profile.arrived = True
        self.homing.hold()

    def _drop_set_points(self) -> None:
        self._set_point = self._next = None
        self.acknowledged = False

    def update(self) -> None:
        """Choose the law and its target after a set value, a parameter, the mode or the halt bit changed."""
        if not self.powered:
            return
        if self._stopping:
            self.ramp.aim(0.0, self.parameters.quick_stop, self.parameters.quick_stop)
            self._law = self._brake
        elif self.mode is Mode.PROFILE_VELOCITY:
            self._aim_ramp()
            self._law = self._follow_ramp
        else:
            self._law = self._laws[self.mode]

    @property
    def _laws(self) -> dict[Mode, Law]:
        return {
            Mode.HOMING: self.homing.current_demand,
            Mode.PROFILE_POSITION: self._follow_set_points,
            Mode.POSITION: self._follow_position,
            Mode.VELOCITY: self._follow_velocity,
            Mode.CURRENT: self._follow_current,
        }

    def _aim_ramp(self) -> None:
        parameters = self.parameters
        limit = parameters.max_speed
        target = 0.0 if self.halted else min(max(self.set_values.target_velocity, -limit), limit)
        self.ramp.aim(target, parameters.acceleration, parameters.deceleration)

    # Set-points of mode 1

    def new_set_point(self, position_qc: int, *, relative: bool, at_once: bool) -> None:
        """Rising edge of the set-point bit: take the target now, or after the move under way.

        While one set-point waits, another that is not to be taken at once is not acknowledged.
        """
        self._set_point_bit = True
        parameters = self.parameters
        speed = min(parameters.profile_speed, parameters.max_speed)
        point = SetPoint(position_qc, relative, speed, parameters.acceleration, parameters.deceleration)
        if at_once or self._set_point is None:
            self.acknowledged = True
            self._begin(point)
        elif self._next is None:
            self.acknowledged = True
            self._next = point

    def clear_set_point_bit(self) -> None:
        """The set-point bit is 0: the acknowledge falls as soon as no set-point waits."""
        self._set_point_bit = False
        if self._next is None:
            self.acknowledged = False

    def _begin(self, point: SetPoint) -> None:
        self._next = None
        end_qc = point.position_qc + (self.qc_of(self.profile.end) if point.relative else 0.0)
        if not self.parameters.min_position_qc <= end_qc <= self.parameters.max_position_qc:
            self._raise_fault(POSITION_LIMIT)
        elif min(point.speed, point.acceleration, point.deceleration) <= 0.0:
            self._raise_fault(SOFTWARE_PARAMETER)
        else:
            self._set_point = point
            self.profile.aim(self.angle_of(end_qc), point.speed, point.acceleration, point.deceleration)

    # Laws: current for the coming step

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """Demand of motor current [A] for the coming step."""
        current = self._law(speed_rad_s, position_rad, dt_s)
        return current if self.powered and not self.cable_off else 0.0

    def _follow_ramp(self, speed: float, _position: float, dt_s: float) -> float:
        ramp = self.ramp
        if ramp.slope != 0.0 or ramp.speed != ramp.target:
            ramp.step(dt_s)
        self.demand_speed = ramp.speed
        return self.regulator.follow_speed(ramp.speed, ramp.slope, speed, dt_s)

    def _brake(self, speed: float, position: float, dt_s: float) -> float:
        current = self._follow_ramp(speed, position, dt_s)
        if self.ramp.speed == 0.0:
            self._ramp_ended()
        return current

    def _follow_velocity(self, speed: float, _position: float, dt_s: float) -> float:
        limit = self.parameters.max_speed
        self.demand_speed = min(max(self.set_values.velocity, -limit), limit)
        return self.regulator.follow_speed(self.demand_speed, 0.0, speed, dt_s)

    def _follow_current(self, speed: float, _position: float, dt_s: float) -> float:
        if abs(speed) > self.parameters.max_speed_in_current_mode:
            self._raise_fault(OVER_SPEED)
        return self.regulator.limit(self.set_values.current_a, dt_s)

    def _follow_position(self, speed: float, position: float, dt_s: float) -> float:
        low, high = self.parameters.min_position_qc, self.parameters.max_position_qc
        self.profile.position = self.angle_of(min(max(self.set_values.position_qc, low), high))
        self.profile.speed = self.profile.slope = 0.0
        return self.regulate_position(speed, position, dt_s)

    def _follow_set_points(self, speed: float, position: float, dt_s: float) -> float:
        if self._set_point is not None and self.profile.arrived:
            self._set_point = None
            if self._next is not None:
                self.acknowledged = self._set_point_bit
                self._begin(self._next)
        if self._stopping:
            return self._brake(speed, position, dt_s)
        self.run_profile(dt_s)
        return self.regulate_position(speed, position, dt_s)

    def run_profile(self, dt_s: float) -> None:
        """One step of the position profile; without a move it comes to rest and stays."""
        profile = self.profile
        if profile.arrived and profile.speed:
            profile.down = self.parameters.deceleration
        if profile.speed or profile.slope or not profile.arrived:
            profile.step(dt_s, halted=self.halted)
        if self._set_point is None and profile.arrived:
            profile.end = profile.position

    def regulate_position(self, speed: float, position: float, dt_s: float) -> float:
        """Current that makes the shaft follow the position profile; a following error trips the drive."""
        profile = self.profile
        error = profile.position - position
        if abs(error) * self.qc_per_rad > self.parameters.following_error_qc:
            self._raise_fault(FOLLOWING_ERROR)
            self.following_error = True
            return self._brake(speed, position, dt_s)
        self.demand_speed = profile.speed + self.regulator.speed_for(error)
        return self.regulator.follow_speed(self.demand_speed, profile.slope, speed, dt_s)

    # Statusword

    def status_bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword (maxon EPOS Firmware Specification 9.2 to 9.8)."""
        if self._stopping:
            return TARGET_REACHED if self.ramp.speed == 0.0 else 0
        if self.mode is Mode.PROFILE_VELOCITY:
            reached = self.powered and self.ramp.speed == self.ramp.target
            zero = abs(self.axis.speed_rad_s) < _SPEED_ZERO_RAD_S
            return (TARGET_REACHED if reached else 0) | (BIT_12 if zero else 0)
        if self.mode is Mode.PROFILE_POSITION:
            return self._position_bits()
        return self.homing.status_bits() if self.mode is Mode.HOMING else 0

    def _position_bits(self) -> int:
        still = self.profile.speed == 0.0
        reached = self.powered and still and (self.halted or (self.profile.arrived and self._next is None))
        bits = TARGET_REACHED if reached else 0
        bits |= BIT_12 if self.acknowledged else 0
        return bits | (BIT_13 if self.following_error else 0)
