"""What `make bench` measures on a kernel's bus, for a moment only."""

from __future__ import annotations

from pathlib import Path

import pytest

from vcan_tests.vcan import speeds

pytestmark = pytest.mark.vcan


def test_every_producer_of_sync_and_every_cycle_is_timed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.rates.REAL_RATES_HZ", (50.0,))
    found = speeds.measure(tmp_path, 0.5)
    assert len(found["jitter_us"]) == 3
    assert all(errors for errors in found["jitter_us"].values())
    assert found["latency_us"]
    assert [rate["hz"] for rate in found["rates"]] == [50.0]
