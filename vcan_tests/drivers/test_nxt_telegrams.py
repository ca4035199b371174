from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.nxt import replies, requests
from drivers.nxt.codes import (
    OK,
    STATUSES,
    Output,
    OutputMode,
    Regulation,
    RunState,
    SensorMode,
    SensorType,
    status_of,
)
from drivers.nxt.layout import Telegram
from drivers.nxt.replies import REPLIES
from drivers.nxt.requests import REQUESTS
from drivers.nxt.telegrams import (
    Reply,
    Request,
    Unframer,
    make_frame,
    make_reply,
    make_request,
    parse_reply,
    parse_request,
)

# Those of the test data of an independent library, and of LEGO's Appendix 2.
REQUEST_EXAMPLES: list[tuple[str, Telegram, bool]] = [
    (
        "80 04 01 9C 01 00 FB 20 01 02 03 04",
        requests.SetOutputState(Output.B, -100, OutputMode.MOTOR_ON, Regulation.IDLE, -5, RunState.RUNNING, 0x04030201),
        False,
    ),
    ("80 03 B8 01 E8 03", requests.PlayTone(440, 1000), False),
    ("00 06 01", requests.GetOutputState(Output.B), True),
    ("00 07 02", requests.GetInputValues(2), True),
    ("80 05 02 01 20", requests.SetInputMode(2, SensorType.SWITCH, SensorMode.BOOLEAN), False),
    ("00 08 02", requests.ResetInputScaledValue(2), True),
    ("00 0A 01 01", requests.ResetMotorPosition(Output.B, True), True),
    ("00 0B", requests.GetBatteryLevel(), True),
    ("00 0D", requests.KeepAlive(), True),
    ("00 0E 02", requests.LowSpeedGetStatus(2), True),
    ("00 0F 02 07 09 01 02 03 04 05 06 07", requests.LowSpeedWrite(2, bytes(range(1, 8)), 9), True),
    ("00 10 02", requests.LowSpeedRead(2), True),
    ("00 00" + b"test.rxe".ljust(20, b"\0").hex(), requests.StartProgram("test.rxe"), True),
    ("00 01", requests.StopProgram(), True),
    ("00 09 05 03 68 69 00", requests.MessageWrite(5, b"hi"), True),
    ("00 13 0A 00 01", requests.MessageRead(10, 0, True), True),
    ("01 88", requests.GetFirmwareVersion(), True),
    ("01 9B", requests.GetDeviceInfo(), True),
]
REPLY_EXAMPLES: list[tuple[str, Reply]] = [
    (
        "02 06 00 01 9C 01 00 FB 20 01 02 03 04 11 12 13 14 21 22 23 24 31 32 33 34",
        Reply(
            0x06,
            OK,
            replies.OutputState(1, -100, 1, 0, -5, 0x20, 0x04030201, 0x14131211, 0x24232221, 0x34333231),
        ),
    ),
    (
        "02 07 00 02 01 00 01 20 01 02 11 12 21 22 31 32",
        Reply(0x07, OK, replies.InputValues(2, True, False, 1, 0x20, 0x0201, 0x1211, 0x2221, 0x3231)),
    ),
    ("02 08 00", Reply(0x08)),
    ("02 0A 00", Reply(0x0A)),
    ("02 0B 00 28 23", Reply(0x0B, OK, replies.BatteryLevel(9000))),
    ("02 0D 00 C0 27 09 00", Reply(0x0D, OK, replies.SleepLimit(600_000))),
    ("02 0E 00 07", Reply(0x0E, OK, replies.LowSpeedStatus(7))),
    ("02 0F 00", Reply(0x0F)),
    ("02 10 00 02 41 42" + "00" * 14, Reply(0x10, OK, replies.LowSpeedData(b"AB"))),
    ("02 00 00", Reply(0x00)),
    ("02 01 EC", Reply(0x01, 0xEC)),
    ("02 88 00 01 02 03 04", Reply(0x88, OK, replies.FirmwareVersion(1, 2, 3, 4))),
    (
        "02 9B 00" + b"NXT".ljust(15, b"\0").hex() + "00 16 53 01 02 03 00 01 02 03 04 00 00 01 00",
        Reply(0x9B, OK, replies.DeviceInfo("NXT", "00:16:53:01:02:03", b"\1\2\3\4", 65536)),
    ),
]

