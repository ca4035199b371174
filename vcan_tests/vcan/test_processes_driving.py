"""The demo's manoeuvres with simulator, daemon and commands in processes of their own."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

import pytest

from daemon.demo import FIGURES, Figure
from vcan_tests.vcan.bench import Bench, bench, patient, words_of
from vcan_tests.vcan.witness import malformed, unrecognised

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

PARALLEL, CIRCLE = (figure for figure in FIGURES if figure.identity in ("4.7", "4.16"))
Way = tuple[float, float, float]
"""Forward and left [m], and how far turned [rad]."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("driving"), patient(cycle_hz=25)) as made:
        yield made


@pytest.fixture(scope="module")
def parallel(robot: Bench) -> Way:
    """How far the robot came in figure 4.7."""
    return driven(robot, PARALLEL)


@pytest.fixture(scope="module")
def circle(robot: Bench) -> Way:
    """How far the robot came in figure 4.16."""
    return driven(robot, CIRCLE)


def driven(robot: Bench, figure: Figure) -> Way:
    """Drive a figure as a person does, with both pairs steered well; how far the robot came."""
    robot.daemon.leave_fault()
    before = pose(robot)
    done = robot.daemon.canhelm(*words_of(figure))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["steering_error_deg"] < 0.2
    return way(before, pose(robot))


def pose(robot: Bench) -> Way:
    """Where the daemon's odometry has the robot: x, y, yaw [m, m, rad]."""
    odometry = robot.daemon.status()["vehicle"]["odometry"]
    return odometry["x_m"], odometry["y_m"], math.radians(odometry["yaw_deg"])


def way(before: Way, after: Way) -> Way:
    """The second pose as seen from the first."""
    dx, dy, yaw = (now - then for now, then in zip(after, before, strict=True))
    cos, sin = math.cos(before[2]), math.sin(before[2])
    return dx * cos + dy * sin, dy * cos - dx * sin, yaw


def test_a_parallel_movement_ends_where_its_figure_does(parallel: Way) -> None:
    published = PARALLEL.published["end_x_m"], PARALLEL.published["end_y_m"], 0.0
    assert parallel == pytest.approx(published, abs=0.06)


def test_a_turn_has_the_radius_of_its_figure(circle: Way) -> None:
    x_m, y_m, yaw_rad = circle
    radius_m = math.hypot(x_m, y_m) / (2.0 * abs(math.sin(yaw_rad / 2.0)))
    assert radius_m == pytest.approx(CIRCLE.published["radius_m"], rel=0.05)


@pytest.mark.usefixtures("parallel", "circle")
def test_tshark_finds_nothing_malformed_in_all_of_that(robot: Bench) -> None:
    assert malformed(robot.wire.log) == ""


@pytest.mark.usefixtures("parallel", "circle")
def test_tshark_takes_every_frame_for_the_service_that_it_is(robot: Bench) -> None:
    assert unrecognised(robot.wire.log) == []
