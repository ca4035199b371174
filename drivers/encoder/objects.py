"""The object dictionary of a CiA 406 encoder, as single-turn and multi-turn rotary encoders of several makers have it.

Resolution, ranges and identity differ from device to device and have no default here.
"""

from __future__ import annotations

from dataclasses import replace

from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable

_U8, _U16, _U32, _I32 = DataType.U8, DataType.U16, DataType.U32, DataType.I32
_RO, _RW, _CONST = Access.RO, Access.RW, Access.CONST

SINGLE_TURN = 0x0001_0196
"""Device type 0x1000 of a single-turn rotary encoder."""

MULTI_TURN = 0x0002_0196
"""Device type 0x1000 of a multi-turn rotary encoder."""

POSITION_ERROR = 0x5000
"""EMCY code that encoders send for a position or hardware error; 0x0000 follows when it is gone."""


def _count(index: int, name: str, count: int) -> ObjectDef:
    """Sub-index 0 of a record or array."""
    return ObjectDef(
        index, 0, f"{name}_highest_sub_index", _U8, _RO, "Highest sub-index of this object.", default=count
    )


def _tpdo(number: int, cob_id: int, transmission_type: int) -> tuple[ObjectDef, ...]:
    """Communication and mapping of a transmit PDO that carries the position value."""
    index, name = 0x17FF + number, f"tpdo{number}"
    sent = "cyclically by the event timer" if transmission_type > 240 else "after every SYNC"
    # fmt: off
    return (
        _count(index, name, 5),
        ObjectDef(index, 1, f"{name}_cob_id", _U32, _RW, f"Identifier of TPDO{number}; bit 31 set: not used.",
                  default=cob_id, plus_node_id=True),
        ObjectDef(index, 2, f"{name}_transmission_type", _U8, _RW,
                  f"When TPDO{number} is sent, by default {sent}: 1 after every SYNC, 254 and 255 by the event timer.",
                  default=transmission_type),
        ObjectDef(index, 3, f"{name}_inhibit_time", _U16, _RW, "Shortest time between two of its frames.",
                  default=0, unit="100 us"),
        ObjectDef(index, 5, f"{name}_event_timer", _U16, _RW,
                  "Period of cyclic sending; 0 is off. Tied to the cyclic timer 0x6200 for TPDO1.",
                  default=0, unit="ms"),
        ObjectDef(index + 0x200, 0, f"{name}_number_of_mapped_objects", _U8, _RO, "Objects in this PDO.", default=1),
        ObjectDef(index + 0x200, 1, f"{name}_mapping_entry_1", _U32, _RO, "Position value, 32 bits.",
                  default=0x6004_0020),
    )
    # fmt: on


# fmt: off
_COMMUNICATION = (
    ObjectDef(0x1000, 0, "device_type", _U32, _CONST,
              "Low word 0x0196: encoder profile CiA 406. High word: 1 single-turn, 2 multi-turn.", default=SINGLE_TURN,
              cause="Another low word: this is no encoder.", cure="Check node ids of encoders and drives."),
    ObjectDef(0x1001, 0, "error_register", _U8, _RO, "Kinds of errors that are present, one bit each.", default=0,
              cause="Any bit set: the encoder has an error.", cure="Read alarms (0x6503) and error history (0x1003)."),
    ObjectDef(0x1003, 0, "number_of_recorded_errors", _U8, _RW, "Entries in the error history; writing 0 clears it.",
              default=0, low=0, high=4),
    *(ObjectDef(0x1003, entry, f"error_history_entry_{entry}", _U32, _RO,
                f"Error history, entry {entry} of 4, the newest first; EMCY code in the low word.", default=0)
      for entry in range(1, 5)),
    ObjectDef(0x1005, 0, "cob_id_sync", _U32, _RW, "Identifier of SYNC.", default=0x80),
    ObjectDef(0x1008, 0, "device_name", DataType.VISIBLE_STRING, _CONST, "The maker's name of the device."),
    ObjectDef(0x100C, 0, "guard_time", _U16, _RW, "Time between two guard requests; 0 is off.", default=0, unit="ms"),
    ObjectDef(0x100D, 0, "life_time_factor", _U8, _RW,
              "Guard times without a request after which the encoder declares its master lost; 0 is off.", default=0),
    _count(0x1010, "store", 1),
    ObjectDef(0x1010, 1, "save_all_parameters", _U32, _RW, "Writing 0x65766173 ('save') keeps all parameters."),
    _count(0x1011, "restore", 1),
    ObjectDef(0x1011, 1, "restore_all_defaults", _U32, _RW,
              "Writing 0x64616F6C ('load') restores the factory values at the next start."),
    ObjectDef(0x1014, 0, "cob_id_emcy", _U32, _RO, "Identifier of the emergency message.",
              default=0x80, plus_node_id=True),
    ObjectDef(0x1017, 0, "producer_heartbeat_time", _U16, _RW, "Period of the heartbeat; 0 is off.",
              default=0, unit="ms"),
    _count(0x1018, "identity", 4),
    ObjectDef(0x1018, 1, "vendor_id", _U32, _RO, "Who made it, by the number CiA gave."),
    ObjectDef(0x1018, 2, "product_code", _U32, _RO, "What it is, by the maker's number."),
    ObjectDef(0x1018, 3, "revision_number", _U32, _RO, "Its revision."),
    ObjectDef(0x1018, 4, "identity_serial_number", _U32, _RO, "Its serial number."),
    _count(0x1200, "sdo_server", 2),
    ObjectDef(0x1200, 1, "cob_id_sdo_client_to_server", _U32, _RO, "Identifier of SDO requests to the encoder.",
              default=0x600, plus_node_id=True),
    ObjectDef(0x1200, 2, "cob_id_sdo_server_to_client", _U32, _RO, "Identifier of the encoder's SDO answers.",
              default=0x580, plus_node_id=True),
    *_tpdo(1, 0x180, 254),
    *_tpdo(2, 0x280, 1),
)

