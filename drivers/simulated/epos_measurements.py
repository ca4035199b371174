"""What the simulated EPOS 24/5 measures: actual and demand values as its objects show them."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, pi, tau
from random import Random

from drivers.simulated.epos_motion import Motion

_CURRENT_NOISE_MA = 4.0
"""Standard deviation of a current measurement (assumed)."""
_HALL_PATTERNS = (0b001, 0b011, 0b010, 0b110, 0b100, 0b101)
_ROTOR_KNOWN = 0b110
_CURRENT_LIMITED = 1 << 7


class Measurements:
    """Readers of the measuring objects.

    Args:
        motion: the drive's motion control.
        pole_pairs: of the motor.
        rad_s_per_rpm: shaft speed of what the drive takes for 1 rpm.
        seed: of the measurement noise.

    Attributes:
        captured_qc: position at the last edge of the position marker.
        analog_mv: functions that measure the voltages at the analog inputs.
    """

    def __init__(self, motion: Motion, pole_pairs: int, rad_s_per_rpm: Callable[[], float], seed: int) -> None:
        self.captured_qc = 0
        self.analog_mv: list[Callable[[], float]] = [lambda: 0.0, lambda: 0.0]
        self._motion = motion
        self._pole_pairs = pole_pairs
        self._rad_s_per_rpm = rad_s_per_rpm
        self._random = Random(seed)

    def readers(self) -> dict[str, Callable[[], int]]:
        """Functions that compute the objects' values, by name."""
        motion = self._motion
        return {
            "mode_of_operation_display": lambda: int(motion.mode),
            "position_actual_value": lambda: _int32(motion.counts),
            "position_demand_value": lambda: _int32(round(motion.qc_of(motion.profile.position))),
            "velocity_actual_value": lambda: self._rpm(motion.axis.speed_rad_s),
            "velocity_actual_value_averaged": lambda: _int16(self._rpm(motion.axis.speed_rad_s)),
            "velocity_demand_value": lambda: self._rpm(motion.demand_speed),
            "velocity_sensor_actual_value": lambda: round(motion.axis.speed_rad_s * motion.qc_per_rad),
            "current_actual_value": self._current_ma,
            "current_actual_value_averaged": lambda: _int16(1000.0 * motion.axis.current_a),
            "encoder_counter": lambda: motion.counts & 0xFFFF,
            "encoder_counter_at_index": self._counter_at_index,
            "hall_sensor_pattern": self._hall_pattern,
            "system_state": lambda: _ROTOR_KNOWN | (_CURRENT_LIMITED if motion.regulator.limited else 0),
            "captured_position": lambda: _int32(self.captured_qc),
            "analog_input_1": lambda: _int16(self.analog_mv[0]()),
            "analog_input_2": lambda: _int16(self.analog_mv[1]()),
        }

    def _rpm(self, speed_rad_s: float) -> int:
        return round(speed_rad_s / self._rad_s_per_rpm())

    def _current_ma(self) -> int:
        return _int16(1000.0 * self._motion.axis.current_a + self._random.gauss(0.0, _CURRENT_NOISE_MA))

    def _counter_at_index(self) -> int:
        return floor(self._motion.qc_of(floor(self._motion.axis.position_rad / tau) * tau)) & 0xFFFF

    def _hall_pattern(self) -> int:
        electrical = self._motion.axis.position_rad * self._pole_pairs
        return _HALL_PATTERNS[floor(electrical / (pi / 3.0)) % 6]


def _int32(counts: int) -> int:
    """Counts as a 32-bit register shows them: wrapped."""
    return (counts + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000


def _int16(value: float) -> int:
    """A value as a 16-bit object shows it: at most its range."""
    return min(max(round(value), -0x8000), 0x7FFF)
