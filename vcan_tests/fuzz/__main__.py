"""``make fuzz``: every target, or one of them, for as long as it is told; exit code 1 where anything was found."""

from __future__ import annotations

import argparse
import resource
import sys
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

from vcan_tests.arguments import not_negative
from vcan_tests.fuzz.hunt import hunt, keep
from vcan_tests.fuzz.rooms import targets
from vcan_tests.fuzz.target import Target

FOUND = Path("fuzz-findings")
MEMORY_BYTES = 4 << 30
"""What the whole search may take; an input that takes more ends in a MemoryError, which is a finding."""


def main(argv: Sequence[str] | None = None, folder: Path = FOUND) -> int:
    """Search, and say a line a target.

    Returns:
        The exit code: 0 where nothing was found.
    """
    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__)
    parser.add_argument("--minutes", type=not_negative, default=10.0, help="of the processor, for each target")
    parser.add_argument("targets", nargs="*", metavar="target", help="all where none is named")
    asked = parser.parse_args(argv)
    if unknown := [name for name in asked.targets if name not in targets()]:
        parser.error(f"no target {unknown[0]}; there are {', '.join(targets())}")
    return max([_search(targets()[name], asked.minutes * 60.0, folder) for name in asked.targets or targets()])


def _search(target: Target, seconds: float, folder: Path) -> int:
    begin_s = time.process_time()
    hunted = hunt(target, seconds)
    spent_s = time.process_time() - begin_s
    count = len(hunted.findings)
    print(
        f"{target.name:<12} {hunted.executions:>9} executions in {spent_s:.0f} s, "
        f"{count} finding{'' if count == 1 else 's'}",
        flush=True,
    )
    for path, (defect, finding) in zip(
        keep(folder, target, list(hunted.findings.values())), hunted.findings.items(), strict=True
    ):
        print(f"  {path}: {defect}\n{finding.told}", flush=True)
    return 1 if count else 0


def _bound_process() -> None:
    """Limit its memory, and take numpy's warnings for errors as the tests do."""
    warnings.simplefilter("error", RuntimeWarning)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, resource.getrlimit(resource.RLIMIT_AS)[1]))


if __name__ == "__main__":
    _bound_process()
    sys.exit(main())
