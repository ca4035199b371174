"""The serial side of a simulated gateway with the framing of later drives: DLE, STX and stuffing, no acknowledges.

What its commands do, and how long they take, is as in an EPOS 24/5. Assumed: that a broken frame is dropped.
"""

from __future__ import annotations

from drivers.canopen.codes import NmtState
from drivers.epos.serial_frames_v2 import Deframer, restuffed
from drivers.simulated.node import SimulatedNode
from drivers.simulated.serial import EposTiming
from drivers.simulated.serial_commands import SerialCommands
from drivers.simulated.serial_wire import QUIET, SerialCable


class SimulatedLaterSerial:
    """The serial port of one drive, which makes it the gateway to all others.

    Args:
        node: the drive.
        baud: bit/s.
        seed: of noise on its cable.

    Attributes:
        cable: its cable; the host writes to it.
        broken: frames that were dropped.
    """

    def __init__(self, node: SimulatedNode, baud: int, *, seed: int = 0) -> None:
        self.cable = SerialCable(baud, self._receive, QUIET, seed)
        self.broken = 0
        self._node = node
        self._timing = EposTiming()
        self._commands = SerialCommands(node, self._timing.forwarding_timeout_s)
        self._deframer = Deframer()

    def _receive(self, data: bytes, end_s: float) -> None:
        if self._node.nmt_state is NmtState.BOOT_UP:
            self._deframer = Deframer()
            return
        for frame in self._deframer.feed(data):
            if isinstance(frame, str):
                self.broken += 1
            else:
                self._commands.execute(frame, self._reply, end_s)

    def _reply(self, answer: bytes | None, at_s: float) -> None:
        if answer is not None and self._node.nmt_state is not NmtState.BOOT_UP:
            self.cable.to_host.send(restuffed(answer), at_s + self._timing.answer_s)
