"""An electromechanical brake on a digital output of an EPOS 24/5, which has no brake sequence of its own.

Outputs are open drain: with polarity 0 a state bit of 0 sinks current, so the coil is energised, and 1 lets go of it
(maxon EPOS Hardware Reference 7.5.13; Firmware Specification 14.1.41).
"""

from __future__ import annotations

import asyncio
from typing import Any

from canhelm.errors import CanhelmError, Refused
from drivers.contract import BrakeState
from drivers.epos.drive import EposDrive
from profiles.schema import BrakeConfig


class EposBrake:
    """One brake. It is engaged when its drive is configured, and its state is unknown while the drive is not there.

    Args:
        name: its name in the profile.
        config: its wiring and times.
        drive: the drive whose output switches it.
    """

    def __init__(self, name: str, config: BrakeConfig, drive: EposDrive) -> None:
        self.name = name
        self.kind: str = config.kind
        self.drive = drive.name
        self.state = BrakeState.UNKNOWN
        self._config = config
        self._on = drive
        self._timer: asyncio.TimerHandle | None = None
        self._moved: asyncio.Future[None] | None = None
        drive.outputs.use(config.output, config.output_bit, self._level(engaged=True))
        drive.on_ready_change.append(self._on_drive)

    def _level(self, *, engaged: bool) -> bool:
        """State bit for a position of the brake; the coil is energised at 0."""
        return engaged == self._config.energise_to_release

    def _on_drive(self, ready: bool) -> None:
        """The drive has just been configured, output included, or is gone."""
        self._settle(Refused(f"the drive of the {self.name} brake restarted", node=self._on.node))
        self.state = BrakeState.UNKNOWN
        if ready:
            self._begin(BrakeState.ENGAGING, BrakeState.ENGAGED, self._config.close_time_s)

    async def engage(self) -> None:
        """Engage and return after the closing time.

        Raises:
            NotReady: the drive is not ready.
            NodeAbsent, Timeout, Aborted: the output could not be switched.
            Refused: the brake was released in the meantime, or its drive restarted.
        """
        await self._move(BrakeState.ENGAGING, BrakeState.ENGAGED, self._config.close_time_s)

    async def release(self) -> None:
        """Release and return after the opening time; raises as :meth:`engage`."""
        await self._move(BrakeState.RELEASING, BrakeState.RELEASED, self._config.open_time_s)

    async def _move(self, moving: BrakeState, there: BrakeState, time_s: float) -> None:
        self._on.require_ready()
        if self.state is there:
            return
        if self.state is not moving:
            self._settle(Refused(f"the {self.name} brake was switched the other way in the meantime"))
            self.state = moving
            try:
                await self._on.outputs.switch(self._config.output_bit, self._level(engaged=there is BrakeState.ENGAGED))
            except (CanhelmError, asyncio.CancelledError):
                self._settle(None)
                self.state = BrakeState.UNKNOWN
                raise
            if self.state is moving:
                self._begin(moving, there, time_s)
        await self._arrival(moving, there)

    def _begin(self, moving: BrakeState, there: BrakeState, time_s: float) -> None:
        self.state = moving
        self._timer = asyncio.get_running_loop().call_later(time_s, self._arrive, there)

    def _arrive(self, there: BrakeState) -> None:
        self.state = there
        self._settle(None)

    async def _arrival(self, moving: BrakeState, there: BrakeState) -> None:
        """Wait until a brake that moves there is there."""
        if self.state is moving:
            if self._moved is None:
                self._moved = asyncio.get_running_loop().create_future()
            await asyncio.shield(self._moved)
        if self.state is not there:
            raise Refused(f"the {self.name} brake is {self.state}, not {there}", node=self._on.node)

    def _settle(self, error: CanhelmError | None) -> None:
        """End the movement for everybody who waits for it."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        moved, self._moved = self._moved, None
        if moved is None or moved.done():
            return
        if error is None:
            moved.set_result(None)
        else:
            moved.set_exception(error)
            moved.exception()  # seen, also where nobody waits any more

    def status(self) -> dict[str, Any]:
        """State for people and programs."""
        return {
            "name": self.name,
            "kind": self.kind,
            "drive": self.drive,
            "state": str(self.state),
            "open_time_s": self._config.open_time_s,
            "close_time_s": self._config.close_time_s,
        }
