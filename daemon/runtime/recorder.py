"""The plain record of everything that went over the bus, as a candump log."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from io import FileIO
from pathlib import Path
from typing import Any

from canhelm.errors import ConfigError
from drivers.bus.candump import make_line
from drivers.bus.contract import Bus

LOGGER = logging.getLogger("canhelm.recorder")

FLUSH_PERIOD_S = 1.0
PENDING_LIMIT_BYTES = 4_000_000


class CandumpRecorder:
    """Writes every frame of a bus to a candump log, at least once a second and when it is closed.

    A disk that is full or fails does not stop anything: it is said once, what could not be written is kept up to
    4 MB and tried again, and only frames beyond that are lost and counted.

    Args:
        bus: the interface to listen to.
        path: the log (``*.log``), which must not exist yet, or a folder, which gets a new
            ``candump-<robot>-<n>.log``; it is made where only it is missing, not the one around it.
        robot: the robot's name.
        virtual: whether the loop runs on virtual time. Then times count from zero, so that two runs with one seed
            write the same bytes; otherwise they are those of the wall clock.

    Attributes:
        path: the log itself, once it is started.
        frames: frames recorded.
        lost: frames that never reached the log because the disk failed for too long.
        errors: attempts to write that failed.
    """

    def __init__(self, bus: Bus, path: Path, robot: str, *, virtual: bool = False) -> None:
        self.path = path
        self.frames = 0
        self.lost = 0
        self.errors = 0
        self._bus = bus
        self._robot = robot
        self._virtual = virtual
        self._epoch_s = 0.0
        self._file: FileIO | None = None
        self._pending = bytearray()
        self._timer: asyncio.TimerHandle | None = None
        self._failing = False

    def start(self) -> None:
        """Create the log and record from now on. Raises ConfigError where it cannot be created."""
        self._loop = asyncio.get_running_loop()
        if not self._virtual:
            self._epoch_s = time.time() - self._loop.time()
        try:
            self._file = self._create()
        except OSError as error:
            raise ConfigError(
                f"cannot create the log {self.path}: {error.strerror}",
                remedy="name a folder that this user may write to, or a new file",
            ) from error
        self._bus.taps.append(self._record)

    def close(self) -> None:
        """Write what is left and end the log; a recorder that was never started has nothing to do."""
        if self._file is None:
            return
        self._bus.taps.remove(self._record)
        self._flush()
        self.lost += self._pending.count(b"\n")
        try:
            self._file.close()
        except OSError as error:
            self._fail(error)
        self._file = None

    def status(self) -> dict[str, Any]:
        """The log for ``status``."""
        return {
            "path": str(self.path),
            "failing": self._failing,
            "frames": self.frames,
            "lost": self.lost,
            "errors": self.errors,
        }

    def _create(self) -> FileIO:
        if self.path.suffix == ".log":
            return FileIO(self.path, "x")
        folder, number = self.path, 0
        folder.mkdir(exist_ok=True)
        while True:
            number += 1
            self.path = folder / f"candump-{self._robot}-{number}.log"
            with contextlib.suppress(FileExistsError):
                return FileIO(self.path, "x")

    def _record(self, can_id: int, data: bytes, timestamp_s: float) -> None:
        pending = self._pending
        if len(pending) > PENDING_LIMIT_BYTES:
            self.lost += 1
            return
        self.frames += 1
        pending += f"{make_line(self._epoch_s + timestamp_s, self._bus.name, can_id, data)}\n".encode()
        if self._timer is None:
            self._timer = self._loop.call_later(FLUSH_PERIOD_S, self._flush)

    def _flush(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        assert self._file is not None
        try:
            while self._pending:
                del self._pending[: self._file.write(self._pending)]
            self._failing = False
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.errors += 1
        if not self._failing:
            self._failing = True
            LOGGER.error(
                "cannot write to the log %s: %s (make room on the disk: recording goes on by itself)",
                self.path,
                error.strerror,
            )
