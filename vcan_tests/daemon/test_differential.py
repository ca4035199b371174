from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daemon.loops.differential import (
    DifferentialDrive,
    Leg,
    Move,
    TachoCompensation,
    arc_move,
    bend,
    limit_speeds,
    line,
    share_power,
    wrap_angle,
)
from daemon.loops.odometry import Pose
from daemon.loops.pose_feedback import (
    REPORT_GAINS,
    SLOW_CYCLE_GAINS,
    AlignedTurns,
    GearPlay,
    GoalSeeker,
    Phase,
    PoseGains,
    SeekSettings,
    Tolerance,
    at_goal,
    polar_law,
    reversed_law,
)

DRIVE = DifferentialDrive(0.028, 0.0585)
SPEED = st.floats(-50, 50)
ORIGIN = Pose()
TIGHT = Tolerance(0.002, 0.002, math.radians(2))


def radians(move: Move) -> tuple[float, float]:
    return math.radians(move.right.angle_deg), math.radians(move.left.angle_deg)


def end(move: Move) -> Pose:
    return DRIVE.moved(Pose(), *radians(move))


def assert_pose(pose: Pose, x_m: float, y_m: float, yaw_rad: float) -> None:
    assert (pose.x_m, pose.y_m, pose.yaw_rad) == pytest.approx((x_m, y_m, yaw_rad), abs=1e-9)


