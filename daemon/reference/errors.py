"""The page of all errors: exit codes, the codes that devices send, and what daemon and commands say."""

from __future__ import annotations

from collections.abc import Iterable

from canhelm.errors import CanhelmError, all_errors
from daemon.cli.main import INTERRUPTED
from daemon.reference.markdown import code, table
from daemon.reference.sentences import sentences
from drivers.canopen.objects import CodeDef
from drivers.epos.codes import EMERGENCIES
from drivers.explain_codes import ABORTS, REACTIONS

HEAD = """# Errors

Every failure says what happened and where, and after a dash what to do next. `canhelm explain CODE` explains the codes
of devices in a terminal, in every reading.

## Exit codes

0 is done, {interrupted} interrupted. Programs get the class from the client library, or its code in the JSON-RPC error
object.

"""
EMCY = """
## Emergency codes

What an EPOS 24/5 says in an EMCY frame; `canhelm status` shows it. How the drive reacts:

"""
SDO = """
## Abort codes

What a device answers to an SDO request that it does not carry out, or the drive that forwards it from a serial line.

"""
SAID = """
## What daemon and commands say

By the class of the error; words in braces stand for what is put in there.

"""


def errors() -> str:
    """Exit codes, codes of devices, and every sentence with its remedy, as Markdown."""
    emergencies = ((*_cells(entry, digits=4), entry.reaction or "?") for entry in EMERGENCIES.values())
    aborts = (_cells(entry, digits=8) for entry in ABORTS.values())
    said = ((code(each.kind), each.text, each.remedy) for each in sentences())
    columns = ("code", "meaning", "usual cause", "what to do")
    parts = (
        HEAD.format(interrupted=INTERRUPTED) + table(("class", "exit code", "JSON-RPC", "meaning"), _classes()),
        EMCY + "\n".join(f"- **{kind}**: {words}" for kind, words in (*REACTIONS.items(), ("?", "not documented"))),
        "\n" + table((*columns, "reaction"), emergencies),
        SDO + table(columns, aborts),
        SAID + table(("class", "what happened", "what to do"), said),
    )
    return "\n".join(parts)


def exit_codes() -> dict[int, str]:
    """Every exit code of the commands with its meaning."""
    leaves = {leaf.exit_code: _meaning(leaf) for leaf in reversed(all_errors())}
    return {0: "Done."} | dict(sorted(leaves.items())) | {INTERRUPTED: "Interrupted; the motion was stopped."}


def _meaning(leaf: type[CanhelmError]) -> str:
    return str(leaf.__doc__) if leaf is not CanhelmError else "Any other failure: refused, or failed in a device."


def _classes() -> Iterable[tuple[object, ...]]:
    for leaf in all_errors():
        yield code(leaf.__name__), leaf.exit_code, leaf.rpc_code, _meaning(leaf)


def _cells(entry: CodeDef, digits: int) -> tuple[str, ...]:
    return code(f"0x{entry.code:0{digits}X}"), f"**{entry.name}**: {entry.meaning}", entry.cause, entry.cure
