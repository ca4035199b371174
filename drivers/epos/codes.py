"""Codes of the EPOS 24/5 with cause and cure: emergencies, gateway aborts, and what the values of objects stand for."""

from __future__ import annotations

from drivers.canopen.objects import CodeDef


def _table(*codes: CodeDef) -> dict[int, CodeDef]:
    return {entry.code: entry for entry in codes}


_EMERGENCY = "maxon EPOS Firmware Specification 12.1"
_LATER = "firmware later than 2011h; the reaction is not documented"

EMERGENCIES = _table(
    CodeDef(
        0x0000,
        "no error",
        "All errors of the node are gone.",
        "A fault was reset, or its cause went away.",
        "Nothing to do; command the drive again when it shall move.",
        register=0x00,
        source="CiA 301 7.2.7",
    ),
    CodeDef(
        0x1000,
        "generic error",
        "An error that the drive cannot name.",
        "A fault inside the drive.",
        "Reset the fault; if it comes back, restart the drive, then have it repaired.",
        register=0x02,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x2310,
        "over-current",
        "The current in the power stage was too high.",
        "Short circuit in the motor or its cable, current regulator tuned too hard, or too much acceleration.",
        "Check cable and winding; tune the current regulator (0x60F6); lower the output current limit (0x6410/2).",
        register=0x02,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x3210,
        "over-voltage",
        "The supply voltage is too high.",
        "Braking feeds energy back that the supply cannot take, or the supply is set too high.",
        "Brake more gently (0x6084, 0x6085), add a capacitor or a shunt regulator, check the supply voltage.",
        register=0x04,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x3220,
        "under-voltage",
        "The supply voltage is too low.",
        "Motor power is switched off (emergency stop, empty battery), or the supply breaks down under load.",
        "Switch motor power on, check battery, fuse and cable; accelerate more gently; then reset the fault.",
        register=0x04,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x4210,
        "over-temperature",
        "The power stage is too hot.",
        "More continuous current than the cooling can take, or too warm surroundings.",
        "Let it cool down, lower the continuous current limit (0x6410/1), improve the cooling.",
        register=0x08,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x5113,
        "internal 5 V supply low",
        "The drive's own 5 V supply is too low.",
        "Encoder or hall sensors draw too much, or their cable has a short circuit.",
        "Unplug the sensor cable and reset: if the fault stays away, repair the cable or the sensor.",
        register=0x04,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x6100,
        "internal software error",
        "The firmware stopped at an inner error.",
        "A fault of the firmware or its memory.",
        "Restart the drive; if it comes back, note the firmware (0x2003/1) and ask the maker.",
        register=0x20,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x6320,
        "software parameter error",
        "A motion cannot be computed from the parameters given.",
        "The target is too far away for so low a profile velocity or acceleration, or a parameter contradicts another.",
        "Raise profile velocity or acceleration (0x6081, 0x6083), or shorten the way; then reset the fault.",
        register=0x20,
        reaction="Q",
        source=_EMERGENCY + " (maxon's error map gives class D)",
    ),
    CodeDef(
        0x7320,
        "position sensor error",
        "The position sensor cannot be trusted.",
        "Its parameters were changed (0x2210), its cable is broken, or hall sensors and encoder disagree.",
        "After a change of parameters: reset the fault. Else check the sensor's cable and its direction.",
        register=0x20,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x8110,
        "CAN overrun",
        "The drive lost CAN messages.",
        "More frames than the drive can read.",
        "Lower the cycle rate or the number of PDOs, then reset the fault.",
        register=0x10,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x8111,
        "CAN overrun, second cause",
        "The drive lost CAN messages.",
        "More frames than the drive can read.",
        "Lower the cycle rate or the number of PDOs, then reset the fault.",
        source=_LATER,
    ),
    CodeDef(
        0x8120,
        "CAN error passive",
        "The drive sees so many bus errors that it may no longer signal them.",
        "Termination missing, wrong bit rate at some node, cable broken, or no other node on the bus.",
        "Check both 120 ohm terminators, bit rates and cable; then NMT reset communication and reset the fault.",
        register=0x10,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x8130,
        "life guarding failed",
        "The drive has not been guarded for guard time x life time factor.",
        "The master stopped, hung or was cut off the bus.",
        "See why the master was late (canhelm status: late cycles, bus); then reset the fault.",
        register=0x10,
        reaction="Q",
        source=_EMERGENCY + ".12",
    ),
    CodeDef(
        0x8140,
        "recovered from bus-off",
        "The drive was off the bus and came back.",
        "Short circuit or disturbance on the CAN wires.",
        "Check cable, shield and termination; then reset the fault.",
        source="maxon error map of firmware 2011h; the reaction is not documented",
    ),
    CodeDef(
        0x8150,
        "COB-ID collision",
        "Another node sends with an identifier of this drive.",
        "Two nodes with one node id, or PDOs left at the factory identifiers of node 1.",
        "Give each node its own id (DIP switches) and its own PDO identifiers (0x18nn/1, or 0x1011/5).",
        source=_LATER,
    ),
    CodeDef(
        0x81FD,
        "CAN bus-off",
        "The drive's CAN controller took itself off the bus after too many errors.",
        "Short circuit of the CAN wires, wrong bit rate, or no termination.",
        "Mend the cable or the bit rate, restart the drive, then reset the fault.",
        register=0x10,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x81FE,
        "CAN receive queue overrun",
        "The drive could not read received messages in time.",
        "Bursts of frames with the drive's identifiers.",
        "Lower the cycle rate; spread SDO traffic over time; then reset the fault.",
        register=0x10,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x81FF,
        "CAN transmit queue overrun",
        "The drive could not get its messages on the bus in time.",
        "Bus load too high, or nobody acknowledges.",
        "Lower the bus load, check that other nodes are there; then reset the fault.",
        register=0x10,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0x8210,
        "PDO length error",
        "A received PDO is shorter than its mapping.",
        "Master and drive do not agree about the mapping.",
        "Configure the drive again so that both use the same mapping.",
        source=_LATER,
    ),
    CodeDef(
        0x8611,
        "following error",
        "The position is further from its demand than 0x6065 allows.",
        "Axis blocked or brake engaged, current limit too low, ramp too steep, or encoder counting backwards.",
        "Free the axis, release the brake, lower acceleration, or widen 0x6065; then reset the fault.",
        register=0x20,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF01,
        "hall sensor error",
        "The hall sensors show a pattern that cannot be.",
        "A hall wire is broken or disturbed.",
        "Check hall cable and shield (0x2022 shows the pattern), then reset the fault.",
        register=0x80,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF02,
        "index processing error",
        "The encoder's index pulse does not fit its count.",
        "Index wire broken, disturbed counts, or the wrong number of pulses (0x2210/1).",
        "Check the encoder cable; for an encoder without index set 0x2210/2 to 2; then reset the fault.",
        register=0x80,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF03,
        "encoder resolution error",
        "The number of counts a turn is not what was set.",
        "Wrong number of pulses (0x2210/1) or of pole pairs (0x6410/3).",
        "Set both to the motor's data, save, restart the drive.",
        register=0x80,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF04,
        "no hall sensor found",
        "No hall sensor is connected.",
        "Hall cable unplugged, or the motor has none.",
        "Plug the cable in or set motor and sensor type right (0x6402, 0x2210/2); then NMT reset node.",
        register=0x80,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF05,
        "over-speed",
        "The motor turned faster than 0x6410/4 allows.",
        "Current mode without load, or the encoder counts too many pulses.",
        "Lower the current set value, raise 0x6410/4 if the motor may turn faster; then reset the fault.",
        register=0x80,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF06,
        "negative limit switch",
        "The axis ran into its negative limit switch.",
        "Target beyond the travel, lost reference, or a wrong polarity (0x2071/3).",
        "Reset the fault and drive off the switch in positive direction; reference the axis again.",
        register=0x80,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF07,
        "positive limit switch",
        "The axis ran into its positive limit switch.",
        "Target beyond the travel, lost reference, or a wrong polarity (0x2071/3).",
        "Reset the fault and drive off the switch in negative direction; reference the axis again.",
        register=0x80,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF08,
        "hall angle detection error",
        "The angle from the hall sensors and the one from the encoder differ.",
        "Encoder slips on the shaft, wrong number of pulses or pole pairs, or swapped wires.",
        "Check 0x2210/1 and 0x6410/3, the wiring order of halls and windings, and the encoder's seat.",
        register=0x80,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF09,
        "software position limit",
        "The position is beyond a limit of 0x607D.",
        "Target beyond the limit, or lost reference.",
        "Reset the fault and drive back inside the limits; correct 0x607D where they are wrong.",
        register=0x80,
        reaction="Q",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF0A,
        "position sensor breach",
        "The drive is driving and no position change is seen.",
        "Encoder cable broken or axis blocked.",
        "Check the encoder and free the axis; 0x2008 bit 0 switches this supervision off.",
        register=0x80,
        reaction="D",
        source=_EMERGENCY,
    ),
    CodeDef(
        0xFF0B,
        "system overloaded",
        "The drive's processor has too much to do.",
        "Too much communication for the chosen mode.",
        "Lower the cycle rate or the number of PDOs, then reset the fault.",
        source=_LATER,
    ),
)
"""Emergency codes of firmware 2011h and later, by code. An unknown code is possible: treat it as a fault of its own."""

