"""The page of all commands, from the command line's own parser."""

from __future__ import annotations

import re

from daemon.cli.main import whole_app

SUPERFLUOUS = (
    re.compile(r"^## Table of Contents\n.*?(?=^\*\*)", re.MULTILINE | re.DOTALL),  # the groups below it list them, too
    re.compile(r" -m [\w.]+(?=\s)"),  # how Python was started, between the command and its arguments
    re.compile(r" \*\[default: False\]\*"),
)
"""What the parser writes and nobody needs."""
HEAD = """# Commands

What `canhelm COMMAND --help` says, for every command; `man canhelm` has the same where canhelm is installed.

"""


def commands() -> str:
    """Every command with its arguments, options and an example, as Markdown."""
    return HEAD + command_sections()


def command_sections() -> str:
    """The same without the page's head: ``## canhelm``, ``### canhelm motor``, ``#### canhelm motor velocity``."""
    text = whole_app().generate_docs(heading_level=2, max_heading_level=4)
    for superfluous in SUPERFLUOUS:
        text = superfluous.sub("", text)
    return text
