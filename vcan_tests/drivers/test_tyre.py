from __future__ import annotations

from math import atan, hypot, tan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.simulated.tyre import Contact
from profiles.schema import Tyre

TYRE = Tyre(friction=0.8, slip_stiffness=12.0, cornering_stiffness_per_rad=10.0, relaxation_length_m=0.03)
LOAD_N = 70.0
DT_S = 0.001

speeds = st.floats(-3.0, 3.0)


def rolled(rim_m_s: float, roll_m_s: float, lateral_m_s: float, time_s: float) -> Contact:
    contact = Contact(TYRE)
    for _ in range(round(time_s / DT_S)):
        contact.deform(rim_m_s, roll_m_s, lateral_m_s, LOAD_N, DT_S)
    return contact


def test_a_wheel_that_rolls_freely_feels_no_force() -> None:
    contact = rolled(1.0, 1.0, 0.0, 0.5)
    assert (contact.force_x_n, contact.force_y_n) == (0.0, 0.0)


def test_small_slip_makes_a_force_by_the_slip_stiffness() -> None:
    contact = rolled(1.0, 1.0 - 1e-4, 0.0, 1.0)
    assert contact.force_x_n == pytest.approx(12.0 * 1e-4 * LOAD_N, rel=1e-3)


def test_a_small_slip_angle_makes_a_force_by_the_cornering_stiffness() -> None:
    contact = rolled(1.0, 1.0, tan(1e-4), 1.0)
    assert contact.force_y_n == pytest.approx(-10.0 * 1e-4 * LOAD_N, rel=1e-3)


def test_large_slip_gives_exactly_friction_against_the_sliding() -> None:
    contact = rolled(2.0, 0.5, 0.0, 1.0)
    assert contact.force_x_n == pytest.approx(0.8 * LOAD_N)


def test_a_locked_wheel_slides_against_its_motion_in_both_directions() -> None:
    contact = rolled(0.0, 0.3, 0.4, 1.0)
    assert (contact.force_x_n, contact.force_y_n) == pytest.approx((-0.6 * 0.8 * LOAD_N, -0.8 * 0.8 * LOAD_N))


def test_spinning_leaves_little_lateral_force() -> None:
    pure = rolled(0.5, 0.5, 0.1, 1.0)
    spinning = rolled(2.0, 0.5, 0.1, 1.0)
    assert abs(spinning.force_y_n) < 0.3 * abs(pure.force_y_n)


def test_lateral_force_builds_up_over_the_relaxation_length() -> None:
    slow, steady = rolled(1.0, 1.0, 1e-4, 0.03), rolled(1.0, 1.0, 1e-4, 1.0)
    assert slow.force_y_n / steady.force_y_n == pytest.approx(1.0 - 0.3679, abs=0.1)


def test_a_standing_tyre_is_a_spring_that_holds() -> None:
    contact = rolled(0.0, 0.01, 0.0, 0.05)
    for _ in range(5000):
        contact.deform(0.0, 0.0, 0.0, LOAD_N, DT_S)
    stiffness = 10.0 * LOAD_N / 0.03
    assert contact.force_x_n == pytest.approx(-stiffness * 0.01 * 0.05, rel=0.1)


@given(st.lists(st.tuples(speeds, speeds, speeds), min_size=1, max_size=60), st.sampled_from([0.00025, 0.001, 0.01]))
def test_the_force_never_exceeds_friction(history: list[tuple[float, float, float]], dt_s: float) -> None:
    contact = Contact(TYRE)
    for rim, roll, lateral in history:
        contact.deform(rim, roll, lateral, LOAD_N, dt_s)
        assert hypot(contact.force_x_n, contact.force_y_n) <= 0.8 * LOAD_N * (1.0 + 1e-9)


@given(st.lists(st.tuples(speeds, speeds), min_size=1, max_size=100))
def test_a_standing_tyre_gives_back_no_more_work_than_it_got(motion: list[tuple[float, float]]) -> None:
    contact = Contact(TYRE)
    work = 0.0
    for roll, lateral in motion:
        contact.deform(0.0, roll, lateral, LOAD_N, DT_S)
        work -= (contact.force_x_n * roll + contact.force_y_n * lateral) * DT_S
        assert work >= -1e-9


@pytest.mark.parametrize(
    ("rim", "roll", "lateral", "ratio", "tangent"),
    [(1.0, 0.8, 0.2, 0.2, 0.25), (0.8, 1.0, -0.1, -0.2, -0.1), (0.01, 0.0, 0.01, 0.2, 0.2)],
)
def test_slip_is_that_of_the_last_step(rim: float, roll: float, lateral: float, ratio: float, tangent: float) -> None:
    contact = rolled(1.0, 0.5, 0.5, 0.01)
    contact.deform(rim, roll, lateral, LOAD_N, DT_S)
    assert (contact.slip_ratio, contact.slip_angle_rad) == pytest.approx((ratio, atan(tangent)))
