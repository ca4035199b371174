"""The communication area of the EPOS 24/5, indices below 0x2000: identity, errors, guarding, saving, SDO and PDOs.

Part of :data:`drivers.epos.objects.OBJECTS`.
"""

from __future__ import annotations

from drivers.canopen.objects import Access, DataType, ObjectDef

_U8, _U16, _U32 = DataType.U8, DataType.U16, DataType.U32
_RO, _RW, _CONST = Access.RO, Access.RW, Access.CONST


def highest_sub_index(index: int, name: str, count: int) -> ObjectDef:
    """Sub-index 0 of a record or array."""
    return ObjectDef(
        index, 0, f"{name}_highest_sub_index", _U8, _RO, "Highest sub-index of this object.", default=count
    )


# fmt: off
def _mapping(index: int, pdo: str, access: Access, count: int, entries: tuple[int, ...]) -> tuple[ObjectDef, ...]:
    """The mapping record of a PDO: how many objects, and which."""
    return (
        ObjectDef(index, 0, f"{pdo}_number_of_mapped_objects", _U8, access,
                  f"How many objects {pdo.upper()} carries; write 0 before changing its entries, then the count.",
                  default=count, low=0, high=len(entries),
                  cause="A count that does not fit the entries: a mapping was changed half.",
                  cure="In pre-operational write 0, the entries, then the count; read all of them back."),
        *(ObjectDef(index, place, f"{pdo}_mapping_entry_{place}", _U32, access,
                    f"Object number {place} in {pdo.upper()}: index, sub-index, length in bits; 0 for none.",
                    default=entry)
          for place, entry in enumerate(entries, 1)),
    )


def _communication(index: int, pdo: str, cob_id: int, types: str) -> tuple[ObjectDef, ...]:
    """The communication record of a PDO: its identifier and when it is sent or applied."""
    return (
        highest_sub_index(index, pdo, 2),
        ObjectDef(index, 1, f"{pdo}_cob_id", _U32, _RW,
                  f"Identifier of {pdo.upper()}. The factory value is the one of node 1 on every drive.",
                  default=cob_id,
                  cause="A factory value on a node other than 1: it shares its identifiers with other drives.",
                  cure="Write the identifier with the node's own id, or 'load' to 0x1011/5, save and restart."),
        ObjectDef(index, 2, f"{pdo}_transmission_type", _U8, _RW, f"When {pdo.upper()} counts: {types}.", default=255),
    )


def _rpdo(number: int, access: Access, count: int, entries: tuple[int, ...]) -> tuple[ObjectDef, ...]:
    types = "1 applied at the next SYNC, 255 applied at once"
    return (
        *_communication(0x13FF + number, f"rpdo{number}", 0x101 + 0x100 * number, types),
        *_mapping(0x15FF + number, f"rpdo{number}", access, count, entries),
    )


def _tpdo(number: int, access: Access, count: int, entries: tuple[int, ...]) -> tuple[ObjectDef, ...]:
    types = "1 sent after every SYNC, 255 sent on a remote request only"
    return (
        *_communication(0x17FF + number, f"tpdo{number}", 0x81 + 0x100 * number, types),
        _inhibit_time(number),
        *_mapping(0x19FF + number, f"tpdo{number}", access, count, entries),
    )


def _inhibit_time(number: int) -> ObjectDef:
    return ObjectDef(0x17FF + number, 3, f"tpdo{number}_inhibit_time", _U16, _RW,
                     f"Shortest time between two frames of TPDO{number}.", unit="100 us", firmware="later")


