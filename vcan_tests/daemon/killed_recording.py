"""What ``kill -9`` takes from a recording: ``python -m vcan_tests.daemon.killed_recording [mcap]`` does it ten times.

A daemon with a simulated MAX2D, its control cycle at 100 Hz, records its bus; it is killed right after it has told how
many frames it has seen. Those that are missing in the log were lost.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from mcap.reader import make_reader

from canhelm.client import Client
from canhelm.errors import CanhelmError
from drivers.bus.candump import parse_line

PROFILE = """
schema_version: 1
name: max2d
extends: robots/max2d
network: {cycle_hz: 100, guard_time_ms: 1000, life_time_factor: 4}
"""
TIMEOUT_S = 120.0
FRAMES = 3000
"""Seen at least before it is killed: by then it has long booted, and its frames come evenly."""
TIMES = 10
CANDUMP = "candump"


@dataclass(frozen=True, slots=True)
class Killed:
    """One recording that was cut off.

    Attributes:
        seen: frames that the daemon has told of.
        stamps_s: of those in the log.
        unreadable: lines of the log that are none; an MCAP file is read as a whole or not at all.
    """

    seen: int
    stamps_s: list[float]
    unreadable: int

    @property
    def lost(self) -> int:
        """Frames seen and not in the log; none where more were written than the daemon had told of."""
        return max(0, self.seen - len(self.stamps_s))

    @property
    def lost_s(self) -> float:
        """How much of the bus's time that is, at the log's own rate of frames."""
        return self.lost * (self.stamps_s[-1] - self.stamps_s[0]) / (len(self.stamps_s) - 1)


def kill_while_recording(folder: Path, form: str = CANDUMP) -> Killed:
    """Start a daemon that records into a folder, and kill it in the midst."""
    profile, socket, logs = folder / "max2d.yaml", folder / "robot.sock", folder / "logs"
    profile.write_text(PROFILE)
    arguments = ["--profile", str(profile), "--socket", str(socket), "--record", str(logs), "--runs", "off"]
    arguments += ["--record-format", form]
    daemon = subprocess.Popen(
        [sys.executable, "-m", "daemon", "run", "--simulate", *arguments], stderr=subprocess.DEVNULL
    )
    try:
        with _connected(socket) as client:
            while (seen := client.status()["recording"]["frames"]) < FRAMES:
                continue
            daemon.send_signal(signal.SIGKILL)
    finally:
        daemon.kill()
        daemon.wait()
    (log,) = logs.iterdir()
    if form != CANDUMP:
        with log.open("rb") as file:
            return Killed(seen, [each.log_time * 1e-9 for _, _, each in make_reader(file).iter_messages()], 0)
    lines = log.read_text(encoding="ascii").splitlines()
    stamps_s = [frame.timestamp_s for line in lines if (frame := parse_line(line))]
    return Killed(seen, stamps_s, len(lines) - len(stamps_s))


def _connected(socket: Path) -> Client:
    deadline = time.monotonic() + TIMEOUT_S
    while True:
        try:
            return Client(str(socket))
        except CanhelmError:
            if time.monotonic() > deadline:
                raise


def main(form: str = CANDUMP) -> None:
    """Print a line for each time."""
    print("frames seen  in the log  unreadable  lost frames  lost ms")
    for _ in range(TIMES):
        with TemporaryDirectory() as folder:
            killed = kill_while_recording(Path(folder), form)
        counts = f"{killed.seen:11}  {len(killed.stamps_s):10}  {killed.unreadable:10}  {killed.lost:11}"
        print(f"{counts}  {killed.lost_s * 1e3:7.1f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
