"""The simulated SDO server and the dictionary behind it."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable
from drivers.simulated.dictionary import SimulatedDictionary
from drivers.simulated.sdo_server import SdoServer

TABLE = ObjectTable(
    (
        ObjectDef(0x2000, 0, "number", DataType.U16, Access.RW, "", default=500, low=16, high=7500),
        ObjectDef(0x2000, 1, "signed", DataType.I8, Access.RW, "", default=-3),
        ObjectDef(0x2001, 0, "constant", DataType.U32, Access.CONST, "", default=0x12345678),
        ObjectDef(0x2002, 0, "command", DataType.U8, Access.WO, ""),
        ObjectDef(0x2003, 0, "text", DataType.VISIBLE_STRING, Access.RW, "", default="a text longer than a frame"),
        ObjectDef(0x2004, 0, "blob", DataType.DOMAIN, Access.RW, ""),
        ObjectDef(0x2005, 0, "wide", DataType.U64, Access.RW, "", default=1),
        ObjectDef(0x2006, 0, "new", DataType.U8, Access.RW, "", firmware="later"),
        ObjectDef(0x2007, 0, "of_node", DataType.U32, Access.RO, "", default=0x600, plus_node_id=True),
    )
)


@pytest.fixture(name="server")
def _server() -> SdoServer:
    return make_server()


def make_server() -> SdoServer:
    return SdoServer(SimulatedDictionary(TABLE, 5, {}))


def ask(server: SdoServer, command: int, index: int, sub: int = 0, data: bytes = b"") -> bytes:
    answer = server.answer(struct.pack("<BHB4s", command, index, sub, data))
    assert answer is not None
    assert len(answer) == 8
    return answer


def abort_code(answer: bytes) -> int:
    assert answer[0] == 0x80
    return int.from_bytes(answer[4:], "little")


def upload(server: SdoServer, index: int) -> bytes:
    """Read by segments, as CiA 301 7.2.4.3.5 has it."""
    answer = ask(server, 0x40, index)
    if answer[0] & 0x02:
        return answer[4 : 8 - (answer[0] >> 2 & 3)]
    size, data, toggle = int.from_bytes(answer[4:], "little"), b"", 0
    while True:
        answer = ask(server, 0x60 | toggle, 0)
        assert answer[0] & 0x10 == toggle
        data += answer[1 : 8 - (answer[0] >> 1 & 7)]
        toggle ^= 0x10
        if answer[0] & 1:
            assert len(data) == size
            return data


def download(server: SdoServer, index: int, data: bytes, size: int | None = None) -> bytes:
    """Write by segments; the last answer."""
    answer = ask(server, 0x21, index, 0, (len(data) if size is None else size).to_bytes(4, "little"))
    toggle, segments = 0, [data[i : i + 7] for i in range(0, len(data), 7)] or [b""]
    for number, segment in enumerate(segments):
        if answer[0] == 0x80:
            return answer
        head = toggle | (7 - len(segment)) << 1 | (number == len(segments) - 1)
        answer = server.answer(bytes((head,)) + segment.ljust(7, b"\0")) or b""
        toggle ^= 0x10
    return answer


def test_a_short_object_is_read_in_one_frame(server: SdoServer) -> None:
    assert ask(server, 0x40, 0x2000) == bytes.fromhex("4B002000F4010000")


def test_a_long_object_is_read_in_segments(server: SdoServer) -> None:
    assert upload(server, 0x2003) == b"a text longer than a frame"


def test_an_empty_object_is_read_as_nothing(server: SdoServer) -> None:
    assert upload(server, 0x2004) == b""


def test_a_value_is_written_in_one_frame(server: SdoServer) -> None:
    ask(server, 0x2B, 0x2000, 0, b"\x10\x01")
    assert ask(server, 0x40, 0x2000)[4:6] == b"\x10\x01"


def test_a_write_without_a_size_takes_as_many_bytes_as_the_object_has(server: SdoServer) -> None:
    assert ask(server, 0x22, 0x2000, 1, b"\xfe\xff\xff\xff")[0] == 0x60
    assert ask(server, 0x40, 0x2000, 1)[4] == 0xFE


def test_a_default_that_depends_on_the_node_id_is_complete(server: SdoServer) -> None:
    assert ask(server, 0x40, 0x2007)[4:6] == b"\x05\x06"


@given(st.binary(max_size=60))
def test_what_is_written_in_segments_is_read_back(data: bytes) -> None:
    server = make_server()
    assert download(server, 0x2004, data)[0] & 0xE0 == 0x20
    assert upload(server, 0x2004) == data


@pytest.mark.parametrize(
    ("command", "index", "sub", "data", "code"),
    [
        (0x40, 0x5555, 0, b"", 0x06020000),
        (0x40, 0x2000, 9, b"", 0x06090011),
        (0x40, 0x2006, 0, b"", 0x06020000),
        (0x40, 0x2002, 0, b"", 0x06010001),
        (0x23, 0x2001, 0, b"\1\0\0\0", 0x06010002),
        (0x23, 0x2000, 0, b"\0\1\0\0", 0x06070012),
        (0x2F, 0x2000, 0, b"\1", 0x06070013),
        (0x2B, 0x2000, 0, b"\xff\xff", 0x06090031),
        (0x2B, 0x2000, 0, b"\x01\x00", 0x06090032),
        (0xA0, 0x2000, 0, b"", 0x05040001),
        (0xC0, 0x2000, 0, b"", 0x05040001),
        (0xE0, 0x2000, 0, b"", 0x05040001),
        (0x00, 0x2000, 0, b"", 0x05040001),
        (0x60, 0x2000, 0, b"", 0x05040001),
        (0x21, 0x2004, 0, b"\xff\xff\xff\xff", 0x05040005),
        (0x21, 0x5555, 0, b"\1\0\0\0", 0x06020000),
    ],
)
def test_a_refusal_names_its_reason(command: int, index: int, sub: int, data: bytes, code: int) -> None:
    assert abort_code(ask(make_server(), command, index, sub, data)) == code


def test_a_repeated_toggle_bit_ends_an_upload(server: SdoServer) -> None:
    ask(server, 0x40, 0x2003)
    ask(server, 0x60, 0)
    assert abort_code(ask(server, 0x60, 0)) == 0x05030000


def test_an_abort_within_segments_names_the_object(server: SdoServer) -> None:
    ask(server, 0x40, 0x2003)
    assert ask(server, 0x70, 0)[1:4] == b"\x03\x20\x00"


def test_a_wrong_toggle_bit_ends_a_download(server: SdoServer) -> None:
    ask(server, 0x21, 0x2004, 0, b"\x0e\0\0\0")
    assert abort_code(server.answer(bytes((0x10,)) + bytes(7)) or b"") == 0x05030000


def test_less_data_than_announced_is_a_wrong_length(server: SdoServer) -> None:
    assert abort_code(download(server, 0x2004, b"abc", size=5)) == 0x06070010


def test_more_data_than_announced_is_too_long(server: SdoServer) -> None:
    assert abort_code(download(server, 0x2004, b"abcdefghi", size=5)) == 0x06070012


def test_a_wide_number_is_written_in_segments(server: SdoServer) -> None:
    download(server, 0x2005, bytes(range(8)))
    assert upload(server, 0x2005) == bytes(range(8))


def test_the_clients_abort_ends_a_transfer_without_an_answer(server: SdoServer) -> None:
    ask(server, 0x40, 0x2003)
    assert server.answer(struct.pack("<BHBI", 0x80, 0x2003, 0, 0x05040000)) is None
    assert abort_code(ask(server, 0x60, 0)) == 0x05040001


@given(st.lists(st.binary(min_size=8, max_size=8), max_size=20))
def test_whatever_comes_the_server_answers_or_keeps_silent(requests: list[bytes]) -> None:
    server = make_server()
    for request in requests:
        answer = server.answer(request)
        assert answer is None or len(answer) == 8


def test_saved_values_outlive_a_restart_and_others_do_not() -> None:
    dictionary = SimulatedDictionary(TABLE, 5, {}, volatile=("signed",))
    dictionary.set_number((0x2000, 0), 600)
    dictionary.set_number((0x2000, 1), 7)
    dictionary.save()
    dictionary.set_number((0x2000, 0), 700)
    dictionary.restart()
    assert (dictionary.number("number"), dictionary.number("signed")) == (600, -3)


def test_restored_defaults_count_after_a_restart() -> None:
    dictionary = SimulatedDictionary(TABLE, 5, {})
    dictionary.set_number((0x2000, 0), 600)
    dictionary.save()
    dictionary.forget()
    assert dictionary.number("number") == 600
    dictionary.restart()
    assert dictionary.number("number") == 500
