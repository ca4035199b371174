from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.objects import Access, ObjectDef, ObjectTable
from drivers.encoder.objects import OBJECTS as ENCODER
from drivers.epos.objects import OBJECTS as EPOS
from vcan_tests.peer import peer_variable

ALL = EPOS.objects + ENCODER.objects
NUMBERS = [entry for entry in ALL if entry.type.bits]


def limits(entry: ObjectDef) -> tuple[int, int]:
    signed = entry.type.name.startswith("I")
    lowest = -(1 << entry.type.bits - 1) if signed else 0
    highest = (1 << entry.type.bits - signed) - 1
    return lowest if entry.low is None else entry.low, highest if entry.high is None else entry.high


def test_every_object_has_a_meaning_and_a_source() -> None:
    assert [entry.address for entry in ALL if not (entry.meaning.endswith(".") and entry.source)] == []


def test_a_cause_comes_with_a_cure() -> None:
    assert [entry.address for entry in ALL if bool(entry.cause) != bool(entry.cure)] == []


def test_sizes_agree_with_an_independent_dictionary() -> None:
    assert [entry.address for entry in NUMBERS if len(peer_variable(entry)) != entry.type.bits] == []


@given(st.sampled_from(NUMBERS), st.data())
def test_values_encode_as_in_an_independent_dictionary(entry: ObjectDef, data: st.DataObject) -> None:
    value = data.draw(st.integers(*limits(entry)))
    assert entry.type.pack(value) == peer_variable(entry).encode_raw(value)


@given(st.sampled_from(NUMBERS), st.data())
def test_a_value_survives_the_wire(entry: ObjectDef, data: st.DataObject) -> None:
    value = data.draw(st.integers(*limits(entry)))
    assert entry.type.unpack(entry.type.pack(value)) == value


def test_a_default_lies_within_the_limits() -> None:
    defaults = [(entry, entry.default) for entry in NUMBERS if isinstance(entry.default, int)]
    assert [entry.address for entry, value in defaults if not limits(entry)[0] <= value <= limits(entry)[1]] == []


def test_limits_fit_the_type() -> None:
    for entry in NUMBERS:
        assert [entry.type.unpack(entry.type.pack(limit)) for limit in limits(entry)] == list(limits(entry))


def test_the_epos_has_202_objects_of_the_base_firmware_and_37_later_ones() -> None:
    later = [entry for entry in EPOS.objects if entry.firmware == "later"]
    assert (len(EPOS.objects) - len(later), len(later)) == (202, 37)


@pytest.mark.parametrize("table", [EPOS, ENCODER])
def test_factory_mappings_name_objects_that_can_be_mapped(table: ObjectTable) -> None:
    mappings = [entry.default for entry in table.objects if "mapping_entry" in entry.name and entry.default]
    mapped = [table.at(int(mapping) >> 16, int(mapping) >> 8 & 0xFF) for mapping in mappings]
    assert [entry and entry.mapping for entry in mapped] == mappings
    assert all(entry and entry.pdo for entry in mapped)


@pytest.mark.parametrize(
    ("name", "section"),
    [("statusword", 49), ("function_of_digital_input_1", 38), ("motor_type", 82), ("guard_time", 6)],
)
def test_an_object_names_its_section_of_the_manual(name: str, section: int) -> None:
    assert EPOS[name].source == f"maxon EPOS Firmware Specification 14.1.{section}"


def test_objects_are_sorted_by_address() -> None:
    addresses = [(entry.index, entry.sub) for entry in EPOS.objects]
    assert addresses == sorted(addresses)


@pytest.mark.parametrize("text", ["target_velocity", "0x60FF", "60FFh", "0x60ff/0", "0x60FF:00"])
def test_an_object_is_found_by_name_and_address(text: str) -> None:
    assert EPOS.find(text) is EPOS["target_velocity"]


@pytest.mark.parametrize("text", ["", "0x", "target_speed", "0x6041/300", "0x16041", "6041h/x", "0x6041/-1"])
def test_nonsense_finds_no_object(text: str) -> None:
    assert EPOS.find(text) is None


def test_constants_and_measured_values_are_not_writable() -> None:
    names = ("device_type", "statusword", "position_actual_value", "current_actual_value", "vendor_id")
    assert all(EPOS[name].access in (Access.RO, Access.CONST) for name in names)
