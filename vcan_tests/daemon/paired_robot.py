"""A paired-steer robot for tests of its laws: wheels that roll without slip, late by a few cycles.

It shares no code with the laws. Order of wheels: rear right, rear left, front left, front right.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from daemon.loops.measurement import Command, Measurement
from daemon.loops.paired_steer import PairedSteerLaw, PairedSteerRecord
from daemon.loops.paired_steer_target import PairedSteerTarget
from profiles.schema import Limits, PairedSteerGeometry

DT = 0.01
GEOMETRY = PairedSteerGeometry(
    mass_kg=28,
    wheelbase_m=0.45,
    pivot_track_m=0.32,
    contact_offset_m=0.075,
    contact_lead_m=0.005,
    max_heading_deg=88,
    wheels=("rear_right", "rear_left", "front_left", "front_right"),
    encoders=("rear", "front"),
    brakes=("rear", "front"),
    yaw_inertia_kg_m2=0.98,
)
LIMITS = Limits(
    speed_m_s=1.2,
    acceleration_m_s2=0.8,
    wheel_speed_m_s=2.0,
    steering_rim_speed_m_s=0.15,
    heading_deg=85,
    heading_tolerance_deg=0.15,
)


@dataclass
class Step:
    """One cycle as the law saw and answered it."""

    measurement: Measurement
    command: Command
    record: PairedSteerRecord


class PairedRobot:
    """Headings, wheels and brakes; ``delay`` cycles pass between a command and its effect."""

    def __init__(self, *, rear_deg: float = 0.0, front_deg: float = 0.0, delay: int = 2) -> None:
        self.heading = [math.radians(rear_deg), math.radians(front_deg)]
        self.speed = [0.0] * 4
        self.travel = [0.0] * 4
        self.brake = [0.0, 0.0]
        """0: engaged, 1: released, between: on its way."""
        self.brake_time_s = 0.05
        self.jammed = False
        self.encoder_sign = 1.0
        self.pending = deque([(0.0, 0.0, 0.0, 0.0)] * delay)
        self.time_s = 0.0

    def measure(self) -> Measurement:
        count = math.tau / 4096
        return Measurement(
            time_s=self.time_s,
            wheel_speed_m_s=tuple(self.speed),
            wheel_travel_m=tuple(self.travel),
            heading_rad=tuple(round(self.encoder_sign * heading / count) * count for heading in self.heading),
            brake_engaged=tuple(position == 0 for position in self.brake),
            brake_released=tuple(position == 1 for position in self.brake),
        )

    def act(self, command: Command) -> None:
        """Live through one cycle under a command."""
        first, second, third, fourth = command.wheel_speed_m_s
        self.pending.append((first, second, third, fourth))
        wanted = self.pending.popleft()
        for wheel in range(4):
            step = 1.5 * DT
            self.speed[wheel] += max(-step, min(step, wanted[wheel] - self.speed[wheel]))
            self.travel[wheel] += self.speed[wheel] * DT
        for pair, (right, left) in enumerate(((0, 1), (3, 2))):
            if self.brake[pair] == 1 and not self.jammed:
                self.heading[pair] += (self.speed[right] - self.speed[left]) / 2 / 0.075 * DT
            change = DT / self.brake_time_s if command.release_brake[pair] else -DT / self.brake_time_s
            self.brake[pair] = round(max(0.0, min(1.0, self.brake[pair] + change)), 9)
        self.time_s += DT


def drive(
    law: PairedSteerLaw, robot: PairedRobot, target: PairedSteerTarget | None, *, at_most_s: float = 30.0
) -> list[Step]:
    """Run the law on the robot until it says done or failed, or the time is over."""
    steps: list[Step] = []
    for _ in range(round(at_most_s / DT)):
        measurement = robot.measure()
        command, record = law.step(measurement, target, DT)
        steps.append(Step(measurement, command, record))
        if record.done or record.failure:
            break
        robot.act(command)
    return steps
