"""The master: dispatch, and the boot-up of nodes with everything that can go wrong in it."""

from __future__ import annotations

import asyncio
import random

import msgspec
import pytest

from canhelm.errors import NodeAbsent, NotReady, UsageError
from drivers.bus.contract import RTR_FLAG
from drivers.contract import NodeState
from drivers.epos.objects import OBJECTS
from profiles.schema import Profile
from vcan_tests.drivers.bench import Bench, bench, max2d

COMMUNICATION = [entry for entry in OBJECTS.objects if 0x1400 <= entry.index <= 0x1BFF and entry.firmware == "2011h"]


def changed(profile: Profile, drive: str, **values: object) -> Profile:
    """The profile with other values for one drive."""
    drives = {**profile.drives, drive: msgspec.structs.replace(profile.drives[drive], **values)}
    return msgspec.structs.replace(profile, drives=drives)


# --- dispatch --------------------------------------------------------------------------------------------------------


async def test_frames_that_nobody_listens_to_are_counted() -> None:
    async with bench(powered=False) as b:
        b.intruder.send(0x555, b"what")
        b.intruder.send(RTR_FLAG | 0x181)
        await asyncio.sleep(0.01)
        assert b.master.counters.unknown == 2


async def test_truncated_and_oversized_frames_are_counted_and_change_nothing() -> None:
    async with bench() as b:
        drive = b.drive("rear_right")
        before = (drive.state, drive.node_state, drive.position_m, drive.fault)
        for can_id in (0x181, 0x286, 0x581, 0x701, 0x081):
            b.intruder.send(can_id, b"\xff\xff")
        await asyncio.sleep(0.005)
        assert b.master.counters.malformed == 5
        assert (drive.state, drive.node_state, drive.position_m, drive.fault) == before


async def test_a_storm_of_random_frames_raises_nothing() -> None:
    async with bench() as b:
        chance = random.Random(1)
        for _ in range(2000):
            b.intruder.send(chance.randrange(0x800), chance.randbytes(chance.randrange(9)))
            await asyncio.sleep(0.0005)
        assert b.port.receiver_errors == 0
        assert b.master.counters.internal_errors == 0


async def test_sync_is_an_empty_frame_with_identifier_0x80() -> None:
    async with bench(powered=False) as b:
        frames: list[tuple[int, bytes]] = []
        b.port.taps.append(lambda can_id, data, _: frames.append((can_id, data)))
        await asyncio.sleep(0.015)
        assert (0x80, b"") in frames


@pytest.mark.parametrize("node", [-1, 0, 128, 200])
async def test_a_node_id_outside_1_to_127_has_no_sdo(node: int) -> None:
    async with bench(powered=False) as b:
        with pytest.raises(UsageError, match="no node id"):
            b.master.sdo(node)


# --- boot-up ---------------------------------------------------------------------------------------------------------


async def test_without_power_it_says_what_it_waits_for() -> None:
    async with bench(powered=False) as b:
        await asyncio.sleep(1.0)
        assert b.drive().status_sentence == "waiting for node 3 (front_left): no boot-up; is motor power on?"
        with pytest.raises(NodeAbsent, match="is motor power on"):
            await b.drive().enable()


async def test_a_waiting_node_makes_one_event_however_long_it_takes() -> None:
    async with bench(powered=False) as b:
        await asyncio.sleep(60.0)
        assert b.kinds(3) == ["waiting"]


async def test_power_that_comes_after_30_s_is_enough() -> None:
    async with bench(powered=False) as b:
        await asyncio.sleep(30.0)
        b.network.power_on()
        await asyncio.sleep(0.5)
        assert {device.node_state for device in b.devices.by_node.values()} == {NodeState.READY}


