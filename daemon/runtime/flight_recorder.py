"""The last minute in memory: every frame and every control cycle, for the moment in which a fault strikes."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from daemon.runtime.motions import Motion
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicle import VehicleState

KEPT_S = 60.0
SLICE_S = 1.0
LATCHED = (VehicleState.FAULT, VehicleState.ESTOP)


class Slice:
    """What one second brought, as lines of text.

    Args:
        begun_s: loop time.

    Attributes:
        frames: of the bus, as candump logs them.
        cycles: rows of a run's table.
        records: of each cycle, everything that went into the laws and came out, as JSON.
    """

    __slots__ = ("begun_s", "cycles", "frames", "records")

    def __init__(self, begun_s: float) -> None:
        self.begun_s = begun_s
        self.frames, self.cycles, self.records = bytearray(), bytearray(), bytearray()

    @property
    def size_bytes(self) -> int:
        """What it takes in memory, and later on the disk."""
        return len(self.frames) + len(self.cycles) + len(self.records)


class FlightRecorder:
    """Keeps the last 60 s, and hands them over when a fault or an emergency stop becomes latched.

    It makes lines at once and not when they are needed: a fault is the worst moment for half a second of work.

    Args:
        supervisor: whose cycles they are.
        limit_bytes: what is kept at most; of more than that, the newest.
        on_fault: called in the cycle in which a stop was found latched, with what is kept, oldest first; nothing is
            changed in it any more.
    """

    def __init__(self, supervisor: Supervisor, limit_bytes: int, on_fault: Callable[[Sequence[Slice]], None]) -> None:
        self._supervisor = supervisor
        self._limit_bytes = limit_bytes
        self._on_fault = on_fault
        self._newest = Slice(-math.inf)
        self._slices = deque([self._newest])
        self._cut_s = -math.inf
        self._latched = False
        self._encode = msgspec.json.Encoder(enc_hook=str).encode

    def take_frame(self, line: bytes, time_s: float) -> None:
        """A frame of the bus, at its loop time."""
        if time_s >= self._cut_s:
            self._cut(time_s)
        self._newest.frames += line

    def take_motion(self, motion: Motion, time_s: float) -> None:
        """What a motion that begins was asked for; its cycles follow."""
        if time_s >= self._cut_s:
            self._cut(time_s)
        begins = {**_name(motion), "drives": motion.drives, "asked": motion.asked}
        self._newest.records += self._encode({"time_s": time_s, "begins": begins}) + b"\n"

    def take_cycle(self, row: str) -> None:
        """A control cycle that is over, with its row of a run's table."""
        supervisor = self._supervisor
        measurement, state = supervisor.measurement, supervisor.state
        assert measurement is not None
        now_s = measurement.time_s
        if now_s >= self._cut_s:
            self._cut(now_s)
        record = {
            "time_s": now_s,
            "state": state,
            "measurement": measurement,
            "command": supervisor.command,
            "limits": supervisor.active_limits,
            "motions": [_step(motion) for motion in supervisor.motions.values()],
        }
        self._newest.cycles += f"{now_s:.4f},{row}\n".encode()
        self._newest.records += self._encode(record) + b"\n"
        self._look(latched=state in LATCHED, now_s=now_s)

    def _look(self, *, latched: bool, now_s: float) -> None:
        if latched and not self._latched:
            self._cut(now_s)
            self._on_fault([kept for kept in self._slices if kept.size_bytes])
        self._latched = latched

    def _cut(self, now_s: float) -> None:
        """Begin the next second, and let go what is too old or too much."""
        self._newest = Slice(now_s)
        self._slices.append(self._newest)
        self._cut_s = now_s + SLICE_S
        size_bytes = sum(kept.size_bytes for kept in self._slices)
        while len(self._slices) > 1 and (size_bytes > self._limit_bytes or self._slices[1].begun_s < now_s - KEPT_S):
            size_bytes -= self._slices.popleft().size_bytes


def _name(motion: Motion) -> dict[str, Any]:
    return {"motion": motion.identity, "kind": motion.kind}


def _step(motion: Motion) -> dict[str, Any]:
    stepped = motion.running and not motion.ended.done()
    return {**_name(motion), "running": stepped, "stop_reason": motion.stop_reason, "terms": motion.terms}
