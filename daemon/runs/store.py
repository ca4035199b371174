"""Where runs are kept: a folder of numbered folders, one a motion, the oldest deleted when there is no room."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import yaml

from canhelm.errors import CanhelmError, ConfigError, UsageError
from profiles.plain_yaml import read_plain

SYSTEM_FOLDER = Path("/var/lib/canhelm")
"""Where the service manager keeps the state of robots' services (StateDirectory= of canhelm@.service)."""
RUNS = "runs"
FACTS, PROFILE, DRIVES = "run.yaml", "profile.yaml", "drives.yaml"
CYCLES, TERMS, FRAMES = "cycles.csv", "terms.jsonl", "frames.log"
RECORDS, EVENTS = "records.jsonl", "events.jsonl"
"""Of a fault alone."""
FAULT = "fault"
"""The kind of a run that no motion but a fault has left."""
DRAFT = ".draft"
"""A run that is being written and has no number yet; what a crash has left of one is overwritten by the next."""
LIMIT_BYTES = 200_000_000
"""What all runs of a robot may take, unless told otherwise."""
PARTS = 8
"""A run takes this part of all room at most; a motion that takes more goes on in a further run."""
RESERVE_BYTES = 50_000_000
"""What runs leave free on their disk for everything else."""
LAST = "last"
UNENDED = "not ended: it runs, or its daemon was killed"
OFF = "off"
"""In place of a folder: keep none."""


@dataclass(frozen=True, slots=True)
class Run:
    """One run that was kept.

    Attributes:
        number: by which people name it.
        folder: with its files.
        facts: of :data:`FACTS`; empty where that file is missing or damaged.
    """

    number: int
    folder: Path
    facts: Mapping[str, Any]

    @property
    def robot(self) -> str:
        """Whose run it is."""
        return str(self.facts.get("robot", ""))

    @property
    def begun(self) -> str:
        """When it began, in UTC; sorts by time."""
        return str(self.facts.get("begun", ""))

    @property
    def when(self) -> str:
        """When its motion began, or its fault struck, in UTC; sorts by time."""
        return str(self.facts.get("struck", self.begun))

    @property
    def ending(self) -> str:
        """How it ended, in words; the name of an error is taken apart (``DeviceFault``: device fault)."""
        ended = self.facts.get("ended")
        return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", str(ended)).lower() if ended else UNENDED

    @property
    def size_bytes(self) -> int:
        """What its files take."""
        return size_of(self.folder)


class RunStore:
    """The runs of one folder.

    Args:
        folder: need not be there yet.
        limit_bytes: what all runs may take.

    Attributes:
        run_bytes: what one of them may take.
    """

    def __init__(self, folder: Path, limit_bytes: int = LIMIT_BYTES) -> None:
        self.folder = folder
        self.limit_bytes = limit_bytes
        self.run_bytes = limit_bytes // PARTS

    def folders(self) -> list[Path]:
        """The folders of runs, oldest first."""
        if not self.folder.is_dir():
            return []
        return sorted(
            (path for path in self.folder.iterdir() if path.name.isdecimal()), key=lambda path: int(path.name)
        )

    def begin(self) -> Path:
        """A new folder for a run, with room made for it. Raises OSError."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.make_room()
        folder = self._next()
        folder.mkdir()
        return folder

    def keep(self, files: Mapping[str, Sequence[bytes | bytearray]]) -> Path:
        """A new run whose files are all known, by name and in pieces.

        It is there as a whole and on the disk when this returns; whatever ends the process or the machine before
        leaves none of it (rename(2) is atomic, and on the disk after an fsync(2) of the folder). Raises OSError.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        self.make_room()
        draft = self.folder / DRAFT
        shutil.rmtree(draft, ignore_errors=True)
        draft.mkdir()
        for name, pieces in files.items():
            with (draft / name).open("xb") as file:
                file.writelines(pieces)
                file.flush()
                os.fsync(file.fileno())
        _sync(draft)
        folder = self._next()
        draft.rename(folder)
        _sync(self.folder)
        return folder

    def _next(self) -> Path:
        number = max((int(path.name) for path in self.folders()), default=0) + 1
        return self.folder / f"{number:04d}"

    def make_room(self) -> None:
        """Delete the oldest runs until there is room for one more. Raises OSError where the disk is full."""
        sizes = {folder: size_of(folder) for folder in self.folders()}
        taken = sum(sizes.values())
        for folder, size in sizes.items():
            if taken + self.run_bytes <= self.limit_bytes and self._free_bytes() >= RESERVE_BYTES:
                return
            shutil.rmtree(folder)
            taken -= size
        if self._free_bytes() < RESERVE_BYTES:
            raise no_room(self.folder)

    def _free_bytes(self) -> int:
        return shutil.disk_usage(self.folder).free


