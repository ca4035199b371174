"""The laws on the simulated MAX2D: tyres that slip, dry friction, encoders with counts, commands two cycles late."""

from __future__ import annotations

import math
from collections import deque

import pytest

from daemon.loops.limits import Gate
from daemon.loops.measurement import Command, Measurement
from daemon.loops.odometry import Odometry
from daemon.loops.paired_steer import PairedSteerLaw, PairedSteerRecord, Phase
from daemon.loops.paired_steer_target import PairedSteerTarget, parallel_target, steer_target, turn_target
from vcan_tests.daemon.paired_robot import DT
from vcan_tests.drivers.max2d_bench import PROFILE, Robot, turning_speeds, vehicle

PAIRS = ("rear", "front")
BRAKE_TIME_S = 0.05


class Bench:
    """Law, gate and odometry around the physics; brakes take their time."""

    def __init__(self) -> None:
        self.robot = Robot()
        self.law = PairedSteerLaw(vehicle(), PROFILE.limits)
        self.gate = Gate(PROFILE.limits, vehicle())
        self.odometry = Odometry(vehicle())
        self.sent = Command((0.0,) * 4, (False, False))
        self.pending = deque([self.sent] * 2)
        self.brake = [0.0, 0.0]
        self.record: PairedSteerRecord | None = None
        self.turned: list[float] = []
        for name in PAIRS:
            self.robot.world.set_brake(name, True)

    def measure(self) -> Measurement:
        count = math.tau / 4096
        axes = [(self.robot.world.axes[name], PROFILE.drives[name]) for name in vehicle().wheels]
        rim = [drive.direction * drive.wheel_radius_m / drive.total_ratio for _, drive in axes]
        qc = [math.tau / drive.qc_per_motor_turn for _, drive in axes]
        counts = [round(axis.position_rad / step) * step for (axis, _), step in zip(axes, qc, strict=True)]
        return Measurement(
            time_s=self.robot.now_s,
            wheel_speed_m_s=tuple(axis.speed_rad_s * scale for (axis, _), scale in zip(axes, rim, strict=True)),
            wheel_travel_m=tuple(position * scale for position, scale in zip(counts, rim, strict=True)),
            heading_rad=tuple(round(self.robot.world.heading_rad(name) / count) * count for name in PAIRS),
            brake_engaged=tuple(position == 0 for position in self.brake),
            brake_released=tuple(position == 1 for position in self.brake),
        )

    def run(self, target: PairedSteerTarget, at_most_s: float = 30.0) -> PairedSteerRecord:
        for _ in range(round(at_most_s / DT)):
            measurement = self.measure()
            self.odometry.update(measurement)
            command, self.record = self.law.step(measurement, target, DT)
            if self.record.done or self.record.failure:
                break
            self.sent, active = self.gate.apply(command, measurement, self.sent, DT)
            assert active == ()
            self.pending.append(self.sent)
            self.act(self.pending.popleft())
        assert self.record is not None
        return self.record

    def act(self, command: Command) -> None:
        for pair, name in enumerate(PAIRS):
            change = DT / BRAKE_TIME_S if command.release_brake[pair] else -DT / BRAKE_TIME_S
            self.brake[pair] = round(max(0.0, min(1.0, self.brake[pair] + change)), 9)
            self.robot.world.set_brake(name, self.brake[pair] < 0.5)
        self.robot.roll(*command.wheel_speed_m_s, for_s=DT)
        if self.record is not None and self.record.phase is Phase.DRIVING:
            self.turned.append(self.robot.world.pose[2])


@pytest.mark.parametrize("heading_deg", [60.0, -30.0, 85.0, 1.0])
def test_pairs_are_steered_within_a_fifth_of_a_degree(heading_deg: float) -> None:
    bench = Bench()
    for pair in (0, 1):
        assert bench.run(steer_target(pair, math.radians(heading_deg))).done
    for name in PAIRS:
        assert math.degrees(bench.robot.world.heading_rad(name)) == pytest.approx(heading_deg, abs=0.2)


@pytest.mark.parametrize(("heading_deg", "speed"), [(60.0, 0.5), (0.0, -1.0)])
def test_a_parallel_movement_ends_within_two_percent(heading_deg: float, speed: float) -> None:
    """MAX2D thesis, figures 4.7 and 4.6."""
    bench = Bench()
    assert bench.run(parallel_target(math.radians(heading_deg), speed, 4.0)).done
    x, y, _ = bench.robot.world.pose
    end = (4 * speed * math.cos(math.radians(heading_deg)), 4 * speed * math.sin(math.radians(heading_deg)))
    assert math.dist((x, y), end) < 0.02 * 4 * abs(speed)


@pytest.mark.parametrize(("rear", "front", "speed", "tolerance"), [(0.15, -0.3, 1.0, 0.05), (-0.35, 0.35, 0.5, 0.10)])
def test_a_turn_is_driven_on_the_commanded_arc(rear: float, front: float, speed: float, tolerance: float) -> None:
    """MAX2D thesis, figures 4.16 and 4.15: way over angle is the radius."""
    bench = Bench()
    assert bench.run(turn_target(rear, front, speed, 4.0)).done
    radius = 4 * speed / abs(bench.turned[-1] - bench.turned[0])
    commanded, _ = turning_speeds(rear, front, speed)
    assert radius == pytest.approx(commanded, rel=tolerance)


def test_the_odometry_of_a_line_agrees_with_the_world() -> None:
    bench = Bench()
    bench.run(parallel_target(math.radians(30), 0.5, 4.0))
    x, y, yaw = bench.robot.world.pose
    pose = bench.odometry.pose
    assert math.dist((pose.x_m, pose.y_m), (x, y)) < 0.02 * 2.0
    assert pose.yaw_rad == pytest.approx(yaw, abs=math.radians(1))
