"""The NXT report's loops against the reference vectors: one check for each kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import pytest

from daemon.loops.differential import DifferentialDrive, bend, line, share_power, wrap_angle
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import PoseGains, Tolerance
from daemon.loops.published_pose_drive import IdealDrive, ideal_drive

Case = dict[str, Any]

REPORT_DRIVE: Final = DifferentialDrive(17.593 / math.tau, 5.85)
"""Lengths in centimetres, as in the report; its formulas hold in any unit."""


def exact(expected: Any, absolute: float = 1e-9) -> Any:
    return pytest.approx(expected, rel=1e-9, abs=absolute)


def as_tuple(pose: Pose) -> tuple[float, float, float]:
    return pose.x_m, pose.y_m, pose.yaw_rad


def check_modangle(case: Case) -> None:
    wrapped = wrap_angle(case["input"]["angle"])
    assert math.remainder(wrapped - case["output"]["modangle"], math.tau) == exact(0)
    assert -math.pi <= wrapped <= math.pi


def check_kinematics(case: Case) -> None:
    given, expected = case["input"], case["output"]
    drive = DifferentialDrive(given["r"], given["l"])
    right, left, theta, dt = given["phidot_right"], given["phidot_left"], given["theta"], given["dt"]
    forward, yaw_rate = drive.body_motion(right, left)
    assert (forward, yaw_rate) == exact((expected["v"], expected["thetadot"]))
    assert (forward * math.cos(theta), forward * math.sin(theta)) == exact((expected["xdot"], expected["ydot"]))
    assert drive.wheel_speeds(forward, yaw_rate) == exact(tuple(expected["inverse"]))
    pose = drive.moved(Pose(0.0, 0.0, theta), right * dt, left * dt)
    assert as_tuple(pose) == exact(tuple(expected["pose_after_dt_exact"]))
    assert share_power(right, left, given["maxpower"]) == exact(tuple(expected["power"]))


def check_line_bend(case: Case) -> None:
    given, expected = case["input"], case["output"]
    if case["kind"] == "line":
        right, left = line(REPORT_DRIVE, given["distance_cm"], 50.0)
        assert right == left
        assert right.angle_deg == exact(expected["wentels_deg"])
        return
    angle, clockwise = math.radians(given["alpha_deg"]), given["right"]
    move = bend(REPORT_DRIVE, given["radius_cm"], angle, given["phi1"], clockwise)
    for leg, name in ((move.right, "motorB"), (move.left, "motorC")):
        assert leg == exact((expected[name]["power"], expected[name]["deg"]))
    outer, inner = (move.left, move.right) if clockwise else move
    assert (outer.angle_deg, inner.angle_deg) == exact((expected["wentel1"], expected["wentel2"]))
    assert inner.power == exact(expected["phi2"])
    end = REPORT_DRIVE.moved(Pose(), math.radians(move.right.angle_deg), math.radians(move.left.angle_deg))
    assert as_tuple(end) == exact(tuple(expected["end_pose"]), 1e-6)


def drive_to(given: Case) -> IdealDrive:
    gains = PoseGains(given["k_rho"], given["k_alpha"], given["k_beta"])
    drive, goal, tolerance = DifferentialDrive(given["r"], given["l"]), Pose(*given["goal"]), Tolerance(*given["var"])
    return ideal_drive(drive, goal, tolerance, gains, given["dt"], given["Tmax"])


def check_rho_alpha_beta(case: Case) -> None:
    given, expected, done = case["input"], case["output"], drive_to(case["input"])
    steps = len(done.track) - done.reached
    assert done.reached == expected["reached"]
    assert steps == expected["steps"]
    assert steps * given["dt"] == exact(expected["t_end"])
    assert as_tuple(done.track[-1]) == exact(tuple(expected["end"]), 1e-6)
    assert (done.way, done.fastest) == exact((expected["path_length"], expected["max_wheel_speed"]), 1e-6)
    for sample in case["samples"]:
        pose = done.track[round(sample["t"] / given["dt"])]
        assert as_tuple(pose) == exact((sample["x"], sample["y"], sample["theta"]), 1e-6)


CHECKS: Final[dict[str, Callable[[Case], None]]] = {
    "seed004_kinematics": check_kinematics,
    "seed004_line_bend": check_line_bend,
    "seed004_modangle": check_modangle,
    "seed004_rho_alpha_beta": check_rho_alpha_beta,
}
