"""One run under way: what was gathered of it, and the files that it becomes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from daemon.runs.store import CYCLES, FRAMES, TERMS
from daemon.runtime.cycle_rows import CycleRows
from daemon.runtime.motions import Motion

STEP_BYTES = 500
"""What a step takes in memory, about."""


class Step(NamedTuple):
    """What one control cycle leaves in a run.

    Attributes:
        time_s: since the run's begin.
        values: of its row.
        terms: of the motion's law, as MessagePack.
    """

    time_s: float
    values: list[Any]
    terms: msgspec.Raw


class Pending(NamedTuple):
    """What was gathered and is not written yet."""

    steps: list[Step]
    frames: bytearray

    @property
    def size_bytes(self) -> int:
        """What it takes in memory, about."""
        return STEP_BYTES * len(self.steps) + len(self.frames)

    def files(self, rows: CycleRows, make_frames: Callable[[bytearray], bytes]) -> dict[str, bytes]:
        """Its text, by the names of the files."""
        terms = (
            msgspec.json.encode({"time_s": round(time_s, 4), "terms": msgspec.msgpack.decode(terms)}) + b"\n"
            for time_s, _, terms in self.steps
        )
        return {
            CYCLES: b"".join(rows.text(time_s, values) for time_s, values, _ in self.steps),
            TERMS: b"".join(terms),
            FRAMES: make_frames(self.frames),
        }


class Recording:
    """One run under way.

    Args:
        motion: what leaves it.
        part: counts the runs of one long motion.
        now_s: loop time.
        epoch_s: time of day at which that was zero; a clock that is set meanwhile changes nothing in this run.

    Attributes:
        folder: where its files are; None until the disk has made it, or where it cannot.
        failed: the disk failed: nothing more is recorded of it.
    """

    def __init__(self, motion: Motion, part: int, now_s: float, epoch_s: float) -> None:
        self.motion = motion
        self.part = part
        self.begun_s = self.flushed_s = now_s
        self.epoch_s = epoch_s
        self.folder: Path | None = None
        self.failed = False
        self.facts: dict[str, Any] = {}
        self.steps: list[Step] = []
        self.frames = bytearray()
        self.rows = self.size_bytes = self.lost_bytes = 0

    def take_pending(self) -> Pending:
        """What was gathered since the last time; nothing of it stays."""
        pending = Pending(self.steps, self.frames)
        self.steps, self.frames = [], bytearray()
        return pending

    def append(self, files: dict[str, bytes]) -> None:
        """Write what goes on in its files; nothing where it has no folder. Raises OSError."""
        if self.folder is None:
            return
        for name, data in files.items():
            if data:
                with (self.folder / name).open("ab") as file:
                    file.write(data)
                self.size_bytes += len(data)