async def test_a_configured_drive_has_its_own_cob_ids_and_the_default_map() -> None:
    async with bench() as b:
        twin = b.network.drives["front_left"].dictionary
        assert [twin.number(f"{kind}{n}_cob_id") for kind in ("rpdo", "tpdo") for n in (1, 2, 3)] == [
            0x203,
            0x303,
            0x403,
            0x183,
            0x283,
            0x383,
        ]
        assert [twin.number(f"tpdo1_mapping_entry_{n}") for n in (1, 2, 3)] == [0x60410010, 0x60640020, 0x60780010]
        assert [twin.number(f"rpdo1_mapping_entry_{n}") for n in (1, 2)] == [0x60400010, 0x60FF0020]
        assert [twin.number(f"{kind}1_transmission_type") for kind in ("rpdo", "tpdo")] == [1, 1]


async def test_velocity_mode_maps_its_own_target() -> None:
    async with bench(changed(max2d(), "front_left", mode="velocity")) as b:
        assert b.network.drives["front_left"].dictionary.number("rpdo1_mapping_entry_2") == 0x206B0020


async def test_limits_and_ramps_come_from_the_profile() -> None:
    async with bench() as b:
        twin, config = b.network.drives["front_left"].dictionary, b.profile.drives["front_left"]
        rpm_per_m_s = abs(b.drive().rpm_from_speed(1.0))
        assert twin.number("profile_acceleration") == round(config.acceleration_m_s2 * rpm_per_m_s)
        assert twin.number("quick_stop_deceleration") == round(config.quick_stop_m_s2 * rpm_per_m_s)
        assert twin.number("continuous_current_limit") == 1000 * config.continuous_current_a
        assert twin.number("guard_time") == 100


async def test_nothing_is_saved_and_nobody_else_is_started() -> None:
    async with bench(powered=False) as b:
        frames: list[tuple[int, bytes]] = []
        b.port.taps.append(lambda can_id, data, _: frames.append((can_id, data)))
        b.network.power_on()
        await asyncio.sleep(0.5)
        assert not [data for can_id, data in frames if can_id & 0x780 == 0x600 and data[1:3] == b"\x10\x10"]
        assert {data[1] for can_id, data in frames if can_id == 0} == {1, 2, 3, 4, 5, 6}


async def test_another_kind_of_device_is_refused_with_object_and_cure() -> None:
    profile = max2d()
    swapped = changed(profile, "front_left", node=5)
    encoders = {**profile.encoders, "rear": msgspec.structs.replace(profile.encoders["rear"], node=3)}
    b = Bench(msgspec.structs.replace(swapped, encoders=encoders))
    b.network = type(b.network)(profile, b.medium, 0)
    await b.master.start()
    b.devices.start()
    b.network.power_on()
    await asyncio.sleep(0.5)
    sentence = b.drive().status_sentence
    assert b.drive().node_state is NodeState.REFUSED
    assert "node 5 (front_left): 0x1000 (device_type)" in sentence
    assert "another kind of device" in sentence
    await b.devices.close()


async def test_an_encoder_of_another_resolution_is_refused() -> None:
    profile = max2d()
    encoders = {**profile.encoders, "front": msgspec.structs.replace(profile.encoders["front"], counts_per_turn=8192)}
    b = Bench(msgspec.structs.replace(profile, encoders=encoders))
    b.network = type(b.network)(profile, b.medium, 0)
    await b.master.start()
    b.devices.start()
    b.network.power_on()
    await asyncio.sleep(0.5)
    assert b.encoder().node_state is NodeState.REFUSED
    assert "4096" in b.encoder().status_sentence
    assert "8192" in b.encoder().status_sentence
    await b.devices.close()


async def test_a_drive_that_does_not_keep_what_is_written_is_refused() -> None:
    async with bench(powered=False) as b:
        twin = b.network.drives["front_left"].dictionary
        twin.readers[twin.address("quick_stop_deceleration")] = lambda: 10000
        b.network.power_on()
        await asyncio.sleep(0.5)
        assert b.drive().node_state is NodeState.REFUSED
        assert "0x6085 (quick_stop_deceleration) is 10000" in b.drive().status_sentence


