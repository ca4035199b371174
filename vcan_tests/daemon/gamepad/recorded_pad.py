"""A gamepad as its event device tells of it: a pad in somebody's hands, event by event."""

from __future__ import annotations

import copy

from daemon.gamepad.input_events import EV_ABS, EV_KEY, EV_SYN, EVENT, SYN_REPORT, Event
from daemon.gamepad.pad import Pad, Snapshot
from profiles.gamepad_codes import AXES, BUTTONS

STICKS = ("ABS_X", "ABS_Y", "ABS_RX", "ABS_RY")
FULL = 32767


def make_event(event: Event) -> bytes:
    """An event as the kernel writes it, at time zero."""
    return EVENT.pack(0, 0, *event)


REPORT = make_event(Event(EV_SYN, SYN_REPORT, 0))


def stick_events(axis: str, share: float) -> bytes:
    """A stick moves to a share of its way."""
    return make_event(Event(EV_ABS, AXES[axis], round(share * FULL))) + REPORT


def button_events(button: str, *, down: bool) -> bytes:
    """A button is pressed or let go of."""
    return make_event(Event(EV_KEY, BUTTONS[button], int(down))) + REPORT


def untouched() -> Snapshot:
    """Sticks in their middle, nothing pressed."""
    codes = [AXES[stick] for stick in STICKS]
    return Snapshot(dict.fromkeys(codes, 0), dict.fromkeys(codes, (-FULL - 1, FULL)), set())


class RecordedPad:
    """A pad with two sticks of -32768 to 32767, as the kernel's xpad driver makes them.

    Attributes:
        pad: what reads it.
        truth: how it is held, whatever was told of it.
    """

    def __init__(self, name: str = "Recorded Pad", pressed: tuple[str, ...] = ()) -> None:
        self.truth = untouched()
        self.truth.pressed |= {BUTTONS[button] for button in pressed}
        self.pad = Pad(name, self.look)

    def look(self) -> Snapshot:
        """What the kernel would answer."""
        return copy.deepcopy(self.truth)

    def moves(self, axis: str, share: float) -> bytes:
        """Move a stick to a share of its way; the events."""
        self.truth.axes[AXES[axis]] = round(share * FULL)
        return stick_events(axis, share)

    def presses(self, button: str) -> bytes:
        """Press a button; the events."""
        self.truth.pressed.add(BUTTONS[button])
        return button_events(button, down=True)

    def lets_go(self, button: str) -> bytes:
        """Let go of a button; the events."""
        self.truth.pressed.discard(BUTTONS[button])
        return button_events(button, down=False)

    def move(self, axis: str, share: float) -> None:
        """Move a stick, and let the pad read it."""
        self.pad.feed(self.moves(axis, share))

    def press(self, button: str) -> None:
        """Press a button, and let the pad read it."""
        self.pad.feed(self.presses(button))

    def let_go(self, button: str) -> None:
        """Let go of a button, and let the pad read it."""
        self.pad.feed(self.lets_go(button))
