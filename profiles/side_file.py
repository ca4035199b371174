"""Values that a machine writes into a robot's profile: the side file ``NAME.calibration.yaml``, merged last."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import yaml

from canhelm.errors import ConfigError
from profiles.loader import CALIBRATION
from profiles.sensors import AngleCalibration

_HEAD = "# Written by `canhelm calibrate`; merged last into the profile beside it. A person's file stays as it is.\n"


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
    side = profile.with_name(profile.stem + CALIBRATION)
    try:
        values = yaml.safe_load(side.read_text(encoding="utf-8")) if side.is_file() else None
        if not isinstance(values, dict | None):
            raise ConfigError(f"{side} is not a mapping", remedy="mend or remove it")
        merged = _with(values or {}, ("encoders", encoder, "calibration"), _plain(calibration))
        new = side.with_name(f"{side.name}.new")
        new.write_text(_HEAD + yaml.safe_dump(merged, sort_keys=False), encoding="utf-8")
        new.replace(side)
    except OSError as error:
        remedy = "calibrate a profile of your own: `canhelm profile new` makes one"
        raise ConfigError(f"cannot write {side}: {error.strerror}", value=str(side), remedy=remedy) from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read {side}: {error}", value=str(side), remedy="mend or remove it") from None
    return side


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
