"""The pose from bearings alone."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from daemon.loops.localisation import Covariance, composed, inverted, triangulated
from daemon.loops.odometry import Pose
from daemon.loops.path import Point, wrap
from vcan_tests.daemon.reflectors import MARKS, NOISE_RAD, headings, places, true_bearing


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
