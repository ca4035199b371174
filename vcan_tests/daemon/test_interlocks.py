"""Objects and network states cannot be used to get round the supervisor, whatever they are reached through."""

from __future__ import annotations

import pytest

from canhelm.errors import Interlock
from vcan_tests.robot import running_robot

OBJECTS = [
    *(("controlword", word, 4) for word in (0x0000, 0x0006, 0x000F, 0x0080)),
    ("guard_time", 0, 4),
    ("life_time_factor", 0, 5),
    ("0x2078/1", 0xFFFF, 1),
]


@pytest.mark.parametrize(("name", "value", "node"), OBJECTS)
async def test_a_write_that_gets_round_an_interlock_is_refused_with_the_command_to_use(
    name: str, value: int, node: int
) -> None:
    async with running_robot() as robot:
        with pytest.raises(Interlock) as refused:
            await robot.call("sdo.write", node=node, object=name, value=value)
        assert refused.value.remedy is not None


async def test_a_controlword_that_was_refused_leaves_a_drive_as_it_was_and_others_writable() -> None:
    async with running_robot() as robot:
        with pytest.raises(Interlock, match="switched by the daemon alone") as refused:
            await robot.call("sdo.write", node=1, object="controlword", value=6)
        assert "`canhelm motor enable rear_right`, or disable, quick-stop" in (refused.value.remedy or "")
        assert robot.state == "idle"
        await robot.call("sdo.write", node=4, object="profile_acceleration", value=2000)


async def test_other_objects_are_written_at_rest() -> None:
    async with running_robot() as robot:
        await robot.call("sdo.write", node=4, object="profile_acceleration", value=2000)
        assert (await robot.call("sdo.read", node=4, object="profile_acceleration"))["value"] == 2000


@pytest.mark.parametrize("method", ["nmt", "sdo.write"])
async def test_nothing_is_changed_while_a_drive_is_enabled(method: str) -> None:
    params = {"nmt": {"command": "preop", "node": 5}, "sdo.write": {"node": 4, "object": "0x6083", "value": 2000}}
    async with running_robot() as robot:
        await robot.call("motor.enable", node=1)
        with pytest.raises(Interlock, match="a drive is enabled"):
            await robot.call(method, **params[method])
        await robot.call("motor.disable", node=1)
