"""Localisation: the pose from bearings, what the filter makes of it, and a vehicle that goes by it."""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from canhelm.errors import ConfigError, UsageError
from daemon.loops.localisation import Covariance, bearing, bearing_row, composed, inverted, triangulated
from daemon.loops.odometry import Pose, moved_along_arc
from daemon.loops.path import Point, wrap
from daemon.loops.pose_filter import FilterNoise, PoseFilter, SeenBearing
from drivers.simulated.scanner import SimulatedScanner
from drivers.simulated.semitrailer import SemitrailerWorld
from profiles.loader import load
from profiles.localisation import SimulatedScannerConfig
from profiles.schema import Profile
from vcan_tests.robot import Robot, running_robot

MARKS = {"a": (0.0, 4.0), "b": (5.0, 4.0), "c": (4.0, -3.0), "d": (-3.0, -2.0)}
NOISE_RAD = math.radians(0.2)
MOUNTING = Pose(0.3, 0.1, 0.5)
NOISE = FilterNoise(NOISE_RAD, 0.03, math.radians(2.0))

places = st.tuples(st.floats(-8, 8), st.floats(-8, 8))
headings = st.floats(-math.pi, math.pi)


def true_bearing(pose: Pose, place: Point) -> float:
    """By turning the reflector into the scanner's frame: another way than the loop's."""
    backwards = complex(math.cos(pose.yaw_rad), -math.sin(pose.yaw_rad))
    turned = complex(place[0] - pose.x_m, place[1] - pose.y_m) * backwards
    return math.atan2(turned.imag, turned.real)


def sightings(pose: Pose, marks: Sequence[Point]) -> list[tuple[Point, float]]:
    return [(mark, true_bearing(pose, mark)) for mark in marks]


def area(marks: Sequence[Point]) -> float:
    (ax, ay), (bx, by), (cx, cy) = marks
    return abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2


def circle(marks: Sequence[Point]) -> tuple[complex, float]:
    """Centre and radius of the circle through three points."""
    a, b, c = (complex(*mark) for mark in marks)
    w = (c - a) / (b - a)
    centre = (b - a) * (w - abs(w) ** 2) / (2j * w.imag) + a
    return centre, abs(a - centre)


# -- from bearings alone -----------------------------------------------------------------------------------------------


@settings(max_examples=200)
@given(st.tuples(places, places, places), places, headings)
def test_three_bearings_give_the_pose(marks: tuple[Point, Point, Point], place: Point, heading: float) -> None:
    pose = Pose(*place, heading)
    assume(area(marks) > 1 and all(math.dist(mark, place) > 0.3 for mark in marks))
    centre, radius = circle(marks)
    assume(abs(abs(complex(*place) - centre) - radius) > 0.3)
    fix = triangulated(sightings(pose, marks), max_dilution_m_rad=math.inf)
    assert fix is not None
    assert (fix.pose.x_m, fix.pose.y_m) == pytest.approx(place, abs=1e-5)
    assert wrap(fix.pose.yaw_rad - heading) == pytest.approx(0.0, abs=1e-5)


def test_it_is_where_the_circles_of_equal_angle_meet() -> None:
    """The old way: each pair of bearings puts the scanner on a circle through its two reflectors."""
    pose, (a, b, c) = Pose(1.3, 0.7, 0.4), [MARKS[name] for name in "abc"]
    angles = {mark: true_bearing(pose, mark) for mark in (a, b, c)}
    fix = triangulated(list(angles.items()))
    assert fix is not None
    for one, other in ((a, b), (b, c), (c, a)):
        subtended = wrap(angles[other] - angles[one])
        half = math.dist(one, other) / 2
        middle = complex(one[0] + other[0], one[1] + other[1]) / 2
        across = complex(other[0] - one[0], other[1] - one[1]) / (2 * half) * 1j
        centre = middle + across * half / math.tan(subtended)
        radius = half / abs(math.sin(subtended))
        assert abs(complex(fix.pose.x_m, fix.pose.y_m) - centre) == pytest.approx(radius, abs=1e-9)


@given(st.floats(0, 2 * math.pi), headings, st.floats(1, 5))
def test_on_the_circle_through_the_reflectors_there_is_no_pose(angle: float, heading: float, radius: float) -> None:
    marks = [(radius * math.cos(turn), radius * math.sin(turn)) for turn in (0.3, 1.9, 4.0)]
    place = (radius * math.cos(angle), radius * math.sin(angle))
    assume(all(math.dist(mark, place) > 0.2 for mark in marks))
    assert triangulated(sightings(Pose(*place, heading), marks)) is None


