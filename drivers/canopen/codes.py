"""Codes of CiA 301 with cause and cure: SDO aborts, NMT commands and states, the error register."""

from __future__ import annotations

from enum import IntEnum

from drivers.canopen.objects import BitDef, CodeDef


class NmtCommand(IntEnum):
    """Command byte of an NMT frame (CiA 301, 7.2.8.3)."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


class NmtState(IntEnum):
    """State byte of a boot-up message, a guarding answer or a heartbeat, its toggle bit taken off."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


def _table(source: str, *codes: CodeDef) -> dict[int, CodeDef]:
    return {
        entry.code: CodeDef(entry.code, entry.name, entry.meaning, entry.cause, entry.cure, source=source)
        for entry in codes
    }


_PROTOCOL_CURE = (
    "Send the request again; if it happens again, look for a second SDO client or for lost frames on the bus."
)
_NO_BLOCK_CURE = "Use expedited or segmented transfer: the EPOS 24/5 offers no block transfer."
_STATE_CURE = "Take the node to pre-operational, or disable the drive, and write again."
_LIST_CURE = "Compare with the object dictionary (canhelm object show); later firmware has objects that older lacks."

SDO_ABORTS = _table(
    "CiA 301 7.2.4.3.17; maxon EPOS Communication Guide 6.4",
    CodeDef(
        0x05030000,
        "toggle bit not alternated",
        "A segment came with the toggle bit of the one before it.",
        "A segment was lost or repeated, or two clients share the SDO channel.",
        _PROTOCOL_CURE,
    ),
    CodeDef(
        0x05040000,
        "SDO time-out",
        "The transfer was given up because the next message did not come in time.",
        "The node is off, rebooting or overloaded; behind an RS-232 gateway: no such node on the CAN bus.",
        "Check power, node id and bit rate of the node, then try again.",
    ),
    CodeDef(
        0x05040001,
        "unknown command specifier",
        "The node does not know the command byte of the request.",
        "Block transfer was asked for, or the frame was damaged or is no SDO request.",
        _NO_BLOCK_CURE,
    ),
    CodeDef(
        0x05040002,
        "invalid block size",
        "The block size of a block transfer is out of range.",
        "The client offered 0 or more than 127 segments a block.",
        _NO_BLOCK_CURE,
    ),
    CodeDef(
        0x05040003,
        "invalid sequence number",
        "A segment of a block transfer came out of order.",
        "A segment was lost or overtaken on the way.",
        _NO_BLOCK_CURE,
    ),
    CodeDef(
        0x05040004,
        "block CRC error",
        "The checksum over a block transfer does not match.",
        "Data was lost or changed on the way.",
        _NO_BLOCK_CURE,
    ),
    CodeDef(
        0x05040005,
        "out of memory",
        "The node has no memory left for the transfer.",
        "The data is longer than the node can take.",
        "Write less data, or restart the node.",
    ),
    CodeDef(
        0x06010000,
        "access not supported",
        "This object cannot be accessed in this way.",
        "A record was accessed as a whole, or the object cannot be changed now (a PDO mapping that is in use).",
        "Access one sub-index; set the number of mapped objects to 0 before changing a mapping.",
    ),
    CodeDef(
        0x06010001,
        "object is write-only",
        "A write-only object was read.",
        "The object has no value to read.",
        "Do not read it; its effect shows in other objects.",
    ),
    CodeDef(
        0x06010002,
        "object is read-only",
        "A read-only object was written.",
        "The object is a measured value or a constant, or the firmware fixes it (mapping of RPDO3 and TPDO3).",
        "Do not write it; look for the object that sets this value (canhelm object list).",
    ),
    CodeDef(
        0x06020000,
        "no such object",
        "The node has no object with this index.",
        "Wrong index, another kind of device, or firmware without this object.",
        _LIST_CURE,
    ),
    CodeDef(
        0x06040041,
        "object cannot be mapped",
        "The object may not be mapped to this PDO.",
        "It is not in the firmware's list of mappable objects, or it has the wrong direction.",
        "Map another object, or transfer this one by SDO.",
    ),
    CodeDef(
        0x06040042,
        "mapping exceeds the PDO",
        "The mapped objects are longer than the PDO allows.",
        "More than 8 bytes, or more than four objects.",
        "Map fewer objects, and spread them over two PDOs.",
    ),
    CodeDef(
        0x06040043,
        "parameter incompatibility",
        "The value does not go together with other parameters.",
        "Another object has to be changed first.",
        "Read the objects that belong together and write them in the order of the manual.",
    ),
    CodeDef(
        0x06040047,
        "internal incompatibility",
        "The node cannot do this for a reason inside it.",
        "Settings contradict each other, or the firmware is in the wrong mode.",
        "Restart the node; if it stays, restore the default parameters (0x1011/1) and set it up again.",
    ),
    CodeDef(
        0x06060000,
        "hardware error",
        "The access failed because of a hardware error.",
        "The non-volatile memory or a sensor does not answer.",
        "Read the error history (0x1003), restart the node; if it stays, have the device repaired.",
    ),
    CodeDef(
        0x06070010,
        "wrong length",
        "The data has another length than the object.",
        "The object was written with the wrong data type.",
        "Write it with the type of the object dictionary (canhelm object show).",
    ),
    CodeDef(
        0x06070012,
        "data too long",
        "The data is longer than the object.",
        "The object was written with too large a data type.",
        "Write it with the type of the object dictionary (canhelm object show).",
    ),
    CodeDef(
        0x06070013,
        "data too short",
        "The data is shorter than the object.",
        "The object was written with too small a data type.",
        "Write it with the type of the object dictionary (canhelm object show).",
    ),
    CodeDef(
        0x06090011,
        "no such sub-index",
        "The object exists, but not with this sub-index.",
        "Wrong sub-index, or firmware without this entry.",
        _LIST_CURE,
    ),
    CodeDef(
        0x06090030,
        "value out of range",
        "The value is not allowed for this object.",
        "It is beyond a limit, or no code that the object knows.",
        "Write a value within the limits of the object dictionary (canhelm object show).",
    ),
    CodeDef(
        0x06090031,
        "value too high",
        "The value is above the object's upper limit.",
        "Wrong unit (rpm, qc, mA), or a limit object is set lower.",
        "Write a smaller value, or raise the limit that the drive allows.",
    ),
    CodeDef(
        0x06090032,
        "value too low",
        "The value is below the object's lower limit.",
        "Wrong unit (rpm, qc, mA) or sign, or a limit object is set higher.",
        "Write a larger value, or lower the limit that the drive allows.",
    ),
    CodeDef(
        0x06090036,
        "maximum below minimum",
        "The maximum would be less than the minimum.",
        "Two limits that belong together were written in the wrong order.",
        "Write the limit that widens the range first.",
    ),
    CodeDef(
        0x060A0023,
        "no SDO connection",
        "A resource for the SDO connection is not available.",
        "Another client uses the channel.",
        "Wait until the other client is done, or stop it.",
    ),
    CodeDef(
        0x08000000,
        "general error",
        "The access failed for a reason that the node does not tell.",
        "Anything; often a request at a moment when the node is busy.",
        "Read the error register (0x1001) and the error history (0x1003), then try again.",
    ),
    CodeDef(
        0x08000020,
        "cannot transfer or store",
        "The data cannot be taken over or stored.",
        "Wrong signature on save or load, or the non-volatile memory is busy or worn out.",
        "Write 'save' or 'load' exactly, with the drive disabled; try again after a second.",
    ),
    CodeDef(
        0x08000021,
        "refused by local control",
        "The data cannot be taken over because the device is controlled locally.",
        "A service tool or an input has control.",
        "Close the service tool, or switch the device to remote control.",
    ),
    CodeDef(
        0x08000022,
        "refused in this state",
        "The data cannot be taken over in the present device state.",
        "Mapping or configuration was written while the node is operational or the drive enabled.",
        _STATE_CURE,
    ),
    CodeDef(
        0x08000023,
        "no object dictionary",
        "The node has no object dictionary, or could not build it.",
        "Damaged firmware or parameter memory.",
        "Restart the node; if it stays, load the firmware again.",
    ),
    CodeDef(
        0x08000024,
        "no data",
        "There is nothing to read at the moment.",
        "The value was never produced, or was read already.",
        "Read again later.",
    ),
)
"""SDO abort codes by number."""

