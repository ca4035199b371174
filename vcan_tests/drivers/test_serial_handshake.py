from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drivers.epos.serial_answers import make_read_answer
from drivers.epos.serial_frames import make_read_object, make_segment_read, make_send_nmt, make_write_object
from drivers.epos.serial_handshake import Handshake, Outcome, Phase

BAUD = 115200
BYTE_S = 10 / BAUD
STATUSWORD = make_read_object(1, 0x6041, 0)
VALUE = make_read_answer(b"\x37\x03")
REQUESTS = st.sampled_from(
    [STATUSWORD, make_write_object(1, 0x6040, 0, b"\x06"), make_segment_read(0), make_send_nmt(0, 1)]
)


def test_the_acknowledged_exchange_goes_step_by_step() -> None:
    handshake = Handshake(BAUD)
    assert handshake.begin(STATUSWORD, 0.0) == b"\x10"
    assert handshake.feed(b"O", 1.0) == STATUSWORD[1:]
    assert handshake.feed(b"O", 2.0) == b""
    assert handshake.feed(b"\0", 3.0) == b"O"
    assert handshake.feed(VALUE[1:], 4.0) == b"O"
    assert handshake.outcome is Outcome.ANSWERED
    assert handshake.answer.data == b"\x37\x03\0\0"


def test_an_acknowledge_counts_from_the_time_at_which_a_drive_can_have_sent_it() -> None:
    handshake = Handshake(BAUD)
    handshake.begin(STATUSWORD, 0.0)
    handshake.feed(b"O", 1.4 * BYTE_S)
    assert (handshake.phase, handshake.strays) == (Phase.READY, 1)
    handshake.feed(b"O", 2.0 * BYTE_S)
    assert handshake.phase is Phase.ACCEPTED


def test_bytes_that_are_still_on_the_wire_count_into_that_time() -> None:
    handshake = Handshake(BAUD)
    handshake.begin(STATUSWORD, 0.0)
    handshake.feed(b"O", 2.0 * BYTE_S)
    handshake.feed(b"O", 9.0 * BYTE_S)
    assert handshake.strays == 1
    handshake.feed(b"O", 10.0 * BYTE_S)
    assert handshake.phase is Phase.ANSWER


def test_a_damaged_answer_is_refused() -> None:
    handshake = Handshake(BAUD)
    handshake.begin(STATUSWORD, 0.0)
    for stamp_s, heard in enumerate((b"O", b"O", b"\0"), 1):
        handshake.feed(heard, stamp_s)
    assert handshake.feed(VALUE[1:-1] + b"\x99", 4.0) == b"F"
    assert handshake.outcome is Outcome.GARBLED


@given(REQUESTS, st.lists(st.one_of(st.sampled_from([b"O", b"\0", VALUE[1:]]), st.binary(max_size=20)), max_size=20))
def test_whatever_a_drive_says_the_exchange_has_an_end(request: bytes, heard: list[bytes]) -> None:
    handshake = Handshake(BAUD)
    handshake.begin(request, 0.0)
    for stamp_s, data in enumerate(heard, 1):
        handshake.feed(data, float(stamp_s))
    if handshake.outcome is None:
        handshake.give_up(1000.0)
    assert handshake.outcome is not None


@given(st.lists(st.one_of(st.sampled_from([b"O", b"\0"]), st.binary(min_size=1, max_size=20)), max_size=20))
def test_no_random_bytes_are_taken_for_a_value(heard: list[bytes]) -> None:
    handshake = Handshake(BAUD)
    handshake.begin(STATUSWORD, 0.0)
    for stamp_s, data in enumerate(heard, 1):
        handshake.feed(data, float(stamp_s))
    assert handshake.outcome is not Outcome.ANSWERED


@given(st.integers(0, 8 * (len(VALUE) - 1) - 1))
def test_no_single_wrong_bit_in_an_answer_is_taken_for_a_value(bit: int) -> None:
    wrong = bytearray(VALUE[1:])
    wrong[bit // 8] ^= 1 << bit % 8
    handshake = Handshake(BAUD)
    handshake.begin(STATUSWORD, 0.0)
    for stamp_s, data in enumerate((b"O", b"O", b"\0", bytes(wrong)), 1):
        handshake.feed(data, float(stamp_s))
    assert handshake.outcome is not Outcome.ANSWERED
