"""A robot and those around it, and what they must not see: a motor that faults by itself, a robot that stays down."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager
from pathlib import Path
from random import Random
from typing import Any, Final

from canhelm.aio import Client
from canhelm.errors import CanhelmError
from daemon.app import App

READY_S: Final = 30.0
"""In which a robot whose faults are gone has to be ready: nodes are tried again all the time."""
ANSWER_S: Final = 60.0
"""In which every command has to be answered, whatever is broken."""
LOOK_S: Final = 0.2
PROOF: Final = {"angle_deg": 0.0, "speed_m_s": 0.2, "duration_s": 0.6}
PROOF_WAY_M: Final = 0.06
"""Half of what it commands: steering back to straight ahead comes first, and takes nothing of it away."""


class Defect(Exception):
    """The robot does not do what it has to."""


class Stage:
    """Where everything happens.

    Args:
        app: the daemon, with its simulated robot.
        random: what decides everything.

    Attributes:
        counts: what has happened, by name.
        defects: what must not happen, with its time.
    """

    def __init__(self, app: App, random: Random) -> None:
        assert app.server is not None
        assert app.network is not None
        assert app.gateway is not None
        self.app, self.random = app, random
        self.socket: Path = app.server.path
        self.gateway: Path = app.gateway.path
        self.world = app.network.world
        self.counts: Counter[str] = Counter()
        self.defects: list[str] = []

    def client(self) -> Client:
        """Somebody who has not connected yet."""
        return Client(self.socket)

    async def ask(self, client: Client, method: str, /, **params: Any) -> dict[str, Any] | CanhelmError:
        """What a client is answered, be it a refusal. Raises Defect: nothing."""
        async with self.patience(f"{method} {params}"):
            return await self.answer(client, method, **params)

    async def answer(self, client: Client, method: str, /, **params: Any) -> dict[str, Any] | CanhelmError:
        """The same, with no end of waiting."""
        try:
            return await client.call(method, **params)
        except CanhelmError as error:
            self.counts["refusals"] += 1
            return error

    @asynccontextmanager
    async def patience(self, asked: str) -> AsyncIterator[None]:
        """For what has to be answered in here. Raises Defect: it is not."""
        try:
            async with asyncio.timeout(ANSWER_S):
                yield
        except TimeoutError:
            raise Defect(f"{asked} is not answered within {ANSWER_S:g} s") from None

    def defect(self, told: str) -> None:
        """Write down what must not happen."""
        self.defects.append(f"{asyncio.get_running_loop().time():.3f} s: {told}")

    # --- getting going again -----------------------------------------------------------------------------------

    async def recover(self, what: str) -> None:
        """Get the robot going again after something; one that needs more than a reset for it is a defect."""
        try:
            async with self.client() as person:
                await self._reset(person)
                await self._prove(person)
        except (Defect, CanhelmError) as error:
            self.defect(f"after {what}: {error}")
            await self._cure()

    async def _reset(self, person: Client) -> None:
        """Wait for all nodes, and reset."""
        waited_s = 0.0
        while not await self._is_idle(person):
            if waited_s >= READY_S:
                status = await person.status()
                raise Defect(f"it stays {status['state']}: {status['message']}")
            waited_s += LOOK_S
            await asyncio.sleep(LOOK_S)

    async def _is_idle(self, person: Client) -> bool:
        status = await person.status()
        ready = all(node["node_state"] == "ready" for node in status["nodes"])
        if ready and status["state"] in ("fault", "estop"):
            await self.ask(person, "reset")
            self.counts["resets"] += 1
            status = await person.status()
        return ready and status["state"] == "idle"

    async def _prove(self, person: Client) -> None:
        """Drive a little, by the world's truth."""
        await self.ask(person, "brake.engage")
        x, y, _ = self.world.pose
        answer = await self.ask(person, "drive.parallel", **PROOF)
        way_m = math.hypot(self.world.pose[0] - x, self.world.pose[1] - y)
        if isinstance(answer, CanhelmError) or way_m < PROOF_WAY_M:
            raise Defect(f"it does not drive: {answer}, {way_m:.3f} m")

    async def _cure(self) -> None:
        """Switch the robot off and on, so that what follows says something again."""
        async with self.client() as person:
            for on in (False, True):
                await self.ask(person, "simulation.power", node="all", on=on)
                await asyncio.sleep(2.0)
            try:
                await self._reset(person)
            except Defect as error:
                self.defect(f"switched off and on: {error}")

    async def peace(self, what: str, doing: Awaitable[object]) -> None:
        """Let something happen in which the robot must not fault."""
        await self.happen(what, doing)
        state, message = self.app.service.state, self.app.supervisor.message
        if state in ("fault", "estop"):
            self.defect(f"{what}: {state}: {message}")
            await self.recover(what)

    async def happen(self, what: str, doing: Awaitable[object]) -> None:
        """Let something happen; those who come to the robot must be let in and answered."""
        try:
            await doing
        except (Defect, CanhelmError) as error:
            self.defect(f"{what}: {error}")
            await self.recover(what)
