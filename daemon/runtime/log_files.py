"""The files of a continuous record: one after the other, within a limit, and on the disk in time."""

from __future__ import annotations

import contextlib
import math
import os
import shutil
from io import FileIO
from pathlib import Path

from daemon.runs.store import RESERVE_BYTES, no_room
from daemon.runtime.log_forms import LogForm
from drivers.simulated.computer_trouble import ComputerTrouble

PARTS = 8
"""A file takes this part of all room; then the next one begins."""
SYNC_PERIOD_S = 1.0
UNWRITTEN_LIMIT_BYTES = 4_000_000
"""What is kept while the disk takes nothing; more is lost."""


class LogFiles:
    """Takes frames, writes them into a file, and begins the next one when it is full. Used by one thread at a time.

    Args:
        path: the log by its suffix, which must not exist yet and grows without another limit than its disk's, or a
            folder, which gets ``candump-<robot>-<n>.log``; it is made where only it is missing, not the one around it.
        form: of the files.
        robot: the robot's name.
        limit_bytes: what the robot's logs of the folder may take together; the oldest are deleted.
        sync: have what was written on the disk once a second (fdatasync(2)), against a power cut.
        trouble: what faults make of a simulated robot's computer.

    Attributes:
        path: the file that is written to, once it is open.
        failing: the last frames have not been written, or not all of them.
        lost: frames that were given up.
    """

    def __init__(
        self, path: Path, form: LogForm, robot: str, limit_bytes: int, *, sync: bool, trouble: ComputerTrouble
    ) -> None:
        self.path = path
        self.failing = False
        self.lost = 0
        self._form = form
        self._folder = None if path.suffix == form.suffix else path
        self._robot = robot
        self._limit_bytes = limit_bytes
        self._sync = sync
        self._trouble = trouble
        self._synced_s = -math.inf
        self._size_bytes = 0
        self._unwritten = bytearray()
        self._unwritten_frames = 0

    def open(self) -> None:
        """Create the first file. Raises OSError."""
        if self._folder is not None:
            self._folder.mkdir(exist_ok=True)
        self._begin(self._create())

    def write(self, told: bytes, frames: int, now_s: float) -> None:
        """Write frames, after those that could not be written before.

        Args:
            told: they, in the form of the files.
            frames: how many.
            now_s: loop time.

        Raises:
            OSError: the disk takes no more; what is left is tried again with the next frames.
        """
        self.failing = True
        if len(self._unwritten) + len(told) > UNWRITTEN_LIMIT_BYTES:
            self.lost += frames
        else:
            self._unwritten += told
            self._unwritten_frames += frames
        self._trouble.require_room()
        if now_s >= self._synced_s + SYNC_PERIOD_S:
            self._bring_to_disk()
            self._make_room()
            self._synced_s = now_s
        self._write_out()
        self._unwritten_frames = 0
        if self._folder is not None and self._size_bytes >= self._limit_bytes // PARTS:
            self._begin_next()
        self.failing = False

    def _begin(self, file: FileIO) -> None:
        self._file, self._size_bytes = file, 0
        self._unwritten += self._form.head
        self._write_out()

    def _write_out(self) -> None:
        """Write what is unwritten, and behind it the end of the file, over which the next piece is written.

        One write(2) takes both, unless the disk is full: whoever is killed leaves a file that is whole.
        """
        while self._unwritten:
            self._file.seek(self._size_bytes)
            written = self._file.write(self._unwritten + self._form.tail)
            taken = min(written, len(self._unwritten))
            self._size_bytes += taken
            del self._unwritten[:taken]

    def close(self) -> None:
        """End the last file; what is unwritten now is lost. Raises OSError."""
        self.lost += self._unwritten_frames
        self._unwritten.clear()
        with self._file:
            self._bring_to_disk()

    def _bring_to_disk(self) -> None:
        if self._sync:
            os.fdatasync(self._file.fileno())

    def _begin_next(self) -> None:
        self._bring_to_disk()
        self._make_room()
        following = self._create()
        self._file.close()
        self._begin(following)

    def _create(self) -> FileIO:
        if self._folder is None:
            return FileIO(self.path, "x")
        number = max((_number(path) for path in self._logs()), default=0)
        while True:
            number += 1
            self.path = self._folder / f"{self._form.name}-{self._robot}-{number}{self._form.suffix}"
            with contextlib.suppress(FileExistsError):
                return FileIO(self.path, "x")

    def _logs(self) -> list[Path]:
        """The robot's logs of the folder, oldest first."""
        assert self._folder is not None
        names = f"{self._form.name}-{self._robot}-*{self._form.suffix}"
        logs = [path for path in self._folder.glob(names) if _number(path)]
        return sorted(logs, key=_number)

    def _make_room(self) -> None:
        """Delete the oldest logs of a folder until there is room for one more. Raises OSError for a full disk."""
        if self._folder is not None:
            sizes = {path: path.stat().st_size for path in self._logs() if path != self.path}
            taken = sum(sizes.values())
            for path, size in sizes.items():
                if taken <= self._limit_bytes * (PARTS - 1) // PARTS and self._free_bytes() >= RESERVE_BYTES:
                    break
                path.unlink()
                taken -= size
        if self._free_bytes() < RESERVE_BYTES:
            raise no_room(self._folder or self.path.parent)

    def _free_bytes(self) -> int:
        return shutil.disk_usage(self._folder or self.path.parent).free


def _number(path: Path) -> int:
    """Of a log by its name; 0 for another file."""
    number = path.stem.rpartition("-")[2]
    return int(number) if number.isdecimal() else 0
