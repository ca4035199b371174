from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.epos.serial_answers import (
    Answer,
    make_can_frame_answer,
    make_done_answer,
    make_read_answer,
    make_segment_answer,
    make_segment_written_answer,
    may_answer,
    parse_answer,
)
from drivers.epos.serial_frames import (
    Frame,
    InitiateSegmentedRead,
    InitiateSegmentedWrite,
    ReadObject,
    Request,
    RequestCanFrame,
    SegmentRead,
    SegmentWrite,
    SendCanFrame,
    SendNmt,
    WriteObject,
    make_frame,
    make_initiate_segmented_read,
    make_initiate_segmented_write,
    make_read_object,
    make_request_can_frame,
    make_segment_read,
    make_segment_write,
    make_send_can_frame,
    make_send_nmt,
    make_write_object,
    parse_frame,
    parse_request,
)

NODES = st.integers(0, 127)
INDICES = st.integers(0, 0xFFFF)
SUBS = st.integers(0, 0xFF)
TOGGLES = st.integers(0, 1)
COB_IDS = st.integers(0, 0x7FF)

# The first two and the first two answers are printed in the EPOS Communication Guide 6.2.4.
REQUESTS: list[tuple[str, bytes, Request]] = [
    ("10 01 03 20 01 02 88 A8", make_read_object(2, 0x2003, 1), ReadObject(2, 0x2003, 1)),
    ("10 01 41 60 00 01 AB F0", make_read_object(1, 0x6041, 0), ReadObject(1, 0x6041, 0)),
    ("10 01 01 10 00 00 42 9C", make_read_object(0, 0x1001, 0), ReadObject(0, 0x1001, 0)),
    ("10 01 64 60 00 01 9D 9D", make_read_object(1, 0x6064, 0), ReadObject(1, 0x6064, 0)),
    ("10 01 04 60 00 05 32 CA", make_read_object(5, 0x6004, 0), ReadObject(5, 0x6004, 0)),
    (
        "11 03 40 60 00 01 06 00 00 00 C3 71",
        make_write_object(1, 0x6040, 0, b"\x06\x00"),
        WriteObject(1, 0x6040, 0, b"\x06\0\0\0"),
    ),
    (
        "11 03 40 60 00 01 0F 00 00 00 52 EF",
        make_write_object(1, 0x6040, 0, b"\x0f\x00"),
        WriteObject(1, 0x6040, 0, b"\x0f\0\0\0"),
    ),
    (
        "11 03 40 60 00 01 80 00 00 00 39 F8",
        make_write_object(1, 0x6040, 0, b"\x80\x00"),
        WriteObject(1, 0x6040, 0, b"\x80\0\0\0"),
    ),
    (
        "11 03 60 60 00 01 FF 00 00 00 F6 62",
        make_write_object(1, 0x6060, 0, b"\xff"),
        WriteObject(1, 0x6060, 0, b"\xff\0\0\0"),
    ),
    (
        "11 03 60 60 00 01 FF FF FF FF 5A 34",
        make_write_object(1, 0x6060, 0, b"\xff\xff\xff\xff"),
        WriteObject(1, 0x6060, 0, b"\xff\xff\xff\xff"),
    ),
    (
        "11 03 7A 60 00 01 A0 86 01 00 BC 3E",
        make_write_object(1, 0x607A, 0, (100000).to_bytes(4, "little")),
        WriteObject(1, 0x607A, 0, b"\xa0\x86\x01\0"),
    ),
    (
        "11 03 62 20 00 02 18 FC FF FF F4 D2",
        make_write_object(2, 0x2062, 0, (-1000).to_bytes(4, "little", signed=True)),
        WriteObject(2, 0x2062, 0, b"\x18\xfc\xff\xff"),
    ),
    (
        "11 03 78 20 02 01 00 10 00 00 B7 A0",
        make_write_object(1, 0x2078, 2, b"\x00\x10"),
        WriteObject(1, 0x2078, 2, b"\x00\x10\0\0"),
    ),
    (
        "11 03 10 10 01 01 73 61 76 65 19 77",
        make_write_object(1, 0x1010, 1, b"save"),
        WriteObject(1, 0x1010, 1, b"save"),
    ),
    ("12 01 08 10 00 01 A2 BA", make_initiate_segmented_read(1, 0x1008, 0), InitiateSegmentedRead(1, 0x1008, 0)),
    ("14 00 00 00 56 D1", make_segment_read(0), SegmentRead(0)),
    ("14 00 40 00 92 99", make_segment_read(1), SegmentRead(1)),
    (
        "13 03 0C 20 01 01 08 00 00 00 4E 67",
        make_initiate_segmented_write(1, 0x200C, 1, 8),
        InitiateSegmentedWrite(1, 0x200C, 1, 8),
    ),
    ("0E 01 01 00 01 00 E3 0D", make_send_nmt(1, 1), SendNmt(1, 1)),
    ("0E 01 00 00 80 00 7A BB", make_send_nmt(0, 128), SendNmt(0, 128)),
    ("0E 01 02 00 81 00 3B C5", make_send_nmt(2, 129), SendNmt(2, 129)),
    (
        "20 05 01 02 02 00 0F 00 00 00 00 00 00 00 2C 4F",
        make_send_can_frame(0x201, b"\x0f\x00"),
        SendCanFrame(0x201, b"\x0f\x00"),
    ),
    ("21 01 81 01 08 00 2F 21", make_request_can_frame(0x181, 8), RequestCanFrame(0x181, 8)),
]

