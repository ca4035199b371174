"""A daemon to type at, and none."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from canhelm import protocol
from daemon.api.server import Server
from vcan_tests.daemon.fake_backend import FakeBackend, served


@pytest.fixture
def backend() -> FakeBackend:
    return FakeBackend()


@pytest.fixture
def server(backend: FakeBackend, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    with served(backend, tmp_path / "robot.sock") as server:
        monkeypatch.setenv("CANHELM_SOCKET", os.fspath(server.path))
        yield server


@pytest.fixture
def nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No daemon runs anywhere."""
    monkeypatch.delenv("CANHELM_SOCKET", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(protocol, "SYSTEM_FOLDER", tmp_path / "no-system")
