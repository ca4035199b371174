"""Homing mode of the simulated EPOS 24/5 (maxon EPOS Firmware Specification 9.3, 14.1.75).

Modelled are the methods that need nothing but motor, encoder and current: 35 (present position), 33 and 34 (encoder
index), -3 and -4 (current threshold, against a stop), 0 (none needed). The others start, find no switch and end with
the homing error bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from math import floor, tau

from drivers.simulated.epos_motion import BIT_12, BIT_13, TARGET_REACHED, Motion

_PRESENT_POSITION = (0, 35)
_INDEX = {33: -1, 34: 1}
_THRESHOLD = {-3: 1, -4: -1}


class Phase(Enum):
    """How far a homing is."""

    IDLE = auto()
    SEARCHING = auto()
    MOVING = auto()
    ATTAINED = auto()
    FAILED = auto()


@dataclass(slots=True)
class HomingParameters:
    """Objects of the homing mode: rad/s, rad/s2, A and quad counts."""

    switch_speed: float = 0.0
    zero_speed: float = 0.0
    acceleration: float = 0.0
    threshold_a: float = 0.0
    offset_qc: int = 0
    home_position_qc: int = 0


class Homing:
    """Searches a reference, moves by the home offset, and gives that place the home position.

    Args:
        motion: whose shaft it moves.

    Attributes:
        referenced: statusword bit 15, kept until the position is lost.
    """

    def __init__(self, motion: Motion) -> None:
        self.parameters = HomingParameters()
        self.referenced = False
        self._motion = motion
        self._phase = Phase.IDLE
        self._method = 0
        self._turn = 0

    def hold(self) -> None:
        """Come to rest and wait for the start bit; a homing under way is given up."""
        if self._phase in (Phase.SEARCHING, Phase.MOVING):
            self._phase = Phase.IDLE

    def start(self, method: int) -> None:
        """Rising edge of the start bit."""
        self._method = method
        self.referenced = False
        self._motion.ramp.speed = self._motion.axis.speed_rad_s
        if method in _PRESENT_POSITION:
            self._found(self._motion.axis.position_rad)
        elif method in _INDEX or method in _THRESHOLD:
            self._phase = Phase.SEARCHING
            self._turn = floor(self._motion.axis.position_rad / tau)
        else:
            self._phase = Phase.FAILED

    def _found(self, position_rad: float) -> None:
        motion, parameters = self._motion, self.parameters
        motion.profile.position = motion.axis.position_rad
        motion.profile.speed = motion.axis.speed_rad_s
        end = position_rad + parameters.offset_qc / motion.qc_per_rad
        motion.profile.aim(end, parameters.switch_speed, parameters.acceleration, parameters.acceleration)
        self._phase = Phase.MOVING

    def current_demand(self, speed_rad_s: float, position_rad: float, dt_s: float) -> float:
        """Demand of motor current [A] for the coming step."""
        motion = self._motion
        if self._phase in (Phase.MOVING, Phase.ATTAINED):
            motion.run_profile(dt_s)
            if self._phase is Phase.MOVING and motion.profile.arrived:
                self._attain()
            return motion.regulate_position(speed_rad_s, position_rad, dt_s)
        rate = self.parameters.acceleration
        motion.ramp.aim(self._search_speed(), rate, rate)
        motion.ramp.step(dt_s)
        motion.demand_speed = motion.ramp.speed
        if self._phase is Phase.SEARCHING:
            self._look(position_rad)
        return motion.regulator.follow_speed(motion.ramp.speed, motion.ramp.slope, speed_rad_s, dt_s)

    def _search_speed(self) -> float:
        if self._phase is not Phase.SEARCHING or self._motion.halted:
            return 0.0
        if self._method in _INDEX:
            return _INDEX[self._method] * self.parameters.zero_speed
        return _THRESHOLD[self._method] * self.parameters.switch_speed

    def _look(self, position_rad: float) -> None:
        """Look for the index (one a turn) or for the current that a stop makes once the search speed is demanded."""
        if self._method in _INDEX:
            turn = floor(position_rad / tau)
            if turn != self._turn:
                self._found(max(turn, self._turn) * tau)
            return
        ramp = self._motion.ramp
        if ramp.speed == ramp.target != 0.0 and abs(self._motion.axis.current_a) >= self.parameters.threshold_a:
            self._found(position_rad)

    def _attain(self) -> None:
        motion = self._motion
        offset = motion.counts - motion.qc_of(motion.profile.position)
        motion.set_counts(self.parameters.home_position_qc + round(offset))
        self._phase = Phase.ATTAINED
        self.referenced = True

    def status_bits(self) -> int:
        """Bits 10, 12 and 13 of the statusword."""
        motion = self._motion
        if motion.halted:
            speed = motion.profile.speed if self._phase is Phase.MOVING else motion.ramp.speed
            return TARGET_REACHED if speed == 0.0 else 0
        if self._phase is Phase.ATTAINED:
            return TARGET_REACHED | BIT_12
        return BIT_13 if self._phase is Phase.FAILED else 0

    def forget(self) -> None:
        """The position is lost (power-up)."""
        self._phase = Phase.IDLE
        self.referenced = False
