"""The observed bending angle: less noise than its sensor has, and no lag behind the vehicle."""

from __future__ import annotations

import math
import random
import statistics

import pytest

from daemon.campaigns.ideal_semitrailer import SEMITRAILER, SemitrailerPlant
from daemon.loops.bending_observer import JUMP_RAD, BendingObserver

DT_S = 0.01
HITCH = SEMITRAILER.hitches[0]
NOISE_RAD = math.radians(0.1)


def test_the_first_reading_is_believed() -> None:
    assert BendingObserver(HITCH).update(0.3, 0.0, 0.0, DT_S) == 0.3


def test_an_angle_that_jumps_is_believed_at_once() -> None:
    observer = BendingObserver(HITCH)
    observer.update(0.3, 0.0, 0.0, DT_S)
    assert observer.update(0.3 + 2 * JUMP_RAD, 0.0, 0.0, DT_S) == pytest.approx(0.3 + 2 * JUMP_RAD)


def errors_of(noise_rad: float, speed_m_s: float) -> list[float]:
    """Observed minus true angle while an ideal vehicle backs with a bending angle that swings."""
    chance, observer = random.Random(1), BendingObserver(HITCH)
    plant = SemitrailerPlant((0.0, 0.0, 0.0, 0.2), 0.0)
    errors = []
    for cycle in range(600):
        sensed = plant.bending_rad + chance.gauss(0.0, noise_rad)
        curvature = SEMITRAILER.curvature(plant.steering_rad)
        observed = observer.update(sensed, speed_m_s * DT_S if cycle else 0.0, curvature, DT_S)
        errors.append(observed - plant.bending_rad)
        holding = SEMITRAILER.steering(HITCH.holding_curvature(plant.bending_rad))
        plant.advance(speed_m_s, holding + 0.15 * math.cos(3.0 * cycle * DT_S), DT_S)
    return errors[150:]


@pytest.mark.parametrize("speed_m_s", [0.0, -0.2, -0.4])
def test_a_quarter_of_the_noise_is_left_while_the_angle_changes(speed_m_s: float) -> None:
    assert statistics.pstdev(errors_of(NOISE_RAD, speed_m_s)) < 0.3 * NOISE_RAD


def test_it_does_not_lag_behind_the_vehicle() -> None:
    assert max(map(abs, errors_of(0.0, -0.4))) < math.radians(0.05)
