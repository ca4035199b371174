"""The results of a fault campaign: a line of JSON for each injection, kept as soon as it was tried, and the table.

A campaign that was killed goes on where it was: what stands in the file is not tried again. A line that was cut short
is taken away.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TextIO

import msgspec

from canhelm import __version__
from canhelm.errors import ConfigError
from daemon.campaigns.faults.outcome import MANOEUVRES, Outcome
from daemon.campaigns.faults.strikes import STRIKES, Injection
from daemon.campaigns.results import appended, whole_lines

LINES: Final = "results.jsonl"
SUMMARY: Final = "results.json"


@dataclass(frozen=True, slots=True)
class Heading:
    """The first line of the file: what the results are of.

    Attributes:
        seed: of the campaign.
        canhelm: version.
    """

    seed: int
    canhelm: str = __version__

    def __str__(self) -> str:
        return f"seed {self.seed} and canhelm {self.canhelm}"


class FaultResults:
    """The open results file of one campaign; use :func:`opened`.

    Attributes:
        tried: outcome of each injection.
    """

    def __init__(self, file: TextIO, path: Path, heading: Heading) -> None:
        self.tried: dict[Injection, Outcome] = {}
        self._file, self._path = file, path
        whole = whole_lines(file)
        if not whole:
            self._write(msgspec.json.encode(heading))
        for number, line in enumerate(whole.splitlines(), start=1):
            self._take(number, line, heading)

    def keep(self, outcome: Outcome) -> None:
        """Write one outcome into the file at once. Raises OSError."""
        self._write(msgspec.json.encode(outcome))
        self.tried[Injection(outcome.strike, outcome.index)] = outcome

    def _write(self, line: bytes) -> None:
        self._file.write(line.decode() + "\n")
        self._file.flush()

    def _take(self, number: int, line: str, heading: Heading) -> None:
        try:
            if number == 1:
                found = msgspec.json.decode(line, type=Heading)
                if found == heading:
                    return
                what = f"is of {found}, not of {heading}"
            else:
                outcome = msgspec.json.decode(line, type=Outcome)
                self.tried[Injection(outcome.strike, outcome.index)] = outcome
                return
        except (msgspec.MsgspecError, RecursionError) as error:
            what = f"is no result: {error}"
        remedy = "give another folder with --out, or delete this file"
        raise ConfigError(f"{self._path}:{number} {what}", object=str(self._path), remedy=remedy)


@contextmanager
def opened(folder: Path, seed: int) -> Iterator[FaultResults]:
    """The results file in ``folder``, made or gone on with; nobody else may write into it meanwhile.

    Raises:
        UsageError: the folder cannot be made, or another campaign writes into it.
        ConfigError: the file is of another campaign, or another version of canhelm.
    """
    path = folder / LINES
    with appended(path) as file:
        yield FaultResults(file, path, Heading(seed))


def table(outcomes: Iterable[Outcome]) -> list[dict[str, Any]]:
    """A row for each kind in each manoeuvre: injections, violations, worst time to rest, and what it recovered by."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault((outcome.strike, outcome.manoeuvre), []).append(outcome)
    order = [(strike, manoeuvre) for strike in STRIKES for manoeuvre in MANOEUVRES]
    return [{"fault": key[0], "manoeuvre": key[1], **_sums(groups[key])} for key in order if key in groups]


def _sums(group: Sequence[Outcome]) -> dict[str, Any]:
    rests_s = [outcome.rest_s for outcome in group if outcome.rest_s is not None]
    return {
        "injections": len(group),
        "violations": sum(bool(outcome.violations) for outcome in group),
        "stopped": sum(outcome.stopped for outcome in group),
        "worst_rest_s": max(rests_s, default=None),
        "recovered": dict(Counter(outcome.recovered or "not" for outcome in group)),
    }


def violated(outcomes: Iterable[Outcome]) -> list[Outcome]:
    """Those in which an invariant was violated."""
    return [outcome for outcome in outcomes if outcome.violations]


def write_summary(folder: Path, seed: int, outcomes: Sequence[Outcome]) -> Path:
    """``results.json``: sums, the table, and every violation. Raises OSError."""
    path = folder / SUMMARY
    failed = [msgspec.to_builtins(outcome) for outcome in violated(outcomes)]
    content = {
        "canhelm": __version__,
        "seed": seed,
        "injections": len(outcomes),
        "violations": len(failed),
        "table": table(outcomes),
        "failed": failed,
    }
    new = path.with_suffix(".new")
    new.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    new.replace(path)
    return path
