"""What the doctor finds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        check: what was looked at.
        verdict: ``problem`` makes the command's exit code 1.
        finding: what was found.
        mend: the line that mends it; empty where there is nothing to mend.
    """

    check: str
    verdict: Literal["ok", "note", "problem"]
    finding: str
    mend: str = ""
