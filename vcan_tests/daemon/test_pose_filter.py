"""What the filter makes of bearings and odometry together."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given, settings

from daemon.loops.localisation import bearing, bearing_row, composed, triangulated
from daemon.loops.odometry import Pose, moved_along_arc
from daemon.loops.path import Point, wrap
from daemon.loops.pose_filter import FilterNoise, PoseFilter, SeenBearing
from vcan_tests.daemon.reflectors import MARKS, NOISE_RAD, headings, places, true_bearing

MOUNTING = Pose(0.3, 0.1, 0.5)
NOISE = FilterNoise(NOISE_RAD, 0.03, math.radians(2.0))


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
