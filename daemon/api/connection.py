"""One client's connection: lines in, requests as tasks, answers and notifications out, and its lease."""

from __future__ import annotations

import asyncio
import itertools
import logging
import os
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any

from canhelm import __version__, errors, protocol
from canhelm.errors import CanhelmError, Refused, UsageError
from daemon.api.metering import BYTES_PER_S, REQUESTS_PER_S, Meter
from daemon.api.methods import METHODS, NOTIFICATIONS, stops
from daemon.api.parameters import Method, validate
from daemon.api.peers import Peer
from daemon.runtime.clock import outside_s, pace

if TYPE_CHECKING:
    from daemon.api.server import Server

LOGGER = logging.getLogger("canhelm.api")
MAX_PENDING = 64
"""Requests of one client under way at once."""
LINES_A_TURN = 16
"""Lines of one client handled before the control cycle gets its turn."""
MAX_MALFORMED = 50
"""Lines that are no request after which a client is dropped."""
SLOW_BYTES = 64 * 1024
"""Unsent bytes from which on a client loses samples."""
MAX_UNSENT_BYTES = 1024 * 1024
"""Unsent bytes at which a client is dropped."""
STALLED_S = 10.0
"""Time of lost samples on end after which a client is dropped."""
FAREWELL_S = 0.2
"""How long a client whose line was too long may still send, unheard: it reads its answer when it has sent all."""

_numbers = itertools.count(1)


