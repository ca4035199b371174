"""A person who commissions a simulated robot: pushes and turns what is asked for, looks, and says what is seen."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from typing import Any

Call = Callable[..., Awaitable[dict[str, Any]]]
SEEN_DEG = 5.0
MOMENT_S = 0.1


class WorkshopPerson:
    """Answers the questions of ``canhelm setup`` by what the simulated robot shows.

    Args:
        call: a method of the daemon's API.
        labels: pulses on the labels of encoders that are not as the profile says, by wheel.
        diameters: of wheels [mm] that are not as the profile says.

    Attributes:
        mistaken: wrong answers, and angles [deg] of a hand that errs, by the beginning of their questions; each once.
        sensors: names in the daemon's profile of encoders that sit on the axis of another name.
    """

    def __init__(
        self, call: Call, labels: dict[str, int] | None = None, diameters: dict[str, float] | None = None
    ) -> None:
        self.heard: list[str] = []
        self.sensors: dict[str, str] = {}
        self._call = call
        self.labels = labels or {}
        self.diameters = diameters or {}
        self.mistaken: dict[str, str] = {}
        self._before: dict[str, float] = {}
        self._wheel = ""

    def tell(self, text: str) -> None:
        """Hear something."""
        self.heard.append(text)

    async def ask(self, question: str) -> str:
        """The answer."""
        self.heard.append(question)
        mistaken = next((self.mistaken.pop(begin) for begin in self.mistaken if question.startswith(begin)), None)
        if question.startswith("turn wheel"):
            return await self._turn(question.split()[2], float(mistaken or 360.0))
        if mistaken is not None:
            return mistaken
        if question.startswith("which wheel"):
            return await self._what_turned()
        if question.startswith("where do the steered wheels"):
            return await self._where_it_points()
        if pushed := re.match(r"push the (\w+) pair", question):
            given = await self._call("simulation.hand", name=pushed[1], angle_deg=20.0)
            await asyncio.sleep(MOMENT_S)
            return "y" if given["turned_deg"] else "n"
        if back := re.match(r"turn the (\w+) pair back", question):
            await self._call("simulation.hand", name=back[1], angle_deg=-20.0)
            await asyncio.sleep(MOMENT_S)
        elif axis := re.match(r"turn the axis of encoder (\w+) (back|to)", question):
            angle_deg = 20.0 if axis[2] == "to" else 0.0
            await self._call("simulation.turn", node=self.sensors.get(axis[1], axis[1]), angle_deg=angle_deg)
            await asyncio.sleep(MOMENT_S)
        elif question.startswith("pulses"):
            return str(self.labels.get(self._wheel, ""))
        elif question.startswith("diameter"):
            return str(self.diameters.get(self._wheel, ""))
        elif held := re.match(r"the (\w+) brake is (locked|released): does (\w+) turn", question):
            given = await self._call("simulation.hand", name=held[3], angle_deg=30.0)
            return "y" if given["turned_deg"] else "n"
        elif question.endswith("[y/n]"):
            return "y"
        elif "press Enter and watch" in question:
            seen = await self._call("simulation.look")
            self._before = seen["wheel_deg"] | seen["heading_deg"]
        return ""

    async def _what_turned(self) -> str:
        now = (await self._call("simulation.look"))["wheel_deg"]
        turned = {name: angle - self._before[name] for name, angle in now.items()}
        name = max(turned, key=lambda wheel: abs(turned[wheel]))
        if abs(turned[name]) < SEEN_DEG:
            return "none"
        return f"{name} {'forward' if turned[name] > 0 else 'backward'}"

    async def _where_it_points(self) -> str:
        now = (await self._call("simulation.look"))["heading_deg"]
        axle = next(iter(now))
        turned = now[axle] - self._before[axle]
        return "none" if abs(turned) < SEEN_DEG else "left" if turned > 0 else "right"

    async def _turn(self, wheel: str, angle_deg: float) -> str:
        self._wheel = wheel
        await self._call("simulation.hand", name=wheel, angle_deg=angle_deg)
        return ""
