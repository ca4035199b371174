"""A whole robot on a simulated NXT brick: daemon and brick in one process, on virtual time."""

from __future__ import annotations

import math

from daemon.loops.differential import wrap_angle
from daemon.loops.odometry import Pose
from drivers.simulated.nxt_link import SimulatedBrick
from drivers.simulated.nxt_robot import SimulatedNxtRobot
from profiles.loader import load
from vcan_tests.robot import Robot

NXT = load("nxt").profile


def twin_of(robot: Robot, name: str = "nxt") -> SimulatedBrick:
    return robot.network.bricks[name]


def body_of(robot: Robot) -> SimulatedNxtRobot:
    body = twin_of(robot).robot
    assert body is not None
    body.brick.catch_up()
    return body


def pose_of(robot: Robot) -> Pose:
    """Where the robot really is."""
    body = body_of(robot)
    return Pose(body.x_m, body.y_m, body.yaw_rad)


def miss(robot: Robot, wanted: Pose) -> tuple[float, float]:
    """How far the robot really is from a pose: metres, degrees."""
    pose = pose_of(robot)
    turn = wrap_angle(pose.yaw_rad - wanted.yaw_rad)
    return math.hypot(pose.x_m - wanted.x_m, pose.y_m - wanted.y_m), abs(math.degrees(turn))


def turning(robot: Robot, name: str = "nxt") -> bool:
    """Whether a motor of the brick really turns."""
    brick = twin_of(robot, name).brick
    brick.catch_up()
    return any(abs(motor.speed_rad_s) > 0.05 for motor in brick.motors)