BYTE, BOOL = st.integers(0, 0xFF), st.booleans()
NAME = st.text(st.characters(codec="latin-1", exclude_characters="\0"), max_size=19)
FIELDS: dict[str, st.SearchStrategy[Any]] = {
    "B": BYTE,
    "b": st.integers(-128, 127),
    "H": st.integers(0, 0xFFFF),
    "h": st.integers(-0x8000, 0x7FFF),
    "I": st.integers(0, 0xFFFFFFFF),
    "i": st.integers(-0x80000000, 0x7FFFFFFF),
    "?": BOOL,
    "20s": NAME,
    "15s": NAME.map(lambda text: text[:14]),
}
SPECIAL: dict[type[Telegram], st.SearchStrategy[Telegram]] = {
    requests.MessageWrite: st.builds(requests.MessageWrite, BYTE, st.binary(max_size=58)),
    requests.LowSpeedWrite: st.builds(requests.LowSpeedWrite, BYTE, st.binary(max_size=16), BYTE),
    replies.LowSpeedData: st.builds(replies.LowSpeedData, st.binary(max_size=16)),
    replies.Message: st.builds(replies.Message, BYTE, st.binary(max_size=58)),
    replies.DeviceInfo: st.builds(
        replies.DeviceInfo,
        NAME.map(lambda text: text[:15]),
        st.binary(min_size=6, max_size=6).map(lambda data: data.hex(":")),
        st.binary(min_size=4, max_size=4),
        FIELDS["I"],
    ),
}


def any_of(kind: type[Telegram]) -> st.SearchStrategy[Telegram]:
    """Telegrams of a class, built from its layout."""
    if kind in SPECIAL:
        return SPECIAL[kind]
    layout = kind.LAYOUT.replace("20s", "N").replace("15s", "n")
    codes = ({"N": "20s", "n": "15s"}.get(code, code) for code in layout)
    return st.tuples(*(FIELDS[code] for code in codes)).map(lambda values: kind(*values))


REQUEST = st.sampled_from(list(REQUESTS.values())).flatmap(any_of)
REPLY = st.sampled_from(list(REPLIES.values())).flatmap(any_of)


@pytest.mark.parametrize(("telegram", "content", "reply"), REQUEST_EXAMPLES)
def test_published_requests_are_made(telegram: str, content: Telegram, reply: bool) -> None:
    assert make_request(content, reply) == bytes.fromhex(telegram)


@pytest.mark.parametrize(("telegram", "content", "reply"), REQUEST_EXAMPLES)
def test_published_requests_are_understood(telegram: str, content: Telegram, reply: bool) -> None:
    assert parse_request(bytes.fromhex(telegram)) == Request(content, reply)


@pytest.mark.parametrize(("telegram", "reply"), REPLY_EXAMPLES)
def test_published_replies_are_made_and_understood(telegram: str, reply: Reply) -> None:
    assert make_reply(reply) == bytes.fromhex(telegram)
    assert parse_reply(bytes.fromhex(telegram)) == reply


def test_the_published_frames_of_bluetooth_come_out() -> None:
    assert make_frame(make_request(requests.GetBatteryLevel())) == bytes.fromhex("02 00 00 0B")
    assert Unframer().feed(bytes.fromhex("05 00 02 0B 00 28 23")) == [bytes.fromhex("02 0B 00 28 23")]


@given(REQUEST, BOOL)
def test_every_request_survives_the_wire(content: Telegram, reply: bool) -> None:
    telegram = make_request(content, reply)
    assert len(telegram) <= 64
    assert parse_request(telegram) == Request(content, reply)


@given(REPLY)
def test_every_reply_survives_the_wire(content: Telegram) -> None:
    reply = Reply(content.OPCODE, OK, content)
    telegram = make_reply(reply)
    assert len(telegram) <= 64
    assert parse_reply(telegram) == reply


