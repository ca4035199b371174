"""A person at the terminal, asked from a running asyncio loop."""

from __future__ import annotations

import asyncio
import sys

from canhelm.errors import UsageError
from daemon.cli.output import say


class Terminal:
    """Questions on stderr, answers from stdin. Raises UsageError where stdin is no terminal."""

    def __init__(self) -> None:
        if not sys.stdin.isatty():
            raise UsageError("nobody is there to answer", remedy="run it in a terminal, beside the robot")

    async def ask(self, question: str) -> str:
        """The answer, without blanks around it. Raises EOFError where nobody is there any more."""
        print(f"{question} ", end="", file=sys.stderr, flush=True)
        loop = asyncio.get_running_loop()
        typed = asyncio.Event()
        loop.add_reader(sys.stdin, typed.set)
        try:
            await typed.wait()
        finally:
            loop.remove_reader(sys.stdin)
        line = sys.stdin.readline()
        if not line:
            raise EOFError
        return line.strip()

    def tell(self, text: str) -> None:
        """Say something."""
        say(text)
