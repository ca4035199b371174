"""Process data of the EPOS 24/5 as canhelm maps it: pure bytes.

TPDO1 and RPDO1 go with SYNC; RPDO3, whose mapping is fixed (maxon EPOS Firmware Specification 14.1.18), counts at once.
"""

from __future__ import annotations

from drivers.canopen.pdo import pdo_struct
from drivers.epos.objects import OBJECTS
from drivers.epos.state_machine import Mode

TPDO1_MAP = (OBJECTS["statusword"], OBJECTS["position_actual_value"], OBJECTS["current_actual_value"])
TPDO1 = pdo_struct(TPDO1_MAP)
TPDO1_BYTES = TPDO1.size

TPDO2_MAP = tuple(OBJECTS[name] for name in ("analog_input_1", "analog_input_2", "digital_input_functions_state"))
"""Where a profile asks for the analog inputs, or has an emergency stop at a digital one."""
TPDO2 = pdo_struct(TPDO2_MAP)

TARGET_OBJECT = {
    Mode.PROFILE_VELOCITY: OBJECTS["target_velocity"],
    Mode.VELOCITY: OBJECTS["velocity_mode_setting_value"],
    Mode.PROFILE_POSITION: OBJECTS["target_position"],
}
"""Where the target of a driving mode is written to: a speed in rpm, or a position in qc."""

RPDO1_MAPS = {mode: (OBJECTS["controlword"], target) for mode, target in TARGET_OBJECT.items()}
RPDO1 = pdo_struct(RPDO1_MAPS[Mode.PROFILE_VELOCITY])
RPDO3 = pdo_struct((OBJECTS["controlword"], OBJECTS["mode_of_operation"]))

DRIVING_MODES = {
    "profile_velocity": Mode.PROFILE_VELOCITY,
    "velocity": Mode.VELOCITY,
    "expiring_position": Mode.PROFILE_POSITION,
}
"""Modes for driving by their name in a profile."""


def make_rpdo3(controlword: int, mode: int) -> bytes:
    """Controlword and mode of operation."""
    return RPDO3.pack(controlword, mode)
