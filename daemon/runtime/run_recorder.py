"""Each motion leaves a run: what was asked, measured and commanded, and every frame meanwhile; so does each fault."""

from __future__ import annotations

import asyncio
import errno
import logging
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from canhelm import __version__
from canhelm.errors import CanhelmError
from daemon.runs.store import (
    CYCLES,
    DRIVES,
    EVENTS,
    FACTS,
    FAULT,
    PROFILE,
    RunStore,
    make_yaml,
)
from daemon.runtime.cycle_rows import CycleRows
from daemon.runtime.disk import Disk
from daemon.runtime.fault_text import FaultText
from daemon.runtime.flight_recorder import KEPT_S, FlightRecorder, Slice
from daemon.runtime.gathering import Gathering
from daemon.runtime.motions import Motion
from daemon.runtime.recording import Pending, Recording, Step
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.time_of_day import epoch_s
from drivers.bus.candump import make_lines
from drivers.epos.drive import EposDrive
from drivers.simulated.computer_trouble import ComputerTrouble
from profiles.schema import Profile

LOGGER = logging.getLogger("canhelm.runs")
FLUSH_PERIOD_S = 1.0
ROOM = "make room there, or: canhelm runs delete NUMBER"
ELSEWHERE = "keep them in a folder that can be written: canhelm run --runs DIR"


