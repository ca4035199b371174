"""Network management and error control (CiA 301 7.2.8): pure bytes."""

from __future__ import annotations

from drivers.canopen.codes import NmtCommand

NMT_COB_ID = 0x000
SYNC_COB_ID = 0x080
ERROR_CONTROL_COB_ID = 0x700
"""Plus node id: boot-up message, guarding request (remote frame) and guarding answer."""


def make_nmt(command: NmtCommand, node: int) -> bytes:
    """The data of an NMT frame.

    Args:
        command: what the node shall do.
        node: node id 1 to 127, or 0 for all nodes.
    """
    return bytes((command, node))


def parse_error_control(data: bytes) -> tuple[int, int] | None:
    """Toggle bit (0 or 1) and state byte of a guarding answer or boot-up message; None where it is neither."""
    if len(data) != 1:
        return None
    return data[0] >> 7, data[0] & 0x7F
