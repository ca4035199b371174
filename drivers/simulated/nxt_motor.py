"""A motor of the NXT with the firmware that drives it, a millisecond at a time.

Motor, by its output shaft (measured values of an NXT motor at 9 V: 170 rpm and 60 mA without load, 0.5 N m and 2 A when
stalled)::

    i = (u - k_e w) / R        J dw/dt = k_t i - dry friction - load

Firmware, as the LEGO firmware does it: limits are measured by the tacho counter against a count to run to, which a
limited run moves on by its limit, and an unlimited one takes along. What a run overshoots is therefore taken off the
next one. At the limit the output coasts, and its power fades by one a millisecond, which is why it overshoots. Speed is
regulated ten times a second by a PID on the counts that are missing; 100 is 1000 degrees a second. Not modelled:
synchronised motors, which run unregulated here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from drivers.nxt.codes import OutputMode, Regulation, RunState
from drivers.nxt.replies import OutputState
from drivers.nxt.requests import SetOutputState

TICK_S: Final = 0.001
REGULATION_TICKS: Final = 100
MIN_RAMP_POWER: Final = 10
"""Ramps begin and end here, not at rest."""
_INTEGRAL_LIMIT: Final = 800


@dataclass(frozen=True, slots=True)
class MotorConstants:
    """One motor with its gear and its wheel, at the output shaft; the inertia (with half a light robot) is assumed."""

    resistance_ohm: float = 4.5
    back_emf_v_s: float = 0.490
    torque_n_m_a: float = 0.258
    friction_n_m: float = 0.0155
    inertia_kg_m2: float = 0.6e-3


class NxtMotor:
    """One output of the brick with the motor that is plugged into it.

    Args:
        constants: of the motor.

    Attributes:
        shaft_rad, speed_rad_s: of the motor's output, before the play of what it drives.
        current_a: what the motor takes.
        load_n_m: torque against the motion.
        blocked: set it to True to hold the shaft.
    """

    def __init__(self, constants: MotorConstants = MotorConstants()) -> None:
        self.shaft_rad = 0.0
        self.speed_rad_s = 0.0
        self.current_a = 0.0
        self.load_n_m = 0.0
        self.blocked = False
        self._constants = constants
        self._order = SetOutputState(0, 0, OutputMode.IDLE, Regulation.IDLE, 0, RunState.IDLE, 0)
        self._run_state = RunState.IDLE
        self._regulated = False
        self._braking = False
        self._power = 0
        self._set = self._target = 0
        self._count = self._block = self._rotation = self._degree = 0
        self._to_run = 0
        self._forever = True
        self._ramp_start = self._ramp_from = 0
        self._timer = self._window = 0
        self._error = self._integral = 0

    # Orders

    def set_output(self, order: SetOutputState) -> None:
        """Take a SetOutputState."""
        self._order = order
        on = bool(order.mode & OutputMode.MOTOR_ON)
        power = max(-100, min(100, order.power))
        self._set_speed(order.run_state if on else RunState.IDLE, power if on else 0)
        self._braking = bool(order.mode & OutputMode.BRAKE)
        self._regulated = (
            on and bool(order.mode & OutputMode.REGULATED) and order.regulation == Regulation.SPEED
        ) and self._run_state != RunState.IDLE
        if self._regulated and self._set == 0:
            self._error = self._integral = 0
        self._set_limit(order.tacho_limit_deg)

    def _set_speed(self, run_state: int, power: int) -> None:
        if self._target == 0:
            self._error = self._integral = self._timer = self._window = 0
        if run_state == RunState.RUNNING:
            self._run_state = RunState.RUNNING
            self._set = self._target = power
            if power == 0:
                self._power = 0
        elif run_state == RunState.RAMP_UP:
            self._begin_ramp(RunState.RAMP_UP, power, abs(power) > abs(self._set) or power * self._set < 0)
        elif run_state == RunState.RAMP_DOWN:
            self._begin_ramp(RunState.RAMP_DOWN, power, abs(power) < abs(self._set))
        else:
            self._run_state = RunState.IDLE

    def _begin_ramp(self, ramp: RunState, power: int, changes: bool) -> None:
        if not changes:
            self._run_state = RunState.RUNNING
            return
        self._run_state = ramp
        self._set = power
        self._ramp_start = self._count
        self._ramp_from = self._target or int(math.copysign(MIN_RAMP_POWER, power))
        self._target = self._ramp_from

    def _set_limit(self, limit_deg: int) -> None:
        self._forever = limit_deg == 0
        direction = self._set or self._target
        self._to_run += limit_deg if direction > 0 else -limit_deg

    def reset_position(self, relative: bool) -> None:
        """Zero the counter of the block, or that of the rotation."""
        if relative:
            self._block = 0
        else:
            self._rotation = 0

    def forget_counts(self) -> None:
        """As after switching on."""
        self._count = self._block = self._rotation = self._to_run = 0

    def state(self, port: int) -> OutputState:
        """What GetOutputState tells."""
        order = self._order
        return OutputState(
            port,
            order.power,
            order.mode,
            order.regulation,
            order.turn_ratio,
            self._run_state,
            order.tacho_limit_deg,
            self._count,
            self._block,
            self._rotation,
        )

    @property
    def at_rest(self) -> bool:
        """Whether a tick would change nothing."""
        return self._run_state == RunState.IDLE and not (self._power or self._target or self._set or self.speed_rad_s)

    # Time

    def tick(self, battery_v: float) -> None:
        """One millisecond."""
        self._turn(battery_v)
        self._count_degrees()
        if self._run_state == RunState.RUNNING:
            self._run()
        elif self._run_state == RunState.IDLE:
            self._fade()
        else:
            self._ramp()
        self._timer += 1
        if self._timer > REGULATION_TICKS:
            if self._regulated:
                self._regulate()
            self._timer = self._window = 0

    def _count_degrees(self) -> None:
        degree = math.floor(math.degrees(self.shaft_rad))
        moved = degree - self._degree
        if moved:
            self._degree = degree
            self._count += moved
            self._block += moved
            self._rotation += moved
            self._window += moved

    def _past_limit(self, direction: int) -> bool:
        return self._count >= self._to_run if direction > 0 else self._count <= self._to_run

    def _run(self) -> None:
        if self._forever:
            if self._target:
                self._to_run = self._count
        elif self._set and self._past_limit(self._set):
            self._end()
        if not self._regulated:
            self._power = self._target

    def _end(self) -> None:
        self._run_state = RunState.IDLE
        self._regulated = False

    def _fade(self) -> None:
        self._braking = False
        self._power = _towards_rest(self._power)
        self._target = _towards_rest(self._target)
        self._set = _towards_rest(self._set)

    def _ramp(self) -> None:
        """The target follows the way: linear from where the ramp began to the count to run to."""
        end = self._set or int(math.copysign(MIN_RAMP_POWER, self._ramp_from))
        way = self._to_run - self._ramp_start
        done = (self._count - self._ramp_start) / way if way else 1.0
        self._target = self._ramp_from + int((end - self._ramp_from) * max(0.0, min(1.0, done)))
        if not self._regulated:
            self._power = self._target
        if self._past_limit(self._ramp_from):
            self._end()
            if self._set == 0:
                self._target = self._power = 0

    def _regulate(self) -> None:
        error = max(-32000, min(32000, self._error - self._window + self._target))
        change, self._error = error - self._error, error
        integral = int((3 * self._integral + error) / 4)
        self._integral = max(-_INTEGRAL_LIMIT, min(_INTEGRAL_LIMIT, integral))
        self._power = max(-100, min(100, int((3 * error + self._integral + change) / 2)))

    # Motion

    def _turn(self, battery_v: float) -> None:
        if self.blocked:
            self.speed_rad_s = 0.0
            self.current_a = abs(self._power) / 100 * battery_v / self._constants.resistance_ohm
            return
        constants = self._constants
        current = self._flowing(battery_v)
        self.current_a = abs(current)
        step = TICK_S / constants.inertia_kg_m2
        speed = self.speed_rad_s + constants.torque_n_m_a * current * step
        stopping = (constants.friction_n_m + self.load_n_m) * step
        self.speed_rad_s = speed - max(-stopping, min(stopping, speed))
        self.shaft_rad += self.speed_rad_s * TICK_S

    def _flowing(self, battery_v: float) -> float:
        """Mean current: braked between the pulses it flows all the time, else in the pulses only."""
        constants, back_emf = self._constants, self._constants.back_emf_v_s * self.speed_rad_s
        duty = self._power / 100
        if self._braking:
            return (duty * battery_v - back_emf) / constants.resistance_ohm
        pulse = (math.copysign(battery_v, duty) - back_emf) / constants.resistance_ohm
        return abs(duty) * pulse if pulse * duty > 0 else 0.0


def _towards_rest(value: int) -> int:
    return value - (value > 0) + (value < 0)
