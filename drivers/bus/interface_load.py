"""How busy the wire of a network interface is, by the kernel's own counters: they see what no filter lets through."""

from __future__ import annotations

from pathlib import Path

NETWORK_DEVICES = Path("/sys/class/net")
_COUNTERS = ("tx_packets", "tx_bytes", "rx_packets", "rx_bytes")
_FRAME_BITS = 47
"""Of a classic base frame without data, with intermission and without stuff bits (Bosch CAN 2.0 part A, 3.1)."""
_STUFFED_BITS = 34
"""Those of them that may be followed by stuff bits."""
_STUFFING = 0.11
"""Stuff bits for each of those and of the data bits: what canhelm's traffic with a MAX2D has."""


def wire_bits(frames: int, data_bytes: int) -> float:
    """Bits that so many frames with so many data bytes in all took, to about 5 %."""
    stuffed = _STUFFED_BITS * frames + 8 * data_bytes
    return (_FRAME_BITS - _STUFFED_BITS) * frames + (1.0 + _STUFFING) * stuffed


class InterfaceLoad:
    """Share of the time between the last two samples that the wire was busy.

    Args:
        name: of the interface.
        bit_rate: bit/s.
        devices: ``/sys/class/net``.

    Attributes:
        load: that share, 0 to 1; 0 until there are two samples.
    """

    def __init__(self, name: str, bit_rate: int, devices: Path = NETWORK_DEVICES) -> None:
        self.load = 0.0
        self._bit_rate = bit_rate
        # a virtual interface counts a frame as received, too, when it hands it back to this machine
        counters = _COUNTERS[:2] if name.startswith("vcan") else _COUNTERS
        self._paths = [devices / name / "statistics" / counter for counter in counters]
        self._last: tuple[float, int, int] | None = None

    def sample(self, now_s: float) -> None:
        """Look at the counters; best about once a second. Without them there is no load."""
        try:
            counts = [int(path.read_text()) for path in self._paths]
        except (OSError, ValueError):
            self._last, self.load = None, 0.0
            return
        frames, data_bytes = sum(counts[::2]), sum(counts[1::2])
        if self._last is not None and now_s > self._last[0]:
            last_s, last_frames, last_bytes = self._last
            bits = wire_bits(frames - last_frames, data_bytes - last_bytes)
            self.load = min(1.0, max(0.0, bits / (self._bit_rate * (now_s - last_s))))
        self._last = (now_s, frames, data_bytes)
