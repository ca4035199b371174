"""The results of a campaign: one row of a CSV file a finished run, kept as soon as the run is over.

A campaign that was killed goes on where it was: what stands in the file is not driven again. A line that was cut short
is taken away. Runs of the same parts that the plan does not have, as of more random states, stay and are passed over.
"""

from __future__ import annotations

import csv
import fcntl
import io
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, astuple, fields
from importlib.util import find_spec
from pathlib import Path
from typing import Final, TextIO

import msgspec

from canhelm import __version__
from canhelm.errors import ConfigError, UsageError
from daemon.campaigns.cases import Case, Outcome

Result = tuple[Case, Outcome]

CSV: Final = "results.csv"
PARQUET: Final = "results.parquet"
_CASE: Final = [field.name for field in fields(Case)]
_OUTCOME: Final = [field.name for field in fields(Outcome)]
_VERSION: Final = "canhelm"
COLUMNS: Final = [*_CASE, *_OUTCOME, _VERSION]


class Results:
    """The open results file of one campaign.

    Attributes:
        finished: outcome of every case that has been driven.
    """

    def __init__(self, file: TextIO, path: Path, cases: Sequence[Case]) -> None:
        """Use :func:`opened`."""
        self._file, self._path, self._cases = file, path, cases
        self.finished: dict[Case, Outcome] = {}
        self._read()

    @property
    def missing(self) -> list[Case]:
        """Cases that are still to be driven."""
        return [case for case in self._cases if case not in self.finished]

    def in_order(self) -> dict[Case, Outcome]:
        """The finished runs in the order of the plan."""
        return {case: self.finished[case] for case in self._cases if case in self.finished}

    def keep(self, results: Iterable[Result]) -> None:
        """Write finished runs into the file at once. Raises OSError."""
        text = io.StringIO()
        rows = list(results)
        csv.writer(text, lineterminator="\n").writerows(
            [*astuple(case), *astuple(out), __version__] for case, out in rows
        )
        self._file.write(text.getvalue())
        self._file.flush()
        self.finished.update(rows)

    def _read(self) -> None:
        whole = whole_lines(self._file)
        if not whole:
            self._file.write(",".join(COLUMNS) + "\n")
            self._file.flush()
            return
        rows = csv.reader(io.StringIO(whole))
        if next(rows) != COLUMNS:
            raise self._foreign(1, "has other columns")
        planned = set(self._cases)
        parts = {_part(case) for case in planned}
        for number, row in enumerate(rows, start=2):
            case, out = self._parsed(row, number)
            if _part(case) not in parts:
                raise self._foreign(number, "is a run that this campaign does not have")
            if case in planned:
                self.finished[case] = out

    def _parsed(self, row: list[str], number: int) -> Result:
        if len(row) != len(COLUMNS):
            raise self._foreign(number, f"has {len(row)} fields, not {len(COLUMNS)}")
        given = {column: value or None for column, value in zip(COLUMNS, row, strict=True)}
        if given[_VERSION] != __version__:
            raise self._foreign(number, f"was driven by canhelm {given[_VERSION]}, this is {__version__}")
        try:
            case = msgspec.convert({name: given[name] for name in _CASE}, Case, strict=False)
            return case, msgspec.convert({name: given[name] for name in _OUTCOME}, Outcome, strict=False)
        except msgspec.ValidationError as error:
            raise self._foreign(number, f"is no result: {error}") from None

    def _foreign(self, line: int, what: str) -> ConfigError:
        remedy = "give another folder with --out, or delete this file"
        return ConfigError(f"{self._path}:{line} {what}", object=str(self._path), remedy=remedy)


def _part(case: Case) -> tuple[str | float | None, ...]:
    return case.part, case.through, case.law, case.rate_deg_s


@contextmanager
def opened(folder: Path, cases: Sequence[Case]) -> Iterator[Results]:
    """The results file in ``folder``, made or gone on with; nobody else may write into it meanwhile.

    Raises:
        UsageError: the folder cannot be made, or another campaign writes into it.
        ConfigError: the file is of another campaign, or another version of canhelm.
    """
    path = folder / CSV
    with appended(path) as file:
        yield Results(file, path, cases)


@contextmanager
def appended(path: Path) -> Iterator[TextIO]:
    """A file that is read and written on by nobody else meanwhile, its folder included.

    Raises:
        UsageError: it cannot be made, or another campaign writes into it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("a+", encoding="utf-8", newline="")
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}", remedy="give a folder of yours with --out") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            message = f"another campaign writes into {path}"
            raise UsageError(message, remedy="wait for it, or give another folder with --out") from None
        yield file


def whole_lines(file: TextIO) -> str:
    """What stands in a file to be written on; a last line that was cut short is taken away."""
    file.seek(0)
    text = file.read()
    whole = text[: text.rfind("\n") + 1]
    file.seek(0)
    file.truncate(len(whole.encode()))
    file.seek(0, io.SEEK_END)
    return whole


def write_parquet(results: Results, folder: Path) -> Path | None:
    """The finished runs as Parquet, in the order of the plan; None where pyarrow is not installed. Raises OSError."""
    if find_spec("pyarrow") is None:
        return None
    import pyarrow as pa
    from pyarrow import parquet

    rows = [asdict(case) | asdict(out) for case, out in results.in_order().items()]
    path = folder / PARQUET
    new = path.with_suffix(".new")
    parquet.write_table(pa.Table.from_pylist(rows), new)
    new.replace(path)
    return path
