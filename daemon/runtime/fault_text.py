"""The tables of a fault's run, made of what was kept packed, one second at a time."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec

from daemon.runs.store import CYCLES, FRAMES, RECORDS
from daemon.runtime.cycle_rows import CycleRows
from daemon.runtime.flight_recorder import Slice, unpack_record


class FaultText:
    """Takes slices, the newest first, as long as there is room.

    Args:
        rows: of the robot.
        make_frames: makes the log of packed frames.
        limit_bytes: what all files may take.

    Attributes:
        begun_s: loop time of the oldest slice that was taken.
        rows: lines of the run's table.
    """

    def __init__(self, rows: CycleRows, make_frames: Callable[[bytearray], bytes], limit_bytes: int) -> None:
        self.begun_s = math.inf
        self.rows = 0
        self._head = rows.head
        self._row_text = rows.text
        self._make_frames = make_frames
        self._left_bytes = limit_bytes
        self._frames: list[bytes] = []
        self._cycles: list[bytes] = []
        self._records: list[bytes] = []

    def take(self, kept: Slice) -> None:
        """The next older slice; none is taken any more after the first that does not fit."""
        records = [unpack_record(packed) for packed in kept.records]
        frames = self._make_frames(kept.frames)
        cycles = [self._row_text(time_s, values) for time_s, values, _ in records if values is not None]
        told = b"".join(msgspec.json.encode(record) + b"\n" for _, _, record in records)
        self._left_bytes -= len(frames) + sum(map(len, cycles)) + len(told)
        if self._left_bytes < 0 and self._frames:
            return
        self.begun_s = kept.begun_s
        self.rows += len(cycles)
        self._frames.append(frames)
        self._cycles.append(b"".join(cycles))
        self._records.append(told)

    def files(self) -> dict[str, list[bytes]]:
        """The files by their names, oldest line first."""
        return {
            CYCLES: [self._head, *reversed(self._cycles)],
            RECORDS: self._records[::-1],
            FRAMES: self._frames[::-1],
        }
