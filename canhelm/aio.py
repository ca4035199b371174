"""The asyncio client. Calls may overlap; the lease is renewed by the running loop while a call waits."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncGenerator
from pathlib import Path
from types import TracebackType
from typing import Any

from canhelm import protocol
from canhelm.errors import CanhelmError, DaemonNotRunning, Timeout

_KEPT_NOTIFICATIONS = 256


class Client:
    """A connection to the daemon of one robot; use it with ``async with``.

    Args:
        socket: path of the socket; None: that of ``robot``.
        robot: name of the robot. Without both: what CANHELM_SOCKET or CANHELM_ROBOT names, or the only one that runs.

    Attributes:
        lost_notifications: how many were thrown away because nobody fetched them.
    """

    def __init__(self, socket: str | os.PathLike[str] | None = None, robot: str | None = None) -> None:
        self._socket_path = socket
        self._robot = robot
        self._pending: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._notifications: asyncio.Queue[tuple[str, dict[str, Any]] | None] = asyncio.Queue()
        self._last_id = 0
        self._unanswered = 0
        self._farewell: Exception | None = None
        self._writer: asyncio.StreamWriter | None = None
        self._reading: asyncio.Task[None] | None = None
        self._renewing: asyncio.TimerHandle | None = None
        self.lost_notifications = 0

    async def __aenter__(self) -> Client:
        await self.connect()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        await self.close()

    async def connect(self) -> None:
        """Open the connection.

        Raises:
            DaemonNotRunning: nobody answers there.
            PermissionRefused: this user may not open the socket.
            UsageError: several daemons run and none was chosen, or ``socket`` leads to another robot than ``robot``.
        """
        path = protocol.choose_socket(self._socket_path, self._robot)
        connection = protocol.open_socket(path)
        connection.setblocking(False)
        reader, self._writer = await asyncio.open_connection(sock=connection, limit=protocol.MAX_ANSWER_BYTES)
        self._reading = asyncio.create_task(self._read(reader))
        if self._socket_path and self._robot:
            await self._check(path, self._robot)

    async def _check(self, path: Path, robot: str) -> None:
        try:
            protocol.check_robot(path, robot, await self.call("hello"))
        except CanhelmError:
            await self.close()
            raise

    async def close(self) -> None:
        """Hang up. A motion that this client holds stops."""
        if self._reading is not None:
            self._reading.cancel()
            await asyncio.wait([self._reading])
        if self._writer is not None:
            self._writer.close()

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """Call a method and wait for its result; a motion returns when it is done.

        Args:
            method: name as in ``api.schema``, for instance ``"drive.turn"``.
            params: its parameters; those that are None are left out.

        Raises:
            CanhelmError: the leaf that the daemon answered with.
            DaemonNotRunning: the daemon hung up.
            Timeout: the daemon gives no sign of life.
        """
        loop = asyncio.get_running_loop()
        request = self._send(method, {key: value for key, value in params.items() if value is not None})
        answer: asyncio.Future[dict[str, Any]] = loop.create_future()
        self._pending[request] = answer
        if self._renewing is None:
            self._unanswered = 0
            self._renewing = loop.call_later(protocol.RENEW_PERIOD_S, self._renew)
        try:
            return protocol.result_of(await answer)
        finally:
            self._pending.pop(request, None)

    async def status(self) -> dict[str, Any]:
        """The state of the robot at a glance."""
        return await self.call("status")

    async def stop(self) -> dict[str, Any]:
        """Stop everything now; returns when the robot is at rest."""
        return await self.call("stop")

    async def notifications(self, rate_hz: float = 5.0) -> AsyncGenerator[tuple[str, dict[str, Any]], None]:
        """Subscribe, and yield ("status", {...}) at that rate and ("event", {...}) as they come, without end."""
        await self.call("subscribe", rate_hz=rate_hz)
        while (notification := await self._notifications.get()) is not None:
            yield notification
        raise self._farewell or _gone()

    def _send(self, method: str, params: dict[str, Any]) -> int:
        if self._writer is None or self._reading is None or self._reading.done():
            raise self._farewell or _gone()
        self._last_id += 1
        self._writer.write(protocol.make_request(self._last_id, method, params))
        return self._last_id

    def _renew(self) -> None:
        self._renewing = None
        if not self._pending or self._reading is None or self._reading.done():
            return
        if self._unanswered >= protocol.SILENT_RENEWALS:
            self._fail(Timeout("the daemon does not answer", remedy="restart it; its drives stop by themselves"))
            return
        self._send("lease.renew", {})
        self._unanswered += 1
        self._renewing = asyncio.get_running_loop().call_later(protocol.RENEW_PERIOD_S, self._renew)

    async def _read(self, reader: asyncio.StreamReader) -> None:
        try:
            while line := await reader.readline():
                self._unanswered = 0
                message = protocol.parse_message(line)
                if isinstance(message, dict):
                    protocol.check_farewell(message)
                    self._take(message)
        except CanhelmError as error:
            self._farewell = error
        except (OSError, ValueError):
            pass  # a broken pipe and an endless line end the connection like a hang-up
        finally:
            self._fail(self._farewell or _gone())
            self._notifications.put_nowait(None)

    def _take(self, message: dict[str, Any]) -> None:
        request = message.get("id")
        if isinstance(request, int) and request in self._pending:
            answer = self._pending[request]
            if not answer.done():
                answer.set_result(message)
        elif "method" in message:
            if self._notifications.qsize() >= _KEPT_NOTIFICATIONS:
                self._notifications.get_nowait()
                self.lost_notifications += 1
            self._notifications.put_nowait((str(message["method"]), message.get("params") or {}))

    def _fail(self, error: Exception) -> None:
        for answer in self._pending.values():
            if not answer.done():
                answer.set_exception(error)


def _gone() -> DaemonNotRunning:
    return DaemonNotRunning("the daemon hung up", remedy="look at its last words: journalctl -u 'canhelm@*'")
