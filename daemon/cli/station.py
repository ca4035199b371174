"""``canhelm station``: robots in a browser."""

from __future__ import annotations

import asyncio
import importlib.util
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from canhelm.errors import UsageError
from daemon.cli.logs import log_to_stderr
from daemon.cli.output import say

if TYPE_CHECKING:
    from daemon.station.server import Station

PORT = 8137


def station(
    *,
    robot: Annotated[list[str] | None, Parameter(negative=())] = None,
    host: str = "127.0.0.1",
    port: int = PORT,
    tokens: Path | None = None,
) -> int:
    """Serve the control station, a page for browsers, until Ctrl-C or SIGTERM.

    Example: `canhelm station`

    Args:
        robot: Name of a robot that it offers; give it again for each further one. Without it every robot of this
            machine whose daemon has a socket.
        host: Address to listen on; any but this machine's own loopback address needs `--tokens`.
        port: Port to listen on; 0 takes a free one.
        tokens: File of lines, each a role and a token that gives it; only its owner may read it (docs/station.md).
    """
    if importlib.util.find_spec("aiohttp") is None:
        remedy = f"{sys.executable} -m pip install 'canhelm[web]'"
        raise UsageError("no control station: aiohttp is missing", remedy=remedy)
    from daemon.api.tokens import load_tokens
    from daemon.station.guard import is_loopback
    from daemon.station.robots import Robots
    from daemon.station.server import Station

    if not host:
        raise UsageError(
            "--host names no address", value=host, remedy="give an address of this machine, or leave it out"
        )
    if tokens is None and not is_loopback(host):
        remedy = "give a file of tokens with --tokens, or leave --host out"
        raise UsageError(f"whoever reaches {host} could drive the robots without a token", value=host, remedy=remedy)
    if not 0 <= port < 1 << 16:
        raise UsageError(f"{port} is no port", value=port, limit="0 to 65535", remedy="give 0 to 65535")
    log_to_stderr(os.environ)
    offered = Robots(robot or ())
    asyncio.run(_serve(Station(offered, load_tokens(tokens) if tokens else None, host, port)))
    return 0


async def _serve(station: Station) -> None:
    ended = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, ended.set)
    await station.start()
    say(f"the control station is at {station.url} - end it with Ctrl-C")
    await ended.wait()
    await station.close()
