"""``canhelm run``: the daemon in the foreground."""

from __future__ import annotations

import asyncio
import faulthandler
import os
import re
import signal
import sys
from collections.abc import Callable, Coroutine, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from canhelm import protocol
from canhelm.errors import ConfigError, UsageError
from daemon.cli.logs import log_to_stderr
from daemon.cli.output import say

if TYPE_CHECKING:
    from daemon.app import App, TcpAccess
    from daemon.runs.store import RunStore
    from profiles.schema import Profile

LOOPBACK = "127.0.0.1"


def run(
    *,
    profile: str | None = None,
    bus: str | None = None,
    simulate: Annotated[bool, Parameter(negative=())] = False,
    virtual_time: Annotated[bool, Parameter(negative=())] = False,
    seed: int = 0,
    socket: Path | None = None,
    record: str | None = None,
    record_mb: int = 1000,
    record_format: Literal["candump", "mcap"] | None = None,
    unpowered: Annotated[bool, Parameter(negative=())] = False,
    gateway: Path | None = None,
    gateway_tcp: int | None = None,
    gateway_write: Annotated[bool, Parameter(negative=())] = False,
    bit_rate: int | None = None,
    miswire: str | None = None,
    faults: Path | None = None,
    runs: str | None = None,
    runs_mb: int = 200,
    watch_group: str = "canhelm-watch",
    drive_group: str = "canhelm",
    configure_group: str = "canhelm-admin",
    tcp: str | None = None,
    tokens: Path | None = None,
) -> int:
    """Run a robot's daemon in the foreground until Ctrl-C or SIGTERM; then it stops the vehicle and goes down.

    Example: `canhelm run --simulate --profile max2d`

    Args:
        profile: Name of a profile, or a YAML file. Without it the daemon listens to the bus, scans it, tells who is
            there, and lets each EPOS 24/5 be jogged slowly as robot `bench`.
        bus: `socketcan:can0` or another INTERFACE:CHANNEL of python-can; `rs232:/dev/ttyS0@115200` for the serial line
            of one EPOS that forwards to the others; `simulated`, or `rs232` for a simulated serial line. For a robot
            with nothing on CAN: `serial:/dev/rfcomm0` or `usb` for its NXT brick, `none`: as the profile says.
        simulate: Simulate the network of the profile in this process; the same as `--bus simulated`.
        virtual_time: Refused here: clients live in real time. `canhelm demo --virtual-time` has it.
        seed: Seed of everything random in the simulated network.
        socket: Where to listen; the default is the robot's socket in the runtime folder.
        record: Folder or file (`.log`, `.mcap`) for everything that goes over the bus.
        record_mb: What the logs of that folder may take; the oldest are deleted.
        record_format: Text as candump writes it, or MCAP for Foxglove, PlotJuggler and Rerun; the default is what the
            name of the file says, and candump for a folder.
        unpowered: Simulated drives have no power until `canhelm sim power all on`.
        gateway: Where other CANopen tools connect (CiA 309-3); the default is beside the socket, as NAME.309.sock.
        gateway_tcp: Port on the loopback interface for such tools as well, to read only.
        gateway_write: Let them write objects and command network states through the gateway's socket, too.
        bit_rate: Bit/s of a bus without a profile; the default is 1000000.
        miswire: Profile of how the simulated robot is really built and wired, to find it out by `canhelm setup`.
        faults: YAML file of faults that strike the simulated network (docs/faults.md).
        runs: Folder in which each motion leaves a run, or `off`; the default is the service's or the person's state
            folder (~/.local/state/canhelm/NAME/runs).
        runs_mb: What all runs may take; the oldest are deleted.
        watch_group: Members of this group may watch the robot (docs/rights.md).
        drive_group: Members of this one may drive it, too.
        configure_group: Members of this one may change its settings, too.
        tcp: PORT of the loopback interface, or HOST:PORT, on which clients with a token are served, too.
        tokens: File of lines, each a role and a token that gives it; only its owner may read it.
    """
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end_before_it_began)
    from daemon.app import App, GatewayAccess
    from daemon.runtime.activation import inherited_sockets
    from daemon.runtime.clock import run_patient
    from daemon.runtime.log_forms import FORMS
    from profiles.faults import load_faults
    from profiles.loader import load

    chosen = _bus(bus, simulate=simulate)
    _refuse_senseless(chosen, unpowered=unpowered, virtual_time=virtual_time)
    _refuse_recording(record, record_mb, record_format)
    loaded = load(profile) if profile else None
    robot = loaded.profile if loaded else _unknown(chosen, bit_rate)
    for option, wanted in (("--miswire", miswire), ("--faults", faults)):
        if wanted and not simulates(chosen):
            raise UsageError(f"{option} is for simulated robots, and {chosen} is real", remedy="leave it out")
    struck_by = load_faults(faults, robot) if faults else ()
    if profile and bit_rate is not None:
        raise UsageError("--bit-rate is for a bus without a profile", remedy="write network.bit_rate in the profile")
    served_over_tcp = tcp_access(tcp, tokens)
    for given in (socket, gateway):
        _require_folder(given)
    log_to_stderr(os.environ)
    faulthandler.enable()  # a watchdog ends a hung daemon by SIGABRT: tell where it hangs
    inherited = inherited_sockets(os.environ, os.getpid())
    path = socket or _api_socket(inherited) or Path(protocol.default_socket(robot.name))
    make_app = partial(
        App,
        bus=chosen,
        socket=path,
        record=Path(record) if record else None,
        record_bytes=record_mb * 1_000_000,
        record_form=FORMS[record_format or "candump"],
        seed=seed,
        powered=not unpowered,
        gateway=GatewayAccess(gateway or path.with_suffix(protocol.GATEWAY_SUFFIX), gateway_tcp, gateway_write),
        inherited=inherited,
        built=load(miswire).profile if miswire else None,
        runs=_store(runs, runs_mb, robot.name),
        profile_file=loaded.path.resolve() if loaded else None,
        faults=struck_by,
        groups=(watch_group, drive_group, configure_group),
        tcp=served_over_tcp,
    )
    runner: Callable[[Coroutine[Any, Any, str]], str] = run_patient if simulates(chosen) else asyncio.run
    say(runner(_live(make_app, profile, robot)))
    return 0


