"""The profile that a running daemon uses, where it is one that may be changed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from canhelm.errors import ConfigError, NotReady

if TYPE_CHECKING:
    from profiles.loader import LoadedProfile
    from profiles.schema import Profile


SHIPPED = Path(__file__).resolve().parents[2] / "profiles"
"""As in ``profiles.loader``, which a look at the status need not load."""


def is_own(file: str | None) -> bool:
    """Whether a profile's file is somebody's own, not a shipped one."""
    return file is not None and not Path(file).is_relative_to(SHIPPED)


def own_profile(status: dict[str, Any]) -> LoadedProfile:
    """The profile of a robot, from its file.

    Args:
        status: of its daemon.

    Raises:
        ConfigError: it has none of its own, or the file says something else by now.
        NotReady: a node is not ready.
    """
    from profiles.loader import load

    file = status["profile_file"]
    if not is_own(file):
        remedy = "begin one: `canhelm profile new NAME --extends max2d --out NAME.yaml`, and run the daemon with it"
        raise ConfigError("this robot has no profile of its own that could be changed", value=file, remedy=remedy)
    loaded = load(file)
    if _nodes(loaded.profile) != {node["name"]: node["node"] for node in status["nodes"] if node.get("node")}:
        raise ConfigError(f"{file} has changed since the daemon was started", value=file, remedy="start it anew")
    absent = [str(node["status"]) for node in status["nodes"] if node["node_state"] != "ready"]
    if absent:
        raise NotReady("; ".join(absent), remedy="all nodes have to be there: see `canhelm status`")
    return loaded


def _nodes(profile: Profile) -> dict[str, int]:
    drives = {name: drive.node for name, drive in profile.drives.items()}
    return drives | {name: encoder.node for name, encoder in profile.encoders.items()}
