"""Scatter in a record: left where it is harmless, taken out where lines and arcs would follow it."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from daemon.loops.odometry import Pose
from daemon.loops.path import wrap
from daemon.loops.path_fitting import deviation, fit_pieces, split_runs
from daemon.loops.record_smoothing import WIDEST, smoothed
from vcan_tests.daemon.test_path_fitting import chain, driven

WAY = ((2.0, 0.0), (1.5, 0.8), (1.0, 0.0))


def scattered(position_m: float, heading_rad: float) -> list[Pose]:
    chance = random.Random(4)
    poses = [
        Pose(
            pose.x_m + chance.gauss(0, position_m),
            pose.y_m + chance.gauss(0, position_m),
            pose.yaw_rad + chance.gauss(0, heading_rad),
        )
        for pose in driven(chain(*WAY))
    ]
    ((_, indices),) = split_runs(poses)
    return [poses[index] for index in indices]


def test_a_record_without_scatter_stays_as_it_is() -> None:
    poses = driven(chain(*WAY))
    assert smoothed(poses, 0.01) == poses


@pytest.mark.parametrize(("position_m", "heading_deg"), [(0.005, 0.5), (0.003, 1.0)])
def test_a_way_with_scatter_is_fitted_with_few_pieces_that_can_be_driven(position_m: float, heading_deg: float) -> None:
    found = fit_pieces(smoothed(scattered(position_m, math.radians(heading_deg)), 0.01), 0.01)
    assert len(found) <= 10
    assert max(abs(piece.curvature) for piece in found) < 1.5
    assert min(piece.length_m for piece in found) > 0.02


def test_what_is_left_lies_nearer_to_the_way_than_the_record() -> None:
    poses, way = scattered(0.005, math.radians(0.5)), chain(*WAY)
    off = [deviation([pose], way) for pose in smoothed(poses, 0.01)]
    assert math.sqrt(sum(d * d for d in off) / len(off)) < 0.5 * 0.005


def test_headings_that_jump_by_a_whole_turn_are_one_heading() -> None:
    chance = random.Random(1)
    poses = [Pose(-0.02 * i, chance.gauss(0, 0.004), wrap(math.pi + chance.gauss(0, 0.01))) for i in range(60)]
    assert all(abs(wrap(pose.yaw_rad - math.pi)) < 0.02 for pose in smoothed(poses, 0.01))


def test_the_parabolas_are_those_of_numpy() -> None:
    chance = random.Random(2)
    xs = sorted(chance.uniform(0.0, 2.0) for _ in range(81))
    poses = [Pose(x, chance.gauss(0, 0.004)) for x in xs]
    near = slice(40 - WIDEST, 40 + WIDEST + 1)
    fit = np.polyfit(xs[near], [pose.y_m for pose in poses[near]], 2)
    assert smoothed(poses, 0.004)[40].y_m == pytest.approx(np.polyval(fit, xs[40]), abs=1e-12)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4])
def test_records_of_a_few_poses_are_taken_as_they_are_or_smoothed(count: int) -> None:
    assert len(smoothed([Pose(0.1 * i, 0.05 * (-1) ** i) for i in range(count)], 0.001)) == count
