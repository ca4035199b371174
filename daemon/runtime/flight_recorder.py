"""The last minute in memory: every frame and every control cycle, for the moment in which a fault strikes."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from daemon.runtime.motions import Motion
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicle import VehicleState

KEPT_S = 60.0
SLICE_S = 1.0
LATCHED = (VehicleState.FAULT, VehicleState.ESTOP)


class Slice:
    """What one second brought, packed: lines of text are made of it when it is written.

    Args:
        begun_s: loop time.

    Attributes:
        frames: of the bus, as :func:`drivers.bus.candump.pack_frame` makes them.
        records: of each cycle, the values of its row and everything that went into the laws and came out; and of each
            motion that begins, what it was asked for. As MessagePack, for :func:`unpack_record`.
    """

    __slots__ = ("_records_bytes", "begun_s", "frames", "records")

    def __init__(self, begun_s: float) -> None:
        self.begun_s = begun_s
        self.frames = bytearray()
        self.records: list[bytes] = []
        self._records_bytes = 0

    def add(self, record: bytes) -> None:
        """The next record."""
        self.records.append(record)
        self._records_bytes += len(record)

    @property
    def size_bytes(self) -> int:
        """What it takes in memory; as text it takes more."""
        return len(self.frames) + self._records_bytes


def unpack_record(packed: bytes) -> tuple[float, list[Any] | None, dict[str, Any]]:
    """Time of a record, the values of its row, where it is that of a cycle, and the record itself."""
    time_s, values, record = msgspec.msgpack.decode(packed)
    return time_s, values, record


class FlightRecorder:
    """Keeps the last 60 s, and hands them over when a fault or an emergency stop becomes latched.

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
        self._encode = msgspec.msgpack.Encoder(enc_hook=str).encode

    def take_frames(self, packed: bytes | bytearray, time_s: float) -> None:
        """Frames of the bus that have come until a loop time."""
        if time_s >= self._cut_s:
            self._cut(time_s)
        self._newest.frames += packed

    def take_motion(self, motion: Motion, time_s: float) -> None:
        """What a motion that begins was asked for; its cycles follow."""
        if time_s >= self._cut_s:
            self._cut(time_s)
        begins = {**_name(motion), "drives": motion.drives, "asked": motion.asked}
        self._newest.add(self._encode((time_s, None, {"time_s": time_s, "begins": begins})))

    def take_cycle(self, row: list[Any], terms: Mapping[str, msgspec.Raw]) -> None:
        """A control cycle that is over.

        Args:
            row: values of its row in a run's table.
            terms: of the motions' laws, as MessagePack, by the motions' numbers.
        """
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
            "motions": [_step(motion, terms[number]) for number, motion in supervisor.motions.items()],
        }
        self._newest.add(self._encode((now_s, row, record)))
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


def _step(motion: Motion, terms: msgspec.Raw) -> dict[str, Any]:
    stepped = motion.running and not motion.ended.done()
    return {**_name(motion), "running": stepped, "stop_reason": motion.stop_reason, "terms": terms}
