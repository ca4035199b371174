"""The page's geometry of paths is that of the loops."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest

from canhelm.errors import CanhelmError
from daemon.loops.odometry import Pose
from daemon.loops.path import MAX_GAP_M, MAX_KINK_RAD, Path, Piece, wrap
from daemon.runtime.path_building import PathBuilder
from profiles.path_file import PieceSpec
from vcan_tests.station.browser import Operator

pytestmark = pytest.mark.station

LEAD_M = 0.602
PATHS = 400
NO_LIMIT = 1e9
BUILD = """async paths => {
    const geometry = await import("/page/path_geometry.js");
    return paths.map(({path, here, lead_m, exchanged, places}) => {
        const built = geometry.build(path, here, {lead_m, exchanged});
        const projected = built.pieces.map(piece => places.map(([x, y]) => geometry.project(piece, x, y, 0)));
        return {...built, projected, points: built.pieces.map(piece => geometry.point(piece, piece.length_m / 3))};
    });
}"""

ARCS = """async paths => {
    const {arcThrough, nextPlace} = await import("/page/path_geometry.js");
    return paths.map(({path, here, lead_m, exchanged, places: [place]}) =>
        arcThrough(nextPlace(path, here, exchanged, {lead_m, exchanged}), ...place));
}"""
"""Tangent to the path that is there, driven forward whichever way the path is."""


def random_piece(dice: random.Random) -> dict[str, Any]:
    """An entry of a path file, good or not."""
    drive = {"drive": dice.choice(("forward", "backward"))} if dice.random() < 0.3 else {}
    kind = dice.choice(("line", "arc", "arc", "waypoints", "line_to", "no kind" if dice.random() < 0.1 else "line"))
    place = [dice.uniform(-4, 4), dice.uniform(-4, 4)]
    body: dict[str, dict[str, Any]] = {
        "line": {"line_m": dice.uniform(0.1, 3)},
        "arc": {"arc_deg": dice.choice((-1, 1)) * dice.uniform(1, 350), "radius_m": dice.uniform(0.3, 3)},
        "waypoints": {"waypoints_m": [place, [place[0] + 3, place[1] + 1]], "radius_m": dice.uniform(0.1, 0.8)},
        "line_to": {"line_to_m": place},
        "no kind": {"line_m": 1.0, "arc_deg": 10.0, "radius_m": 1.0},
    }
    return {**drive, **body[kind]}


def random_case(dice: random.Random) -> dict[str, Any]:
    """A path, where it begins, and places beside it."""
    start = {"x_m": dice.uniform(-3, 3), "y_m": dice.uniform(-3, 3), "heading_deg": dice.uniform(-180, 180)}
    path = {"pieces": [random_piece(dice) for _ in range(dice.randint(1, 4))]}
    here = {"x_m": 0.5, "y_m": -0.25, "heading_deg": 30.0}
    return {
        "path": path if dice.random() < 0.5 else {"start": start, **path},
        "here": here,
        "lead_m": LEAD_M,
        "exchanged": dice.random() < 0.5,
        "places": [[dice.uniform(-5, 5), dice.uniform(-5, 5)] for _ in range(3)],
    }


def built_by_the_loops(case: dict[str, Any]) -> Path | None:
    """The path by the daemon's code; None where it refuses it."""
    begin = case["path"].get("start", case["here"])
    pose = Pose(begin["x_m"], begin["y_m"], math.radians(begin["heading_deg"]))
    builder = PathBuilder(pose, case["lead_m"], case["exchanged"], NO_LIMIT, NO_LIMIT)
    try:
        for piece in case["path"]["pieces"]:
            builder.add(PieceSpec(**piece))
        return builder.finished(0.0)
    except CanhelmError:
        return None


def refused(shown: dict[str, Any]) -> bool:
    """Whether the page would refuse the path."""
    return shown["broken"] is not None or shown["gap_m"] > MAX_GAP_M or shown["kink_rad"] > MAX_KINK_RAD


def assert_alike(theirs: dict[str, Any], ours: Piece) -> None:
    """A piece of the page and one of the loops are the same."""
    for name in ("x_m", "y_m", "length_m", "curvature"):
        assert theirs[name] == pytest.approx(getattr(ours, name), rel=1e-9, abs=1e-9), name
    assert wrap(theirs["direction_rad"] - ours.direction_rad) == pytest.approx(0.0, abs=1e-9)
    assert theirs["backward"] == ours.backward


@pytest.fixture(scope="module")
def cases() -> list[dict[str, Any]]:
    dice = random.Random(20)
    return [random_case(dice) for _ in range(PATHS)]


def test_the_random_paths_are_of_both_kinds(cases: list[dict[str, Any]]) -> None:
    good = sum(built_by_the_loops(case) is not None for case in cases)
    assert PATHS / 5 < good < PATHS * 4 / 5


def test_the_page_builds_and_refuses_the_same_paths_as_the_loops(
    operator: Operator, cases: list[dict[str, Any]]
) -> None:
    for case, shown in zip(cases, operator.page.evaluate(BUILD, cases), strict=True):
        path = built_by_the_loops(case)
        assert refused(shown) == (path is None), case
        for theirs, ours in zip(shown["pieces"], path.pieces if path else (), strict=path is not None):
            assert_alike(theirs, ours)


def test_the_page_projects_places_as_the_loops_do(operator: Operator, cases: list[dict[str, Any]]) -> None:
    for case, shown in zip(cases, operator.page.evaluate(BUILD, cases), strict=True):
        path = built_by_the_loops(case)
        for piece, point, found in zip(path.pieces if path else (), shown["points"], shown["projected"], strict=False):
            assert point == pytest.approx(piece.point(piece.length_m / 3), abs=1e-9)
            for place, (along, offset) in zip(case["places"], found, strict=True):
                assert (along, offset) == pytest.approx(piece.project(*place), abs=1e-8)


def test_an_arc_that_is_added_ends_where_the_map_was_clicked(operator: Operator, cases: list[dict[str, Any]]) -> None:
    good = [case for case in cases if built_by_the_loops(case) is not None]
    arcs = operator.page.evaluate(ARCS, good)
    assert sum(arc is not None for arc in arcs) > len(good) / 2
    for case, arc in zip(good, arcs, strict=True):
        if arc is None:
            continue
        drive = {"drive": "backward" if case["exchanged"] else "forward"}
        longer = {**case["path"], "pieces": [*case["path"]["pieces"], {**drive, **arc}]}
        path = built_by_the_loops({**case, "path": longer})
        assert path is not None
        last = path.pieces[-1]
        assert last.point(last.length_m) == pytest.approx(case["places"][0], abs=1e-6)