GATEWAY_ABORTS = _table(
    CodeDef(
        0x0F00FFC0,
        "wrong NMT state",
        "The device is in the wrong NMT state for this access.",
        "The node is stopped, or operational where it should be pre-operational.",
        "Send the NMT command that the access needs (pre-operational for mappings), then try again.",
        source="maxon EPOS Firmware Specification 12.3.27",
    ),
    CodeDef(
        0x0F00FFBF,
        "illegal RS-232 command",
        "The drive does not know this serial command.",
        "Operation code of another EPOS generation, or a damaged frame.",
        "Use the commands of the first EPOS generation; check baud rate and cable.",
        source="maxon EPOS Firmware Specification 12.3.28",
    ),
    CodeDef(
        0x0F00FFBE,
        "wrong password",
        "The access needs a password and got a wrong one.",
        "The object belongs to the maker's service.",
        "Leave this object alone.",
        source="maxon EPOS Firmware Specification 12.3.29",
    ),
    CodeDef(
        0x0F00FFBC,
        "not in service mode",
        "The access works in service mode only.",
        "The object belongs to the maker's service.",
        "Leave this object alone.",
        source="maxon EPOS Firmware Specification 12.3.30",
    ),
    CodeDef(
        0x0F00FFB9,
        "wrong node id",
        "There is no node with this id behind the gateway.",
        "Wrong node id, or the node is off or at another bit rate.",
        "Check DIP switches, power and bit rate of the node that was meant.",
        source="maxon EPOS Firmware Specification 12.3.31",
    ),
)
"""Abort codes of maxon's own, seen on RS-232 and through a gateway."""

# What the values of configuration objects stand for.

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
