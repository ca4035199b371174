"""The object dictionary of the EPOS 24/5: firmware 2011h, and what later firmware added (to be probed before use).

Units are fixed: position in quad counts (qc, four an encoder pulse), velocity in rpm, acceleration in rpm/s, current in
mA, all at the motor's shaft (maxon EPOS Firmware Specification 13).
"""

from __future__ import annotations

from dataclasses import replace

from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable
from drivers.epos.communication_objects import COMMUNICATION_AREA, highest_sub_index

_U8, _U16, _U32, _U64 = DataType.U8, DataType.U16, DataType.U32, DataType.U64
_I8, _I16, _I32 = DataType.I8, DataType.I16, DataType.I32
_RO, _WO, _RW, _CONST = Access.RO, Access.WO, Access.RW, Access.CONST

_RESTART = "Takes effect after saving (0x1010/1) and a restart."
_SERVICE_TOOL = "of the data recorder that maxon's service tool uses"
_FIXED_UNIT = "The unit is fixed: another value is refused."


# fmt: off
_SYSTEM = (
    ObjectDef(0x2000, 0, "node_id_software", _U8, _RW,
              f"Node id that counts while all DIP switches of the id are off. {_RESTART}", default=1, low=1, high=127),
    ObjectDef(0x2001, 0, "can_bit_rate_code", _U16, _RW, f"Bit rate of the CAN bus, 0 for 1 Mbit/s. {_RESTART}",
              default=0, unit="code", low=0, high=6),
    ObjectDef(0x2002, 0, "rs232_baud_rate_code", _U16, _RW, f"Baud rate of the serial line, 3 for 38400. {_RESTART}",
              default=3, unit="code", low=0, high=5),
    highest_sub_index(0x2003, "version", 5),
    ObjectDef(0x2003, 1, "software_version", _U16, _RO, "Firmware version, read as hexadecimal digits: 0x2011.",
              unit="bcd-like hex",
              cause="Above 0x2011: later firmware with other objects and PDO rules.",
              cure="Probe objects marked 'later' before using them."),
    ObjectDef(0x2003, 2, "hardware_version", _U16, _RO,
              "Hardware: 0x621x is an EPOS 24/5, 0x601x a 24/1, 0x641x a 70/10.", unit="hex",
              cause="Not 0x621x: another drive with other current and voltage limits.",
              cure="Correct the profile, or exchange the drive."),
    ObjectDef(0x2003, 3, "application_number", _U16, _RO, "Number of a special application in the firmware."),
    ObjectDef(0x2003, 4, "application_version", _U16, _RO, "Version of that application."),
    ObjectDef(0x2003, 5, "base_sector_version", _U16, _RO, "Version of the boot sector."),
    ObjectDef(0x2004, 0, "serial_number", _U64, _RO, "Serial number of the device.", firmware="later"),
    ObjectDef(0x2005, 0, "rs232_frame_timeout", _U16, _RW, "Longest pause inside a serial frame.",
              default=500, unit="ms", firmware="later"),
    ObjectDef(0x2008, 0, "miscellaneous_configuration", _U16, _RW,
              "Bit 0 set: software supervision of the position sensor is off.", default=0,
              cause="Bit 0 set: a broken encoder cable goes unnoticed.",
              cure="Clear bit 0 unless the sensor needs it."),
    ObjectDef(0x2009, 0, "dip_switch_state", _U16, _RO, "The DIP switches as the drive reads them.", firmware="later"),
    *(ObjectDef(0x200C, place, f"custom_persistent_memory_{place}", _U32, _RW,
                "Free for the user, kept with the parameters.", default=0, firmware="later")
      for place in range(1, 5)),
)

