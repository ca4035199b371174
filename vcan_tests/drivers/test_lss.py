"""LSS: frames of CiA 305, the master against the simulated encoder's slave, fast scan."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canhelm.errors import DeviceFault, NodeAbsent, Refused, UsageError
from daemon.runtime.clock import run_virtual
from drivers.canopen.counters import CanopenCounters
from drivers.canopen.lss import (
    ANSWER_COB_ID,
    UNCONFIGURED,
    Identity,
    LssMaster,
    make_activate,
    make_fast_scan,
    make_inquire,
    make_inquire_node_id,
    make_select,
    make_set_bit_timing,
    make_set_node_id,
    make_store,
    make_switch_global,
    parse_answer,
    parse_identity,
)
from drivers.simulated.bus import SimulatedBus
from drivers.simulated.encoder import SimulatedEncoder
from drivers.simulated.lss_slave import LssSlave
from profiles.schema import EncoderConfig
from vcan_tests.drivers.epos_bench import BenchWorld

ANSWER_TIME_S = 0.005
numbers = st.integers(0, 2**32 - 1)
identities = st.builds(Identity, numbers, numbers, numbers, numbers)


class LssBench:
    """Two encoders, nodes 5 and 6, and an LSS master."""

    def __init__(self) -> None:
        medium = SimulatedBus()
        world = BenchWorld()
        self.encoders = [
            SimulatedEncoder(medium.port(f"encoder {node}"), config, "rear", world, 0.05)
            for node in (5, 6)
            if (config := EncoderConfig(node=node, counts_per_turn=4096))
        ]
        self.port = medium.port("master")
        self.boot_ups: list[int] = []
        self.counters = CanopenCounters()
        self.master = LssMaster(self.port.send, 0.1, self.counters)
        self.port.receiver = self._receive

    def _receive(self, can_id: int, data: bytes, timestamp: float) -> None:
        if can_id == ANSWER_COB_ID:
            self.master.receive(can_id, data, timestamp)
        elif can_id >> 7 == 0xE:
            self.boot_ups.append(can_id & 0x7F)

    async def power_on(self, *without_id: int) -> LssBench:
        """Switch everything on; the encoders of these numbers come without a node id, as from the maker."""
        for number, encoder in enumerate(self.encoders):
            if number in without_id:
                encoder.lss.stored = UNCONFIGURED
            encoder.power_on()
        await asyncio.sleep(0.1)
        return self

    def identity(self, number: int) -> Identity:
        return Identity(*self.encoders[number].lss.identity)


@pytest.mark.parametrize(
    ("frame", "expected"),
    [
        (make_switch_global(True), "04 01 00 00 00 00 00 00"),
        (make_switch_global(False), "04 00 00 00 00 00 00 00"),
        (make_select(Identity(1, 2, 3, 0x12345678))[0], "40 01 00 00 00 00 00 00"),
        (make_select(Identity(1, 2, 3, 0x12345678))[3], "43 78 56 34 12 00 00 00"),
        (make_set_node_id(5), "11 05 00 00 00 00 00 00"),
        (make_set_bit_timing(1_000_000), "13 00 00 00 00 00 00 00"),
        (make_set_bit_timing(125_000), "13 00 04 00 00 00 00 00"),
        (make_activate(1000), "15 E8 03 00 00 00 00 00"),
        (make_store(), "17 00 00 00 00 00 00 00"),
        (make_inquire(3), "5D 00 00 00 00 00 00 00"),
        (make_inquire_node_id(), "5E 00 00 00 00 00 00 00"),
        (make_fast_scan(0x80000000, 30, 1, 1), "51 00 00 00 80 1E 01 01"),
    ],
)
def test_requests_are_the_bytes_of_cia_305(frame: bytes, expected: str) -> None:
    assert frame == bytes.fromhex(expected)


@given(st.binary(max_size=12))
def test_whatever_comes_as_an_answer_is_parsed_or_refused(data: bytes) -> None:
    assert (parse_answer(data) is None) == (len(data) != 8)


@given(identities)
def test_an_identity_reads_as_it_is_written(identity: Identity) -> None:
    assert parse_identity(str(identity)) == identity


@pytest.mark.parametrize("text", ["", "1:2:3", "1:2:3:4:5", "1:2:3:x", "1:2:3:-4", "1:2:3:0x100000000"])
def test_what_is_no_identity_is_none(text: str) -> None:
    assert parse_identity(text) is None


@given(st.lists(st.binary(max_size=9), max_size=20))
def test_whatever_comes_the_slave_answers_or_keeps_silent(requests: list[bytes]) -> None:
    slave = LssSlave((1, 2, 3, 4), UNCONFIGURED, lambda: None)
    answers = [slave.answer(request) for request in requests]
    assert all(answer is None or len(answer) == 8 for answer in answers)


async def test_one_device_of_several_is_selected_by_its_identity() -> None:
    bench = await LssBench().power_on()
    await bench.master.select(bench.identity(1))
    assert await bench.master.inquire_node_id() == 6
    assert await bench.master.inquire_identity() == bench.identity(1)
    assert [encoder.lss.configuring for encoder in bench.encoders] == [False, True]


async def test_an_identity_that_nobody_has_is_absent() -> None:
    bench = await LssBench().power_on()
    with pytest.raises(NodeAbsent, match="0x9:0x9:0x9:0x9"):
        await bench.master.select(Identity(9, 9, 9, 9))


async def test_nothing_is_answered_outside_configuration() -> None:
    bench = await LssBench().power_on()
    with pytest.raises(NodeAbsent, match="no LSS device in configuration"):
        await bench.master.inquire_node_id()


async def test_a_new_node_id_counts_after_a_reset_of_communication() -> None:
    bench = await LssBench().power_on()
    await bench.master.select(bench.identity(0))
    await bench.master.set_node_id(9)
    bench.master.switch_global(False)
    bench.boot_ups.clear()
    bench.port.send(0x000, bytes((130, 5)))
    await asyncio.sleep(0.05)
    assert bench.boot_ups == [9]


async def test_the_identifiers_of_pdos_follow_the_node_id() -> None:
    bench = await LssBench().power_on()
    encoder = bench.encoders[0]
    await bench.master.select(bench.identity(0))
    await bench.master.set_node_id(9)
    encoder.reset_communication()
    assert encoder.dictionary.number("tpdo2_cob_id") == 0x289


@pytest.mark.parametrize(("stored", "boots_as"), [(True, 9), (False, 5)])
async def test_only_a_stored_node_id_outlives_the_power(stored: bool, boots_as: int) -> None:
    bench = await LssBench().power_on()
    await bench.master.select(bench.identity(0))
    await bench.master.set_node_id(9)
    if stored:
        await bench.master.store()
    bench.encoders[0].power_off()
    bench.boot_ups.clear()
    bench.encoders[0].power_on()
    await asyncio.sleep(0.1)
    assert bench.boot_ups == [boots_as]


async def test_a_stored_bit_rate_is_in_force_after_the_next_power_up() -> None:
    bench = await LssBench().power_on()
    await bench.master.select(bench.identity(0))
    await bench.master.set_bit_rate(250_000)
    await bench.master.store()
    bench.encoders[0].power_off()
    bench.encoders[0].power_on()
    assert bench.encoders[0].port.bit_rate == 250_000


@pytest.mark.parametrize("node", [0, 128, 254])
async def test_what_is_no_node_id_is_not_sent(node: int) -> None:
    bench = LssBench()
    with pytest.raises(UsageError):
        await bench.master.set_node_id(node)
    assert bench.port.counters.sent == bench.port.queued == 0


async def test_a_bit_rate_that_cia_305_does_not_have_is_not_sent() -> None:
    with pytest.raises(UsageError, match="100000"):
        await LssBench().master.set_bit_rate(100_000)


async def test_a_refusal_of_the_device_names_its_error() -> None:
    bench = LssBench()
    bench.port.receiver = None
    asking = asyncio.ensure_future(bench.master.set_node_id(5))
    await asyncio.sleep(0.01)
    bench.master.receive(ANSWER_COB_ID, bytes.fromhex("11FF070000000000"), 0.0)
    with pytest.raises(Refused, match="error 255, maker's error 7"):
        await asking


async def test_an_answer_to_another_request_is_dropped() -> None:
    bench = LssBench()
    asking = asyncio.ensure_future(bench.master.inquire_node_id())
    await asyncio.sleep(0.01)
    bench.master.receive(ANSWER_COB_ID, bytes.fromhex("5A05000000000000"), 0.0)
    bench.master.receive(ANSWER_COB_ID, bytes.fromhex("5E07000000000000"), 0.0)
    assert await asking == 7
    assert bench.counters.late_answers == 1


async def test_a_device_without_node_id_keeps_silent_until_it_is_found_and_given_one() -> None:
    bench = await LssBench().power_on(0)
    assert bench.boot_ups == [6]
    assert await bench.master.find(ANSWER_TIME_S) == bench.identity(0)
    await bench.master.set_node_id(7)
    bench.master.switch_global(False)
    await asyncio.sleep(0.05)
    assert bench.boot_ups == [6, 7]


async def test_two_devices_without_node_id_are_found_one_after_the_other() -> None:
    bench = await LssBench().power_on(0, 1)
    found = []
    for node in (11, 12):
        found.append(await bench.master.find(ANSWER_TIME_S))
        await bench.master.set_node_id(node)
        bench.master.switch_global(False)
        await asyncio.sleep(0.05)
    assert sorted(filter(None, found)) == [bench.identity(0), bench.identity(1)]
    assert sorted(bench.boot_ups) == [11, 12]


async def test_where_everybody_has_a_node_id_nobody_is_found() -> None:
    bench = await LssBench().power_on()
    assert await bench.master.find(ANSWER_TIME_S) is None


async def test_a_scan_that_nobody_confirms_is_a_fault() -> None:
    bench = LssBench()
    finding = asyncio.ensure_future(bench.master.find(ANSWER_TIME_S))
    await asyncio.sleep(0.001)
    bench.master.receive(ANSWER_COB_ID, b"\x4f".ljust(8, b"\0"), 0.0)
    with pytest.raises(DeviceFault, match="nobody confirms identity number 1"):
        await finding


async def test_lss_is_not_served_while_process_data_flow() -> None:
    bench = await LssBench().power_on()
    bench.port.send(0x000, bytes((1, 0)))
    await asyncio.sleep(0.01)
    with pytest.raises(NodeAbsent):
        await bench.master.select(bench.identity(0))


@settings(max_examples=30, deadline=None)
@given(identities)
def test_any_identity_is_found_bit_by_bit(identity: Identity) -> None:
    async def find() -> Identity | None:
        slave = LssSlave(identity, UNCONFIGURED, lambda: None)

        def send(can_id: int, data: bytes, deadline_s: float) -> None:
            answer = slave.answer(data)
            if answer is not None:
                asyncio.get_running_loop().call_soon(master.receive, ANSWER_COB_ID, answer, 0.0)

        master = LssMaster(send, 0.1, CanopenCounters())
        return await master.find(ANSWER_TIME_S)

    assert run_virtual(find()) == identity
