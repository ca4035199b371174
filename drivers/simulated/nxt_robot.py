"""A robot on two wheels with a simulated NXT: where it really is, which its brick cannot know.

Between each motor and its wheel there is play, which the floor takes up: a
wheel stays where it is until the flank of the gear takes it along. Wheels roll without slipping, on radii and a track
that are not quite those that are written down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random
from typing import Final

from drivers.nxt.codes import Output
from drivers.simulated.nxt import BLUETOOTH, NxtTiming, SimulatedNxt
from drivers.simulated.nxt_motor import MotorConstants, NxtMotor


@dataclass(frozen=True, slots=True)
class NxtRobotConstants:
    """The robot of the NXT report: wheels of 5.6 cm, 5.85 cm from the centre. Scatter and play are assumed.

    Attributes:
        wheel_radius_m, half_track_m: what is written down.
        play_rad: of the gear, at the wheel.
        load_n_m: rolling resistance at each wheel.
        outputs, directions: of the right and the left motor; at -1 positive power rolls the wheel backward.
        motor_scatter: relative standard deviation of each motor's constants.
        size_scatter: of wheel radii and track, as a calibration leaves it.
    """

    wheel_radius_m: float = 0.028
    half_track_m: float = 0.0585
    play_rad: float = math.radians(4)
    load_n_m: float = 0.01
    outputs: tuple[Output, Output] = (Output.B, Output.C)
    directions: tuple[int, int] = (1, 1)
    motor_scatter: float = 0.05
    size_scatter: float = 0.0003


REPORT_ROBOT: Final = NxtRobotConstants()


class SimulatedNxtRobot:
    """Brick, two motors, a body on the floor.

    Args:
        constants: the robot.
        seed: which one of all robots with these constants, and how it was put down.
        timing: of the brick.

    Attributes:
        brick: its brick.
        x_m, y_m, yaw_rad: where it really is; call :meth:`SimulatedNxt.catch_up` before you look.
    """

    def __init__(
        self, constants: NxtRobotConstants = REPORT_ROBOT, seed: int = 0, timing: NxtTiming = BLUETOOTH
    ) -> None:
        dice = Random(seed)
        self.x_m = self.y_m = self.yaw_rad = 0.0
        motors = [_scattered(constants.motor_scatter, dice) for _ in range(3)]
        self.brick = SimulatedNxt("NXT", motors, timing)
        self.brick.on_tick = self._roll
        self._half_track_m = constants.half_track_m * dice.gauss(1.0, constants.size_scatter)
        self._wheels = [
            _Wheel(
                self.brick.motors[port],
                sign * constants.wheel_radius_m * dice.gauss(1.0, constants.size_scatter),
                constants.play_rad / 2,
                dice.uniform(-constants.play_rad / 2, constants.play_rad / 2),
            )
            for port, sign in zip(constants.outputs, constants.directions, strict=True)
        ]
        for wheel in self._wheels:
            wheel.motor.load_n_m = constants.load_n_m

    def _roll(self) -> None:
        right, left = self._wheels[0].roll(), self._wheels[1].roll()
        if right or left:
            forward, turn = (right + left) / 2, (right - left) / (2 * self._half_track_m)
            heading = self.yaw_rad + turn / 2
            self.x_m += forward * math.cos(heading)
            self.y_m += forward * math.sin(heading)
            self.yaw_rad += turn


class _Wheel:
    """A wheel behind a gear with play."""

    __slots__ = ("_angle_rad", "_half_play_rad", "_radius_m", "motor")

    def __init__(self, motor: NxtMotor, radius_m: float, half_play_rad: float, start_rad: float) -> None:
        self.motor = motor
        self._radius_m = radius_m
        self._half_play_rad = half_play_rad
        self._angle_rad = start_rad

    def roll(self) -> float:
        """How far [m] the wheel has rolled since the last call."""
        shaft, half, before = self.motor.shaft_rad, self._half_play_rad, self._angle_rad
        self._angle_rad = max(shaft - half, min(shaft + half, before))
        return self._radius_m * (self._angle_rad - before)


def _scattered(scatter: float, dice: Random) -> MotorConstants:
    nominal = MotorConstants()
    return MotorConstants(
        nominal.resistance_ohm * dice.gauss(1.0, scatter),
        nominal.back_emf_v_s * dice.gauss(1.0, scatter),
        nominal.torque_n_m_a * dice.gauss(1.0, scatter),
        nominal.friction_n_m * dice.gauss(1.0, scatter),
        nominal.inertia_kg_m2,
    )
