"""The semi-trailer's loops against the reference vectors: one check for each kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import pytest

from daemon.campaigns.following_runs import drive, thesis_law
from daemon.campaigns.ideal_semitrailer import (
    CIRCLE_BACKWARDS,
    LINE_BACKWARDS,
    SEMITRAILER,
    Errors,
    SemitrailerPlant,
    forwards,
    placed,
)
from daemon.loops.articulated import hitch_point
from daemon.loops.odometry import Pose
from daemon.loops.path import Path, Piece, arc
from daemon.loops.path_following import FollowingErrors, FollowingTuning, PathFollower

Case = dict[str, Any]

HITCH: Final = SEMITRAILER.hitches[0]


def near(expected: Any, absolute: float = 1e-9, relative: float = 0.0) -> Any:
    return pytest.approx(expected, rel=relative, abs=absolute)


def check_kinematics(case: Case) -> None:
    given, expected = case["input"], case["output"]
    truck, bending, speed = Pose(given["x1"], given["y1"], given["theta1"]), given["delta"], given["v1"]
    motion = SEMITRAILER.motion(given["alpha"], [bending], speed)
    trailer = SEMITRAILER.poses(truck, [bending])[1]
    velocity = (speed * math.cos(truck.yaw_rad), speed * math.sin(truck.yaw_rad))
    assert velocity == near((expected["x1dot"], expected["y1dot"]))
    assert motion.yaw_rate_rad_s == near((expected["theta1dot"], expected["theta2dot"]))
    assert motion.bending_rate_rad_s == near((expected["deltadot"],))
    assert motion.speed_m_s == near((speed, expected["v2"]))
    assert SEMITRAILER.front_axle_speed(given["alpha"], speed) == near(expected["v0"])
    assert (trailer.x_m, trailer.y_m, trailer.yaw_rad) == near((expected["x2"], expected["y2"], expected["theta2"]))
    assert hitch_point(truck, HITCH) == near(tuple(expected["hitch"]))


def check_open_loop(case: Case) -> None:
    """The rates of the loop and those of the plant, integrated, come to the same place."""
    given, expected = case["input"], case["output"]
    theta, delta = given["theta1"], given["delta"]
    plant = SemitrailerPlant((given["x1"], given["y1"], theta, theta + delta), 0.0)
    for segment, wanted in zip(given["segments"], expected["states"], strict=True):
        plant.advance(segment["v1"], segment["alpha"], segment["t"], steps=200)
        delta = integrated_bending(segment["alpha"], delta, segment["v1"], segment["t"])
        truck = plant.truck
        assert [truck.x_m, truck.y_m, truck.yaw_rad, plant.bending_rad] == near(wanted, 1e-8)
        assert delta == near(wanted[3], 1e-8)
    (_, end) = SEMITRAILER.poses(plant.truck, [delta])
    assert [end.x_m, end.y_m, end.yaw_rad] == near(expected["trailer_end"], 1e-8)


def integrated_bending(steering: float, bending: float, speed: float, duration: float, steps: int = 200) -> float:
    """The bending angle after a motion, by the loop's rates."""
    curvature, h = SEMITRAILER.curvature(steering), speed * duration / steps
    for _ in range(steps):
        k1 = HITCH.bending_rate(curvature, bending)
        k2 = HITCH.bending_rate(curvature, bending + h / 2 * k1)
        k3 = HITCH.bending_rate(curvature, bending + h / 2 * k2)
        k4 = HITCH.bending_rate(curvature, bending + h * k3)
        bending += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return bending


def check_stable_motion(case: Case) -> None:
    given, expected = case["input"], case["output"]
    alpha = given["alpha"]
    curvature = SEMITRAILER.curvature(alpha)
    turning = SEMITRAILER.steering(HITCH.turning_curvature)
    relative = 1e-6 if abs(abs(alpha) - turning) < math.radians(0.1) else 1e-9
    rear = HITCH.rear_curvature(curvature)
    if expected["delta_circ"] is None:
        assert rear is HITCH.stable_bending(curvature) is HITCH.stable_bending(curvature, extreme=True) is None
        return
    assert rear is not None
    bending = HITCH.stable_bending(curvature)
    assert bending == near(expected["delta_circ"], relative=relative)
    assert HITCH.stable_bending(curvature, extreme=True) == near(expected["delta_circ_extreme"], relative=relative)
    assert rear == near(expected["kappa2"], relative=relative)
    if curvature:
        radii = (1 / abs(curvature), math.hypot(1 / curvature, HITCH.offset_m), 1 / abs(rear))
        assert radii == near((expected["r1"], expected["rk1"], expected["r2"]), relative=relative)
    assert HITCH.bending_for(rear) == near(expected["delta_from_kappa2"], relative=relative)
    holding = HITCH.holding_curvature(expected["delta_circ"])
    assert SEMITRAILER.steering(holding) == near(expected["alpha_from_delta"], relative=relative)


