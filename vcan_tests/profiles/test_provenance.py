"""YAML with places: syntax, scalars, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles.provenance import MAX_FILE_BYTES, Mapping, Mistake, Node, Reader, Scalar, dotted, leaves, place_of, plain


def read(tmp_path: Path, content: str | bytes) -> tuple[Node | None, list[str]]:
    """The content's tree, and its mistakes without the folder's name."""
    path = tmp_path / "a.yaml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    mistakes: list[Mistake] = []
    node = Reader(path, mistakes).read()
    return node, [str(mistake).removeprefix(f"{tmp_path}/") for mistake in mistakes]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("-7", -7),
        ("0x1F", 31),
        ("1e-6", 1e-6),
        ("8.5e-6", 8.5e-6),
        (".5", 0.5),
        ("true", True),
        ("~", None),
        ("", None),
        ("on", "on"),
        ("1:30", "1:30"),
        ("2011-09-01", "2011-09-01"),
        ("'1'", "1"),
        ("!assumed 2.0", 2.0),
        ("!assumed '2.0'", "2.0"),
        ("!assumed true", True),
        ("!!float 3", 3.0),
    ],
)
def test_scalars_mean_what_they_look_like(tmp_path: Path, text: str, value: object) -> None:
    node, mistakes = read(tmp_path, f"key: {text}\n")
    assert (plain(node) if node else None, mistakes) == ({"key": value}, [])


@pytest.mark.parametrize("text", ["1e999", "9" * 30, "9" * 5000, "!!int 1.5", "!!bool maybe"])
def test_numbers_out_of_this_world_are_mistakes(tmp_path: Path, text: str) -> None:
    assert read(tmp_path, f"\nkey: {text}\n")[1][0].startswith("a.yaml:2: ")


@pytest.mark.parametrize(
    ("content", "mistake"),
    [
        ("", "a.yaml:1: is empty"),
        ("# nothing\n", "a.yaml:1: is empty"),
        ("a: 1\nb: [1, 2\nc: 3\n", "a.yaml:3: YAML: "),
        ("a: 1\n\tb: 2\n", "a.yaml:2: YAML: a tab stands where spaces belong; indent with spaces"),
        ("a: 1\nb: 010\n", "a.yaml:2: '010' is no int; write it without the zero in front"),
        ("a: &x {b: 1}\nc: *x\n", "a.yaml:2: YAML: aliases are not supported"),
        ("a: 1\n---\nb: 2\n", "a.yaml:2: YAML: but found another document"),
        ("a: 1\nb: 2\na: 3\n", "a.yaml:3: key 'a' stands here twice; remove it (first: line 1)"),
        ("a: 1\n3: 2\n", "a.yaml:2: a key is not a text"),
        ("a: !colour red\n", "a.yaml:1: tag !colour is unknown"),
        ("a: 1\nb: \x07\n", "a.yaml:2: character U+0007 is not allowed"),
        ("a: " + "[" * 200 + "\n", "a.yaml:1: YAML: nested too deeply"),
        (b"a: 1\nb: \xff\n", "a.yaml:2: is not UTF-8 text"),
        (b"#" * (MAX_FILE_BYTES + 1), "a.yaml:1: is larger than 200 kB"),
    ],
)
def test_what_cannot_be_read_is_a_mistake_with_its_line(tmp_path: Path, content: str | bytes, mistake: str) -> None:
    assert read(tmp_path, content)[1][0].startswith(mistake)


def test_a_file_that_the_system_does_not_give_is_a_mistake(tmp_path: Path) -> None:
    mistakes: list[Mistake] = []
    Reader(tmp_path, mistakes).read()
    assert [mistake.what for mistake in mistakes] == ["cannot be read (Is a directory)"]


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    assert read(tmp_path, b"\xef\xbb\xbfa: 1\n")[1] == []


def test_leaves_carry_their_dotted_path_and_place(tmp_path: Path) -> None:
    node, _ = read(tmp_path, "vehicle:\n  wheels: [a, b]\n")
    assert node is not None
    assert [(path, leaf.place.line) for path, leaf in leaves(node)] == [
        ("vehicle.wheels[0]", 2),
        ("vehicle.wheels[1]", 2),
    ]


def test_the_place_of_a_missing_value_is_that_of_what_should_hold_it(tmp_path: Path) -> None:
    node, _ = read(tmp_path, "a: 1\nb:\n  c: 2\n")
    assert node is not None
    assert place_of(node, ("b", "d")).line == 3


def test_a_scalar_outside_any_mapping_is_read_too(tmp_path: Path) -> None:
    node, _ = read(tmp_path, "max2d\n")
    assert isinstance(node, Scalar)


def test_the_kept_one_of_two_equal_keys_is_the_first(tmp_path: Path) -> None:
    node, _ = read(tmp_path, "a: 1\na: 2\n")
    assert isinstance(node, Mapping)
    assert plain(node) == {"a": 1}


def test_a_path_is_written_as_in_programs() -> None:
    assert dotted(("vehicle", "wheels", 2)) == "vehicle.wheels[2]"


@pytest.mark.parametrize("name", ["", " ", " node", "\u00a0", "\x1b[2J"])
def test_a_name_that_would_not_be_seen_is_shown_with_its_codes(name: str) -> None:
    assert dotted(("vehicle", name)) == f"vehicle.{name!a}"