_RECORDER = (
    ObjectDef(0x2010, 0, "recorder_control", _U16, _RW, f"Start and stop {_SERVICE_TOOL}."),
    ObjectDef(0x2011, 0, "recorder_configuration", _U16, _RW, f"Triggers {_SERVICE_TOOL}."),
    ObjectDef(0x2012, 0, "recorder_sampling_period", _U16, _RW, f"Sampling period {_SERVICE_TOOL}."),
    ObjectDef(0x2013, 0, "recorder_preceding_samples", _U16, _RW, f"Samples before the trigger {_SERVICE_TOOL}."),
    ObjectDef(0x2014, 0, "recorder_number_of_variables", _U16, _RW, f"Number of variables {_SERVICE_TOOL}."),
    highest_sub_index(0x2015, "recorder_variable_index", 4),
    *(ObjectDef(0x2015, place, f"recorder_variable_{place}_index", _U16, _RW,
                f"Index of variable {place} {_SERVICE_TOOL}.") for place in range(1, 5)),
    highest_sub_index(0x2016, "recorder_variable_subindex", 4),
    *(ObjectDef(0x2016, place, f"recorder_variable_{place}_subindex", _U16, _RW,
                f"Sub-index of variable {place} {_SERVICE_TOOL}.") for place in range(1, 5)),
    ObjectDef(0x2017, 0, "recorder_status", _U16, _RO, f"State {_SERVICE_TOOL}."),
    ObjectDef(0x2018, 0, "recorder_max_samples", _U16, _RO, f"Room for samples a variable {_SERVICE_TOOL}."),
    ObjectDef(0x2019, 0, "recorder_recorded_samples", _U16, _RO, f"Samples taken so far {_SERVICE_TOOL}."),
    ObjectDef(0x201A, 0, "recorder_start_offset", _U16, _RO, f"First sample in the buffer {_SERVICE_TOOL}."),
    ObjectDef(0x201B, 0, "recorder_data_buffer", DataType.DOMAIN, _RO, f"All samples {_SERVICE_TOOL}."),
)

_SENSORS = (
    ObjectDef(0x2020, 0, "encoder_counter", _U16, _RO, "The encoder's raw 16-bit counter; wraps.", unit="qc", pdo="tx"),
    ObjectDef(0x2021, 0, "encoder_counter_at_index", _U16, _RO, "Value of that counter at the last index pulse.",
              unit="qc", pdo="tx",
              cause="Changes by anything but whole turns: counts are lost.", cure="Check encoder cable and shield."),
    ObjectDef(0x2022, 0, "hall_sensor_pattern", _U16, _RO, "Hall sensors 1 to 3 in bits 0 to 2.",
              cause="0 or 7: a pattern that no rotor position gives; a wire is broken.", cure="Check the hall cable."),
    ObjectDef(0x2023, 0, "rotor_angle", _U16, _RW, "Electrical angle of the rotor, inside the drive."),
    ObjectDef(0x2024, 0, "system_state", _U16, _RO,
              "Bit 0 index found, 1 hall reference, 2 rotor position known, 3 service mode, "
              "7 current limited to the continuous limit.",
              cause="Bit 7: the motor drew more than its continuous current for too long.",
              cure="Lower load or acceleration; check that no brake drags."),
    ObjectDef(0x2025, 0, "reserved", _U32, _WO, "Reserved by the maker; do not write."),
    highest_sub_index(0x2026, "process_memory", 2),
    ObjectDef(0x2026, 1, "process_memory_address", _U16, _RW, "Address for the maker's diagnosis; do not write."),
    ObjectDef(0x2026, 2, "process_memory_value", _U16, _RW, "Value at that address, for the maker's diagnosis."),
    ObjectDef(0x2027, 0, "current_actual_value_averaged", _I16, _RO, "Motor current, smoothed.", unit="mA"),
    ObjectDef(0x2028, 0, "velocity_actual_value_averaged", _I16, _RO, "Motor speed, smoothed.", unit="rpm"),
    ObjectDef(0x202E, 0, "trajectory_profile_time", _U16, _RO, "Duration of the profile being driven.",
              firmware="later"),
)

