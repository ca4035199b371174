"""From the pieces of a path file to a path: where pieces begin, cusps, and what is wrong with which piece."""

from __future__ import annotations

import asyncio
import gc
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import CanhelmError, LimitExceeded, UsageError
from daemon.loops.odometry import Pose
from daemon.loops.path import Path
from daemon.runtime.path_building import PIECES_AT_A_TIME, build_path
from profiles.path_file import PathSpec, PieceSpec, StartSpec

LEAD_M = 0.602
HERE = Pose(1.0, 2.0, math.pi / 2)


async def built(*pieces: PieceSpec, start: StartSpec | None = None, here: Pose = HERE, **more: Any) -> Path:
    limits = {"forward_curvature": 2.5, "backward_curvature": 1.5, "run_out_m": 0.4, **more}
    return await build_path(PathSpec(start=start, pieces=list(pieces)), here, lead_m=LEAD_M, **limits)


async def refused(*pieces: PieceSpec) -> CanhelmError:
    with pytest.raises((UsageError, LimitExceeded)) as caught:
        await built(*pieces)
    return caught.value


async def test_a_path_without_a_start_begins_where_the_vehicle_is() -> None:
    path = await built(PieceSpec(line_m=2.0))
    assert path.pieces[0].point(2.0) == pytest.approx((1.0, 4.0))


async def test_a_path_with_a_start_begins_there() -> None:
    path = await built(PieceSpec(line_m=2.0), start=StartSpec(x_m=-1.0, heading_deg=180.0))
    assert path.pieces[0].point(2.0) == pytest.approx((-3.0, 0.0))


async def test_a_gap_before_a_point_is_told_with_its_frame_where_the_file_has_no_start() -> None:
    error = await refused(PieceSpec(line_m=1.0), PieceSpec(from_m=(1.0, 0.0), line_m=1.0))
    assert error.message.endswith("; points count in the frame of `canhelm status`, and the file has no start:")
    assert (error.object, error.remedy) == (
        "pieces[1]",
        "let each piece begin where the last one ends, or add start: to the file",
    )


async def test_a_gap_in_a_file_with_a_start_is_told_without_it() -> None:
    with pytest.raises(UsageError) as caught:
        await built(PieceSpec(line_m=1.0), PieceSpec(from_m=(9.0, 0.0), line_m=1.0), start=StartSpec())
    assert "frame" not in caught.value.message


@given(st.lists(st.tuples(st.floats(0.5, 3.0), st.integers(-170, 170), st.booleans()), min_size=1, max_size=6))
def test_pieces_that_say_nothing_of_their_begin_always_join(ways: list[tuple[float, int, bool]]) -> None:
    pieces = [
        piece
        for length, turn, back in ways
        for piece in (
            PieceSpec(line_m=length, drive="backward" if back else "forward"),
            PieceSpec(arc_deg=float(turn or 1), radius_m=1.0),
        )
    ]
    path = asyncio.run(built(*pieces, run_out_m=0.0))
    assert len(path.pieces) == len(pieces)


async def test_an_arc_turns_the_heading_by_its_angle_whichever_way_it_is_driven() -> None:
    for drive in ("forward", "backward"):
        path = await built(PieceSpec(arc_deg=90.0, radius_m=1.0, drive=drive))
        piece = path.pieces[0]
        assert piece.heading(piece.length_m) - piece.heading(0.0) == pytest.approx(math.pi / 2)
        assert piece.length_m == pytest.approx(math.pi / 2)


async def test_an_arc_may_be_given_by_its_centre() -> None:
    by_radius = await built(PieceSpec(arc_deg=-90.0, radius_m=2.0))
    by_centre = await built(PieceSpec(arc_deg=-90.0, centre_m=(3.0, 2.0)))
    assert by_centre.pieces[0].point(1.0) == pytest.approx(by_radius.pieces[0].point(1.0))


async def test_at_a_cusp_the_path_goes_over_to_the_other_reference_point() -> None:
    path = await built(PieceSpec(line_m=1.0), PieceSpec(line_m=1.0, drive="backward"), here=Pose())
    assert path.sections == [(0, 0), (1, 1)]
    assert path.pieces[1].point(0.0) == pytest.approx((1.0 - LEAD_M, 0.0))
    assert path.pieces[1].point(1.0) == pytest.approx((-LEAD_M, 0.0))


async def test_exchanged_directions_drive_the_same_pieces_the_other_way() -> None:
    path = await built(PieceSpec(line_m=1.0), PieceSpec(line_m=1.0, drive="backward"), here=Pose(), exchanged=True)
    assert [piece.backward for piece in path.pieces] == [True, False]
    assert path.pieces[0].point(1.0) == pytest.approx((-1.0, 0.0))


async def test_waypoints_are_joined_from_where_the_path_is() -> None:
    path = await built(
        PieceSpec(waypoints_m=[(2.0, 0.0), (2.0, 2.0)], radius_m=0.5), PieceSpec(line_m=1.0), here=Pose()
    )
    assert path.pieces[-1].point(1.0) == pytest.approx((2.0, 3.0))


