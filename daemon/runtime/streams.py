"""Values that come again and again (``drive.set``), each good for a while."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from daemon.runtime.clock import outside_s

T = TypeVar("T")
STREAM_END_S = 2.0
"""A stream whose last value has been too old for this long is over."""


class Streamed(Generic[T]):
    """The newest value of a stream.

    Args:
        value: the first one.
        valid_for_s: age at which it is too old.

    Attributes:
        age_s: of the newest value when it was asked for last.
    """

    def __init__(self, value: T, valid_for_s: float) -> None:
        self.age_s = 0.0
        self._value = value
        self.take(value, valid_for_s)

    def take(self, value: T, valid_for_s: float) -> None:
        """A new value; one that equals the last is that same object."""
        self._value = self._value if value == self._value else value
        self._valid_for_s = valid_for_s
        self._taken_s = outside_s()

    def newest(self) -> T | None:
        """The value now; None where it is too old, by the time of who sends it."""
        self.age_s = outside_s() - self._taken_s
        return self._value if self.age_s <= self._valid_for_s else None

    @property
    def over(self) -> bool:
        """Whether no value came for so long that none is expected any more."""
        return self.age_s > self._valid_for_s + STREAM_END_S

    @property
    def age_ms(self) -> int:
        """Age of the newest value, for people."""
        return round(self.age_s * 1e3)


def streamed(value: T, params: dict[str, Any]) -> Streamed[T]:
    """The stream that a ``drive.set`` with these parameters begins."""
    return Streamed(value, valid_for_s(params))


def valid_for_s(params: dict[str, Any]) -> float:
    """How long the value of a ``drive.set`` is good."""
    return float(params["valid_for_ms"]) / 1e3
