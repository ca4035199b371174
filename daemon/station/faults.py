"""Which faults a simulated network knows, for the form in which the page asks for one."""

from __future__ import annotations

from typing import Any

from daemon.api.simulation_methods import SIMULATION_METHODS
from profiles.faults import KINDS, Kind

_FAULT = next(method for method in SIMULATION_METHODS if method.name == "simulation.fault")


def fault_kinds() -> dict[str, Any]:
    """Every kind of fault with what can be said of it, for ``station.fault_kinds``.

    Returns:
        ``kinds``: of each its name, summary, the sections of a profile that its part may be of, and the names of the
        parameters that it ``needs`` and ``takes``; ``fields``: each parameter as ``api.schema`` tells it, by its name.
    """
    fields = {param.name: param.schema() for param in _FAULT.params if param.name != "kind"}
    return {"kinds": [_told(name, kind) for name, kind in KINDS.items()], "fields": fields}


def _told(name: str, kind: Kind) -> dict[str, Any]:
    takes = [field for field in kind.fields if field != "kind" and field not in kind.needs]
    return {
        "kind": name,
        "summary": kind.summary,
        "parts": list(kind.parts),
        "needs": list(kind.needs),
        "takes": takes,
    }