@given(st.binary(max_size=70))
def test_whatever_is_understood_is_made_the_same_way_again(data: bytes) -> None:
    request = parse_request(data)
    if isinstance(request, Request):
        again = parse_request(make_request(request.content, request.wants_reply))
        assert again == request


def test_random_bytes_never_raise() -> None:
    dice = random.Random(7)
    heads = [bytes((kind | silent, opcode)) for kind, opcode in REQUESTS for silent in (0, 0x80)]
    heads += [bytes((2, opcode, 0)) for opcode in range(256)] + [b""]
    for _ in range(100_000):
        data = dice.choice(heads) + dice.randbytes(dice.randrange(66))
        assert isinstance(parse_request(data), Request | str)
        assert isinstance(parse_reply(data), Reply | str)


@given(st.lists(st.binary(min_size=2, max_size=64), max_size=6), st.integers(1, 9))
def test_telegrams_are_found_however_the_stream_is_cut(telegrams: list[bytes], piece: int) -> None:
    stream, unframer = b"".join(map(make_frame, telegrams)), Unframer()
    found = [each for at in range(0, len(stream), piece) for each in unframer.feed(stream[at : at + piece])]
    assert found == telegrams
    assert unframer.dropped == 0


@pytest.mark.parametrize("length", ["00 00", "01 00", "41 00", "FF FF"])
def test_after_an_impossible_length_all_that_came_is_dropped(length: str) -> None:
    unframer = Unframer()
    assert unframer.feed(bytes.fromhex(length) + b"rubbish") == []
    assert unframer.dropped == 9
    assert unframer.feed(make_frame(b"\x02\x0b\x00")) == [b"\x02\x0b\x00"]


@pytest.mark.parametrize(
    "make",
    [
        lambda: make_request(requests.GetOutputState(256)),
        lambda: make_request(requests.SetOutputState(0, 200, 1, 0, 0, 0x20, 0)),
        lambda: make_request(requests.SetOutputState(0, 50, 1, 0, 0, 0x20, -1)),
        lambda: requests.StartProgram("twenty_characters.rxe"),
        lambda: requests.StartProgram("zero\0.rxe"),
        lambda: requests.StartProgram("Ω.rxe"),
        lambda: requests.MessageWrite(0, bytes(59)),
        lambda: requests.LowSpeedWrite(0, bytes(17), 1),
        lambda: requests.SetBrickName("fifteen letters"),
    ],
)
def test_what_a_field_cannot_hold_is_a_value_error(make: Any) -> None:
    with pytest.raises(ValueError, match=r"."):
        make()


@pytest.mark.parametrize(
    ("telegram", "reason"),
    [
        ("", "2 to 64 bytes"),
        ("00 42", "unknown request 00 42"),
        ("00 06", "GetOutputState has 1 bytes"),
        ("00 09 00 09 68 69 00", "a message has its size"),
        ("00 0F 00 05 01 02", "a write to a sensor has its size"),
        ("00 00" + "41" * 20, "at most 19 characters"),
    ],
)
def test_a_bad_request_gets_a_reason(telegram: str, reason: str) -> None:
    assert reason in str(parse_request(bytes.fromhex(telegram)))


@pytest.mark.parametrize(
    ("telegram", "reason"),
    [("02 0B", "3 to 64 bytes"), ("00 0B 00", "does not begin a reply"), ("02 0B 00 28", "BatteryLevel has 2 bytes")],
)
def test_a_bad_reply_gets_a_reason(telegram: str, reason: str) -> None:
    assert reason in str(parse_reply(bytes.fromhex(telegram)))


def test_a_refusal_is_understood_with_and_without_parameters() -> None:
    assert parse_reply(bytes.fromhex("02 0B DF")) == Reply(0x0B, 0xDF)
    assert parse_reply(bytes.fromhex("02 0B DF 00 00")) == Reply(0x0B, 0xDF)


def test_every_status_says_what_to_do() -> None:
    assert len(STATUSES) == 36
    assert all(status.meaning and status.remedy for status in STATUSES.values())
    assert status_of(0x77).remedy