def test_near_the_circle_the_dilution_grows() -> None:
    marks = [(3 * math.cos(turn), 3 * math.sin(turn)) for turn in (0.3, 1.9, 4.0)]
    fixes = [triangulated(sightings(Pose(0.0, -radius, 0.2), marks), math.inf) for radius in (0.5, 2.0, 2.8, 2.95)]
    dilutions = [fix.unit.position_m for fix in fixes if fix is not None]
    assert dilutions == sorted(dilutions)
    assert dilutions[-1] > 10 * dilutions[0]


def test_a_fourth_reflector_off_the_circle_tells_the_pose_on_it() -> None:
    marks = [(3 * math.cos(turn), 3 * math.sin(turn)) for turn in (0.3, 1.9, 4.0)]
    fix = triangulated(sightings(Pose(0.0, -3.0, 0.2), [*marks, (6.0, 1.0)]))
    assert fix is not None
    assert (fix.pose.x_m, fix.pose.y_m) == pytest.approx((0.0, -3.0), abs=1e-6)


def test_reflectors_in_one_line_with_the_scanner_give_no_pose() -> None:
    assert triangulated(sightings(Pose(0.0, 0.0, 0.3), [(1.0, 0.0), (2.0, 0.0), (-3.0, 0.0)])) is None


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_bearings_give_no_pose(count: int) -> None:
    assert triangulated(sightings(Pose(1.0, 1.0, 0.0), list(MARKS.values())[:count])) is None


def test_the_covariance_is_what_many_noisy_fixes_show() -> None:
    pose, chance = Pose(1.0, 0.5, 0.3), random.Random(4)
    found = []
    told = Covariance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(400):
        noisy = [(mark, angle + chance.gauss(0, NOISE_RAD)) for mark, angle in sightings(pose, list(MARKS.values()))]
        fix = triangulated(noisy)
        assert fix is not None
        found.append((fix.pose.x_m, fix.pose.y_m, fix.pose.yaw_rad))
        told = fix.unit.scaled(NOISE_RAD**2)
    seen = np.cov(np.array(found).T)
    assert np.sqrt(np.diag(seen)) == pytest.approx(np.sqrt([told.xx, told.yy, told.tt]), rel=0.15)


@given(places, headings, places, headings)
def test_a_pose_seen_from_itself_is_the_origin(one: Point, turn: float, other: Point, more: float) -> None:
    pose, relative = Pose(*one, turn), Pose(*other, more)
    back = composed(inverted(pose), composed(pose, relative))
    assert (back.x_m, back.y_m, back.yaw_rad) == pytest.approx((relative.x_m, relative.y_m, relative.yaw_rad), abs=1e-9)


# -- with the odometry -------------------------------------------------------------------------------------------------


@dataclass
class Drive:
    """A vehicle on a circle whose odometry drifts, and a filter that follows it.

    Attributes:
        true: pose.
        odometry: pose by the wheels, corrected by the filter.
    """

    seed: int
    mounting: Pose = MOUNTING
    named: bool = True
    delay_s: float = 0.0
    drift: float = 1.0
    swing_rad: float = 0.0

    def __post_init__(self) -> None:
        self.chance = random.Random(self.seed)
        self.filter = PoseFilter(MARKS, NOISE)
        self.true, self.odometry, self.time_s = Pose(1.0, 0.0, 0.0), Pose(), 0.0
        self._pending: list[tuple[float, list[SeenBearing]]] = []

    def step(self, scan: bool, hidden: Sequence[str] = ()) -> None:
        """A tenth of a second at 0.5 m/s."""
        way, turn = 0.05, 0.03
        self.true = moved_along_arc(self.true, way, 0.0, turn)
        spread = math.sqrt(way) * self.drift
        wrong = self.chance.gauss(0, NOISE.way) * spread, self.chance.gauss(0, NOISE.way) * spread
        turned = turn + self.chance.gauss(0, NOISE.turn_rad) * spread
        self.odometry = moved_along_arc(self.odometry, way + wrong[0], wrong[1], turned)
        self.time_s += 0.1
        swung = self.swing_rad * math.sin(3 * self.time_s)
        self.mounting = Pose(MOUNTING.x_m, MOUNTING.y_m, MOUNTING.yaw_rad + swung)
        self.filter.move(self.odometry, self.time_s, self.mounting)
        if scan:
            self._pending.append((self.time_s, self.seen(hidden)))
        while self._pending and self._pending[0][0] <= self.time_s - self.delay_s + 1e-9:
            taken_s, bearings = self._pending.pop(0)
            self.filter.take(bearings, taken_s)
            self.odometry = self.filter.pose

    def seen(self, hidden: Sequence[str] = ()) -> list[SeenBearing]:
        scanner = composed(self.true, self.mounting)
        return [
            SeenBearing(true_bearing(scanner, place) + self.chance.gauss(0, NOISE_RAD), name if self.named else None)
            for name, place in MARKS.items()
            if name not in hidden
        ]

    @property
    def error_m(self) -> float:
        return math.hypot(self.odometry.x_m - self.true.x_m, self.odometry.y_m - self.true.y_m)

    def normalised_error(self) -> float:
        """Squared error of the pose in units of its covariance: 3 on average when both agree."""
        c = self.filter.covariance
        assert c is not None
        matrix = np.array([[c.xx, c.xy, c.xt], [c.xy, c.yy, c.yt], [c.xt, c.yt, c.tt]])
        pose = self.filter.pose
        turned = wrap(pose.yaw_rad - self.true.yaw_rad)
        error = np.array([pose.x_m - self.true.x_m, pose.y_m - self.true.y_m, turned])
        return float(error @ np.linalg.solve(matrix, error))


