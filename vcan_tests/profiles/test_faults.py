"""Files of faults: what they may say, and that every mistake is told with file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import UsageError
from profiles.faults import KIND_NAMES, KINDS, Fault, load_faults, objections
from profiles.loader import load

MAX2D = load("max2d").profile
EXAMPLES: dict[str, Any] = {
    "cob_id": 0x181,
    "object": "0x1018/2",
    "for_s": 2.0,
    "nth": 3,
    "probability": 0.5,
    "times": 4,
    "delay_s": 0.1,
    "code": 0x4210,
    "value": 7,
    "angle_deg": 12.0,
    "friction": 0.1,
    "jump_s": 3600.0,
    "clients": 3,
}
PARTS = {"drives": "front_left", "encoders": "front", "brakes": "front", "bricks": "nxt"}


def written(tmp_path: Path, text: str) -> Path:
    file = tmp_path / "faults.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def mistakes(tmp_path: Path, text: str) -> str:
    with pytest.raises(UsageError) as caught:
        load_faults(written(tmp_path, text), MAX2D)
    return caught.value.message.replace(str(tmp_path), "")


def values_of(field: str, kind: str) -> Any:
    return PARTS[KINDS[kind].parts[0]] if field == "part" else EXAMPLES[field]


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    """Any fault that makes sense in a robot that has its part."""
    kind = draw(st.sampled_from(KIND_NAMES))
    taken = [field for field in KINDS[kind].takes if draw(st.booleans())]
    fields = {field: values_of(field, kind) for field in (*KINDS[kind].needs, *taken)}
    when: dict[str, Any] = draw(st.sampled_from(({}, {"at_s": 1.5}, {"at_frame": 9})))
    return msgspec.convert({"kind": kind, **fields, **when}, Fault)


@given(faults().filter(lambda fault: fault.kind != "brick_lost"))
def test_a_fault_that_makes_sense_comes_back_from_a_file_as_it_was_written(
    tmp_path_factory: pytest.TempPathFactory, fault: Fault
) -> None:
    text = yaml.safe_dump({"faults": [msgspec.to_builtins(fault)]})
    (placed,) = load_faults(written(tmp_path_factory.mktemp("faults"), text), MAX2D)
    assert placed.fault == fault


@given(faults(), st.sampled_from(sorted(EXAMPLES)))
def test_a_key_that_a_kind_does_not_take_is_an_objection_to_that_key(fault: Fault, field: str) -> None:
    told = {
        objection.field for objection in objections(msgspec.structs.replace(fault, **{field: EXAMPLES[field]}), MAX2D)
    }
    assert (field in told) == (field not in KINDS[fault.kind].fields)


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(), st.lists, max_leaves=8))
def test_a_part_that_is_no_name_is_refused_with_its_line(
    tmp_path_factory: pytest.TempPathFactory, content: Any
) -> None:
    file = written(
        tmp_path_factory.mktemp("faults"), yaml.safe_dump({"faults": [{"kind": "silence", "part": content}]})
    )
    with pytest.raises(UsageError) as caught:
        load_faults(file, MAX2D)
    assert f"{file}:" in caught.value.message


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("faults:\n- kind: loose\n", "/faults.yaml:2: faults[0].kind: is 'loose'; write one of babbling"),
        ("faults:\n- kind: lose\n  node: 3\n", "/faults.yaml:3: faults[0].node: is an unknown key"),
        ("faults:\n- kind: delay\n", "/faults.yaml:2: faults[0].delay_s: is missing: delay needs it"),
        ("faults:\n- kind: lose\n  code: 1\n", "/faults.yaml:3: faults[0].code: means nothing for lose"),
        ("faults:\n- kind: lose\n  probability: 2\n", "/faults.yaml:3: faults[0].probability: is 2"),
        ("faults:\n- kind: silence\n  part: left\n", "/faults.yaml:3: faults[0].part: 'left' is none of the drives"),
        ("faults:\n- kind: brake_stuck\n  part: front_left\n", "none of the brakes; one of"),
        ("faults:\n- kind: lose\n  at_s: 1\n  at_frame: 2\n", "/faults.yaml:4: faults[0].at_frame: and at_s"),
        ("faults:\n- {kind: emcy, part: front, code: 0x10000}\n", "faults[0].code: 0x10000 is no EMCY code"),
        ("faults:\n- {kind: sdo_abort, part: front, object: statusword}\n", "write an object as 0x6041/0"),
        ("faults:\n- {kind: client_flood, clients: 31}\n", "faults[0].for_s: is missing: so many clients keep"),
        ("faults:\n- {kind: clock_jump, jump_s: .nan}\n", "/faults.yaml:2: faults[0].jump_s: is "),
        ("", "/faults.yaml:1: is empty; write faults: with a list of them"),
        ("faults: 3\n", "/faults.yaml:1: faults: is 3; write a list of"),
        ("- kind: lose\n", "/faults.yaml:1: is not a mapping"),
        ("faults: [\n", "/faults.yaml:2: YAML"),
    ],
)
def test_a_mistake_is_told_with_its_line(tmp_path: Path, text: str, told: str) -> None:
    assert told in mistakes(tmp_path, text)


def test_all_mistakes_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    told = mistakes(tmp_path, "faults:\n- kind: delay\n- kind: emcy\n  part: nobody\n")
    assert "has 3 mistakes" in told


def test_a_file_that_is_not_there_is_a_mistake_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read"):
        load_faults(tmp_path / "none.yaml", MAX2D)


def test_every_kind_has_a_part_where_it_needs_one() -> None:
    assert all(kind.parts for kind in KINDS.values() if "part" in kind.fields)
