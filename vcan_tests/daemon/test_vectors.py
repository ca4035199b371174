"""The loops against the reference vectors."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest

from daemon.loops.geometry import TurningSolution, clamp, contact_points, solve_turning
from profiles.schema import PairedSteerGeometry
from vcan_tests.daemon import vectors_ackermann, vectors_nxt, vectors_semitrailer, vectors_turtle
from vcan_tests.vectors_loader import read_vectors, vector_paths

Case = dict[str, Any]

LEFT_OUT: Final[frozenset[str]] = frozenset()
"""Kinds whose loops do not exist."""


def max2d(contact_lead_m: float) -> PairedSteerGeometry:
    return PairedSteerGeometry(
        mass_kg=28,
        wheelbase_m=0.45,
        pivot_track_m=0.32,
        contact_offset_m=0.075,
        contact_lead_m=contact_lead_m,
        max_heading_deg=88,
        wheels=("rear_right", "rear_left", "front_left", "front_right"),
        encoders=("rear", "front"),
        brakes=("rear", "front"),
        yaw_inertia_kg_m2=0.98,
    )


def near(expected: Any, relative: float, absolute: float = 1e-9) -> Any:
    return pytest.approx(expected, rel=relative, abs=absolute)


def check_parallel(case: Case) -> None:
    given, expected = case["input"], case["output"]
    heading = clamp(math.radians(given["al_deg"]), 1.5)
    geometry = max2d(contact_lead_m=0.01)
    start = contact_points(geometry, heading, heading)
    motion = solve_turning(geometry, heading, heading, given["v"])
    assert motion.parallel
    way = motion.roll_speed_m_s[0] * given["t"]
    dx, dy = way * math.cos(motion.wheel_direction_rad[0]), way * math.sin(motion.wheel_direction_rad[0])
    assert heading == near(expected["al"], 0)
    assert [list(point) for point in start] == [near(point, 0) for point in expected["wheels0"]]
    assert [[x + dx, y + dy] for x, y in start] == [near(point, 0) for point in expected["wheels_end"]]
    assert [dx, dy] == near(expected["center_end"], 0)


def check_turning(case: Case) -> None:
    given, expected = case["input"], case["output"]
    rear, front = given["alpha12"], -given["alpha34"]
    motion = solve_turning(max2d(contact_lead_m=0.005), rear, front, given["v"])
    relative = 1e-5 if 0 < abs(math.sin(rear - front)) < 0.01 else 1e-6
    assert list(motion.heading_rad) == near(expected["heading"], relative)
    assert [list(point) for point in motion.contact_m] == [near(point, relative) for point in expected["wheels"]]
    assert motion.parallel == expected["parallel"]
    assert motion.yaw_rate_rad_s == near(expected["omega"], relative)
    assert list(motion.wheel_speed_m_s) == near(expected["wheel_speed"], relative)
    assert list(motion.roll_speed_m_s) == near(expected["v_roll"], relative)
    assert list(motion.lateral_speed_m_s) == near(expected["v_lat"], relative)
    assert [math.degrees(angle) for angle in motion.mismatch_rad] == near(expected["mismatch_deg"], 0, 1e-4)
    for direction, wanted in zip(motion.wheel_direction_rad, expected["wheel_dir"], strict=True):
        assert math.remainder(direction - wanted, math.tau) == near(0, 0, relative)
    if motion.icr_m is None:
        assert expected["ICR"] is expected["ICR_left"] is expected["ICR_right"] is expected["R_center"] is None
        return
    for own, name in ((motion.icr_right_m, "ICR_right"), (motion.icr_left_m, "ICR_left"), (motion.icr_m, "ICR")):
        assert own == near(tuple(expected[name]), relative)
    assert motion.centre_radius_m == near(expected["R_center"], relative)
    assert motion.published_radius_m == near(expected["R_listing"], relative)
    check_published_program(motion, given["v"], case["listing"], relative)


def check_published_program(motion: TurningSolution, speed: float, printed: Case, relative: float) -> None:
    """The thesis' program ``turning``: centre 0.1625 m beside that of the right wheels, omega unsigned."""
    assert motion.icr_right_m is not None
    centre = (motion.icr_right_m[0], motion.icr_right_m[1] + 0.1625)
    radii = [math.dist(centre, point) for point in motion.contact_m]
    rate = speed / motion.published_radius_m
    assert centre == near(tuple(printed["ICR"]), relative)
    assert motion.published_radius_m == near(printed["R"], relative)
    assert rate == near(printed["omega_unsigned"], relative)
    assert radii == near(printed["wheel_radii"], relative)
    assert [rate * radius for radius in radii] == near(printed["wheel_speeds"], relative)


CHECKS: Final[dict[str, Callable[[Case], None]]] = {
    **vectors_nxt.CHECKS,
    **vectors_ackermann.CHECKS,
    **vectors_semitrailer.CHECKS,
    **vectors_turtle.CHECKS,
    "seed001_parallel": check_parallel,
    "seed001_turning": check_turning,
}


PATHS: Final = vector_paths()


@pytest.mark.parametrize("path", PATHS, ids=[path.name for path in PATHS])
def test_every_file_is_of_a_known_kind(path: Path) -> None:
    kind = read_vectors(path).kind
    assert kind in CHECKS.keys() | LEFT_OUT, f"{path}: unknown kind {kind!r}"


@pytest.mark.parametrize("kind", CHECKS)
def test_the_loops_agree_with_the_vectors(kind: str) -> None:
    files = [file for file in map(read_vectors, PATHS) if file.kind == kind]
    assert files, f"no vectors of kind {kind}"
    for file in files:
        for number, case in enumerate(file.cases):
            try:
                CHECKS[kind](case)
            except AssertionError as difference:
                pytest.fail(f"{file.path}, case {number} {case['input']}: {difference}")


def test_kinds_without_a_loop_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    files = [read_vectors(path) for path in PATHS]
    left_out = [file for file in files if file.kind in LEFT_OUT]
    verified = sum(len(file.cases) for file in files if file.kind in CHECKS)
    with capsys.disabled():
        print(f"\nvectors: {verified} cases checked; {sum(len(f.cases) for f in left_out)} left out, no such loop yet:")
        for file in left_out:
            print(f"  left out: {file.kind} ({len(file.cases)} cases)")
    assert verified == sum(len(file.cases) for file in files) - sum(len(file.cases) for file in left_out)


def test_a_kind_is_either_checked_or_left_out() -> None:
    assert not CHECKS.keys() & LEFT_OUT


def test_a_second_folder_is_read_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    extra = {"kind": "seed009_new", "schema": {}, "cases": [{"input": {}, "output": {}}]}
    (tmp_path / "extra.json").write_text(json.dumps(extra))
    monkeypatch.setenv("CANHELM_VECTORS", str(tmp_path))
    assert read_vectors(vector_paths()[-1]).kind == "seed009_new"


def test_an_empty_second_folder_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CANHELM_VECTORS", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="CANHELM_VECTORS"):
        vector_paths()


def test_a_file_without_a_kind_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(ValueError, match="no kind"):
        read_vectors(tmp_path / "bad.json")
