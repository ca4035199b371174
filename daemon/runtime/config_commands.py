"""The ``config.*`` methods: the settings of a drive read, compared, written, kept."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

from canhelm.errors import NodeAbsent, Refused, UsageError
from daemon.runtime.handlers import Handler, Params
from daemon.runtime.interlocks import require_all_disabled
from daemon.runtime.supervisor import Supervisor
from drivers.canopen.objects import ObjectDef, parse_address
from drivers.epos.commissioning import Commissioning, until_ready
from drivers.epos.drive import EposDrive
from drivers.epos.objects import OBJECTS
from drivers.epos.parameters import (
    ADDRESSING,
    SETTINGS,
    counts_from_start,
    expected_settings,
    without_unmapped,
    write_order,
)

OUTPUT_MASK = OBJECTS["digital_output_functions_mask"]
BASE_SETTINGS = frozenset(entry for entry in SETTINGS if entry.firmware == "2011h")
"""Those that every drive has."""
HARDWARE_SHIFT = 16
"""The hardware version stands in the high word of the product code."""

BY_HAND = "how the drive is reached is changed by `canhelm sdo write` alone"

Values = dict[ObjectDef, int]


class ConfigCommands:
    """Handlers of the ``config.*`` methods, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.handlers: dict[str, Handler] = {
            "config.dump": self._dump,
            "config.diff": self._diff,
            "config.apply": self._apply,
            "config.backup": self._backup,
            "config.restore": self._restore,
        }

    def _drives(self) -> list[EposDrive]:
        return [drive for drive in self._supervisor.devices.drives.values() if isinstance(drive, EposDrive)]

    def _drive(self, node: int | str) -> EposDrive:
        for drive in self._drives():
            if node in (drive.name, drive.node, str(drive.node)):
                return drive
        have = ", ".join(f"{drive.node} ({drive.name})" for drive in self._drives())
        raise NodeAbsent(f"no drive {node} in this profile", remedy=f"drives: {have}")

    # --- looking -------------------------------------------------------------------------------------------------

    async def _dump(self, params: Params, lease: str | None) -> dict[str, Any]:
        return await self._dump_of(self._drive(params["node"]))

    async def _backup(self, params: Params, lease: str | None) -> dict[str, Any]:
        drives = self._drives() if params["node"] == "all" else [self._drive(params["node"])]
        return {"drives": [await self._dump_of(drive) for drive in drives]}

    async def _dump_of(self, drive: EposDrive) -> dict[str, Any]:
        async with Commissioning(drive) as commissioning:
            identity = await commissioning.identity()
            found = await commissioning.read()
        values = {entry.address: value for entry, value in found.items()}
        bit_rate = self._supervisor.master.network.bit_rate
        return {"node": drive.node, "name": drive.name, "bit_rate": bit_rate, **identity, "values": values}

    async def _diff(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self._drive(params["node"])
        wanted, notes = self._wanted(drive, params["values"])
        async with Commissioning(drive) as commissioning:
            notes += _require_kind(drive, await commissioning.identity(), params["product_code"])
            found = await commissioning.read()
        target, more = _target(drive, wanted, found)
        differences = self._changes(drive, target, found)
        return {"node": drive.node, "name": drive.name, "compared": len(wanted), "differences": differences,
                "notes": more + notes}  # fmt: skip

    # --- changing ------------------------------------------------------------------------------------------------

    async def _apply(self, params: Params, lease: str | None) -> dict[str, Any]:
        return await self._change(params, save=bool(params["save"]))

    async def _restore(self, params: Params, lease: str | None) -> dict[str, Any]:
        return await self._change(params, save=True)

    async def _change(self, params: Params, *, save: bool) -> dict[str, Any]:
        """Make a drive's settings those that were given, or those of the profile."""
        drive, dry_run = self._drive(params["node"]), bool(params["dry_run"])
        wanted, notes = self._wanted(drive, params["values"])
        if not dry_run:
            require_all_disabled(self._supervisor)
        async with Commissioning(drive) as commissioning:
            notes += _require_kind(drive, await commissioning.identity(), params["product_code"])
            found = await commissioning.read()
            target, more = _target(drive, wanted, found)
            changes = self._changes(drive, target, found)
            writes = not dry_run and bool(changes or save)
            if writes:
                _require_saved(drive, target, found, save)
                await self._write(commissioning, target, found, save)
        if writes:
            await until_ready(drive, self._supervisor.master.network.boot_deadline_s + 1.0)
        return {
            "node": drive.node,
            "name": drive.name,
            "dry_run": dry_run,
            "changes": changes,
            "saved": save and not dry_run,
            "restarted": save and not dry_run,
            "notes": more + notes,
            "node_state": str(drive.node_state),
            "status": drive.status_sentence,
        }

    async def _write(self, commissioning: Commissioning, target: Values, found: Values, save: bool) -> None:
        require_all_disabled(self._supervisor)
        idle = await commissioning.take_out()
        await commissioning.write(write_order(target, found | idle))
        if save:
            await commissioning.save()
            await commissioning.restart()
            await commissioning.require_kept(target)

    # --- what is wanted ------------------------------------------------------------------------------------------

    def _wanted(self, drive: EposDrive, values: Mapping[str, int] | None) -> tuple[Values, list[str]]:
        """The settings asked for: those given, else the profile's; and what was left out. Raises UsageError."""
        if values is None:
            return expected_settings(drive.config, self._supervisor.master.network), []
        wanted: Values = {}
        others = 0
        for text, value in values.items():
            entry = OBJECTS.at(*(parse_address(text) or (0, 0)))
            if entry is None or entry not in SETTINGS:
                others += 1
            else:
                wanted[entry] = _fitting(entry, value)
        notes = [f"{others} objects are no settings of an EPOS 24/5 and were left out"] if others else []
        given = sum(entry in BASE_SETTINGS for entry in wanted)
        if given < len(BASE_SETTINGS):
            notes.append(
                f"{given} of the {len(BASE_SETTINGS)} settings of an EPOS 24/5 were given (is the file whole?)"
            )
        return without_unmapped(wanted), notes

    def _changes(self, drive: EposDrive, target: Values, found: Values) -> list[dict[str, Any]]:
        """Every difference for people and programs; the outputs of brakes are none, they stay as they are."""
        brakes = drive.outputs.own_bits
        wanted = dict(target)
        if OUTPUT_MASK in wanted:
            wanted[OUTPUT_MASK] = wanted[OUTPUT_MASK] & ~brakes | found[OUTPUT_MASK] & brakes
        profile = expected_settings(drive.config, self._supervisor.master.network)
        return [
            {
                "object": entry.address,
                "name": entry.name,
                "was": found[entry],
                "wanted": value,
                "unit": entry.unit,
                "note": _note(entry, value, profile),
            }
            for entry, value in wanted.items()
            if found[entry] != value
        ]


def _target(drive: EposDrive, wanted: Values, found: Values) -> tuple[Values, list[str]]:
    """What can be written of it: nothing that the drive lacks, not its addressing, the brakes' outputs idle."""
    absent = [entry for entry in wanted if entry not in found]
    kept = [entry for entry in ADDRESSING if wanted.get(entry, found[entry]) != found[entry]]
    notes = [f"{_words(entry)} is absent in this drive's firmware and was left out" for entry in absent]
    notes += [f"{_words(entry)} stays {found[entry]}, not {wanted[entry]}: {BY_HAND}" for entry in kept]
    target = {entry: value for entry, value in wanted.items() if entry not in (*absent, *ADDRESSING)}
    brakes = drive.outputs.own_bits
    if brakes:
        target[OUTPUT_MASK] = target.get(OUTPUT_MASK, found[OUTPUT_MASK]) & ~brakes
    return target, notes


def _require_saved(drive: EposDrive, target: Values, found: Values, save: bool) -> None:
    late = [entry for entry, value in target.items() if counts_from_start(entry) and found[entry] != value]
    if late and not save:
        names = ", ".join(map(_words, late))
        raise Refused(
            f"{drive.who}: {names} takes effect after saving and a restart only",
            node=drive.node,
            object=late[0].address,
            remedy="add --save: the settings are kept and the drive restarts",
        )


def _require_kind(drive: EposDrive, identity: Mapping[str, int], product_code: int | None) -> list[str]:
    """Raise Refused for the settings of another kind of drive; a note for those of another firmware."""
    code = identity["product_code"]
    if product_code is None or product_code == code:
        return []
    if product_code >> HARDWARE_SHIFT != code >> HARDWARE_SHIFT:
        raise Refused(
            f"{drive.who} is product 0x{code:08X}, the settings are of product 0x{product_code:08X}",
            node=drive.node,
            value=f"0x{code:08X}",
            limit=f"0x{product_code:08X}",
            remedy="take the settings of a drive of the same hardware",
        )
    return [f"the settings are of product 0x{product_code:08X}, this drive is 0x{code:08X}: another firmware"]


def _fitting(entry: ObjectDef, value: int) -> int:
    """The value, if the object can hold it. Raises UsageError."""
    low, high = entry.low, entry.high
    try:
        entry.type.pack(value)
    except struct.error:
        raise _no_fit(entry, value, entry.type.name.lower()) from None
    if (low is not None and value < low) or (high is not None and value > high):
        raise _no_fit(entry, value, f"{'' if low is None else low} .. {'' if high is None else high}")
    return value


def _no_fit(entry: ObjectDef, value: int, limit: str) -> UsageError:
    return UsageError(
        f"{value} does not fit {_words(entry)}",
        object=entry.address,
        value=value,
        limit=limit,
        remedy="mend the file; nothing was written",
    )


def _words(entry: ObjectDef) -> str:
    return f"{entry.address} ({entry.name})"


def _note(entry: ObjectDef, value: int, profile: Values) -> str:
    if entry is OUTPUT_MASK:
        return "the outputs of brakes are driven by the daemon alone, from each boot on"
    if entry in profile and profile[entry] != value:
        return f"the profile sets it to {profile[entry]} at each boot"
    return "counts from the drive's start on" if counts_from_start(entry) else ""
