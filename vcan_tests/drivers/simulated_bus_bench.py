"""What tests of the simulated wire listen with."""

from __future__ import annotations

from drivers.simulated.bus import SimulatedPort

BIT_S = 1e-6
Frame = tuple[int, bytes, float]


def listen(port: SimulatedPort) -> list[Frame]:
    frames: list[Frame] = []
    port.receiver = lambda can_id, data, stamp: frames.append((can_id, data, stamp))
    return frames
