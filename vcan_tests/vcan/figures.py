"""``make vcan-figures``: what the kernel's bus shows of canhelm, measured from candump's logs.

Where the running kernel has vcan it is measured there, else in the user-mode kernel, whose one processor all share.
What was measured while the whole machine stood still is left out, and counted, but a stop within its limit: a guest
stands still for some 10 ms whenever its kernel takes a killed process apart.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import quantiles
from tempfile import TemporaryDirectory, mkdtemp

from daemon.demo import FIGURES
from vcan_tests.kernel import running
from vcan_tests.kernel.guest import exchange_folder, run_in_guest
from vcan_tests.kernel.processes import run
from vcan_tests.kernel.tools import require_tools
from vcan_tests.vcan.bench import COMMAND, Bench, Daemon, Simulator, bench, patient, words_of, write_profile
from vcan_tests.vcan.pauses import PauseWatch, watched_for_pauses
from vcan_tests.vcan.stethoscope import DRIVES, at_rest_after, emergencies_after, life_time_s, listen, stop_s
from vcan_tests.vcan.witness import candump, frames_of, malformed, service_of, unrecognised

MODULE = "vcan_tests.vcan.figures"
LONGEST_S = 1800.0
LIFE_TIME_S, MARGIN_S = 0.3, 0.05
"""Of the shipped robot; what is promised beyond life time and ramp."""
LISTENED_S = 1.5
TIMES, MOST_LEFT_OUT = 5, 20
SYNC, SYNCS, PERIOD_S = 0x080, 1500, 0.01
WITHOUT_BROADCAST_MANAGER = (
    sys.executable,
    "-c",
    "import daemon.wires; daemon.wires.kernel_repeats = lambda: False;"
    "from daemon.__main__ import main; raise SystemExit(main())",
)
SENDERS = {"kernel": COMMAND, "daemon": WITHOUT_BROADCAST_MANAGER}
BESIDE = {"nothing": "exec cat", "a busy loop": "while :; do :; done"}


@dataclass(frozen=True)
class Death:
    """One way to lose a daemon.

    Attributes:
        words: what happens.
        number: the signal that the daemon gets.
        speed_m_s: speed of the wheels at that time.
        move: brings the robot to it.
    """

    words: str
    number: signal.Signals
    speed_m_s: float
    move: Callable[[Bench], object]


@dataclass(frozen=True)
class Stop:
    """One stop without a daemon.

    Attributes:
        lived_s: longest time from the last guarding answer of a drive until it missed its master.
        first_s: time until the first drive missed its master.
        missed_s: time until the last one did.
        rest_s: time until all drives stood.
        paused_s: how long the machine stood still until then.
        guarded_late: it stood still in the life time before, too, when the last guard requests were due.
    """

    lived_s: float
    first_s: float
    missed_s: float
    rest_s: float
    paused_s: float
    guarded_late: bool


DEATHS = (
    Death("kill -9 at 0.5 m/s", signal.SIGKILL, 0.5, lambda robot: robot.drive(0.5)),
    Death("SIGSTOP at 0.5 m/s", signal.SIGSTOP, 0.5, lambda robot: robot.drive(0.5)),
    Death("kill -9 while a pair turns", signal.SIGKILL, 0.15, lambda robot: robot.turn_pair(0.15)),
)


def main() -> int:
    """Measure here or in a guest; the exit status is 1 where a figure misses what is promised."""
    if not running.has_vcan():
        require_tools()
        with exchange_folder() as exchange:
            return run(run_in_guest([sys.executable, "-m", MODULE], exchange, timeout_s=LONGEST_S)).status
    with running.buses_up(), TemporaryDirectory() as folder:
        show(f"kernel {os.uname().release}, {os.cpu_count()} processor(s)")
        with watched_for_pauses(Path(folder) / "pauses") as pauses:
            figures = Figures(Path(folder), pauses)
            good = [figures.demo(), *map(figures.death, DEATHS), figures.decoding()]
            figures.periods()
    return 0 if all(good) else 1


def show(*lines: str) -> None:
    """Print as soon as it is known."""
    print(*lines, sep="\n", flush=True)


class Figures:
    """What is measured, one after the other.

    Args:
        folder: for logs and profiles.
        pauses: tells when the machine stood still.
    """

    def __init__(self, folder: Path, pauses: PauseWatch) -> None:
        self._folder = folder
        self._pauses = pauses
        self._logs: list[Path] = []

    def demo(self) -> bool:
        """The demo's manoeuvres by commands; whether all have been driven."""
        with bench(self._new_folder(), patient(cycle_hz=100)) as robot:
            self._logs.append(robot.wire.log)
            done = [robot.daemon.canhelm(*words_of(figure)) for figure in FIGURES]
        codes = [each.returncode for each in done]
        show(f"demo: figures {', '.join(figure.identity for figure in FIGURES)}: exit statuses {codes}")
        show(*(each.stderr.strip() for each in done if each.returncode))
        return not any(codes)

    def death(self, death: Death) -> bool:
        """How long the drives take to stand; whether that was often enough seen, and always short enough."""
        limit_s = stop_s(death.speed_m_s, LIFE_TIME_S) + MARGIN_S
        stops, left_out = self._stops(death, limit_s)
        show(f"{death.words}, {len(stops)} times, {left_out} left out; limit {limit_s:.3f} s")
        show(
            *(
                f"  the drives missed their master after {stop.first_s:.3f} to {stop.missed_s:.3f} s, "
                f"at most {stop.lived_s:.3f} s after they were guarded; all stood after {stop.rest_s:.3f} s, "
                f"for {stop.paused_s:.3f} s of which the machine stood still"
                for stop in stops
            )
        )
        return len(stops) == TIMES and all(stop.rest_s <= limit_s for stop in stops)

    def _stops(self, death: Death, limit_s: float) -> tuple[list[Stop], int]:
        """Some stops, and how many beside them took too long, or came to nothing, in a machine that stood still.

        Standing still before the signal may make a stop shorter, afterwards only longer: one that is within its limit
        all the same counts.
        """
        stops: list[Stop] = []
        left_out = 0
        while len(stops) < TIMES and left_out < MOST_LEFT_OUT:
            begin_s = time.time()
            try:
                stop = self._stop(death)
            except AssertionError:
                if not self._pauses.between(begin_s, time.time()):
                    raise
                left_out += 1
                continue
            if stop.guarded_late or (stop.rest_s > limit_s and stop.paused_s):
                left_out += 1
            else:
                stops.append(stop)
        return stops, left_out

    def _stop(self, death: Death) -> Stop:
        with bench(self._new_folder()) as robot:
            self._logs.append(robot.wire.log)
            death.move(robot)
            struck_s = robot.daemon.signal(death.number)
            listen(LISTENED_S)
            frames = robot.wire.frames()
        missed_s = {node: max(after_s for _, after_s in emergencies_after(frames, node, struck_s)) for node in DRIVES}
        rest_s = max(at_rest_after(frames, node, struck_s) for node in DRIVES)
        return Stop(
            max(life_time_s(frames, node, struck_s + after_s) for node, after_s in missed_s.items()),
            min(missed_s.values()),
            max(missed_s.values()),
            rest_s,
            sum(self._pauses.between(struck_s, struck_s + rest_s)),
            bool(self._pauses.between(struck_s - LIFE_TIME_S, struck_s)),
        )

    def decoding(self) -> bool:
        """What tshark says of all these logs; whether it has nothing to object."""
        log = self._folder / "all.log"
        log.write_text("".join(part.read_text() for part in self._logs))
        frames = frames_of(log.read_text())
        counts = Counter("guard request" if frame.remote else service_of(frame.can_id) for frame in frames)
        bad, strange = malformed(log).splitlines(), unrecognised(log)
        show(f"tshark: {len(frames)} frames, {len(bad)} malformed, {len(strange)} not recognised", *bad, *strange)
        show(*(f"  {count:7} {name}" for name, count in sorted(counts.items())))
        return not bad and not strange

    def periods(self) -> None:
        """How the period of SYNC differs from 10 ms, sent by the kernel and by the daemon, with nothing and a load."""
        for beside, script in BESIDE.items():
            for sender, command in SENDERS.items():
                periods = list(pairwise(self._sync_times(command, script)))
                kept = [span for span in periods if not self._pauses.between(*span)]
                errors_ms = [1e3 * abs(end_s - begin_s - PERIOD_S) for begin_s, end_s in kept]
                cuts = quantiles(errors_ms, n=100)
                show(
                    f"SYNC by the {sender}, beside the daemon {beside}: |period - 10 ms| "
                    f"p50 {cuts[49]:.3f} ms, p99 {cuts[98]:.3f} ms, max {max(errors_ms):.1f} ms "
                    f"({len(kept)} periods, {len(periods) - len(kept)} left out)"
                )

    def _sync_times(self, command: Sequence[str], beside: str) -> list[float]:
        folder = self._new_folder()
        profile = write_profile(folder, patient(cycle_hz=100))
        with ExitStack() as stack:
            wire = stack.enter_context(candump("vcan0", folder / "candump.log"))
            stack.callback(Simulator(profile).end)
            daemon = Daemon(profile, command=command, niceness=0)
            stack.callback(daemon.end)
            daemon.wait_for_state("idle")
            load = stack.enter_context(subprocess.Popen(["/bin/sh", "-c", beside], stdin=subprocess.PIPE))
            stack.callback(load.kill)
            begin_s = time.time()
            subprocess.run(["candump", "-n", str(SYNCS), "vcan0,080:7FF"], stdout=subprocess.DEVNULL, check=True)
            return [frame.time_s for frame in wire.frames(begin_s) if frame.can_id == SYNC]

    def _new_folder(self) -> Path:
        return Path(mkdtemp(dir=self._folder))


if __name__ == "__main__":
    sys.exit(main())