COMMUNICATION_AREA = (
    ObjectDef(0x1000, 0, "device_type", _U32, _CONST,
              "What kind of device this is: low word 0x0192 for the drive profile CiA 402.", default=0x200192,
              cause="Another value: the node is no EPOS.", cure="Check node ids of encoders and drives."),
    ObjectDef(0x1001, 0, "error_register", _U8, _RO, "Kinds of errors that are present, one bit each.", default=0,
              cause="Any bit set: the drive has a fault.", cure="Read the error history (0x1003), cure it, reset it."),
    ObjectDef(0x1003, 0, "number_of_recorded_errors", _U8, _RW,
              "Entries in the error history; writing 0 clears it, other values are refused.",
              default=0, low=0, high=5),
    *(ObjectDef(0x1003, entry, f"error_history_entry_{entry}", _U32, _RO,
                f"Error history, entry {entry} of 5, the newest first: an EMCY code in the low word.",
                default=0, unit="emcy code",
                cause="Not 0: an error came up since the history was cleared.",
                cure="Look the code up (canhelm explain CODE --as emcy), then write 0 to 0x1003.")
      for entry in range(1, 6)),
    ObjectDef(0x1005, 0, "cob_id_sync", _U32, _RW,
              "Identifier of SYNC. The drive only consumes SYNC; the manual calls the object read-only.", default=0x80),
    ObjectDef(0x1008, 0, "device_name", DataType.VISIBLE_STRING, _CONST, "Name of the device.", default="EPOS"),
    ObjectDef(0x100C, 0, "guard_time", _U16, _RW, "Time between two guard requests of the master; 0 is off.",
              default=0, unit="ms",
              cause="0: the drive does not notice the loss of its master.", cure="Set it before enabling the drive."),
    ObjectDef(0x100D, 0, "life_time_factor", _U8, _RW,
              "Guard times without a request after which the drive stops with EMCY 0x8130; 0 is off. "
              "Counting starts with the first request.", default=0,
              cause="0: the drive does not notice the loss of its master.", cure="Set it before enabling the drive."),
    highest_sub_index(0x1010, "store", 1),
    ObjectDef(0x1010, 1, "save_all_parameters", _U32, _RW,
              "Writing 0x65766173 ('save') keeps all parameters in non-volatile memory."),
    highest_sub_index(0x1011, "restore", 5),
    ObjectDef(0x1011, 1, "restore_all_defaults", _U32, _RW,
              "Writing 0x64616F6C ('load') brings the factory values back at the next start."),
    ObjectDef(0x1011, 5, "recompute_pdo_cob_ids_from_node_id", _U32, _RW,
              "Writing 0x64616F6C ('load') sets all PDO identifiers by the node id; then save and restart."),
    ObjectDef(0x1014, 0, "cob_id_emcy", _U32, _RO, "Identifier of the emergency message.",
              default=0x80, plus_node_id=True),
    ObjectDef(0x1016, 1, "consumer_heartbeat_1", _U32, _RW,
              "Node whose heartbeat is watched, and how long it may be silent.",
              default=0, unit="node<<16 + ms", firmware="later"),
    ObjectDef(0x1017, 0, "producer_heartbeat_time", _U16, _RW, "Period of the drive's own heartbeat; 0 is off.",
              default=0, unit="ms", firmware="later"),
    highest_sub_index(0x1018, "identity", 2),
    ObjectDef(0x1018, 1, "vendor_id", _U32, _RO, "Who made it: 251 is maxon motor.", default=251,
              cause="Another value: this is no maxon drive.", cure="Check node ids; correct the profile."),
    ObjectDef(0x1018, 2, "product_code", _U32, _RO, "Hardware version in the high word, software version in the low."),
    ObjectDef(0x1018, 3, "revision_number", _U32, _RO, "Revision of the device.", firmware="later"),
    ObjectDef(0x1018, 4, "identity_serial_number", _U32, _RO, "Serial number, 32 bits of it.", firmware="later"),
    ObjectDef(0x1020, 1, "verify_configuration_date", _U32, _RW, "Date stamp of the configuration, for comparison.",
              default=0, firmware="later"),
    ObjectDef(0x1020, 2, "verify_configuration_time", _U32, _RW, "Time stamp of the configuration, for comparison.",
              default=0, firmware="later"),
    highest_sub_index(0x1200, "sdo_server", 2),
    ObjectDef(0x1200, 1, "cob_id_sdo_client_to_server", _U32, _RO, "Identifier of SDO requests to the drive.",
              default=0x600, plus_node_id=True),
    ObjectDef(0x1200, 2, "cob_id_sdo_server_to_client", _U32, _RO, "Identifier of the drive's SDO answers.",
              default=0x580, plus_node_id=True),
    *_rpdo(1, _RW, 1, (0x206B_0020, 0, 0, 0)),
    *_rpdo(2, _RW, 1, (0x6040_0010, 0x60FF_0020, 0, 0)),
    *_rpdo(3, _RO, 2, (0x6040_0010, 0x6060_0008)),
    ObjectDef(0x1403, 1, "rpdo4_cob_id", _U32, _RW, "Identifier of RPDO4; bit 31 set: not used.",
              default=0x501, firmware="later"),
    ObjectDef(0x1403, 2, "rpdo4_transmission_type", _U8, _RW, "When RPDO4 is applied: 1 at the next SYNC, 255 at once.",
              default=255, firmware="later"),
    ObjectDef(0x1603, 1, "rpdo4_mapping_entry_1", _U32, _RW, "First object in RPDO4.",
              default=0x6040_0010, firmware="later"),
    ObjectDef(0x1603, 2, "rpdo4_mapping_entry_2", _U32, _RW, "Second object in RPDO4.",
              default=0x60FF_0020, firmware="later"),
    *_tpdo(1, _RW, 2, (0x606C_0020, 0x6064_0020, 0, 0)),
    *_tpdo(2, _RW, 2, (0x6078_0010, 0x207C_0110, 0x207C_0210, 0)),
    *_tpdo(3, _RO, 2, (0x6041_0010, 0x6061_0008)),
    ObjectDef(0x1803, 1, "tpdo4_cob_id", _U32, _RW, "Identifier of TPDO4; bit 31 set: not used.",
              default=0x481, firmware="later"),
    ObjectDef(0x1803, 2, "tpdo4_transmission_type", _U8, _RW, "When TPDO4 is sent: 1 after every SYNC, 255 on change.",
              default=255, firmware="later"),
    _inhibit_time(4),
    ObjectDef(0x1A03, 1, "tpdo4_mapping_entry_1", _U32, _RW, "First object in TPDO4.",
              default=0x6041_0010, firmware="later"),
    ObjectDef(0x1A03, 2, "tpdo4_mapping_entry_2", _U32, _RW, "Second object in TPDO4.",
              default=0x606C_0020, firmware="later"),
)
# fmt: on
