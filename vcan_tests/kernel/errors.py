"""The one error of this package."""

from __future__ import annotations


class MissingTool(Exception):
    """Something from outside the project is not there or does not work; the message says how to get it."""
