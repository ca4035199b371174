"""The ``simulation.*`` methods: what one does by hand to a real network."""

from __future__ import annotations

import asyncio
import math
from typing import Any, Protocol

from canhelm.errors import NodeAbsent, Refused
from daemon.runtime.clock import PatientLoop
from daemon.runtime.handlers import Handler, Params, node_number
from daemon.runtime.supervisor import Supervisor


class Network(Protocol):
    """What can be done to a simulated network."""

    def power_on(self, which: int | str = "all") -> None:
        """Switch on one node, or all."""

    def power_off(self, which: int | str = "all") -> None:
        """Switch off one node, or all."""

    def set_input(self, node: int, number: int, level: bool) -> None:
        """Apply a level to a digital input of a drive."""

    def turn_sensor(self, node: int, angle_rad: float | None) -> None:
        """Hold the axis of an encoder by hand at an angle; None lets go of it."""

    @property
    def stands_on_floor(self) -> bool:
        """Whether its wheels touch a floor."""

    def tilt(self, slope_rad: float, downhill_rad: float) -> None:
        """Tilt the floor."""


class SimulationCommands:
    """Handlers of the ``simulation.*`` methods, by name in :attr:`handlers`.

    Args:
        supervisor: for the names of nodes.
        network: the simulated network; None where it is real.
    """

    def __init__(self, supervisor: Supervisor, network: Network | None) -> None:
        self._supervisor = supervisor
        self._network = network
        self.handlers: dict[str, Handler] = {
            "simulation.power": self._power,
            "simulation.input": self._input,
            "simulation.turn": self._turn,
            "simulation.slope": self._slope,
            "simulation.pace": self._pace,
        }

    async def _power(self, params: Params, lease: str | None) -> dict[str, Any]:
        network = self._simulated("its power is switched by hand")
        named, on = params["node"], bool(params["on"])
        if named != "all" and named not in self._supervisor.devices.bricks:
            self._member(named)
        switch = network.power_on if on else network.power_off
        try:
            switch(named)
        except KeyError:
            remedy = "`canhelm nodes scan` shows who has which id; call it by its name"
            raise NodeAbsent(f"no simulated node has the id {named}", node=named, remedy=remedy) from None
        return {"node": params["node"], "on": on}

    async def _input(self, params: Params, lease: str | None) -> dict[str, Any]:
        network = self._simulated("its inputs are wired")
        node, number, level = self._member(params["node"]), int(params["input"]), str(params["level"])
        if node not in {drive.node for drive in self._supervisor.devices.drives.values()}:
            raise NodeAbsent(f"node {node} is no drive and has no digital inputs", node=node, remedy="name a drive")
        network.set_input(node, number, level == "high")
        return {"node": params["node"], "input": number, "level": level}

    async def _turn(self, params: Params, lease: str | None) -> dict[str, Any]:
        network = self._simulated("its axes are turned by hand")
        node, angle = self._member(params["node"]), params["angle_deg"]
        if node not in {encoder.node for encoder in self._supervisor.devices.encoders.values()}:
            raise NodeAbsent(f"node {node} is no encoder", node=node, remedy="name an encoder")
        network.turn_sensor(node, None if angle is None else math.radians(angle))
        return {"node": params["node"], "angle_deg": angle}

    async def _slope(self, params: Params, lease: str | None) -> dict[str, Any]:
        network = self._simulated("its floor is as it is")
        if not network.stands_on_floor:
            raise Refused("this simulated robot stands on no floor: its wheels turn in the air",
                          remedy="tilt the floor of a vehicle with a mass in its profile")  # fmt: skip
        slope_deg, direction_deg = float(params["slope_deg"]), float(params["direction_deg"])
        network.tilt(math.radians(slope_deg), math.radians(direction_deg))
        return {"slope_deg": slope_deg, "direction_deg": direction_deg}

    async def _pace(self, params: Params, lease: str | None) -> dict[str, Any]:
        self._simulated("its time passes as it does")
        loop = asyncio.get_running_loop()
        if not isinstance(loop, PatientLoop):
            raise Refused("the time of this simulation is not the machine's", remedy="leave it as it is")
        loop.set_pace(float(params["factor"]))
        return {"factor": loop.pace}

    def _simulated(self, why_not: str) -> Network:
        if self._network is None:
            raise Refused(f"this network is real: {why_not}")
        return self._network

    def _member(self, node: int | str) -> int:
        number = node_number(self._supervisor, node)
        if number not in self._supervisor.devices.by_node:
            raise NodeAbsent(
                f"no node {number} is simulated", node=number, remedy="`canhelm status` lists the nodes of the profile"
            )
        return number
