"""What a person sees while the demo runs: a live table on a terminal, sentences elsewhere; all on stderr."""

from __future__ import annotations

import math
import sys
from types import TracebackType
from typing import TYPE_CHECKING

from daemon.cli.output import console, say

if TYPE_CHECKING:
    from rich.table import Table

    from daemon.app import App

WHEELS = ("1 rear right", "2 rear left", "3 front left", "4 front right")


class DemoView:
    """A live table of the running robot, refreshed now and then.

    Args:
        every: control cycles between two refreshes.
    """

    def __init__(self, every: int) -> None:
        from rich.live import Live

        self._every = every
        self._cycles = 0
        self._live = Live(console=console(stderr=True), auto_refresh=False, transient=True)
        self._shown = sys.stderr.isatty()

    def __enter__(self) -> DemoView:
        if self._shown:
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._shown:
            self._live.stop()

    def tell(self, sentence: str) -> None:
        """A step of the demo."""
        if self._shown:
            self._live.console.print(f"· {sentence}")
        else:
            say(sentence)

    def watch(self, app: App) -> None:
        """Called once a control cycle."""
        self._cycles += 1
        if self._shown and self._cycles % self._every == 0:
            self._live.update(self._table(app), refresh=True)

    def _table(self, app: App) -> Table:
        from rich.table import Table

        supervisor, world = app.supervisor, app.network.world if app.network else None
        phase = next((str(motion.progress().get("phase", "")) for motion in supervisor.motions.values()), "")
        x, y, yaw = world.pose if world else (0.0, 0.0, 0.0)
        caption = f"x {x:+.2f} m  y {y:+.2f} m  yaw {math.degrees(yaw):+.1f}°  bus {app.bus.load():.0%}"
        line = app.bus.details()
        if line:
            busy, ours = line["line_utilisation"], line["own_idle_share"]
            caption += f"\nserial line: {app.cycle.counters.achieved_hz:.1f} cycles/s, busy {busy:.0%}, "
            caption += f"idle on our side {ours:.1%}"
        table = Table(title=f"{supervisor.state.value} {phase}", caption=caption, min_width=70)
        for column in ("wheel", "heading", "commanded", "measured", "current"):
            table.add_column(column, justify="left" if column == "wheel" else "right")
        encoders = app.vehicle.encoders
        for index, (name, drive) in enumerate(zip(WHEELS, app.vehicle.drives, strict=True)):
            table.add_row(
                name,
                f"{math.degrees(encoders[index // 2].heading_rad):+.2f}°",
                f"{supervisor.command.wheel_speed_m_s[index]:+.3f} m/s",
                f"{drive.speed_m_s:+.3f} m/s",
                f"{drive.current_a:+.2f} A",
            )
        return table