_PROFILE = (
    ObjectDef(0x6000, 0, "operating_parameters", _U16, _RW,
              "Bit 0 code direction (0: counts up clockwise), bit 1 commissioning diagnostics, bit 2 scaling on, "
              "bit 3 measuring direction, bits 12 to 15 of the maker.", default=0),
    ObjectDef(0x6001, 0, "measuring_units_per_turn", _U32, _RW, "Counts of one turn while scaling is on.",
              unit="counts"),
    ObjectDef(0x6002, 0, "total_measuring_range", _U32, _RW,
              "Counts until the value wraps to 0 while scaling is on.", unit="counts"),
    ObjectDef(0x6003, 0, "preset_value", _U32, _RW,
              "The present position becomes this value; 0x6509 tells the offset that results.", unit="counts"),
    ObjectDef(0x6004, 0, "position_value", _U32, _RO, "Position, from 0 up to the range; then it wraps.",
              unit="counts", pdo="tx"),
    ObjectDef(0x6200, 0, "cyclic_timer", _U16, _RW, "Period of the cyclic position PDO (TPDO1); 0 is off.",
              default=0, unit="ms"),
    ObjectDef(0x6500, 0, "operating_status", _U16, _RO, "The operating parameters that are in force, bits as 0x6000.",
              default=0),
    ObjectDef(0x6501, 0, "single_turn_resolution", _U32, _RO, "Counts of one turn of the sensor itself.",
              unit="counts"),
    ObjectDef(0x6502, 0, "number_of_turns", _U16, _RO, "Turns that the sensor can tell apart; 1 for single-turn."),
    ObjectDef(0x6503, 0, "alarms", _U16, _RO, "Bit 0 position error, bits 12 to 15 of the maker.", default=0, pdo="tx",
              cause="Bit 0: the sensor cannot tell its position (magnet or disc, supply, contamination).",
              cure="Do not use the position; restart the encoder, then have it replaced; preset it again."),
    ObjectDef(0x6504, 0, "supported_alarms", _U16, _RO, "The alarms that this encoder can raise, bits as 0x6503.",
              default=0x0001),
    ObjectDef(0x6505, 0, "warnings", _U16, _RO, "Bit 2 watchdog restarted it, bit 4 battery low.", default=0, pdo="tx",
              cause="Bit 2: supply dips or disturbance. Bit 4: the battery that counts turns is nearly empty.",
              cure="Check the supply; change the battery while the encoder is powered, then check the position."),
    ObjectDef(0x6506, 0, "supported_warnings", _U16, _RO, "The warnings that this encoder can raise, bits as 0x6505.",
              default=0),
    ObjectDef(0x6507, 0, "profile_and_software_version", _U32, _RO,
              "Version of the profile in the low word, of the software in the high word."),
    ObjectDef(0x6508, 0, "operating_time", _U32, _RO, "Time in operation; 0xFFFFFFFF where it is not counted.",
              default=0xFFFF_FFFF, unit="0.1 h"),
    ObjectDef(0x6509, 0, "offset_value", _I32, _RO, "Offset that the last preset led to.", default=0, unit="counts"),
)
# fmt: on

OBJECTS = ObjectTable(
    tuple(replace(entry, source="CiA 301 7.5.2") for entry in _COMMUNICATION)
    + tuple(replace(entry, source="CiA 406") for entry in _PROFILE)
)