NMT_COMMANDS = _table(
    "CiA 301 7.2.8.3.1",
    CodeDef(NmtCommand.START, "start", "The node becomes operational: PDOs flow."),
    CodeDef(NmtCommand.STOP, "stop", "The node stops all communication except NMT and error control."),
    CodeDef(NmtCommand.ENTER_PRE_OPERATIONAL, "enter pre-operational", "SDOs only; the state for configuration."),
    CodeDef(NmtCommand.RESET_NODE, "reset node", "The node restarts as after power-up and sends a boot-up message."),
    CodeDef(NmtCommand.RESET_COMMUNICATION, "reset communication", "The node restarts its communication part only."),
)
"""NMT commands by command byte."""

NMT_STATES = _table(
    "CiA 301 7.3.2",
    CodeDef(
        NmtState.BOOT_UP,
        "boot-up",
        "The node has just started.",
        "Power-up, NMT reset, or an unexpected restart.",
        "In the middle of operation: check its supply; canhelm configures it again by itself.",
    ),
    CodeDef(
        NmtState.STOPPED,
        "stopped",
        "Only NMT and error control work; neither SDO nor PDO.",
        "It got NMT stop.",
        "Send NMT pre-operational or start to it.",
    ),
    CodeDef(NmtState.OPERATIONAL, "operational", "SDO and PDO work."),
    CodeDef(
        NmtState.PRE_OPERATIONAL,
        "pre-operational",
        "SDO works, PDOs are ignored and not sent.",
        "It has booted and nobody has started it, or it got NMT pre-operational.",
        "Configure it, then send NMT start to this node alone.",
    ),
)
"""NMT states by state byte without the toggle bit."""

ERROR_REGISTER_BITS: tuple[BitDef, ...] = (
    BitDef(0, "generic", "an error is present"),
    BitDef(1, "current", "current error"),
    BitDef(2, "voltage", "voltage error"),
    BitDef(3, "temperature", "temperature error"),
    BitDef(4, "communication", "communication error"),
    BitDef(5, "device_profile", "error of the device profile"),
    BitDef(6, "reserved", "reserved, always 0"),
    BitDef(7, "manufacturer", "manufacturer specific: motion or sensor error"),
)
"""Bits of the error register 0x1001 (CiA 301 7.5.2.2)."""

EMCY_CLASSES = {
    0x00: "no error",
    0x10: "generic error",
    0x20: "current",
    0x21: "current at the input side",
    0x22: "current inside the device",
    0x23: "current at the output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the device",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "temperature of the device",
    0x50: "device hardware",
    0x60: "device software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "data set",
    0x70: "additional modules",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol",
    0x90: "external error",
    0xF0: "additional functions",
    0xFF: "device specific",
}
"""What the high byte of any emergency code stands for (CiA 301 7.2.7.1)."""


def emcy_class(code: int) -> str:
    """What kind of error an emergency code is, known or not: by its high byte, else by the first digit of it."""
    high = code >> 8 & 0xFF
    return EMCY_CLASSES.get(high) or EMCY_CLASSES.get(high & 0xF0, "unknown kind")
