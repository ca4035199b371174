"""The demo: a simulated MAX2D boots, steers its wheel pairs and drives the manoeuvres that its designers published.

Everything is real but the network: the daemon of ``daemon.app`` with its master, drivers, loops and gate drives
simulated nodes over the simulated bus. What was achieved is read from the simulation's truth, not from odometry.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from canhelm.errors import UsageError
from daemon.app import App
from daemon.demo_robot import DemoRobot
from daemon.loops.geometry import solve_turning
from daemon.loops.least_squares import least_squares
from profiles.faults import PlacedFault
from profiles.schema import PairedSteerGeometry, Profile


@dataclass(frozen=True, slots=True)
class Figure:
    """One published manoeuvre (MAX2D thesis, chapter 4).

    Attributes:
        identity: number of the figure.
        move: ``parallel`` or ``turn``.
        rear_deg, front_deg: headings of the pairs (alpha_12 and minus alpha_34 of the thesis).
        speed_m_s: of the robot's centre.
        duration_s: of the published simulation.
        published: what the thesis prints or its program computes.
    """

    identity: str
    move: str
    rear_deg: float
    front_deg: float
    speed_m_s: float
    duration_s: float
    published: dict[str, float]

    @property
    def words(self) -> str:
        """The manoeuvre in words."""
        if self.move == "parallel":
            return f"parallel movement at {self.rear_deg:g}° with {self.speed_m_s:g} m/s for {self.duration_s:g} s"
        headings = f"rear {self.rear_deg:.2f}°, front {self.front_deg:.2f}°"
        return f"turn with {headings} at {self.speed_m_s:g} m/s for {self.duration_s:g} s"

    def request(self) -> tuple[str, dict[str, Any]]:
        """Method and parameters that drive it."""
        common = {"speed_m_s": self.speed_m_s, "duration_s": self.duration_s}
        if self.move == "parallel":
            return "drive.parallel", {"angle_deg": self.rear_deg, **common}
        return "drive.turn", {"rear_deg": self.rear_deg, "front_deg": self.front_deg, **common}


FIGURES = (
    Figure("4.6", "parallel", 0.0, 0.0, -1.0, 4.0, {"end_x_m": -4.0, "end_y_m": 0.0}),
    Figure("4.7", "parallel", 60.0, 60.0, 0.5, 4.0, {"end_x_m": 1.0, "end_y_m": 1.732}),
    Figure("4.15", "turn", math.degrees(-0.35), math.degrees(0.35), 0.5, 4.0, {"radius_m": 0.6699}),
    Figure("4.16", "turn", math.degrees(0.15), math.degrees(-0.3), 1.0, 4.0, {"radius_m": 1.0275}),
)


@dataclass(slots=True)
class Track:
    """What happened in one figure, a row a control cycle (SI, radians; robot's start is the origin).

    Attributes:
        time_s: since the figure's begin.
        pose: x, y and yaw of the robot's centre, from the simulation.
        heading_rad: rear and front heading, from the encoders.
        commanded_m_s, measured_m_s: speed of each wheel.
        slip_angle_rad, slip_ratio: of each wheel, from the simulation.
    """

    time_s: list[float] = field(default_factory=list)
    pose: list[tuple[float, float, float]] = field(default_factory=list)
    heading_rad: list[tuple[float, ...]] = field(default_factory=list)
    commanded_m_s: list[tuple[float, ...]] = field(default_factory=list)
    measured_m_s: list[tuple[float, ...]] = field(default_factory=list)
    slip_angle_rad: list[tuple[float, ...]] = field(default_factory=list)
    slip_ratio: list[tuple[float, ...]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class FigureResult:
    """One driven figure: the numbers of ``--json``, and the track for pictures."""

    figure: Figure
    numbers: dict[str, Any]
    track: Track
    icr_m: tuple[float, float] | None


class Demo(DemoRobot):
    """Boots one simulated robot and drives figures with it.

    Args:
        profile: a robot with paired steering and simulation data.
        seed: of everything random in the simulated network.
        record: folder for the candump log, or None.
        bus: ``simulated``, or ``rs232[@BAUD]`` for the same robot behind the serial line of its first drive.
        tell: called with a sentence at each step of the demo.
        watch: called once a control cycle, for a live view.
        faults: that strike the robot.
    """

    def __init__(
        self,
        profile: Profile,
        seed: int,
        record: Path | None,
        tell: Callable[[str], None],
        watch: Callable[[App], None] | None = None,
        bus: str = "simulated",
        faults: Sequence[PlacedFault] = (),
    ) -> None:
        if not isinstance(profile.vehicle, PairedSteerGeometry):
            raise UsageError(f"profile {profile.name} has no paired steering", remedy="the demo drives max2d")
        super().__init__(profile, seed, record, tell, watch, bus, faults)
        self._geometry = profile.vehicle
        self._limits = self.app.profile.limits

    async def run(self, figures: tuple[Figure, ...]) -> list[FigureResult]:
        """Boot, drive the figures one after another, go down. Raises CanhelmError leaves where the robot fails."""
        await self.app.start()
        try:
            await self.boot("four drives and two encoders")
            return [await self._drive(self._permitted(figure)) for figure in figures]
        finally:
            await self.app.close()

    def _permitted(self, figure: Figure) -> Figure:
        """The figure at the speed that this wire allows, over the same way."""
        rear, front = math.radians(figure.rear_deg), math.radians(figure.front_deg)
        fastest = max(abs(speed) for speed in solve_turning(self._geometry, rear, front, 1.0).roll_speed_m_s)
        top = min(self._limits.speed_m_s, self._limits.wheel_speed_m_s / fastest)
        if abs(figure.speed_m_s) <= top:
            return figure
        speed = math.copysign(math.floor(100 * top) / 100, figure.speed_m_s)
        duration = figure.speed_m_s * figure.duration_s / speed
        self.tell(f"figure {figure.identity} at {abs(speed):g} m/s: the cycle over this wire permits no more")
        return replace(figure, speed_m_s=speed, duration_s=duration)

    async def _drive(self, figure: Figure) -> FigureResult:
        app, world = self.app, self.world
        loop = asyncio.get_running_loop()
        begin_s, track = loop.time(), Track()
        before = self.counts()
        world.advance(begin_s)
        origin = world.pose
        observer = self._observer(track, begin_s, origin)
        app.supervisor.observers.append(observer)
        method, parameters = figure.request()
        self.tell(f"figure {figure.identity}: {figure.words}")
        try:
            async with self.lease("demo") as lease:
                result = await app.service.call(method, parameters, lease)
        finally:
            app.supervisor.observers.remove(observer)
        frames, cycles, late, busy_s = (now - then for now, then in zip(self.counts(), before, strict=True))
        duration_s = loop.time() - begin_s
        numbers: dict[str, Any] = {
            "figure": figure.identity,
            "move": figure.move,
            "commanded": self._commanded(figure),
            "achieved": self._achieved(figure, track, result, duration_s),
            "published": figure.published,
            "frames": frames,
            "bus_load": round(busy_s / duration_s, 4),
            "cycles": cycles,
            "late_cycles": late,
        }
        line = app.bus.details()
        if line:
            numbers["line"] = {"cycle_hz": round(cycles / duration_s, 2), **line}
            self.tell(_line_words(numbers["line"]))
        return FigureResult(figure, numbers, track, self._centre_of_rotation(figure))

    def _observer(self, track: Track, begin_s: float, origin: tuple[float, float, float]) -> Callable[[], None]:
        world, supervisor, loop = self.world, self.app.supervisor, asyncio.get_running_loop()

        def look() -> None:
            measurement = supervisor.measurement
            assert measurement is not None
            track.time_s.append(loop.time() - begin_s)
            track.pose.append(_relative(world.pose, origin))
            track.heading_rad.append(measurement.heading_rad)
            track.commanded_m_s.append(supervisor.command.wheel_speed_m_s)
            track.measured_m_s.append(measurement.wheel_speed_m_s)
            track.slip_angle_rad.append(world.slip_angle_rad)
            track.slip_ratio.append(world.slip_ratio)

        return look

    def _centre_of_rotation(self, figure: Figure) -> tuple[float, float] | None:
        rear, front = math.radians(figure.rear_deg), math.radians(figure.front_deg)
        return solve_turning(self._geometry, rear, front, figure.speed_m_s).icr_m

    def _commanded(self, figure: Figure) -> dict[str, Any]:
        commanded: dict[str, Any] = {
            "rear_deg": round(figure.rear_deg, 3),
            "front_deg": round(figure.front_deg, 3),
            "speed_m_s": figure.speed_m_s,
            "duration_s": figure.duration_s,
        }
        icr = self._centre_of_rotation(figure)
        if icr is not None:
            return {**commanded, "radius_m": round(math.hypot(*icr), 4)}
        distance, angle = figure.speed_m_s * figure.duration_s, math.radians(figure.rear_deg)
        end = {"end_x_m": _rounded(distance * math.cos(angle)), "end_y_m": _rounded(distance * math.sin(angle))}
        return {**commanded, **end}

    def _achieved(self, figure: Figure, track: Track, result: dict[str, Any], duration_s: float) -> dict[str, Any]:
        x, y, yaw = track.pose[-1]
        radius = fitted_radius(track) if figure.move == "turn" else None
        rows = steady_rows(track)
        slip_ratio = max(abs(ratio) for row in rows for ratio in track.slip_ratio[row])
        slip_angle = max(abs(angle) for row in rows for angle in track.slip_angle_rad[row])
        return {
            "end_x_m": _rounded(x),
            "end_y_m": _rounded(y),
            "heading_deg": _rounded(math.degrees(yaw), 3),
            "radius_m": None if radius is None else round(radius, 4),
            "steering_error_deg": round(result["steering_error_deg"], 4),
            "max_slip_ratio": round(slip_ratio, 4),
            "max_slip_angle_deg": round(math.degrees(slip_angle), 3),
            "duration_s": round(duration_s, 3),
        }


def _rounded(value: float, digits: int = 4) -> float:
    """Rounded, without a sign on zero."""
    return round(value, digits) + 0.0


def _line_words(line: dict[str, Any]) -> str:
    return (
        f"serial line at {line['baud']} baud: {line['cycle_hz']:g} cycles a second, "
        f"busy {line['line_utilisation']:.0%}, idle on our side {line['own_idle_share']:.1%}"
    )


def steady_rows(track: Track) -> list[int]:
    """Rows of a track at the largest commanded speeds: after the start-up, before the ramp to rest."""
    top = max(max(abs(speed) for speed in row) for row in track.commanded_m_s)
    rows = [index for index, row in enumerate(track.commanded_m_s) if max(abs(speed) for speed in row) > 0.995 * top]
    settled = [index for index in rows if track.time_s[index] > track.time_s[rows[0]] + 0.3]
    return settled or rows


def fitted_radius(track: Track) -> float:
    """Radius of the circle that fits the centre's steady track best (algebraic least squares) [m]."""
    points = [track.pose[row][:2] for row in steady_rows(track)]
    centre_x, centre_y, offset = least_squares(
        [(2 * x, 2 * y, 1.0) for x, y in points], [x * x + y * y for x, y in points]
    )
    return math.sqrt(offset + centre_x**2 + centre_y**2)


def _relative(pose: tuple[float, float, float], origin: tuple[float, float, float]) -> tuple[float, float, float]:
    dx, dy = pose[0] - origin[0], pose[1] - origin[1]
    cos, sin = math.cos(origin[2]), math.sin(origin[2])
    return (cos * dx + sin * dy, cos * dy - sin * dx, pose[2] - origin[2])
