"""The NXT report's simulation of driving to a pose (its listing 5), repaired, with ideal motors.

Repaired: the robot's speed comes from both wheels, inverse kinematics are in the robot's frame, and the heading error
of the stop test is wrapped. Each step moves the pose with the old heading, then tests the goal, then sets new speeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from daemon.loops.differential import DifferentialDrive
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import PoseGains, Tolerance, at_goal, polar_law


@dataclass(slots=True)
class IdealDrive:
    """What came of it; any unit of length.

    Attributes:
        track: pose after each step.
        reached: whether the goal was.
        way: length of the way.
        fastest: highest speed of a wheel [rad/s].
    """

    track: list[Pose] = field(default_factory=list)
    reached: bool = False
    way: float = 0.0
    fastest: float = 0.0


def ideal_drive(
    drive: DifferentialDrive, goal: Pose, tolerance: Tolerance, gains: PoseGains, dt_s: float, longest_s: float
) -> IdealDrive:
    """Drive from the origin, at rest, to a goal.

    Args:
        drive: the robot.
        goal, tolerance: where to, and what counts as there.
        gains: of the law.
        dt_s: length of a step.
        longest_s: time after which it is given up.
    """
    done, pose, wheels = IdealDrive(), Pose(), (0.0, 0.0)
    while len(done.track) * dt_s < longest_s and not done.reached:
        forward, yaw_rate = drive.body_motion(*wheels)
        x = pose.x_m + forward * math.cos(pose.yaw_rad) * dt_s
        y = pose.y_m + forward * math.sin(pose.yaw_rad) * dt_s
        pose = Pose(x, y, pose.yaw_rad + yaw_rate * dt_s)
        done.track.append(pose)
        done.way += abs(forward) * dt_s
        done.reached = at_goal(pose, goal, tolerance)
        if not done.reached:
            wheels = drive.wheel_speeds(*polar_law(pose, goal, gains))
            done.fastest = max(done.fastest, *map(abs, wheels))
    return done
