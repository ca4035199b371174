"""The Turtle robot's loops against the reference vectors: one check for each kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import pytest

from daemon.loops.omni import OmniKinematics, turtle_wheels
from daemon.loops.published_planner import Branch, PlannedStep, PlanningProblem, PublishedPlanner, Vector
from daemon.loops.published_planner_axis import AxisCase, plan_axis
from daemon.loops.published_traction import PublishedTraction, SafetyFactor, TractionStep
from daemon.loops.slip import AxisSlipDetector
from vcan_tests.daemon.shortest_time import shortest_time

Case = dict[str, Any]

DT: Final = 0.001
EXACT: Final = 1e-9
BRANCH_NAMES: Final = {
    "robot1_unsynced": Branch.UNSYNCHRONISED,
    "unsyncable_only_x_moves": Branch.ONLY_X_MOVES,
    "unsyncable_only_y_moves": Branch.ONLY_Y_MOVES,
}
"""Where the vectors' names differ."""


def exact(expected: Any) -> Any:
    return pytest.approx(expected, rel=0, abs=EXACT)


def check_omni_kinematics(case: Case) -> None:
    given, expected = case["input"], case["output"]
    kinematics = OmniKinematics(turtle_wheels(*given["R"]))
    motion = (given["Vx"], given["Vy"], given["phidot"])
    assert list(kinematics.wheel_speeds(motion)) == exact(expected["w"])
    assert [list(row) for row in kinematics.inverse] == [exact(row) for row in expected["inverse"]]
    assert kinematics.body_motion(expected["w"]) == exact(motion)
    r1, r2, r3 = given["R"]
    w1, w2, w3 = expected["w"]
    printed = (-r2 * w1 + (r3 + r2) * w2 - r2 * w3) / (r1 + r2 + r3)
    assert printed == exact(expected["Vx_if_printed_inverse"])


def check_calculate_time(case: Case) -> None:
    given, expected = case["input"], case["output"]
    numbers = (given["wf"], given["w0dot"], given["wfdot"], given["v_max"], given["a_max"])
    plan, shortest = plan_axis(*numbers), shortest_time(*numbers)
    assert plan.eta_s == exact(expected["ETA"])
    assert plan.acceleration == exact(expected["q"])
    assert plan.case == expected["case"]
    assert shortest == exact(expected["T_optimal"])
    assert plan.eta_s / shortest == exact(expected["ratio"])


def check_planner_calls(case: Case) -> None:
    given, expected = case["input"], case["output"]
    problem = PlanningProblem(
        (given["x_ref"] - given["x"], given["y_ref"] - given["y"]),
        (given["x0dot"], given["y0dot"]),
        (given["xdot_ref"], given["ydot_ref"]),
        given["v_max"],
        given["a_max"],
        keeper=given["robotID"] == 1,
    )
    step = PublishedPlanner().step(problem)
    assert step.branch == BRANCH_NAMES.get(expected["branch"], expected["branch"])
    assert step.acceleration_m_s2 == exact((expected["q_x"], expected["q_y"]))
    assert step.eta_s == exact(expected["ETA"])
    assert step.cases == (expected["case_x"], expected["case_y"])
    assert step.overshoot == (expected["overshootflag_x"], expected["overshootflag_y"])
    assert step.alpha_rad == exact(expected["alpha"])
    assert step.bisections == expected["bisections"]
    assert step.final_velocity_m_s == exact((expected["xfdot_used"], expected["yfdot_used"]))
    assert (step.not_converged > 0) == (expected["nonconverged"] > 0)


@dataclass
class Robot:
    """A plant that follows perfectly, the acceleration held for one step."""

    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0

    def problem(self, given: Case) -> PlanningProblem:
        goal, final = given["goal"], given.get("vf", (0.0, 0.0))
        keeper = given.get("robotID") == 1
        offset, velocity = (goal[0] - self.x, goal[1] - self.y), (self.vx, self.vy)
        return PlanningProblem(offset, velocity, (final[0], final[1]), given["v_max"], given["a_max"], keeper)

    def follow(self, acceleration: Vector) -> None:
        ax, ay = acceleration
        self.x += self.vx * DT + ax * DT * DT / 2
        self.y += self.vy * DT + ay * DT * DT / 2
        self.vx += ax * DT
        self.vy += ay * DT


