"""The demo of the Ackermann car: steps of heading and speed, by the report's equations and driven in simulation.

The report prints no result of its simulations. What its equations make of a step is computed here; what the simulated
car makes of it, with its steering's rate, its drives' ramps and its tyres, is read from the simulation's truth. The
report's car knows its heading; the simulated one is told by a tracking system.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from canhelm.errors import UsageError
from daemon.demo_robot import DemoRobot
from daemon.demo_tracking import tracked
from daemon.loops.ackermann import AckermannController, AckermannState, drive
from daemon.loops.ackermann_drive import CarTarget, car_kinematics
from daemon.loops.pid import PidGains
from daemon.runtime.car_motions import CarMotion
from daemon.runtime.car_vehicle import CarVehicle
from daemon.runtime.handlers import run_motion
from drivers.simulated.ackermann import AckermannWorld
from profiles.schema import Profile
from profiles.steered import CarGeometry, RegulatorGains

GROUP: Final = "ackermann"
"""Name of all figures together."""
TICK_S: Final = 0.05
"""Of the computed runs."""
RUN_UP_S: Final = 2.0
LONGEST_S: Final = 6.0
SETTLED_RAD, SETTLED_SHARE = 0.02, 0.02


@dataclass(frozen=True, slots=True)
class CarStep:
    """One step of the set-points.

    Attributes:
        identity: its name.
        from_m_s: speed before it, straight ahead.
        heading_rad, speed_m_s: set-points after it.
    """

    identity: str
    from_m_s: float
    heading_rad: float
    speed_m_s: float

    @property
    def words(self) -> str:
        """What happens."""
        before = f"from {self.from_m_s:g} m/s" if self.from_m_s else "from rest"
        return f"{before} to {self.speed_m_s:g} m/s and a heading of {self.heading_rad:g} rad"


FIGURES: Final = (
    CarStep("step-from-rest", 0.0, 1.0, 2.0),
    CarStep("step-to-the-right", 0.5, -2.0, 1.0),
    CarStep("step-slower", 1.0, 0.2, 0.5),
    CarStep("step-far", 1.0, 2.5, 1.0),
)


@dataclass(slots=True)
class CarTrack:
    """A run, a row a tick or a control cycle (SI), from the step on.

    Attributes:
        time_s: since the step.
        heading_rad, speed_m_s, steering_rad: of the car.
        place_m: of its rear axle's middle.
    """

    time_s: list[float] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)
    speed_m_s: list[float] = field(default_factory=list)
    steering_rad: list[float] = field(default_factory=list)
    place_m: list[tuple[float, float]] = field(default_factory=list)

    def add(self, time_s: float, pose: tuple[float, float, float], speed_m_s: float, steering_rad: float) -> None:
        """One row."""
        self.time_s.append(time_s)
        self.place_m.append(pose[:2])
        self.heading_rad.append(pose[2])
        self.speed_m_s.append(speed_m_s)
        self.steering_rad.append(steering_rad)


@dataclass(frozen=True, slots=True)
class CarResult:
    """One step: the numbers of ``--json``, and both runs for pictures."""

    step: CarStep
    numbers: dict[str, Any]
    computed: CarTrack
    driven: CarTrack


def computed(profile: Profile, geometry: CarGeometry, step: CarStep) -> CarTrack:
    """The step by the report's equations 4.1 to 4.19, without slip and with a steering that is there at once."""
    radius = profile.drives[geometry.wheels[0]].wheel_radius_m
    car = car_kinematics(geometry, profile.limits, radius)
    heading, speed = _gains(geometry.heading_regulator, 1.0), _gains(geometry.speed_regulator, TICK_S)
    controller = AckermannController(car, heading, speed, TICK_S)
    state = AckermannState(0.0, step.from_m_s / radius, step.from_m_s / radius)
    axle_m_s, x, y, track = step.from_m_s, 0.0, 0.0, CarTrack()
    track.add(0.0, (x, y, 0.0), axle_m_s, 0.0)
    for tick in range(1, round(LONGEST_S / TICK_S) + 1):
        gamma, throttle = controller.step(step.heading_rad - state.heading_rad, step.speed_m_s - axle_m_s)
        done = drive(car, state, throttle, gamma, TICK_S)
        middle = (state.heading_rad + done.state.heading_rad) / 2
        state, axle_m_s = done.state, done.axle_speed_m_s
        x, y = x + axle_m_s * TICK_S * math.cos(middle), y + axle_m_s * TICK_S * math.sin(middle)
        track.add(tick * TICK_S, (x, y, state.heading_rad), axle_m_s, gamma)
    return track


