from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import Timeout
from drivers.epos.serial_answers import Answer, make_read_answer
from drivers.epos.serial_frames import Frame, make_read_object, make_send_nmt, make_write_object
from drivers.epos.serial_frames_v2 import DLE, Deframer, make_stuffed_frame, restuffed
from drivers.epos.serial_handshake_v2 import StuffedExchange
from drivers.epos.serial_line import SerialLine

BAUD = 115200
STATUSWORD = make_read_object(1, 0x6041, 0)
FRAMES = st.tuples(
    st.integers(0, 255), st.binary(min_size=1, max_size=100).map(lambda data: data + data[:1] * (len(data) % 2))
)

# The first two are printed in maxon's EPOS4 Communication Guide.
PUBLISHED = [
    ("90 02 60 02 01 B0 30 00 2E 62", 0x60, "01 B0 30 00"),
    ("90 02 00 04 00 00 00 00 01 90 90 00 00 9A 5C", 0x00, "00 00 00 00 01 90 00 00"),
    ("90 02 10 02 41 60 00 01 64 CF", 0x10, "41 60 00 01"),
]


@pytest.mark.parametrize(("text", "opcode", "data"), PUBLISHED)
def test_a_published_frame_is_made_byte_for_byte(text: str, opcode: int, data: str) -> None:
    assert make_stuffed_frame(opcode, bytes.fromhex(data)) == bytes.fromhex(text)


@pytest.mark.parametrize(("text", "opcode", "data"), PUBLISHED)
def test_a_published_frame_is_read(text: str, opcode: int, data: str) -> None:
    assert list(Deframer().feed(bytes.fromhex(text))) == [Frame(opcode, bytes.fromhex(data))]


def test_a_request_of_the_first_generation_is_wrapped_anew() -> None:
    assert restuffed(STATUSWORD) == bytes.fromhex("90 02 10 02 41 60 00 01 64 CF")


@given(st.lists(FRAMES, max_size=5), st.integers(1, 7))
def test_frames_come_back_however_the_stream_is_cut(frames: list[tuple[int, bytes]], size: int) -> None:
    stream = b"".join(make_stuffed_frame(*frame) for frame in frames)
    deframer = Deframer()
    pieces = [stream[start : start + size] for start in range(0, len(stream), size)]
    assert [frame for piece in pieces for frame in deframer.feed(piece)] == [Frame(*frame) for frame in frames]


@given(st.binary(max_size=300).filter(lambda noise: noise[-1:] != bytes((DLE,))))
def test_a_frame_after_any_noise_is_found(noise: bytes) -> None:
    found = list(Deframer().feed(noise + restuffed(STATUSWORD)))
    assert found[-1:] == [Frame(0x10, STATUSWORD[2:-2])]


@given(FRAMES, st.data())
def test_no_single_wrong_bit_brings_another_frame(frame: tuple[int, bytes], draw: st.DataObject) -> None:
    made = make_stuffed_frame(*frame)
    bit = draw.draw(st.integers(0, 8 * len(made) - 1))
    wrong = made[: bit // 8] + bytes((made[bit // 8] ^ 1 << bit % 8,)) + made[bit // 8 + 1 :]
    assert not [found for found in Deframer().feed(wrong) if isinstance(found, Frame)]


@given(st.binary(max_size=600))
def test_no_bytes_whatever_raise(raw: bytes) -> None:
    list(Deframer().feed(raw))


# The line


class Drive:
    """Answers each thing that the host says with the next of its lines, two milliseconds later."""

    def __init__(self, *answers: bytes) -> None:
        self.host: Callable[[bytes, float], None] | None = None
        self.heard: list[bytes] = []
        self._answers = list(answers)

    def write(self, data: bytes) -> None:
        self.heard.append(data)
        if self._answers:
            asyncio.get_running_loop().call_later(0.002, self._speak, self._answers.pop(0))

    def _speak(self, data: bytes) -> None:
        assert self.host is not None
        self.host(data, asyncio.get_running_loop().time())


VALUE = restuffed(make_read_answer(b"\x37\x03"))


def a_line(*answers: bytes) -> tuple[SerialLine, Drive]:
    drive = Drive(*answers)
    return SerialLine(drive, BAUD, exchange=StuffedExchange(BAUD)), drive


async def test_a_read_is_one_frame_each_way() -> None:
    line, drive = a_line(VALUE)
    assert (await line.request(STATUSWORD)).data == b"\x37\x03\0\0"
    assert drive.heard == [restuffed(STATUSWORD)]


@pytest.mark.parametrize("first", [b"", VALUE[:-1], VALUE[:-1] + b"\x01"], ids=["nothing", "half", "wrong CRC"])
async def test_a_read_is_repeated_after_a_bad_answer(first: bytes) -> None:
    line, _ = a_line(first, VALUE)
    assert (await line.request(STATUSWORD)).data == b"\x37\x03\0\0"


async def test_a_write_is_not_repeated() -> None:
    line, drive = a_line(b"")
    with pytest.raises(Timeout, match="may have been carried out"):
        await line.request(make_write_object(1, 0x6040, 0, b"\x06"))
    assert len(drive.heard) == 1


async def test_a_command_without_answer_ends_when_it_is_sent() -> None:
    line, drive = a_line()
    assert await line.request(make_send_nmt(0, 1)) == Answer()
    assert drive.heard == [restuffed(make_send_nmt(0, 1))]
