"""A three-wheel robot on a floor with ice, for tests of traction control: wheels that spin, motors, an accelerometer.

It shares no code with the laws: the plane is complex numbers, and the sensor reads the change of its own velocity. Each
wheel, between its motor and the floor: ``m_w du/dt = F_drive - F_friction - F_floor``; the floor pulls with friction
times load times a curve over the slip speed that has its best at 0.04 m/s and falls to three quarters of that.
"""

from __future__ import annotations

import cmath
import math
from collections import deque
from collections.abc import Callable
from random import Random

MASS_KG = 30.0
YAW_INERTIA = 0.9
LEVER_M = 0.2
DIRECTIONS = tuple(cmath.rect(1.0, math.radians(angle)) for angle in (240, 0, 120))
PLACES = tuple(direction * -1j * LEVER_M for direction in DIRECTIONS)
"""Contact points; each wheel rolls at a right angle to its arm, counter-clockwise about the centre."""
RIM_MASS_KG = 1.5
FRICTION_N = 2.0
EFFICIENCY = 0.8
FORCE_PER_A = 9.0
MOST_A = 10.0
SENSOR = (complex(0.05, 0.12), math.radians(75))
"""Place and rotation of the accelerometer."""
CYCLE_S = 0.01
FINE = 40
"""Integration steps a cycle."""
DRY = 0.7
ICE = 0.08

Place = Callable[[complex, float], float]
"""Friction of the floor by place and time."""


def dry(place: complex, time: float) -> float:
    return DRY


def ice_between(x_from: float, x_to: float, y_from: float = -9.0, y_to: float = 9.0) -> Place:
    def friction(place: complex, time: float) -> float:
        return ICE if x_from < place.real < x_to and y_from < place.imag < y_to else DRY

    return friction


def pull(slip_m_s: float) -> float:
    """Part of the friction that a slip speed brings."""
    fall = 1 - 0.25 * (1 - math.exp(-abs(slip_m_s) / 0.15))
    return math.tanh(slip_m_s / 0.02) * fall


class OmniFloor:
    """The robot; commands of rim speeds take effect one cycle late and are ramped to within the next."""

    def __init__(self, friction: Place = dry, seed: int = 1, noise_m_s2: float = 0.1, wall_x_m: float = 99.0) -> None:
        self._friction = friction
        self._random = Random(seed)
        self._noise = noise_m_s2
        self._wall_x = wall_x_m
        self.time = 0.0
        self.place = 0j
        self.velocity = 0j
        self.heading = 0.0
        self.rate = 0.0
        self.rims = [0.0, 0.0, 0.0]
        self.slips = [0.0, 0.0, 0.0]
        self.forces = [0.0, 0.0, 0.0]
        self.currents = [0.0, 0.0, 0.0]
        self.reading = (0.0, 0.0)
        self.true_acceleration = 0j
        self._sums = [0.0, 0.0, 0.0]
        self._targets = [0.0, 0.0, 0.0]
        self._underway = deque([(0.0, 0.0, 0.0)])

    def start(self, velocity: complex) -> None:
        """Roll already."""
        self.velocity = velocity
        rims = [(velocity * direction.conjugate()).real for direction in DIRECTIONS]
        self.rims, self._targets = list(rims), list(rims)
        self._underway = deque([(rims[0], rims[1], rims[2])])

    def roll(self, rim_targets: tuple[float, ...]) -> None:
        """Live through one cycle."""
        self._underway.append((rim_targets[0], rim_targets[1], rim_targets[2]))
        wanted = self._underway.popleft()
        slopes = [(new - old) / FINE for new, old in zip(wanted, self._targets, strict=True)]
        before, centre = self._sensor_velocity(), self.velocity
        for _ in range(FINE):
            self._targets = [target + slope for target, slope in zip(self._targets, slopes, strict=True)]
            self._step(CYCLE_S / FINE)
        rotation = SENSOR[1]
        felt = (self._sensor_velocity() - before) / CYCLE_S * cmath.rect(1.0, -self.heading - rotation)
        self.true_acceleration = (self.velocity - centre) / CYCLE_S
        noise = self._random.gauss
        self.reading = (felt.real + noise(0, self._noise), felt.imag + noise(0, self._noise))

    def _sensor_velocity(self) -> complex:
        return self.velocity + 1j * self.rate * SENSOR[0] * cmath.rect(1.0, self.heading)

    def _step(self, dt: float) -> None:
        body = cmath.rect(1.0, self.heading)
        sum_force, moment = 0j, 0.0
        load = MASS_KG * 9.81 / 3
        for wheel, (direction, arm) in enumerate(zip(DIRECTIONS, PLACES, strict=True)):
            world = direction * body
            contact = self.velocity + 1j * self.rate * arm * body
            self.slips[wheel] = self.rims[wheel] - (contact * world.conjugate()).real
            force = self._friction(self.place + arm * body, self.time) * load * pull(self.slips[wheel])
            self._turn(wheel, force, dt)
            self.forces[wheel] = force
            sum_force += force * world
            moment += force * (arm.conjugate() * direction).imag
        if self.place.real > self._wall_x:
            sum_force -= 4e4 * (self.place.real - self._wall_x) + 600 * self.velocity.real
        self.velocity += sum_force / MASS_KG * dt
        self.rate += moment / YAW_INERTIA * dt
        self.place += self.velocity * dt
        self.heading += self.rate * dt
        self.time += dt

    def _turn(self, wheel: int, floor_force: float, dt: float) -> None:
        """Motor with speed control, gear, rim."""
        speed = self.rims[wheel]
        error = self._targets[wheel] - speed
        self._sums[wheel] = max(-MOST_A, min(MOST_A, self._sums[wheel] + 1500 * error * dt))
        current = max(-MOST_A, min(MOST_A, 150 * error + self._sums[wheel]))
        force = FORCE_PER_A * current
        force *= EFFICIENCY if force * speed >= 0 else 1 / EFFICIENCY
        friction = FRICTION_N * max(-1.0, min(1.0, speed / 0.01))
        self.currents[wheel] = current
        self.rims[wheel] = speed + (force - friction - floor_force) / RIM_MASS_KG * dt
