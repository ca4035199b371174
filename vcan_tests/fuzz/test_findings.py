"""What `make fuzz` has found stays mended: each finding is a file, tried again each time."""

from __future__ import annotations

from pathlib import Path

import pytest

from vcan_tests.fuzz.rooms import targets

FOLDER = Path(__file__).parent / "findings"
"""Put a file of ``fuzz-findings/`` in here; its name begins with that of its target and may go on in words."""


@pytest.mark.parametrize("path", sorted(FOLDER.iterdir()), ids=lambda path: path.name)
def test_what_was_found_is_mended(path: Path) -> None:
    targets()[path.name.partition(".")[0]].check(path.read_bytes())
