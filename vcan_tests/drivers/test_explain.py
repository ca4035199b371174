from __future__ import annotations

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import UsageError
from drivers.epos.objects import OBJECTS
from drivers.explain import KINDS, explain
from drivers.explain_codes import Reading

FRAME_TEXTS = st.builds(
    lambda identifier, data: f"{identifier:03X}#{data.hex()}", st.integers(0, 0x7FF), st.binary(max_size=8)
)


def kinds(text: str) -> list[str]:
    return [reading.kind for reading in explain(text)]


def first(text: str, kind: str | None = None) -> Reading:
    return explain(text, kind)[0]


# Codes


def test_0x6320_is_an_emergency_and_looks_like_an_object() -> None:
    assert kinds("0x6320") == ["emcy", "object"]


def test_0x0337_is_a_statusword_and_maybe_a_controlword() -> None:
    assert kinds("0x0337") == ["statusword", "controlword"]


def test_a_statusword_names_its_state() -> None:
    assert first("0x0337").title == "statusword 0x0337: operation enabled"


def test_a_fault_comes_with_its_cure() -> None:
    assert "reset the fault" in first("0x0108").cure


def test_bits_with_a_meaning_by_mode_are_given_with_each_mode() -> None:
    assert first("0x1337").details["bit 12"].count("mode") == 3


def test_an_abort_code_has_one_reading() -> None:
    assert [reading.title for reading in explain("06020000h")] == ["SDO abort 0x06020000: no such object"]


def test_a_gateway_abort_is_known() -> None:
    assert "node" in first("0x0F00FFB9").meaning


@pytest.mark.parametrize("text", ["0x8130", "8130", "8130h", "33072"])
def test_a_number_is_taken_in_every_notation(text: str) -> None:
    assert any(reading.title == "EMCY 0x8130: life guarding failed" for reading in explain(text))


def test_an_emergency_outside_the_table_is_named_by_its_class_when_asked_for() -> None:
    assert first("0x3130", "emcy").title == "EMCY 0x3130: mains voltage"


def test_an_nmt_state_byte_is_read_with_its_toggle_bit() -> None:
    assert first("0x85").title == "NMT state byte 0x85, toggle bit 1: operational"


def test_an_nmt_command_byte_is_read_as_one() -> None:
    assert any("reset node" in reading.title for reading in explain("0x81", "nmt"))


def test_an_error_register_is_read_bit_by_bit() -> None:
    assert first("0x11", "register").details == {"bit 0": "an error is present", "bit 4": "communication error"}


def test_a_word_that_is_no_state_is_still_read_as_a_statusword_when_asked_for() -> None:
    assert "no state" in first("0xFFFF", "statusword").title


# Objects


@pytest.mark.parametrize("text", ["max_following_error", "Max Following Error", "0x6065", "6065h", "0x6065/0"])
def test_an_object_is_explained_by_name_and_address(text: str) -> None:
    assert first(text).title == "object 0x6065: max_following_error"


def test_an_address_in_two_dictionaries_has_two_readings() -> None:
    assert {reading.assumes for reading in explain("0x6502")} == {"EPOS 24/5", "CiA 406 encoder"}


def test_a_mapping_entry_names_its_object() -> None:
    assert first("0x60640020").title == "mapping entry 0x60640020: position_actual_value, 32 bits"


def test_the_values_of_a_code_object_are_listed() -> None:
    assert "brushed DC" in first("motor_type").details["values"]


def test_every_object_is_explained_by_its_name_and_by_its_address() -> None:
    for entry in OBJECTS.objects:
        assert entry.name in first(entry.name, "object").title
        assert entry.name in first(entry.address, "object").title


# Frames


def test_a_tpdo_names_node_mapping_and_values() -> None:
    reading = first("181#370310270000F4FF")
    assert reading.title == "TPDO1 of node 1"
    assert reading.assumes == "EPOS 24/5 with canhelm's mapping"
    assert list(reading.details.values()) == ["0x0337 (operation enabled)", "10000 qc", "-12 mA"]


def test_a_tpdo_of_a_drive_in_fault_comes_with_the_cure() -> None:
    assert "reset the fault" in first("181#0801000000000000").cure


def test_a_tpdo_may_be_one_with_the_factory_mapping() -> None:
    assert [reading.assumes for reading in explain("181#3703000000000000")][1] == "EPOS 24/5 with the factory mapping"


def test_a_frame_cut_short_is_read_as_far_as_it_goes() -> None:
    assert explain("181#3703...")[0].details == {"statusword (0x6041)": "0x0337 (operation enabled)"}


def test_a_tpdo_of_four_bytes_is_one_of_an_encoder() -> None:
    assert [reading.assumes for reading in explain("285#E8030000")] == [
        "CiA 406 encoder",
        "EPOS 24/5 with the factory mapping, two objects counted",
    ]


def test_an_rpdo_is_read_in_every_driving_mode() -> None:
    assert [list(reading.details) for reading in explain("201#0F0006FFFFFF")] == [
        ["controlword (0x6040)", "target_velocity (0x60FF)"],
        ["controlword (0x6040)", "velocity_mode_setting_value (0x206B)"],
        ["controlword (0x6040)", "target_position (0x607A)"],
    ]


