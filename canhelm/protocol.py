"""What goes over the socket, and where the socket is: JSON-RPC 2.0, one object a line, on a Unix socket.

Pure functions for both ends. ``parse_message`` never raises on what a stranger sent; it returns the reason instead.
"""

from __future__ import annotations

import grp
import json
import math
import os
import re
import socket
from pathlib import Path
from typing import Any

from canhelm import tcp
from canhelm.errors import CanhelmError, DaemonNotRunning, PermissionRefused, UsageError, from_rpc

API_VERSION = 1
MAX_REQUEST_BYTES = 65_536
"""Longest line that the daemon reads."""
MAX_ANSWER_BYTES = 4 * 1024 * 1024
"""Longest line that a client reads."""
RENEW_PERIOD_S = 0.5
"""A client that waits for a motion renews its lease this often."""
SILENT_RENEWALS = 10
"""Renewals without a sign of life after which a client takes its daemon for hung."""

PARSE_ERROR = -32700
INVALID_REQUEST = -32600
METHOD_NOT_FOUND = -32601
INTERNAL_ERROR = -32603

SYSTEM_FOLDER = Path("/run/canhelm")
GATEWAY_SUFFIX = ".309.sock"
"""Ending of the sockets beside them that speak CiA 309-3."""
DRIVERS = "canhelm"
"""The group whose members drive, where a daemon was not told another one."""
_ROBOT_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}")


# -- messages ---------------------------------------------------------------------------------------------------------


def make_message(message: dict[str, Any]) -> bytes:
    """One message as a line. JSON has no word for NaN and infinity: such numbers are sent as null."""
    try:
        text = json.dumps(message, separators=(",", ":"), allow_nan=False)
    except ValueError:
        text = json.dumps(_finite(message), separators=(",", ":"), allow_nan=False)
    return text.encode() + b"\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def make_request(request_id: int, method: str, params: dict[str, Any]) -> bytes:
    """A request as a line.

    Raises:
        UsageError: a parameter is NaN or infinite, or nothing that JSON can carry.
    """
    request = {"jsonrpc": "2.0", "id": request_id, "method": method, "params": params}
    try:
        return json.dumps(request, separators=(",", ":"), allow_nan=False).encode() + b"\n"
    except (TypeError, ValueError) as error:
        endless = [f"{name} is {value}" for name, value in params.items() if value != _finite(value)]
        reason = f"{', '.join(endless)}: not a finite number" if endless else str(error)
        raise UsageError(f"{method}: {reason}", remedy="give finite numbers, strings, lists and mappings") from None


def make_result(request_id: int | str | None, result: dict[str, Any]) -> bytes:
    """The answer to a request that was carried out."""
    return make_message({"jsonrpc": "2.0", "id": request_id, "result": result})


def make_error(request_id: int | str | None, code: int, message: str, data: dict[str, Any]) -> bytes:
    """The answer to a request that was not carried out; ``data`` carries type, node, object, limit and remedy."""
    error = {"code": code, "message": message, "data": data}
    return make_message({"jsonrpc": "2.0", "id": request_id, "error": error})


def make_notification(method: str, params: dict[str, Any]) -> bytes:
    """A message that nobody answers."""
    return make_message({"jsonrpc": "2.0", "method": method, "params": params})


def parse_message(line: bytes) -> dict[str, Any] | str:
    """The message in a line, or the reason why there is none."""
    try:
        message = json.loads(line.decode(), parse_constant=_refuse_constant)
    except UnicodeDecodeError as error:
        return f"not JSON: byte {error.start} is not UTF-8"
    except json.JSONDecodeError as error:
        return f"not JSON: {error.msg[:1].lower()}{error.msg[1:]} at character {error.pos}"
    except ValueError as error:
        return f"not JSON: {error}"
    except RecursionError:
        return "not JSON: it is nested too deeply"
    return message if isinstance(message, dict) else "not a JSON object"


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not JSON")


def result_of(answer: dict[str, Any]) -> dict[str, Any]:
    """The result in an answer.

    Raises:
        CanhelmError: the leaf that the daemon named, if the answer is an error.
    """
    error = answer.get("error")
    if isinstance(error, dict):
        raise from_rpc(error)
    result = answer.get("result")
    return result if isinstance(result, dict) else {}


def check_farewell(message: dict[str, Any]) -> None:
    """Raise the CanhelmError that belongs to no request: what a daemon says before it hangs up."""
    if "error" in message and message.get("id") is None:
        result_of(message)


# -- sockets ----------------------------------------------------------------------------------------------------------


