"""The synchronous client: a socket, a buffer, and the renewing of the lease while a call waits.

Nothing renews in the background: a program that hangs, is suspended or dies stops renewing by nature, and the daemon
stops the motion that it held. A client belongs to one thread; another thread opens its own (``stop`` needs no lease).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any

from canhelm import protocol
from canhelm.errors import CanhelmError, DaemonNotRunning, Timeout

Notification = tuple[str, dict[str, Any]]


class Client:
    """A connection to the daemon of one robot.

    Args:
        socket: path of the socket; None: that of ``robot``.
        robot: name of the robot. Without both: what CANHELM_SOCKET or CANHELM_ROBOT names, or the only one that runs.

    Attributes:
        path: the socket that was chosen.
        on_notification: called with the method ("status", "event") and params of what arrives while a call waits.

    Raises:
        DaemonNotRunning: nobody answers there.
        PermissionRefused: this user may not open the socket.
        UsageError: several daemons run and none was chosen, or ``socket`` leads to another robot than ``robot``.
    """

    def __init__(self, socket: str | os.PathLike[str] | None = None, robot: str | None = None) -> None:
        self.path = protocol.choose_socket(socket, robot)
        self.on_notification: Callable[[str, dict[str, Any]], None] | None = None
        self._socket = protocol.open_socket(self.path)
        self._received = bytearray()
        self._last_id = 0
        self._renew_at = 0.0
        self._unanswered = 0
        if socket and robot:
            self._check(robot)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Hang up. A motion that this client holds stops."""
        self._socket.close()

    def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """Call a method and wait for its result; a motion returns when it is done.

        Args:
            method: name as in ``api.schema``, for instance ``"drive.turn"``.
            params: its parameters; those that are None are left out.

        Raises:
            CanhelmError: the leaf that the daemon answered with.
            DaemonNotRunning: the daemon hung up.
            Timeout: the daemon gives no sign of life.
        """
        self._unanswered = 0
        request = self._send(method, {key: value for key, value in params.items() if value is not None})
        self._renew_at = time.monotonic() + protocol.RENEW_PERIOD_S
        while True:
            message = self._next_message()
            if message.get("id") == request:
                return protocol.result_of(message)
            if self.on_notification and "method" in message:
                self.on_notification(str(message["method"]), message.get("params") or {})

    def status(self) -> dict[str, Any]:
        """The state of the robot at a glance."""
        return self.call("status")

    def stop(self) -> dict[str, Any]:
        """Stop everything now; returns when the robot is at rest."""
        return self.call("stop")

    def notifications(self, rate_hz: float = 5.0) -> Iterator[Notification]:
        """Subscribe, and yield ("status", {...}) at that rate and ("event", {...}) as they come, without end."""
        self.call("subscribe", rate_hz=rate_hz)
        while True:
            message = self._next_message()
            if "method" in message:
                yield str(message["method"]), message.get("params") or {}

    def _check(self, robot: str) -> None:
        try:
            protocol.check_robot(self.path, robot, self.call("hello"))
        except CanhelmError:
            self.close()
            raise

    def _send(self, method: str, params: dict[str, Any]) -> int:
        self._last_id += 1
        try:
            self._socket.settimeout(protocol.RENEW_PERIOD_S * protocol.SILENT_RENEWALS)
            self._socket.sendall(protocol.make_request(self._last_id, method, params))
        except TimeoutError:
            raise self._hung() from None
        except OSError:
            pass  # it has hung up: reading tells why
        return self._last_id

    def _next_message(self) -> dict[str, Any]:
        """The next message; renews the lease while it waits."""
        while True:
            end = self._received.find(b"\n")
            if end >= 0:
                message = protocol.parse_message(bytes(self._received[:end]))
                del self._received[: end + 1]
                if isinstance(message, dict):
                    protocol.check_farewell(message)
                    return message
            elif len(self._received) > protocol.MAX_ANSWER_BYTES:
                raise self._gone()
            else:
                self._receive()

    def _receive(self) -> None:
        if time.monotonic() >= self._renew_at:
            self._renew()
        self._socket.settimeout(max(0.001, self._renew_at - time.monotonic()))
        try:
            data = self._socket.recv(65_536)
        except TimeoutError:
            return
        except OSError:
            data = b""
        if not data:
            raise self._gone()
        self._received += data
        self._unanswered = 0

    def _renew(self) -> None:
        if self._unanswered >= protocol.SILENT_RENEWALS:
            raise self._hung()
        self._send("lease.renew", {})
        self._unanswered += 1
        self._renew_at = time.monotonic() + protocol.RENEW_PERIOD_S

    def _gone(self) -> DaemonNotRunning:
        return DaemonNotRunning(
            f"the daemon on {self.path} hung up",
            remedy="look at its last words: journalctl -u 'canhelm@*', or its terminal",
        )

    def _hung(self) -> Timeout:
        return Timeout(f"the daemon on {self.path} does not answer", remedy="restart it; its drives stop by themselves")
