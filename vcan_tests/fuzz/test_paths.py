"""Any path file: it is read and a path is built of it, or what is wrong is told with file and line."""

from __future__ import annotations

import math

from hypothesis import given

from canhelm.errors import CanhelmError
from daemon.loops.odometry import Pose
from daemon.loops.path import Path
from daemon.runtime.clock import run_virtual
from daemon.runtime.path_building import build_path
from profiles.path_file import SHIPPED, PathFile, load_path_file
from vcan_tests.fuzz.files import file_of, read_or_told, require_helpful
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few

NAME = "way.yaml"
CURVATURE = 2.0
"""Tightest bend [1/m], between those of the shipped robots."""
LEAD_M, RUN_OUT_M = 0.44, 0.1
USUAL = (
    *(path.read_bytes() for path in sorted(SHIPPED.glob("*.yaml"))),
    b"start: {x_m: 1, y_m: -2, heading_deg: 90}\npieces:\n"
    b"  - {line_m: 1.5}\n  - {arc_deg: 90, radius_m: 1}\n  - {arc_deg: -45, centre_m: [1, 3]}\n"
    b"  - {waypoints_m: [[1, 1], [4, 1], [4, 5]], radius_m: 0.6}\n  - {line_to_m: [0, 5], drive: backward}\n",
)


def attempt(content: bytes) -> None:
    with file_of(content, NAME) as path:
        file = read_or_told(lambda: load_path_file(path), path)
        if file is not None:
            require_path(file)


def require_path(file: PathFile) -> None:
    """What was read makes a path whose pieces are somewhere, or the first wrong piece is told with its line."""
    try:
        made = run_virtual(built(file))
    except CanhelmError as error:
        require_helpful(file.located(error), file.file)
        return
    assert all(math.isfinite(piece.length_m) and all(map(math.isfinite, piece.point(0.0))) for piece in made.pieces)


async def built(file: PathFile) -> Path:
    return await build_path(
        file.spec,
        Pose(),
        lead_m=LEAD_M,
        forward_curvature=CURVATURE,
        backward_curvature=CURVATURE,
        run_out_m=RUN_OUT_M,
    )


PATH = Target("path", damaged_text(USUAL) | damaged(USUAL), attempt)


@few(150)
@given(PATH.inputs)
def test_a_path_file_makes_a_path_or_is_told_its_mistake(content: bytes) -> None:
    PATH.check(content)
