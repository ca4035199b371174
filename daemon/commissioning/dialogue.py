"""Who takes part in a commissioning: the robot's daemon, and a person who looks at the robot and answers questions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from canhelm.errors import CanhelmError


class Daemon(Protocol):
    """The robot's daemon; the asyncio client is one."""

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """Call a method of its API. Raises CanhelmError."""


class Person(Protocol):
    """Somebody beside the robot."""

    async def ask(self, question: str) -> str:
        """The answer to a question, without blanks around it. Raises EOFError where nobody is there any more."""

    def tell(self, text: str) -> None:
        """Say something."""


async def agrees(person: Person, question: str) -> bool:
    """Whether the person says yes; asks again where the answer is neither yes nor no."""
    while True:
        answer = (await person.ask(f"{question} [y/n]")).lower()
        if answer in ("y", "yes", "n", "no"):
            return answer.startswith("y")
        person.tell("please answer y or n")


async def number(person: Person, question: str, usual: float, least: float = 0.0, most: float = 1e6) -> float:
    """A number greater than 0, from least to most; the usual one where the answer is empty."""
    while True:
        answer = (await person.ask(f"{question} [{usual:g}]")).replace(",", ".")
        try:
            value = float(answer) if answer else usual
        except ValueError:
            value = 0.0
        if value > 0.0 and least <= value <= most:
            return value
        wanted = f"from {least:g} to {most:g}" if least else "greater than 0"
        person.tell(f"{answer!r} is no number {wanted}")


def told(error: CanhelmError) -> str:
    """An error with what to do about it."""
    return f"{error.message} - {error.remedy}" if error.remedy else error.message


def preview(changes: Mapping[str, tuple[Any, Any]]) -> Sequence[str]:
    """One line a change: what, from what, to what."""
    return [f"  {name}: {'-' if old is None else old} -> {new}" for name, (old, new) in changes.items()]