class RunRecorder:
    """Records every motion into a folder of its own, and with every fault the last minute before it.

    Nothing is written within a control cycle: rows and frames are gathered, and written by a thread once a second. A
    disk that fails or is full ends the recording of that run with a warning; the next run tries again.

    Args:
        store: where runs are kept.
        supervisor: whose motions they are.
        gathering: of the bus' frames, which are recorded while something moves.
        profile: the robot as it is run.
        spec: of the bus.
        trouble: what faults make of a simulated robot's computer.

    Attributes:
        message: what the disk said of the newest run; empty while it works.
        remedy: what mends that.
    """

    def __init__(
        self,
        store: RunStore,
        supervisor: Supervisor,
        gathering: Gathering,
        profile: Profile,
        spec: str,
        trouble: ComputerTrouble | None = None,
    ) -> None:
        self.message = self.remedy = ""
        self._store = store
        self._supervisor = supervisor
        self._gathering = gathering
        self._profile = profile
        self._spec = spec
        self._trouble = trouble or ComputerTrouble()
        self._recordings: list[Recording] = []
        self._last: Path | None = None
        self._unended: set[int] = set()
        self._given_up = False

    def start(self) -> None:
        """Record every motion from now on, on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._disk = Disk(self._on_failure, self._trouble)
        self._rows = CycleRows(self._supervisor)
        self._pack = msgspec.msgpack.Encoder(enc_hook=str).encode
        self._profile_yaml = make_yaml(self._profile)
        self._flight = FlightRecorder(self._supervisor, self._store.run_bytes, self._keep_fault)
        self._supervisor.on_motion.append(self._on_motion)
        self._supervisor.observers.append(self._on_cycle)
        self._gathering.join(self._take_frames)

    def close(self) -> None:
        """End the runs under way and write what is left; nothing where it was never started."""
        if self._on_motion not in self._supervisor.on_motion:
            return
        self._supervisor.on_motion.remove(self._on_motion)
        self._supervisor.observers.remove(self._on_cycle)
        self._gathering.leave(self._take_frames)
        for recording in list(self._recordings):
            self._end(recording)
        self._disk.close()

    def status(self) -> dict[str, Any]:
        """The runs for ``status``; one is under way until it is written how it ended."""
        return {
            "folder": str(self._store.folder),
            "last": self._last.name if self._last else None,
            "under_way": sorted(self._unended),
            "message": self.message,
            "remedy": self.remedy,
        }

    # --- guarded: a defect of the recording is no reason to stop a robot ----------------------------------------

    def _on_motion(self, motion: Motion) -> None:
        try:
            self._begin(motion)
            self._flight.take_motion(motion, self._loop.time())
        except Exception:
            LOGGER.exception("the recording of runs failed")
            self._give_up()

    def _on_cycle(self) -> None:
        if self._given_up:
            return
        try:
            self._end_closed()
            values = self._rows.values()
            motions = self._supervisor.motions.items()
            terms = {number: msgspec.Raw(self._pack(motion.terms)) for number, motion in motions}
            self._gather(values, terms)
            self._flight.take_cycle(values, terms)
        except Exception:
            LOGGER.exception("the recording of runs failed")
            self._give_up()

    def _give_up(self) -> None:
        self._given_up = True
        self._recordings.clear()
        self._unended.clear()
        self.message = "the recording of runs failed inside the daemon: report it with the log"
        self.remedy = "canhelm doctor --bundle FILE packs what a report needs"

    # --- a run -------------------------------------------------------------------------------------------------

    def _begin(self, motion: Motion, part: int = 1) -> None:
        self._end_closed()
        self.message, self.remedy, self._given_up = "", "", False
        recording = Recording(motion, part, self._loop.time(), epoch_s(self._trouble))
        recording.facts = self._facts(recording)
        self._recordings.append(recording)
        drives = self._confirmed()
        self._disk.do(partial(self._make_folder, recording, dict(recording.facts), drives))

    def _make_folder(self, recording: Recording, facts: dict[str, Any], drives: dict[str, Any]) -> None:
        """In the disk's thread: the folder, and what is known before the first cycle."""
        self._trouble.require_room()
        folder = self._store.begin()
        (folder / PROFILE).write_bytes(self._profile_yaml)
        (folder / DRIVES).write_bytes(make_yaml(drives))
        (folder / CYCLES).write_bytes(self._rows.head)
        recording.folder = self._last = folder
        self._unended.add(int(folder.name))
        (folder / FACTS).write_bytes(make_yaml(facts))

    def _facts(self, recording: Recording) -> dict[str, Any]:
        motion = recording.motion
        return {
            **self._place(recording.begun_s, recording.epoch_s),
            "kind": "motion",
            "motion": motion.kind,
            "asked": motion.asked,
            "drives": list(motion.drives),
            "part": recording.part,
        }

    def _place(self, begun_s: float, epoch_s: float) -> dict[str, Any]:
        """Whose run it is, and since when; from loop time."""
        vehicle, begun_unix_s = self._profile.vehicle, epoch_s + begun_s
        return {
            "robot": self._profile.name,
            "vehicle": vehicle.type if vehicle else None,
            "begun": _time_of_day(begun_unix_s),
            "begun_unix_s": round(begun_unix_s, 6),
            "bus": self._spec,
            "versions": {"canhelm": __version__, "python": platform.python_version(), "kernel": platform.release()},
        }

    def _confirmed(self) -> dict[str, Any]:
        drives = self._supervisor.devices.drives.values()
        return {
            drive.name: {f"{entry.address} {entry.name}": value for entry, value in drive.confirmed.items()}
            for drive in drives
            if isinstance(drive, EposDrive)
        }

    def _end(self, recording: Recording, ended: str | None = None, message: str = "") -> None:
        self._recordings.remove(recording)
        self._flush(recording)
        facts = {
            **recording.facts,
            "duration_s": round(self._loop.time() - recording.begun_s, 3),
            **({"ended": ended, "message": message, "result": {}} if ended else _ending(recording.motion)),
            "rows": recording.rows,
            "lost_bytes": recording.lost_bytes,
        }
        self._disk.do(partial(self._write_facts, recording, facts))

    def _write_facts(self, recording: Recording, facts: dict[str, Any]) -> None:
        """In the disk's thread."""
        if recording.folder is None:
            return
        try:
            (recording.folder / FACTS).write_bytes(make_yaml(facts))
        finally:
            self._unended.discard(int(recording.folder.name))

    # --- gathering ---------------------------------------------------------------------------------------------

    def _gather(self, values: list[Any], terms: Mapping[str, msgspec.Raw]) -> None:
        now_s = self._loop.time()
        for recording in list(self._recordings):
            if not recording.failed:
                self._take(recording, values, terms[recording.motion.identity], now_s)
            if recording.size_bytes > self._store.run_bytes:
                self._end(recording, "continued", "goes on in the next run")
                self._begin(recording.motion, recording.part + 1)

    def _end_closed(self) -> None:
        self._gathering.hand_out()
        for recording in list(self._recordings):
            if recording.motion.closed.is_set():
                self._end(recording)

    def _take(self, recording: Recording, values: list[Any], terms: msgspec.Raw, now_s: float) -> None:
        recording.rows += 1
        recording.steps.append(Step(now_s - recording.begun_s, values, terms))
        if now_s - recording.flushed_s >= FLUSH_PERIOD_S:
            recording.flushed_s = now_s
            self._flush(recording)

    def _take_frames(self, packed: bytearray) -> None:
        for recording in self._recordings:
            recording.frames += packed
        self._flight.take_frames(packed, self._loop.time())

    # --- faults ------------------------------------------------------------------------------------------------

    def _keep_fault(self, slices: Sequence[Slice]) -> None:
        supervisor, now_s, clock_unix_s = self._supervisor, self._loop.time(), epoch_s(self._trouble)
        facts = {
            "kind": FAULT,
            "motion": ", ".join(motion.kind for motion in supervisor.motions.values()) or None,
            "clock_unix_s": round(clock_unix_s, 6),
            "struck": _time_of_day(clock_unix_s + now_s),
            "ended": str(supervisor.state),
            "message": supervisor.message,
        }
        events = [event for event in supervisor.log.events if event["time_s"] >= now_s - KEPT_S]
        text = FaultText(self._rows, partial(self._make_frames, clock_unix_s), self._store.run_bytes)
        self._disk.do_in_turns(
            *(partial(text.take, kept) for kept in reversed(slices)),
            partial(self._write_fault, text, now_s, facts, self._confirmed(), events),
        )

    def _make_frames(self, epoch_s: float, packed: bytearray) -> bytes:
        return make_lines(packed, epoch_s, self._gathering.bus.name)

    def _write_fault(
        self,
        text: FaultText,
        now_s: float,
        facts: dict[str, Any],
        drives: dict[str, Any],
        events: list[dict[str, Any]],
    ) -> None:
        """In the disk's thread."""
        place = self._place(text.begun_s, facts["clock_unix_s"])
        facts = {**place, **facts, "duration_s": round(now_s - text.begun_s, 3), "rows": text.rows}
        files: dict[str, list[bytes]] = {
            FACTS: [make_yaml(facts)],
            PROFILE: [self._profile_yaml],
            DRIVES: [make_yaml(drives)],
            EVENTS: [msgspec.json.encode(event) + b"\n" for event in events],
            **text.files(),
        }
        self._trouble.require_room()
        self._last = folder = self._store.keep(files)
        told = f"the last {facts['duration_s']:.1f} s before it are run {int(folder.name)}"
        self._loop.call_soon_threadsafe(
            self._supervisor.log.add, "info", "runs", told, f"`canhelm runs show {int(folder.name)}`"
        )

    # --- writing -----------------------------------------------------------------------------------------------

    def _flush(self, recording: Recording) -> None:
        pending = recording.take_pending()
        if recording.failed:
            return
        if not self._disk.do(partial(self._append, recording, pending), pending.size_bytes):
            recording.lost_bytes += pending.size_bytes

    def _append(self, recording: Recording, pending: Pending) -> None:
        """In the disk's thread."""
        self._trouble.require_room()
        recording.append(pending.files(self._rows, partial(self._make_frames, recording.epoch_s)))

    def _on_failure(self, error: OSError) -> None:
        told = f"runs cannot be written to {self._store.folder}: {error.strerror or error}"
        remedy = ROOM if error.errno in (errno.ENOSPC, errno.EDQUOT) else ELSEWHERE
        for recording in self._recordings:
            recording.failed = True
        if not self.message:
            self._supervisor.log.add("warning", "runs", told, f"{remedy}; motions go on")
        self.message, self.remedy = told, remedy


def _time_of_day(unix_s: float) -> str:
    return datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds")


def _ending(motion: Motion) -> dict[str, Any]:
    """How a motion ended, as far as it has."""
    if not motion.ended.done():
        return {"ended": "cut off", "message": "the daemon went down", "result": {}}
    error = motion.ended.exception()
    if error is None:
        return {"ended": "done", "message": "", "result": motion.ended.result()}
    name = "stopped" if motion.stop_reason else type(error).__name__
    message = error.message if isinstance(error, CanhelmError) else str(error)
    return {"ended": name, "message": message, "result": {}}
