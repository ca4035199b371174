"""What the simulated robots have in common: a rigid body on a floor, integrated in fixed steps, and its rest.

On a floor that is tilted by the angle a, g sin a pulls at every mass, down the slope. Poses are those on the floor; the
wheel loads are those of a level one, too large by the share 1 - cos a, 3.4 % at 15 degrees.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from math import cos, sin
from typing import Protocol, TypeVar

from canhelm.errors import ConfigError
from drivers.simulated.motor import WheelDrive
from drivers.simulated.world import Axis
from profiles.schema import BodyGeometry, Profile, SimulationConfig

GRAVITY_M_S2 = 9.81
REST_SPEED = 1e-5
"""Speed [m/s, rad/s] below which a motion counts as rest."""
HAND_RAD_S = 4.0
"""Speed at which a hand turns a wheel (assumed)."""
REST_STEPS = 50
"""Steps at rest, half a swing of the body on its tyres, after which the world stands still."""
LOAD_SHIFT_S = 0.05
"""Time constant with which wheel loads follow the body's acceleration (assumed)."""

G = TypeVar("G", bound=BodyGeometry)


def parts_of(profile: Profile, kind: type[G], what: str, example: str) -> tuple[G, SimulationConfig]:
    """The sections of a profile that the physics needs.

    Args:
        profile: the robot.
        kind: of its vehicle.
        what: it is, in words.
        example: a profile that has both sections.

    Raises:
        ConfigError: the vehicle is another one, or a section is missing.
    """
    if not isinstance(profile.vehicle, kind) or profile.simulation is None:
        raise ConfigError(
            f"profile {profile.name} cannot be simulated as {what}: it needs such a vehicle and simulation data",
            object="simulation" if profile.simulation is None else "vehicle",
            remedy=f"add them, or start from a profile that has them: canhelm profile new NAME --extends {example}",
        )
    return profile.vehicle, profile.simulation


class Braked(Protocol):
    """What a brake holds."""

    def set_brake(self, engaged: bool) -> None:
        """Engage or release it."""
        ...


class Footing(Protocol):
    """Where a wheel touches the floor."""

    def lay_ice(self, friction: float) -> None:
        """From now on there is at most this friction; infinity takes the ice away."""
        ...


