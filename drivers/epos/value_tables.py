"""What the values of configuration objects of the EPOS 24/5 stand for."""

from __future__ import annotations

CAN_BIT_RATES = {0: 1_000_000, 1: 800_000, 2: 500_000, 3: 250_000, 4: 125_000, 5: 50_000, 6: 20_000}
"""Object 0x2001, in bit/s."""

RS232_BAUD_RATES = {0: 9600, 1: 14400, 2: 19200, 3: 38400, 4: 57600, 5: 115200}
"""Object 0x2002, in bit/s (maxon EPOS Firmware Specification 14.1.27)."""

MOTOR_TYPES = {1: "brushed DC", 10: "brushless, sine commutated", 11: "brushless, block commutated"}
"""Object 0x6402 (maxon EPOS Firmware Specification 14.1.82)."""

POSITION_SENSOR_TYPES = {1: "encoder with index", 2: "encoder without index", 3: "hall sensors"}
"""Object 0x2210/2 (maxon EPOS Firmware Specification 14.1.46)."""

HOMING_METHODS = {
    0: "no homing needed",
    1: "negative limit switch, then index",
    2: "positive limit switch, then index",
    7: "home switch at positive speed, then index",
    11: "home switch at negative speed, then index",
    17: "negative limit switch",
    18: "positive limit switch",
    23: "home switch at positive speed",
    27: "home switch at negative speed",
    33: "index at negative speed",
    34: "index at positive speed",
    35: "present position",
    -1: "current threshold at positive speed, then index",
    -2: "current threshold at negative speed, then index",
    -3: "current threshold at positive speed",
    -4: "current threshold at negative speed",
}
"""Object 0x6098 (maxon EPOS Firmware Specification 14.1.75)."""

DIGITAL_INPUT_FUNCTIONS = {
    0: "negative limit switch",
    1: "positive limit switch",
    2: "home switch",
    3: "position marker",
    4: "device enable",
    8: "general purpose H (EPOS 70/10)",
    9: "general purpose G (EPOS 70/10)",
    10: "general purpose F",
    11: "general purpose E",
    12: "general purpose D",
    13: "general purpose C",
    14: "general purpose B",
    15: "general purpose A",
}
"""Objects 0x2070/n, and bits of 0x2071 (maxon EPOS Firmware Specification 14.1.38)."""

DIGITAL_OUTPUT_FUNCTIONS = {
    0: "ready (active) or fault",
    12: "general purpose D",
    13: "general purpose C",
    14: "general purpose B",
    15: "general purpose A",
}
"""Objects 0x2079/n, and bits of 0x2078 (maxon EPOS Firmware Specification 14.1.41, 14.1.42)."""

VALUE_TABLES: dict[str, dict[int, str]] = {
    "can_bit_rate_code": {code: f"{rate} bit/s" for code, rate in CAN_BIT_RATES.items()},
    "rs232_baud_rate_code": {code: f"{rate} bit/s" for code, rate in RS232_BAUD_RATES.items()},
    "motor_type": MOTOR_TYPES,
    "position_sensor_type": POSITION_SENSOR_TYPES,
    "homing_method": HOMING_METHODS,
    "capture_edge": {0: "both edges", 1: "rising edge", 2: "falling edge"},
    **{f"function_of_digital_input_{pin}": DIGITAL_INPUT_FUNCTIONS for pin in range(1, 7)},
    **{f"function_of_digital_output_{pin}": DIGITAL_OUTPUT_FUNCTIONS for pin in range(1, 5)},
}
"""For objects whose values are codes: what each value means, by the object's name."""
