"""The programs among the tests refuse numbers that make no sense, before they begin."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from vcan_tests.fuzz.__main__ import main as fuzz
from vcan_tests.long_life.__main__ import main as long_life


@pytest.mark.parametrize(
    ("program", "arguments", "told"),
    [
        (long_life, ["--cycle-hz", "0"], "--cycle-hz: give more than 0"),
        (long_life, ["--hours=-1"], "--hours: -1 is negative"),
        (long_life, ["--hours", "nan"], "--hours: nan is negative or has no end"),
        (long_life, ["--hours", "soon"], "--hours: 'soon' is no number"),
        (fuzz, ["--minutes", "-1"], "--minutes: -1 is negative"),
        (fuzz, ["--minutes", "inf"], "--minutes: inf is negative or has no end"),
    ],
)
def test_a_number_that_makes_no_sense_is_wrong_usage(
    program: Callable[[Sequence[str]], int], arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        program(arguments)
    assert told in capsys.readouterr().err