async def test_a_gap_of_ten_centimetres_is_named_with_its_piece() -> None:
    error = await refused(PieceSpec(line_m=1.0), PieceSpec(line_m=1.0, from_m=(1.0, 3.1)))
    assert error.object == "pieces[1]"
    assert "0.100 m beside" in error.message


async def test_a_kink_is_named_with_its_piece() -> None:
    error = await refused(PieceSpec(line_m=1.0), PieceSpec(line_to_m=(3.0, 5.0)))
    assert error.object == "pieces[1]"
    assert "heading jumps" in error.message


async def test_a_radius_that_is_too_small_is_named_with_its_entry_of_the_file() -> None:
    through = PieceSpec(waypoints_m=[(1.0, 5.0), (4.0, 5.0)], radius_m=1.0)
    error = await refused(through, PieceSpec(arc_deg=9.0, radius_m=0.3))
    assert isinstance(error, LimitExceeded)
    assert error.object == "pieces[1]"
    assert error.message.startswith("piece 1 has a radius of 0.300 m")


async def test_a_joint_after_waypoints_is_told_by_the_numbers_of_the_file() -> None:
    through = PieceSpec(waypoints_m=[(1.0, 5.0), (4.0, 5.0)], radius_m=1.0)
    error = await refused(through, PieceSpec(line_m=1.0, from_m=(4.0, 5.1)))
    assert error.message.startswith("piece 1 begins 0.100 m beside the end of piece 0")


async def test_a_leg_that_is_too_short_is_told_with_its_entry_and_its_waypoint() -> None:
    through = PieceSpec(waypoints_m=[(1.0, 4.0), (4.0, 4.0)], radius_m=1.5)
    error = await refused(PieceSpec(line_m=1.0), through)
    assert error.object == "pieces[1]"
    assert error.message.startswith("piece 1: the leg to waypoint [1, 4] is 1.000 m long")


async def test_limits_of_angles_are_told_in_degrees() -> None:
    error = await refused(PieceSpec(line_m=1.0), PieceSpec(line_to_m=(3.0, 5.0)))
    assert (error.limit, error.value) == ("kink_deg 0.5", 45.0)


async def test_a_line_of_a_million_kilometres_is_refused() -> None:
    error = await refused(PieceSpec(line_m=1e9))
    assert (error.object, error.limit) == ("pieces[0]", "length_m 10000")


@pytest.mark.parametrize(
    ("piece", "told"),
    [
        (PieceSpec(arc_deg=90.0), "piece 0: arc_deg 90 has neither radius_m nor centre_m"),
        (PieceSpec(arc_deg=90.0, radius_m=1.0, centre_m=(0.0, 0.0)), "piece 0: arc_deg 90 has both radius_m and"),
        (PieceSpec(waypoints_m=[(0.0, 5.0)]), "piece 0: waypoints_m without the radius of their corners"),
        (PieceSpec(line_m=1.0, arc_deg=90.0), "piece 0 has line_m and arc_deg"),
        (PieceSpec(), "piece 0 has none of its kinds"),
    ],
)
async def test_a_piece_that_is_half_told_says_what_is_missing(piece: PieceSpec, told: str) -> None:
    assert (await refused(piece)).message.startswith(told)


async def test_a_section_that_is_too_short_is_named_with_its_last_piece() -> None:
    error = await refused(PieceSpec(line_m=1.0), PieceSpec(line_m=0.2, drive="backward"))
    assert error.object == "pieces[1]"
    assert "too short" in error.message


@pytest.mark.parametrize(
    "piece",
    [
        PieceSpec(),
        PieceSpec(line_m=1.0, arc_deg=90.0),
        PieceSpec(arc_deg=90.0),
        PieceSpec(arc_deg=0.0, radius_m=1.0),
        PieceSpec(arc_deg=90.0, radius_m=1.0, centre_m=(0.0, 0.0)),
        PieceSpec(arc_deg=90.0, centre_m=(1.0, 2.0)),
        PieceSpec(waypoints_m=[(0.0, 5.0)]),
        PieceSpec(line_to_m=(1.0, 2.0)),
    ],
)
async def test_what_is_no_piece_is_refused_by_its_number(piece: PieceSpec) -> None:
    assert (await refused(piece)).object == "pieces[0]"


async def test_two_kinds_in_one_piece_are_refused_by_its_number() -> None:
    assert (await refused(PieceSpec(line_m=1.0), PieceSpec(line_m=1.0, arc_deg=90.0))).object == "pieces[1]"


async def test_an_empty_path_is_refused() -> None:
    assert "empty" in (await refused()).message


async def test_a_long_path_gives_the_collector_of_garbage_nothing_to_look_through() -> None:
    specs = [PieceSpec(line_m=0.01) for _ in range(1000)]
    path = await built(*specs)
    assert not any(map(gc.is_tracked, [*specs, *path.pieces]))


async def test_while_a_long_path_is_built_others_have_their_turn() -> None:
    turns = 0

    async def others() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    busy = asyncio.create_task(others())
    await built(*[PieceSpec(line_m=0.01)] * 10_000)
    busy.cancel()
    assert turns == pytest.approx(10_000 / PIECES_AT_A_TIME, abs=2)
