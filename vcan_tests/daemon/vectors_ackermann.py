"""The Ackermann car's loops against the reference vectors: one check for each kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import pytest

from daemon.loops.ackermann import (
    AckermannController,
    AckermannGeometry,
    AckermannState,
    drive,
    mass_radius,
    turning_radius,
    wheel_angles,
)
from daemon.loops.path import wrap
from daemon.loops.pid import PidGains

Case = dict[str, Any]


def near(expected: Any, absolute: float = 1e-9) -> Any:
    return pytest.approx(expected, rel=1e-9, abs=absolute)


def geometry_of(given: Case) -> AckermannGeometry:
    return AckermannGeometry(given["L"], given["W"], given["a"], given["rw"], given["alpha_max"], given["omega_max"])


def check_ackermann(case: Case) -> None:
    given, expected = case["input"], case["output"]
    geometry, gamma = geometry_of(given), given["gamma"]
    if gamma:
        assert mass_radius(geometry, gamma) == near(expected["R"])
        assert turning_radius(geometry, gamma) == near(expected["R1"])
    left, right = wheel_angles(geometry, gamma)
    inner, outer = (left, right) if gamma > 0 else (right, left)
    assert (left, right) == near((expected["alpha_left"], expected["alpha_right"]))
    assert (abs(inner), abs(outer)) == near((expected["alpha_i"], expected["alpha_o"]))
    state = AckermannState(given["heading"], given["omega_left"], given["omega_right"])
    step = drive(geometry, state, given["throttle"], gamma, given["dt"])
    assert step.state.left_rad_s == near(expected["omega_left"])
    assert step.state.right_rad_s == near(expected["omega_right"])
    assert step.state.heading_rad == near(expected["heading"])
    assert step.axle_speed_m_s == near(expected["speed_axle"])
    assert step.mass_speed_m_s == near(expected["speed_com"])
    assert step.throttle_rad_s == near(expected["throttle_used"])


Tick = tuple[float, float, float]
"""Heading, speed and steering angle after a tick."""


def regulated(given: Case, anti_windup: bool = False) -> list[Tick]:
    """The car under the report's two regulators, from an even speed of its wheels."""
    geometry, gains, dt = geometry_of(given), given["gains"], given["dt"]
    heading = PidGains(gains["Kp_theta"], gains["Ki_theta"], gains["Kd_theta"])
    speed = PidGains(gains["Kp_s"], gains["Ki_s"], gains["Kd_s"])
    controller = AckermannController(geometry, heading, speed, dt, anti_windup)
    state = AckermannState(given["heading0"], given["omega0"], given["omega0"])
    axle_speed, ticks = geometry.wheel_radius_m * given["omega0"], []
    for _ in range(round(given["T"] / dt)):
        gamma, throttle = controller.step(
            given["target_heading"] - state.heading_rad, given["target_speed"] - axle_speed
        )
        step = drive(geometry, state, throttle, gamma, dt)
        state, axle_speed = step.state, step.axle_speed_m_s
        ticks.append((state.heading_rad, axle_speed, gamma))
    return ticks


def check_pid(case: Case) -> None:
    given, summary = case["input"], case["summary"]
    ticks = regulated(given)
    for sample in case["samples"]:
        wanted = (sample["heading"], sample["speed"], sample["gamma"])
        assert ticks[round(sample["t"] / given["dt"]) - 1] == near(wanted, 1e-6)
    heading, speed, _ = ticks[-1]
    assert abs(wrap(given["target_heading"] - heading)) == near(summary["final_heading_error"], 1e-6)
    assert abs(given["target_speed"] - speed) == near(summary["final_speed_error"], 1e-6)
    assert max(abs(gamma) for _, _, gamma in ticks) == near(summary["max_gamma"], 1e-6)
    overshoot = max(speed for _, speed, _ in ticks) - given["target_speed"]
    assert max(0.0, overshoot) == near(summary["speed_overshoot"], 1e-6)
    assert settle(given, ticks) == near(summary["settle_2pct"], given["dt"])


def settle(given: Case, ticks: list[Tick]) -> float:
    """Time from which the heading stays within 0.02 rad and the speed within 2 % of the set-points."""
    last_off = -1
    for number, (heading, speed, _) in enumerate(ticks):
        turned = abs(wrap(given["target_heading"] - heading)) <= 0.02
        if not (turned and abs(given["target_speed"] - speed) <= 0.02 * given["target_speed"]):
            last_off = number
    return float(given["dt"] * (last_off + 2))


CHECKS: Final[dict[str, Callable[[Case], None]]] = {
    "seed003_ackermann": check_ackermann,
    "seed003_pid": check_pid,
}
