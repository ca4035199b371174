"""What the pages show that a program says, to compare with what it says."""

from __future__ import annotations

import re
from pathlib import Path

from vcan_tests.docs.pages import blocks

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
NUMBER = re.compile(r"-?\d+(\.\d+)?")


def shown_output(command: str) -> str:
    """The lines that stand under a command in a console block of docs/programs.md."""
    for block in blocks((ROOT / "docs/programs.md").read_text("utf-8")):
        for shown in block.commands() if block.language == "console" else ():
            if shown.text == command:
                return "\n".join(shown.shown) + "\n"
    raise AssertionError(f"docs/programs.md does not show `{command}`")


def alike(said: str, shown: str) -> bool:
    """Whether two texts differ in numbers only; where the page has ``...``, any lines may stand."""
    wanted = re.escape(NUMBER.sub("0", shown)).replace(re.escape("...\n"), "(.*\n)*")
    return re.fullmatch(wanted, NUMBER.sub("0", said)) is not None
