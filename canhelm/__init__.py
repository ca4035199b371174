"""canhelm: the client of the canhelm daemon (standard library only)."""

__version__ = "0.1.0"
