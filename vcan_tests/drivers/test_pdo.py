"""PDO mapping, and the process data of the EPOS."""

from __future__ import annotations

import pytest

from drivers.canopen.pdo import ON_SYNC, pdo_struct, rpdo_cob_id, rpdo_settings, tpdo_cob_id, tpdo_settings
from drivers.epos.codec import RPDO1, RPDO1_MAPS, TPDO1, TPDO1_MAP, make_rpdo3
from drivers.epos.objects import OBJECTS
from drivers.epos.parameters import pdo_plan
from vcan_tests.drivers.bench import max2d


def test_cob_ids_are_those_of_the_predefined_connection_set() -> None:
    assert [rpdo_cob_id(1, 3), rpdo_cob_id(3, 3), tpdo_cob_id(1, 3), tpdo_cob_id(2, 5)] == [0x203, 0x403, 0x183, 0x285]


def test_a_mapping_is_switched_off_written_and_switched_on() -> None:
    settings = tpdo_settings(OBJECTS, 1, 3, ON_SYNC, TPDO1_MAP)
    assert [(entry.address, value) for entry, value in settings] == [
        ("0x1800/1", 0x183),
        ("0x1800/2", 1),
        ("0x1A00", 0),
        ("0x1A00/1", 0x60410010),
        ("0x1A00/2", 0x60640020),
        ("0x1A00/3", 0x60780010),
        ("0x1A00", 3),
    ]


def test_without_a_mapping_only_the_communication_is_written() -> None:
    assert [entry.address for entry, _ in rpdo_settings(OBJECTS, 3, 3, 255)] == ["0x1402/1", "0x1402/2"]


def test_more_than_8_bytes_are_no_pdo() -> None:
    with pytest.raises(ValueError, match="8 bytes"):
        pdo_struct((*TPDO1_MAP, OBJECTS["controlword"]))


def test_both_driving_modes_have_the_same_layout_of_rpdo1() -> None:
    assert {pdo_struct(mapping).format for mapping in RPDO1_MAPS.values()} == {"<Hi"}


def test_no_two_drives_share_a_cob_id() -> None:
    cob_ids = [
        value
        for config in max2d().drives.values()
        for entry, value in pdo_plan(config)
        if entry.name.endswith("_cob_id")
    ]
    assert len(cob_ids) == len(set(cob_ids)) == 4 * 6


def test_targets_and_stops_are_these_bytes() -> None:
    assert RPDO1.pack(0x000F, -250) == bytes.fromhex("0F 00 06 FF FF FF")
    assert make_rpdo3(0x0002, -2) == bytes.fromhex("02 00 FE")


def test_a_reading_is_these_bytes() -> None:
    assert TPDO1.unpack(bytes.fromhex("37 02 FE FF FF FF 06 FF")) == (0x0237, -2, -250)
