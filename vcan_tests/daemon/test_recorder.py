"""The candump recorder, on a healthy and on a full disk."""

from __future__ import annotations

import asyncio
import errno
import os
import time
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import ConfigError
from daemon.runtime import log_files
from daemon.runtime.clock import run_virtual
from daemon.runtime.events import EventLog
from daemon.runtime.gathering import Gathering
from daemon.runtime.recorder import LIMIT_BYTES, WRITE_PERIOD_S, BusRecorder
from drivers.bus.candump import parse_line
from drivers.bus.contract import RTR_FLAG
from drivers.simulated.bus import SimulatedBus, SimulatedPort
from vcan_tests.robot import running_robot


class FragileDisk(FileIO):
    """A file that takes a few bytes at a time, and none while its disk is ``full``."""

    full = False

    def write(self, data: Any) -> int:
        if self.full:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(data[:7])


@pytest.fixture
def port() -> SimulatedPort:
    return SimulatedBus().port("master")


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[FragileDisk]]:
    monkeypatch.setattr(log_files, "FileIO", FragileDisk)
    yield FragileDisk
    FragileDisk.full = False


def record(port: SimulatedPort, path: Path, limit_bytes: int = LIMIT_BYTES) -> BusRecorder:
    """A recorder that has begun."""
    recorder = BusRecorder(Gathering(port), path, "max2d", EventLog(), limit_bytes)
    recorder.start()
    return recorder


