"""Any recording: what reads one ends with a result or a sentence, and never with a traceback."""

from __future__ import annotations

import asyncio
import contextlib
import io
import tempfile
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import CanhelmError
from daemon.calibration.fit import fit
from daemon.calibration.readings import Reading, read_readings, write_readings
from daemon.cli.main import main
from daemon.runs.pictures import panels
from daemon.runs.store import CYCLES, FACTS, FRAMES, PROFILE, RECORDS, TERMS, RunStore, read_runs, read_yaml
from daemon.runs.table import read_table
from daemon.runtime.clock import run_virtual
from vcan_tests.fuzz.files import file_of, read_or_told
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few
from vcan_tests.robot import running_robot

MOST_LINES = 60
"""Of each file of a run: enough for what a reader looks for, and few enough to be quick."""
CODES = {0, 1, 2, 7}
"""Done, something differs or nothing is there, wrong usage, damaged content."""
UNSAFE = {chr(code) for code in (*range(9), *range(11, 32), *range(127, 160))}
"""What a terminal would obey instead of showing it."""


@cache
def drive() -> dict[str, bytes]:
    """The files of a run and of a fault, by their names: a short drive that a person breaks off."""

    async def scenario(folder: Path) -> None:
        async with running_robot(runs=RunStore(folder), expect_errors=True) as robot:
            driving = asyncio.create_task(robot.call("drive.parallel", angle_deg=5.0, speed_m_s=0.3, duration_s=0.5))
            await asyncio.sleep(0.6)
            robot.app.supervisor.estop("pressed")
            with pytest.raises(CanhelmError):
                await driving

    with tempfile.TemporaryDirectory() as folder:
        run_virtual(scenario(Path(folder)))
        files = sorted(path for run in read_runs([Path(folder)]) for path in run.folder.iterdir())
        return {path.name: path.read_bytes() for path in files}


def beginning(name: str) -> bytes:
    """The first lines of a file of a run, from where on things happen."""
    lines = drive()[name].splitlines(keepends=True)
    return b"".join([*lines[:1], *lines[-MOST_LINES:]])


def texts(*usual: Callable[[], bytes]) -> st.SearchStrategy[bytes]:
    """Changed texts; the right ones are made when they are asked for first."""
    return st.deferred(lambda: damaged_text([make() for make in usual]) | damaged([make() for make in usual]))


def command(*words: str) -> None:
    """A command as a person types it, with a result or a sentence at its end."""
    told, shown = io.StringIO(), io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.redirect_stderr(told), contextlib.redirect_stdout(shown):
        code = main(words)
    assert code in CODES, (code, told.getvalue())
    assert code in (0, 1) or told.getvalue().strip(), code
    assert not UNSAFE & set(told.getvalue()), told.getvalue()


# -- logs of frames, and the cycles of a fault ------------------------------------------------------------------------


def replayed(name: str, options: tuple[str, ...], content: bytes) -> None:
    with file_of(content, name) as path:
        command("replay", str(path), "--profile", "max2d", *options)


CANDUMP = Target("candump", texts(partial(beginning, FRAMES)), partial(replayed, FRAMES, ("--every", "0")))
RECORDED = Target("records", texts(partial(beginning, RECORDS)), partial(replayed, RECORDS, ("--json",)))


@few(20)
@given(CANDUMP.inputs)
def test_a_log_of_frames_is_replayed_or_refused(content: bytes) -> None:
    CANDUMP.check(content)


@few(20)
@given(RECORDED.inputs)
def test_the_cycles_of_a_fault_are_computed_again_or_refused(content: bytes) -> None:
    RECORDED.check(content)


# -- the folder of a run ----------------------------------------------------------------------------------------------

HEAD = b"== "
FILES = (FACTS, PROFILE, CYCLES, TERMS)


def bundle() -> bytes:
    """The files of a run in one."""
    return b"".join(HEAD + name.encode() + b"\n" + beginning(name) for name in FILES)


def unpacked(content: bytes) -> Iterator[tuple[str, bytes]]:
    for part in content.split(HEAD)[1:]:
        name, _, text = part.partition(b"\n")
        if name.decode("latin-1") in FILES:
            yield name.decode("latin-1"), text


def looked_at(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "0001").mkdir()
        for name, text in unpacked(content):
            (Path(folder) / "0001" / name).write_bytes(text)
        command("runs", "--runs", folder)
        command("runs", "show", "1", "--runs", folder)
        drawn(Path(folder))


def drawn(folder: Path) -> None:
    """What a picture of the run would show."""
    (run,) = read_runs([folder])
    with contextlib.suppress(CanhelmError):
        list(panels(run, read_table(run), read_yaml(run.folder / PROFILE)))


RUN = Target("run", texts(bundle), looked_at)


@few(30)
@given(RUN.inputs)
def test_a_damaged_run_is_listed_and_looked_at_as_far_as_it_goes(content: bytes) -> None:
    RUN.check(content)


# -- tables -----------------------------------------------------------------------------------------------------------

WAY = b"time_s,x_m,y_m,yaw_deg,trailer_x_m,trailer_y_m,trailer_yaw_deg\n" + b"".join(
    b"%d.0,%d.5,0.%d,0.0,%d.0,0.%d,0.0\n" % (row, row, row, row, row) for row in range(12)
)


def fitted(content: bytes) -> None:
    with file_of(content, "way.csv") as path:
        command("drive", "fit", str(path), str(path.with_name("way.yaml")))


FIT = Target("fit", damaged_text([WAY]) | damaged([WAY]), fitted)


@few(40)
@given(FIT.inputs)
def test_a_record_of_a_way_is_fitted_or_refused(content: bytes) -> None:
    FIT.check(content)


@cache
def readings() -> bytes:
    with file_of(b"", "readings.csv") as path:
        write_readings(path, [Reading(run, run % 3 - 1, 4.0 * run, 4.1 * run + 0.3) for run in range(-8, 9)])
        return path.read_bytes()


def calibrated(content: bytes) -> None:
    with file_of(content, "readings.csv") as path:
        found = read_or_told(lambda: read_readings(path), path)
    if found is not None:
        with contextlib.suppress(CanhelmError):
            fit(found)


READINGS = Target("readings", texts(readings), calibrated)


@few(40)
@given(READINGS.inputs)
def test_readings_of_a_calibration_are_fitted_or_refused(content: bytes) -> None:
    READINGS.check(content)
