"""Drives a robot with a pad: reads the sticks at a steady rate, and streams them by ``drive.set``."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, Final, Protocol

from canhelm.errors import CanhelmError, DaemonNotRunning, Refused, Timeout
from daemon.gamepad.dead_man import DeadMan
from daemon.gamepad.mapping import Mapping
from daemon.gamepad.pad import Pad

PERIOD_S: Final = 0.05
"""Between two set-points."""
VALID_FOR_MS: Final = 200.0
"""Age at which a set-point is too old: three may be lost on the way."""
LINK_LOST_S: Final = 1.0
"""An answer that took longer than this: the robot has stopped meanwhile, and does not go on by itself."""


def _unseen(words: str) -> None:
    """Nobody looks."""


class Caller(Protocol):
    """A client of the daemon."""

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """As of :class:`canhelm.aio.Client`."""
        ...


class PadDriver:
    """One robot, driven by one pad after the other.

    Each set-point waits for the answer to the last, so that no more than one can be on its way to a robot whose link
    hangs, and that one is too old soon after it arrives.

    Args:
        client: of its daemon.
        mapping: of its profile.
        tell: called with a sentence for people when something changes.
        draw: called with what is commanded, while it drives.
    """

    def __init__(
        self,
        client: Caller,
        mapping: Mapping,
        tell: Callable[[str], None],
        draw: Callable[[str], None] = _unseen,
    ) -> None:
        self._client, self._mapping, self._tell, self._draw = client, mapping, tell, draw
        self._dead_man = DeadMan()
        self._motion: str | None = None
        self._end_of_motion: asyncio.Task[dict[str, Any]] | None = None
        self._errands: set[asyncio.Task[None]] = set()
        self._told = ""

    async def drive(self, pad: Pad) -> None:
        """Drive until the pad has gone; whatever ends it, the robot comes to rest.

        Raises:
            DaemonNotRunning, Timeout: the daemon is lost; the robot stops by itself.
        """
        self._dead_man.lock()
        try:
            while not pad.gone:
                await self._step(pad)
                await pad.wait(PERIOD_S)
            self._look_at_buttons(pad)
        finally:
            self._let_go()
            await asyncio.gather(*self._errands, return_exceptions=True)
        self._look_after_errands()
        self._say(f"{pad.name} has gone ({pad.gone}): the robot is at rest")

    async def _step(self, pad: Pad) -> None:
        self._look_after_errands()
        self._look_after_motion()
        self._look_at_buttons(pad)
        neutral = self._mapping.neutral(pad.position)
        self._dead_man.step(held=pad.held(self._mapping.buttons.dead_man), neutral=neutral)
        pad.forget()
        if self._dead_man.driving and not neutral:
            self._watch_silence(pad)
        if self._dead_man.driving:
            await self._set(pad)
        else:
            self._let_go()
        if self._dead_man.centring:
            self._say("let the sticks go back to their middle, then it drives")

    def _look_at_buttons(self, pad: Pad) -> None:
        buttons = self._mapping.buttons
        if pad.was_pressed(buttons.emergency_stop):
            self._lock("emergency stop: `canhelm reset` when it is safe")
            self._send(self._stop("estop", reason="pressed on a gamepad"))
        elif pad.was_pressed(buttons.stop):
            self._lock("stopped")
            self._send(self._stop("stop"))

    def _watch_silence(self, pad: Pad) -> None:
        silence_s = self._mapping.silence_s
        if silence_s is not None and asyncio.get_running_loop().time() - pad.heard_s > silence_s:
            self._lock(f"no word from {pad.name} for {silence_s:g} s: is it asleep, or out of reach?")

    async def _set(self, pad: Pad) -> None:
        """One set-point; none while the last motion still comes to rest."""
        if self._errands:
            return
        loop = asyncio.get_running_loop()
        begun_s, commands = loop.time(), self._mapping.commands(pad.position)
        parameters = self._mapping.parameters(commands)
        try:
            answer = await self._client.call("drive.set", valid_for_ms=VALID_FOR_MS, **parameters)
        except (DaemonNotRunning, Timeout):
            raise
        except CanhelmError as refusal:
            self._lock(str(refusal))
            return
        await self._follow(str(answer["motion"]))
        self._draw(self._mapping.words(commands))
        if loop.time() - begun_s > LINK_LOST_S:
            self._lock(f"the daemon answered after {loop.time() - begun_s:.1f} s: the robot has stopped meanwhile")

    async def _follow(self, motion: str) -> None:
        """Remember which motion it is; another one than before: that has ended by itself."""
        if motion == self._motion:
            return
        if self._end_of_motion is not None:
            self._lock(str(await _ending(self._end_of_motion)))
        else:
            self._say("driving")
        self._motion = motion
        self._end_of_motion = asyncio.create_task(self._client.call("motion.wait", motion=motion))

    def _look_after_motion(self) -> None:
        """Drive no more where the motion has ended by itself, and say why."""
        task = self._end_of_motion
        if task is not None and task.done():
            self._motion = self._end_of_motion = None
            error = task.exception()
            if isinstance(error, DaemonNotRunning | Timeout):
                raise error
            self._lock(str(error or "the motion is over"))

    def _lock(self, why: str) -> None:
        """Drive no more before the dead-man button was let go of and pressed again."""
        self._dead_man.lock()
        self._say(f"{why} - let go of {self._mapping.buttons.dead_man}, and hold it again to drive")

    def _let_go(self) -> None:
        """Begin to end the motion by its ramp."""
        if self._motion is not None and self._end_of_motion is not None:
            self._send(self._end(self._motion, self._end_of_motion))
            self._motion = self._end_of_motion = None

    async def _end(self, motion: str, ended: asyncio.Task[dict[str, Any]]) -> None:
        try:
            await self._client.call("motion.stop", motion=motion)
        except Refused:
            pass  # it is over already
        finally:
            await _ending(ended)
        self._say("at rest")

    async def _stop(self, method: str, **params: Any) -> None:
        await self._client.call(method, **params)

    def _send(self, errand: Coroutine[Any, Any, None]) -> None:
        """Something that takes its time and keeps no button waiting."""
        self._errands.add(asyncio.create_task(errand))

    def _look_after_errands(self) -> None:
        """Raise that the daemon is lost, and tell what else has gone wrong with those that are done."""
        for errand in [errand for errand in self._errands if errand.done()]:
            self._errands.discard(errand)
            try:
                errand.result()
            except (DaemonNotRunning, Timeout):
                raise
            except CanhelmError as error:
                self._lock(str(error))

    def _say(self, sentence: str) -> None:
        """Tell a sentence that is not the last one."""
        if sentence != self._told:
            self._told = sentence
            self._tell(sentence)


async def _ending(task: asyncio.Task[dict[str, Any]]) -> object:
    """The result or the error of a motion that is over."""
    ends = await asyncio.gather(task, return_exceptions=True)
    return ends[0]
