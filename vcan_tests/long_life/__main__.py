"""``python -m vcan_tests.long_life --hours 12 --seed 1``: is a robot after hours of everything what it was before?"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
from rich.box import SIMPLE
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from profiles.loader import load
from vcan_tests.arguments import positive
from vcan_tests.long_life.figures import GROWTH, draw, growth_per_h, table
from vcan_tests.long_life.life import Life, live
from vcan_tests.long_life.samples import Sample


def main(argv: Sequence[str] | None = None) -> int:
    """0 after a good life, 1 after one with defects."""
    parser = argparse.ArgumentParser(prog="python -m vcan_tests.long_life", description=__doc__)
    parser.add_argument("--hours", type=positive, default=12.0, help="of virtual time (default 12)")
    parser.add_argument("--seed", type=int, default=1, help="of everything random (default 1)")
    parser.add_argument("--out", type=Path, default=Path("long-life-out"), help="folder for figures and picture")
    parser.add_argument("--cycle-hz", type=positive, help="of the robot; the profile's where left out")
    asked = parser.parse_args(argv)
    asked.out.mkdir(parents=True, exist_ok=True)
    profile = load("max2d").profile
    if asked.cycle_hz is not None:
        network = msgspec.structs.replace(profile.network, cycle_hz=asked.cycle_hz)
        profile = msgspec.structs.replace(profile, network=network)
    logging.getLogger("canhelm").addHandler(logging.NullHandler())
    logging.getLogger("canhelm").propagate = True
    logging.lastResort = None  # a robot that is broken a thousand times has a lot to say
    samples = asked.out / "samples.jsonl"
    samples.unlink(missing_ok=True)
    begun_s = time.monotonic()
    with TemporaryDirectory() as folder, _progress(asked.hours) as show:
        life = live(profile, asked.hours, asked.seed, Path(folder), samples, show)
    took_s = time.monotonic() - begun_s
    (asked.out / "life.json").write_text(json.dumps(asdict(life)))
    draw(life.samples, asked.out / "life.png")
    _show(life, took_s)
    return 1 if life.defects else 0


@contextmanager
def _progress(hours: float) -> Iterator[Callable[[Life, Sample], None]]:
    """A bar on a terminal, else a line an hour."""
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.completed:.2f} of {task.total:g} h"),
        BarColumn(),
        TextColumn("{task.fields[told]}"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    next_h = 0
    with bar:
        task = bar.add_task("life", total=hours, told="")

        def told(life: Life, now: Sample) -> None:
            nonlocal next_h
            lived_h = now.time_s / 3600.0
            line = f"{now.faults} faults, {now.memory_kib / 1024:.1f} MiB, {len(life.defects)} defects"
            bar.update(task, completed=lived_h, told=line)
            if not console.is_terminal and lived_h >= next_h:
                next_h = int(lived_h) + 1
                print(f"{lived_h:.1f} h: {line}", file=sys.stderr, flush=True)

        yield told


def _show(life: Life, took_s: float) -> None:
    """Table, counts and defects."""
    console = Console()
    rows = table(life.samples)
    shown = Table(*rows[0], box=SIMPLE, padding=(0, 1, 0, 0))
    for row in rows:
        shown.add_row(*map(str, row.values()))
    console.print(shown)
    for name in GROWTH:
        growth = growth_per_h(life.samples, name)
        told = "too short a life to tell" if growth is None else "{:+.1f} an hour, at most {:.0f}".format(*growth)
        console.print(f"{name}: {told}")
    hours = life.samples[-1].time_s / 3600.0
    console.print(f"{hours:.2f} h in {took_s / 60.0:.1f} min; {dict(sorted(life.counts.items()))}")
    for defect in life.defects:
        console.print(f"DEFECT {defect}", style="red", markup=False)


if __name__ == "__main__":
    sys.exit(main())
