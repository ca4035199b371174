"""One pad that is read: where its sticks are, which buttons are pressed, and that it has gone."""

from __future__ import annotations

import asyncio
import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from daemon.gamepad.input_events import (
    ABS_INFO,
    EV_ABS,
    EV_KEY,
    EV_SYN,
    EVENT,
    KEY_BYTES,
    SYN_DROPPED,
    SYN_REPORT,
    Event,
    absinfo_request,
    keys_request,
    parse_bits,
    parse_events,
)
from daemon.gamepad.pads import PadInfo
from profiles.gamepad_codes import AXES, BUTTONS

READ_EVENTS = 64


@dataclass(slots=True)
class Snapshot:
    """Everything about a pad at one moment, by the kernel's numbers.

    Attributes:
        axes: raw values.
        ranges: smallest and largest raw value of each axis.
        pressed: buttons.
    """

    axes: dict[int, int] = field(default_factory=dict)
    ranges: dict[int, tuple[int, int]] = field(default_factory=dict)
    pressed: set[int] = field(default_factory=set)


class Pad:
    """A pad by its events, which tell changes only.

    Args:
        name: for people.
        look: asks the kernel for everything; at the begin, and after events were lost (SYN_DROPPED).

    Attributes:
        heard_s: loop time of the last event.
        gone: why there is no pad any more; empty while there is one.
    """

    def __init__(self, name: str, look: Callable[[], Snapshot]) -> None:
        self.name = name
        self.heard_s = asyncio.get_running_loop().time()
        self.gone = ""
        self._look = look
        self._now = look()
        self._pressed: set[int] = set()
        self._released: set[int] = set()
        self._dropping = False
        self._news = asyncio.Event()

    def feed(self, data: bytes) -> None:
        """Take what was read of its event device."""
        self.heard_s = asyncio.get_running_loop().time()
        for event in parse_events(data):
            self._take(event)

    def _take(self, event: Event) -> None:
        if event.type == EV_SYN and event.code == SYN_DROPPED:
            self._dropping = True
        elif event.type == EV_SYN and event.code == SYN_REPORT and self._dropping:
            self._dropping = False
            self._look_again()
        elif self._dropping:
            pass  # the kernel: ignore everything up to the next SYN_REPORT, then ask for the state
        elif event.type == EV_ABS:
            self._now.axes[event.code] = event.value
        elif event.type == EV_KEY and event.value in (0, 1):
            self._press(event.code, down=bool(event.value))

    def _press(self, code: int, *, down: bool) -> None:
        (self._pressed if down else self._released).add(code)
        (self._now.pressed.add if down else self._now.pressed.discard)(code)
        self._news.set()

    def _look_again(self) -> None:
        """Events were lost: what was pressed may have been let go of in between."""
        before, self._now = self._now.pressed, self._look()
        self._pressed |= self._now.pressed - before
        self._released |= before
        self._news.set()

    def lose(self, why: str) -> None:
        """There is no pad any more."""
        self.gone = self.gone or why
        self._news.set()

    async def wait(self, timeout_s: float) -> None:
        """Until a button changes, the pad goes, or the time is over."""
        try:
            async with asyncio.timeout(timeout_s):
                await self._news.wait()
        except TimeoutError:
            return
        self._news.clear()

    def position(self, axis: str) -> float:
        """Where an axis is, from -1 to 1; 0 is the middle of its range."""
        code = AXES[axis]
        low, high = self._now.ranges[code]
        middle = (low + high) / 2
        return max(-1.0, min(1.0, (self._now.axes[code] - middle) / (high - middle))) if high > low else 0.0

    def held(self, button: str) -> bool:
        """Whether a button is pressed, and has been since the last :meth:`forget`."""
        code = BUTTONS[button]
        return code in self._now.pressed and code not in self._released

    def was_pressed(self, button: str | None) -> bool:
        """Whether a button was pressed down since the last :meth:`forget`, however shortly."""
        return button is not None and BUTTONS[button] in self._pressed

    def forget(self) -> None:
        """What was pressed and let go of up to now has been seen to."""
        self._pressed.clear()
        self._released.clear()


@contextmanager
def opened(info: PadInfo) -> Iterator[Pad]:
    """A pad that is read on the running loop as long as this lasts. Raises OSError where it cannot be opened."""
    device = os.open(info.path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        with watched(device, Pad(info.name, lambda: snapshot(device, info))) as pad:
            yield pad
    finally:
        os.close(device)


@contextmanager
def watched(device: int, pad: Pad) -> Iterator[Pad]:
    """Feed a pad with what a file descriptor says; its end or its error is the pad's."""
    loop = asyncio.get_running_loop()

    def read() -> None:
        try:
            if data := os.read(device, READ_EVENTS * EVENT.size):
                pad.feed(data)
                return
        except BlockingIOError:
            return
        except OSError as error:
            pad.lose(error.strerror or str(error))
        pad.lose("it says no more")
        loop.remove_reader(device)

    loop.add_reader(device, read)
    try:
        yield pad
    finally:
        loop.remove_reader(device)


def snapshot(device: int, info: PadInfo) -> Snapshot:
    """Ask the kernel where all sticks and buttons are. Raises OSError where the pad has gone."""
    now = Snapshot()
    for name in info.axes:
        code = AXES[name]
        answer = fcntl.ioctl(device, absinfo_request(code), bytes(ABS_INFO.size))
        now.axes[code], low, high, *_ = ABS_INFO.unpack(answer)
        now.ranges[code] = (low, high)
    now.pressed = parse_bits(fcntl.ioctl(device, keys_request(), bytes(KEY_BYTES)))
    return now