def no_room(folder: Path) -> OSError:
    """Why a folder takes nothing more: its file system is read-only (a small one is full as well), or full."""
    number = errno.EROFS if os.statvfs(folder).f_flag & os.ST_RDONLY else errno.ENOSPC
    return OSError(number, os.strerror(number), str(folder))


def _sync(folder: Path) -> None:
    """Have the names in a folder on the disk."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def size_of(folder: Path) -> int:
    """What the files of a folder take."""
    return sum(path.stat().st_size for path in folder.iterdir() if path.is_file())


def own_folder(robot: str, environment: Mapping[str, str]) -> Path:
    """Where a daemon keeps its runs unless it is told otherwise.

    Under a service manager that is the folder of its state (systemd.exec(5), StateDirectory=), else the person's own
    (XDG Base Directory Specification, XDG_STATE_HOME).
    """
    given = environment.get("STATE_DIRECTORY", "").partition(":")[0]
    return Path(given) / RUNS if given else _person_folder(environment) / robot / RUNS


def _person_folder(environment: Mapping[str, str]) -> Path:
    state = environment.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(state) / "canhelm"


def searched(given: Path | None, environment: Mapping[str, str]) -> list[Path]:
    """Where :func:`all_folders` looks: the folder given, else for a folder a robot in each of these."""
    return [given] if given is not None else [SYSTEM_FOLDER, _person_folder(environment)]


def all_folders(given: Path | None, environment: Mapping[str, str]) -> list[Path]:
    """The folders in which to look for runs.

    Args:
        given: the one that a person named; None: of this person's robots and of the services.
        environment: of this process.

    Raises:
        UsageError: there is no such folder.
        ConfigError: runs of a service are closed to this user.
    """
    if given is not None:
        if not given.is_dir():
            raise UsageError(f"there is no folder {given}", value=str(given), remedy="name a folder of runs")
        return [given]
    found: list[Path] = []
    closed = ""
    for root in searched(None, environment):
        try:
            found += [robot / RUNS for robot in sorted(root.iterdir()) if (robot / RUNS).is_dir()]
        except FileNotFoundError:
            continue
        except PermissionError as error:
            closed = error.filename
    if closed and not found:
        remedy = "join the group: sudo usermod -aG canhelm $USER, then log in again; or give --runs DIR"
        raise ConfigError(f"this user may not look into {closed}", remedy=remedy)
    return found


def read_runs(folders: Iterable[Path], robot: str | None = None) -> list[Run]:
    """All runs of some folders, oldest first; ``robot`` leaves those of others out."""
    runs = [
        Run(int(path.name), path, read_yaml(path / FACTS)) for folder in folders for path in RunStore(folder).folders()
    ]
    return sorted((run for run in runs if robot in (None, run.robot)), key=lambda run: (run.when, run.number))


def choose(runs: list[Run], name: str) -> Run:
    """The run that a person means by a number or ``last``. Raises UsageError."""
    if not runs:
        remedy = "each motion of `canhelm run` leaves one; `canhelm runs` says where they are looked for"
        raise UsageError("there are no runs", remedy=remedy)
    if name == LAST:
        return runs[-1]
    if not (name.isascii() and name.isdecimal()):
        raise UsageError(f"{name!r} is no run", value=name, remedy="give a number of `canhelm runs`, or last")
    found = [run for run in runs if run.number == int(name)]
    if not found:
        raise UsageError(f"there is no run {name}", value=name, remedy="`canhelm runs` lists them")
    if len(found) > 1:
        robots = ", ".join(run.robot for run in found)
        raise UsageError(f"several robots have a run {name}: {robots}", remedy="choose one with --robot NAME")
    return found[0]


def delete(run: Run) -> None:
    """Delete a run. Raises CanhelmError where this user may not."""
    try:
        shutil.rmtree(run.folder)
    except OSError as error:
        remedy = "do it as the user that runs the daemon"
        raise CanhelmError(f"run {run.number} cannot be deleted: {error.strerror}", remedy=remedy) from error


def make_yaml(value: Any) -> bytes:
    """As plain lists, mappings, numbers and words, which is all that YAML takes."""
    plain = msgspec.json.decode(msgspec.json.encode(value, enc_hook=str))
    return yaml.safe_dump(plain, sort_keys=False, allow_unicode=True).encode()


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a file; empty where the file is missing or damaged."""
    try:
        found = read_plain(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
