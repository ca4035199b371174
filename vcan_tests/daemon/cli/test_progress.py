"""What the terminal of a motion says of warnings, and of what ends it."""

from __future__ import annotations

import sys
from typing import Any

import pytest

from canhelm.client import Client
from canhelm.errors import DeviceFault
from daemon.cli.motion import progress_line

SILENT = "node 3 (front_left) is silent"


class Daemon(Client):
    """The client's end of a daemon that answers everything with nothing."""

    def __init__(self) -> None:
        self.on_notification = None

    def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        return {}


def end(daemon: Daemon, event: str) -> None:
    """A motion that hears of an event and then ends, since a node is silent."""
    with progress_line(daemon):
        assert daemon.on_notification is not None
        daemon.on_notification("event", {"severity": "error", "message": event})
        raise DeviceFault(SILENT, node=3, remedy="`canhelm reset`")


@pytest.mark.parametrize(("event", "raised"), [(SILENT, "the motion was ended by this"), ("a late cycle", SILENT)])
def test_what_ends_a_motion_is_not_told_twice(monkeypatch: pytest.MonkeyPatch, event: str, raised: str) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with pytest.raises(DeviceFault) as caught:
        end(Daemon(), event)
    assert (caught.value.message, caught.value.remedy) == (raised, "`canhelm reset`")
