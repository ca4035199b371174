"""Paths: pieces, joints, checks, waypoints."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import LimitExceeded, UsageError
from daemon.loops.path import Meeting, Path, Piece, Point, arc, check_piece, check_run_out, join_waypoints, line, wrap

CORNER = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)]
pieces = st.builds(
    Piece,
    x_m=st.floats(-5, 5),
    y_m=st.floats(-5, 5),
    direction_rad=st.floats(-3, 3),
    length_m=st.floats(0.1, 3),
    curvature=st.sampled_from([0.0, 1e-6, -0.01, 0.3, -1.0]),
    backward=st.booleans(),
)


@given(pieces, st.floats(0, 3), st.floats(-0.9, 0.9))
def test_a_point_beside_a_piece_is_found_again(piece: Piece, along: float, offset: float) -> None:
    x, y = piece.point(along)
    direction = piece.direction(along)
    found = piece.project(x - offset * math.sin(direction), y + offset * math.cos(direction), along)
    assert found == pytest.approx((along, offset), abs=1e-6)


@given(pieces, st.floats(0, 3))
def test_a_piece_runs_in_its_direction(piece: Piece, along: float) -> None:
    h = 1e-6
    (x0, y0), (x1, y1) = piece.point(along - h), piece.point(along + h)
    assert math.hypot(x1 - x0, y1 - y0) == pytest.approx(2 * h, rel=1e-6)
    assert wrap(math.atan2(y1 - y0, x1 - x0) - piece.direction(along)) == pytest.approx(0, abs=1e-6)


def test_at_the_centre_of_a_circle_the_way_stays_what_it_was() -> None:
    circle = arc((1, 1), 0.5, 0.0, 6.0)
    assert circle.project(1.0, 1.0, 0.7) == pytest.approx((0.7, 0.5))


def test_an_arc_begins_and_ends_where_it_should() -> None:
    quarter = arc((1, 2), 2, -math.pi / 2, -math.pi / 2)
    assert quarter.point(0) == pytest.approx((1, 0))
    assert quarter.point(quarter.length_m) == pytest.approx((-1, 2))
    assert quarter.centre() == pytest.approx((1, 2))


def test_an_empty_path_is_refused() -> None:
    with pytest.raises(UsageError, match="empty"):
        Path([])


def test_a_gap_is_named_with_its_piece() -> None:
    with pytest.raises(UsageError, match=r"piece 1 begins 0\.100 m beside the end of piece 0") as caught:
        Path([line((0, 0), (1, 0)), line((1.1, 0), (2, 0))])
    assert caught.value.object == "piece 1"


def test_a_kink_is_named_with_its_piece() -> None:
    with pytest.raises(UsageError, match=r"heading jumps by 45\.0 degrees at the beginning of piece 1"):
        Path([line((0, 0), (1, 0)), line((1, 0), (2, 1))])


def test_driving_on_backwards_in_the_same_direction_is_a_kink() -> None:
    with pytest.raises(UsageError, match=r"jumps by 180\.0 degrees"):
        Path([line((0, 0), (1, 0)), line((1, 0), (2, 0), backward=True)])


@pytest.mark.parametrize("bad", [Piece(math.nan, 0, 0, 1), Piece(0, 0, 0, math.nan), Piece(0, 0, 0, 1, math.inf)])
def test_numbers_that_are_not_finite_are_refused(bad: Piece) -> None:
    with pytest.raises(UsageError, match="piece 0 has a number that is not finite"):
        Path([bad])


def test_only_the_last_piece_may_be_endless() -> None:
    with pytest.raises(UsageError, match="piece 0 has a number"):
        Path([Piece(0, 0, 0, math.inf), line((1, 0), (2, 0))])


def test_a_piece_without_length_is_refused() -> None:
    with pytest.raises(UsageError, match="piece 0 is 0 m long"):
        Path([line((1, 1), (1, 1))])


def test_a_radius_too_small_is_named_with_its_piece() -> None:
    path = join_waypoints(CORNER, 0.5)
    with pytest.raises(LimitExceeded, match=r"piece 1 has a radius of 0\.500 m, the vehicle needs 0\.800 m forwards"):
        check_piece(1, path.pieces[1], 1.25, 5.0)


def test_a_section_too_short_is_named_with_its_last_piece() -> None:
    path = Path([line((0, 0), (1, 0)), line((1, 0), (0.8, 0), backward=True)])
    with pytest.raises(LimitExceeded, match=r"the end of piece 1 is 0\.200 m") as caught:
        check_run_out(path, 0.425)
    assert caught.value.object == "piece 1"


def test_a_vehicle_without_a_reverse_gear_drives_nothing_backwards() -> None:
    with pytest.raises(LimitExceeded, match="piece 3 is driven backwards"):
        check_piece(3, line((0, 0), (1, 0), backward=True), 1.0, 0.0)


def test_a_good_path_passes() -> None:
    path = join_waypoints(CORNER, 1.0)
    for number, piece in enumerate(path.pieces):
        check_piece(number, piece, 1.0, 1.0)
    check_run_out(path, 0.425)


def test_waypoints_give_lines_and_rounded_corners() -> None:
    path = join_waypoints(CORNER, 0.5)
    assert [round(piece.length_m, 6) for piece in path.pieces] == [1.5, round(math.pi / 4, 6), 1.5]
    assert path.pieces[1].curvature == 2.0
    assert path.pieces[2].point(1.5) == pytest.approx((2, 2))


def test_a_leg_back_along_the_last_one_changes_the_driving_direction() -> None:
    path = join_waypoints([(0, 0), (2, 0), (-1, 0), (-1, 2)], 0.5, lead_m=0.6)
    assert [piece.backward for piece in path.pieces] == [False, True, True, True]
    assert path.sections == [(0, 0), (1, 3)]
    assert path.pieces[1].point(0) == pytest.approx((1.4, 0)), "the trailer's axle is behind the truck's"


def test_forwards_again_begins_at_the_trucks_axle() -> None:
    path = join_waypoints([(0, 0), (-2, 0), (1, 0)], 0.5, backward=True, lead_m=0.6)
    assert path.pieces[1].point(0) == pytest.approx((-1.4, 0))
    assert path.sections == [(0, 0), (1, 1)]


def test_legs_too_short_for_their_corners_are_named() -> None:
    with pytest.raises(
        LimitExceeded, match=r"leg to waypoint \[2, 0\] is 2\.000 m long, its ends need 2\.500 m"
    ) as caught:
        join_waypoints(CORNER, 2.5)
    assert caught.value.object == "waypoint [2, 0]"


def test_corners_that_just_fit_leave_no_line_between_them() -> None:
    path = join_waypoints([(0, 0), (1, 0), (1, 2), (0, 2)], 1.0)
    assert [round(piece.curvature, 9) for piece in path.pieces] == [1.0, 1.0]


def test_the_same_waypoint_twice_is_refused() -> None:
    with pytest.raises(UsageError, match=r"waypoint \[0, 0\] is where the one before it is"):
        join_waypoints([(0, 0), (0, 0)], 1.0)


@pytest.mark.parametrize("points", [[], [(0.0, 0.0)]])
def test_too_few_waypoints_are_refused(points: list[Point]) -> None:
    with pytest.raises(UsageError, match="make no path"):
        join_waypoints(points, 1.0)


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=2, max_size=8), st.floats(0.01, 0.5))
def test_waypoints_give_a_path_or_a_named_refusal(points: list[Point], radius: float) -> None:
    try:
        path = join_waypoints(points, radius)
    except (UsageError, LimitExceeded) as refusal:
        named = str(refusal.object)
    else:
        named = ""
    if named:
        assert named.startswith("waypoint")
        return
    last = path.pieces[-1]
    assert path.pieces[0].point(0) == pytest.approx(points[0], abs=1e-6)
    assert last.point(last.length_m) == pytest.approx(points[-1], abs=1e-6)


def test_the_meeting_point_goes_from_piece_to_piece() -> None:
    path = join_waypoints(CORNER, 0.5)
    meeting = Meeting(0, 0.0, 0.0)
    at = [path.meet(0, meeting, x, y) for x, y in ((1.0, 0.1), (1.9, 0.1), (2.1, 1.0))]
    assert [point.piece for point in at] == [0, 1, 2]
    assert at[0] == pytest.approx((0, 1.0, 0.1))
    assert at[2] == pytest.approx((2, 0.5, -0.1))


def test_the_meeting_point_stays_in_its_section() -> None:
    path = Path([line((0, 0), (1, 0)), line((1, 0), (-2, 0), backward=True)])
    meeting = path.meet(0, Meeting(0, 0.5, 0.0), 1.2, 0.0)
    assert meeting.piece == 0
    assert path.remaining(0, meeting.piece, meeting.along_m) == pytest.approx(-0.2)


def test_looking_ahead_goes_over_joints_and_beyond_the_sections_end() -> None:
    path = Path([line((0, 0), (1, 0)), line((1, 0), (2, 0)), line((2, 0), (-2, 0), backward=True)])
    for along in (0.3, 1.4, 2.7):
        piece, way = path.ahead(0, 0, along)
        assert piece.point(way) == pytest.approx((along, 0.0))
    piece, way = path.ahead(1, 2, 0.5)
    assert piece.point(way) == pytest.approx((1.5, 0.0))


def test_a_path_of_a_hundred_thousand_pieces_is_an_ordinary_one() -> None:
    path = Path([line((n * 0.01, 0), (n * 0.01 + 0.01, 0)) for n in range(100_000)])
    check_run_out(path, 0.425)
    assert path.section_length(0) == pytest.approx(1000)
    piece, way = path.ahead(0, 50_000, 0.425)
    assert piece.point(way) == pytest.approx((500.425, 0))
