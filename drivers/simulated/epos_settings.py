"""Objects of the simulated EPOS 24/5 that shape its motions: factory values, units, and what they mean to its parts."""

from __future__ import annotations

from collections.abc import Callable
from math import tau

from drivers.simulated.dictionary import SimulatedDictionary, Value
from drivers.simulated.epos_homing import Homing
from drivers.simulated.epos_motion import Motion
from profiles.schema import DriveConfig

FACTORY: dict[str, Value] = {
    "product_code": 0x6210_2011,
    "software_version": 0x2011,
    "hardware_version": 0x6210,
    "recompute_pdo_cob_ids_from_node_id": 1,
    "continuous_current_limit": 5000,
    "output_current_limit": 10000,
}
VOLATILE = (
    "number_of_recorded_errors",
    "controlword",
    "target_position",
    "target_velocity",
    "current_mode_setting_value",
    "position_mode_setting_value",
    "velocity_mode_setting_value",
    "digital_output_functions_state",
)
PARAMETERS = (
    "encoder_pulses_per_turn",
    "max_following_error",
    "min_position_limit",
    "max_position_limit",
    "max_profile_velocity",
    "profile_velocity",
    "profile_acceleration",
    "profile_deceleration",
    "quick_stop_deceleration",
    "homing_speed_switch_search",
    "homing_speed_zero_search",
    "homing_acceleration",
    "current_threshold_for_homing",
    "home_offset",
    "home_position",
    "continuous_current_limit",
    "output_current_limit",
    "max_speed_in_current_mode",
    "thermal_time_constant_winding",
)
_MOTOR_TYPES = {"brushed_dc": 1, "brushless_sine": 10, "brushless_block": 11}
_SENSOR_TYPES = {"encoder_with_index": 1, "encoder": 2, "hall": 3}


class Settings:
    """Carries objects over to motion control and homing, in their units.

    Args:
        dictionary: the drive's objects.
        motion: its motion control.
        homing: its homing mode.
        mounted_pulses: pulses per turn of the encoder on the motor.

    Attributes:
        rad_s_per_rpm: shaft speed of what the drive takes for 1 rpm: it counts quad counts and trusts 0x2210/1.
    """

    def __init__(self, dictionary: SimulatedDictionary, motion: Motion, homing: Homing, mounted_pulses: int) -> None:
        self._dictionary = dictionary
        self._motion = motion
        self._homing = homing
        self._mounted_pulses = mounted_pulses
        self.rad_s_per_rpm = tau / 60.0

    @property
    def sensor(self) -> tuple[int, int]:
        """Encoder pulses per turn and type of the position sensor."""
        number = self._dictionary.number
        return number("encoder_pulses_per_turn"), number("position_sensor_type")

    def take_parameters(self, _: int = 0) -> None:
        """One of :data:`PARAMETERS` was written."""
        number, motion = self._dictionary.number, self._motion
        parameters, regulator = motion.parameters, motion.regulator
        rpm = self.rad_s_per_rpm = tau / 60.0 * number("encoder_pulses_per_turn") / self._mounted_pulses
        parameters.profile_speed = number("profile_velocity") * rpm
        parameters.max_speed = number("max_profile_velocity") * rpm
        parameters.acceleration = number("profile_acceleration") * rpm
        parameters.deceleration = number("profile_deceleration") * rpm
        parameters.quick_stop = number("quick_stop_deceleration") * rpm
        parameters.following_error_qc = number("max_following_error")
        parameters.min_position_qc = number("min_position_limit")
        parameters.max_position_qc = number("max_position_limit")
        parameters.max_speed_in_current_mode = number("max_speed_in_current_mode") * rpm
        regulator.continuous_a = 0.001 * number("continuous_current_limit")
        regulator.output_a = 0.001 * number("output_current_limit")
        regulator.winding_s = 0.1 * number("thermal_time_constant_winding")
        self._take_homing_parameters(rpm)
        motion.update()

    def _take_homing_parameters(self, rpm: float) -> None:
        number, homing = self._dictionary.number, self._homing.parameters
        homing.switch_speed = number("homing_speed_switch_search") * rpm
        homing.zero_speed = number("homing_speed_zero_search") * rpm
        homing.acceleration = number("homing_acceleration") * rpm
        homing.threshold_a = 0.001 * number("current_threshold_for_homing")
        homing.offset_qc = number("home_offset")
        homing.home_position_qc = number("home_position")

    def set_value_actions(self) -> dict[str, Callable[[int], None]]:
        """Actions of the objects that the modes run after, by name."""
        return {
            "target_velocity": self._take_target_velocity,
            "velocity_mode_setting_value": self._take_velocity,
            "position_mode_setting_value": self._take_position,
            "current_mode_setting_value": self._take_current,
        }

    def take_set_values(self) -> None:
        """Carry over all set values (power-up)."""
        for name, action in self.set_value_actions().items():
            action(self._dictionary.number(name))

    def _take_target_velocity(self, value_rpm: int) -> None:
        target = value_rpm * self.rad_s_per_rpm
        if target != self._motion.set_values.target_velocity:
            self._motion.set_values.target_velocity = target
            self._motion.update()

    def _take_velocity(self, value_rpm: int) -> None:
        self._motion.set_values.velocity = value_rpm * self.rad_s_per_rpm

    def _take_position(self, value_qc: int) -> None:
        self._motion.set_values.position_qc = value_qc

    def _take_current(self, value_ma: int) -> None:
        self._motion.set_values.current_a = 0.001 * value_ma


def commissioned(config: DriveConfig) -> dict[str, Value]:
    """What is saved in a drive that was set up for its motor."""
    return {
        "motor_type": _MOTOR_TYPES[config.motor.type],
        "pole_pairs": config.motor.pole_pairs,
        "encoder_pulses_per_turn": config.encoder_pulses_per_turn,
        "position_sensor_type": _SENSOR_TYPES[config.position_sensor],
    }