@given(st.floats(-1e6, 1e6))
def test_a_wrapped_angle_points_the_same_way(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(SPEED, SPEED)
def test_inverse_kinematics_undo_the_kinematics(right: float, left: float) -> None:
    assert DRIVE.wheel_speeds(*DRIVE.body_motion(right, left)) == pytest.approx((right, left), abs=1e-9)


@given(st.floats(-20, 20), st.floats(-20, 20))
def test_the_exact_arc_is_what_small_steps_come_to(right: float, left: float) -> None:
    pose, steps = Pose(), 2000
    for _ in range(steps):
        forward, turn = DRIVE.body_motion(right / steps, left / steps)
        heading = pose.yaw_rad + turn / 2
        pose = Pose(pose.x_m + forward * math.cos(heading), pose.y_m + forward * math.sin(heading), pose.yaw_rad + turn)
    arc = DRIVE.moved(Pose(), right, left)
    assert (arc.x_m, arc.y_m, arc.yaw_rad) == pytest.approx((pose.x_m, pose.y_m, pose.yaw_rad), abs=1e-5)


@given(SPEED, SPEED)
def test_shared_power_keeps_ratio_and_direction(right: float, left: float) -> None:
    shared = share_power(right, left, 40)
    assert max(map(abs, shared)) == pytest.approx(40 if right or left else 0)
    assert shared[0] * left == pytest.approx(shared[1] * right, abs=1e-9)
    assert shared[0] * right >= 0
    assert shared[1] * left >= 0


def test_speeds_within_the_limit_stay_as_they_are() -> None:
    assert limit_speeds(3.0, -4.0, 5.0) == (3.0, -4.0)
    assert limit_speeds(3.0, -6.0, 3.0) == (1.5, -3.0)


@pytest.mark.parametrize(
    ("distance", "power", "x"), [(0.5, 40, 0.5), (-0.5, 40, -0.5), (0.5, -40, -0.5), (-0.5, -40, 0.5)]
)
def test_a_line_goes_where_its_signs_say(distance: float, power: float, x: float) -> None:
    move = line(DRIVE, distance, power)
    assert_pose(end(move), x, 0.0, 0.0)
    assert move.right.power == move.left.power == math.copysign(40, x)


def test_a_bend_to_the_left_ends_left_of_its_start() -> None:
    assert_pose(end(bend(DRIVE, 0.2, math.pi / 2, 40, clockwise=False)), 0.2, 0.2, math.pi / 2)


def test_a_bend_to_the_right_ends_right_of_its_start() -> None:
    assert_pose(end(bend(DRIVE, 0.2, math.pi / 2, 40, clockwise=True)), 0.2, -0.2, -math.pi / 2)


def test_a_bend_with_negative_power_drives_its_circle_backward() -> None:
    assert_pose(end(bend(DRIVE, 0.2, math.pi / 2, -40, clockwise=False)), -0.2, 0.2, -math.pi / 2)


def test_a_bend_within_the_track_turns_its_inner_wheel_backward() -> None:
    move = bend(DRIVE, 0.03, math.pi / 2, 40, clockwise=False)
    assert move.left.power < 0
    assert move.left.angle_deg < 0


def test_a_bend_about_a_wheel_leaves_it_at_rest() -> None:
    move = bend(DRIVE, DRIVE.half_track_m, math.pi / 2, 40, clockwise=False)
    assert move.left == Leg(0.0, 0.0)


def test_a_bend_of_no_radius_turns_on_the_spot() -> None:
    move = bend(DRIVE, 0.0, math.pi, 40, clockwise=True)
    assert_pose(end(move), 0.0, 0.0, -math.pi)
    assert move.right.power == -move.left.power == -40


def test_both_wheels_of_a_bend_arrive_at_once() -> None:
    move = bend(DRIVE, 0.2, 1.0, 40, clockwise=False)
    assert move.right.angle_deg / move.right.power == pytest.approx(move.left.angle_deg / move.left.power)


def test_nothing_to_do_is_nothing() -> None:
    assert line(DRIVE, 0.0, 0.0) == line(DRIVE, 0.0, 40) == Move(Leg(0.0, 0.0), Leg(0.0, 0.0))


@pytest.mark.parametrize(
    ("forward", "turn", "power", "reason"),
    [
        (0.1, 0.0, 0.0, "never ends"),
        (0.0, 1.0, 0.0, "never ends"),
        (math.inf, 0.0, 1.0, "finite"),
        (1, math.nan, 1, "f"),
    ],
)
def test_a_move_that_makes_no_sense_is_refused(forward: float, turn: float, power: float, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        arc_move(DRIVE, forward, turn, power)


def test_a_negative_radius_is_refused() -> None:
    with pytest.raises(ValueError, match="which way"):
        bend(DRIVE, -0.2, 1.0, 40, clockwise=True)


@pytest.mark.parametrize(("radius", "track"), [(0.0, 0.05), (0.028, -1.0), (math.nan, 0.05)])
def test_a_robot_without_size_is_refused(radius: float, track: float) -> None:
    with pytest.raises(ValueError, match="more than 0"):
        DifferentialDrive(radius, track)


def test_compensation_takes_the_error_off_the_next_move_in_both_directions() -> None:
    compensation, ahead, back = TachoCompensation(), line(DRIVE, 0.1, 40), line(DRIVE, -0.1, 40)
    degrees = ahead.right.angle_deg
    compensation.moved(ahead, (degrees + 30, degrees - 5))
    assert compensation.corrected(ahead).right.angle_deg == pytest.approx(degrees - 30)
    assert compensation.corrected(back).right.angle_deg == pytest.approx(-degrees - 30)
    assert compensation.corrected(back).left.angle_deg == pytest.approx(-degrees + 5)


def test_compensation_turns_back_a_wheel_that_is_already_past_its_end() -> None:
    compensation, short = TachoCompensation(), line(DRIVE, 0.002, 40)
    compensation.moved(short, (100.0, 100.0))
    right = compensation.corrected(short).right
    assert right.power < 0
    assert right.angle_deg < 0


# Feedback


def drive(
    goal: Pose, gains: PoseGains, dt_s: float, settings: SeekSettings | None = None, start: Pose = ORIGIN
) -> tuple[Pose, Phase, float]:
    """Drive an ideal robot; where it ended, how, and after which time."""
    seeker = GoalSeeker(DRIVE, goal, settings or SeekSettings(TIGHT, 20.0, 10.0, gains))
    pose, time_s = start, 0.0
    while not seeker.done:
        right, left = seeker.step(pose, dt_s)
        pose = DRIVE.moved(pose, right * dt_s, left * dt_s)
        time_s += dt_s
    return pose, seeker.phase, time_s


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-10, 10), st.floats(-10, 10), st.booleans())
def test_every_goal_is_reached_whatever_the_angles(x: float, y: float, yaw: float, start: float, reverse: bool) -> None:
    settings = SeekSettings(TIGHT, 60.0, 10.0, SLOW_CYCLE_GAINS, may_reverse=reverse)
    pose, phase, _ = drive(Pose(x, y, yaw), SLOW_CYCLE_GAINS, 0.02, settings, Pose(0.0, 0.0, start))
    assert phase is Phase.REACHED
    assert at_goal(pose, Pose(x, y, yaw), TIGHT)


@pytest.mark.parametrize("goal", [(-0.1, -0.1, math.pi / 2), (0.05, -0.15, math.pi), (-0.2, 0.03, -2.0)])
def test_the_goals_at_which_the_report_never_stops_are_reached(goal: tuple[float, float, float]) -> None:
    settings = SeekSettings(Tolerance(0.005, 0.002, math.pi / 10), 20.0, 100.0, REPORT_GAINS, False, False)
    assert drive(Pose(*goal), REPORT_GAINS, 0.01, settings)[1] is Phase.REACHED


