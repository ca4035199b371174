"""candump beside a robot, and what its log says: what was on the wire, seen by programs that are not ours."""

from __future__ import annotations

import os
import re
import select
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

LINE = re.compile(r"\((\d+\.\d+)\) \w+ ([0-9A-F]{3})#(?:(R)|([0-9A-F]*))\n")
ROOM_BYTES = 4 << 20
SERVICES = {
    0x000: "NMT:",
    0x080: "EMCY",
    0x180: "PDO1 (tx)",
    0x200: "PDO1 (rx)",
    0x280: "PDO2 (tx)",
    0x400: "PDO3 (rx)",
    0x580: "Default-SDO (tx)",
    0x600: "Default-SDO (rx)",
    0x700: "NMT Error Control",
}
"""What tshark calls a frame, by the function code in its identifier."""


class Frame(NamedTuple):
    """One frame of the log.

    Attributes:
        time_s: wall-clock time by the kernel.
        can_id: 11-bit identifier.
        remote: whether it is a remote frame.
        data: 0 to 8 bytes.
    """

    time_s: float
    can_id: int
    remote: bool
    data: bytes


class Witness:
    """A candump that runs.

    Args:
        interface: what it listens to.
        log: the file that it writes.
    """

    def __init__(self, interface: str, log: Path) -> None:
        self.log = log
        with log.open("w") as output:
            self.process = subprocess.Popen(
                ["candump", "-L", "-r", str(ROOM_BYTES), interface], stdout=output, preexec_fn=partial(os.nice, -20)
            )

    def text(self) -> str:
        """The log up to now."""
        return self.log.read_text()

    def comes_to_show(self, what: str, begin: int = 0, patience_s: float = 10.0) -> bool:
        """Whether the log shows that text behind a place in it, now or soon."""
        deadline = time.monotonic() + patience_s
        while what not in self.text()[begin:]:
            if time.monotonic() > deadline:
                return False
            select.select([], [], [], 0.05)
        return True

    def frames(self, since_s: float = 0.0) -> list[Frame]:
        """The frames up to now that are no older than a wall-clock time."""
        return [frame for frame in frames_of(self.text()) if frame.time_s >= since_s]


def frames_of(log: str) -> list[Frame]:
    """The frames of a log."""
    found = LINE.findall(log)
    return [Frame(float(at), int(can_id, 16), bool(r), bytes.fromhex(data)) for at, can_id, r, data in found]


@contextmanager
def candump(interface: str, log: Path) -> Iterator[Witness]:
    """A witness while the ``with`` block lasts."""
    witness = Witness(interface, log)
    try:
        yield witness
    finally:
        witness.process.terminate()
        witness.process.wait()


def malformed(log: Path) -> str:
    """What tshark takes for malformed CANopen."""
    return _tshark(log, "-Y", "_ws.malformed")


def unrecognised(log: Path) -> list[str]:
    """The data frames in which tshark does not see the service that their identifier stands for.

    It does not look into remote frames.
    """
    fields = ("can.id", "can.flags.rtr", "_ws.col.Info")
    lines = _tshark(log, "-T", "fields", "-E", "separator=|", *(word for field in fields for word in ("-e", field)))
    return [line for line in lines.splitlines() if not _is_recognised(*line.split("|"))]


def service_of(can_id: int) -> str:
    """The service that an identifier stands for, in tshark's words."""
    return "SYNC" if can_id == 0x080 else SERVICES.get(can_id & 0x780, "nothing that a node here has")


def _is_recognised(can_id: str, remote: str, info: str) -> bool:
    return remote == "1" or info.startswith(service_of(int(can_id)))


def _tshark(log: Path, *options: str) -> str:
    command = ["tshark", "-r", str(log), "-d", "can.subdissector,canopen", *options]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
