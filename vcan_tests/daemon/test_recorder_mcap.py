"""A continuous record as MCAP: whole after each piece, read again by the library's own reader."""

from __future__ import annotations

import asyncio
import io
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from daemon.runs.mcap_bytes import TAIL, make_messages
from daemon.runtime.events import EventLog
from daemon.runtime.gathering import Gathering
from daemon.runtime.log_forms import MCAP
from daemon.runtime.recorder import WRITE_PERIOD_S, BusRecorder
from drivers.bus.candump import pack_frame
from drivers.bus.contract import RTR_FLAG
from drivers.simulated.bus import SimulatedBus, SimulatedPort


@pytest.fixture
def port() -> SimulatedPort:
    return SimulatedBus().port("master")


def messages(data: bytes) -> list[tuple[int, dict[str, Any]]]:
    """Time [ns] and content of each frame of a file that is whole."""
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    return [(message.log_time, json.loads(message.data)) for _, _, message in reader.iter_messages()]


async def test_the_file_is_whole_after_each_piece(port: SimulatedPort, tmp_path: Path) -> None:
    file = tmp_path / "bus.mcap"
    recorder = BusRecorder(Gathering(port), file, "max2d", EventLog())
    recorder.start()
    for number in range(3):
        assert [content["data_hex"] for _, content in messages(file.read_bytes())] == ["00", "01", "02"][:number]
        port.send(0x181, bytes([number]))
        await asyncio.sleep(WRITE_PERIOD_S + 0.01)
    recorder.close()
    assert len(messages(file.read_bytes())) == recorder.frames == 3


async def test_a_full_file_is_followed_by_a_whole_one(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = BusRecorder(Gathering(port), tmp_path / "logs", "max2d", EventLog(), 8 * 3_000, MCAP)
    recorder.start()
    for number in range(100):
        port.send(0x181, bytes([number]))
        await asyncio.sleep(0.05)
    recorder.close()
    files = sorted((tmp_path / "logs").iterdir(), key=lambda path: int(path.stem.rpartition("-")[2]))
    assert (len(files) > 3, files[-1].name) == (True, f"frames-max2d-{len(files)}.mcap")
    told = [content["data_hex"] for file in files for _, content in messages(file.read_bytes())]
    assert told == [f"{number:02X}" for number in range(100)]


def test_a_frame_is_told_with_its_time_of_day() -> None:
    packed = pack_frame(0.5, 0x181, 2, b"\x37\x06") + pack_frame(0.75, 0x701 | RTR_FLAG, 0, b"")
    status, remote = messages(MCAP.head + make_messages(packed, 1_700_000_000.0, "can0") + TAIL)
    assert status == (
        1_700_000_000_500_000_000,
        {"interface": "can0", "id": 0x181, "id_hex": "181", "remote": False, "data_hex": "3706"},
    )
    assert (remote[1]["id"], remote[1]["remote"]) == (0x701, True)


FRAMES = st.lists(st.tuples(st.floats(0.0, 1e6), st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=5)


@given(FRAMES)
def test_any_frames_are_read_as_they_were_written(frames: list[tuple[float, int, bytes]]) -> None:
    packed = b"".join(pack_frame(time_s, can_id, len(data), data) for time_s, can_id, data in frames)
    read = messages(MCAP.head + make_messages(packed, 0.0, "vcan0") + TAIL)
    told = sorted((round(time_s * 1e9), can_id, data.hex().upper()) for time_s, can_id, data in frames)
    assert sorted((time_ns, content["id"], content["data_hex"]) for time_ns, content in read) == told
