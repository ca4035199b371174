"""``python -m daemon.reference pages|man|completions DIR``: what ``make docs`` and the packages need of these pages."""

from __future__ import annotations

import sys
from pathlib import Path

from daemon.reference.completions import completions
from daemon.reference.man import man_pages
from daemon.reference.pages import site_pages, write

KINDS = {"pages": site_pages, "man": man_pages, "completions": completions}


def main(argv: list[str]) -> int:
    """Write one kind of files into a folder; the exit code."""
    if len(argv) != 2 or argv[0] not in KINDS:
        print(f"usage: python -m daemon.reference {'|'.join(KINDS)} DIR", file=sys.stderr)
        return 2
    write(KINDS[argv[0]](), Path(argv[1]))
    return 0


if __name__ == "__main__":
    sys.argv[0] = "canhelm"  # else the parser writes "-m daemon.reference" into the usage of commands
    sys.exit(main(sys.argv[1:]))
