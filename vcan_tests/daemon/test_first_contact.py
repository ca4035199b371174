"""A daemon without a profile: it listens, scans, tells who is there, and jogs them slowly."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest

from canhelm.errors import LimitExceeded
from daemon.app import App
from daemon.first_contact import PAUSE_S, FirstContact, bench_profile
from daemon.life import Life
from daemon.runtime.notify import ServiceManager
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.encoder import SimulatedEncoder
from drivers.simulated.epos import SimulatedEpos
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.serial import SimulatedSerial
from drivers.simulated.serial_wire import SerialPty
from profiles.loader import load
from profiles.schema import EncoderConfig, Network, Profile
from vcan_tests.drivers.epos_bench import BenchWorld, drive_config


async def _no_reload() -> Profile:
    raise AssertionError("nobody asks for it")


class Bench:
    """A bus on a bench, with whatever hangs on it, and the daemon.

    Attributes:
        medium: the bus.
        sent: identifiers of the frames that the daemon has sent.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.medium = SimulatedBus()
        self.sent: list[int] = []
        self.world = BenchWorld()
        monkeypatch.setattr("daemon.wires.open_bus", lambda spec, bit_rate: self.medium.port("daemon"))
        self.life = Life(lambda profile: App(profile, "socketcan:can0"), _no_reload, ServiceManager())
        self.contact = FirstContact(self.life)

    def drive(self, node: int = 1) -> SimulatedEpos:
        """Switch on a drive at factory settings."""
        port = self.medium.port(f"drive {node}")
        epos = SimulatedEpos(port, drive_config(node), self.world.axes["bench"], self.world, 0.05, seed=node)
        epos.dictionary.forget()
        epos.power_on()
        return epos

    def encoder(self, node: int) -> None:
        """Switch on an encoder."""
        config = EncoderConfig(node=node, counts_per_turn=4096)
        SimulatedEncoder(self.medium.port(f"encoder {node}"), config, "front", self.world, 0.05).power_on()

    def watch_world(self) -> None:
        """Look at the world every 10 ms, as a network does."""
        self.world.advance(asyncio.get_running_loop().time())
        self._watching = asyncio.get_running_loop().call_later(0.01, self.watch_world)

    async def call(self, method: str, **params: Any) -> dict[str, Any]:
        """One method of the API."""
        service = self.life.app.service
        lease = service.open_lease("test")
        calling = asyncio.create_task(service.call(method, params, lease))
        while not (await asyncio.wait([calling], timeout=0.5))[0]:
            service.renew_lease(lease)
        return await calling

    @property
    def status(self) -> dict[str, Any]:
        """What ``canhelm status`` shows."""
        return self.life.app.service.status()

    async def until_met(self) -> None:
        """Wait until the found nodes are ready."""
        await asyncio.sleep(3.0)
        assert {node["node_state"] for node in self.status["nodes"]} == {"ready"}


@asynccontextmanager
async def unknown_bus(
    monkeypatch: pytest.MonkeyPatch, *, set_up: Callable[[Bench], object] = lambda _: None
) -> AsyncIterator[Bench]:
    """A running daemon on a bus that it knows nothing of."""
    bench = Bench(monkeypatch)
    bench.watch_world()
    set_up(bench)
    running = asyncio.create_task(bench.life.run(bench_profile(Network())))
    bench.contact.start()
    await asyncio.sleep(0.1)
    try:
        yield bench
    finally:
        bench._watching.cancel()
        bench.life.end()
        await running
        await bench.contact.close()


async def test_a_drive_at_factory_settings_is_found_and_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch, set_up=lambda bench: bench.drive(3)) as bench:
        await bench.until_met()
        (row,) = bench.status["found"]
        assert (row["name"], row["device"], row["firmware"]) == ("node_3", "EPOS 24/5", "2011")
        assert row["state"].startswith("switch on disabled: Initialised, power stage off")
        assert "500 pulses a turn" in row["remark"]
        assert [node["name"] for node in bench.status["nodes"]] == ["node_3"]


async def test_nothing_is_sent_before_it_has_listened(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch) as bench:
        await asyncio.sleep(0.8)
        assert not bench.medium.frames
        assert bench.status["message"] == "listening to vcan0 before anything is sent"
        await asyncio.sleep(0.5)
        assert bench.medium.frames