class BodyWorld(ABC):
    """A robot's body; a :class:`drivers.simulated.world.World` that also tells the truth to tests.

    Args:
        drives: motor, gear and wheel by the names of the drives.
        mass_kg: of the robot.
        start: pose of the centre (x_m, y_m, yaw_rad).
        step_s: integration step.

    Attributes:
        lifted: whether it stands on blocks, its wheels in the air; only they move then.
        hands: how far hands still turn wheels that are in the air and without current [rad], by their drives.
        slope_rad, downhill_rad: of the floor against the level, and the direction that leads down.
        contacts: where driven wheels touch the floor, by the names of their drives.
    """

    def __init__(
        self, drives: Mapping[str, WheelDrive], mass_kg: float, start: tuple[float, float, float], step_s: float
    ) -> None:
        self.axes: dict[str, Axis] = {name: drive.axis for name, drive in drives.items()}
        self.contacts: Mapping[str, Footing] = {}
        self._drives = tuple(drives.values())
        self._braked: Mapping[str, Braked] = {}
        self.lifted = False
        self.hands: dict[WheelDrive, float] = {}
        self._mass_kg = mass_kg
        self._x_m, self._y_m, self._yaw_rad = start
        self._cos, self._sin = cos(self._yaw_rad), sin(self._yaw_rad)
        self._world_vx = self._world_vy = self._yaw_rate = 0.0
        self.slope_rad = self.downhill_rad = 0.0
        self._pull_x = self._pull_y = 0.0
        self._step_s = step_s
        self._origin_s: float | None = None
        self._advanced_s: float | None = None
        self._steps_done = 0
        self._quiet_steps = REST_STEPS

    @property
    def moving(self) -> bool:
        """False while everything is at rest and every torque source repeats its demand."""
        return self._quiet_steps < REST_STEPS

    @property
    def time_s(self) -> float:
        """Time of the simulation: 0 at the first look."""
        return self._steps_done * self._step_s

    @property
    def pose(self) -> tuple[float, float, float]:
        """True pose of the centre: x_m, y_m, yaw_rad (unwrapped)."""
        return self._x_m, self._y_m, self._yaw_rad

    @property
    def velocity(self) -> tuple[float, float, float]:
        """True velocity in the body's frame: forward m/s, left m/s, yaw rate rad/s."""
        vx, vy = self._body_velocity()
        return vx, vy, self._yaw_rate

    @property
    @abstractmethod
    def slip_ratio(self) -> tuple[float, ...]:
        """True slip ratio of each wheel: (rim speed - rolling speed) over the faster of the two."""

    @property
    @abstractmethod
    def slip_angle_rad(self) -> tuple[float, ...]:
        """True slip angle of each wheel, positive where the contact point drifts to the left of its heading."""

    @abstractmethod
    def heading_rad(self, pair: str) -> float:
        """True heading of a wheel pair by its encoder's name."""

    @abstractmethod
    def _step(self) -> None:
        """Integrate one step."""

    def _fit_brakes(self, profile: Profile, braked: Mapping[str, Braked]) -> None:
        """Brakes by their names in the profile, each as it is without current."""
        self._braked = braked
        for name, part in braked.items():
            part.set_brake(engaged=profile.brakes[name].energise_to_release)

    def set_brake(self, name: str, engaged: bool) -> None:
        """Engage or release a brake from the last advanced time on. Raises KeyError: there is none of this name."""
        self._braked[name].set_brake(engaged)
        self._quiet_steps = 0

    def advance(self, now_s: float) -> None:
        """Integrate up to ``now_s``; the first call sets the origin of time."""
        if now_s == self._advanced_s:
            return  # all nodes look at the same SYNC
        if self._origin_s is None:
            self._origin_s = now_s
        steps = int((now_s - self._origin_s) / self._step_s + 1e-6)
        if steps >= self._steps_done:
            ahead_s = now_s - self._origin_s - steps * self._step_s
            for drive in self._drives:
                drive.axis.ahead_s = ahead_s
        self._integrate(steps)
        self._advanced_s = now_s

    def _integrate(self, steps: int) -> None:
        """Integrate until so many steps are done."""
        step = self._step_in_air if self.lifted else self._step
        while self._steps_done < steps:
            if self._a_demand_changes():
                self._quiet_steps = 0
            if self._quiet_steps < REST_STEPS:
                step()
                self._watch_for_rest()
            elif all(axis.torque_source is None for axis in self.axes.values()):
                self._steps_done = steps
                return
            self._steps_done += 1

    def tilt(self, slope_rad: float, downhill_rad: float) -> None:
        """Tilt the floor from the last advanced time on.

        Args:
            slope_rad: against the level.
            downhill_rad: direction on the floor that leads down, counter-clockwise from the x axis of the poses.
        """
        self.slope_rad, self.downhill_rad = slope_rad, downhill_rad
        pull = GRAVITY_M_S2 * sin(slope_rad)
        self._pull_x, self._pull_y = pull * cos(downhill_rad), pull * sin(downhill_rad)
        self._quiet_steps = 0

    def block(self, drive: str, blocked: bool) -> None:
        """Let something jam a motor from the last advanced time on, or take it away."""
        self._drives[list(self.axes).index(drive)].block(blocked)
        self._quiet_steps = 0

    def turn_by_hand(self, drive: str, angle_rad: float) -> None:
        """Turn a wheel in the air by hand, from the last advanced time on; positive as it rolls forward."""
        self.hands[self._drives[list(self.axes).index(drive)]] = angle_rad
        self._quiet_steps = 0

    def wheel_rad(self, drive: str) -> float:
        """True angle of a wheel by its drive's name, positive as it rolls forward."""
        return self._drives[list(self.axes).index(drive)].wheel_rad

    def _step_in_air(self) -> None:
        """Turn the wheels for one step, each for itself; a hand gives way to a brake and to a motor with current."""
        dt = self._step_s
        for drive in self._drives:
            left = self.hands.pop(drive, 0.0)
            if not left or drive.demand_a or drive.braked:
                drive.turn(0.0, 0.0, dt)
                continue
            step = min(max(left, -HAND_RAD_S * dt), HAND_RAD_S * dt)
            drive.follow(step / dt, dt)
            if left == step:
                drive.stop()
            else:
                self.hands[drive] = left - step

    def _a_demand_changes(self) -> bool:
        """Ask every drive for its demand in the coming step; True when one differs from the last."""
        step = self._step_s
        changed = False
        for drive in self._drives:
            if drive.ask(step):
                changed = True
        return changed

    def _move(self, force_x: float, force_y: float, yaw_acceleration: float, dt: float) -> None:
        """Move the body for one step by the floor's force in its own frame, and by the pull of a slope."""
        self._yaw_rate += yaw_acceleration * dt
        c, s = self._cos, self._sin
        per_mass = dt / self._mass_kg
        self._world_vx += (force_x * c - force_y * s) * per_mass + self._pull_x * dt
        self._world_vy += (force_x * s + force_y * c) * per_mass + self._pull_y * dt
        self._x_m += self._world_vx * dt
        self._y_m += self._world_vy * dt
        if self._yaw_rate != 0.0:
            self._yaw_rad += self._yaw_rate * dt
            self._cos, self._sin = cos(self._yaw_rad), sin(self._yaw_rad)

    def _body_velocity(self) -> tuple[float, float]:
        """Velocity of the centre, forward and left [m/s]."""
        c, s = self._cos, self._sin
        return self._world_vx * c + self._world_vy * s, self._world_vy * c - self._world_vx * s

    def _watch_for_rest(self) -> None:
        """Count the steps at rest; after enough of them take the last imperceptible motion away."""
        if not -REST_SPEED < self._world_vx < REST_SPEED or not self._is_slow():
            self._quiet_steps = 0
            return
        self._quiet_steps += 1
        if self._quiet_steps == REST_STEPS:
            self._come_to_rest()

    def _motions(self) -> tuple[float, ...]:
        """Speeds that have to be small for rest, beside the body's own forward speed."""
        return (self._world_vy, self._yaw_rate, *(drive.rim_m_s for drive in self._drives))

    def _is_slow(self) -> bool:
        """Whether nothing moves faster than what counts as rest."""
        return all(-REST_SPEED < motion < REST_SPEED for motion in self._motions())

    def _come_to_rest(self) -> None:
        """Set every speed to zero."""
        self._world_vx = self._world_vy = self._yaw_rate = 0.0
        for drive in self._drives:
            drive.stop()
