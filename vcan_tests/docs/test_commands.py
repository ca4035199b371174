"""Every command of the pages is carried out on a simulated robot, or is marked in the page with the reason why not."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from vcan_tests.docs.pages import Command, blocks, written
from vcan_tests.docs.player import Answer, Player, parse, without_comment

NUMBER = re.compile(r"\d+(\.\d+)?")
AGREED = Path(__file__).with_name("not_carried_out.txt")
"""Commands that need hardware, root, a person or much time; each page says which, in a comment before them."""


@pytest.fixture
def player(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Player]:
    player = Player(tmp_path, monkeypatch)
    yield player
    player.close()


PLAYED = ("docs/first-week.md",)
"""Pages whose commands make one story, with a test of its own: `vcan_tests/docs/test_first_week.py`."""
PAGES = [page for page, text in written().items() if page not in PLAYED and "```console" in text]


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page_do_what_it_says(player: Player, page: str) -> None:
    for command, answer in player.plays(written()[page]):
        check(page, command, answer)


def check(page: str, command: Command, answer: Answer) -> None:
    """A command that fails, fails as the page says; what the page shows is what the command says, but for numbers."""
    where = f"{page}:{command.line}: {command.text}"
    told = masked(answer.shown)
    if answer.code != 0:
        assert masked([answer.err]) in masked(command.shown), f"{where}: {answer}"
    for line in command.shown:
        assert masked([line]).strip(". ") in told, f"{where}: does not say {line!r}, but {answer}"


def masked(lines: Sequence[str]) -> str:
    """Text without its numbers, the widths of its columns, and where its lines end."""
    return " ".join(NUMBER.sub("0", "\n".join(lines)).split())


def not_carried_out() -> list[str]:
    """Every command that no test carries out, with the reason that its page gives."""
    marked = [(page, block) for page in PAGES for block in blocks(written()[page]) if block.needs]
    return [
        f"{page}: {without_comment(command.text)} ({block.needs})"
        for page, block in marked
        for command in block.commands()
    ]


def agreed() -> list[str]:
    return AGREED.read_text(encoding="utf-8").splitlines()


def test_no_command_is_left_out_by_accident() -> None:
    left_out = not_carried_out()
    assert [line for line in left_out if line not in agreed()] == [], f"run them, or agree to them in {AGREED}"
    assert [line for line in agreed() if line not in left_out] == [], f"these are gone: take them from {AGREED}"


@pytest.mark.parametrize("line", [line for line in agreed() if ": canhelm " in line])
def test_a_command_that_is_not_carried_out_is_one_that_the_parser_takes(line: str) -> None:
    parse(line.partition(": ")[2].rpartition(" (")[0])
