"""``drive.path``: from what a client sends to a motion of a vehicle that can follow paths."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import msgspec

from canhelm.errors import LimitExceeded, UsageError
from daemon.runtime.handlers import Handler, Params, holder, run_motion
from daemon.runtime.motions import Motion
from daemon.runtime.supervisor import Supervisor
from profiles.path_file import MAX_PIECES, PathSpec, PieceSpec, mistake_of

MAX_KEPT = 2
"""Paths that are kept for clients which send them in parts; one more takes the oldest one's place."""
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class PathRequest:
    """What a client wants to be driven.

    Attributes:
        spec: start and pieces, as in a path file.
        backward: what the file says is driven forward is driven backward, and the other way round.
        speed_m_s: no faster than; None: as fast as the vehicle may.
        law: ``cascade`` or ``published``, for vehicles that have both.
    """

    spec: PathSpec
    backward: bool = False
    speed_m_s: float | None = None
    law: str = "cascade"


class PathPlan(ABC):
    """A path that one vehicle can follow, from where it is now."""

    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """What would be driven, for ``dry_run``; part of the motion's result, too."""

    @abstractmethod
    def require_begin(self) -> None:
        """Raise Refused where the vehicle is not at the path's beginning."""

    @abstractmethod
    def motion(self, lease: str | None) -> Motion:
        """The motion that drives it, from its beginning."""


@runtime_checkable
class PathVehicle(Protocol):
    """A vehicle that follows paths; ``drive.path`` is one of its methods."""

    async def plan_path(self, request: PathRequest) -> PathPlan:
        """Check a path and prepare it; a long one in slices between which the control cycle runs.

        Raises:
            UsageError: it is empty, or its pieces do not join; ``object`` is ``pieces[number]``.
            LimitExceeded: a piece is more than the vehicle can do; likewise.
        """
        ...

    def smallest_radius_m(self, *, backward: bool) -> float | None:
        """Of an arc that is driven forward or backward in one go; None where it cannot be driven that way."""
        ...


class PathCommands:
    """The methods ``drive.path`` and ``path.add``, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
        vehicle: its vehicle.

    Attributes:
        located: waits until the vehicle knows where it is, where it has to be told.
    """

    def __init__(self, supervisor: Supervisor, vehicle: PathVehicle) -> None:
        self.located: Callable[[], Awaitable[None]] = _at_once
        self._supervisor, self._vehicle = supervisor, vehicle
        self._kept: dict[str, list[PieceSpec]] = {}
        self._numbers = itertools.count(1)
        self.handlers: dict[str, Handler] = {"drive.path": self._drive, "path.add": self._add}

    async def _add(self, params: Params, lease: str | None) -> dict[str, Any]:
        """Keep pieces of a path that is too long for one request."""
        pieces = converted(params["pieces"], list[PieceSpec])
        name = params.get("kept")
        if name is None:
            name = str(next(self._numbers))
            if len(self._kept) == MAX_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[name] = []
        kept = self._known(name)
        if len(kept) + len(pieces) > MAX_PIECES:
            raise LimitExceeded(
                f"a path of more than {MAX_PIECES} pieces", limit=MAX_PIECES, remedy="drive it in parts"
            )
        kept += pieces
        return {"kept": name, "pieces": len(kept)}

    def _known(self, name: str) -> list[PieceSpec]:
        if name not in self._kept:
            raise UsageError(f"no pieces are kept as {name!r}", value=name, remedy="send them again by path.add")
        return self._kept[name]

    async def _drive(self, params: Params, lease: str | None) -> dict[str, Any]:
        spec = converted(params["path"], PathSpec)
        kept = params.get("kept")
        if kept is not None:
            spec = msgspec.structs.replace(spec, pieces=[*self._known(kept), *spec.pieces])
        dry_run = bool(params.get("dry_run"))
        if not dry_run:
            self._supervisor.require_ready(())
            self._supervisor.require_still(lease)
            await self.located()
        backward, law = bool(params.get("backward")), params.get("law", "cascade")
        plan = await self._vehicle.plan_path(PathRequest(spec, backward, params.get("speed_m_s"), law))
        plan.require_begin()
        if dry_run:
            return plan.summary()
        if kept is not None:
            self._kept.pop(kept, None)
        return await run_motion(self._supervisor, plan.motion(holder(params, lease)), params, lease)


async def _at_once() -> None:
    """An odometry knows from the beginning where the vehicle is."""


def converted(data: Any, kind: type[T]) -> T:
    """What a client sent as an object. Raises UsageError, with the place of the mistake as ``object``."""
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        where, what, remedy = mistake_of(error)
        raise UsageError(f"{where or 'path'}: {what}", object=where or None, remedy=remedy) from None
