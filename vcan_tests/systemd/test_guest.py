"""The machine that the tests of the service are run on: a systemd of its own, a journal, and a CAN bus."""

from __future__ import annotations

import subprocess

import pytest

pytestmark = pytest.mark.systemd


def told(*command: str) -> str:
    """What a command prints."""
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout


def test_systemd_has_booted_without_a_failed_unit() -> None:
    assert told("systemctl", "is-system-running", "--wait").strip() == "running"


def test_the_journal_keeps_what_a_service_says() -> None:
    told("systemd-run", "--wait", "--unit=speaker", "echo", "heard")
    assert "heard" in told("journalctl", "--unit=speaker", "--output=cat")


def test_a_service_without_any_capability_reaches_the_bus() -> None:
    properties = ["--property=User=nobody", "--property=CapabilityBoundingSet=", "--property=NoNewPrivileges=yes"]
    told("systemd-run", "--wait", *properties, "cansend", "vcan0", "123#AABB")


def test_what_is_written_stays_in_the_guest() -> None:
    assert told("findmnt", "--noheadings", "--output", "FSTYPE", "/").strip() == "overlay"
