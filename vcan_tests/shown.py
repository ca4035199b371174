"""What docs/programs.md shows that a program says, to compare with what it says."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
NUMBER = re.compile(r"-?\d+(\.\d+)?")
ANY_LINES = "...\n"


def shown_output(command: str) -> str:
    """The lines that stand under a command in a console block of the page."""
    page = (ROOT / "docs" / "programs.md").read_text("utf-8")
    block = re.search(rf"^\$ {re.escape(command)}\n((?:(?!\$ |```).*\n)+)", page, re.MULTILINE)
    assert block is not None, f"docs/programs.md does not show `{command}`"
    return block[1]


def alike(said: str, shown: str) -> bool:
    """Whether two texts differ in numbers only; where the page has ``...``, any lines may stand."""
    wanted = re.escape(NUMBER.sub("0", shown)).replace(re.escape(ANY_LINES), "(.*\n)*")
    return re.fullmatch(wanted, NUMBER.sub("0", said)) is not None