def test_the_rpdo_for_stops_names_command_and_mode() -> None:
    assert list(first("401#020003").details.values()) == ["0x0002 (quick stop)", "3 (profile velocity)"]


def test_a_pdo_of_no_known_length_says_so() -> None:
    assert "fit no mapping" in first("181#01").meaning


def test_an_emergency_frame_has_code_register_cause_and_cure() -> None:
    reading = first("081#3081100000000000")
    assert reading.title == "EMCY of node 1, 0x8130: life guarding failed"
    assert reading.details["error register"] == "0x10 (communication error)"
    assert reading.cause
    assert reading.cure


def test_an_emergency_of_an_encoder_is_read() -> None:
    assert first("085#0050010000000000").title == "EMCY of node 5, 0x5000: position error"


@pytest.mark.parametrize(
    ("text", "title"),
    [
        ("601#4041600000000000", "SDO request to node 1: read statusword (0x6041)"),
        ("601#2B4060000F000000", "SDO request to node 1: write controlword (0x6040)"),
        ("581#4B41600037030000", "SDO answer of node 1: value of statusword (0x6041)"),
        ("581#6040600000000000", "SDO answer of node 1: written: controlword (0x6040)"),
        (
            "581#8000700000000206",
            "SDO answer of node 1: abort 0x06020000 at 0x7000/0 (in no dictionary): no such object",
        ),
        ("581#4F00700000000000", "SDO answer of node 1: value of 0x7000/0 (in no dictionary)"),
        ("605#4004600000000000", "SDO request to node 5: read position_value (0x6004)"),
        ("601#6000000000000000", "SDO request to node 1: read next segment"),
        ("581#0045504F53000000", "SDO answer of node 1: segment"),
        ("601#A008100020000000", "SDO request to node 1: read 0x1008/0 in blocks of 32 segments"),
        ("000#0103", "NMT to node 3: start"),
        ("000#8000", "NMT to all nodes: enter pre-operational"),
        ("080#", "SYNC"),
        ("701#R", "guard request to node 1"),
        ("703#00", "boot-up of node 3"),
        ("703#85", "state of node 3: operational"),
        ("181#R8", "request of TPDO1 of node 1"),
        ("7E5#0401000000000000", "LSS request: all devices into configuration"),
        ("7FF#00", "identifier 0x7FF"),
        ("18FF1234#00", "identifier 0x18FF1234"),
        ("(1607120998.528012) vcan0 080#", "SYNC"),
    ],
)
def test_a_frame_is_named(text: str, title: str) -> None:
    assert first(text).title == title


def test_the_value_of_an_expedited_write_is_in_words() -> None:
    assert first("601#2B4060000F000000").details["value"] == "0x000F (enable operation)"


def test_the_value_of_an_expedited_read_carries_its_unit() -> None:
    assert first("581#4365600000000000").details["value"] == "0 qc"


def test_a_value_of_the_wrong_length_is_shown_as_bytes() -> None:
    assert first("601#2F40600006000000").details["value"] == "06 (1 bytes; the object has 2)"


def test_the_device_name_is_read_as_text() -> None:
    assert first("581#4308100045504F53").details["value"] == "'EPOS'"


def test_the_toggle_bit_of_a_guard_answer_is_told() -> None:
    assert first("703#85").details["toggle bit"].startswith("1")


@pytest.mark.parametrize("text", ["000#01", "000#0180", "000#0901", "081#30", "701#", "701#33", "601#40"])
def test_a_malformed_frame_is_called_malformed(text: str) -> None:
    assert "malformed" in first(text).title


# Nonsense


@pytest.mark.parametrize(
    "text", ["", " ", "#", "zzz", "0x", "0xZZ", "-5", "1.5", "181#3", "181#" + "00" * 9, "181##0", "٣"]
)
def test_nonsense_is_refused_with_what_is_accepted(text: str) -> None:
    with pytest.raises(UsageError) as caught:
        explain(text)
    assert "give" in str(caught.value.remedy)


def test_an_unknown_kind_is_refused_with_the_kinds() -> None:
    with pytest.raises(UsageError) as caught:
        explain("0x0337", "word")
    assert "statusword" in str(caught.value.remedy)


def test_a_code_that_cannot_be_of_the_kind_is_refused() -> None:
    with pytest.raises(UsageError, match="cannot be read as register"):
        explain("0x0337", "register")


def check(text: str, kind: str | None) -> None:
    try:
        readings = explain(text, kind)
    except UsageError:
        return
    assert readings
    assert all(reading.title and reading.meaning for reading in readings)
    assert all(reading.kind == kind for reading in readings if kind)


@given(st.text() | st.text(string.hexdigits + "xh#R/:. ", max_size=24), st.none() | st.sampled_from(KINDS))
def test_any_text_is_explained_or_refused(text: str, kind: str | None) -> None:
    check(text, kind)


@given(st.integers(0, 0xFFFF_FFFF) | st.integers(0, 0xFFFF), st.none() | st.sampled_from(KINDS))
def test_any_number_is_explained_or_refused(value: int, kind: str | None) -> None:
    check(f"0x{value:X}", kind)


@given(FRAME_TEXTS)
def test_any_frame_is_explained(text: str) -> None:
    assert all(reading.kind == "frame" for reading in explain(text))