ANSWERS: list[tuple[str, bytes, bytes, Answer]] = [
    (
        "00 03 00 00 00 00 10 20 10 62 10 26",
        make_read_answer(b"\x10\x20\x10\x62"),
        make_read_object(2, 0x2003, 1),
        Answer(data=b"\x10\x20\x10\x62"),
    ),
    (
        "00 03 00 00 00 00 37 03 00 00 AD F6",
        make_read_answer(b"\x37\x03"),
        make_read_object(1, 0x6041, 0),
        Answer(data=b"\x37\x03\0\0"),
    ),
    (
        "00 03 00 00 00 00 78 EC FF FF 3A 8A",
        make_read_answer((-5000).to_bytes(4, "little", signed=True)),
        make_read_object(1, 0x6064, 0),
        Answer(data=b"\x78\xec\xff\xff"),
    ),
    ("00 01 00 00 00 00 51 AA", make_done_answer(), make_write_object(1, 0x6040, 0, b"\x06"), Answer()),
    (
        "00 01 00 00 02 06 B5 20",
        make_done_answer(0x06020000),
        make_write_object(1, 0x7000, 0, b"\x06"),
        Answer(0x06020000),
    ),
    (
        "00 01 B9 FF 00 0F A2 91",
        make_done_answer(0x0F00FFB9),
        make_initiate_segmented_read(9, 8, 0),
        Answer(0x0F00FFB9),
    ),
    (
        "00 04 00 00 00 00 04 45 50 4F 53 00 7A 7F",
        make_segment_answer(b"EPOS", 0, more=False),
        make_segment_read(0),
        Answer(data=b"EPOS"),
    ),
]


def frame_of(raw: bytes) -> Frame:
    frame = parse_frame(raw)
    assert isinstance(frame, Frame)
    return frame


# Worked frames


@pytest.mark.parametrize(("text", "made", "request_"), REQUESTS)
def test_a_published_request_is_made_byte_for_byte(text: str, made: bytes, request_: Request) -> None:
    assert made == bytes.fromhex(text)


@pytest.mark.parametrize(("text", "made", "request_"), REQUESTS)
def test_a_published_request_is_read(text: str, made: bytes, request_: Request) -> None:
    assert parse_request(frame_of(bytes.fromhex(text))) == request_


@pytest.mark.parametrize(("text", "made", "request_", "answer"), ANSWERS)
def test_a_published_answer_is_made_byte_for_byte(text: str, made: bytes, request_: bytes, answer: Answer) -> None:
    assert made == bytes.fromhex(text)


@pytest.mark.parametrize(("text", "made", "request_", "answer"), ANSWERS)
def test_a_published_answer_is_read(text: str, made: bytes, request_: bytes, answer: Answer) -> None:
    assert parse_answer(request_, frame_of(bytes.fromhex(text))) == answer


# Round trips


@given(NODES, INDICES, SUBS)
def test_a_read_comes_back_from_its_bytes(node: int, index: int, sub: int) -> None:
    assert parse_request(frame_of(make_read_object(node, index, sub))) == ReadObject(node, index, sub)


@given(NODES, INDICES, SUBS, st.binary(min_size=1, max_size=4))
def test_a_write_comes_back_from_its_bytes(node: int, index: int, sub: int, data: bytes) -> None:
    made = make_write_object(node, index, sub, data)
    assert parse_request(frame_of(made)) == WriteObject(node, index, sub, data.ljust(4, b"\0"))


@given(NODES, INDICES, SUBS)
def test_the_begin_of_a_segmented_read_comes_back(node: int, index: int, sub: int) -> None:
    made = make_initiate_segmented_read(node, index, sub)
    assert parse_request(frame_of(made)) == InitiateSegmentedRead(node, index, sub)


@given(NODES, INDICES, SUBS, st.integers(0, 0xFFFF_FFFF))
def test_the_begin_of_a_segmented_write_comes_back(node: int, index: int, sub: int, size: int) -> None:
    made = make_initiate_segmented_write(node, index, sub, size)
    assert parse_request(frame_of(made)) == InitiateSegmentedWrite(node, index, sub, size)


@given(st.binary(max_size=63), TOGGLES)
def test_a_written_segment_comes_back(data: bytes, toggle: int) -> None:
    assert parse_request(frame_of(make_segment_write(data, toggle))) == SegmentWrite(toggle, data)