def tcp_access(address: str | None, tokens: Path | None) -> TcpAccess | None:
    """Where the API is served over TCP. Raises UsageError for half of it, or an address that is none."""
    from canhelm.tcp import split_address
    from daemon.app import TcpAccess

    if address is None and tokens is None:
        return None
    if address is None or tokens is None:
        raise UsageError("--tcp and --tokens need each other", remedy="give both: --tcp PORT --tokens FILE")
    try:
        host, port = split_address(address if ":" in address else f"{LOOPBACK}:{address}")
    except UsageError:
        remedy = "give PORT or HOST:PORT, with a port of 1 to 65535"
        raise UsageError(f"--tcp {address}: there is no such port", value=address, remedy=remedy) from None
    return TcpAccess(host, port, tokens)


def _unknown(bus: str, bit_rate: int | None) -> Profile:
    """The robot that a bus without a profile begins with. Raises UsageError."""
    import msgspec

    from daemon.first_contact import bench_profile
    from drivers.epos.value_tables import CAN_BIT_RATES
    from profiles.schema import Network

    if simulates(bus):
        remedy = "give --profile NAME or FILE; `canhelm profile list` shows the shipped ones"
        raise UsageError("which robot?", remedy=remedy)
    try:
        network = msgspec.convert({"bit_rate": bit_rate or 1_000_000}, Network)
    except msgspec.ValidationError:
        remedy = f"give {', '.join(map(str, sorted(CAN_BIT_RATES.values())))}"
        raise UsageError(f"{bit_rate} bit/s is no bit rate of an EPOS", value=bit_rate, remedy=remedy) from None
    return bench_profile(network)


