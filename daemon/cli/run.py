"""``canhelm run``: the daemon in the foreground."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from canhelm import protocol
from canhelm.errors import UsageError
from daemon.cli.output import say


def run(
    *,
    profile: str | None = None,
    bus: str | None = None,
    simulate: Annotated[bool, Parameter(negative=())] = False,
    virtual_time: Annotated[bool, Parameter(negative=())] = False,
    seed: int = 0,
    socket: Path | None = None,
    record: Path | None = None,
    unpowered: Annotated[bool, Parameter(negative=())] = False,
    gateway: Path | None = None,
    gateway_tcp: int | None = None,
    gateway_write: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Run a robot's daemon in the foreground until Ctrl-C or SIGTERM; then it stops the vehicle and goes down.

    Example: `canhelm run --simulate --profile max2d`

    Args:
        profile: Name of a profile, or a YAML file.
        bus: `socketcan:can0` or another INTERFACE:CHANNEL of python-can; `rs232:/dev/ttyS0@115200` for the serial line
            of one EPOS that forwards to the others; `simulated`, or `rs232` for a simulated serial line.
        simulate: Simulate the network of the profile in this process; the same as `--bus simulated`.
        virtual_time: Refused here: clients live in real time. `canhelm demo --virtual-time` has it.
        seed: Seed of everything random in the simulated network.
        socket: Where to listen; the default is the robot's socket in the runtime folder.
        record: Folder or file for a candump log.
        unpowered: Simulated drives have no power until `canhelm sim power all on`.
        gateway: Where other CANopen tools connect (CiA 309-3); the default is beside the socket, as NAME.309.sock.
        gateway_tcp: Port on the loopback interface for such tools as well, to read only.
        gateway_write: Let them write objects and command network states through the gateway's socket, too.
    """
    from daemon.app import App, GatewayAccess
    from daemon.runtime.clock import run_precise
    from profiles.loader import load

    chosen = _bus(bus, simulate=simulate)
    if profile is None:
        raise UsageError(
            "which robot?", remedy="give --profile NAME or FILE; `canhelm profile list` shows the shipped ones"
        )
    if virtual_time:
        raise UsageError(
            "virtual time is for demos, campaigns and tests: clients of a socket live in real time",
            remedy="leave --virtual-time out, or use `canhelm demo --virtual-time`",
        )
    loaded = load(profile)
    path = socket or Path(protocol.default_socket(loaded.profile.name))
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s %(message)s")
    logging.getLogger("canhelm").info("robot %s on %s, socket %s", loaded.profile.name, chosen, path)
    access = GatewayAccess(gateway or path.with_suffix(protocol.GATEWAY_SUFFIX), gateway_tcp, gateway_write)

    async def serve() -> None:
        app = App(
            loaded.profile,
            chosen,
            socket=path,
            record=record,
            seed=seed,
            powered=not unpowered,
            gateway=access,
        )
        await app.run()

    runner: Callable[[Coroutine[Any, Any, None]], None] = run_precise if _simulated(chosen) else asyncio.run
    runner(serve())
    say("the vehicle is at rest and its drives are off")
    return 0


def _bus(bus: str | None, *, simulate: bool) -> str:
    if simulate and bus is not None and not _simulated(bus):
        raise UsageError(f"--simulate and --bus {bus} contradict each other", remedy="give one of them")
    if bus is None and not simulate:
        raise UsageError("which bus?", remedy="give --simulate, or --bus socketcan:can0")
    return bus or "simulated"


def _simulated(bus: str) -> bool:
    return bus.partition("@")[0] in ("simulated", "rs232")
