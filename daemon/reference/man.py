"""The pages for ``man``: canhelm(1), and canhelm-COMMAND(1) for every command, from the sections of the commands' page.

Only the Markdown that the parser writes is known here: headings, paragraphs, lists, one fenced line of usage.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from canhelm import __version__
from daemon.reference.commands import command_sections
from daemon.reference.errors import exit_codes

ELSEWHERE = "Robots, wiring, profiles and all error messages: the documentation in /usr/share/doc/canhelm."
_COMMAND = re.compile(r"^### canhelm (\S+)\n", re.MULTILINE)
_USAGE = re.compile(r"```console\n(.*)\n```\n")
_INLINE = re.compile(r"\[`(?P<link>[^`]*)`\]\([^)]*\)|`(?P<code>[^`]*)`|\*\*(?P<bold>[^*]+)\*\*|\*(?P<slanted>[^*]+)\*")
_ITEM = re.compile(r"\* (?P<tag>\[?`[^`]*`(?:\]\([^)]*\))?(?:, `[^`]*`)*): ?(?P<rest>.*)")


def man_pages() -> dict[str, str]:
    """Every page as roff, by the name of its file."""
    overview, *rest = _COMMAND.split(command_sections())
    commands = dict(zip(rest[::2], rest[1::2], strict=True))
    pages = {f"canhelm-{name}.1": _page(f"canhelm-{name}", text) for name, text in commands.items()}
    return {"canhelm.1": _overview(overview.removeprefix("## canhelm\n"), list(commands))} | pages


def _overview(text: str, commands: list[str]) -> str:
    codes = "".join(f".TP\n.B {code}\n{_inline(meaning)}\n" for code, meaning in exit_codes().items())
    others = ",\n".join(f".BR {_escaped('canhelm-' + name)} (1)" for name in commands)
    return f"{_page('canhelm', text)}.SH EXIT STATUS\n{codes}.SH SEE ALSO\n{others}\n.PP\n{_inline(ELSEWHERE)}\n"


def _page(name: str, markdown: str) -> str:
    """One page: what the command does, then a section for each word that may follow it."""
    own, *subcommands = markdown.split("\n#### ")
    usage, text = _usage_and_text(own)
    summary = text.strip().partition("\n")[0].partition(". ")[0].rstrip(".")
    parts = [f'.TH "{name.upper()}" "1" "" "canhelm {__version__}" "canhelm"\n']
    parts += [f".SH NAME\n{_escaped(name)} \\- {_inline(summary)}\n"]
    parts += [f".SH SYNOPSIS\n.B {_escaped(usage)}\n"] if usage else []
    parts += [".SH DESCRIPTION\n", *_lines(text)]
    for section in subcommands:
        title, _, rest = section.partition("\n")
        usage, text = _usage_and_text(rest)
        parts += [f".SH {_escaped(title.upper())}\n.B {_escaped(usage)}\n", *_lines(text)]
    return "".join(parts)


def _usage_and_text(markdown: str) -> tuple[str, str]:
    """The fenced line of a section, empty where there is none, and the rest of it."""
    found = _USAGE.search(markdown)
    return (found[1], markdown[: found.start()] + markdown[found.end() :]) if found else ("", markdown)


def _lines(markdown: str) -> Iterator[str]:
    for line in markdown.splitlines():
        item = _ITEM.match(line)
        if item:
            yield f".TP\n{_inline(item['tag'])}\n{_inline(item['rest'])}\n"
        else:
            yield f"{_inline(line.strip())}\n" if line.strip() else ".PP\n"


def _inline(text: str) -> str:
    """Code and bold in bold, what is slanted in italics; the rest as it is."""
    parts, end = [], 0
    for found in _INLINE.finditer(text):
        bold = found["link"] or found["code"] or found["bold"]
        marked = f"\\fB{_escaped(bold)}\\fR" if bold else f"\\fI{_escaped(found['slanted'] or '')}\\fR"
        parts += [_escaped(text[end : found.start()]), marked]
        end = found.end()
    return _guarded("".join(parts) + _escaped(text[end:]))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\e").replace("-", "\\-")


def _guarded(line: str) -> str:
    """A line of text that begins like a request is none."""
    return f"\\&{line}" if line.startswith((".", "'")) else line