def test_the_first_scan_gives_the_pose_wherever_the_odometry_began() -> None:
    drive = Drive(1)
    drive.step(scan=True)
    assert drive.error_m < 0.05


def test_the_filter_is_better_than_single_fixes() -> None:
    drive, single, filtered = Drive(2), [], []
    for _ in range(200):
        drive.step(scan=True)
        filtered.append(drive.error_m**2)
        fix = triangulated([(MARKS[seen.reflector or ""], seen.bearing_rad) for seen in drive.seen()])
        assert fix is not None
        scanner = composed(drive.true, drive.mounting)
        single.append((fix.pose.x_m - scanner.x_m) ** 2 + (fix.pose.y_m - scanner.y_m) ** 2)
    assert np.mean(filtered[10:]) < 0.7 * np.mean(single)


def test_what_the_filter_says_of_its_errors_is_true() -> None:
    errors = []
    for seed in range(40):
        drive = Drive(seed)
        for _ in range(30):
            drive.step(scan=True)
        errors.append(drive.normalised_error())
    assert 2.0 < np.mean(errors) < 4.2, "chi squared with three degrees of freedom, 40 runs"


def test_standing_still_it_agrees_with_least_squares_over_all_scans() -> None:
    pose, chance, scans = Pose(1.0, 0.4, 0.2), random.Random(9), []
    found = PoseFilter(MARKS, NOISE)
    found.move(Pose(), 0.0, Pose())
    for _ in range(50):
        scan = [SeenBearing(true_bearing(pose, p) + chance.gauss(0, NOISE_RAD), n) for n, p in MARKS.items()]
        found.take(scan, 0.0)
        scans += [(MARKS[seen.reflector or ""], seen.bearing_rad) for seen in scan]
    mean = [(place, float(np.mean([angle for mark, angle in scans if mark == place]))) for place in MARKS.values()]
    fix = triangulated(mean)
    assert fix is not None
    assert (found.pose.x_m, found.pose.y_m) == pytest.approx((fix.pose.x_m, fix.pose.y_m), abs=5e-4)


def test_without_reflectors_it_goes_on_by_the_odometry_and_knows_less() -> None:
    drive = Drive(3)
    drive.step(scan=True)
    before = drive.filter.covariance
    for _ in range(50):
        drive.step(scan=False)
    after = drive.filter.covariance
    assert before is not None
    assert after is not None
    assert after.position_m > 3 * before.position_m
    assert drive.error_m < 4 * after.position_m


def test_one_reflector_is_enough_to_hold_it_for_a_while() -> None:
    held: list[float] = []
    free: list[float] = []
    for seed in range(12):
        for errors, scan in ((held, True), (free, False)):
            drive = Drive(seed)
            drive.step(scan=True)
            for _ in range(60):
                drive.step(scan=scan, hidden="bcd")
            errors.append(drive.error_m)
    assert np.mean(held) < 0.8 * np.mean(free)


