"""Runs one command in a guest: the user-mode kernel over the host's files, with vcan0 and vcan1 up.

The guest is an ordinary process of this user. As it sees the host's files, so can it change them, except under
systemd, whose guest writes into a RAM disk over them. What both sides exchange lies in one folder, which the guest
finds at ``/run/guest``.
"""

from __future__ import annotations

import fcntl
import os
import resource
import shlex
import shutil
import socket
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from vcan_tests.kernel.fetch import Kernel, cache, fetch_kernel
from vcan_tests.kernel.processes import run_to_end

TIMED_OUT = 124
NO_STATUS = 125
SCRIPTS = Path(__file__).parent
RUNNING_SYSTEMD, COMMAND_IN_GUEST = Path("/run/systemd/system"), Path("/run/guest/command")
"""What is there under a systemd, and in a guest."""
PASSED_ON = ("HOME", "LANG", "LC_ALL", "LOGNAME", "PYTEST_ADDOPTS", "USER")


@dataclass(frozen=True)
class Outcome:
    """How a guest ended: the command's exit status (124: timed out, 125: the guest died) and the kernel's release."""

    status: int
    kernel: str


async def run_in_guest(
    command: Sequence[str],
    exchange: Path,
    *,
    systemd: bool = False,
    timeout_s: float | None = None,
    show_kernel: bool = False,
    environment: Mapping[str, str] | None = None,
    output: IO[bytes] | None = None,
) -> Outcome:
    """Boots a guest, runs the command in the present folder, and halts the guest.

    Args:
        command: Program and arguments, as the guest finds them: by path, or in the system's folders.
        exchange: A new folder, which the guest sees as ``/run/guest``.
        systemd: Whether a real systemd is the guest's first process, and all writing goes into a RAM disk.
        timeout_s: Wall time until the guest is ended, in seconds.
        show_kernel: Whether the kernel's own messages are shown: for a guest that dies.
        environment: Variables for the command beside the few that are passed on.
        output: Where its output goes; None: to our stdout.

    Raises:
        MissingTool: no user-mode kernel can be had here.
    """
    kernel = fetch_kernel()
    _furnish(exchange, kernel, "run_systemd.sh" if systemd else "run_plain.sh")
    _write_script(exchange / "command", command, environment or {})
    _allow_many_files()
    with _own_cpu() as cpu, _serial_cable() as ends:
        command_line = _command_line(kernel, exchange, cpu, ends, show_kernel)
        ended = await run_to_end(command_line, timeout_s, ends, output)
    release = exchange / "kernel"
    status = TIMED_OUT if ended is None else _status(exchange)
    return Outcome(status, release.read_text().strip() if release.exists() else "that did not start")


def is_guest() -> bool:
    """Whether this process runs in a guest, under a systemd that is not this machine's."""
    return RUNNING_SYSTEMD.exists() and COMMAND_IN_GUEST.exists()


@contextmanager
def exchange_folder() -> Iterator[Path]:
    """A folder for one guest, removed with all that is in it."""
    with tempfile.TemporaryDirectory(prefix="canhelm-guest-") as folder:
        yield Path(folder)


def _furnish(exchange: Path, kernel: Kernel, run: str) -> None:
    shutil.copy(SCRIPTS / "init.sh", exchange / "init")
    (exchange / "init").chmod(0o755)
    shutil.copy(SCRIPTS / run, exchange / "run")
    (exchange / "modules").symlink_to(kernel.modules)


def _write_script(script: Path, command: Sequence[str], environment: Mapping[str, str]) -> None:
    """The command as a shell script. A terminal that the host has not is a dumb one, so that nobody colours for it."""
    passed_on = {name: os.environ[name] for name in PASSED_ON if name in os.environ}
    terminal = os.environ.get("TERM", "dumb") if os.isatty(1) else "dumb"
    variables = {**passed_on, "TERM": terminal, "TMPDIR": "/run/tmp", **environment}
    exports = [f"export {name}={shlex.quote(value)}\n" for name, value in variables.items()]
    script.write_text(
        f"#!/bin/sh\n{''.join(exports)}cd {shlex.quote(os.getcwd())} || exit\nexec {shlex.join(command)}\n"
    )
    script.chmod(0o755)


def _command_line(kernel: Kernel, exchange: Path, cpu: int, cable: tuple[int, int], show_kernel: bool) -> list[str]:
    """The guest's process. On one CPU it is 3 to 5 times as fast as on two; it ends when this process dies."""
    start = ["setpriv", "--pdeathsig", "TERM", "taskset", "-c", str(cpu)]
    if kernel.preload:
        start += ["env", f"LD_PRELOAD={kernel.preload}"]
    root = ["rootfstype=hostfs", "rootflags=/", "rw", f"init={exchange}/init", "lsm=yama"]
    place = ["mem=2G", f"uml_dir={exchange}", "umid=uml"]
    serial = [f"ssl{number}=fd:{end}" for number, end in enumerate(cable)]
    output = ["con=null", "con0=null,fd:1", *(["loglevel=7"] if show_kernel else ["quiet", "loglevel=0"])]
    return [*start, str(kernel.program), *root, *place, *serial, *output, "systemd.unit=guest.target"]


def _allow_many_files() -> None:
    """A guest keeps each of the host's files open that it has ever looked into; many systems allow 1024."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


@contextmanager
def _serial_cable() -> Iterator[tuple[int, int]]:
    """Both ends of what joins the guest's serial ports, ``/dev/ttyS0`` and ``/dev/ttyS1``."""
    one, other = socket.socketpair()
    with one, other:
        yield one.fileno(), other.fileno()


@contextmanager
def _own_cpu() -> Iterator[int]:
    """A CPU that no other guest of this user has; when all are taken, the last."""
    cpus = sorted(os.sched_getaffinity(0))
    folder = cache()
    folder.mkdir(parents=True, exist_ok=True)
    for cpu in cpus:
        with (folder / f"cpu{cpu}.lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield cpu
            return
    yield cpus[-1]


def _status(exchange: Path) -> int:
    status = exchange / "status"
    return int(status.read_text()) if status.exists() else NO_STATUS
