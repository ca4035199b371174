"""Faults of the computer that the daemon of a simulated robot runs on: its disk, its clock, the clients on it."""

from __future__ import annotations

from random import Random

from canhelm.errors import UsageError
from drivers.simulated.client_flood import ClientFlood
from drivers.simulated.computer_trouble import ComputerTrouble
from drivers.simulated.device_faults import Effect, Maker, Site
from profiles.faults import Fault


def _computer_of(site: Site, fault: Fault) -> ComputerTrouble:
    if site.computer is None:
        remedy = "set it in `canhelm run --simulate`"
        raise UsageError("the daemon is in another process", object="kind", value=fault.kind, remedy=remedy)
    return site.computer


def _disk_fault(site: Site, fault: Fault, _: Random) -> Effect:
    computer = _computer_of(site, fault)
    if fault.kind == "disk_full":
        return Effect(lambda: setattr(computer, "disk_full", True), lambda: setattr(computer, "disk_full", False))
    delay_s = fault.delay_s
    return Effect(lambda: setattr(computer, "disk_delay_s", delay_s), lambda: setattr(computer, "disk_delay_s", 0.0))


def _clock_jump(site: Site, fault: Fault, _: Random) -> Effect:
    computer, jump_s = _computer_of(site, fault), fault.jump_s or 0.0

    def set_clock(by_s: float) -> None:
        computer.clock_jump_s += by_s

    return Effect(lambda: set_clock(jump_s), lambda: set_clock(-jump_s))


def _client_flood(site: Site, fault: Fault, _: Random) -> Effect:
    if site.socket is None:
        remedy = "set it in `canhelm run --simulate`"
        raise UsageError("the daemon has no socket here", object="kind", value=fault.kind, remedy=remedy)
    flood = ClientFlood(site.socket, fault.clients or 0)
    return Effect(flood.begin, flood.end)


COMPUTER_MAKERS: dict[str, Maker] = {
    **dict.fromkeys(("disk_full", "disk_slow"), _disk_fault),
    "clock_jump": _clock_jump,
    "client_flood": _client_flood,
}
