"""How faults of a simulated robot are set, from a file, by the API and by commands, and what is refused."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import DeviceFault, Refused, UsageError
from daemon.api.simulation_methods import SIMULATION_METHODS
from daemon.app import App
from daemon.cli.main import main
from daemon.demo import FIGURES, Demo
from profiles.faults import load_faults, wanted
from profiles.loader import load
from profiles.schema import BodyGeometry
from vcan_tests.robot import Robot, running_robot

MAX2D = load("max2d").profile


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ({"kind": "serial_noise", "probability": 0.1}, "no simulated serial line"),
        ({"kind": "silence", "part": "left"}, "none of the drives and encoders"),
        ({"kind": "delay"}, "delay_s is missing"),
        ({"kind": "lose", "for_s": 0.0}, "for_s"),
        ({"kind": "brick_lost", "part": "nxt"}, "this robot has no bricks"),
        ({"kind": "wrong_identity", "part": 3, "object": "0x9999"}, "front_left has no object 0x9999"),
    ],
)
async def test_a_fault_that_cannot_happen_is_refused_with_a_remedy(fault: dict[str, Any], told: str) -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError, match=told) as caught:
            await robot.call("simulation.fault", **fault)
        assert caught.value.remedy
        assert (await robot.call("simulation.faults"))["faults"] == []


async def test_a_refused_fault_uses_up_no_number() -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError):
            await robot.call("simulation.fault", kind="serial_noise", probability=0.1)
        assert (await robot.call("simulation.fault", kind="duplicate"))["fault"] == 1


async def test_both_ways_to_set_a_fault_list_the_kinds_alike() -> None:
    params = {param.name: param for method in SIMULATION_METHODS for param in method.params}
    assert wanted("kind") == f"one of {', '.join(params['kind'].choices)}"


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ({"kind": "encoder_jump", "part": "front"}, "write angle_deg: in a file, --angle in a command"),
        ({"kind": "silence"}, "write part: in a file, a second word in a command"),
        ({"kind": "sdo_abort", "part": "front", "object": "banana"}, "give an object as 0x6041/0"),
        ({"kind": "lose", "probability": 0.0}, "give a number greater than 0 and to 1"),
        ({"kind": "lose", "probability": 2.0}, "give a number greater than 0 and to 1"),
    ],
)
async def test_a_mistaken_fault_is_told_how_it_is_written(fault: dict[str, Any], told: str) -> None:
    async with running_robot() as robot:
        with pytest.raises(UsageError) as caught:
            await robot.call("simulation.fault", **fault)
        assert told in str(caught.value.remedy)


async def test_a_real_robot_has_no_faults_to_set() -> None:
    app = App(MAX2D, "virtual:nobody")
    with pytest.raises(Refused, match="this robot is real"):
        await app.service.call("simulation.faults", {}, app.service.open_lease("test"))


# Files


async def test_the_faults_of_a_file_are_counted_from_the_robots_start(tmp_path: Path) -> None:
    file = tmp_path / "faults.yaml"
    file.write_text("faults:\n- {kind: emcy, part: front_left, code: 0x4210, at_s: 2.5}\n")
    app = App(MAX2D, faults=load_faults(file, MAX2D))
    begun_s = asyncio.get_running_loop().time()
    await app.start()
    took_s = await Robot(app).until(lambda: app.service.state == "fault")
    assert asyncio.get_running_loop().time() - begun_s == took_s == pytest.approx(2.5, abs=0.05)
    await app.close()


async def test_a_fault_of_a_file_that_cannot_happen_here_is_told_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "faults.yaml"
    file.write_text("faults:\n- kind: lose\n- kind: serial_noise\n  probability: 0.1\n")
    app = App(MAX2D, faults=load_faults(file, MAX2D))
    with pytest.raises(UsageError, match=r"faults.yaml:3: there is no simulated serial line"):
        await app.start()
    await app.close()


@pytest.mark.parametrize("profile", ["max2d", "turtle", "ackermann", "semitrailer"])
async def test_the_driven_wheels_of_every_vehicle_on_a_floor_can_stand_on_ice(profile: str) -> None:
    robot = load(profile).profile
    assert isinstance(robot.vehicle, BodyGeometry)
    app = App(robot)
    for name in robot.vehicle.wheels:
        told = await app.service.call("simulation.fault", {"kind": "ice", "part": name}, app.service.open_lease("test"))
        assert told["state"] == "acting"
    await app.close()


# Commands


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("run --profile max2d --bus socketcan:can0 --faults faults.yaml", "--faults is for simulated robots"),
        ("run --profile max2d --simulate --faults none.yaml", "none.yaml:1: cannot be read"),
        ("demo --figure nxt --faults faults.yaml", "--faults is for the figures of the MAX2D"),
        ("demo --figure 4.6 --virtual-time --faults faults.yaml", "faults.yaml:3: faults[0].delay_s: means nothing"),
        ("simulate --profile nxt --bus serial:pty --faults empty.yaml", "--faults is for a network"),
    ],
)
def test_a_command_refuses_faults_that_make_no_sense(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str, told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("faults.yaml").write_text("faults:\n- kind: lose\n  delay_s: 1\n")
    Path("empty.yaml").write_text("faults: []\n")
    assert main(line.split()) == 2
    assert told in capsys.readouterr().err


async def test_a_demo_that_a_fault_strikes_ends_with_its_cause(tmp_path: Path) -> None:
    file = tmp_path / "faults.yaml"
    file.write_text("faults:\n- {kind: emcy, part: front_left, code: 0x4210, at_s: 1}\n")
    demo = Demo(MAX2D, 1, None, lambda _: None, faults=load_faults(file, MAX2D))
    with pytest.raises(DeviceFault, match="front_left\\) reports over-temperature"):
        await demo.run(FIGURES[:1])
