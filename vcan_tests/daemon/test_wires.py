"""What a bus SPEC means, and what is wrong with one that means nothing."""

from __future__ import annotations

import pytest

from canhelm.errors import UsageError
from daemon.wires import make_wire
from profiles.loader import load

MAX2D = load("max2d").profile


@pytest.mark.parametrize("spec", ["rs232:/dev/ttyS9@abc", "rs232:/dev/ttyS9@", "rs232@7", "rs232:/dev/ttyS9@14400"])
def test_a_baud_rate_that_is_none_is_named(spec: str) -> None:
    with pytest.raises(UsageError, match="is no baud rate") as refused:
        make_wire(spec, MAX2D, 0)
    assert "115200" in (refused.value.remedy or "")


async def test_a_simulated_robot_of_a_brick_alone_has_no_can() -> None:
    assert make_wire("simulated", load("nxt").profile, 0).bus.name == "none"


def test_a_framing_that_nobody_speaks_is_refused() -> None:
    with pytest.raises(UsageError, match="'epos7' in 'rs232:/dev/ttyS9@115200,epos7' is no framing") as refused:
        make_wire("rs232:/dev/ttyS9@115200,epos7", MAX2D, 0)
    assert refused.value.remedy == "leave it out for an EPOS 24/5, or give epos2"


@pytest.mark.parametrize("spec", ["rs232:", "rs232:@115200"])
def test_a_device_that_is_left_out_is_told_with_both_meanings(spec: str) -> None:
    with pytest.raises(UsageError, match="names no serial device") as refused:
        make_wire(spec, MAX2D, 0)
    assert refused.value.remedy == "give rs232:/dev/ttyS0@115200, or rs232@115200 for a simulated line"


@pytest.mark.parametrize("spec", ["rs232:/tmp", "rs232:/dev/null", "rs232:pty"])
def test_a_path_that_can_never_be_a_line_is_wrong_usage_at_once(spec: str) -> None:
    with pytest.raises(UsageError, match=r"no serial device|no path of a device"):
        make_wire(spec, MAX2D, 0)


def test_a_device_that_is_missing_is_a_wire_all_the_same() -> None:
    assert make_wire("rs232:/dev/ttyUSB99@38400", MAX2D, 0).bus.name == "/dev/ttyUSB99"


@pytest.mark.parametrize("spec", ["Simulated", "can0"])
def test_what_names_no_bus_is_told_every_form(spec: str) -> None:
    with pytest.raises(UsageError, match="names no bus") as refused:
        make_wire(spec, MAX2D, 0)
    assert all(form in (refused.value.remedy or "") for form in ("socketcan:can0", "rs232:/dev/ttyS0", "simulated"))
