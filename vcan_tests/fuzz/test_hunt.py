"""The search itself: a planted defect is found, made small, kept in a file, and told by the exit code."""

from __future__ import annotations

import asyncio
import itertools
import logging
from pathlib import Path

import pytest
from hypothesis import strategies as st

from vcan_tests.fuzz import __main__ as command
from vcan_tests.fuzz import target as bounds
from vcan_tests.fuzz.hunt import ROOT, hunt, outcome, shortened
from vcan_tests.fuzz.mutation import damaged_text
from vcan_tests.fuzz.rooms import targets
from vcan_tests.fuzz.target import DefectLogged, Target, TookTooLong

LINES = (b"speed: 1.5\nname: rover\n", b"speed: 2\n")


def fails_on(word: bytes, content: bytes) -> None:
    if word in content:
        raise ValueError(word)


def planted(inputs: st.SearchStrategy[bytes]) -> Target:
    """A reader that fails on one word; no target of `make fuzz`, as those of this module's own would be."""
    return Target("planted", inputs, lambda content: fails_on(b"0", content))


def a_clock() -> itertools.count[int]:
    """Seconds, one more each time that somebody looks."""
    return itertools.count()


def test_a_defect_behind_one_word_of_a_text_is_found_and_made_small() -> None:
    hunted = hunt(planted(damaged_text(LINES)), 1000, a_clock().__next__)
    (finding,) = hunted.findings.values()
    assert finding.content == b"0"
    assert "ValueError" in finding.told


def test_what_is_not_needed_for_a_defect_is_left_out() -> None:
    both = Target("both", st.just(b""), lambda content: fails_on(b"x", content[1:]))
    found = outcome(both, b"a long x text")
    assert found is not None
    assert shortened(both, b"a long x text", found[0]) == b"ex"


def test_findings_are_files_and_the_exit_code_tells_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    sound = Target("sound", damaged_text(LINES), lambda content: None)
    there = {"planted": planted(st.just(b"a 0 b")), "sound": sound}
    monkeypatch.setattr(command, "targets", lambda: there)
    assert command.main(["--minutes", "0", "sound"], tmp_path) == 0
    assert command.main(["--minutes", "0"], tmp_path) == 1
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"0"]
    told = capsys.readouterr().out
    assert "0 findings" in told
    assert "1 finding\n" in told


def test_every_target_is_known_to_the_documentation() -> None:
    page = (ROOT / "docs" / "testing.md").read_text(encoding="utf-8")
    assert [name for name in targets() if f"`{name}`" not in page] == []


def test_an_input_that_never_ends_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "CPU_S", 0.05)

    def turn(loop: asyncio.AbstractEventLoop) -> None:
        loop.call_soon(turn, loop)

    async def endless() -> None:
        turn(asyncio.get_running_loop())
        await asyncio.Event().wait()

    with pytest.raises(TookTooLong):
        Target("endless", st.just(b""), lambda _: asyncio.run(endless())).check(b"")


def test_an_exception_that_was_only_logged_is_raised() -> None:
    def log(_: bytes) -> None:
        try:
            fails_on(b"", b"")
        except ValueError:
            logging.getLogger("canhelm").exception("a task failed")

    with pytest.raises(ValueError, match="b''"):
        Target("logs", st.just(b""), log).check(b"")


def test_so_is_a_complaint_of_asyncio() -> None:
    with pytest.raises(DefectLogged, match="never retrieved"):
        Target("complains", st.just(b""), lambda _: logging.getLogger("asyncio").error("never retrieved")).check(b"")
