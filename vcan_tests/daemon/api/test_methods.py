"""The table of methods, and what requests it lets through."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import UsageError
from daemon.api.methods import METHODS
from daemon.api.parameters import MAX_NESTING, validate

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


def refusal(method: str, **params: Any) -> UsageError:
    with pytest.raises(UsageError) as caught:
        validate(METHODS[method], params)
    return caught.value


def test_defaults_are_filled_in() -> None:
    assert validate(METHODS["steer"], {"pair": "front", "angle_deg": -30})["wait"] is True


@pytest.mark.parametrize("node", [0, 128, 200, -1, 1.0, True, "", [1], 10**400])
def test_what_is_no_node_is_refused(node: Any) -> None:
    assert refusal("motor.enable", node=node).object == "node"


@pytest.mark.parametrize("node", [1, 127, "front_left"])
def test_ids_and_names_are_nodes(node: Any) -> None:
    assert validate(METHODS["motor.enable"], {"node": node}) == {"node": node}


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), "1", True, 10**400])
def test_what_is_no_finite_number_is_refused(speed: Any) -> None:
    assert refusal("drive.set", direction_deg=0, speed_m_s=speed).object == "speed_m_s"


def test_a_value_out_of_range_is_refused_with_the_range() -> None:
    assert refusal("drive.set", direction_deg=0, speed_m_s=0.1, valid_for_ms=5000).limit == "20 to 1000 ms"


def test_a_range_without_an_upper_end_is_told_by_its_lower_one() -> None:
    error = refusal("drive.path", path={}, speed_m_s=-1)
    assert (error.limit, error.remedy) == ("at least 0.001 m/s", "give at least 0.001 m/s")


@pytest.mark.parametrize(("depth", "fits"), [(1, True), (MAX_NESTING, True), (MAX_NESTING + 1, False), (900, False)])
def test_lists_in_lists_are_taken_to_a_depth_that_is_told(depth: int, fits: bool) -> None:
    pieces: list[Any] = []
    for _ in range(depth - 1):
        pieces = [pieces]
    if fits:
        assert validate(METHODS["path.add"], {"pieces": pieces})["pieces"] == pieces
        return
    with pytest.raises(UsageError, match=f"is not a list, {MAX_NESTING} deep at most"):
        validate(METHODS["path.add"], {"pieces": pieces})


def test_an_unknown_parameter_is_refused_with_those_that_there_are() -> None:
    assert "pair" in str(refusal("brake.engage", pairs="front").remedy)


def test_a_missing_parameter_is_named() -> None:
    assert refusal("steer", pair="front").object == "angle_deg"


def test_a_word_that_is_no_choice_is_refused_with_the_choices() -> None:
    assert "reset-comm" in str(refusal("nmt", command="explode", node=1).remedy)


@pytest.mark.parametrize("params", [{}, {"velocity_rpm": 1.0, "wheel_speed_m_s": 1.0}])
def test_a_velocity_is_given_exactly_once(params: dict[str, Any]) -> None:
    assert refusal("motor.velocity", node=1, **params).object == "velocity_rpm"


@given(st.sampled_from(sorted(METHODS)), st.data())
def test_whatever_is_asked_is_checked_or_refused_as_usage(name: str, data: st.DataObject) -> None:
    known = [param.name for param in METHODS[name].params]
    keys = st.sampled_from(known) if known else st.text()
    params = data.draw(st.dictionaries(keys | st.text(max_size=3), JSON, max_size=5))
    try:
        checked = validate(METHODS[name], params)
    except UsageError:
        return
    assert set(checked) == set(known)


def test_whatever_can_be_handed_over_is_a_motion_with_a_lease() -> None:
    waiting = {name for name, method in METHODS.items() if any(param.name == "wait" for param in method.params)}
    assert waiting == {name for name, method in METHODS.items() if method.needs_lease} - {"drive.set", "setup.begin"}
