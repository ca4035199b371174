"""How an interface comes up on a real system: by udev's rule, by its unit, and by systemd-networkd."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.bus.can_link import CanLink, read_link
from vcan_tests.kernel.fetch import fetch_udev
from vcan_tests.kernel.slcan_adapter import SlcanAdapter
from vcan_tests.systemd.bench import Robot, tell, told, until

pytestmark = [pytest.mark.systemd, pytest.mark.timeout(240)]

EXAMPLE = Path("/usr/share/doc/canhelm/examples/80-can0.network")
NETWORK = Path("/etc/systemd/network/80-can0.network")
SETTINGS = Path("/etc/canhelm/can0.env")


@pytest.fixture(scope="module", autouse=True)
def _devices() -> None:
    """udev runs, with the rule of the package."""
    Robot().clear()
    if shutil.which("udevadm") is None:
        told(
            "sh", "-c", f"dpkg-deb --fsys-tarfile {fetch_udev()} | tar --extract --directory / --keep-directory-symlink"
        )
        told("systemctl", "daemon-reload")
    told("systemctl", "start", "systemd-udevd")
    told("udevadm", "control", "--reload")


@pytest.fixture
def adapter() -> Iterator[SlcanAdapter]:
    """An adapter whose interface, can0, is down and has a bit rate that nobody wants; udev has seen it."""
    with SlcanAdapter(bit_rate=125_000) as plugged_in:
        plugged_in.down()
        told("udevadm", "settle")
        yield plugged_in


def queue_of(interface: str) -> int:
    return int(Path(f"/sys/class/net/{interface}/tx_queue_len").read_text())


def test_each_can_interface_gets_a_queue_for_a_burst() -> None:
    told("ip", "link", "add", "can5", "type", "vxcan", "peer", "name", "can6")
    try:
        told("udevadm", "settle")
        assert (queue_of("can5"), queue_of("can6")) == (1000, 1000)
    finally:
        told("ip", "link", "delete", "can5")


@pytest.mark.usefixtures("adapter")
def test_its_unit_brings_an_interface_up_as_its_settings_say_and_down_again() -> None:
    SETTINGS.write_text("CAN_BIT_RATE=500000\nCAN_OPTIONS=\nCAN_QUEUE=900\n")
    told("systemctl", "start", "can@can0")
    assert (read_link("can0"), queue_of("can0")) == (CanLink(500_000, "ERROR-ACTIVE", restart_ms=0), 900)
    told("systemctl", "stop", "can@can0")
    assert read_link("can0").state == "STOPPED"


async def test_its_unit_ends_with_the_adapter(adapter: SlcanAdapter) -> None:
    told("sh", "-c", f"echo CAN_OPTIONS= >{SETTINGS}")
    told("systemctl", "start", "can@can0")
    adapter.unplug()
    await until(lambda: tell("systemctl", "is-active", "can@can0").stdout.strip() == "inactive")


@pytest.fixture
def networkd(adapter: SlcanAdapter) -> Iterator[None]:
    """systemd-networkd with the shipped file, but for what no driver of such an adapter knows."""
    NETWORK.parent.mkdir(exist_ok=True)
    NETWORK.write_text(EXAMPLE.read_text().replace("RestartSec=100ms\n", ""))
    told("systemctl", "start", "systemd-networkd")
    yield
    told("systemctl", "stop", "systemd-networkd.socket", "systemd-networkd")
    NETWORK.unlink()


@pytest.mark.usefixtures("networkd")
async def test_networkd_brings_an_interface_up_by_the_file_that_is_shipped() -> None:
    await until(lambda: read_link("can0") == CanLink(1_000_000, "ERROR-ACTIVE", restart_ms=0))
