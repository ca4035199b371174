"""Lines of candump logs."""

from __future__ import annotations

import io

import pytest
from can import CanutilsLogReader
from hypothesis import given
from hypothesis import strategies as st

from drivers.bus.candump import LogFrame, make_line, parse_line
from drivers.bus.contract import RTR_FLAG

FRAMES = st.one_of(
    st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)),
    st.tuples(st.integers(RTR_FLAG, RTR_FLAG | 0x7FF), st.just(b"")),
)
MICROSECONDS = st.integers(0, 4_000_000_000_000_000)


def test_a_line_reads_like_candump() -> None:
    assert make_line(1607120998.528012, "vcan0", 0x181, b"\x37\x06") == "(1607120998.528012) vcan0 181#3706"


def test_a_log_from_time_zero_keeps_the_columns() -> None:
    assert make_line(0.000048, "vcan0", 0x080, b"") == "(0000000000.000048) vcan0 080#"


def test_a_remote_frame_is_marked() -> None:
    assert make_line(1.5, "can1", RTR_FLAG | 0x701, b"") == "(0000000001.500000) can1 701#R"


@pytest.mark.parametrize("text", ["701#R", "701#R8", "701#r1", "701#R T"])
def test_every_spelling_of_a_remote_frame_is_read(text: str) -> None:
    assert parse_line(f"(1.5) can1 {text}\n") == LogFrame(1.5, "can1", RTR_FLAG | 0x701, b"")


@given(MICROSECONDS, FRAMES)
def test_what_is_written_is_read_back(time_us: int, frame: tuple[int, bytes]) -> None:
    can_id, data = frame
    parsed = parse_line(make_line(time_us / 1e6, "vcan0", can_id, data) + "\n")
    assert parsed is not None
    assert parsed[1:] == ("vcan0", can_id, data)
    assert parsed.timestamp_s == pytest.approx(time_us / 1e6, abs=1e-6)


@given(FRAMES)
def test_python_can_reads_what_is_written(frame: tuple[int, bytes]) -> None:
    can_id, data = frame
    message = next(iter(CanutilsLogReader(io.StringIO(make_line(12.25, "vcan0", can_id, data) + "\n"))))
    assert (message.timestamp, message.channel, message.is_extended_id) == (12.25, "vcan0", False)
    assert (message.arbitration_id, message.is_remote_frame) == (can_id & 0x7FF, bool(can_id & RTR_FLAG))
    assert bytes(message.data) == data


@pytest.mark.parametrize(
    "line",
    [
        "",
        "(1.0) vcan0 181",
        "(1.0) vcan0 181#370",
        "(1.0) vcan0 181#370612345678901234",
        "(1.0) vcan0 00000181#3706",
        "(1.0) vcan0 181##03706",
        "(1.0) vcan0 20000088#0000000000000000",
        "(1.0) vcan0 801#00",
        "(1.0) vcan0 701#R9",
        "1.0 vcan0 181#3706",
        "(x) vcan0 181#3706",
    ],
)
def test_what_is_no_base_frame_gives_nothing(line: str) -> None:
    assert parse_line(line) is None


@given(st.text())
def test_reading_never_raises(line: str) -> None:
    assert parse_line(line) is None or line.startswith("(")