_SET_VALUES_AND_PINS = (
    ObjectDef(0x2030, 0, "current_mode_setting_value", _I16, _RW,
              "Set value of current mode (-3); acts at once, guarded by 0x6410/4 alone.",
              default=0, unit="mA", pdo="rx"),
    ObjectDef(0x2062, 0, "position_mode_setting_value", _I32, _RW,
              "Set value of position mode (-1); acts at once without a profile, clipped by 0x607D.",
              default=0, unit="qc", pdo="rx"),
    ObjectDef(0x206B, 0, "velocity_mode_setting_value", _I32, _RW,
              "Set value of velocity mode (-2); acts at once without a profile.", unit="rpm", pdo="rx"),
    highest_sub_index(0x2070, "digital_input_function", 6),
    *(ObjectDef(0x2070, pin, f"function_of_digital_input_{pin}", _U16, _RW,
                f"What digital input {pin} is for: the number of its bit in 0x2071.",
                default=function, unit="code", low=0, high=15)
      for pin, function in enumerate((15, 14, 13, 2, 1, 0), 1)),
    highest_sub_index(0x2071, "digital_input_functions", 4),
    ObjectDef(0x2071, 1, "digital_input_functions_state", _U16, _RO,
              "Input functions that are active, after mask and polarity.", pdo="tx"),
    ObjectDef(0x2071, 2, "digital_input_functions_mask", _U16, _RW, "Input functions that are looked at.",
              default=0xE007),
    ObjectDef(0x2071, 3, "digital_input_functions_polarity", _U16, _RW,
              "Bit 0: the function is active when its pin is high; bit 1: when it is low.", default=0),
    ObjectDef(0x2071, 4, "digital_input_functions_execution_mask", _U16, _RW,
              "Functions that the drive acts on (limit switches, marker, enable), not only shows.", default=8,
              cause="A limit switch's bit is 0: the switch is seen and not obeyed.",
              cure="Set bits 0 and 1 where limit switches are wired."),
    highest_sub_index(0x2074, "position_marker", 2),
    ObjectDef(0x2074, 1, "captured_position", _I32, _RO, "Position at the last edge of the marker input.", unit="qc"),
    ObjectDef(0x2074, 2, "capture_edge", _U8, _RW, "Edge that captures: 0 both, 1 rising, 2 falling.",
              default=0, unit="code", low=0, high=2),
    ObjectDef(0x2074, 3, "position_marker_capture_mode", _U8, _RW, "Whether one edge or every edge captures.",
              firmware="later"),
    ObjectDef(0x2074, 4, "position_marker_capture_counter", _U16, _RW, "Edges captured so far.", firmware="later"),
    *(ObjectDef(0x2074, 4 + age, f"position_marker_capture_history_{age}", _I32, _RO,
                f"Position captured {age} before the last.", unit="qc", firmware="later") for age in (1, 2)),
    highest_sub_index(0x2078, "digital_output_functions", 3),
    ObjectDef(0x2078, 1, "digital_output_functions_state", _U16, _RW,
              "Wanted output functions: bits 15 to 12 for general purpose A to D, bit 0 ready. "
              "At polarity 0 a 0 lets the open-drain output sink.", pdo="rx",
              cause="The bit of a brake is not what the brake needs: it is released, or drags.",
              cure="Write it through canhelm brake, with the load supported."),
    ObjectDef(0x2078, 2, "digital_output_functions_mask", _U16, _RW, "Output functions that are driven at all.",
              default=0,
              cause="The bit of a wired output is 0: the output does not follow its state.",
              cure="Write state 0x2078/1 first, then set the bit."),
    ObjectDef(0x2078, 3, "digital_output_functions_polarity", _U16, _RW, "Bit 1: the output function is inverted.",
              default=0),
    highest_sub_index(0x2079, "digital_output_function", 4),
    *(ObjectDef(0x2079, pin, f"function_of_digital_output_{pin}", _U16, _RW,
                f"What digital output {pin} shows: the number of its bit in 0x2078.",
                default=16 - pin, unit="code", low=0, high=15)
      for pin in range(1, 5)),
    highest_sub_index(0x207C, "analog_input", 2),
    ObjectDef(0x207C, 1, "analog_input_1", _I16, _RO, "Voltage at analog input 1.", unit="mV", pdo="tx"),
    ObjectDef(0x207C, 2, "analog_input_2", _I16, _RO, "Voltage at analog input 2.", unit="mV", pdo="tx"),
    ObjectDef(0x2080, 0, "current_threshold_for_homing", _U16, _RW,
              "Current at which homing against a stop takes the stop as found.", default=500, unit="mA",
              cause="Above the output current limit (0x6410/2): the stop is never found.",
              cure="Set it above the current of free running and below the limit."),
    ObjectDef(0x2081, 0, "home_position", _I32, _RW, "Position that home gets after homing.", default=0, unit="qc"),
    ObjectDef(0x20F4, 0, "following_error_actual_value", _I16, _RO, "Demanded minus actual position.",
              unit="qc", pdo="tx", firmware="later",
              cause="Near 0x6065: the axis cannot follow.", cure="Lower the ramps, free the axis, tune the regulator."),
    highest_sub_index(0x2210, "sensor_configuration", 3),
    ObjectDef(0x2210, 1, "encoder_pulses_per_turn", _U16, _RW,
              "Pulses of the motor encoder a turn; a turn has four times as many qc. A change raises EMCY 0x7320.",
              default=500, unit="pulses/turn", low=16, high=7500,
              cause="Not the encoder's number: speed and distance are wrong by the ratio.",
              cure="Set it to the encoder's data, then reset the fault."),
    ObjectDef(0x2210, 2, "position_sensor_type", _U16, _RW,
              f"1 encoder with index, 2 encoder without, 3 hall sensors. {_RESTART}",
              default=1, unit="code", low=1, high=3),
    ObjectDef(0x2210, 3, "absolute_position_offset", _U16, _RW, "Offset of an absolute sensor, inside the drive."),
    ObjectDef(0x2210, 4, "position_sensor_polarity", _U16, _RW, "Direction of encoder and hall sensors, one bit each.",
              firmware="later"),
    highest_sub_index(0x2300, "digital_position", 4),
    ObjectDef(0x2300, 1, "digital_position_desired_value", _I32, _RO,
              "Steps counted in the modes master encoder (-5) and step/direction (-6).", default=0, unit="steps"),
    ObjectDef(0x2300, 2, "digital_position_scaling_numerator", _U16, _RW, "Position a step, numerator.", default=1),
    ObjectDef(0x2300, 3, "digital_position_scaling_denominator", _U16, _RW, "Position a step, denominator.", default=1),
    ObjectDef(0x2300, 4, "digital_position_polarity", _U8, _RW, "1 turns the counting direction round.",
              default=0, low=0, high=1),
    ObjectDef(0x2FFF, 0, "download_area", _U32, _RW, "For loading firmware; do not write.", firmware="later"),
)

