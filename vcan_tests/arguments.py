"""Types for the arguments of the programs among the tests."""

from __future__ import annotations

import argparse
import math


def positive(text: str) -> float:
    """A finite number above 0. Raises ArgumentTypeError."""
    number = not_negative(text)
    if number == 0.0:
        raise argparse.ArgumentTypeError("give more than 0")
    return number


def not_negative(text: str) -> float:
    """A finite number from 0 on. Raises ArgumentTypeError."""
    try:
        number = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number") from None
    if not 0.0 <= number < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is negative or has no end; give a number from 0 on")
    return number
