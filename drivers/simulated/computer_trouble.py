"""What is wrong with the computer that the daemon of a simulated robot runs on."""

from __future__ import annotations

import errno
import os


class ComputerTrouble:
    """A disk that faults make full or slow, and a clock that they set; whoever uses them asks here.

    Attributes:
        disk_full: the disk takes nothing more.
        disk_delay_s: how much later than asked it does each thing.
        clock_jump_s: by how much the time of day was set.
    """

    def __init__(self) -> None:
        self.disk_full = False
        self.disk_delay_s = 0.0
        self.clock_jump_s = 0.0

    def require_room(self) -> None:
        """Raise OSError as a full disk does."""
        if self.disk_full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
