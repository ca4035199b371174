"""The NXT: its parser on random bytes, feedback and open loop over many robots, and whether tacho compensation helps.

    .venv/bin/python -m benchmarks.nxt [ROBOTS] [STRINGS]

Each robot is another one of its kind (motors, wheels, play, how it was put down); all drive through the whole daemon,
on virtual time, from a start that takes up the play of the gears. What counts is the simulation's true pose.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from random import Random
from statistics import median
from typing import Any

from daemon.demo_nxt import FIGURES, NxtResult, drive
from daemon.runtime.clock import run_virtual
from drivers.nxt.telegrams import Unframer, parse_reply, parse_request
from profiles.loader import load
from vcan_tests.daemon.nxt_bench import errors_of_lines

ROBOTS, STRINGS = 100, 1_000_000
WITHIN_CM, WITHIN_DEG = 0.5, 3.0


def parse_random(count: int) -> None:
    """Random strings, half of them behind the beginning of a true telegram, into everything that reads from a wire."""
    dice, unframer, understood, begin_s = Random(0), Unframer(), 0, time.perf_counter()
    kinds = (0x00, 0x01, 0x80, 0x81, 0x02)
    for number in range(count):
        data = dice.randbytes(dice.randrange(80))
        if number % 2:
            data = bytes((dice.choice(kinds), dice.randrange(0x15))) + data
        understood += not isinstance(parse_request(data), str)
        understood += not isinstance(parse_reply(data), str)
        for telegram in unframer.feed(data):
            parse_reply(telegram)
    took_s = time.perf_counter() - begin_s
    print(f"{count} random strings: no exception, {understood} understood, {took_s:.1f} s")


def report(results: list[NxtResult]) -> None:
    """One line: medians open loop, and how many robots end within the tolerance under feedback."""
    open_loop = [result.open_loop.miss for result in results]
    feedback = [result.feedback.miss for result in results]
    good = sum(miss["error_cm"] <= WITHIN_CM and abs(miss["heading_error_deg"]) <= WITHIN_DEG for miss in feedback)
    outer = [max(miss["tacho_error_deg"]) for miss in open_loop]
    told = f"{_middle(open_loop, 'error_cm'):5.1f} cm {_middle(open_loop, 'heading_error_deg'):5.1f} deg"
    held = f"{_middle(feedback, 'error_cm'):5.2f} cm {_middle(feedback, 'heading_error_deg'):5.2f} deg"
    print(f"{results[0].figure.words:26} {told}  tacho {min(outer):.0f} to {max(outer):.0f} deg   {held}"
          f"   {good} of {len(results)}")  # fmt: skip


def _middle(misses: Iterable[dict[str, Any]], key: str) -> float:
    return float(median(abs(miss[key]) for miss in misses))


async def worst_of_a_row(seed: int, compensated: bool) -> float:
    """By how much [deg] a wheel misses its angle at worst, from the second of six lines of 20 cm on."""
    return max(map(abs, await errors_of_lines(seed, compensated)))


def main(robots: int = ROBOTS, strings: int = STRINGS) -> None:
    """Everything, at most a few minutes."""
    parse_random(strings)
    profile = load("nxt").profile
    print(f"\n{'':26} open loop, medians{'':25}feedback, medians     within {WITHIN_CM} cm and {WITHIN_DEG:g} deg")
    for figure in FIGURES:
        report([run_virtual(drive(profile, figure, seed, lambda _: None)) for seed in range(robots)])
    rows = [[run_virtual(worst_of_a_row(seed, way)) for seed in range(robots)] for way in (False, True)]
    better = sum(with_it < without for without, with_it in zip(*rows, strict=True))
    print(f"\nworst tacho error in a row of lines: {median(rows[0]):.0f} deg without compensation, "
          f"{median(rows[1]):.0f} deg with it; better with it: {better} of {robots} robots")  # fmt: skip


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
