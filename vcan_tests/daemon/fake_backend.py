"""A daemon behind the socket that remembers what it was asked, and a thread to serve it from."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from canhelm.errors import EmergencyStop, LimitExceeded, NodeAbsent, Refused
from daemon.api.methods import METHODS
from daemon.api.server import Server

FAILURES = {
    7: NodeAbsent("node 7 does not answer", node=7, remedy="check its power"),
    8: LimitExceeded("9000 rpm is beyond the limit", node=8, limit="8000 rpm", remedy="ask for less"),
    9: EmergencyStop("the emergency stop is latched", node=9, remedy="canhelm reset"),
}
SHORT_WAY_S = 0.05
ENDLESS_S = 60.0


class FakeBackend:
    """Fulfils ``daemon.api.server.Backend`` without a bus.

    A motion lasts its ``duration_s``, or until its lease closes or runs out. A stream of ``drive.set`` comes to rest
    when :attr:`at_rest` is set.
    """

    def __init__(self, lease_timeout_s: float = 1.5) -> None:
        self.robot = "fake"
        self.state = "idle"
        self.lease_timeout_s = lease_timeout_s
        self.events: list[Callable[[dict[str, Any]], None]] = []
        self.calls: list[tuple[str, dict[str, Any], str | None]] = []
        self.stopped: list[str] = []
        self.stop_reasons: list[str] = []
        self.called = threading.Event()
        self.ran_out = threading.Event()
        self.renewals = 0
        self.clients: list[dict[str, Any]] = []
        self.taken: list[str] = []
        self.at_rest = asyncio.Event()
        self.at_rest.set()
        self.padding = ""
        self.cycle = {"cycles": 10}
        self.loop: asyncio.AbstractEventLoop
        self._leases: dict[str, asyncio.TimerHandle] = {}
        self._motions: dict[str, list[asyncio.Future[None]]] = {}

    def status(self) -> dict[str, Any]:
        node = {
            "node": 1,
            "name": "rear_right",
            "node_state": "ready",
            "state": "enabled",
            "velocity_rpm": float("nan"),
        }
        return {
            "robot": self.robot,
            "state": self.state,
            "message": self.padding,
            "nodes": [node],
            "cycle": self.cycle,
        }

    def open_lease(self, client: str, details: Mapping[str, Any]) -> str:
        self.clients.append({"client": client, **details})
        lease = f"lease-{len(self._motions) + 1}"
        self._motions[lease] = []
        self._leases[lease] = self._expiry(lease)
        return lease

    def _expiry(self, lease: str) -> asyncio.TimerHandle:
        return asyncio.get_running_loop().call_later(self.lease_timeout_s, self._run_out, lease)

    def _run_out(self, lease: str) -> None:
        self.close_lease(lease)
        self.ran_out.set()

    def renew_lease(self, lease: str) -> None:
        if lease not in self._leases:
            raise Refused(f"{lease} has run out")
        self.renewals += 1
        self._leases.pop(lease).cancel()
        self._leases[lease] = self._expiry(lease)

    def close_lease(self, lease: str, reason: str = "its client hung up") -> None:
        self._leases.pop(lease).cancel()
        for motion in self._motions[lease]:
            if not motion.done():
                self.stopped.append(lease)
                self.stop_reasons.append(reason)
                motion.set_result(None)

    async def end_lease(self, lease: str, reason: str) -> None:
        self.close_lease(lease, reason)
        await self.at_rest.wait()

    async def take_lease(self, lease: str) -> str | None:
        self.taken.append(lease)
        return "somebody"

    async def call(self, method: str, params: dict[str, Any], lease: str | None) -> dict[str, Any]:
        self.calls.append((method, params, lease))
        self.called.set()
        if method == "motor.reset":
            raise ZeroDivisionError("a defect")
        failure = FAILURES.get(params.get("node", 0))
        if failure is not None:
            raise failure
        if lease is not None and params.get("wait"):
            way_s = ENDLESS_S if METHODS[method].ends_by or method == "steer" else SHORT_WAY_S
            await self._move(lease, params.get("duration_s") or way_s)
        return {"motion": "1"} if "wait" in params else {"state": self.state}

    async def _move(self, lease: str, duration_s: float) -> None:
        motion: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._motions[lease].append(motion)
        await asyncio.wait([motion], timeout=duration_s)
        if motion.done():
            raise Refused("the motion was stopped: its client is gone")
        self._motions[lease].remove(motion)


@contextmanager
def served(backend: FakeBackend, path: Path) -> Iterator[Server]:
    """A server for the backend on a real loop in a thread of its own."""
    loop = backend.loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    server = Server(backend, path)
    asyncio.run_coroutine_threadsafe(server.start(), loop).result(5)
    try:
        yield server
    finally:
        asyncio.run_coroutine_threadsafe(_take_down(server), loop).result(5)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(5)
        loop.close()


async def _take_down(server: Server) -> None:
    await server.close()
    for _ in range(10):  # turns of the loop for connections that were just being accepted
        await asyncio.sleep(0)
