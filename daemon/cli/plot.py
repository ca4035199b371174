"""``canhelm plot``: the picture of a run."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from canhelm.errors import CanhelmError, UsageError
from daemon.cli.output import Json, say, show
from daemon.cli.runs import Folder, Robot, find_runs
from daemon.runs import store
from daemon.runs.store import LAST


def plot(
    name: str = LAST, /, *, out: Path | None = None, folder: Folder = None, robot: Robot = None, json: Json = None
) -> None:
    """Draw a run: track, headings, speeds, currents (what the robot has of it), limits, slip; say what stands out.

    Example: `canhelm plot last`

    Args:
        name: Number of a run, or last.
        out: The picture's file; its ending chooses the format (png, svg, pdf). The default is run-NUMBER.png here.
    """
    run = store.choose(find_runs(folder, robot), name)
    if importlib.util.find_spec("matplotlib") is None:
        raise CanhelmError("no pictures: matplotlib is missing", remedy="pip install 'canhelm[plot]'")
    from daemon.runs.pictures import draw

    path = out or Path(f"run-{run.number}.png")
    try:
        signs = draw(run, path)
    except OSError as error:
        remedy = "name a file in a folder that this user may write to, by --out"
        raise UsageError(f"cannot write {path}: {error.strerror or error}", remedy=remedy) from error
    except ValueError as error:
        raise UsageError(f"cannot draw {path.name}: {error}", remedy="give a file that ends in .png") from error
    for sign in signs:
        say(sign)
    show({"run": run.number, "picture": str(path), "stands_out": signs}, json=json)