def user_folder() -> Path:
    """Where this user's daemons open their sockets when no service manager gives them a folder."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return Path(runtime) / "canhelm" if runtime else Path(f"/tmp/canhelm-{os.getuid()}")


def default_socket(robot: str) -> Path:
    """Where the daemon of a robot listens unless it is told otherwise.

    Raises:
        UsageError: the name cannot be the name of a file.
    """
    given = os.environ.get("RUNTIME_DIRECTORY")
    folder = Path(given.split(":")[0]) if given else user_folder()
    return folder / f"{_checked_name(robot)}.sock"


def _checked_name(robot: str) -> str:
    if not _ROBOT_NAME.fullmatch(robot):
        raise UsageError(f"{robot!r} is not a robot's name", value=robot, remedy="use letters, digits, _ . and -")
    return robot


def choose_socket(socket_path: str | os.PathLike[str] | None = None, robot: str | None = None) -> Path:
    """The socket to talk to: the one named, the one of a robot, or the only one on which a daemon answers.

    Where neither is named, CANHELM_SOCKET or CANHELM_ROBOT names one.

    Raises:
        DaemonNotRunning: no socket is named and none answers.
        PermissionRefused: the system's folder of sockets is closed to this user and there is no other.
        UsageError: several daemons run and none is chosen.
    """
    if not socket_path and not robot:
        socket_path, robot = os.environ.get("CANHELM_SOCKET"), os.environ.get("CANHELM_ROBOT")
    if socket_path:
        return Path(socket_path)
    if robot:
        name = f"{_checked_name(robot)}.sock"
        found = [folder / name for folder in (SYSTEM_FOLDER, user_folder())]
        return next((path for path in found if os.path.exists(path)), found[-1])
    return _only_one(find_sockets())


def check_robot(path: Path, robot: str, hello: dict[str, Any]) -> None:
    """Compare the robot that answers with the one that was asked for.

    Args:
        path: the socket.
        robot: that the caller named.
        hello: the daemon's answer to ``hello``.

    Raises:
        UsageError: it is another one.
    """
    if hello.get("robot") != robot:
        raise UsageError(
            f"on {path} is robot {hello.get('robot')}, not {robot}",
            value=robot,
            remedy=f"leave --socket out to reach {robot}, or --robot to reach {hello.get('robot')}",
        )


def find_sockets() -> list[Path]:
    """The sockets on which a daemon answers (or would, if this user were allowed to ask), sorted."""
    paths = [path for folder in (SYSTEM_FOLDER, user_folder()) for path in _sockets_in(folder)]
    return [path for path in paths if is_live(path)]


def _sockets_in(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.glob("*.sock") if not path.name.endswith(GATEWAY_SUFFIX))
    except OSError:
        return []


def _only_one(live: list[Path]) -> Path:
    if len(live) > 1:
        names = ", ".join(path.stem for path in live)
        raise UsageError(f"several daemons run: {names}", remedy="choose one with --robot NAME or --socket PATH")
    if live:
        return live[0]
    if SYSTEM_FOLDER.is_dir() and not os.access(SYSTEM_FOLDER, os.R_OK | os.X_OK):
        raise _refused(SYSTEM_FOLDER)
    raise DaemonNotRunning(
        "no daemon is running",
        remedy="start one: canhelm run --profile NAME (--simulate without hardware), or systemctl start canhelm@NAME",
    )


def is_live(path: str | os.PathLike[str]) -> bool:
    """Whether somebody listens on a socket."""
    try:
        open_socket(path).close()
    except DaemonNotRunning:
        return False
    except PermissionRefused:
        return True
    return True


def open_socket(path: str | os.PathLike[str], timeout_s: float = 5.0) -> socket.socket:
    """A connected socket.

    Raises:
        DaemonNotRunning: nobody listens there.
        PermissionRefused: somebody may, but this user may not open it, or its token for ``tcp:HOST:PORT`` is missing
            or wrong.
    """
    if os.fspath(path).startswith(tcp.PREFIX):
        return _open_over_tcp(os.fspath(path), timeout_s)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.settimeout(timeout_s)
    try:
        connection.connect(os.fspath(path))
    except PermissionError:
        connection.close()
        raise _refused(path) from None
    except OSError as error:
        connection.close()
        raise DaemonNotRunning(
            f"no daemon answers on {os.fspath(path)}: {error.strerror or error}", remedy=how_to_start(Path(path))
        ) from None
    return connection


def _open_over_tcp(address: str, timeout_s: float) -> socket.socket:
    token = tcp.own_token()
    connection = tcp.connected(address, timeout_s)
    try:
        connection.sendall(make_request(0, "login", {"token": token}))
        answer = parse_message(tcp.first_line(connection))
        if isinstance(answer, str):
            raise DaemonNotRunning(f"what answers on {address} is no daemon", remedy="look at host and port")
        result_of(answer)
    except (OSError, CanhelmError) as error:
        connection.close()
        if isinstance(error, CanhelmError):
            raise
        told = f"the daemon on {address} hung up: {error.strerror or error}"
        raise DaemonNotRunning(told, remedy="try again in a few seconds") from None
    return connection


def how_to_start(path: Path) -> str:
    """What to do where no daemon answers on a socket, which has the robot's name."""
    if path.parent in (SYSTEM_FOLDER, user_folder()):
        run = f"canhelm run --profile {path.stem} (add --simulate without hardware)"
        return f"start it: {run}, or systemctl start canhelm@{path.stem}"
    return f"start it: canhelm run --profile NAME --socket {path} (add --simulate without hardware)"


def _refused(path: str | os.PathLike[str]) -> PermissionRefused:
    return PermissionRefused(
        f"this user may not open {os.fspath(path)}",
        remedy=f"join the group: sudo usermod -aG {_group_of(path)} $USER, then log in again",
    )


def _group_of(path: str | os.PathLike[str]) -> str:
    """The group that may open a socket; canhelm's own where that is not to be seen, or root's."""
    try:
        number = os.stat(path).st_gid
        return grp.getgrgid(number).gr_name if number else DRIVERS
    except (OSError, KeyError):
        return DRIVERS