def test_bearings_without_a_name_are_told_apart_once_there_is_a_fix() -> None:
    drive = Drive(4)
    drive.step(scan=True)
    drive.named = False
    for _ in range(200):
        drive.step(scan=True)
    assert drive.error_m < 0.05


def test_bearings_without_a_name_give_no_first_fix() -> None:
    drive = Drive(4, named=False)
    drive.step(scan=True)
    assert drive.filter.covariance is None


def test_a_wrong_bearing_is_rejected() -> None:
    drive = Drive(5)
    for _ in range(20):
        drive.step(scan=True)
    scan = drive.seen()
    scan[0] = SeenBearing(scan[0].bearing_rad + math.radians(10), scan[0].reflector)
    correction = drive.filter.take([*scan, SeenBearing(0.0, "nobody knows")], drive.time_s)
    assert (correction.used, correction.rejected) == (3, 2)


@pytest.mark.parametrize("delay_s", [0.1, 0.3])
def test_an_old_scan_corrects_the_pose_of_now(delay_s: float) -> None:
    errors = []
    for seed in range(5):
        drive = Drive(seed, delay_s=delay_s)
        for _ in range(60):
            drive.step(scan=True)
        errors.append(drive.error_m)
    assert np.mean(errors) < 0.035, "the vehicle drives 5 cm in 0.1 s"


def test_an_old_scan_from_a_trailer_that_bends_meanwhile_fits_as_well() -> None:
    drive = Drive(8, delay_s=0.3, swing_rad=0.4)
    for _ in range(60):
        drive.step(scan=True)
    assert drive.error_m < 0.035


def test_a_vehicle_that_was_carried_away_is_found_again() -> None:
    drive = Drive(6)
    for _ in range(10):
        drive.step(scan=True)
    drive.true = Pose(-1.0, 2.0, 2.5)
    for _ in range(10):
        drive.step(scan=True)
    assert drive.error_m < 0.05


def test_the_heading_does_not_jump_by_whole_turns() -> None:
    drive = Drive(7)
    drive.odometry = Pose(0.0, 0.0, 12.0)
    drive.filter.move(drive.odometry, 0.0, MOUNTING)
    drive.step(scan=True)
    assert abs(drive.filter.pose.yaw_rad - 12.0) <= math.pi


@settings(max_examples=50)
@given(places, headings)
def test_the_row_of_a_bearing_is_its_derivative(place: Point, heading: float) -> None:
    mark, step = MARKS["a"], 1e-6
    assume(math.dist(place, mark) > 0.5)
    pose = Pose(*place, heading)
    moved = [
        Pose(place[0] + step, place[1], heading),
        Pose(place[0], place[1] + step, heading),
        Pose(*place, heading + step),
    ]
    slopes = [wrap(bearing(other, mark) - bearing(pose, mark)) / step for other in moved]
    assert bearing_row(pose, mark) == pytest.approx(slopes, abs=1e-4)


# -- the simulated scanner ---------------------------------------------------------------------------------------------


def scanner(
    noise_deg: float = 0.0, hidden_share: float = 0.0, hidden_s: float = 1.0, range_m: float = 100.0
) -> SimulatedScanner:
    config = SimulatedScannerConfig(noise_deg=noise_deg, hidden_share=hidden_share, hidden_s=hidden_s, range_m=range_m)
    return SimulatedScanner(config, MARKS, lambda _: (1.0, 0.5, 0.3), "seed")


def test_the_scanner_sees_what_is_there() -> None:
    for angle, name in scanner().scan(0.0):
        assert name is not None
        assert angle == pytest.approx(true_bearing(Pose(1.0, 0.5, 0.3), MARKS[name]), abs=1e-9)


def test_its_noise_is_as_told() -> None:
    eye = scanner(noise_deg=0.5)
    errors = [
        wrap(angle - true_bearing(Pose(1.0, 0.5, 0.3), MARKS[name or ""]))
        for number in range(300)
        for angle, name in eye.scan(number / 10)
    ]
    assert math.degrees(float(np.std(errors))) == pytest.approx(0.5, rel=0.1)


def test_reflectors_are_hidden_for_their_share_of_the_time() -> None:
    eye = scanner(hidden_share=0.3, hidden_s=0.5)
    seen = sum(len(eye.scan(number / 20)) for number in range(20_000))
    assert seen / (20_000 * len(MARKS)) == pytest.approx(0.7, abs=0.03)


