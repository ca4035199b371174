"""Emergency messages: bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.emcy import parse_emcy


@given(st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(min_size=5, max_size=5))
def test_any_emergency_is_read(code: int, register: int, vendor: bytes) -> None:
    data = code.to_bytes(2, "little") + bytes((register,)) + vendor
    assert parse_emcy(data) == (code, register, vendor)


def test_a_life_guarding_error_is_read() -> None:
    assert parse_emcy(bytes.fromhex("30 81 10 00 00 00 00 00")) == (0x8130, 0x10, bytes(5))


@pytest.mark.parametrize("length", [0, 3, 7, 9])
def test_other_lengths_are_no_emergency(length: int) -> None:
    assert parse_emcy(bytes(length)) is None
