"""Values that a machine writes into a robot's profile: the side file ``NAME.calibration.yaml``, merged last."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import yaml

from canhelm.errors import ConfigError
from profiles.loader import CALIBRATION, load
from profiles.plain_yaml import read_plain
from profiles.sensors import AngleCalibration

_HEAD = "# Written by canhelm; merged last into the profile beside it. A person's file stays as it is.\n"


def write_calibration(profile: Path, encoder: str, calibration: AngleCalibration) -> Path:
    """Put an encoder's calibration into the side file of a profile; what else stands there stays.

    Args:
        profile: the robot's own file.
        encoder: name in the profile.
        calibration: of the encoder.

    Returns:
        The side file.

    Raises:
        ConfigError: the side file cannot be read or written.
    """
    return write_values(profile, {("encoders", encoder, "calibration"): _plain(calibration)})


def write_values(profile: Path, values: Mapping[tuple[str, ...], Any]) -> Path:
    """Put values into the side file of a profile; what else stands there stays.

    Args:
        profile: the robot's own file.
        values: by their keys from the root, as ``("drives", "rear_left", "direction")``.

    Returns:
        The side file.

    Raises:
        ConfigError: the side file cannot be read or written, or the profile has mistakes with it; then it stays as it
            was.
    """
    side = profile.with_name(profile.stem + CALIBRATION)
    try:
        before = side.read_bytes() if side.is_file() else None
        merged = read_plain(before.decode()) if before is not None else {}
        if not isinstance(merged, dict | None):
            raise ConfigError(f"{side} is not a mapping", remedy="mend or remove it")
        for keys, value in values.items():
            merged = _with(merged or {}, keys, value)
        _replace(side, (_HEAD + yaml.safe_dump(merged, sort_keys=False)).encode())
        _require_sound(profile, side, before)
    except OSError as error:
        remedy = "use a profile of your own: `canhelm profile new` makes one"
        raise ConfigError(f"cannot write {side}: {error.strerror}", value=str(side), remedy=remedy) from None
    except RecursionError:
        raise ConfigError(f"{side} is nested too deeply", value=str(side), remedy="mend or remove it") from None
    except ValueError as error:
        raise ConfigError(f"cannot read {side}: {error}", value=str(side), remedy="mend or remove it") from None
    return side


def _replace(side: Path, content: bytes) -> None:
    """All of it or nothing. Raises OSError."""
    new = side.with_name(f"{side.name}.new")
    new.write_bytes(content)
    new.replace(side)


def _require_sound(profile: Path, side: Path, before: bytes | None) -> None:
    """Raise ConfigError where the profile has mistakes now, and put the side file back as it was."""
    try:
        load(profile)
    except ConfigError as error:
        if before is None:
            side.unlink()
        else:
            _replace(side, before)
        remedy = f"give {profile} its own values of what is named, that go with the new ones; then write these again"
        message = f"{side} stays as it was: with the new values {error.message}"
        raise ConfigError(message, value=str(side), remedy=remedy) from None


def _plain(calibration: AngleCalibration) -> dict[str, Any]:
    """As YAML takes it, numbers to a ten-thousandth of a degree."""
    values: dict[str, Any] = msgspec.to_builtins(calibration)
    rounded = {key: round(value, 4) if isinstance(value, float) else value for key, value in values.items()}
    return rounded | {"correction_deg": [round(term, 4) for term in calibration.correction_deg]}


def _with(values: dict[str, Any], keys: tuple[str, ...], value: Any) -> dict[str, Any]:
    """The mapping with a value at a path of keys."""
    first, *rest = keys
    inner = values.get(first)
    below = _with(inner if isinstance(inner, dict) else {}, tuple(rest), value) if rest else value
    return {**values, first: below}