def _gains(gains: RegulatorGains, scale: float) -> PidGains:
    return PidGains(scale * gains.proportional, scale * gains.integral, scale * gains.derivative)


async def run(
    profile: Profile, step: CarStep, seed: int, record: Path | None, tell: Callable[[str], None]
) -> CarResult:
    """Boot a car of its own for one step, drive it, go down. Raises CanhelmError leaves where the car fails.

    Args:
        profile: a car with simulation data.
        step: what to drive.
        seed: of everything random in the simulated network.
        record: folder for the candump log, or None.
        tell: called with a sentence at each stage.
    """
    geometry = profile.vehicle
    if not isinstance(geometry, CarGeometry) or profile.simulation is None:
        raise UsageError(f"profile {profile.name} has no car to simulate", remedy="leave --profile out")
    robot = DemoRobot(profile, seed, record, tell)
    await robot.app.start()
    try:
        await robot.boot("three drives and an encoder")
        tell(f"{step.identity}: {step.words}")
        before, begin_s = robot.counts(), asyncio.get_running_loop().time()
        driven = await _driven(robot, step, seed)
        frames, cycles, late, busy_s = (now - then for now, then in zip(robot.counts(), before, strict=True))
    finally:
        await robot.app.close()
    ideal = computed(profile, geometry, step)
    numbers = {
        "figure": step.identity,
        "move": step.words,
        "computed": summary(step, ideal),
        "achieved": summary(step, driven),
        "frames": frames,
        "bus_load": round(busy_s / (asyncio.get_running_loop().time() - begin_s), 4),
        "cycles": cycles,
        "late_cycles": late,
    }
    return CarResult(step, numbers, ideal, driven)


async def _driven(robot: DemoRobot, step: CarStep, seed: int) -> CarTrack:
    """Run up to the speed before the step, change the set-points, and look on."""
    run_up_s = RUN_UP_S if step.from_m_s else 0.0
    params = {"heading_deg": 0.0, "speed_m_s": step.from_m_s, "duration_s": run_up_s + LONGEST_S}
    vehicle, world, track, loop = robot.app.vehicle, robot.world, CarTrack(), asyncio.get_running_loop()
    assert isinstance(vehicle, CarVehicle)
    assert isinstance(world, AckermannWorld)
    motion = vehicle.motion("drive.heading", params, None)
    assert isinstance(motion, CarMotion)

    def look() -> None:
        if not motion.running or motion.target is None:
            return
        time_s = loop.time() - motion.begun_s - run_up_s
        if time_s >= 0.0:
            motion.target = CarTarget(step.speed_m_s, heading_rad=step.heading_rad)
            track.add(time_s, world.rear_pose, world.velocity[0], world.steering.angle_rad)

    robot.app.supervisor.observers.append(look)
    with tracked(robot, lambda: world.rear_pose, vehicle.locate, seed):
        await run_motion(robot.app.supervisor, motion, {})
    return track


def summary(step: CarStep, track: CarTrack) -> dict[str, Any]:
    """Settling, overshoot and what is left at the end."""
    side = math.copysign(1.0, step.heading_rad)
    grows = math.copysign(1.0, step.speed_m_s - step.from_m_s)
    return {
        "settling_s": settling_s(step, track),
        "heading_overshoot_deg": _beyond(math.degrees(side * (a - step.heading_rad)) for a in track.heading_rad),
        "speed_overshoot_m_s": _beyond(grows * (v - step.speed_m_s) for v in track.speed_m_s),
        "final_heading_error_deg": round(math.degrees(step.heading_rad - track.heading_rad[-1]), 3) + 0.0,
        "final_speed_error_m_s": round(step.speed_m_s - track.speed_m_s[-1], 4) + 0.0,
        "largest_steering_deg": round(math.degrees(max(map(abs, track.steering_rad))), 2),
    }


def _beyond(values: Iterable[float]) -> float:
    return round(max(0.0, *values), 4)


def settling_s(step: CarStep, track: CarTrack) -> float | None:
    """Time from which the heading stays within 0.02 rad and the speed within 2 % of the set-points; None for never."""
    last_off = -1
    for row, (heading, speed) in enumerate(zip(track.heading_rad, track.speed_m_s, strict=True)):
        turned = abs(heading - step.heading_rad) <= SETTLED_RAD
        if not (turned and abs(speed - step.speed_m_s) <= SETTLED_SHARE * step.speed_m_s):
            last_off = row
    return round(track.time_s[last_off + 1], 2) if last_off + 1 < len(track.time_s) else None