def piece_of(path: Case, backward: bool) -> Piece:
    if path["type"] == "line":
        x, y = path["g"]
        return Piece(x, y, path["direction"], math.inf, 0.0, backward)
    full = arc(tuple(path["center"]), path["radius"], 0.0, path["sense"] * 1.0, backward)
    return Piece(full.x_m, full.y_m, full.direction_rad, math.inf, full.curvature, backward)


def published_errors(piece: Piece, errors: FollowingErrors) -> list[float | None]:
    """In the vectors' signs: positions to the left on lines, to the outside on circles."""
    outside = -errors.position_m if piece.heading_curvature > 0 else errors.position_m
    return [outside, errors.heading_rad, errors.bending_rad]


def check_path_law(case: Case) -> None:
    given, expected = case["input"], case["output"]
    piece = piece_of(given["path"], given["backward"])
    tuning = FollowingTuning(given["c_v"], given["c_p"] or 4.0)
    follower = PathFollower(SEMITRAILER, Path([piece]), tuning)
    x, y = given["P"]
    pose, bending = Pose(x, y, given["theta"]), given["delta_is"]
    step = follower.step(pose, bending or 0.0)
    assert step.target == near(tuple(expected["target"]))
    assert step.curvature == near(expected["kappa"], relative=1e-9)
    if expected["r_kk"] is not None:
        r = 1 / step.curvature
        assert r == near(expected["r_kk"], relative=1e-9)
        centre = [pose.x_m - r * math.sin(pose.yaw_rad), pose.y_m + r * math.cos(pose.yaw_rad)]
        assert centre == near(expected["center"], relative=1e-9)
    assert step.wanted_steering_rad == near(expected["alpha_unclamped"])
    assert step.steering_rad == near(expected["alpha"])
    wanted = expected["errors"]
    errors = published_errors(piece, step.errors)
    assert errors[:2] == near([wanted["xi_y"], wanted["xi_theta"]])
    if given["backward"]:
        assert step.bending_target_rad == near(expected["delta_target"])
        holding = HITCH.holding_curvature(bending)
        assert SEMITRAILER.steering(holding) == near(expected["alpha_circ_is"])
        assert errors[2] == near(wanted["xi_delta"])


def check_closed_loop(case: Case) -> None:
    given, expected = case["input"], case["output"]
    backward, rate = given["backward"], given["steering_rate_limit_deg_s"]
    piece = LINE_BACKWARDS if given["path"] == "line" else circle_backwards(given["radius"])
    piece = piece if backward else forwards(piece)
    errors = Errors(given["xi_y0"], math.radians(given["xi_theta0_deg"]), math.radians(given["xi_delta0_deg"]))
    plant = placed(piece, errors, None if rate is None else math.radians(rate))
    law = thesis_law(piece, FollowingTuning(given["c_v"], given["c_p"]))
    period = given["control_period"]
    run = drive(law, plant, piece, given["T"], period, speed_m_s=given["speed"])
    position, heading, bending = run.worst
    assert position == near(expected["max_xi_y"], 0.002)
    assert math.degrees(heading) == near(expected["max_xi_theta_deg"], 0.3)
    assert run.settle_m == near(expected["settle_distance"], 0.03)
    if backward:
        assert math.degrees(bending) == near(expected["max_xi_delta_deg"], 0.3)
    metres, degrees = (0.002, 0.3) if rate is None else (0.005, 1.0)
    for sample in case["samples"]:
        instant = round(sample["t"] / period)
        assert run.position_m[instant] == near(sample["xi_y"], metres)
        assert math.degrees(run.heading_rad[instant]) == near(sample["xi_theta_deg"], degrees)
        if backward:
            assert math.degrees(run.bending_rad[instant]) == near(sample["xi_delta_deg"], degrees)


def circle_backwards(radius_m: float) -> Piece:
    circle = CIRCLE_BACKWARDS
    return Piece(0.0, -radius_m, circle.direction_rad, math.inf, circle.curvature / radius_m, backward=True)


CHECKS: Final[dict[str, Callable[[Case], None]]] = {
    "seed002_kinematics": check_kinematics,
    "seed002_open_loop": check_open_loop,
    "seed002_stable_motion": check_stable_motion,
    "seed002_path_law": check_path_law,
    "seed002_closed_loop": check_closed_loop,
}
