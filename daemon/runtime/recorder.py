"""The plain record of everything that goes over the bus."""

from __future__ import annotations

import asyncio
from functools import partial
from pathlib import Path
from typing import Any

from canhelm.errors import ConfigError
from daemon.runtime.clock import VirtualTimeLoop
from daemon.runtime.disk import Disk
from daemon.runtime.events import EventLog
from daemon.runtime.gathering import Gathering
from daemon.runtime.log_files import LogFiles
from daemon.runtime.log_forms import CANDUMP, FORMS, LogForm
from daemon.runtime.time_of_day import epoch_s
from drivers.bus.candump import PACKED_BYTES
from drivers.simulated.computer_trouble import ComputerTrouble

WRITE_PERIOD_S = 0.1
"""What the end of the process by a signal that nobody can catch may cost."""
RETRY_PERIOD_S = 1.0
LIMIT_BYTES = 1_000_000_000
"""What all logs of a folder may take, unless told otherwise."""


class BusRecorder:
    """Writes every frame of a bus to a log: ten times a second, by a thread, and when it is closed.

    A disk that is full, fails or is slow stops nothing else: it is an event, what could not be written is kept up to
    4 MB and tried again once a second, and only frames beyond that are lost and counted.

    On virtual time times count from zero, so that two runs with one seed write the same bytes; otherwise they are those
    of the wall clock.

    Args:
        gathering: of the bus.
        path: file or folder, as :class:`daemon.runtime.log_files.LogFiles` takes it.
        robot: the robot's name.
        events: where a disk that fails is told.
        limit_bytes: what the logs of a folder may take.
        form: of the log, unless the suffix of a file says it.
        trouble: what faults make of a simulated robot's computer.

    Attributes:
        errors: attempts to write that failed.
    """

    def __init__(
        self,
        gathering: Gathering,
        path: Path,
        robot: str,
        events: EventLog,
        limit_bytes: int = LIMIT_BYTES,
        form: LogForm = CANDUMP,
        trouble: ComputerTrouble | None = None,
    ) -> None:
        self.errors = 0
        self._loop = asyncio.get_running_loop()
        self._trouble = trouble or ComputerTrouble()
        self._epoch_s = epoch_s(self._trouble)
        sync = not isinstance(self._loop, VirtualTimeLoop)
        self._form = next((each for each in FORMS.values() if path.suffix == each.suffix), form)
        self._files = LogFiles(path, self._form, robot, limit_bytes, sync=sync, trouble=self._trouble)
        self._gathering = gathering
        self._events = events
        self._taken = self._lost = 0
        self._disk: Disk | None = None
        self._pending = bytearray()
        self._timer: asyncio.TimerHandle | None = None
        self._failing = False

    @property
    def path(self) -> Path:
        """The log that is written to now, once it is started."""
        return self._files.path

    @property
    def frames(self) -> int:
        """Frames seen."""
        return self._taken + len(self._pending) // PACKED_BYTES

    @property
    def lost(self) -> int:
        """Frames that never reached a log because the disk failed, or was busy, for too long."""
        return self._lost + self._files.lost

    def start(self) -> None:
        """Create the log and record from now on. Raises ConfigError where it cannot be created."""
        try:
            self._files.open()
        except OSError as error:
            raise ConfigError(
                f"cannot create the log {self.path}: {error.strerror}",
                remedy="name a folder that this user may write to, or a new file",
            ) from error
        self._disk = Disk(self._on_failure, self._trouble)
        self._gathering.join(self._take)
        self._timer = self._loop.call_later(WRITE_PERIOD_S, self._on_timer)

    def close(self) -> None:
        """Write what is left and end the log; a recorder that was never started has nothing to do."""
        if self._disk is None:
            return
        if self._timer is not None:
            self._timer.cancel()
        self._gathering.leave(self._take)
        self._write()
        self._disk.do(self._files.close)
        self._disk.close()
        self._disk = None

    def status(self) -> dict[str, Any]:
        """The log for ``status``."""
        return {
            "path": str(self.path),
            "failing": self._failing,
            "frames": self.frames,
            "lost": self.lost,
            "errors": self.errors,
        }

    def _take(self, packed: bytearray) -> None:
        self._pending += packed

    def _on_timer(self) -> None:
        self._gathering.hand_out()
        if self._pending:
            self._write()
        period_s = RETRY_PERIOD_S if self._failing else WRITE_PERIOD_S
        self._timer = self._loop.call_later(period_s, self._on_timer)

    def _write(self) -> None:
        assert self._disk is not None
        packed, self._pending = self._pending, bytearray()
        self._taken += len(packed) // PACKED_BYTES
        if not self._disk.do(partial(self._write_out, packed, self._loop.time()), len(packed)):
            self._lost += len(packed) // PACKED_BYTES
        if self._failing and not self._files.failing:
            self._failing = False
            self._events.add("info", "recording", f"goes on in {self.path}; {self.lost} frames are missing in all")

    def _write_out(self, packed: bytearray, now_s: float) -> None:
        """In the disk's thread."""
        told = self._form.make(packed, self._epoch_s, self._gathering.bus.name)
        self._files.write(told, len(packed) // PACKED_BYTES, now_s)

    def _on_failure(self, error: OSError) -> None:
        self.errors += 1
        if not self._failing:
            self._failing = True
            told = f"cannot write to the log {self.path}: {error.strerror}"
            self._events.add("error", "recording", told, "make room on the disk: recording goes on by itself")