async def test_every_frame_becomes_a_line(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = record(port, tmp_path / "run.log")
    port.send(0x080)
    port.send(0x181, b"\x37\x06")
    port.send(0x701 | RTR_FLAG)
    await asyncio.sleep(0.01)
    recorder.close()
    lines = (tmp_path / "run.log").read_text().splitlines()
    assert lines[0] == "(0000000000.000048) vcan0 080#"
    assert [line.split()[2] for line in lines] == ["080#", "181#3706", "701#R"]
    assert (recorder.frames, recorder.lost, recorder.errors) == (3, 0, 0)


async def test_frames_are_in_the_file_within_the_stated_time(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = record(port, tmp_path / "run.log")
    port.send(0x080)
    await asyncio.sleep(WRITE_PERIOD_S + 0.001)
    assert (tmp_path / "run.log").read_text().count("\n") == 1
    recorder.close()


async def test_nothing_is_recorded_after_the_end(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = record(port, tmp_path / "run.log")
    recorder.close()
    recorder.close()
    port.send(0x080)
    await asyncio.sleep(2.0)
    assert (tmp_path / "run.log").read_text() == ""


async def test_a_folder_gets_a_fresh_file_each_time(port: SimulatedPort, tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    for _ in range(2):
        record(port, folder).close()
    assert sorted(path.name for path in folder.iterdir()) == ["candump-max2d-1.log", "candump-max2d-2.log"]


async def test_an_old_log_is_not_overwritten(port: SimulatedPort, tmp_path: Path) -> None:
    (tmp_path / "run.log").write_text("precious")
    with pytest.raises(ConfigError, match=r"run\.log"):
        record(port, tmp_path / "run.log")
    assert (tmp_path / "run.log").read_text() == "precious"


@pytest.mark.parametrize("reason", [errno.EACCES, errno.EROFS, errno.ENOSPC])
async def test_a_folder_that_cannot_be_written_to_is_told_in_one_sentence_with_the_way_out(
    port: SimulatedPort, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reason: int
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(reason, os.strerror(reason))

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(ConfigError) as caught:
        record(port, tmp_path / "logs")
    assert os.strerror(reason) in caught.value.message
    assert caught.value.remedy == "name a folder that this user may write to, or a new file"


async def send_for_5_s(port: SimulatedPort, disk: type[FragileDisk]) -> None:
    """Five numbered frames; the disk is full while the second to the fourth are sent."""
    for second in range(5):
        disk.full = second in (1, 2, 3)
        port.send(0x181, bytes([second]))
        await asyncio.sleep(1.5)


async def test_a_full_disk_loses_nothing_that_can_be_kept(
    port: SimulatedPort, tmp_path: Path, disk: type[FragileDisk]
) -> None:
    recorder = record(port, tmp_path / "run.log")
    await send_for_5_s(port, disk)
    recorder.close()
    frames = [parse_line(line) for line in (tmp_path / "run.log").read_text().splitlines()]
    assert [frame.data[0] for frame in frames if frame] == [0, 1, 2, 3, 4]
    assert (recorder.errors, recorder.lost) == (3, 0)


async def test_a_full_disk_and_its_end_are_told_once_each(
    port: SimulatedPort, tmp_path: Path, disk: type[FragileDisk]
) -> None:
    events = EventLog()
    recorder = BusRecorder(Gathering(port), tmp_path / "run.log", "max2d", events)
    recorder.start()
    await send_for_5_s(port, disk)
    recorder.close()
    failed, over = events.last(9)
    assert (failed["severity"], "No space left" in failed["message"]) == ("error", True)
    assert failed["remedy"] == "make room on the disk: recording goes on by itself"
    assert (over["severity"], "0 frames are missing" in over["message"]) == ("info", True)


async def test_the_status_says_that_the_disk_is_full(
    port: SimulatedPort, tmp_path: Path, disk: type[FragileDisk]
) -> None:
    recorder = record(port, tmp_path / "run.log")
    disk.full = True
    port.send(0x080)
    await asyncio.sleep(1.0)
    assert recorder.status()["failing"] is True
    recorder.close()


async def test_frames_beyond_what_is_kept_are_counted_as_lost(
    port: SimulatedPort, tmp_path: Path, disk: type[FragileDisk], monkeypatch: pytest.MonkeyPatch
) -> None:
    disk.full = True
    monkeypatch.setattr(log_files, "UNWRITTEN_LIMIT_BYTES", 100)
    recorder = record(port, tmp_path / "run.log")
    for _ in range(10):
        port.send(0x181, bytes(8))
        await asyncio.sleep(1.5)
    recorder.close()
    assert recorder.lost == 10


async def test_a_full_disk_does_not_stop_a_drive(tmp_path: Path, disk: type[FragileDisk]) -> None:
    async with running_robot(record=tmp_path / "logs", expect_errors=True) as robot:
        disk.full = True
        result = await robot.call("drive.parallel", angle_deg=0.0, speed_m_s=0.5, duration_s=1.0)
        status = robot.app.service.status()
    assert (result["steering_error_deg"], status["state"]) == (0.0, "idle")
    assert status["recording"]["failing"] is True
    assert "cannot write to the log" in str(status["events"])


async def test_what_is_kept_free_for_others_is_not_written_on(
    port: SimulatedPort, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_files, "RESERVE_BYTES", 10**18)
    recorder = record(port, tmp_path / "run.log")
    port.send(0x080)
    await asyncio.sleep(0.2)
    assert recorder.status()["failing"] is True
    recorder.close()
    assert (tmp_path / "run.log").read_bytes() == b""


async def send_many(port: SimulatedPort, folder: Path, limit_bytes: int) -> None:
    """Record 400 numbered frames (19 kB)."""
    recorder = record(port, folder, limit_bytes)
    for number in range(400):
        port.send(0x181, number.to_bytes(8, "big"))
        await asyncio.sleep(0.05)
    recorder.close()


def logs_of(folder: Path) -> list[Path]:
    """The logs, oldest first."""
    return sorted(folder.iterdir(), key=lambda path: int(path.stem.rpartition("-")[2]))


def numbers(logs: list[Path]) -> list[int]:
    lines = "".join(log.read_text() for log in logs).splitlines()
    return [int.from_bytes(frame.data, "big") for line in lines if (frame := parse_line(line))]


async def test_a_folder_gets_a_further_file_when_one_is_full_and_misses_no_frame(
    port: SimulatedPort, tmp_path: Path
) -> None:
    await send_many(port, tmp_path / "logs", 8 * 2_000)
    logs = logs_of(tmp_path / "logs")
    assert len(logs) > 5
    assert numbers(logs)[-200:] == list(range(200, 400))


async def test_the_oldest_files_make_room(port: SimulatedPort, tmp_path: Path) -> None:
    await send_many(port, tmp_path / "logs", 8_000)
    logs = logs_of(tmp_path / "logs")
    assert logs[0].name != "candump-max2d-1.log"
    assert sum(log.stat().st_size for log in logs) <= 8_000 + 200


async def test_files_of_others_are_let_alone(port: SimulatedPort, tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    others = [folder / name for name in ("candump-turtle-1.log", "candump-max2d-old.log", "notes.txt")]
    for path in others:
        path.write_text("precious" * 10_000)
    record(port, folder, 1_000).close()
    assert all(path.exists() for path in others)


async def test_a_file_that_is_named_grows_beyond_the_limit_of_a_folder(port: SimulatedPort, tmp_path: Path) -> None:
    recorder = record(port, tmp_path / "run.log", 100)
    for _ in range(20):
        port.send(0x181, bytes(8))
        await asyncio.sleep(0.2)
    recorder.close()
    assert (tmp_path / "run.log").read_text().count("\n") == 20


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    async def run(path: Path) -> None:
        bus = SimulatedBus(seed=7, disturbed=0.2)
        port = bus.port("master")
        recorder = record(port, path)
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
    recorder = record(port, tmp_path / "run.log")
    port.send(0x080)
    await asyncio.sleep(0.02)
    recorder.close()
    frame = parse_line((tmp_path / "run.log").read_text())
    assert frame is not None
    assert frame.timestamp_s == pytest.approx(time.time(), abs=5.0)
