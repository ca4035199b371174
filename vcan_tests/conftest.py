"""What a test needs, told by its marks: virtual time unless one of the others says otherwise."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import hypothesis
import pytest

from daemon.runtime.clock import VirtualTimeLoop
from vcan_tests.awake import awake_processors
from vcan_tests.kernel.guest import COMMAND_IN_GUEST, RUNNING_SYSTEMD
from vcan_tests.station.browser import CHROMIUM

hypothesis.settings.register_profile("canhelm", deadline=None)
hypothesis.settings.load_profile("canhelm")

for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    signal.signal(number, handler)  # nohup and shells in the background have them ignored, and processes inherit that

if not COMMAND_IN_GUEST.exists():
    os.environ["CANHELM_ROBOTS"] = "/nonexistent"  # the robots of whoever runs the tests are not those that are tested

os.environ["CANHELM_RUNS"] = "off"  # nor do tests leave runs with them

NEEDS = {
    "vcan": [Path("/sys/class/net/vcan0"), Path("/sys/class/net/vcan1")],
    "systemd": [RUNNING_SYSTEMD, COMMAND_IN_GUEST],
    "station": [CHROMIUM],
}
MADE_BY = {"vcan": "make vcan-test", "systemd": "make vcan-test", "station": "make station-test"}


def pytest_asyncio_loop_factories(item: pytest.Item) -> Mapping[str, Callable[[], asyncio.AbstractEventLoop]]:
    """The kind of loop that a test runs on."""
    if any(item.get_closest_marker(mark) for mark in ("real_time", *NEEDS)):
        return {"real": asyncio.SelectorEventLoop}
    return {"virtual": VirtualTimeLoop}


@pytest.hookimpl(tryfirst=True)  # before the marks choose
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests in real time get a second and a third try: a loaded machine may stand still for longer than they allow."""
    for item in items:
        if "bench" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.real_time)
        if any(item.get_closest_marker(mark) for mark in ("real_time", *NEEDS)):
            item.add_marker(pytest.mark.flaky(reruns=2))


@pytest.fixture(autouse=True)
def _awake(request: pytest.FixtureRequest) -> Iterator[None]:
    """A test in real time is not to wait for a sleeping processor.

    The processor of a guest is a process of its host, which comes to its turn the sooner the more it has rested.
    """
    wanted = request.node.get_closest_marker("real_time") and not COMMAND_IN_GUEST.exists()
    with awake_processors() if wanted else contextlib.nullcontext():
        yield


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test that can't run here, fails: a skipped one proves nothing."""
    for mark, paths in NEEDS.items():
        missing = [str(path) for path in paths if item.get_closest_marker(mark) and not path.exists()]
        if missing:
            pytest.fail(f"marked {mark}, but here is no {' and no '.join(missing)}: run {MADE_BY[mark]}", pytrace=False)
