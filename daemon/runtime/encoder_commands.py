"""The ``encoder.*`` methods: where heading 0 is."""

from __future__ import annotations

import asyncio
import math
from typing import Any

from canhelm.errors import DeviceFault, Interlock, NodeAbsent, Timeout
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.interlocks import require_all_disabled
from daemon.runtime.node_commands import MEMORY_TIMEOUT_S, SIGNATURES, STORE
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.codes import NmtCommand
from drivers.contract import NodeState
from drivers.encoder.encoder import Cia406Encoder
from drivers.encoder.objects import OBJECTS

STILL_S = 0.3
"""Time in which the position of a pair that is to be zeroed must not change."""
STILL_COUNTS = 1
FAR_DEG = 30.0
"""A pair that stands farther than this from its old zero is probably not straight (assumed)."""
RESTART_S = 10.0
"""Longest time that an encoder may take to be ready again."""


class EncoderCommands:
    """Handlers of the ``encoder.*`` methods, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.handlers: dict[str, Handler] = {"encoder.status": self._status, "encoder.zero": self._zero}

    def _encoder(self, name: str) -> Cia406Encoder:
        encoders = self._supervisor.devices.encoders
        encoder = encoders.get(name)
        if not isinstance(encoder, Cia406Encoder):
            raise NodeAbsent(f"no encoder {name} in this profile", remedy=f"encoders: {', '.join(encoders) or 'none'}")
        return encoder

    async def _status(self, params: Params, lease: str | None) -> dict[str, Any]:
        names = self._supervisor.devices.encoders if params["pair"] == "all" else [str(params["pair"])]
        return {"encoders": [await self._described(self._encoder(name)) for name in names]}

    async def _described(self, encoder: Cia406Encoder) -> dict[str, Any]:
        encoder.require_ready()
        return {
            **encoder.status(),
            "zero_counts": encoder.config.zero_counts,
            "counts_per_turn": encoder.config.counts_per_turn,
            "offset_counts": await encoder.sdo.read_int(OBJECTS["offset_value"]),
            "calibrated": encoder.config.calibration is not None,
        }

    async def _zero(self, params: Params, lease: str | None) -> dict[str, Any]:
        """The pair stands straight now: the device's preset, kept over a restart, or a value for the profile."""
        encoder = self._encoder(str(params["pair"]))
        encoder.require_ready()
        require_all_disabled(self._supervisor)
        counts = await self._still_counts(encoder)
        heading_deg = math.degrees(encoder.heading_rad)
        if abs(heading_deg) > FAR_DEG and not params["force"]:
            self._refuse_far(encoder, heading_deg)
        old = {
            "pair": encoder.name,
            "store": params["store"],
            "heading_before_deg": round(heading_deg, 1),
            "position_before_counts": counts,
            "zero_before_counts": encoder.config.zero_counts,
            "offset_before_counts": await encoder.sdo.read_int(OBJECTS["offset_value"]),
        }
        stale = encoder.config.calibration is not None
        note = {"note": "its calibration was made with the old zero: calibrate it again"} if stale else {}
        if params["store"] == "profile":
            return {**old, "zero_counts": counts, **note}
        await encoder.preset_zero()
        await self._keep(encoder)
        kept = {"zero_counts": encoder.config.zero_counts, "position_counts": await self._position(encoder)}
        return {**old, **kept, **note}

    def _refuse_far(self, encoder: Cia406Encoder, heading_deg: float) -> None:
        brake = self._supervisor.devices.brakes.get(encoder.name)
        state = f", with its brake {brake.state.value}" if brake is not None else ""
        raise Interlock(
            f"the {encoder.name} pair stands at {heading_deg:.1f} degrees by its old zero{state}: this would become 0",
            node=encoder.node,
            limit=f"{FAR_DEG:g} degrees without --force",
            remedy="turn it straight with its brake released; or say --force where it stands straight now",
        )

    async def _still_counts(self, encoder: Cia406Encoder) -> int:
        """The position of a pair at rest. Raises Interlock where it moves."""
        first = await self._position(encoder)
        await asyncio.sleep(STILL_S)
        require_all_disabled(self._supervisor)
        counts = await self._position(encoder)
        if abs(counts - first) > STILL_COUNTS:
            raise Interlock(
                f"the {encoder.name} pair moves: {abs(counts - first)} counts in {STILL_S:g} s",
                node=encoder.node,
                remedy="zero it at rest, standing straight",
            )
        return counts

    async def _position(self, encoder: Cia406Encoder) -> int:
        return await encoder.sdo.read_int(OBJECTS["position_value"])

    async def _keep(self, encoder: Cia406Encoder) -> None:
        """Save the preset, restart the encoder as after a power-off, and see that heading 0 is still where it was.

        Raises:
            DeviceFault: it is not.
            Timeout: the encoder does not come back.
        """
        async with encoder.configuring:
            encoder.master.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, encoder.node)
            try:
                await encoder.sdo.write_raw(STORE, SIGNATURES[STORE], MEMORY_TIMEOUT_S)
            finally:
                encoder.master.nmt(NmtCommand.RESET_NODE, encoder.node)
        await self._until_ready(encoder)
        found = await self._position(encoder)
        wanted = encoder.config.zero_counts
        if abs(found - wanted) > STILL_COUNTS:
            raise DeviceFault(
                f"{encoder.who} has forgotten its zero at its restart: it says {found}, not {wanted}",
                node=encoder.node,
                object=OBJECTS["preset_value"].address,
                value=found,
                limit=wanted,
                remedy=f"put the zero into the profile: `canhelm encoder zero {encoder.name} --store profile`",
            )

    async def _until_ready(self, encoder: Cia406Encoder) -> None:
        ready: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def look() -> None:
            if encoder.node_state is NodeState.READY and not ready.done():
                ready.set_result(None)

        self._supervisor.observers.append(look)
        try:
            async with asyncio.timeout(RESTART_S):
                await ready
        except TimeoutError:
            raise Timeout(
                f"{encoder.who} did not come back within {RESTART_S:g} s", node=encoder.node, remedy="`canhelm status`"
            ) from None
        finally:
            self._supervisor.observers.remove(look)
