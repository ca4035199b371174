"""Any file of faults: they strike a simulated robot without a defect in the daemon, or each mistake has its line."""

from __future__ import annotations

import asyncio
from pathlib import Path

from hypothesis import given

from canhelm.errors import UsageError
from daemon.app import App
from daemon.runtime.clock import run_virtual
from profiles.faults import KIND_NAMES, KINDS, PlacedFault, load_faults
from profiles.loader import load
from vcan_tests.fuzz.files import file_of, read_or_told, require_helpful
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few
from vcan_tests.profiles.test_faults import EXAMPLES, PARTS

NAME = "faults.yaml"
MAX2D = load("max2d").profile
STRUCK_S = 1.0


def example(kind: str) -> str:
    """A fault of a kind, with everything that it may have."""
    takes = dict.fromkeys((*KINDS[kind].needs, *KINDS[kind].takes))
    part = {"part": PARTS[KINDS[kind].parts[0]]} if "part" in takes else {}
    fields = {"kind": kind, "at_s": 0.2, **part, **{name: EXAMPLES[name] for name in takes if name in EXAMPLES}}
    return ", ".join(f"{name}: {value}" for name, value in fields.items())


USUAL = tuple(f"faults:\n  - {{{example(kind)}}}\n".encode() for kind in KIND_NAMES if kind != "brick_lost")


def attempt(content: bytes) -> None:
    with file_of(content, NAME) as path:
        faults = read_or_told(lambda: load_faults(path, MAX2D), path)
    if faults:
        run_virtual(struck(faults))


async def struck(faults: tuple[PlacedFault, ...]) -> None:
    """A robot lives with the faults for a while; one that cannot happen in its network is refused with its line."""
    app = App(MAX2D, faults=faults, seed=1)
    try:
        await app.start()
        await asyncio.sleep(STRUCK_S)
    except UsageError as refused:
        require_helpful(refused, Path(NAME))
    finally:
        await app.close()


FAULTS = Target("faults", damaged_text(USUAL) | damaged(USUAL), attempt)


@few(20)
@given(FAULTS.inputs)
def test_a_file_of_faults_strikes_a_robot_or_is_told_its_mistakes(content: bytes) -> None:
    FAULTS.check(content)
