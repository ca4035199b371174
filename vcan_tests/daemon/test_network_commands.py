"""Objects, network states and supply of nodes as a person names them, on a whole simulated MAX2D."""

from __future__ import annotations

from typing import Any

import pytest

from canhelm.errors import NodeAbsent, UsageError
from vcan_tests.robot import running_robot

MOVES: list[tuple[str, dict[str, Any]]] = [
    ("drive.parallel", {"angle_deg": 0.0, "speed_m_s": 0.3, "duration_s": 1.0}),
    ("motor.velocity", {"node": 3, "velocity_rpm": 100.0, "duration_s": 1.0}),
    ("motor.enable", {"node": 3}),
    ("motor.disable", {"node": "front_left"}),
    ("brake.engage", {"pair": "all"}),
    ("brake.release", {"pair": "all"}),
    ("sdo.read", {"node": 3, "object": "statusword"}),
]


async def test_whatever_needs_an_absent_node_says_that_it_is_absent() -> None:
    async with running_robot(powered=False, booted=False, expect_errors=True) as robot:
        for method, params in MOVES:
            with pytest.raises(NodeAbsent):
                await robot.call(method, **params)


async def test_driving_without_an_encoder_says_that_it_is_absent() -> None:
    async with running_robot(powered=False, booted=False, expect_errors=True) as robot:
        for node in range(1, 5):
            await robot.call("simulation.power", node=node, on=True)
        await robot.until(lambda: all(robot.app.devices.by_node[node].node_state == "ready" for node in range(1, 5)))
        with pytest.raises(NodeAbsent):
            await robot.call("steer", pair="front", angle_deg=5.0)


@pytest.mark.parametrize("node", ["²", "٣", "0", "128", "0x", "0x80", "-1", "1e1", "9" * 200])
async def test_what_only_looks_like_a_node_id_is_absent(node: str) -> None:
    async with running_robot(powered=False, booted=False) as robot:
        for method, more in (("sdo.read", {"object": "0x1000"}), ("nmt", {"command": "start"}), ("motor.stop", {})):
            with pytest.raises(NodeAbsent, match=r"no (node|drive)"):
                await robot.call(method, node=node, **more)


@pytest.mark.parametrize("node", ["4", "0x4", "0X04", "004"])
async def test_a_node_id_is_read_in_decimal_and_hexadecimal(node: str) -> None:
    async with running_robot() as robot:
        assert (await robot.call("sdo.read", node=node, object="0x1000"))["name"] == "device_type"


@pytest.mark.parametrize("node", [77, "nix"])
async def test_the_supply_of_a_node_that_is_not_simulated_cannot_be_switched(node: int | str) -> None:
    async with running_robot() as robot:
        with pytest.raises(NodeAbsent, match=str(node)):
            await robot.call("simulation.power", node=node, on=False)


@pytest.mark.parametrize("method", ["brake.release", "brake.engage", "brake.status"])
async def test_a_brake_that_the_profile_does_not_have_is_wrong_usage(method: str) -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError, match="middle"):
            await robot.call(method, pair="middle")


@pytest.mark.parametrize("value", [1.5, "fast", 2**40])
async def test_what_an_object_cannot_hold_is_wrong_usage(value: float | str) -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError, match=r"1\.5|fast|1099511627776"):
            await robot.call("sdo.write", node=1, object="0x6083", value=value)


READINGS = [
    ("statusword", {"hex": "0x1140", "words": "switch on disabled"}),
    ("position_sensor_type", {"hex": "0x0001", "words": "encoder with index"}),
    ("mode_of_operation_display", {"hex": "0x03"}),
]


@pytest.mark.parametrize(("name", "reading"), READINGS, ids=[name for name, _ in READINGS])
async def test_a_value_is_read_in_hexadecimal_and_in_words_where_it_has_some(
    name: str, reading: dict[str, str]
) -> None:
    async with running_robot() as robot:
        answer = await robot.call("sdo.read", node=1, object=name)
        assert {key: answer[key] for key in ("hex", "words") if key in answer} == reading


async def test_a_network_command_to_a_node_outside_the_profile_says_so() -> None:
    async with running_robot() as robot:
        assert "55 is not in the profile" in (await robot.call("nmt", command="stop", node=55))["note"]
        assert "note" not in await robot.call("nmt", command="start", node=5)


@pytest.mark.parametrize(
    ("node", "name", "remedy"),
    [
        (1, "profile_accelaration", "did you mean profile_acceleration?"),
        (5, "Position_valu", "did you mean position_value?"),
        (1, "xyzzy", "give a name (`canhelm object list`), 0x6041, or 0x2078/1"),
    ],
)
async def test_a_misspelt_object_is_told_the_name_that_comes_nearest(node: int, name: str, remedy: str) -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError, match=name) as refused:
            await robot.call("sdo.read", node=node, object=name)
        assert refused.value.remedy == remedy
