"""The page of all commands, from the command line's own parser."""

from __future__ import annotations

import re

from daemon.cli.main import whole_app

HEAD = """# Commands

What `canhelm COMMAND --help` says, for every command; `man canhelm` has the same where canhelm is installed.

"""


def commands() -> str:
    """Every command with its arguments, options and an example, as Markdown."""
    return HEAD + command_sections()


def command_sections() -> str:
    """The same without the page's head: ``## canhelm``, ``### canhelm motor``, ``#### canhelm motor velocity``."""
    text = whole_app().generate_docs(heading_level=2, max_heading_level=4, usage_name="canhelm")
    contents = re.compile(
        r"^## Table of Contents\n.*?(?=^\*\*)", re.MULTILINE | re.DOTALL
    )  # the groups below list them, too
    return contents.sub("", text).replace(" *[default: False]*", "")
