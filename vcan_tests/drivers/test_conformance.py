"""A second opinion: the library ``canopen`` as master of the simulated devices, and as a slave of this master.

Both sides meet on a virtual bus of python-can. The library works in threads, so everything here runs in real time.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from math import pi
from typing import Any, TypeVar

import canopen
import pytest
from canopen.sdo.client import SdoClient

from canhelm.errors import Aborted
from drivers.bus.python_can import PythonCanBus, python_can_bus
from drivers.canopen.boot import NodeBoot
from drivers.canopen.codes import NmtState
from drivers.canopen.master import Master, NodeEvent
from drivers.canopen.objects import Access, DataType, ObjectDef, ObjectTable
from drivers.encoder.encoder import Cia406Encoder
from drivers.encoder.objects import OBJECTS as ENCODER_OBJECTS
from drivers.epos.objects import OBJECTS as EPOS_OBJECTS
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.dictionary import SimulatedDictionary
from drivers.simulated.encoder import SimulatedEncoder
from drivers.simulated.network import SimulatedNetwork
from drivers.simulated.node import SimulatedNode
from profiles.loader import load
from profiles.schema import EncoderConfig, Network
from vcan_tests.peer import peer_dictionary

pytestmark = [pytest.mark.real_time, pytest.mark.timeout(30)]


@pytest.fixture(autouse=True)
def patient_peer(monkeypatch: pytest.MonkeyPatch) -> None:
    """The peer waits 300 ms for an answer; a loaded machine may pause for longer."""
    monkeypatch.setattr(SdoClient, "RESPONSE_TIMEOUT", 3.0)


EPOS, ENCODER, STORE = 1, 5, 9
LIMIT_S = 5.0
BLOB = ObjectDef(0x2F00, 0, "blob", DataType.DOMAIN, Access.RW, "")
STORE_OBJECTS = ObjectTable((*ENCODER_OBJECTS.objects, BLOB))
LONG = bytes(range(256)) * 3 + b"end"

T = TypeVar("T")


async def in_thread(call: Callable[[], T]) -> T:
    """A call of the library, which blocks."""
    return await asyncio.wait_for(asyncio.to_thread(call), LIMIT_S)


class Heard:
    """Waits in the loop for something that the library says in one of its threads."""

    def __init__(self) -> None:
        self._event = threading.Event()

    def __call__(self, *_: object) -> None:
        self._event.set()

    async def wait(self) -> bool:
        return await in_thread(lambda: self._event.wait(LIMIT_S - 1.0))


@asynccontextmanager
async def peer_network(channel: str) -> AsyncIterator[canopen.Network]:
    """The library on a virtual channel."""
    network = canopen.Network()
    network.connect(interface="virtual", channel=channel)
    try:
        yield network
    finally:
        await in_thread(network.disconnect)


class Twins:
    """The simulated MAX2D and a node with a long object, reached by the library through a bridge.

    Attributes:
        peer: the library as master.
        epos, encoder, store: the library's view of three of the nodes.
    """

    def __init__(self, peer: canopen.Network, bridge: PythonCanBus) -> None:
        self.medium = SimulatedBus()
        self.network = SimulatedNetwork(load("max2d").profile, self.medium, 0)
        dictionary = SimulatedDictionary(STORE_OBJECTS, STORE, {})
        self.store_twin = SimulatedNode(
            self.medium.port("store"),
            STORE,
            dictionary,
            receive_pdos=0,
            transmit_pdos=2,
            boot_delay_s=0.01,
            block_transfer=True,
        )
        port = self.medium.port("bridge")
        port.receiver = lambda can_id, data, stamp: bridge.send(can_id, data)
        bridge.receiver = lambda can_id, data, stamp: port.send(can_id, data)
        self.peer = peer
        self.epos = peer.add_node(EPOS, peer_dictionary(EPOS_OBJECTS))
        self.encoder = peer.add_node(ENCODER, peer_dictionary(ENCODER_OBJECTS))
        self.store = peer.add_node(STORE, peer_dictionary(STORE_OBJECTS))

    async def power_on(self) -> None:
        self.network.power_on()
        self.store_twin.power_on()
        await asyncio.sleep(0.2)

    async def close(self) -> None:
        self.store_twin.power_off()
        await self.network.close()


@asynccontextmanager
async def twins(channel: str) -> AsyncIterator[Twins]:
    """Simulated devices with power, and the library as their master."""
    bridge = python_can_bus("virtual", channel, 1_000_000)
    await bridge.open()
    async with peer_network(channel) as peer:
        made = Twins(peer, bridge)
        await made.power_on()
        try:
            yield made
        finally:
            await made.close()
            await bridge.close()


# --- the library as master -------------------------------------------------------------------------------------------


async def test_peer_reads_and_writes_expedited() -> None:
    async with twins("expedited") as t:
        assert await in_thread(lambda: t.epos.sdo.upload(0x1000, 0)) == bytes.fromhex("92012000")
        await in_thread(lambda: t.epos.sdo.download(0x6083, 0, (2000).to_bytes(4, "little")))
        assert t.network.drives["rear_right"].dictionary.number("profile_acceleration") == 2000


async def test_peer_gets_our_abort_codes() -> None:
    async with twins("abort") as t:
        with pytest.raises(canopen.SdoAbortedError) as caught:
            await in_thread(lambda: t.epos.sdo.download(0x6041, 0, b"\0\0"))
        assert caught.value.code == 0x06010002


async def test_peer_reads_and_writes_in_segments() -> None:
    async with twins("segmented") as t:
        assert await in_thread(lambda: t.encoder.sdo.upload(0x1008, 0)) == b"CiA 406 encoder"
        await in_thread(lambda: t.store.sdo.download(BLOB.index, 0, LONG))
        assert await in_thread(lambda: t.store.sdo.upload(BLOB.index, 0)) == LONG


async def test_peer_writes_in_blocks() -> None:
    async with twins("block-down") as t:

        def write() -> None:
            with t.store.sdo.open(BLOB.index, 0, "wb", size=len(LONG), block_transfer=True) as stream:
                stream.write(LONG)

        await in_thread(write)
        assert t.store_twin.dictionary.values[BLOB.index, 0] == LONG


async def test_peer_reads_in_blocks() -> None:
    async with twins("block-up") as t:
        t.store_twin.dictionary.values[BLOB.index, 0] = LONG

        def read() -> bytes:
            with t.store.sdo.open(BLOB.index, 0, "rb", block_transfer=True) as stream:
                return bytes(stream.read())

        assert await in_thread(read) == LONG


async def test_the_simulated_epos_refuses_blocks() -> None:
    async with twins("block-epos") as t:
        with pytest.raises(canopen.SdoAbortedError) as caught:
            await in_thread(lambda: t.epos.sdo.open(0x1008, 0, "rb", block_transfer=True))
        assert caught.value.code == 0x05040001


async def test_peer_remaps_a_pdo_and_receives_it_after_sync() -> None:
    async with twins("remap") as t:
        pdo = t.epos.tpdo[1]
        heard = Heard()

        def remap() -> None:
            pdo.read()
            pdo.clear()
            pdo.add_variable(0x6041)
            pdo.add_variable(0x606C)
            pdo.cob_id, pdo.trans_type, pdo.enabled = 0x180 + EPOS, 1, True
            pdo.save()
            pdo.add_callback(heard)
            t.epos.nmt.state = "OPERATIONAL"
            t.peer.sync.transmit()

        await in_thread(remap)
        assert await heard.wait()
        statusword = t.network.drives["rear_right"].dictionary.getter((0x6041, 0))()
        assert (len(pdo.data), pdo[0].raw, pdo[1].raw) == (6, statusword, 0)


async def test_peer_guards_a_node() -> None:
    async with twins("guarding") as t:
        heard = Heard()
        await in_thread(lambda: setattr(t.encoder.nmt, "state", "OPERATIONAL"))
        nmt: Any = t.encoder.nmt
        nmt.add_heartbeat_callback(heard)
        nmt.start_node_guarding(0.05)
        assert await heard.wait()
        nmt.stop_node_guarding()
        assert nmt.state == "OPERATIONAL"


async def test_peer_hears_an_emergency_and_its_end() -> None:
    async with twins("emcy") as t:
        encoder = t.network.encoders["rear"]
        waiting = asyncio.ensure_future(in_thread(lambda: t.encoder.emcy.wait(0x5000, LIMIT_S - 1.0)))
        await asyncio.sleep(0.05)
        encoder.set_alarms(1)
        emergency = await waiting
        assert (emergency.code, emergency.register, emergency.data[:2]) == (0x5000, 1, b"\x01\0")
        waiting = asyncio.ensure_future(in_thread(lambda: t.encoder.emcy.wait(0, LIMIT_S - 1.0)))
        await asyncio.sleep(0.05)
        encoder.set_alarms(0)
        assert (await waiting).code == 0
        assert t.encoder.emcy.active == []


async def test_peer_sets_a_node_id_by_lss() -> None:
    async with twins("lss") as t:
        encoder: SimulatedEncoder = t.network.encoders["rear"]
        lss: Any = t.peer.lss

        def set_node_id() -> tuple[int, int]:
            assert lss.send_switch_state_selective(*encoder.lss.identity)
            before = lss.inquire_node_id()
            lss.configure_node_id(42)
            lss.store_configuration()
            serial = lss.inquire_lss_address(0x5D)
            lss.send_switch_state_global(lss.WAITING_STATE)
            return before, serial

        assert await in_thread(set_node_id) == (ENCODER, encoder.lss.identity[3])
        assert (encoder.lss.pending, encoder.lss.stored) == (42, 42)


# --- the library as slave --------------------------------------------------------------------------------------------


class Local:
    """A node of the library under this master."""

    def __init__(self, peer: canopen.Network, bus: PythonCanBus) -> None:
        self.node = peer.create_node(ENCODER, peer_dictionary(STORE_OBJECTS))
        self.master = Master(bus, Network(sdo_timeout_s=2.0))
        self.sdo = self.master.sdo(ENCODER)

    def set(self, index: int, sub: int, data: bytes) -> None:
        self.node.set_data(index, sub, data)

    def get(self, index: int, sub: int) -> bytes:
        return bytes(self.node.get_data(index, sub))


@asynccontextmanager
async def local(channel: str) -> AsyncIterator[Local]:
    """A node of the library, and this master."""
    async with peer_network(channel) as peer:
        made = Local(peer, python_can_bus("virtual", channel, 1_000_000))
        await made.master.start()
        try:
            yield made
        finally:
            await made.master.close()


async def test_our_client_reads_and_writes_expedited() -> None:
    async with local("our-expedited") as lo:
        await lo.sdo.write(ENCODER_OBJECTS["guard_time"], 250)
        assert lo.get(0x100C, 0) == (250).to_bytes(2, "little")
        assert await lo.sdo.read(ENCODER_OBJECTS["guard_time"]) == 250


async def test_our_client_reads_and_writes_in_segments() -> None:
    async with local("our-segments") as lo:
        await lo.sdo.write_raw((BLOB.index, 0), b"twenty bytes of data")
        assert lo.get(BLOB.index, 0) == b"twenty bytes of data"
        assert await lo.sdo.read_raw((BLOB.index, 0)) == b"twenty bytes of data"


async def test_our_client_falls_back_on_segments_for_a_long_write() -> None:
    async with local("our-long-write") as lo:
        await lo.sdo.write_raw((BLOB.index, 0), LONG)
        assert (lo.get(BLOB.index, 0), lo.sdo.blocks) == (LONG, False)


async def test_our_client_takes_a_block_read_that_is_answered_in_segments() -> None:
    async with local("our-long-read") as lo:
        lo.set(BLOB.index, 0, LONG)
        assert (await lo.sdo.read_raw((BLOB.index, 0)), lo.sdo.blocks) == (LONG, False)


async def test_our_client_names_the_peers_abort() -> None:
    async with local("our-abort") as lo:
        with pytest.raises(Aborted, match="no such object") as caught:
            await lo.sdo.read_raw((0x5555, 0))
        assert caught.value.value == 0x06020000


async def until(bus: PythonCanBus, can_id: int, act: Callable[[], Any]) -> None:
    """Do something and wait for the frame that follows."""
    came: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def look(seen_id: int, data: bytes, stamp: float) -> None:
        if seen_id == can_id and not came.done():
            came.set_result(None)

    bus.taps.append(look)
    await in_thread(act)
    await asyncio.wait_for(came, LIMIT_S)
    bus.taps.remove(look)
    await asyncio.sleep(0)


async def test_our_encoder_takes_the_peers_pdo() -> None:
    async with local("our-pdo") as lo:
        encoder = Cia406Encoder(lo.master, "rear", EncoderConfig(node=ENCODER, counts_per_turn=4096))
        pdo = lo.node.tpdo[2]
        pdo.cob_id = 0x280 + ENCODER
        pdo.add_variable(0x6004)
        pdo[0].raw = 1024
        assert isinstance(lo.master.bus, PythonCanBus)
        await until(lo.master.bus, 0x285, pdo.transmit)
        assert encoder.counts == 1024
        assert encoder.heading_rad == pytest.approx(pi / 2)


async def test_our_node_takes_the_peers_emergency_and_its_end() -> None:
    async with local("our-emcy") as lo:
        events: list[NodeEvent] = []
        lo.master.on_event = events.append
        encoder = Cia406Encoder(lo.master, "rear", EncoderConfig(node=ENCODER, counts_per_turn=4096))
        NodeBoot(lo.master, encoder)
        assert isinstance(lo.master.bus, PythonCanBus)
        await until(lo.master.bus, 0x085, lambda: lo.node.emcy.send(0x5000, 1))
        assert encoder.fault is not None
        assert encoder.fault.code == 0x5000
        await until(lo.master.bus, 0x085, lambda: lo.node.emcy.reset(0))
        assert encoder.fault is None
        assert [event.kind for event in events] == ["emcy", "emcy"]


async def test_our_nmt_commands_move_the_peer() -> None:
    async with local("our-nmt") as lo:
        heard = Heard()
        network = lo.node.network
        assert network is not None
        network.subscribe(0, heard)
        lo.master.bus.send(0x000, bytes((1, ENCODER)))
        assert await heard.wait()
        assert lo.node.nmt.state == NmtState.OPERATIONAL.name
