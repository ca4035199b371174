"""Path files: what they say, and their mistakes with file and line."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import LimitExceeded, UsageError
from profiles.path_file import SHIPPED, PathSpec, PieceSpec, load_path_file

numbers = st.floats(-1e6, 1e6)
points = st.tuples(numbers, numbers)
pieces = st.builds(
    PieceSpec,
    line_m=st.none() | st.floats(1e-3, 1e3),
    arc_deg=st.none() | numbers,
    waypoints_m=st.none() | st.lists(points, min_size=1, max_size=3),
    from_m=st.none() | points,
    drive=st.sampled_from([None, "forward", "backward"]),
)


def written(folder: Path, text: str) -> Path:
    file = folder / "way.yaml"
    file.write_text(text)
    return file


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(UsageError) as caught:
        load_path_file(written(folder, text))
    return str(caught.value).removeprefix(f"{folder}/way.yaml:")


@pytest.mark.parametrize("name", sorted(path.stem for path in SHIPPED.glob("*.yaml")))
def test_every_shipped_path_can_be_read_by_its_name(name: str) -> None:
    assert load_path_file(name).spec.pieces


@given(spec=st.lists(pieces, min_size=1, max_size=5))
def test_what_is_written_is_read_again(spec: list[PieceSpec], tmp_path_factory: pytest.TempPathFactory) -> None:
    path = PathSpec(pieces=spec)
    file = tmp_path_factory.mktemp("paths") / "way.yaml"
    file.write_text(json.dumps(msgspec.to_builtins(path)))
    assert load_path_file(file).spec == path


def test_the_lines_of_the_pieces_are_kept(tmp_path: Path) -> None:
    file = written(tmp_path, "# a way\npieces:\n  - {line_m: 1}\n\n  - line_m: 2\n    drive: backward\n")
    assert load_path_file(file).lines == [3, 5]


def test_a_mistake_is_named_with_its_line_and_piece(tmp_path: Path) -> None:
    told = refusal(tmp_path, "pieces:\n  - {line_m: 1}\n  - {line_mm: 2}\n")
    assert told.startswith("3: pieces[1]: has an unknown field line_mm")


@pytest.mark.parametrize("value", ["-1", "0", "text", "[1]", ".nan", "inf", "nan", "1e400", "true", "'1'"])
def test_a_length_is_a_positive_finite_number(tmp_path: Path, value: str) -> None:
    assert refusal(tmp_path, f"pieces: [{{line_m: {value}}}]").startswith("1: pieces[0].line_m")


@pytest.mark.parametrize("value", [".nan", "abc"])
def test_a_length_that_is_no_number_is_told_in_plain_words(tmp_path: Path, value: str) -> None:
    told = refusal(tmp_path, f"pieces: [{{line_m: {value}}}]")
    assert told.startswith("1: pieces[0].line_m: is not a finite number (")


@pytest.mark.parametrize(
    ("text", "line", "key"),
    [
        ("pieces:\n  - {line_m: 1, line_m: 2}\n", 2, "line_m"),
        ("pieces: [{line_m: 1}]\nstart: {x_m: 1}\npieces: [{line_m: 2}]\n", 3, "pieces"),
    ],
)
def test_a_key_that_stands_twice_is_refused_with_its_line(tmp_path: Path, text: str, line: int, key: str) -> None:
    assert refusal(tmp_path, text) == f"{line}: key '{key}' stands here twice (remove one of them)"


@pytest.mark.parametrize("text", ["", "pieces: []", "[]", "pieces:", "start: {x_m: 1}"])
def test_an_empty_path_is_refused(tmp_path: Path, text: str) -> None:
    assert refusal(tmp_path, text).startswith("1: ")


def test_a_file_that_is_a_list_is_not_called_empty(tmp_path: Path) -> None:
    assert refusal(tmp_path, "- {line_m: 1}\n") == "1: is a list, not a mapping (write pieces: above it, and indent it)"


def test_a_driving_direction_that_is_none_is_told_with_those_that_are(tmp_path: Path) -> None:
    told = refusal(tmp_path, "pieces: [{line_m: 1, drive: sideways}]")
    assert told == "1: pieces[0].drive: is 'sideways' (write forward or backward)"


@pytest.mark.parametrize("text", ["a: &a [*a]\npieces: []", "pieces: [" * 50 + "]" * 50, "pieces: [\t", "a: b: c"])
def test_broken_yaml_is_a_mistake_like_others(tmp_path: Path, text: str) -> None:
    assert refusal(tmp_path, text)[0].isdigit()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a: &a [1]\npieces:\n  - *a\n", "3: aliases are not supported"),
        ("pieces: []\n---\npieces: []\n", "2: a second document begins"),
        ("? [1]\n: 2\npieces: []\n", "1: a key is not a text"),
        ("pieces:\n  " + "[" * 200_000, "2: is nested too deeply"),
        ("pieces:\n  " + "- " * 200_000, "2: is nested too deeply"),
    ],
    ids=("alias", "second document", "key", "brackets", "dashes"),
)
def test_what_a_path_has_no_need_of_is_refused_before_it_takes_memory(tmp_path: Path, text: str, told: str) -> None:
    assert refusal(tmp_path, text).startswith(told)


def test_a_file_that_is_not_there_is_told_with_those_that_are_shipped() -> None:
    with pytest.raises(UsageError, match="park-parallel"):
        load_path_file("nowhere")


def test_a_directory_is_told_to_be_one(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is a directory, not a path file"):
        load_path_file(tmp_path)


def test_a_path_is_read_from_a_pipe() -> None:
    reading, writing = os.pipe()
    try:
        with os.fdopen(writing, "w") as pipe:
            pipe.write("pieces: [{line_m: 1.5}]")
        assert load_path_file(f"/dev/fd/{reading}").spec.pieces == [PieceSpec(line_m=1.5)]
    finally:
        os.close(reading)


def test_what_never_ends_is_refused_as_too_large() -> None:
    with pytest.raises(UsageError, match="/dev/zero:1: is larger than 20 MB"):
        load_path_file("/dev/zero")


def test_an_empty_name_is_told_to_be_empty() -> None:
    with pytest.raises(UsageError, match="the name of the path file is empty"):
        load_path_file("")


def test_an_error_about_a_piece_gets_its_file_and_line(tmp_path: Path) -> None:
    file = load_path_file(written(tmp_path, "pieces:\n  - {line_m: 1}\n  - {line_m: 2}\n"))
    told = file.located(LimitExceeded("too tight", object="pieces[1]", limit=2, remedy="widen it"))
    assert (told.message, told.limit, told.remedy) == (f"{file.file}:3: too tight", 2, "widen it")


def test_other_errors_stay_as_they_are(tmp_path: Path) -> None:
    file = load_path_file(written(tmp_path, "pieces: [{line_m: 1}]"))
    for error in (UsageError("no"), UsageError("no", object="pieces[7]"), UsageError("no", object="pieces[0].line_m")):
        assert file.located(error) is error


def test_a_hundred_thousand_pieces_are_read(tmp_path: Path) -> None:
    rows = ["- {line_m: 0.01}", "- {arc_deg: 0.5, radius_m: 1.5}"] * 50_000
    assert len(load_path_file(written(tmp_path, "pieces:\n" + "\n".join(rows))).lines) == 100_000


def test_the_same_structure_goes_over_the_socket() -> None:
    spec = load_path_file("park-parallel").spec
    sent: Any = json.loads(json.dumps(msgspec.to_builtins(spec)))
    assert msgspec.convert(sent, PathSpec) == spec
