"""Reads YAML as plain lists, mappings, numbers and words, for files whose places nobody has to be told."""

from __future__ import annotations

from typing import Any

import yaml


def read_plain(text: str) -> Any:
    """What a text means.

    Raises:
        ValueError: it is no YAML, nested too deeply, or a value is not of the kind that its tag says.
    """
    try:
        return yaml.safe_load(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except (yaml.YAMLError, LookupError, AttributeError) as error:  # the last two: a tag as !!int before no number
        raise ValueError(str(error)) from error
