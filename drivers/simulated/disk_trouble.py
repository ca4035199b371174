"""What is wrong with the disk that the daemon of a simulated robot records on."""

from __future__ import annotations

import errno
import os


class DiskTrouble:
    """A disk that faults make full or slow; whoever writes on it asks here before.

    Attributes:
        full: it takes nothing more.
        delay_s: how much later than asked it does each thing.
    """

    def __init__(self) -> None:
        self.full = False
        self.delay_s = 0.0

    def require_room(self) -> None:
        """Raise OSError as a full disk does."""
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
