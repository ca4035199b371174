"""What ``make vcan-test`` says in the end comes from pytest's own report, and only a full run is a good one."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from vcan_tests.kernel.guest import NO_STATUS, TIMED_OUT
from vcan_tests.kernel.processes import run, run_to_end
from vcan_tests.kernel.suite import Part, part_of

ONE_OF_EACH = """
import pytest
def test_good(): pass
def test_bad(): assert False
@pytest.fixture
def broken(): raise OSError
def test_error(broken): pass
def test_skipped(): pytest.importorskip("a_module_that_is_nowhere")
"""

GOOD_AND_SKIPPED = """
import pytest
def test_good(): pass
def test_skipped(): pytest.importorskip("a_module_that_is_nowhere")
"""


def reported(folder: Path, tests: str) -> Part:
    """What is read from the report of a real pytest over these tests."""
    (folder / "test_these.py").write_text(tests)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "no:cacheprovider",
        f"--junit-xml={folder}/report.xml",
        str(folder),
    ]
    status = subprocess.run(command, cwd=folder, capture_output=True).returncode
    return part_of("vcan", "a kernel", status, folder)


def test_the_counts_are_those_of_pytests_report(tmp_path: Path) -> None:
    part = reported(tmp_path, ONE_OF_EACH)
    assert (part.passed, part.failed, part.skipped) == (1, 2, 1)


def test_a_run_with_a_skipped_test_is_not_good(tmp_path: Path) -> None:
    part = reported(tmp_path, GOOD_AND_SKIPPED)
    assert (part.status, part.good) == (0, False)


def test_a_run_in_which_all_passed_is_good(tmp_path: Path) -> None:
    assert reported(tmp_path, "def test_good(): pass\n").good


@pytest.mark.parametrize("status", [TIMED_OUT, NO_STATUS])
def test_a_guest_that_left_no_report_is_not_good(tmp_path: Path, status: int) -> None:
    assert not part_of("vcan", "a kernel", status, tmp_path).good


def test_the_last_line_names_the_kernel_and_the_numbers() -> None:
    part = Part("vcan", "the running kernel 6.1.0", 1, passed=3, failed=1, skipped=0)
    assert str(part) == "vcan tests on the running kernel 6.1.0: 3 passed, 1 FAILED, none skipped (exit status 1)"


@pytest.mark.real_time
async def test_a_process_that_outlives_its_parent_is_ended_with_it() -> None:
    command = ["sh", "-c", "sleep 600 &"]  # it holds the output open as long as it lives
    assert await run_to_end(command, timeout_s=60) == 0


@pytest.mark.real_time
async def test_a_command_is_ended_when_its_time_is_over() -> None:
    assert await run_to_end(["sleep", "600"], timeout_s=0.1) is None


@pytest.mark.real_time
async def test_what_two_commands_say_at_the_same_time_is_kept_apart(tmp_path: Path) -> None:
    with (tmp_path / "one").open("w+b") as one, (tmp_path / "other").open("w+b") as other:
        said = {"first": one, "second": other}
        await asyncio.gather(*(run_to_end(["echo", word], 60, output=output) for word, output in said.items()))
    assert [(tmp_path / name).read_text() for name in ("one", "other")] == ["first\n", "second\n"]


def test_a_signal_ends_it_with_its_processes_and_tells_by_the_exit_status() -> None:
    pipe, end = os.pipe()

    async def work() -> None:
        asyncio.get_running_loop().call_later(0.1, os.kill, os.getpid(), signal.SIGTERM)
        await run_to_end(["sleep", "600"], timeout_s=60, descriptors=[end])

    with pytest.raises(SystemExit) as ended:
        run(work())
    os.close(end)
    assert ended.value.code == 128 + signal.SIGTERM
    with os.fdopen(pipe) as held_by_nobody:
        assert held_by_nobody.read() == ""
