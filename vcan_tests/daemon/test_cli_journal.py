"""Log lines as the system's journal takes them."""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path

import pytest

from canhelm.errors import Refused
from daemon.cli import journal, logs
from daemon.cli.output import say, say_error


def record(level: int, message: str) -> logging.LogRecord:
    return logging.LogRecord("canhelm", level, "file", 1, message, None, None)


@pytest.mark.parametrize(
    ("level", "prefix"),
    [(logging.DEBUG, "<7>"), (logging.INFO, "<6>"), (logging.WARNING, "<4>"), (logging.CRITICAL, "<3>")],
)
def test_each_level_has_its_prefix(level: int, prefix: str) -> None:
    assert logs.JournalFormatter("%(message)s").format(record(level, "told")) == f"{prefix}told"


def test_each_line_of_a_traceback_has_the_level_of_its_record() -> None:
    failed = record(logging.ERROR, "the law failed")
    try:
        raise ValueError("of all")
    except ValueError:
        failed.exc_info = sys.exc_info()
    lines = logs.JournalFormatter("%(message)s").format(failed).splitlines()
    assert len(lines) > 3
    assert {line[:3] for line in lines} == {"<3>"}


def test_only_the_stream_that_the_journal_reads_gets_levels(tmp_path: Path) -> None:
    with (tmp_path / "stream").open("w") as stream:
        found = os.fstat(stream.fileno())
        environment = {"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"}
        assert journal.reads_stderr(environment, stream.fileno())
        assert not journal.reads_stderr({"JOURNAL_STREAM": f"{found.st_dev}:1"}, stream.fileno())
        assert not journal.reads_stderr({}, stream.fileno())


def test_what_a_command_says_has_its_level_in_the_journal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(journal, "reads_stderr", lambda _: True)
    say("done")
    say_error(Refused("profile lab1 has 1 mistake:\n  lab1.yaml:6: node: is 200"))
    assert capsys.readouterr().err.splitlines() == [
        "<6>canhelm: done",
        "<3>canhelm: profile lab1 has 1 mistake:",
        "<3>  lab1.yaml:6: node: is 200",
    ]
