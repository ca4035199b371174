"""The host's side of one exchange in the framing of later drives, without clock or I/O: no acknowledges."""

from __future__ import annotations

from drivers.epos.serial_answers import Answer, parse_answer
from drivers.epos.serial_frames import UNANSWERED
from drivers.epos.serial_frames_v2 import Deframer, restuffed
from drivers.epos.serial_handshake import Exchange, Outcome, Phase


class StuffedExchange(Exchange):
    """The host's side of one exchange: one frame out, one frame back, nothing in between."""

    def __init__(self, baud: int) -> None:
        super().__init__(baud)
        self._deframer = Deframer()

    def begin(self, request: bytes, now_s: float) -> bytes:
        """Begin an exchange with a frame of the first generation; the bytes to send at ``now_s``."""
        self._request = request
        self.outcome = None
        self.phase = Phase.SENDING if request[0] in UNANSWERED else Phase.ANSWER
        self._deframer = Deframer()
        return self._say(restuffed(request), now_s)

    def feed(self, data: bytes, stamp_s: float) -> bytes:
        """Take bytes of the drive; there is nothing to say to them."""
        for frame in self._deframer.feed(data):
            answer = frame if isinstance(frame, str) else parse_answer(self._request, frame)
            if self.outcome is not None or stamp_s < self.sent_s:
                self.strays += 1
            elif isinstance(answer, str):
                self.crc_errors += 1
                self.outcome = Outcome.GARBLED
            else:
                self.answer = answer
                self.outcome = Outcome.ANSWERED
        return b""

    def give_up(self, now_s: float) -> bytes:
        """No answer came in time; nobody acknowledges a command without answer, so it counts as carried out."""
        if self.phase is Phase.SENDING:
            self.answer = Answer()
            self.outcome = Outcome.ANSWERED
        else:
            self.outcome = Outcome.LOST
        return b""