@given(COB_IDS, st.binary(max_size=8))
def test_a_can_frame_comes_back(cob_id: int, data: bytes) -> None:
    assert parse_request(frame_of(make_send_can_frame(cob_id, data))) == SendCanFrame(cob_id, data)


@given(COB_IDS, st.integers(0, 8))
def test_a_request_for_a_can_frame_comes_back(cob_id: int, length: int) -> None:
    assert parse_request(frame_of(make_request_can_frame(cob_id, length))) == RequestCanFrame(cob_id, length)


@given(st.binary(max_size=63), TOGGLES, st.booleans())
def test_a_segment_that_was_read_comes_back(data: bytes, toggle: int, more: bool) -> None:
    frame = frame_of(make_segment_answer(data, toggle, more))
    assert parse_answer(make_segment_read(toggle), frame) == Answer(data=data, toggle=toggle, more=more)


@given(st.integers(0, 63), TOGGLES)
def test_the_answer_to_a_written_segment_comes_back(accepted: int, toggle: int) -> None:
    frame = frame_of(make_segment_written_answer(accepted, toggle))
    assert parse_answer(make_segment_write(b"", toggle), frame) == Answer(toggle=toggle, accepted=accepted)


@given(st.binary(max_size=8))
def test_an_asked_for_can_frame_is_cut_to_the_length_asked_for(data: bytes) -> None:
    request = make_request_can_frame(0x181, len(data))
    exact, padded = make_can_frame_answer(data), make_can_frame_answer(data.ljust(8, b"\0"))
    assert parse_answer(request, frame_of(exact)) == parse_answer(request, frame_of(padded)) == Answer(data=data)


@given(st.integers(1, 0xFFFF_FFFF))
def test_an_error_may_come_with_and_without_data(error: int) -> None:
    request = make_read_object(1, 0x6041, 0)
    for raw in (make_read_answer(b"\x01\x02", error), make_done_answer(error)):
        assert parse_answer(request, frame_of(raw)) == Answer(error)


# Damage


@given(st.binary(min_size=1, max_size=64), st.integers(0, 255), st.data())
def test_every_single_wrong_bit_is_found(data: bytes, opcode: int, draw: st.DataObject) -> None:
    frame = make_frame(opcode, data)
    bit = draw.draw(st.integers(0, 8 * len(frame) - 1))
    assert isinstance(parse_frame(_flip(frame, bit)), str)


@pytest.mark.parametrize("text", [text for text, *_ in REQUESTS] + [text for text, *_ in ANSWERS])
def test_every_pair_of_wrong_bits_in_a_published_frame_is_found(text: str) -> None:
    frame = bytes.fromhex(text)
    bits = range(8 * len(frame))
    assert all(isinstance(parse_frame(_flip(_flip(frame, a), b)), str) for a in bits for b in bits if a < b)


@given(st.binary(max_size=600), st.binary(min_size=6, max_size=80))
def test_no_bytes_whatever_raise(raw: bytes, request: bytes) -> None:
    _read_all_ways(raw, request)


@given(st.integers(0, 255), st.binary(min_size=1, max_size=100), st.sampled_from([text for text, *_ in REQUESTS]))
def test_no_frame_with_a_good_crc_raises(opcode: int, data: bytes, request: str) -> None:
    _read_all_ways(make_frame(opcode, data), bytes.fromhex(request))


def test_ten_thousand_random_byte_strings_pass_without_exception() -> None:
    dice = random.Random(309)
    requests = [bytes.fromhex(text) for text, *_ in REQUESTS]
    for turn in range(10_000):
        _read_all_ways(dice.randbytes(turn % 24), requests[turn % len(requests)])


@pytest.mark.parametrize("opcode", [0x00, 0x0F, 0x30, 0x60, 0xFF])
def test_an_unknown_operation_code_is_told(opcode: int) -> None:
    assert parse_request(Frame(opcode, b"\0\0")) == "unknown operation code"


def test_an_answer_of_the_wrong_length_is_told() -> None:
    assert (
        parse_answer(make_read_object(1, 0x6041, 0), Frame(0, bytes(10)))
        == "wrong length for an answer to this request"
    )


def test_a_read_answer_without_error_and_data_is_told() -> None:
    assert parse_answer(make_read_object(1, 0x6041, 0), Frame(0, bytes(4))) == "no error and no data"


def test_a_command_without_answer_takes_none() -> None:
    assert not may_answer(make_send_nmt(0, 1), 4)


def _flip(frame: bytes, bit: int) -> bytes:
    return frame[: bit // 8] + bytes((frame[bit // 8] ^ 1 << bit % 8,)) + frame[bit // 8 + 1 :]


def _read_all_ways(raw: bytes, request: bytes) -> None:
    frame = parse_frame(raw)
    if not isinstance(frame, str):
        parse_request(frame)
        parse_answer(request, frame)
    if raw:
        unchecked = Frame(raw[0], raw[2 : 2 + len(raw[2:]) // 2 * 2] or b"\0\0")
        parse_request(unchecked)
        parse_answer(request, unchecked)