class Connection(asyncio.Protocol):
    """A client of the daemon.

    Args:
        server: who it belongs to.
        peer: who it is; None: whom the kernel names.

    Attributes:
        subscribed: whether it hears of events.
        crowded: there are too many clients; this one may only stop the robot.
    """

    def __init__(self, server: Server, peer: Peer | None = None) -> None:
        self.subscribed = False
        self.crowded = False
        self._server = server
        self._heard_s = outside_s()
        self._transport: asyncio.Transport | None = None
        self._known = peer is not None
        self._peer = peer or Peer.nobody()
        self._name = f"client {next(_numbers)}"
        self._received = bytearray()
        self._handling = False
        self._deaf = False
        self._malformed = 0
        self._meter: Meter
        self._lease: str | None = None
        self._pending: set[asyncio.Task[None]] = set()
        self._moving: set[asyncio.Task[None]] = set()
        self._lost = 0
        self._slow_since: float | None = None
        self._period_s = 0.2
        self._sampling: asyncio.TimerHandle | None = None
        self._own: dict[str, Callable[[dict[str, Any]], Coroutine[Any, Any, dict[str, Any]]]] = {
            "hello": self._hello,
            "client.name": self._take_name,
            "api.schema": self._schema,
            "status": self._status,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "lease.renew": self._renew,
            "lease.close": self._close_lease,
            "lease.take": self._take_lease,
        }

    # -- the wire -----------------------------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client is there."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._known:
            self._peer = self._server.rights.peer(transport.get_extra_info("socket"))
        self._name = f"client {self._name.split()[-1]} ({self._peer.name or f'pid {self._peer.pid}'})"
        self._meter = self._server.meters.lend(self._peer.uid, self._heard_s)
        self._server.admit(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """It hung up, or was dropped: its motions stop."""
        self._transport = None
        self._received.clear()
        self._stop_sampling()
        self._server.leave(self)
        self._server.meters.give_back(self._peer.uid, self._meter)
        if self._lease is not None:
            self._server.backend.close_lease(self._lease)
            self._lease = None

    def end(self) -> None:
        """Hang up once everything is sent."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Hang up now, whatever is unsent."""
        if self._transport is not None:
            self._transport.abort()

    def dismiss(self) -> None:
        """Hang up for the sake of others, and say why."""
        refusal = Refused("too many clients", remedy="close other clients, and connect again")
        self._answer(None, protocol.INVALID_REQUEST, refusal)
        self._server.counters.dropped_clients += 1
        self.abort()

    @property
    def idle_s(self) -> float:
        """How long nothing was heard of it; 0 while it subscribes or waits for an answer."""
        if self.subscribed or self._pending:
            return 0.0
        return outside_s() - self._heard_s

    def _drop(self, reason: str) -> None:
        if self._transport is not None:
            LOGGER.warning("%s dropped: %s", self._name, reason)
            self._server.counters.dropped_clients += 1
            self.abort()

    def data_received(self, data: bytes) -> None:
        """Bytes came in; the lines in them are handled a few at a time."""
        if self._deaf:
            return
        self._received += data
        self._heard_s = outside_s()
        if not self._handling:
            self._handle_lines()

    def _handle_lines(self) -> None:
        self._handling = False
        for _ in range(LINES_A_TURN):
            end = self._received.find(b"\n")
            if end < 0 or self._transport is None or self._transport.is_closing():
                self._wait_for_more()
                return
            if end > protocol.MAX_REQUEST_BYTES:
                self._refuse_long_line()
                return
            line = bytes(self._received[:end])
            message = protocol.parse_message(line)
            wait_s = 0.0 if stops(message) else self._meter.wait_s(end, outside_s())
            if wait_s and len(self._received) == end + 1:  # it waits for its answers: this one comes later
                self._go_on_later(wait_s)
                return
            del self._received[: end + 1]
            if wait_s:
                self._meter.refuse(end)
            if line.strip():
                self._handle_message(message, too_many=wait_s > 0.0)
        self._go_on_later(self._meter.pause_s())

    def _go_on_later(self, pause_s: float) -> None:
        if self._transport is not None:
            self._handling = True
            self._transport.pause_reading()
            asyncio.get_running_loop().call_later(pause_s * pace(), self._handle_lines)

    def _wait_for_more(self) -> None:
        if self._transport is None or self._transport.is_closing():
            self._received.clear()
            return
        self._transport.resume_reading()
        if len(self._received) > protocol.MAX_REQUEST_BYTES:
            self._refuse_long_line()

    def _refuse_long_line(self) -> None:
        """Answer, and hang up a little later."""
        self._deaf = True
        self._received.clear()
        self._malformed_line(None, f"a line is longer than {protocol.MAX_REQUEST_BYTES} bytes")
        if self._transport is not None:
            self._transport.resume_reading()
        asyncio.get_running_loop().call_later(FAREWELL_S, self.end)

    def _send(self, line: bytes) -> None:
        if self._transport is None or self._transport.is_closing():
            return
        self._transport.write(line)
        if self._transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            self._drop("it does not read its answers")

    # -- requests -----------------------------------------------------------------------------------------------------

    def _handle_message(self, message: dict[str, Any] | str, *, too_many: bool) -> None:
        if isinstance(message, str):
            code = protocol.PARSE_ERROR if message.startswith("not JSON:") else protocol.INVALID_REQUEST
            self._malformed_line(None, message, code)
            return
        request_id = message.get("id")
        if isinstance(request_id, bool) or not isinstance(request_id, int | str | None):
            self._malformed_line(None, "id is neither a number nor a string")
        elif not isinstance(message.get("method"), str):
            self._malformed_line(request_id, "method is missing or no string")
        elif not isinstance(message.get("params", {}), dict):
            self._malformed_line(request_id, "params is no object")
        elif too_many:
            self._refuse_flood(request_id)
        else:
            self._server.counters.requests += 1
            self._begin(request_id, message["method"], message.get("params", {}), "id" in message)

    def _malformed_line(self, request_id: int | str | None, reason: str, code: int = protocol.INVALID_REQUEST) -> None:
        self._server.counters.malformed += 1
        self._malformed += 1
        remedy = "send one JSON-RPC 2.0 object a line; api.schema lists the methods"
        self._answer(request_id, code, UsageError(reason, remedy=remedy))
        if self._malformed >= MAX_MALFORMED:
            self._drop("it sends nonsense")

    def _refuse_flood(self, request_id: int | str | None) -> None:
        self._server.counters.refused += 1
        limit = f"{REQUESTS_PER_S} requests or {BYTES_PER_S} bytes a second"
        refusal = Refused(f"too many at once: more than {limit}", limit=limit, remedy="wait for answers")
        self._answer(request_id, refusal.rpc_code, refusal)

    def _begin(self, request_id: int | str | None, name: str, params: dict[str, Any], answer: bool) -> None:
        try:
            method = self._admitted(name)
            checked = self._peer.signed(name, validate(method, params))
        except CanhelmError as error:
            if answer:
                code = protocol.METHOD_NOT_FOUND if name not in METHODS else error.rpc_code
                self._answer(request_id, code, error)
            return
        task = asyncio.get_running_loop().create_task(self._carry_out(request_id, method, checked, answer))
        groups = (self._server.tasks, self._pending, *((self._moving,) if method.needs_lease else ()))
        for group in groups:
            group.add(task)
            task.add_done_callback(group.discard)

    def _admitted(self, name: str) -> Method:
        method = METHODS.get(name)
        if method is None:
            raise UsageError(f"no method {name[:80]!r}", remedy="api.schema lists the methods")
        refusal = self._server.rights.refusal(self._peer, method.role, method.name)
        if refusal is not None:
            raise refusal
        if self.crowded and not method.urgent and name != "hello":
            raise self._server.crowd_refusal()
        if len(self._pending) >= MAX_PENDING * (1 + method.urgent):
            raise Refused("too many requests under way", limit=MAX_PENDING, remedy="wait for answers")
        return method

    async def _carry_out(self, request_id: int | str | None, method: Method, params: dict[str, Any], ask: bool) -> None:
        try:
            result = await self._call(method, params)
        except CanhelmError as error:
            if ask:
                self._answer(request_id, error.rpc_code, error)
        except Exception:
            LOGGER.exception("%s failed", method.name)
            self._server.counters.internal_errors += 1
            if ask:
                defect = CanhelmError(
                    f"{method.name} failed inside the daemon", remedy="report it with the daemon's log"
                )
                self._answer(request_id, protocol.INTERNAL_ERROR, defect)
        else:
            if ask:
                self._send(protocol.make_result(request_id, result))

    async def _call(self, method: Method, params: dict[str, Any]) -> dict[str, Any]:
        own = self._own.get(method.name)
        if own is not None:
            return await own(params)
        lease = self._held_lease() if method.needs_lease else self._lease
        return await self._server.backend.call(method.name, params, lease)

    def _answer(self, request_id: int | str | None, code: int, error: CanhelmError) -> None:
        self._send(protocol.make_error(request_id, code, error.message, error.data()))

    # -- the lease ----------------------------------------------------------------------------------------------------

    def _held_lease(self) -> str:
        """The connection's lease: a command is a sign of life too, and after one that ran out begins a new one."""
        backend = self._server.backend
        if self._transport is None:
            raise Refused("the client hung up")
        if self._lease is not None:
            try:
                backend.renew_lease(self._lease)
            except Refused:
                self._lease = None
        if self._lease is None:
            self._lease = backend.open_lease(self._peer.told(), self._peer.details())
        return self._lease

    async def _renew(self, params: dict[str, Any]) -> dict[str, Any]:
        if self._lease is not None:
            self._server.backend.renew_lease(self._lease)
        return {"lease": self._lease}

    async def _take_lease(self, params: dict[str, Any]) -> dict[str, Any]:
        return {"taken_from": await self._server.backend.take_lease(self._held_lease())}

    async def _close_lease(self, params: dict[str, Any]) -> dict[str, Any]:
        if self._lease is not None:
            lease, self._lease = self._lease, None
            await self._server.backend.end_lease(lease, "its client ended it")
        if self._moving:
            await asyncio.wait(list(self._moving))
        return {"state": str(self._server.backend.state)}

    # -- looking ------------------------------------------------------------------------------------------------------

    async def _hello(self, params: dict[str, Any]) -> dict[str, Any]:
        backend = self._server.backend
        return {
            "api_version": protocol.API_VERSION,
            "version": __version__,
            "robot": backend.robot,
            "state": str(backend.state),
            "lease_timeout_s": backend.lease_timeout_s,
            "role": self._peer.role,
            "name": self._peer.label,
            "pid": os.getpid(),
        }

    async def _take_name(self, params: dict[str, Any]) -> dict[str, Any]:
        self._peer = self._peer.called(params["name"].strip())
        return {"name": self._peer.label}

    async def _schema(self, params: dict[str, Any]) -> dict[str, Any]:
        return {
            "api_version": protocol.API_VERSION,
            "methods": [method.schema() for method in METHODS.values()],
            "notifications": NOTIFICATIONS,
            "errors": [
                {"type": leaf.__name__, "code": leaf.rpc_code, "exit_code": leaf.exit_code, "doc": leaf.__doc__}
                for leaf in errors.all_errors()
            ],
        }

    async def _status(self, params: dict[str, Any]) -> dict[str, Any]:
        return self._seen()

    def _seen(self) -> dict[str, Any]:
        own = {"role": self._peer.role, "role_remedy": self._server.rights.way_up(self._peer), "lease": self._lease}
        return {**self._server.status(), **{name: value for name, value in own.items() if value is not None}}

    async def _subscribe(self, params: dict[str, Any]) -> dict[str, Any]:
        self._stop_sampling()
        self.subscribed = True
        self._period_s = 1.0 / params["rate_hz"]
        self._sampling = asyncio.get_running_loop().call_later(self._period_s * pace(), self._sample)
        return {"rate_hz": params["rate_hz"]}

    async def _unsubscribe(self, params: dict[str, Any]) -> dict[str, Any]:
        self._stop_sampling()
        return {"lost_samples": self._lost}

    def _stop_sampling(self) -> None:
        self.subscribed = False
        if self._sampling is not None:
            self._sampling.cancel()
            self._sampling = None

    def _sample(self) -> None:
        self._sampling = asyncio.get_running_loop().call_later(self._period_s * pace(), self._sample)
        if self._reads_too_slowly():
            return
        self._send(protocol.make_notification("status", {**self._seen(), "lost_samples": self._lost}))

    def publish(self, line: bytes) -> None:
        """Send a notification, unless the client reads too slowly."""
        if not self._reads_too_slowly():
            self._send(line)

    def _reads_too_slowly(self) -> bool:
        """Whether a sample is lost on this client; one that loses samples for long is dropped."""
        if self._transport is None or self._transport.get_write_buffer_size() <= SLOW_BYTES:
            self._slow_since = None
            return False
        self._lost += 1
        self._server.counters.lost_samples += 1
        self._slow_since = self._slow_since or outside_s()
        if outside_s() - self._slow_since > STALLED_S:
            self._drop("it stopped reading")
        return True
