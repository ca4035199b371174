"""The file of tokens: who may read it, and what a token gives."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import ConfigError
from daemon.api.parameters import Role
from daemon.api.tokens import SHORTEST, Tokens, load_tokens

WATCHES, DRIVES = "w" * SHORTEST, "d" * SHORTEST


def written(path: Path, text: str, mode: int = 0o600) -> Path:
    path.write_text(text)
    path.chmod(mode)
    return path


def test_each_token_of_a_file_gives_its_role(tmp_path: Path) -> None:
    tokens = load_tokens(written(tmp_path / "tokens", f"watch {WATCHES}\n\n  drive {DRIVES}\n"))
    assert [tokens.role_of(token) for token in (WATCHES, DRIVES)] == [Role.WATCH, Role.DRIVE]


@given(st.text())
def test_nothing_else_gives_a_role(token: str) -> None:
    assert Tokens({WATCHES: Role.WATCH}).role_of(token) is None


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o666])
def test_a_file_that_others_may_use_is_refused(tmp_path: Path, mode: int) -> None:
    path = written(tmp_path / "tokens", f"watch {WATCHES}\n", mode)
    with pytest.raises(ConfigError, match="others than its owner") as caught:
        load_tokens(path)
    assert "chmod 600" in str(caught.value.remedy)


def test_a_file_of_somebody_else_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "tokens", f"watch {WATCHES}\n")
    found = os.stat_result((0o100600, 1, 1, 1, 54_321, 1, 1, 0, 0, 0))
    monkeypatch.setattr(os, "fstat", lambda descriptor: found)
    with pytest.raises(ConfigError, match="belongs to somebody else"):
        load_tokens(path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "has no token"),
        (f"watch {WATCHES}\nboss {DRIVES}\n", ":2: 'boss' is no role"),
        (f"stop {WATCHES}\n", ":1: 'stop' is no role"),
        ("watch short\n", f":1: the token is shorter than {SHORTEST} characters"),
        (f"watch {WATCHES} more\n", ":1: the token is shorter"),
        ("watch\n", ":1: the token is shorter"),
        (f"watch {WATCHES}\ndrive {WATCHES}\n", ":2: a line above gives this token another role"),
        (f"Drive {DRIVES}\n", ":1: no role stands first"),
    ],
)
def test_a_line_that_is_no_token_is_told_with_its_place(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told) as caught:
        load_tokens(written(tmp_path / "tokens", text))
    assert WATCHES not in str(caught.value)


@pytest.mark.parametrize("token", ["5c1e09" * 10, "Zk3-q_8wVxTb1n" * 3, "A" * SHORTEST, "d" * SHORTEST])
@pytest.mark.parametrize("form", ["{}", "{} drive", "drive{}", "{}\tdrive", "drive\t{}", "boss {}", "drive {} {}"])
def test_no_part_of_a_token_is_told(tmp_path: Path, form: str, token: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_tokens(written(tmp_path / "tokens", form.format(token, token)))
    told = str(caught.value).replace(str(tmp_path), "")
    assert not any(token[at : at + 6] in told for at in range(len(token) - 5))


def test_a_file_that_may_not_be_read_is_told_with_who_wants_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path, **options: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(ConfigError, match="Permission denied") as caught:
        load_tokens(tmp_path / "tokens")
    assert f"sudo chown {os.getuid()} {tmp_path}" in str(caught.value.remedy)


def test_a_file_that_is_missing_or_no_text_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file"):
        load_tokens(tmp_path / "none")
    with pytest.raises(ConfigError, match="Is a directory"):
        load_tokens(tmp_path)
    binary = tmp_path / "binary"
    binary.touch(0o600)
    binary.write_bytes(b"\xff\xfe")
    with pytest.raises(ConfigError, match="it is no text"):
        load_tokens(binary)