def test_what_is_too_far_is_not_seen() -> None:
    names = {name for _, name in scanner(range_m=4.7).scan(0.0)}
    assert names == {"a", "c"}


# -- a vehicle ---------------------------------------------------------------------------------------------------------


def lab(**simulated: Any) -> Profile:
    """The semi-trailer among reflectors, with this scanner; with none where nothing is given."""
    profile = load("semitrailer_lab").profile
    assert profile.simulation is not None
    eye = SimulatedScannerConfig(**simulated) if simulated else None
    return replace(profile, simulation=replace(profile.simulation, scanner=eye))


def error_m(robot: Robot) -> float:
    """Distance between where the vehicle is and where the daemon believes it to be."""
    x, y, _ = robot.network.world.pose
    told = robot.app.service.status()["localisation"]
    return math.hypot(told["x_m"] - x, told["y_m"] - y)


async def test_a_vehicle_knows_its_place_after_the_first_scan() -> None:
    async with running_robot(lab(rate_hz=10.0, noise_deg=0.1), booted=False, powered=False) as robot:
        world = robot.network.world
        assert isinstance(world, SemitrailerWorld)
        world.place((0.5, -0.4, 0.6), 0.2, 0.0)
        robot.network.power_on("all")
        await robot.until(lambda: robot.state == "idle")
        await asyncio.sleep(0.5)
        assert robot.app.service.status()["localisation"]["state"] == "fixed"
        assert error_m(robot) < 0.02


async def test_a_scanner_on_the_trailer_keeps_the_truck_in_place_while_it_drives() -> None:
    line = {"pieces": [{"line_m": 1.5, "drive": "backward"}]}
    async with running_robot(lab(rate_hz=10.0, noise_deg=0.1, hidden_share=0.3, delay_ms=40.0)) as robot:
        await asyncio.sleep(0.5)
        driving = asyncio.create_task(robot.call("drive.path", path=line))
        errors: list[float] = []
        robot.app.supervisor.observers.append(lambda: errors.append(error_m(robot)))
        await driving
        assert max(errors) < 0.03


async def test_any_program_may_send_the_bearings() -> None:
    async with running_robot(lab()) as robot:
        localisation = robot.app.profile.localisation
        assert localisation is not None
        assert robot.app.service.status()["localisation"]["state"] == "waiting"
        world = robot.network.world
        assert isinstance(world, SemitrailerWorld)
        x, y, yaw = world.trailer_pose
        mounted = localisation.scanner
        eye = composed(Pose(x, y, yaw), Pose(mounted.x_m, mounted.y_m, math.radians(mounted.rotation_deg)))
        sent = [
            {"reflector": name, "bearing_deg": math.degrees(true_bearing(eye, (mark.x_m, mark.y_m)))}
            for name, mark in localisation.reflectors.items()
        ]
        told = await robot.call("localisation.bearings", bearings=sent, age_ms=0.0)
        assert (told["used"], told["rejected"], told["state"]) == (len(sent), 0, "fixed")
        assert error_m(robot) < 0.005
        await asyncio.sleep(2.0)
        assert robot.app.service.status()["localisation"]["state"] == "odometry"


@pytest.mark.parametrize("value", [[{"bearing": 1}], ["a"], [{"bearing_deg": "a"}], [{"bearing_deg": math.nan}]])
async def test_bearings_that_are_none_are_refused(value: list[object]) -> None:
    async with running_robot(lab()) as robot:
        with pytest.raises(UsageError, match=r"localisation\.bearings"):
            await robot.call("localisation.bearings", bearings=value, age_ms=0.0)


@pytest.mark.parametrize(
    ("robot", "more", "told"),
    [
        ("max2d", "  scanner: {on: trailer}", "there is no trailer"),
        ("turtle", "", "no vehicle with an odometry"),
        ("max2d", "  scanner: {on: roof}", "one of trailer, vehicle"),
    ],
)
def test_what_cannot_be_localised_is_named_with_file_and_line(tmp_path: Path, robot: str, more: str, told: str) -> None:
    marks = "{a: {x_m: 0, y_m: 1}, b: {x_m: 1, y_m: 1}, d: {x_m: 2, y_m: 0}}"
    text = (
        f"schema_version: 1\nextends: robots/{robot}\nlocalisation:\n  bearing_noise_deg: 0.1\n  reflectors: {marks}\n"
    )
    path = tmp_path / "lab1.yaml"
    path.write_text(text + more + "\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=told):
        load(path)