async def test_a_refused_drive_is_tried_again() -> None:
    async with bench(powered=False) as b:
        twin = b.network.drives["front_left"].dictionary
        twin.readers[twin.address("quick_stop_deceleration")] = lambda: 10000
        b.network.power_on()
        await asyncio.sleep(0.5)
        del twin.readers[twin.address("quick_stop_deceleration")]
        await asyncio.sleep(3.0)
        assert b.drive().node_state is NodeState.READY
        assert b.kinds(3).count("refused") == 1


async def test_a_drive_is_not_ready_before_its_first_guarding_answer() -> None:
    async with bench(powered=False) as b:
        b.cycle.stop()
        b.network.power_on()
        await asyncio.sleep(0.6)
        assert b.drive().node_state is NodeState.CONFIGURING
        assert "first guarding answer" in b.drive().status_sentence
        with pytest.raises(NotReady):
            await b.drive().enable()


async def test_an_attempt_has_a_deadline_and_says_which_step_failed() -> None:
    async with bench(powered=False) as b:
        b.cycle.stop()
        b.network.power_on()
        await asyncio.sleep(4.0)
        waiting = next(event for event in b.events if event.kind == "waiting" and event.severity == "warning")
        assert "waiting for its first guarding answer failed: not done 3 s" in waiting.message
        b.cycle.start()
        await asyncio.sleep(4.0)
        assert b.drive().node_state is NodeState.READY


async def test_a_node_that_restarts_is_configured_again() -> None:
    async with bench() as b:
        b.network.power_off(3)
        b.network.power_on(3)
        await asyncio.sleep(0.5)
        assert b.kinds(3)[-2:] == ["rebooted", "ready"]


async def test_power_lost_in_the_middle_of_the_configuration_is_survived_at_any_moment() -> None:
    for tenths_ms in range(700, 2100, 130):
        async with bench(powered=False) as b:
            b.network.power_on()
            await asyncio.sleep(tenths_ms * 1e-4)
            b.network.power_off(3)
            await asyncio.sleep(0.4)
            b.network.power_on(3)
            await asyncio.sleep(1.5)
            assert b.drive().node_state is NodeState.READY


async def test_all_nodes_switched_off_and_on_together_come_back() -> None:
    async with bench() as b:
        b.network.power_off()
        await asyncio.sleep(2.0)
        b.network.power_on()
        await asyncio.sleep(0.6)
        assert {device.node_state for device in b.devices.by_node.values()} == {NodeState.READY}
        assert [device.fault for device in b.devices.by_node.values()] == [None] * 6


async def test_a_second_master_on_the_same_drives_takes_them_over_at_rest() -> None:
    async with bench() as b:
        await b.drive().enable()
        b.drive().command_speed(0.5)
        await asyncio.sleep(1.0)
        for boot in b.devices._boots:
            await boot.close()
        b.cycle.stop()
        b.master = type(b.master)(b.port, b.profile.network)
        b.devices = type(b.devices)(b.master, b.profile)
        b.devices.start()
        b.cycle.start()
        await asyncio.sleep(3.0)
        assert b.drive().node_state is NodeState.READY
        assert abs(b.network.world.axes["front_left"].speed_rad_s) < 0.1


async def test_closing_leaves_no_life_guarding_behind() -> None:
    async with bench() as b:
        await b.devices.close()
        b.cycle.stop()
        await asyncio.sleep(1.0)
        assert not any(event.kind == "emcy" for event in b.events)


async def test_a_node_that_is_lost_with_the_interface_is_not_to_blame() -> None:
    async with bench() as b:
        b.events.clear()
        b.port.down = "Network is down"
        b.network.power_off(3)
        await asyncio.sleep(0.3)
        fault, lost = b.drive().fault, next(event for event in b.events if event.kind == "lost")
    assert lost.message.startswith("vcan0 does not work: Network is down; node 3 (front_left) is lost: no guarding")
    assert fault is not None
    assert (fault.message, fault.remedy) == (lost.message, lost.remedy)
    assert "motor power" not in lost.remedy
