"""Async tests run on virtual time; those that need sockets, threads or the real clock are marked ``real_time``."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

import pytest

from daemon.runtime.clock import VirtualTimeLoop


def pytest_asyncio_loop_factories(item: pytest.Item) -> Mapping[str, Callable[[], asyncio.AbstractEventLoop]]:
    """The kind of loop that a test runs on."""
    if item.get_closest_marker("real_time"):
        return {"real": asyncio.SelectorEventLoop}
    return {"virtual": VirtualTimeLoop}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests in real time get a second and a third try: a loaded machine may stand still for longer than they allow."""
    for item in items:
        if item.get_closest_marker("real_time") or "bench" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.flaky(reruns=2))
