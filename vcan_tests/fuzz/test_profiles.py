"""Any profile: it is loaded, and a simulated robot can be made of it; or each of its mistakes is told with its line."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from functools import cache

import msgspec
import yaml
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import ConfigError
from daemon.app import App
from daemon.runtime.clock import run_virtual
from profiles.loader import CALIBRATION, SHIPPED, ProfileError, load
from profiles.schema import Profile
from profiles.side_file import write_values
from vcan_tests.fuzz.files import file_of, read_or_told
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few

NAME = "lab.yaml"
PLACE = re.compile(r"\S+\.yaml:[1-9]\d*: \S.*; \S.*")
POWERED_S = 0.3


@cache
def usual() -> tuple[bytes, ...]:
    """The shipped robots, as they are written and with all that they extend written out."""
    files = sorted(SHIPPED.glob("robots/*.yaml"))
    whole = (yaml.safe_dump(msgspec.to_builtins(load(file).profile), sort_keys=False).encode() for file in files)
    return (*(file.read_bytes() for file in files), *whole, b"extends: max2d\nlimits: {speed_m_s: 0.5}\n")


def attempt(content: bytes) -> None:
    with file_of(content, NAME) as path:
        loaded = read_or_told(lambda: located(lambda: load(path).profile), path)
    if loaded is not None:
        run_virtual(powered(loaded))


def located(read: Callable[[], Profile]) -> Profile:
    """Whether each mistake has its line and its remedy."""
    try:
        return read()
    except ProfileError as error:
        for mistake in error.mistakes:
            assert PLACE.fullmatch(str(mistake)), str(mistake)
        raise


async def powered(profile: Profile) -> None:
    """A robot of this profile comes up and goes down; where it cannot be simulated, that is told."""
    try:
        app = App(profile)
    except ConfigError:
        return
    await app.start()
    await asyncio.sleep(POWERED_S)
    app.service.status()
    await app.close()


PROFILE = Target(
    "profile", st.deferred(lambda: damaged_text(usual()) | damaged(usual()) | st.sampled_from(usual())), attempt
)


@few(20)
@given(PROFILE.inputs)
def test_a_profile_makes_a_robot_or_is_told_its_mistakes(content: bytes) -> None:
    PROFILE.check(content)


# -- the side file ----------------------------------------------------------------------------------------------------

SIDE = b"""\
encoders:
  rear:
    calibration: {hysteresis_deg: 0.1, correction_deg: [0.1, 0.01]}
  front: {zero_counts: 99}
"""


def attempt_side(content: bytes) -> None:
    with file_of(b"extends: max2d\n", NAME) as path:
        side = path.with_name(path.stem + CALIBRATION)
        side.write_bytes(content)
        if read_or_told(lambda: write_values(path, {("drives", "rear_left", "direction"): -1}), side) is None:
            assert side.read_bytes() == content


SIDE_FILE = Target("side", damaged_text([SIDE]) | damaged([SIDE]), attempt_side)


@few(20)
@given(SIDE_FILE.inputs)
def test_a_side_file_takes_a_value_or_stays_as_it_was(content: bytes) -> None:
    SIDE_FILE.check(content)
