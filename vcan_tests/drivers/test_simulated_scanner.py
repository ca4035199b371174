"""The simulated scanner: what it sees, its noise, and what is hidden from it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from daemon.loops.odometry import Pose
from daemon.loops.path import wrap
from drivers.simulated.scanner import SimulatedScanner
from profiles.localisation import SimulatedScannerConfig
from vcan_tests.daemon.reflectors import MARKS, true_bearing


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