async def test_a_drive_is_jogged_under_a_cap_of_speed_and_current(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch, set_up=lambda bench: bench.drive()) as bench:
        await bench.until_met()
        asyncio.get_running_loop().call_later(0.95, lambda: seen.append(bench.status["nodes"][0]["velocity_rpm"]))
        seen: list[float] = []
        await bench.call("motor.velocity", node=1, velocity_rpm=500.0, duration_s=1.0)
        assert seen[0] == pytest.approx(500.0, abs=10.0)
        with pytest.raises(LimitExceeded):
            await bench.call("motor.velocity", node=1, velocity_rpm=502.0, duration_s=1.0)
        with pytest.raises(LimitExceeded):
            await bench.call("motor.current", node=1, current_ma=501.0, duration_s=1.0)
        limit = await bench.call("sdo.read", node=1, object="output_current_limit")
        assert limit["value"] == 500


async def test_what_a_drive_was_set_to_comes_back_with_its_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    epos: list[SimulatedEpos] = []
    async with unknown_bus(monkeypatch, set_up=lambda bench: epos.append(bench.drive())) as bench:
        await bench.until_met()
    epos[0].power_off()
    epos[0].power_on()
    await asyncio.sleep(0.1)
    assert epos[0].dictionary.number("output_current_limit") == 10_000


async def test_a_recorded_error_is_told_with_its_cure(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch) as bench:
        epos = bench.drive()
        await asyncio.sleep(0.1)
        epos.trigger_fault(0x3220)
        await bench.until_met()
        (row,) = bench.status["found"]
        assert row["errors"] == ["0x3220"]
        assert "under-voltage (0x3220)" in row["remark"]
        assert row["state"].startswith("fault:")


async def test_two_drives_with_one_id_are_named_and_not_driven(monkeypatch: pytest.MonkeyPatch) -> None:
    def two(bench: Bench) -> None:
        bench.drive(1)
        bench.drive(1)

    async with unknown_bus(monkeypatch, set_up=two) as bench:
        await asyncio.sleep(3.0)
        assert bench.status["state"] == "waiting"
        assert "node 1: two nodes have this id" in bench.status["message"]
        assert bench.status["nodes"] == []


async def test_an_empty_bus_is_looked_at_until_somebody_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch) as bench:
        await asyncio.sleep(3.0)
        assert "nobody answers on vcan0 at 1000000 bit/s: check motor power" in bench.status["message"]
        bench.drive(7)
        await asyncio.sleep(PAUSE_S)
        await bench.until_met()
        assert [node["name"] for node in bench.status["nodes"]] == ["node_7"]


async def test_a_bus_of_another_bit_rate_is_named_and_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch) as bench:
        bench.life.app.bus.counters.error_frames += 12  # as a controller counts that hears frames of another rate
        await asyncio.sleep(1.2)
        assert "12 error frames and not one good frame" in bench.status["message"]
        assert not bench.medium.frames


async def test_silent_drives_of_another_bit_rate_are_suspected(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch) as bench:
        bench.medium.port("a drive at 500 kbit/s").set_bit_rate(500_000)
        await asyncio.sleep(3.0)
        assert "1000000 bit/s is probably not the bit rate of this network" in bench.status["message"]


async def test_a_bus_with_another_master_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch) as bench:
        bench.medium.port("another master").send(0x080)
        await asyncio.sleep(1.2)
        assert "another master sends SYNC" in bench.status["message"]
        assert sum(bench.medium.frames.values()) == 1


@pytest.mark.real_time
async def test_the_drive_on_a_serial_line_is_found() -> None:
    robot = load("max2d").profile
    network = SimulatedNetwork(robot, SimulatedBus(), 1)
    network.power_on("front_left")
    pty = SerialPty(SimulatedSerial(network.drives["front_left"], 115200, seed=1).cable)
    life = Life(lambda profile: App(profile, f"rs232:{pty.device}"), _no_reload, ServiceManager())
    contact = FirstContact(life)
    running = asyncio.create_task(life.run(bench_profile(Network())))
    contact.start()
    for _ in range(100):
        await asyncio.sleep(0.1)
        if life.app.service.state == "idle":
            break
    status = life.app.service.status()
    assert (status["found"][0]["name"], status["nodes"][0]["node"]) == ("node_3", 3)
    life.end()
    await running
    await contact.close()
    pty.close()
    await network.close()


async def test_an_encoder_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    async with unknown_bus(monkeypatch, set_up=lambda bench: bench.encoder(5)) as bench:
        bench.world.heading = 0.5
        await bench.until_met()
        (node,) = bench.status["nodes"]
        assert (node["name"], node["heading_deg"]) == ("node_5", pytest.approx(28.6, abs=0.1))
