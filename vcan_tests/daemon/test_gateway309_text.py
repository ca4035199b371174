"""The grammar of the CiA 309-3 gateway: requests, datatypes and answers."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from daemon.api.gateway309_answers import ERROR_TEXTS, ErrorNumber, make_abort, make_error, make_value
from daemon.api.gateway309_help import HELP
from daemon.api.gateway309_text import (
    MAX_LINE_BYTES,
    Command,
    Lss,
    Nmt,
    Read,
    Refusal,
    Request,
    Set,
    Tell,
    Write,
    parse_request,
)
from daemon.api.gateway309_types import HEX, VALUE_TYPES, parse_number, print_value
from drivers.canopen.codes import NmtCommand
from vcan_tests.daemon.gateway309_rules import ANSWER, Heard, cocomm

U16, VS = VALUE_TYPES["u16"], VALUE_TYPES["vs"]

# -- requests ---------------------------------------------------------------------------------------------------------

REQUESTS: dict[bytes, tuple[int | None, Command]] = {
    b"[1] 4 read 0x1017 0 u16": (4, Read(0x1017, 0, U16)),
    b"[1] 4 r 0x1017 0": (4, Read(0x1017, 0, HEX)),
    b"[1] 4 r 4119 0x00 U16": (4, Read(0x1017, 0, U16)),
    b"[1] 04 R 010027 00 u16": (4, Read(0x1017, 0, U16)),
    b"[1] 1 4 r 0x1017 0 u16": (4, Read(0x1017, 0, U16)),
    b"[0x1]\t4\tr  0x1017 0 \r": (4, Read(0x1017, 0, HEX)),
    b"[1] r 0x1018 255": (None, Read(0x1018, 255, HEX)),
    b"[1] 4 r 0x1017 0 # how often": (4, Read(0x1017, 0, HEX)),
    b"[1] 4 w 0x6040 0 u16 0x000F": (4, Write(0x6040, 0, b"\x0f\0")),
    b"[1] 4 write 0x6083 0 i32 -2": (4, Write(0x6083, 0, b"\xfe\xff\xff\xff")),
    b"[1] 4 w 0x2040 0 hex E8 03": (4, Write(0x2040, 0, b"\xe8\x03")),
    b"[1] 4 w 0x2040 0 hex e803ff # three": (4, Write(0x2040, 0, b"\xe8\x03\xff")),
    b"[1] 4 w 0x1010 1 vs save": (4, Write(0x1010, 1, b"save")),
    b'[1] 4 w 0x1010 1 vs "to "" # be"': (4, Write(0x1010, 1, b'to " # be')),
    b"[1] 4 w 0x1F50 1 d AAECAw==": (4, Write(0x1F50, 1, b"\0\1\2\3")),
    b"[1] 0 start": (0, Nmt(NmtCommand.START)),
    b"[1] 4 StOp": (4, Nmt(NmtCommand.STOP)),
    b"[1] 4 preop": (4, Nmt(NmtCommand.ENTER_PRE_OPERATIONAL)),
    b"[1] 4 preoperational": (4, Nmt(NmtCommand.ENTER_PRE_OPERATIONAL)),
    b"[1] 4 reset node": (4, Nmt(NmtCommand.RESET_NODE)),
    b"[1] 4 reset comm": (4, Nmt(NmtCommand.RESET_COMMUNICATION)),
    b"[1] reset communication": (None, Nmt(NmtCommand.RESET_COMMUNICATION)),
    b"[1] set network 65535": (None, Set("network", 65535)),
    b"[1] set node 4": (None, Set("node", 4)),
    b"[1] set sdo_timeout 500": (None, Set("sdo_timeout", 500)),
    b"[1] set sdo_block 1": (None, Set("sdo_block", 1)),
    b"[1] help": (None, Tell("help")),
    b"[1] help LSS": (None, Tell("help", "lss")),
    b"[1] info version": (None, Tell("info", "version")),
    b"[1] led": (None, Tell("led")),
    b"[1] log": (None, Tell("log")),
    b"[1] lss_switch_glob 1": (None, Lss("lss_switch_glob", (1,))),
    b"[1] lss_switch_sel 0xFB 1 2 3": (None, Lss("lss_switch_sel", (0xFB, 1, 2, 3))),
    b"[1] lss_set_node 255": (None, Lss("lss_set_node", (255,))),
    b"[1] lss_conf_bitrate 0 2": (None, Lss("lss_conf_bitrate", (0, 2))),
    b"[1] lss_activate_bitrate 100": (None, Lss("lss_activate_bitrate", (100,))),
    b"[1] lss_store": (None, Lss("lss_store", ())),
    b"[1] lss_inquire_addr": (None, Lss("lss_inquire_addr", ())),
    b"[1] lss_inquire_addr 3": (None, Lss("lss_inquire_addr", (3,))),
    b"[1] lss_get_node": (None, Lss("lss_get_node", ())),
    b"[1] _lss_fastscan 50": (None, Lss("_lss_fastscan", (50,))),
    b"[1] lss_allnodes 0 20 1": (None, Lss("lss_allnodes", (0, 20, 1))),
}


@pytest.mark.parametrize("line", REQUESTS, ids=lambda line: line.decode())
def test_a_request_says_what_shall_be_done(line: bytes) -> None:
    node, command = REQUESTS[line]
    assert parse_request(line) == Request(1, node, command)


SYNTAX, NOT_SUPPORTED = ErrorNumber.SYNTAX, ErrorNumber.NOT_SUPPORTED
REFUSED = {
    b"[1] foo": NOT_SUPPORTED,
    b"[1] set colour 3": NOT_SUPPORTED,
    b"[1] info weather": NOT_SUPPORTED,
    b"[1]": SYNTAX,
    b"[1] 4": SYNTAX,
    b"[1] 4 r": SYNTAX,
    b"[1] 4 r 0x1000": SYNTAX,
    b"[1] 4 r 0x10000 0": SYNTAX,
    b"[1] 4 r 0x1000 256": SYNTAX,
    b"[1] 4 r 0x1000 0 u17": SYNTAX,
    b"[1] 4 r 0x1000 0 t": SYNTAX,
    b"[1] 4 r 0x1000 0 u32 more": SYNTAX,
    b"[1] 4 r 08 0": SYNTAX,
    b"[1] 1 2 3 r 0x1000 0": SYNTAX,
    b"[1] 4x r 0x1000 0": SYNTAX,
    b"[1] 4 w 0x1017 0 u16": SYNTAX,
    b"[1] 4 w 0x1017 0 u16 65536": SYNTAX,
    b"[1] 4 w 0x1017 0 u16 1 2": SYNTAX,
    b"[1] 4 w 0x1017 0 u16 -1": SYNTAX,
    b"[1] 4 w 0x1017 0 i8 128": SYNTAX,
    b"[1] 4 w 0x1017 0 r32 1e39": SYNTAX,
    b"[1] 4 w 0x1017 0 r64 nan": SYNTAX,
    b"[1] 4 w 0x1017 0 hex 1": SYNTAX,
    b"[1] 4 w 0x1017 0 vs": SYNTAX,
    b"[1] 4 w 0x1017 0 vs two words": SYNTAX,
    b'[1] 4 w 0x1017 0 vs "open # quote': SYNTAX,
    b"[1] 4 w 0x1017 0 d AAE": SYNTAX,
    b"[1] start now": SYNTAX,
    b"[1] reset": SYNTAX,
    b"[1] reset engine": SYNTAX,
    b"[1] set node": SYNTAX,
    b"[1] set node 0": SYNTAX,
    b"[1] set sdo_timeout 0": SYNTAX,
    b"[1] set sdo_block 2": SYNTAX,
    b"[1] help me": SYNTAX,
    b"[1] log all": SYNTAX,
    b"[1] lss_set_node 128": SYNTAX,
    b"[1] lss_conf_bitrate 0 5": SYNTAX,
    b"[1] lss_conf_bitrate 1 2": SYNTAX,
    b"[1] lss_switch_sel 1 2 3": SYNTAX,
    b"[1] lss_switch_sel 1 2 3 4 5": SYNTAX,
    b"[1] lss_allnodes 0 20": SYNTAX,
    b"[1] 4 r 0x00000000000000000001 0": SYNTAX,
    b"[1] 200 start": ErrorNumber.UNSUPPORTED_NODE,
    b"[1] 1 200 start": ErrorNumber.UNSUPPORTED_NODE,
    b"[1] 0 r 0x1000 0": ErrorNumber.UNSUPPORTED_NODE,
    b"[1] 0 w 0x1017 0 u16 1": ErrorNumber.UNSUPPORTED_NODE,
    b"[1] 65536 4 start": ErrorNumber.UNSUPPORTED_NET,
}


@pytest.mark.parametrize("line", REFUSED, ids=lambda line: line.decode())
def test_a_line_that_is_no_request_is_refused_with_its_number(line: bytes) -> None:
    refusal = parse_request(line)
    assert isinstance(refusal, Refusal)
    assert (refusal.sequence, refusal.number) == (1, REFUSED[line])


@pytest.mark.parametrize("line", [b"4 r 0x1000 0", b"[] start", b"[-1] start", b"[4294967296] start", b"[ 1 ] start"])
def test_a_line_without_a_sequence_number_is_a_syntax_error(line: bytes) -> None:
    refusal = parse_request(line)
    assert isinstance(refusal, Refusal)
    assert (refusal.sequence, refusal.number) == (None, SYNTAX)


@pytest.mark.parametrize("line", [b"", b"\r", b" \t ", b"# only words", b"   # [1] start\r"])
def test_an_empty_line_asks_for_nothing(line: bytes) -> None:
    assert parse_request(line) is None


def test_a_word_of_20_characters_is_the_longest() -> None:
    assert isinstance(parse_request(b"[1] 4 r 0x000000000000001000 0"), Request)


def test_a_line_that_is_too_long_is_refused_with_its_own_number() -> None:
    refusal = parse_request(b"[7] 4 w 0x1F50 1 hex " + b"00" * MAX_LINE_BYTES)
    assert isinstance(refusal, Refusal)
    assert (refusal.sequence, refusal.number) == (7, SYNTAX)


WORDS = st.sampled_from(
    b"[1] [0x1] 1 4 0 127 200 r w read write start reset node comm set sdo_timeout lss_store vs hex u8 r32 d help "
    b'0x1000 "a "" # 1e9 E8 -1 99999999999999999999999 \xff \xb2 [1 x] preop lss_allnodes \r 08 info version'.split(
        b" "
    )
)
LINES = st.one_of(st.binary(max_size=200), st.lists(WORDS, max_size=14).map(b" ".join))


@given(LINES)
@example(b'[1] 4 w 0 0 vs "' + b'"' * 1900)
@example(b"\xb2 r 0 0")
def test_any_bytes_are_a_request_a_refusal_or_nothing(line: bytes) -> None:
    assert isinstance(parse_request(line), Request | Refusal | None)


# -- numbers and datatypes --------------------------------------------------------------------------------------------


@given(st.integers(-(2**64), 2**64))
def test_a_number_reads_the_same_in_every_base_of_c(value: int) -> None:
    sign, size = "-" if value < 0 else "", abs(value)
    octal = "0" if size == 0 else f"0{size:o}"
    assert {parse_number(f"{sign}{text}") for text in (str(size), f"0x{size:x}", f"0X{size:X}", octal)} == {value}


@pytest.mark.parametrize("text", ["", "0x", "08", "1e3", "+", "0b1", "1_000", "²", " 1", "1\n"])
def test_what_c_does_not_take_for_a_number_is_none(text: str) -> None:
    assert parse_number(text) is None


PRINTED = {
    ("hex", "E803"): "E8 03",
    ("b", "01"): "1",
    ("i8", "FF"): "-1",
    ("i16", "E803"): "1000",
    ("i32", "00000080"): "-2147483648",
    ("i64", "FFFFFFFFFFFFFFFF"): "-1",
    ("u8", "FF"): "255",
    ("u64", "FFFFFFFFFFFFFFFF"): "18446744073709551615",
    ("x8", "0A"): "0x0A",
    ("x16", "3702"): "0x0237",
    ("x32", "FB000000"): "0x000000FB",
    ("x64", "0100000000000000"): "0x0000000000000001",
    ("r32", "0000C03F"): "1.5",
    ("r64", "000000000000F07F"): "inf",
    ("vs", "45504F530000"): '"EPOS"',
    ("vs", "612262"): '"a""b"',
    ("vs", "610D0A62"): "61 0D 0A 62",
    ("os", "00010203"): "AAECAw==",
    ("us", "4500"): "RQA=",
    ("d", ""): "",
    ("u16", "E80300"): "E8 03 00",
    ("r32", "00"): "00",
}


@pytest.mark.parametrize(("name", "raw"), PRINTED)
def test_a_value_is_printed_in_its_datatype_or_as_hex(name: str, raw: str) -> None:
    assert print_value(bytes.fromhex(raw), VALUE_TYPES[name]) == PRINTED[name, raw]


FIXED = [datatype for datatype in VALUE_TYPES.values() if datatype.size and not datatype.name.startswith("r")]


@given(st.sampled_from(FIXED), st.binary(min_size=8, max_size=8))
def test_what_was_read_as_a_number_is_written_back_the_same(datatype: object, raw: bytes) -> None:
    assert isinstance(datatype, type(HEX))
    data = raw[: datatype.size]
    text = datatype.to_text(data)
    assert text is not None
    assert datatype.from_text(text) == data


@given(st.sampled_from(["hex", "os", "us", "d"]), st.binary(min_size=1, max_size=40))
def test_what_was_read_as_bytes_is_written_back_the_same(name: str, data: bytes) -> None:
    assert VALUE_TYPES[name].from_text(print_value(data, VALUE_TYPES[name])) == data


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=40))
def test_what_was_read_as_text_is_written_back_the_same(text: str) -> None:
    line = f"[1] 4 w 0x1008 0 vs {print_value(text.encode(), VS)}".encode()
    assert parse_request(line) == Request(1, 4, Write(0x1008, 0, text.encode()))


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_real_is_printed_to_six_digits(value: float) -> None:
    text = print_value(struct.pack("<f", value), VALUE_TYPES["r32"])
    assert math.isclose(float(text), value, rel_tol=1e-5)


# -- answers ----------------------------------------------------------------------------------------------------------


def test_answers_have_the_forms_that_clients_look_for() -> None:
    assert make_value(4, "OK") == b"[4] OK\r\n"
    assert make_value(1, "1000") == b"[1] 1000\r\n"
    assert make_error(10, ErrorNumber.NOT_SUPPORTED).startswith(b"[10] ERROR:100 #")
    assert make_abort(5, 0x06020000).startswith(b"[5] ERROR:0x06020000 #")
    assert make_abort(5, 0x0F00FFB9).startswith(b"[5] ERROR:0x0F00FFB9 #")


@given(st.integers(0, 2**32 - 1), st.sampled_from(ErrorNumber), st.text())
def test_an_error_is_one_line_whatever_it_tells(sequence: int, number: ErrorNumber, detail: str) -> None:
    found = ANSWER.fullmatch(make_error(sequence, number, detail))
    assert found is not None
    assert (int(found["sequence"]), int(found["number"])) == (sequence, number)


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_an_abort_code_is_told_with_eight_digits(sequence: int, code: int) -> None:
    found = ANSWER.fullmatch(make_abort(sequence, code))
    assert found is not None
    assert int(found["abort"], 16) == code


@given(st.sampled_from(sorted(VALUE_TYPES)), st.binary(max_size=100))
def test_every_value_that_was_read_is_one_line(name: str, data: bytes) -> None:
    assert ANSWER.fullmatch(make_value(1, print_value(data, VALUE_TYPES[name])))


def test_every_error_number_has_words() -> None:
    assert set(ERROR_TEXTS) == set(ErrorNumber)


@pytest.mark.parametrize("topic", HELP)
def test_cocomm_shows_the_whole_help(topic: str) -> None:
    assert cocomm(make_value(4294967295, HELP[topic])) == Heard("value", HELP[topic])


def test_cocomm_tells_success_errors_and_values_apart() -> None:
    assert cocomm(make_value(1, "OK")) == Heard("ok")
    assert cocomm(make_error(1, ErrorNumber.TIME_OUT)) == Heard("error")
    assert cocomm(make_abort(1, 0x05040000)) == Heard("error")
    assert cocomm(make_value(4294967295, "E8 03")) == Heard("value", "E8 03")