@pytest.mark.parametrize(("dt_s", "phase"), [(0.01, Phase.REACHED), (0.2, Phase.REACHED), (1.0, Phase.TIMED_OUT)])
def test_the_reports_gains_need_a_short_cycle(dt_s: float, phase: Phase) -> None:
    settings = SeekSettings(Tolerance(0.005, 0.002, math.pi / 10), 20.0, 1e3, REPORT_GAINS, False, False)
    assert drive(Pose(0.1, 0.1, math.pi / 2), REPORT_GAINS, dt_s, settings)[1] is phase


def test_the_wheels_keep_their_limit_and_the_arc() -> None:
    settings, goal, pose = SeekSettings(TIGHT, 20.0, 5.0), Pose(1.0, 1.0, 0.0), Pose()
    right, left = GoalSeeker(DRIVE, goal, settings).step(pose, 0.1)
    free = DRIVE.wheel_speeds(*polar_law(pose, goal, settings.gains))
    assert max(abs(right), abs(left)) == pytest.approx(5.0)
    assert right / left == pytest.approx(free[0] / free[1])


def test_a_goal_straight_behind_is_reached_without_turning() -> None:
    pose, phase, _ = drive(Pose(-0.5, 0.0, 0.0), SLOW_CYCLE_GAINS, 0.05)
    assert phase is Phase.REACHED
    assert abs(pose.yaw_rad) < 1e-6


def test_backward_is_forward_for_a_robot_that_looks_the_other_way() -> None:
    forward, yaw_rate = polar_law(Pose(0, 0, math.pi), Pose(-0.3, 0.1, math.pi + 0.2), REPORT_GAINS)
    backward = reversed_law(Pose(), Pose(-0.3, 0.1, 0.2), REPORT_GAINS)
    assert backward == pytest.approx((-forward, yaw_rate))


def test_a_robot_at_its_goal_does_not_move() -> None:
    pose, phase, time_s = drive(Pose(), SLOW_CYCLE_GAINS, 0.1)
    assert (pose, phase) == (Pose(), Phase.REACHED)
    assert time_s < 0.3


def test_what_only_passes_the_goal_has_not_reached_it() -> None:
    seeker = GoalSeeker(DRIVE, Pose(0.1), SeekSettings(TIGHT, 20.0, 10.0))
    assert seeker.step(Pose(0.1), 0.1) == (0.0, 0.0)
    phases = [seeker.phase]
    seeker.step(Pose(0.11), 0.1)
    assert [*phases, seeker.phase] == [Phase.SETTLING, Phase.DRIVING]


def test_after_the_end_the_wheels_stay_at_rest() -> None:
    seeker = GoalSeeker(DRIVE, Pose(1.0), SeekSettings(TIGHT, 1.0, 10.0))
    speeds = [seeker.step(Pose(), 0.5) for _ in range(5)]
    assert seeker.phase is Phase.TIMED_OUT
    assert speeds[2:] == [(0.0, 0.0)] * 3


def test_gains_that_lead_nowhere_are_refused() -> None:
    with pytest.raises(ValueError, match="beta < 0"):
        GoalSeeker(DRIVE, Pose(), SeekSettings(TIGHT, 1.0, 1.0, PoseGains(3, 8, 1.5)))


@pytest.mark.parametrize("gains", [REPORT_GAINS, SLOW_CYCLE_GAINS], ids=["report", "slow"])
def test_with_the_published_gains_the_robot_never_turns_round(gains: PoseGains) -> None:
    """Strong stability (Siegwart and Nourbakhsh, equation 3.60)."""
    assert gains.stable
    assert gains.alpha + 5 * gains.beta / 3 - 2 * gains.rho / math.pi > 0


def test_a_wheel_follows_its_motor_only_once_the_play_is_used_up() -> None:
    play = GearPlay(0.2)
    assert [play.follow(motor) for motor in (0.05, 0.3, 0.25, 0.11, 0.0)] == pytest.approx([0.0, 0.2, 0.2, 0.2, 0.1])


def test_wheels_that_are_read_one_after_the_other_are_brought_to_one_time() -> None:
    aligned = AlignedTurns()
    assert aligned.align((0.0, 0.0), (0.3, 0.03)) == (0.0, 0.3)
    assert aligned.align((1.0, 0.1), (1.3, 0.13)) == pytest.approx((1.0, 1.0))
