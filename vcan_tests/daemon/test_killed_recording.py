"""A recording whose daemon is killed."""

from __future__ import annotations

from pathlib import Path

import pytest

from daemon.runtime.log_forms import FORMS
from daemon.runtime.recorder import WRITE_PERIOD_S
from vcan_tests.daemon.killed_recording import kill_while_recording

SCHEDULING_S = 0.2
"""What a loaded machine may keep the thread waiting that writes."""


@pytest.mark.real_time
@pytest.mark.timeout(150)
@pytest.mark.parametrize("form", FORMS)
def test_a_killed_daemon_loses_no_more_of_its_recording_than_is_stated(tmp_path: Path, form: str) -> None:
    killed = kill_while_recording(tmp_path, form)
    assert killed.unreadable <= 1
    assert killed.lost_s <= WRITE_PERIOD_S + SCHEDULING_S