@dataclass
class Drive:
    """What a simulated drive was like, from its start on."""

    states: list[Robot] = field(default_factory=list)
    steps: list[PlannedStep] = field(default_factory=list)

    def note(self, robot: Robot, step: PlannedStep) -> None:
        self.states.append(Robot(robot.x, robot.y, robot.vx, robot.vy))
        self.steps.append(step)

    def converged(self) -> int:
        """Number of the first call that finds both axes there."""
        return next(n for n, step in enumerate(self.steps) if step.branch is Branch.BOTH_CONVERGED)

    def rest(self) -> int:
        start = self.converged()
        speeds = ((n, max(abs(s.vx), abs(s.vy))) for n, s in enumerate(self.states))
        return next(n for n, speed in speeds if n >= start and speed < 0.0025)


def drive(given: Case, seconds: float) -> Drive:
    """The planner alone."""
    (x, y), (vx, vy) = given["p0"], given["v0"]
    robot, planner, drive = Robot(x, y, vx, vy), PublishedPlanner(), Drive()
    for _ in range(round(seconds / DT)):
        step = planner.step(robot.problem(given))
        drive.note(robot, step)
        robot.follow(step.acceleration_m_s2)
    return drive


def drive_with_slip(given: Case) -> tuple[Drive, list[TractionStep]]:
    """With the traction controller: slip is imposed on the accelerations of an undisturbed run."""
    steps = round(given["T"] / DT)
    reference = [step.acceleration_m_s2 for step in drive({**given, "p0": (0, 0), "v0": (0, 0)}, given["T"]).steps]
    robot, traction, driven = Robot(), PublishedTraction(given["epsilon_slip"], DT), Drive()
    records: list[TractionStep] = []
    for number in range(steps):
        ax, ay = reference[number - 1] if number else (0.0, 0.0)
        factor = imposed_factor(given["error_window"], number)
        record = traction.step(robot.problem(given), (factor * ax, factor * ay), (ax, ay))
        records.append(record)
        driven.note(robot, record.planned)
        robot.follow(record.planned.acceleration_m_s2)
    return driven, records


def imposed_factor(window: Case | None, number: int) -> float:
    if window is None or not round(window["t1"] / DT) <= number < round(window["t2"] / DT):
        return 1.0
    return float(window["factor"])


def check_drive(driven: Drive, given: Case, expected: Case, samples: list[Case]) -> None:
    """A drive against its summary and samples, within the tolerances of their schema."""
    end = driven.converged()
    steps, states = driven.steps[: end + 1], driven.states[: end + 1]
    flags = [max(step.overshoot[axis] for step in steps) for axis in (0, 1)]
    assert driven.steps[0].eta_s == exact(expected["ETA_at_start"])
    assert end * DT == pytest.approx(expected["t_converged"], abs=0.01)
    assert distance(states[-1], given) == pytest.approx(expected["pos_error_at_converged"], abs=0.01)
    for axis, name in enumerate(("max_abs_qx", "max_abs_qy")):
        peak = max(abs(step.acceleration_m_s2[axis]) for step in steps)
        assert peak == pytest.approx(expected[name], rel=0.02, abs=0.05), name
    assert max(abs(complex(*s.acceleration_m_s2)) for s in steps) == pytest.approx(
        expected["max_abs_a"], rel=0.02, abs=0.05
    )
    assert max(abs(complex(s.vx, s.vy)) for s in states) == pytest.approx(expected["max_abs_v"], abs=0.02)
    assert flags == expected["overshootflag_max"]
    for axis, cases in enumerate((expected["cases_x"], expected["cases_y"])):
        assert {step.cases[axis] for step in steps} - {None} == set(cases)
    for sample in samples:
        state = driven.states[round(sample["t"] / DT)]
        assert (state.x, state.y) == pytest.approx((sample["x"], sample["y"]), abs=0.01), sample
        assert (state.vx, state.vy) == pytest.approx((sample["vx"], sample["vy"]), abs=0.02), sample
    if "t_rest" in expected:
        assert driven.rest() * DT == pytest.approx(expected["t_rest"], abs=0.01)
        assert distance(driven.states[-1], given) == pytest.approx(expected["final_pos_error"], abs=0.003)