def _store(folder: str | None, megabytes: int, robot: str) -> RunStore | None:
    """Where runs are kept. Raises UsageError for a size without room for any."""
    from daemon.runs.store import OFF, RunStore, own_folder

    if megabytes < 1:
        raise UsageError("--runs-mb is below 1", value=megabytes, remedy="give megabytes, or --runs off")
    if folder == OFF:
        return None
    return RunStore(Path(folder) if folder else own_folder(robot, os.environ), megabytes * 1_000_000)


async def _live(make_app: Callable[[Profile], App], source: str | None, robot: Profile) -> str:
    """The daemon's life; how it left the vehicle."""
    from daemon.first_contact import FirstContact
    from daemon.life import Life
    from daemon.runtime.notify import ServiceManager
    from profiles.kept import runtime_folder
    from profiles.loader import load

    async def load_anew() -> Profile:
        return (await asyncio.to_thread(load, source)).profile if source else life.app.profile

    manager = ServiceManager.of(os.environ, os.getpid())
    life = Life(make_app, load_anew, manager, runtime_folder(os.environ))
    life.take_signals()
    contact = FirstContact(life)
    if source is None:
        contact.start()
    farewell = await life.run(robot)
    await contact.close()
    return farewell


def _refuse_recording(record: str | None, megabytes: int, form: str | None) -> None:
    """Raise UsageError for options of the recording that make no sense, or not together."""
    from daemon.runtime.log_forms import FORMS

    if record == "":
        raise UsageError("--record is empty", remedy="name a folder or a file, as --record logs")
    if megabytes < 1:
        raise UsageError("--record-mb is below 1", value=megabytes, remedy="give megabytes, or leave --record out")
    if record is None or form is None:
        return
    if any(name != form and record.endswith(other.suffix) for name, other in FORMS.items()):
        remedy = f"name a folder, or a file that ends in {FORMS[form].suffix}; or leave --record-format out"
        raise UsageError(f"--record {record} contradicts --record-format {form}", value=record, remedy=remedy)


def _refuse_senseless(bus: str, *, unpowered: bool, virtual_time: bool) -> None:
    """Raise UsageError for options that make no sense, or not together."""
    if unpowered and not simulates(bus):
        raise UsageError(
            f"--unpowered is for simulated drives, and {bus} is real", remedy="leave it out; switch its power off"
        )
    if virtual_time:
        raise UsageError(
            "virtual time is for demos, campaigns and tests: clients of a socket live in real time",
            remedy="leave --virtual-time out, or use `canhelm demo --virtual-time`",
        )


def _api_socket(inherited: Iterable[Path]) -> Path | None:
    """Which of the sockets that listen already is the API's."""
    return next((path for path in inherited if not path.name.endswith(protocol.GATEWAY_SUFFIX)), None)


def _end_before_it_began(number: int, _: object) -> None:
    say("ended before it began")
    sys.exit(0)


def _require_folder(socket: Path | None) -> None:
    """Raise ConfigError where the folder of a socket is missing: a path that a person gives is not made up for."""
    if socket is not None and not socket.parent.is_dir():
        raise ConfigError(
            f"there is no folder {socket.parent} for {socket.name}", remedy="make it, or correct the path"
        )


def _bus(bus: str | None, *, simulate: bool) -> str:
    if simulate and bus is not None and not simulates(bus):
        raise UsageError(f"--simulate and --bus {bus} contradict each other", remedy="give one of them")
    if bus is None and not simulate:
        remedy = "give --simulate, or --bus socketcan:can0 (for an NXT brick serial:/dev/rfcomm0, or usb)"
        raise UsageError("which bus?", remedy=remedy)
    return bus or "simulated"


def simulates(bus: str) -> bool:
    """Whether a bus SPEC means a simulated network."""
    return re.split("[@,]", bus)[0] in ("simulated", "rs232")
