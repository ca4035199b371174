"""The profile that a daemon runs with, kept for whoever cleans up behind it.

Its file may have been edited since, rightly or wrongly: brakes are on the outputs that the daemon has used.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from profiles.schema import Profile

FILE = "profile.json"


def runtime_folder(environment: Mapping[str, str]) -> Path | None:
    """The folder that the service manager gives a service while it runs (systemd.exec(5), RuntimeDirectory=)."""
    folders = environment.get("RUNTIME_DIRECTORY", "")
    return Path(folders.partition(":")[0]) if folders else None


def keep(profile: Profile, folder: Path) -> None:
    """Write a profile, all of it or nothing. Raises OSError."""
    new = folder / f"{FILE}.new"
    new.write_bytes(msgspec.json.encode(profile))
    new.replace(folder / FILE)


def kept(folder: Path) -> Profile | None:
    """The profile that was kept; None where there is none that can be read."""
    try:
        return msgspec.json.decode((folder / FILE).read_bytes(), type=Profile)
    except (OSError, msgspec.DecodeError, RecursionError):
        return None
