"""Whole simulated robots with a pad in somebody's hands: what they do, by the simulation's own truth."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import msgspec
import pytest

from canhelm.errors import Refused
from daemon.gamepad.driver import PERIOD_S, VALID_FOR_MS, PadDriver
from daemon.gamepad.mapping import Mapping
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.gamepad import GamepadConfig, StickConfig
from profiles.loader import load
from vcan_tests.daemon.gamepad.recorded_pad import RecordedPad
from vcan_tests.daemon.nxt_twin import body_of, pose_of
from vcan_tests.robot import Robot, running_robot

RADIUS_OF_NXT_M = 0.028
AT_REST_M_S = 0.01
UNWINDING_M = 0.04
LEVER_M = 0.2
"""At which a turn counts as a speed."""


class Hands:
    """A person with a pad, in front of a robot.

    Attributes:
        robot: that is driven.
        held: the pad.
        mapping: of the robot's profile.
        told: sentences.
        driving: the driver's task.
    """

    def __init__(self, robot: Robot, mapping: Mapping) -> None:
        self.robot, self.mapping, self.held = robot, mapping, RecordedPad()
        self.told: list[str] = []
        self.driver = PadDriver(robot, mapping, self.told.append)
        self.driving = asyncio.create_task(self.driver.drive(self.held.pad))

    async def push(self, seconds: float, **shares: float) -> None:
        """Hold the button and push the sticks there, one after the other, as still as no hand is."""
        await asyncio.sleep(0.2)
        self.held.press("BTN_TL")
        await asyncio.sleep(0.2)
        for axis, share in shares.items():
            self.held.move(axis, share)
        for tremor in range(round(5 * seconds)):
            self.held.move("ABS_RY", 0.01 * (tremor % 2))
            await asyncio.sleep(0.2)

    @property
    def speed_m_s(self) -> float:
        """The fastest that anything of the robot really moves."""
        if self.robot.app.profile.name == "nxt":
            return max(abs(motor.speed_rad_s) for motor in body_of(self.robot).brick.motors) * RADIUS_OF_NXT_M
        return max(self.robot.speed_m_s, LEVER_M * abs(self.robot.network.world.velocity[2]))

    @property
    def place(self) -> tuple[float, float]:
        """Where it really is."""
        if self.robot.app.profile.name == "nxt":
            return pose_of(self.robot).x_m, pose_of(self.robot).y_m
        x, y, _ = self.robot.network.world.pose
        return x, y

    async def rests_within(self, limit_s: float) -> None:
        """It comes to rest, and stays there but for tyres that unwind when the power goes off."""
        await self.robot.until(lambda: self.speed_m_s < AT_REST_M_S, timeout_s=limit_s)
        rested_at = self.place
        await asyncio.sleep(2.0)
        assert self.speed_m_s < AT_REST_M_S
        assert math.dist(self.place, rested_at) < UNWINDING_M


@asynccontextmanager
async def hands_on(
    name: str, gamepad: GamepadConfig | None = None, *, expect_errors: bool = False
) -> AsyncIterator[Hands]:
    """A robot, and a person with a pad."""
    profile = load(name).profile
    if gamepad is not None:
        profile = msgspec.structs.replace(profile, gamepad=gamepad)
    async with running_robot(profile, expect_errors=expect_errors) as robot:
        hands = Hands(robot, Mapping(await robot.call("drive.gamepad")))
        try:
            yield hands
        finally:
            hands.driving.cancel()
            await asyncio.wait([hands.driving])


FULL_SPEED = {
    "max2d": {"ABS_Y": -1.0},
    "turtle": {"ABS_X": -1.0, "ABS_Y": -1.0},
    "ackermann": {"ABS_Y": -1.0},
    "semitrailer": {"ABS_Y": -1.0},
    "nxt": {"ABS_Y": -1.0, "ABS_RX": -1.0},
}
ROBOTS = pytest.mark.parametrize(("name", "sticks"), FULL_SPEED.items(), ids=FULL_SPEED)


@ROBOTS
async def test_a_pad_that_is_unplugged_at_full_speed_leaves_the_robot_at_rest_in_the_stated_time(
    name: str, sticks: dict[str, float]
) -> None:
    async with hands_on(name) as hands:
        await hands.push(3.0, **sticks)
        assert hands.speed_m_s > 0.95 * hands.robot.app.profile.limits.speed_m_s
        hands.held.pad.lose("No such device")
        await hands.rests_within(hands.mapping.rest_s)
        await hands.driving
        assert hands.robot.state == "idle"


@pytest.mark.parametrize(
    ("name", "sticks"),
    [("max2d", {"ABS_RX": -1.0, "ABS_Y": -1.0}), ("turtle", {"ABS_RX": 1.0}), ("semitrailer", {"ABS_Y": 1.0})],
    ids=["max2d on its narrowest curve", "turtle on the spot", "semitrailer backwards"],
)
async def test_so_it_is_at_the_end_of_every_other_stick(name: str, sticks: dict[str, float]) -> None:
    async with hands_on(name) as hands:
        await hands.push(5.0, **sticks)
        assert hands.speed_m_s > 0.05
        hands.held.let_go("BTN_TL")
        await hands.rests_within(hands.mapping.rest_s)


async def test_a_client_that_hangs_leaves_the_robot_at_rest_when_its_last_value_is_too_old(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def hang(timeout_s: float) -> None:
        await asyncio.Event().wait()

    async with hands_on("ackermann") as hands:
        await hands.push(4.0, ABS_Y=-1.0)
        await asyncio.sleep(PERIOD_S / 2)
        monkeypatch.setattr(hands.held.pad, "wait", hang)
        await hands.rests_within(hands.mapping.rest_s + PERIOD_S + VALID_FOR_MS / 1e3)


async def test_the_pad_that_returns_does_not_move_the_robot_before_its_button_is_pressed_anew() -> None:
    async with hands_on("turtle") as hands:
        await hands.push(1.0, ABS_Y=-1.0)
        hands.held.pad.lose("No such device")
        await hands.driving
        hands.held = RecordedPad(pressed=("BTN_TL",))
        hands.driving = asyncio.create_task(hands.driver.drive(hands.held.pad))
        await asyncio.sleep(0.5)
        x, y, _ = hands.robot.network.world.pose
        hands.held.move("ABS_Y", -1.0)
        await asyncio.sleep(2.0)
        assert hands.robot.network.world.pose[:2] == pytest.approx((x, y), abs=1e-3)
        hands.held.move("ABS_Y", 0.0)
        hands.held.let_go("BTN_TL")
        await hands.push(1.0, ABS_Y=-1.0)
        assert hands.speed_m_s > 0.5


async def test_the_emergency_stop_button_latches_it() -> None:
    async with hands_on("max2d", expect_errors=True) as hands:
        await hands.push(3.0, ABS_Y=-1.0)
        hands.held.press("BTN_EAST")
        await hands.robot.until(lambda: hands.speed_m_s < AT_REST_M_S, timeout_s=1.2 / 2.0 + 0.4)
        assert hands.robot.state == "estop"


async def test_the_stop_button_brings_it_to_rest_by_the_quick_stop_ramp() -> None:
    async with hands_on("max2d") as hands:
        await hands.push(3.0, ABS_Y=-1.0)
        hands.held.press("BTN_SOUTH")
        await hands.robot.until(lambda: hands.speed_m_s < AT_REST_M_S, timeout_s=1.2 / 2.0 + 0.4)
        await asyncio.sleep(2.0)
        assert hands.robot.state == "idle"
        assert hands.speed_m_s < AT_REST_M_S


async def test_max2d_drives_where_the_stick_pointed_when_it_began_and_steers_only_at_rest() -> None:
    async with hands_on("max2d") as hands:
        await hands.push(1.0, ABS_X=-0.5)
        assert hands.robot.network.world.pose == (0.0, 0.0, 0.0)
        hands.held.move("ABS_Y", -0.5)
        await asyncio.sleep(4.0)
        hands.held.move("ABS_X", 1.0)
        await asyncio.sleep(1.0)
        vx, vy, rate = hands.robot.network.world.velocity
        wanted_deg = hands.mapping.sticks["direction"].value(-0.5)
        assert math.degrees(math.atan2(vy, vx)) == pytest.approx(wanted_deg, abs=1.0)
        assert rate == pytest.approx(0.0, abs=0.02)


async def test_max2d_drives_a_curve_by_its_other_stick() -> None:
    async with hands_on("max2d") as hands:
        await hands.push(6.0, ABS_RX=-0.7, ABS_Y=-0.5)
        assert hands.robot.network.world.velocity[2] > 0.2


async def test_a_direction_and_a_curve_beyond_the_stops_are_refused_and_nothing_moves() -> None:
    async with hands_on("max2d") as hands:
        await hands.push(2.0, ABS_X=-1.0, ABS_RX=-1.0, ABS_Y=-1.0)
        assert hands.robot.network.world.pose == (0.0, 0.0, 0.0)
        assert any("beyond the limit" in told for told in hands.told)


async def test_the_car_steers_at_rest_and_follows_the_stick_while_it_rolls() -> None:
    async with hands_on("ackermann") as hands:
        await hands.push(1.0, ABS_RX=-1.0)
        assert hands.robot.app.vehicle.status()["steering_deg"] == pytest.approx(45.0, abs=0.5)
        hands.held.move("ABS_Y", -0.4)
        await asyncio.sleep(2.0)
        left = hands.robot.network.world.velocity[2]
        hands.held.move("ABS_RX", 1.0)
        await asyncio.sleep(2.0)
        assert left > 0.2
        assert hands.robot.network.world.velocity[2] == pytest.approx(-left, rel=0.05)


async def test_the_nxt_turns_on_the_spot() -> None:
    async with hands_on("nxt") as hands:
        await hands.push(3.0, ABS_RX=-1.0)
        assert pose_of(hands.robot).yaw_rad == pytest.approx(math.radians(45.0) * 2.5, abs=0.25)
        assert math.hypot(pose_of(hands.robot).x_m, pose_of(hands.robot).y_m) < 0.02


@pytest.mark.parametrize("steering", [-1.0, 0.3])
async def test_backwards_the_trailer_is_bent_no_further_than_it_can_be_straightened(steering: float) -> None:
    async with hands_on("semitrailer") as hands:
        vehicle, world = hands.robot.app.vehicle, hands.robot.network.world
        assert isinstance(world, SemitrailerWorld)
        await hands.push(10.0, ABS_RX=steering, ABS_Y=1.0)
        bent_deg = math.degrees(abs(world.bending_rad))
        assert bent_deg > 20.0
        assert vehicle.status()["jackknife_margin_deg"] > 1.5
        assert hands.speed_m_s < AT_REST_M_S
        hands.held.move("ABS_Y", -1.0)
        await asyncio.sleep(5.0)
        assert math.degrees(abs(world.bending_rad)) < bent_deg


async def test_a_profile_without_a_stick_for_a_command_never_gives_it() -> None:
    gamepad = GamepadConfig(yaw_rate=None, sideways=None, speed=StickConfig(axis="ABS_RY", share=0.5))
    async with hands_on("turtle", gamepad) as hands:
        assert set(hands.mapping.sticks) == {"speed"}
        assert hands.mapping.sticks["speed"].full == pytest.approx(0.6)


async def test_drives_without_a_vehicle_have_no_gamepad() -> None:
    bare = msgspec.structs.replace(load("max2d").profile, vehicle=None, brakes={}, encoders={})
    async with running_robot(bare, booted=False, expect_errors=True) as robot:
        with pytest.raises(Refused, match="no gamepad drives"):
            await robot.call("drive.gamepad")