_DRIVE_PROFILE = (
    ObjectDef(0x6040, 0, "controlword", _U16, _RW,
              "Commands the drive's states: shutdown 0x06, switch on 0x07, enable operation 0x0F, quick stop 0x02, "
              "disable voltage 0x00, fault reset 0x80.", pdo="rx"),
    ObjectDef(0x6041, 0, "statusword", _U16, _RO, "State of the drive; bits 0 to 6, 8 and 14 name it.", pdo="tx",
              cause="Bit 3 set: the drive is in fault.", cure="Read 0x1003/1, cure the cause, then reset the fault."),
    ObjectDef(0x6060, 0, "mode_of_operation", _I8, _RW,
              "Wanted mode: 6 homing, 3 profile velocity, 1 profile position, -1 position, -2 velocity, -3 current, "
              "-5 master encoder, -6 step/direction.", default=1, unit="code", low=-6, high=6, pdo="rx-static"),
    ObjectDef(0x6061, 0, "mode_of_operation_display", _I8, _RO, "The mode that is active, numbers as in 0x6060.",
              default=1, unit="code", pdo="tx-static",
              cause="Differs from 0x6060: the drive has not taken the mode.",
              cure="Write a mode that the firmware has, and wait for this object to follow."),
    ObjectDef(0x6062, 0, "position_demand_value", _I32, _RO, "Position that the profile generator demands now.",
              default=0, unit="qc"),
    ObjectDef(0x6064, 0, "position_actual_value", _I32, _RO, "Position of the motor's shaft.",
              default=0, unit="qc", pdo="tx"),
    ObjectDef(0x6065, 0, "max_following_error", _U32, _RW,
              "Difference of demanded and actual position that raises EMCY 0x8611.",
              default=2000, unit="qc",
              cause="Too small: stops without need. Too large: a blocked axis is noticed late.",
              cure="Set it to a few times the difference seen in normal driving."),
    ObjectDef(0x6067, 0, "position_window", _U32, _RW, "Distance to the target that counts as reached.",
              default=0xFFFF_FFFF, unit="qc", firmware="later"),
    ObjectDef(0x6068, 0, "position_window_time", _U16, _RW, "Time inside the window that counts as reached.",
              default=0, unit="ms", firmware="later"),
    ObjectDef(0x6069, 0, "velocity_sensor_actual_value", _I32, _RO, "Speed as the encoder gives it.", unit="qc/s"),
    ObjectDef(0x606B, 0, "velocity_demand_value", _I32, _RO, "Speed that the profile generator demands now.",
              unit="rpm"),
    ObjectDef(0x606C, 0, "velocity_actual_value", _I32, _RO, "Speed of the motor's shaft.", unit="rpm", pdo="tx"),
    ObjectDef(0x6078, 0, "current_actual_value", _I16, _RO, "Current in the motor.", unit="mA", pdo="tx",
              cause="Stays near 0x6410/2: the axis is blocked or overloaded.",
              cure="Release the brake, free the axis, lower the load."),
    ObjectDef(0x607A, 0, "target_position", _I32, _RW,
              "Target of profile position mode; taken at the next rising edge of controlword bit 4.",
              default=0, unit="qc", pdo="rx"),
    ObjectDef(0x607C, 0, "home_offset", _I32, _RW, "Way to go on after the reference was found.", default=0, unit="qc"),
    highest_sub_index(0x607D, "position_limit", 2),
    ObjectDef(0x607D, 1, "min_position_limit", _I32, _RW, "Lowest position allowed; below it EMCY 0xFF09.",
              default=-0x8000_0000, unit="qc"),
    ObjectDef(0x607D, 2, "max_position_limit", _I32, _RW, "Highest position allowed; above it EMCY 0xFF09.",
              default=0x7FFF_FFFF, unit="qc"),
    ObjectDef(0x607F, 0, "max_profile_velocity", _U32, _RW, "Highest speed of any profile.",
              default=25000, unit="rpm", low=0, high=25000),
    ObjectDef(0x6081, 0, "profile_velocity", _U32, _RW, "Speed in the middle of a profile position move.",
              default=1000, unit="rpm"),
    ObjectDef(0x6083, 0, "profile_acceleration", _U32, _RW, "Ramp up of profile position and profile velocity mode.",
              default=10000, unit="rpm/s"),
    ObjectDef(0x6084, 0, "profile_deceleration", _U32, _RW, "Ramp down of both modes, and of halt.",
              default=10000, unit="rpm/s"),
    ObjectDef(0x6085, 0, "quick_stop_deceleration", _U32, _RW,
              "Ramp down of quick stop, of faults of class Q and after loss of the master.",
              default=10000, unit="rpm/s",
              cause="Too high: wheels slip and the supply sees over-voltage. Too low: a long way to stop.",
              cure="Set it to what tyre, supply and current limit allow."),
    ObjectDef(0x6086, 0, "motion_profile_type", _I16, _RW, "Shape of the ramps: 0, trapezoidal, is the only one.",
              default=0, unit="code", low=0, high=0),
    ObjectDef(0x6089, 0, "position_notation_index", _I8, _RW, f"Power of ten of positions. {_FIXED_UNIT}",
              default=0, low=0, high=0),
    ObjectDef(0x608A, 0, "position_dimension_index", _U8, _RW, f"Unit of positions, 0xAC for qc. {_FIXED_UNIT}",
              default=0xAC, low=0xAC, high=0xAC),
    ObjectDef(0x608B, 0, "velocity_notation_index", _I8, _RW, f"Power of ten of velocities. {_FIXED_UNIT}",
              default=0, low=0, high=0),
    ObjectDef(0x608C, 0, "velocity_dimension_index", _U8, _RW, f"Unit of velocities, 0xA4 for rpm. {_FIXED_UNIT}",
              default=0xA4, low=0xA4, high=0xA4),
    ObjectDef(0x608D, 0, "acceleration_notation_index", _I8, _RW, f"Power of ten of accelerations. {_FIXED_UNIT}",
              default=0, low=0, high=0),
    ObjectDef(0x608E, 0, "acceleration_dimension_index", _U8, _RW,
              f"Unit of accelerations, 0xA4 for rpm/s. {_FIXED_UNIT}", default=0xA4, low=0xA4, high=0xA4),
    ObjectDef(0x6098, 0, "homing_method", _I8, _RW,
              "How home is found: 35 takes the present position, 33 and 34 the index, below 0 a stop by its current.",
              default=7, unit="code", low=-4, high=35),
    highest_sub_index(0x6099, "homing_speed", 2),
    ObjectDef(0x6099, 1, "homing_speed_switch_search", _U32, _RW, "Speed while looking for the switch or stop.",
              default=100, unit="rpm"),
    ObjectDef(0x6099, 2, "homing_speed_zero_search", _U32, _RW, "Speed while looking for the edge or index.",
              default=10, unit="rpm"),
    ObjectDef(0x609A, 0, "homing_acceleration", _U32, _RW, "Ramp of homing, up and down, and of halt in it.",
              default=1000, unit="rpm/s"),
    highest_sub_index(0x60F6, "current_regulator", 2),
    ObjectDef(0x60F6, 1, "current_regulator_p_gain", _I16, _RW, "Proportional gain of the current regulator.",
              low=0, high=32767),
    ObjectDef(0x60F6, 2, "current_regulator_i_gain", _I16, _RW, "Integral gain of the current regulator.",
              low=0, high=32767),
    highest_sub_index(0x60F9, "velocity_regulator", 2),
    ObjectDef(0x60F9, 1, "velocity_regulator_p_gain", _I16, _RW, "Proportional gain of the velocity regulator.",
              low=0, high=32767),
    ObjectDef(0x60F9, 2, "velocity_regulator_i_gain", _I16, _RW, "Integral gain of the velocity regulator.",
              low=0, high=32767),
    highest_sub_index(0x60FB, "position_regulator", 3),
    ObjectDef(0x60FB, 1, "position_regulator_p_gain", _I16, _RW, "Proportional gain of the position regulator.",
              low=0, high=32767),
    ObjectDef(0x60FB, 2, "position_regulator_i_gain", _I16, _RW, "Integral gain of the position regulator.",
              low=0, high=32767),
    ObjectDef(0x60FB, 3, "position_regulator_d_gain", _I16, _RW, "Differential gain of the position regulator.",
              low=0, high=32767),
    ObjectDef(0x60FB, 4, "velocity_feed_forward", _U16, _RW, "Share of the demanded speed in the regulator's output.",
              default=0, pdo="rx", firmware="later"),
    ObjectDef(0x60FB, 5, "acceleration_feed_forward", _U16, _RW,
              "Share of the demanded acceleration in the regulator's output.", default=0, pdo="rx", firmware="later"),
    ObjectDef(0x60FF, 0, "target_velocity", _I32, _RW,
              "Target of profile velocity mode. It is kept while the drive is disabled and acts when it is enabled.",
              unit="rpm", pdo="rx",
              cause="Not 0 before enabling: the motor starts at once.", cure="Write 0 before each enable."),
    ObjectDef(0x6402, 0, "motor_type", _U16, _RW,
              f"1 brushed DC, 10 brushless with sine, 11 with block commutation. {_RESTART}", default=10, unit="code",
              cause="Not the motor's kind: it does not turn, or draws too much current.",
              cure="Set it to the motor's kind, save, restart."),
    highest_sub_index(0x6410, "motor_data", 5),
    ObjectDef(0x6410, 1, "continuous_current_limit", _U16, _RW, "Current that the motor may draw for ever.",
              unit="mA", low=0, high=5000,
              cause="Above the motor's nominal current: its winding may burn.", cure="Set it from the motor's data."),
    ObjectDef(0x6410, 2, "output_current_limit", _U16, _RW,
              "Highest current at any time; twice the continuous limit is recommended.", unit="mA", low=0, high=10000,
              cause="Too low: the axis cannot follow its ramps.", cure="Set it from mass, ramp and torque constant."),
    ObjectDef(0x6410, 3, "pole_pairs", _U8, _RW, "Pole pairs of a brushless motor.", default=1, low=1, high=255),
    ObjectDef(0x6410, 4, "max_speed_in_current_mode", _U16, _RW, "Speed that raises EMCY 0xFF05.",
              default=30000, unit="rpm"),
    ObjectDef(0x6410, 5, "thermal_time_constant_winding", _U16, _RW,
              "How long the winding may carry more than its continuous current.",
              default=40, unit="100 ms", low=1, high=13107),
    ObjectDef(0x6502, 0, "supported_drive_modes", _U32, _CONST,
              "Modes that the drive has: bit 0 profile position, 2 profile velocity, 5 homing, 16 position, "
              "17 velocity, 18 current, 19 diagnostic.", default=0xF0025),
)

