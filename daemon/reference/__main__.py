"""``python -m daemon.reference KIND DIR [KIND DIR ...]``: what ``make docs`` and the packages need of these pages."""

from __future__ import annotations

import sys
from pathlib import Path

from daemon.reference.completions import completions
from daemon.reference.man import man_pages
from daemon.reference.pages import site_pages, write

KINDS = {"pages": site_pages, "man": man_pages, "completions": completions}


def main(argv: list[str]) -> int:
    """Write each kind of files into its folder; the exit code."""
    wanted = list(zip(argv[::2], argv[1::2], strict=False))
    if not argv or len(argv) % 2 or any(kind not in KINDS for kind, _ in wanted):
        print(f"usage: python -m daemon.reference {'|'.join(KINDS)} DIR ...", file=sys.stderr)
        return 2
    for kind, folder in wanted:
        write(KINDS[kind](), Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
