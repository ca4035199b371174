"""What the parts of ``canhelm demo`` have in common: how figures are driven, printed and drawn."""

from __future__ import annotations

import signal
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from daemon.cli.output import say, show
from daemon.cli.pictures import can_draw, make_folder

if TYPE_CHECKING:
    from rich.table import Table


class Result(Protocol):
    """One driven figure."""

    @property
    def numbers(self) -> dict[str, Any]:
        """What ``--json`` prints."""
        ...


R = TypeVar("R", bound=Result)


@dataclass(frozen=True, slots=True)
class DemoRun:
    """How figures are driven, and what becomes of them.

    Attributes:
        seed: of everything random.
        out: folder for pictures and candump logs, or None.
        json: how to print.
        runner: of the event loop, in real or virtual time.
    """

    seed: int
    out: Path | None
    json: bool | None
    runner: Callable[[Coroutine[Any, Any, Any]], Any]

    def begin(self) -> None:
        """Make the folder; from now on signals end the demo in order. Raises UsageError: it cannot be made."""
        if self.out is not None:
            make_folder(self.out)
        _end_by_signals()

    def drive(
        self,
        figures: Sequence[Callable[[], Coroutine[Any, Any, R]]],
        table: Callable[[list[dict[str, Any]]], Table],
        draw: Callable[[R, Path], Path],
    ) -> int:
        """Drive figures one after the other, print and draw them; the exit code.

        Args:
            figures: each drives one.
            table: of their numbers.
            draw: makes the picture of one in a folder; loads matplotlib.
        """

        async def drive_all() -> list[R]:
            return [await figure() for figure in figures]

        self.show(self.runner(drive_all()), table, draw)
        return 0

    def show(
        self, results: Sequence[R], table: Callable[[list[dict[str, Any]]], Table], draw: Callable[[R, Path], Path]
    ) -> None:
        """Print and draw figures that were driven; arguments as of :meth:`drive`."""
        show([result.numbers for result in results], table, self.json)
        if self.out is not None and can_draw():
            for result in results:
                say(f"picture {draw(result, self.out)}")


def _end_by_signals() -> None:
    """The loop ends the demo in order on SIGINT, which shells ignore for background jobs; other signals become one."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _as_ctrl_c)


def _as_ctrl_c(number: int, _: object) -> None:
    signal.raise_signal(signal.SIGINT)
