from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import UsageError
from drivers.epos.serial_frames import make_frame
from drivers.explain import explain
from drivers.explain_codes import Reading


def first(text: str) -> Reading:
    return explain(text)[0]


@pytest.mark.parametrize(
    ("text", "title"),
    [
        ("10 01 41 60 00 01 AB F0", "read statusword (0x6041) of node 1"),
        ("serial:100141600001ABF0", "read statusword (0x6041) of node 1"),
        ("serial: 10 01 41 60 00 01 ab f0", "read statusword (0x6041) of node 1"),
        ("10 01 01 10 00 00 42 9C", "read error_register (0x1001) of the drive on the line"),
        ("10 01 04 60 00 05 32 CA", "read position_value (0x6004) of node 5"),
        ("11 03 40 60 00 01 0F 00 00 00 52 EF", "write controlword (0x6040) of node 1"),
        ("12 01 08 10 00 01 A2 BA", "read device_name (0x1008) of node 1 in segments"),
        ("14 00 40 00 92 99", "read next segment"),
        ("0E 01 02 00 81 00 3B C5", "NMT command NMT to node 2: reset node"),
        ("20 05 01 02 02 00 0F 00 00 00 00 00 00 00 2C 4F", "send RPDO1 of node 1"),
        ("21 01 81 01 08 00 2F 21", "send and wait for the answer to request of TPDO1 of node 1"),
        ("00 03 00 00 00 00 37 03 00 00 AD F6", "answer"),
        ("00 01 00 00 00 00 51 AA", "answer: done"),
        ("00 01 00 00 02 06 B5 20", "answer, abort 0x06020000: no such object"),
        ("00 01 B9 FF 00 0F A2 91", "answer, abort 0x0F00FFB9: wrong node id"),
        ("90 02 10 02 41 60 00 01 64 CF", "read statusword (0x6041) of node 1"),
        ("serial:4F", "acknowledge O"),
        ("serial:46", "acknowledge F"),
        ("serial:11", "operation code 0x11: write object"),
    ],
)
def test_a_serial_frame_is_named(text: str, title: str) -> None:
    assert first(text).title == f"RS-232: {title}"


def test_a_written_value_is_in_words() -> None:
    assert first("11 03 40 60 00 01 0F 00 00 00 52 EF").details["value"] == "0x000F (enable operation)"


def test_a_written_position_carries_its_unit() -> None:
    assert first("11 03 7A 60 00 01 A0 86 01 00 BC 3E").details["value"] == "100000 qc"


def test_an_answered_value_is_shown_as_a_number_and_as_bytes() -> None:
    assert first("00 03 00 00 00 00 78 EC FF FF 3A 8A").details == {
        "value": "0xFFFFEC78 = -5000",
        "bytes": "78 EC FF FF",
    }


def test_an_answer_may_be_to_a_read_or_to_a_segment() -> None:
    readings = explain("00 04 00 00 00 00 04 45 50 4F 53 00 7A 7F")
    assert [(reading.assumes, reading.details["data"]) for reading in readings] == [
        ("answer to a segment that was read", "'EPOS'")
    ]


def test_an_abort_comes_with_its_cure() -> None:
    assert first("00 01 B9 FF 00 0F A2 91").cure


def test_the_later_framing_is_told() -> None:
    assert "EPOS4" in first("90 02 10 02 41 60 00 01 64 CF").assumes


def test_a_wrong_crc_is_shown_beside_the_right_one() -> None:
    assert first("10 01 41 60 00 01 AB F1").details == {"CRC": "AB F1; these bytes have AB F0"}


def test_a_frame_cut_short_says_how_long_it_should_be() -> None:
    assert first("10 01 41 60").details == {"length": "4 bytes; the length byte 0x01 asks for 8"}


def test_serial_frames_are_a_kind_of_their_own() -> None:
    assert [reading.kind for reading in explain("10 01 41 60 00 01 AB F0", "serial")] == ["serial"]


def test_what_is_no_serial_frame_is_refused_with_an_example() -> None:
    with pytest.raises(UsageError) as caught:
        explain("0x0337", "serial")
    assert "10 01 41 60" in str(caught.value.remedy)


def test_a_marked_text_without_bytes_is_refused() -> None:
    with pytest.raises(UsageError):
        explain("serial:zz")


@given(st.binary(min_size=2, max_size=80))
def test_any_bytes_have_a_reading(raw: bytes) -> None:
    assert explain(raw.hex(" "), "serial")


@given(st.integers(0, 255), st.binary(min_size=1, max_size=80))
def test_any_frame_with_a_good_crc_has_a_reading(opcode: int, data: bytes) -> None:
    assert explain("serial:" + make_frame(opcode, data).hex(), "serial")
