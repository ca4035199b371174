"""``canhelm calibrate``: an angle sensor against a protractor, station by station, through the daemon."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter
from cyclopts.validators import Number

from canhelm.client import Client
from canhelm.errors import ConfigError, NotReady, UsageError
from daemon.calibration.readings import (
    Reading,
    Station,
    read_readings,
    stations,
    steering_angle,
    write_readings,
)
from daemon.cli.calibrate_scale import square, straight
from daemon.cli.options import DEFAULT, Options, agreed
from daemon.cli.output import say, show
from daemon.cli.pictures import can_draw, make_folder

if TYPE_CHECKING:
    from daemon.calibration.fit import Fit

BACK = "back"

app = App(name="calibrate", help="Compare an angle sensor with a protractor, and put what is found into the profile.")

app.command(straight)
app.command(square)

Range = Annotated[float, Parameter(name="--range", validator=Number(gt=0, lte=180), help="To each side [degrees].")]
Step = Annotated[float, Parameter(validator=Number(gt=0, lte=90), help="Between two stations [degrees].")]


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class Choices:
    """What both calibrations are told."""

    profile: str
    """The robot's profile; the calibration goes into the side file beside it."""
    encoder: str | None = None
    """Name of the encoder; without it the first one that is called like what is calibrated."""
    readings: Annotated[Path | None, Parameter(name="--from")] = None
    """Readings taken before (CSV), instead of asking."""
    out: Path = Path("calibration")
    """Folder for the readings and the picture."""
    yes: Annotated[bool, Parameter(negative=())] = False
    """Put it into the profile without asking."""


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked at each station, and the angle that the answer's numbers make."""

    prompt: str
    angle: Callable[[list[float]], float]


@app.command
def steering(*, choices: Choices, range_deg: Range = 32.0, step: Step = 4.0, options: Options = DEFAULT) -> None:
    """The sensor of the steering angle; asks for the angles of the left and the right wheel.

    Example: `canhelm calibrate steering --profile lab1.yaml`
    """
    question = Question("left and right wheel [°]: ", _both_wheels)
    _calibrate("steering", choices, list(stations(range_deg, step)), question, options)


@app.command
def bending(*, choices: Choices, range_deg: Range = 120.0, step: Step = 10.0, options: Options = DEFAULT) -> None:
    """The sensor of the bending angle between truck and trailer.

    Example: `canhelm calibrate bending --profile lab1.yaml`
    """
    question = Question("bending angle [°]: ", _one_angle)
    _calibrate("bending", choices, list(stations(range_deg, step)), question, options)


def _both_wheels(angles: list[float]) -> float:
    left, right = angles
    return steering_angle(left, right)


def _one_angle(angles: list[float]) -> float:
    (angle,) = angles
    return angle


def _calibrate(kind: str, choices: Choices, planned: list[Station], question: Question, options: Options) -> None:
    from daemon.calibration.fit import fit
    from profiles.loader import load
    from profiles.side_file import write_calibration

    loaded = load(choices.profile)
    name = _encoder(kind, choices.encoder, list(loaded.profile.encoders))
    make_folder(choices.out)
    if choices.readings is None:
        with options.client() as client:
            readings = _ask(client, name, planned, question, choices.out / f"{name}.csv")
    else:
        readings = read_readings(choices.readings)
    found = fit(readings)
    _draw(name, readings, found, choices.out / f"{name}.png")
    show(_summary(name, found), json=options.json)
    for number in found.left_out:
        reading = readings[number]
        say(f"left out: reading {number + 1}, {reading.true_deg:g}° where the sensor said {reading.sensed_deg:g}°")
    if choices.yes or agreed(f"put this into the profile {loaded.path}?"):
        side = write_calibration(loaded.path, name, found.calibration)
        say(f"written into {side}; the daemon takes it at its next start")


def _encoder(kind: str, wanted: str | None, known: Sequence[str]) -> str:
    """The encoder to calibrate. Raises ConfigError where the profile has none such."""
    name = wanted or next((name for name in known if name.startswith(kind)), None)
    if name is None or name not in known:
        told = f"{wanted!r}" if wanted else f"whose name begins with {kind}"
        raise ConfigError(f"the profile has no encoder {told}", remedy=f"--encoder with one of: {', '.join(known)}")
    return name


def _ask(client: Client, encoder: str, planned: list[Station], question: Question, kept: Path) -> list[Reading]:
    """Go through all stations with the person at the terminal; each reading is kept in a file at once."""
    if not sys.stdin.isatty():
        raise UsageError("nobody is there to read the protractor", remedy="--from FILE takes readings taken before")
    _sensed_deg(client, encoder)
    say(f"{len(planned)} stations in three passes; come to each from the side that is told, without turning back")
    say("an empty line leaves a station out, `back` goes back by one, Ctrl-C ends without a calibration")
    readings: dict[int, Reading] = {}
    at = 0
    while at < len(planned):
        station = planned[at]
        say(f"{at + 1}/{len(planned)}, pass {station.run}: turn {_side(station)} to about {station.about_deg:.3g}°")
        answer = _answer(question)
        if answer == BACK:
            at = max(0, at - 1)
            readings.pop(at, None)
            continue
        if isinstance(answer, float):
            sensed = _sensed_deg(client, encoder)
            readings[at] = Reading(station.run, station.direction, answer, sensed)
            write_readings(kept, list(readings.values()))
            say(f"the sensor says {sensed:.3f}°")
        at += 1
    return list(readings.values())


def _side(station: Station) -> str:
    return {1: "on to the left", -1: "on to the right", 0: "from anywhere"}[station.direction]


def _answer(question: Question) -> float | str | None:
    """What the person says: an angle, ``back``, or None for a station that is left out. Asks again where it is neither.

    Raises:
        KeyboardInterrupt: nobody is there any more.
    """
    while True:
        print(question.prompt, end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:
            raise KeyboardInterrupt
        words = line.replace(",", ".").split()
        if not words:
            return None
        if words == [BACK]:
            return BACK
        try:
            found = question.angle([float(word) for word in words])
        except ValueError:
            found = math.nan
        if abs(found) <= 180:
            return found
        say(f"{line.strip()!r} is not what is asked for: numbers in degrees, left positive")


def _sensed_deg(client: Client, encoder: str) -> float:
    """What the sensor says now, not corrected. Raises NotReady where it is not there."""
    node: dict[str, Any]
    node = next((node for node in client.call("status")["nodes"] if node.get("name") == encoder), {})
    if node.get("node_state") != "ready":
        raise NotReady(f"{encoder} is not ready", remedy="`canhelm status` says why; does the daemon run this profile?")
    return float(node["sensed_deg"])


def _summary(name: str, found: Fit) -> dict[str, Any]:
    calibration = found.calibration
    return {
        "encoder": name,
        "readings": calibration.readings,
        "left_out": len(found.left_out),
        "from_deg": calibration.from_deg,
        "to_deg": calibration.to_deg,
        "offset_deg": round(found.offset_deg, 4),
        "gain": round(found.gain, 5),
        "nonlinearity_deg": round(found.nonlinearity_deg, 4),
        "hysteresis_deg": round(calibration.hysteresis_deg, 4),
        "residual_deg": round(calibration.residual_deg, 4),
        "worst_residual_deg": round(found.worst_deg, 4),
        "degree": len(calibration.correction_deg) - 1,
    }


def _draw(name: str, readings: Sequence[Reading], found: Fit, path: Path) -> None:
    if not can_draw():
        return
    from daemon.calibration.pictures import draw

    draw(name, readings, found, path)
    say(f"picture {path}")
