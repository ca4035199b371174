"""The candump recorder, on a healthy and on a full disk."""

from __future__ import annotations

import asyncio
import errno
import logging
import time
from pathlib import Path

import pytest

from canhelm.errors import ConfigError
from daemon.runtime import recorder as recorder_module
from daemon.runtime.clock import run_virtual
from daemon.runtime.recorder import CandumpRecorder
from drivers.bus.candump import parse_line
from drivers.bus.contract import RTR_FLAG
from drivers.simulated.bus import SimulatedBus, SimulatedPort


class FragileDisk:
    """Stands in for the log's file: writes a few bytes at a time and fails while ``full``."""

    def __init__(self, path: Path, mode: str) -> None:
        self.content = bytearray()
        self.full = False

    def write(self, data: bytearray) -> int:
        if self.full:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.content += data[:7]
        return min(7, len(data))

    def close(self) -> None:
        pass


@pytest.fixture
def port() -> SimulatedPort:
    return SimulatedBus().port("master")


async def test_every_frame_becomes_a_line(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = CandumpRecorder(port, tmp_path / "run.log", "max2d", virtual=True)
    recorder.start()
    port.send(0x080)
    port.send(0x181, b"\x37\x06")
    port.send(0x701 | RTR_FLAG)
    await asyncio.sleep(0.01)
    recorder.close()
    lines = (tmp_path / "run.log").read_text().splitlines()
    assert lines[0] == "(0000000000.000048) vcan0 080#"
    assert [line.split()[2] for line in lines] == ["080#", "181#3706", "701#R"]
    assert (recorder.frames, recorder.lost, recorder.errors) == (3, 0, 0)


async def test_frames_reach_the_disk_within_a_second(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = CandumpRecorder(port, tmp_path / "run.log", "max2d", virtual=True)
    recorder.start()
    port.send(0x080)
    await asyncio.sleep(1.01)
    assert (tmp_path / "run.log").read_text().count("\n") == 1
    recorder.close()


async def test_nothing_is_recorded_after_the_end(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = CandumpRecorder(port, tmp_path / "run.log", "max2d", virtual=True)
    recorder.start()
    recorder.close()
    recorder.close()
    port.send(0x080)
    await asyncio.sleep(2.0)
    assert (tmp_path / "run.log").read_text() == ""


async def test_a_folder_gets_a_fresh_file_each_time(port: SimulatedPort, tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    for _ in range(2):
        recorder = CandumpRecorder(port, folder, "max2d", virtual=True)
        recorder.start()
        recorder.close()
    assert sorted(path.name for path in folder.iterdir()) == ["candump-max2d-1.log", "candump-max2d-2.log"]


async def test_an_old_log_is_not_overwritten(port: SimulatedPort, tmp_path: Path) -> None:
    (tmp_path / "run.log").write_text("precious")
    with pytest.raises(ConfigError, match=r"run\.log"):
        CandumpRecorder(port, tmp_path / "run.log", "max2d").start()
    assert (tmp_path / "run.log").read_text() == "precious"


async def test_a_full_disk_is_said_once_and_loses_nothing(
    port: SimulatedPort, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    disk = FragileDisk(tmp_path, "x")
    monkeypatch.setattr(recorder_module, "FileIO", lambda path, mode: disk)
    recorder = CandumpRecorder(port, tmp_path / "run.log", "max2d", virtual=True)
    recorder.start()
    with caplog.at_level(logging.ERROR):
        for second in range(5):
            disk.full = second in (1, 2, 3)
            port.send(0x181, bytes([second]))
            await asyncio.sleep(1.5)
    recorder.close()
    frames = [parse_line(line) for line in disk.content.decode().splitlines()]
    assert [frame.data[0] for frame in frames if frame] == [0, 1, 2, 3, 4]
    assert (recorder.errors, recorder.status()["failing"]) == (3, False)
    assert [record.getMessage().count("No space left") for record in caplog.records] == [1]


async def test_frames_beyond_what_is_kept_are_counted_as_lost(
    port: SimulatedPort, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = FragileDisk(tmp_path, "x")
    disk.full = True
    monkeypatch.setattr(recorder_module, "FileIO", lambda path, mode: disk)
    monkeypatch.setattr(recorder_module, "PENDING_LIMIT_BYTES", 100)
    recorder = CandumpRecorder(port, tmp_path / "run.log", "max2d", virtual=True)
    recorder.start()
    for _ in range(10):
        port.send(0x181, bytes(8))
    await asyncio.sleep(0.1)
    recorder.close()
    assert recorder.lost == 10


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    async def run(path: Path) -> None:
        bus = SimulatedBus(seed=7, disturbed=0.2)
        port = bus.port("master")
        recorder = CandumpRecorder(port, path, "max2d", virtual=True)
        recorder.start()
        for number in range(100):
            port.send(0x181, bytes([number]))
            await asyncio.sleep(0.013)
        recorder.close()

    run_virtual(run(tmp_path / "one.log"))
    run_virtual(run(tmp_path / "two.log"))
    assert (tmp_path / "one.log").read_bytes() == (tmp_path / "two.log").read_bytes()
    assert (tmp_path / "one.log").read_text().count("\n") == 100


@pytest.mark.real_time
async def test_a_real_log_carries_the_time_of_day(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = CandumpRecorder(port, tmp_path / "run.log", "max2d")
    recorder.start()
    port.send(0x080)
    await asyncio.sleep(0.02)
    recorder.close()
    frame = parse_line((tmp_path / "run.log").read_text())
    assert frame is not None
    assert frame.timestamp_s == pytest.approx(time.time(), abs=5.0)
