"""``canhelm version``."""

from __future__ import annotations

import platform
from importlib import metadata

from canhelm import __version__, protocol
from daemon.cli.output import Json, show

_STANDS_ON = ("python-can", "canopen", "numpy", "pyyaml", "rich", "msgspec", "cyclopts")


def version(*, json: Json = None) -> None:
    """Versions of canhelm, of its API, and of what it stands on.

    Example: `canhelm version --json`
    """
    show(versions(), json=json)


def versions() -> dict[str, str | int]:
    """Versions by name."""
    libraries = {name: metadata.version(name) for name in _STANDS_ON}
    system = {"python": platform.python_version(), "kernel": platform.release(), "machine": platform.machine()}
    return {"canhelm": __version__, "api_version": protocol.API_VERSION, **system, **libraries}
