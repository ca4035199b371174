"""What commands cost: whose modules take how long to load, and that the part runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.command_line import COMMANDS, run, shares_ms
from benchmarks.section import Options

TOLD = """\
import time: self [us] | cumulative | imported package
import time:       100 |        100 |   json.decoder
import time:       200 |        300 | json
import time:      2000 |       2000 |   attr._make
import time:      3000 |       5300 | cyclopts
import time:       700 |        700 | daemon.cli.status
canhelm: interrupted
"""


def test_the_time_of_each_module_counts_for_whose_it_is_and_only_once() -> None:
    assert shares_ms(TOLD) == {"cyclopts": 3.0, "attrs": 2.0, "canhelm": 0.7, "the standard library": 0.3}


@pytest.mark.real_time
def test_the_smallest_run_tells_of_every_command(tmp_path: Path) -> None:
    figures = run(Options(tmp_path, seconds=0.01)).figures
    assert list(figures["commands"]) == [command.key for command in COMMANDS]
    assert all(0.0 < each["p50_ms"] <= each["worst_ms"] for each in figures["commands"].values())
    assert figures["status_imports_ms"]["canhelm"] > 0.0
