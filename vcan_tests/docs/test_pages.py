"""The pages as a whole: all are listed, no link is dead, and every word that looks like a command is one."""

from __future__ import annotations

import itertools
import os
import re
from urllib.parse import urlsplit

import pytest
from cyclopts import App

from daemon.cli.main import whole_app
from vcan_tests.docs.pages import BESIDE, NAMES, ROOT, anchors, blocks, code_spans, indented, links, listed, text_of

COMMAND = re.compile(r"\s*(\$ )?(sudo )?canhelm [a-z]")
HEADINGS = 6
"""More parts of the list of contents than a person takes in at a glance."""


def test_every_page_stands_in_the_list_of_contents_and_every_entry_is_a_page() -> None:
    written = set(NAMES) - {"docs/index.md", *BESIDE}
    assert written - listed() == set(), "name these pages in a list of docs/index.md"
    assert listed() - written == set(), "these entries of docs/index.md have no page"


def test_the_list_of_contents_has_few_parts() -> None:
    assert text_of("docs/index.md").count(":caption:") <= HEADINGS


@pytest.mark.parametrize("page", NAMES)
def test_no_link_is_dead(page: str) -> None:
    dead = [link for link in links(text_of(page)) if not leads_somewhere(page, link)]
    assert dead == []


def leads_somewhere(page: str, link: str) -> bool:
    """Whether a link has a page and a heading, or a file of the repository, or looks like an address elsewhere."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return parts.scheme in ("http", "https") and "." in parts.netloc
    path = os.path.normpath(os.path.join(os.path.dirname(page), parts.path)) if parts.path else page
    if path not in NAMES:
        return (ROOT / path).is_file() and not parts.fragment
    return not parts.fragment or parts.fragment in anchors(text_of(path))


def test_a_missing_heading_is_a_dead_link() -> None:
    assert not leads_somewhere("docs/index.md", "drives.md#a-heading-that-is-not-there")


@pytest.mark.parametrize("page", NAMES)
def test_commands_stand_in_console_blocks(page: str) -> None:
    other = [block.text for block in blocks(text_of(page)) if block.language not in ("console", "bash", "sh")]
    lines = [*indented(text_of(page)), *itertools.chain.from_iterable(text.splitlines() for text in other)]
    assert [line for line in lines if COMMAND.match(line)] == []


@pytest.fixture(scope="module")
def app() -> App:
    return whole_app()


@pytest.mark.parametrize("page", NAMES)
def test_a_command_within_a_sentence_has_words_and_options_that_exist(app: App, page: str) -> None:
    typed = [span for span in code_spans(text_of(page)) if re.match(r"canhelm [a-z]", span)]
    assert [span for span in typed if unknown_word(app, span)] == []


def unknown_word(app: App, typed: str) -> str:
    """The first word or option of a command line that the parser does not know; values are not looked at."""
    words = re.sub(r"[\[\]]|\.\.\.", " ", typed).split()[1:]
    command = app
    while words and not words[0].startswith("-"):
        choices = words[0].split("|")
        known = command.resolved_commands()
        if any(choice not in known for choice in choices):
            break
        command = known[choices[0]]
        words = words[1:]
    if command.default_command is None or command is app:
        return words[0] if words and not words[0].isupper() and words[0] != "--help" else ""
    options = {name for argument in command.assemble_argument_collection() for name in argument.names}
    given = [word.partition("=")[0] for word in words if re.match(r"--[a-z]", word)]
    return next((option for option in given if option not in options | {"--help"}), "")


@pytest.mark.parametrize(
    ("typed", "unknown"),
    [
        ("canhelm motr velocity 1 5", "motr"),
        ("canhelm motor speed 1 5", "speed"),
        ("canhelm motor velocity 1 5 --for 3", "--for"),
        ("canhelm motor velocity NODE RPM [--duration S]", ""),
        ("canhelm config dump|diff NODE", ""),
        ("canhelm runs delete 3 4", ""),
    ],
)
def test_a_word_that_does_not_exist_is_found(app: App, typed: str, unknown: str) -> None:
    assert unknown_word(app, typed) == unknown
