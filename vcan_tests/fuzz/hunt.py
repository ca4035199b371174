"""The long search: inputs of a target until the time is up, and a file for each defect that they bring to light."""

from __future__ import annotations

import hashlib
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, settings

import vcan_tests
from vcan_tests.fuzz.target import Target, TookTooLong

ROOT = Path(vcan_tests.__file__).resolve().parent.parent
BATCH = 200
"""Inputs that hypothesis makes at a time."""
SHORTENING_S = 30.0
"""How long a finding is made smaller."""
_BATCHES = settings(
    max_examples=BATCH,
    deadline=None,
    database=None,
    phases=(Phase.generate,),
    suppress_health_check=list(HealthCheck),
)


@dataclass(frozen=True, slots=True)
class Finding:
    """One defect.

    Attributes:
        content: an input that brings it to light.
        told: what was raised, with its traceback.
    """

    content: bytes
    told: str


@dataclass(slots=True)
class Hunted:
    """What came of a search.

    Attributes:
        executions: inputs that were tried.
        findings: defects, by what was raised and where; of each the first input, made smaller.
    """

    executions: int = 0
    findings: dict[str, Finding] = field(default_factory=dict)


def hunt(target: Target, seconds: float, now: Callable[[], float] = time.process_time) -> Hunted:
    """Try inputs of a target for some time of the processor, so that a busy machine tries no fewer."""
    hunted, end_s = Hunted(), now() + seconds

    @_BATCHES
    @given(target.inputs)
    def try_batch(content: bytes) -> None:
        if hunted.executions and now() >= end_s:
            return
        hunted.executions += 1
        found = outcome(target, content)
        if found is not None and found[0] not in hunted.findings:
            small = shortened(target, content, found[0], now)
            hunted.findings[found[0]] = Finding(small, (outcome(target, small) or found)[1])

    try_batch()
    while now() < end_s:
        try_batch()
    return hunted


def outcome(target: Target, content: bytes) -> tuple[str, str] | None:
    """What an input brings to light: which defect, and its traceback; None where all is well."""
    try:
        target.check(content)
    except Exception as error:  # whatever it is, it is what was searched for  # noqa: BLE001
        return _identity(error), "".join(traceback.format_exception(error, limit=-12))
    return None


def _identity(error: BaseException) -> str:
    """What was raised, and the innermost line of this project that took part; a hang has no such place."""
    if isinstance(error, TookTooLong):
        return TookTooLong.__name__
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if Path(frame.filename).is_relative_to(ROOT) and ".venv" not in frame.filename]
    place = f" at {Path(ours[-1].filename).relative_to(ROOT)}:{ours[-1].lineno}" if ours else ""
    return f"{type(error).__name__}{place}"


def shortened(target: Target, content: bytes, defect: str, now: Callable[[], float] = time.process_time) -> bytes:
    """A smaller input of the same defect: ever smaller parts are left out, as long as it shows.

    Source: Zeller and Hildebrandt, Simplifying and isolating failure-inducing input, 2002, ddmin.
    """
    end_s, step = now() + SHORTENING_S, max(len(content) // 2, 1)
    while True:
        begin = 0
        while begin < len(content):
            if now() >= end_s:
                return content
            less = content[:begin] + content[begin + step :]
            found = outcome(target, less)
            if found is not None and found[0] == defect:
                content = less
            else:
                begin += step
        if step == 1:
            return content
        step = max(step // 2, 1)


def keep(folder: Path, target: Target, findings: Sequence[Finding]) -> list[Path]:
    """Write each finding into a file that the tests replay once it is in their folder."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for finding in findings:
        path = folder / f"{target.name}.{hashlib.sha256(finding.content).hexdigest()[:12]}"
        path.write_bytes(finding.content)
        paths.append(path)
    return paths