def distance(state: Robot, given: Case) -> float:
    return abs(complex(given["goal"][0] - state.x, given["goal"][1] - state.y))


def check_trajectory(case: Case) -> None:
    given, expected = case["input"], case["summary"]
    seconds = max(expected.get("t_rest", 0.0), expected["t_converged"], case["samples"][-1]["t"]) + 0.2
    check_drive(drive(given, seconds), given, expected, case["samples"])


def check_traction_simulation(case: Case) -> None:
    given, expected = case["input"], case["summary"]
    driven, records = drive_with_slip(given)
    check_drive(driven, given, expected, case["samples"])
    factors = [record.safety_factor for record in records]
    changes = [(0, factors[0])] + [(n + 1, b) for n, (a, b) in enumerate(pairwise(factors)) if a != b]
    assert len(changes) == len(case["sf_changes"])
    for (number, factor), (time, wanted) in zip(changes, case["sf_changes"], strict=True):
        assert number * DT == pytest.approx(time, abs=0.01)
        assert factor == exact(wanted)
    assert min(factors) == exact(expected["min_sf"])
    check_times(
        [n for n, factor in enumerate(factors) if factor < 1],
        (expected["first_sf_below_1"], expected["last_sf_below_1"]),
    )
    at_top_speed = [n for n, step in enumerate(driven.steps) if step.cases[0] == AxisCase.TOP_SPEED]
    check_times(at_top_speed, expected["case3_x_interval"] or (None, None))
    rearmed = {n - 1 for n, record in enumerate(records) if record.countdown[0] == 5}
    assert (rearmed <= set(at_top_speed)) == expected["roundmaxx5_implies_case3_prev"]


def check_times(numbers: list[int], expected: tuple[float | None, float | None]) -> None:
    """First and last step of a condition; None where it never held."""
    own = (numbers[0] * DT, numbers[-1] * DT) if numbers else (None, None)
    assert own == pytest.approx(tuple(expected), abs=0.01)


def check_slip_detection(case: Case) -> None:
    given, expected = case["input"], case["output"]
    for axis, name in enumerate("xy"):
        detector = AxisSlipDetector(given["epsilon_slip"])
        detector.countdown = given["roundmax0"][axis]
        slips, countdowns = [], []
        accelerations = zip(given["a_meas"], given["a_in"], given[f"case_prev_{name}"], strict=True)
        for measured, commanded, previous in accelerations:
            slips.append(detector.step(measured[axis], commanded[axis], previous))
            countdowns.append(detector.countdown)
        assert slips == expected[f"slip_{name}"]
        assert countdowns == expected[f"roundmax_{name}"]


def check_traction_sequence(case: Case) -> None:
    given, expected = case["input"], case["output"]
    safety = SafetyFactor(given["sf_last0"], given["dif_sf_last0"])
    for slip, factor, change, correction in zip(
        given["slip"], expected["sf"], expected["dif_sf"], expected["ret"], strict=True
    ):
        assert safety.step(bool(slip)) == correction
        assert safety.factor == pytest.approx(factor, rel=0, abs=1e-12)
        assert safety.change == pytest.approx(change, rel=0, abs=1e-12)


CHECKS: Final[dict[str, Callable[[Case], None]]] = {
    "seed000_calculate_time": check_calculate_time,
    "seed000_omni_kinematics": check_omni_kinematics,
    "seed000_planner_calls": check_planner_calls,
    "seed000_slip_detection": check_slip_detection,
    "seed000_traction_sequences": check_traction_sequence,
    "seed000_traction_simulations": check_traction_simulation,
    "seed000_trajectories": check_trajectory,
}
