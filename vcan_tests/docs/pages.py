"""The pages of the documentation as the tests read them: headings, links and commands, by a Markdown parser."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

from daemon.reference.pages import PAGES

ROOT = Path(__file__).resolve().parents[2]
BESIDE = ("README.md", "CONTRIBUTING.md")
"""Pages that are no part of the site."""

_PARSER = MarkdownIt("commonmark").enable("table")
_COMMENT = re.compile(r"\s*<!-- (?P<key>\w+): (?P<text>.*?)\s*-->\s*\Z", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Command:
    """One command of a page, as it is shown.

    Attributes:
        line: where it stands.
        text: what a person types.
        shown: what the page says that it answers.
    """

    line: int
    text: str
    shown: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block with what the comment before it says of it.

    Attributes:
        line: where it begins.
        language: word behind the fence.
        text: its lines.
        needs: why it cannot be run in a test; empty where it can.
        before: commands that have to be run first, which the page does not show.
        file: name of the file that it is the text of.
    """

    line: int
    language: str
    text: str
    needs: str = ""
    before: str = ""
    file: str = ""

    def commands(self) -> list[Command]:
        """The commands of a console block, each behind a ``$``, and what is shown under them."""
        found: list[Command] = []
        for line, text in enumerate(self.text.splitlines(), self.line + 1):
            if text.startswith("$ "):
                found.append(Command(line, text[2:]))
            elif found:
                found[-1] = Command(found[-1].line, found[-1].text, (*found[-1].shown, text))
        return found


@cache
def written() -> dict[str, str]:
    """Every page that people write, as Markdown, by its path in the repository."""
    paths = [*sorted(ROOT.glob("docs/*.md")), *(ROOT / name for name in BESIDE)]
    return {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in paths}


GENERATED = {f"docs/reference/{name}": make for name, make in PAGES.items()}
"""What makes the other pages, by the paths that these have in the site."""
NAMES = [*written(), *GENERATED]


@cache
def text_of(page: str) -> str:
    """A page as Markdown."""
    return written()[page] if page in written() else GENERATED[page]()


@cache
def _parsed(text: str) -> list[Token]:
    return _PARSER.parse(text)


def _flat(tokens: list[Token]) -> Iterator[Token]:
    for token in tokens:
        yield token
        yield from _flat(token.children or [])


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page in their order; a comment that holds a whole file counts as one."""
    said: dict[str, str] = {}
    for token in _parsed(text):
        comment = _COMMENT.match(token.content) if token.type == "html_block" else None
        begin = token.map[0] + 1 if token.map else 0
        if token.type == "fence":
            yield Block(begin, token.info.strip(), token.content, **said)
            said = {}
        elif comment and "\n" in comment["text"] and comment["key"] == "file":
            name, _, content = comment["text"].partition("\n")
            yield Block(begin, "yaml", content + "\n", file=name)
        elif comment:
            said[comment["key"]] = comment["text"]


def indented(text: str) -> list[str]:
    """Lines of the blocks of a page that are only indented."""
    return [line for token in _parsed(text) if token.type == "code_block" for line in token.content.splitlines()]


def code_spans(text: str) -> set[str]:
    """What stands in backticks within the lines of a page."""
    return {token.content for token in _flat(_parsed(text)) if token.type == "code_inline"}


def links(text: str) -> set[str]:
    """Where the links and pictures of a page lead."""
    found = {str(token.attrs.get("href") or token.attrs.get("src")) for token in _flat(_parsed(text)) if token.attrs}
    return found - {"None"}


@cache
def anchors(text: str) -> set[str]:
    """The names by which links find the headings of a page, as GitHub and the site make them."""
    found: set[str] = set()
    parsed = _parsed(text)
    for opening, inline in itertools.pairwise(parsed):
        if opening.type == "heading_open":
            words = "".join(token.content for token in inline.children or [])
            slug = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
            doubles = sum(1 for known in found if re.fullmatch(rf"{re.escape(slug)}(-\d+)?", known))
            found.add(f"{slug}-{doubles}" if doubles else slug)
    return found


def listed() -> set[str]:
    """The pages that the site's list of contents names."""
    trees = [block.text for block in blocks(text_of("docs/index.md")) if block.language == "{toctree}"]
    names = [line for tree in trees for line in tree.splitlines() if line and not line.startswith(":")]
    return {f"docs/{name}.md" for name in names}
