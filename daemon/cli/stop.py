"""``canhelm stop``, ``estop`` and ``reset``."""

from __future__ import annotations

from daemon.cli.options import DEFAULT, Options
from daemon.cli.output import show


def stop(*, options: Options = DEFAULT) -> None:
    """Stop everything now, whoever moves it; returns when the robot is at rest.

    Example: `canhelm stop`
    """
    with options.client() as client:
        show(client.call("stop"), json=options.json)


def estop(*, reason: str | None = None, options: Options = DEFAULT) -> None:
    """Emergency stop: quick stop, power stages off, latched until `canhelm reset`.

    Example: `canhelm estop --reason "somebody in the way"`

    Parameters
    ----------
    reason: str
        Why, for those who read the status later.
    """
    with options.client() as client:
        show(client.call("estop", reason=_one_line(reason)), json=options.json)


def _one_line(reason: str | None) -> str | None:
    """A reason as the daemon takes it: one line, not too long."""
    words = "".join(letter if letter.isprintable() else " " for letter in reason or "").split()
    return " ".join(words)[:256] or None


def reset(*, options: Options = DEFAULT) -> None:
    """Clear an emergency stop and the faults of all drives, once their causes are gone.

    Example: `canhelm reset`
    """
    with options.client() as client:
        show(client.call("reset"), json=options.json)