_IN_ORDER = (
    0x1000, 0x1001, 0x1003, 0x1005, 0x1008, 0x100C, 0x100D, 0x1010, 0x1011, 0x1014, 0x1018, 0x1200,
    0x1400, 0x1401, 0x1402, 0x1600, 0x1601, 0x1602, 0x1800, 0x1801, 0x1802, 0x1A00, 0x1A01, 0x1A02,
    0x2000, 0x2001, 0x2002, 0x2003, 0x2008, 0x2020, 0x2021, 0x2022, 0x2027, 0x2028, 0x2030, 0x2062, 0x206B,
    0x2070, 0x2071, 0x2074, 0x2078, 0x2079, 0x207C, 0x2080, 0x2081, 0x2210, 0x2300, 0x6040, 0x6041, 0x6060,
)
# fmt: on

_SECTIONS = {index: section for section, index in enumerate(_IN_ORDER, 1)} | {
    index: section for section, index in enumerate((0x6098, 0x6099, 0x609A, 0x60F6, 0x60F9, 0x60FB, 0x60FF, 0x6402), 75)
}
"""Sections of chapter 14.1 of the firmware specification, which describes the objects by rising index."""


def _source(entry: ObjectDef) -> str:
    if entry.firmware == "later":
        return "later EPOS firmware; probe before use"
    if entry.index in _SECTIONS:
        return f"maxon EPOS Firmware Specification 14.1.{_SECTIONS[entry.index]}"
    if entry.index < 0x6000:
        return "maxon EDS of the EPOS 24/5, firmware 2011h"
    return "maxon EPOS Firmware Specification 14.1"


_ENTRIES = COMMUNICATION_AREA + _SYSTEM + _RECORDER + _SENSORS + _SET_VALUES_AND_PINS + _DRIVE_PROFILE

OBJECTS = ObjectTable(
    tuple(
        replace(entry, source=_source(entry)) for entry in sorted(_ENTRIES, key=lambda entry: (entry.index, entry.sub))
    )
)
