"""PDOs of the simulated CANopen slave, shown on a drive."""

from __future__ import annotations

import asyncio

from drivers.bus.contract import RTR_FLAG
from vcan_tests.drivers.epos_bench import RESET_NODE, START, Bench

SYNC = 0x080
RPDO1, RPDO3, TPDO1, TPDO2, TPDO3 = 0x201, 0x401, 0x181, 0x281, 0x381


async def test_factory_cob_ids_are_those_of_node_1_on_every_node() -> None:
    bench = await Bench.booted(node=9)
    ids = [await bench.read(index, 1) for index in (0x1400, 0x1401, 0x1402, 0x1800, 0x1801, 0x1802)]
    assert ids == [RPDO1, 0x301, RPDO3, TPDO1, TPDO2, TPDO3]


async def test_cob_ids_follow_the_node_id_after_load_save_and_restart() -> None:
    bench = await Bench.booted(node=9)
    await bench.u32(0x1011, 5, 0x64616F6C)
    await bench.u32(0x1010, 1, 0x65766173)
    await bench.master.nmt(RESET_NODE, 9)
    await asyncio.sleep(0.06)
    assert [await bench.read(index, 1) for index in (0x1400, 0x1802)] == [0x209, 0x389]


async def test_a_tpdo_of_type_255_is_sent_on_a_remote_frame_only() -> None:
    bench = await Bench.booted()
    await bench.master.nmt(START, 1)
    await bench.master.send(SYNC)
    assert bench.master.of(TPDO3) == []
    await bench.master.send(TPDO3 | RTR_FLAG)
    assert bench.master.of(TPDO3) == [bytes.fromhex("400101")]


async def test_a_tpdo_of_type_1_is_sent_at_each_sync() -> None:
    bench = await Bench.booted()
    await bench.u8(0x1802, 2, 1)
    await bench.master.nmt(START, 1)
    for _ in range(3):
        await bench.master.send(SYNC)
    assert len(bench.master.of(TPDO3)) == 3


async def test_pdos_rest_before_the_node_is_started() -> None:
    bench = await Bench.booted()
    await bench.u8(0x1802, 2, 1)
    await bench.master.send(SYNC)
    await bench.master.send(TPDO2 | RTR_FLAG)
    await bench.master.send(RPDO3, "060003")
    assert [can_id for can_id, _ in bench.master.heard if can_id < 0x580] == []
    assert await bench.read(0x6061) == 1


async def mode_after_rpdo3(bench: Bench) -> int:
    """Start the node and ask for mode 3 by RPDO3; the mode that it is in then."""
    await bench.master.nmt(START, 1)
    await bench.master.send(RPDO3, "060003")
    return await bench.read(0x6061)


async def test_an_rpdo_of_type_255_acts_at_once() -> None:
    bench = await Bench.booted()
    assert (await mode_after_rpdo3(bench), await bench.state()) == (3, 0x121)


async def test_an_rpdo_of_type_1_waits_for_the_sync() -> None:
    bench = await Bench.booted()
    await bench.u8(0x1402, 2, 1)
    assert await mode_after_rpdo3(bench) == 1
    await bench.master.send(SYNC)
    assert await bench.read(0x6061) == 3


async def test_of_two_rpdos_between_syncs_the_newer_wins_once() -> None:
    bench = await Bench.booted()
    await bench.u8(0x1400, 2, 1)
    await bench.master.nmt(START, 1)
    await bench.master.send(RPDO1, "01000000")
    await bench.master.send(RPDO1, "02000000")
    await bench.master.send(SYNC)
    assert await bench.read(0x206B) == 2
    await bench.u32(0x206B, 0, 5)
    await bench.master.send(SYNC)
    assert await bench.read(0x206B) == 5


async def test_an_rpdo_of_a_wrong_length_is_ignored_and_counted() -> None:
    bench = await Bench.booted()
    await bench.master.nmt(START, 1)
    for text in ("0600", "06000300", ""):
        await bench.master.send(RPDO3, text)
    assert (await bench.read(0x6061), bench.epos.counters.pdo_length) == (1, 3)


async def test_an_rpdo_with_a_value_that_the_device_refuses_is_counted() -> None:
    bench = await Bench.booted()
    await bench.master.nmt(START, 1)
    await bench.master.send(RPDO3, "060063")
    assert (await bench.read(0x6061), bench.epos.counters.pdo_refused) == (1, 1)


async def test_a_remapped_tpdo_carries_the_new_objects() -> None:
    bench = await Bench.booted()
    await bench.u8(0x1A00, 0, 0)
    await bench.u32(0x1A00, 1, 0x60410010)
    await bench.u32(0x1A00, 2, 0x60640020)
    await bench.u32(0x1A00, 3, 0x60780010)
    assert await bench.u8(0x1A00, 0, 3) == 0
    await bench.u8(0x1800, 2, 1)
    await bench.u32(0x1800, 1, 0x185)
    await bench.master.nmt(START, 1)
    await bench.master.send(SYNC)
    (data,) = bench.master.of(0x185)
    assert (len(data), data[:6]) == (8, bytes.fromhex("400100000000"))


async def test_a_pdo_is_switched_off_by_bit_31() -> None:
    bench = await Bench.booted()
    await bench.u32(0x1402, 1, 0x80000401)
    assert await mode_after_rpdo3(bench) == 1


async def test_mapping_is_refused_with_its_reason() -> None:
    bench = await Bench.booted()
    in_use = await bench.u32(0x1A00, 1, 0x60410010)
    await bench.u8(0x1A00, 0, 0)
    not_for_tpdos = await bench.u32(0x1A00, 1, 0x60400010)
    wrong_size = await bench.u32(0x1A00, 1, 0x60410020)
    unknown = await bench.u32(0x1A00, 1, 0x55550010)
    fixed = await bench.u32(0x1A02, 1, 0x60410010)
    assert [in_use, not_for_tpdos, wrong_size, unknown, fixed] == [0x06010000, *3 * (0x06040041,), 0x06010002]


async def test_a_mapping_beyond_8_bytes_is_refused() -> None:
    bench = await Bench.booted()
    await bench.u8(0x1A00, 0, 0)
    for sub in (1, 2, 3):
        await bench.u32(0x1A00, sub, 0x60640020)
    assert await bench.u8(0x1A00, 0, 3) == 0x06040042


async def test_mapping_is_refused_outside_pre_operational() -> None:
    bench = await Bench.booted()
    await bench.master.nmt(START, 1)
    assert await bench.u8(0x1A00, 0, 0) == 0x08000022


async def test_reserved_identifiers_and_types_are_refused() -> None:
    bench = await Bench.booted()
    aborts = [await bench.u32(0x1400, 1, 0x601), await bench.u32(0x1400, 1, 0x20000201), await bench.u8(0x1400, 2, 7)]
    assert aborts == [0x06090030] * 3


async def test_the_sync_identifier_cannot_be_changed() -> None:
    bench = await Bench.booted()
    assert await bench.u32(0x1005, 0, 0x81) == 0x06010002
