"""Commissioning: whatever is wired wrong in a simulated robot is found by name, and put right in its profile."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from canhelm.errors import Interlock, Refused
from daemon.app import App
from daemon.commissioning.pairs import LOCKED, WIRINGS, Push, judge_brakes, judge_encoders
from daemon.commissioning.session import GivenUp, changes_of, commission
from daemon.commissioning.wheels import Findings, Seen, judge_wheel, seen_wheel
from profiles.loader import load
from profiles.schema import Profile
from profiles.side_file import write_values
from vcan_tests.daemon.workshop_person import WorkshopPerson
from vcan_tests.robot import Robot

MAX2D = load("max2d").profile
ROBOT = "schema_version: 1\nname: lab1\nextends: robots/max2d\nsetup: needed\n"


def robot_file(folder: Path, text: str = "") -> Path:
    """A profile that extends the MAX2D."""
    folder.mkdir(exist_ok=True)
    file = folder / "lab1.yaml"
    file.write_text(ROBOT + text)
    return file


class Workshop:
    """A robot on blocks, its daemon, and the person beside it."""

    def __init__(self, app: App) -> None:
        self.robot = Robot(app)
        self.profile: Profile = app.profile
        self.person = WorkshopPerson(self.call)

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """One method of the API, as a client calls it."""
        if method == "status":
            return self.robot.app.service.status()
        return await self.robot.call(method, **params)

    async def commission(self, what: str = "all") -> Findings:
        """All of ``canhelm setup`` but the last question."""
        return await commission(self, self.person, self.profile, what, 500)


@asynccontextmanager
async def workshop(profile: Path, built: Path | None = None, *, lifted: bool = True) -> AsyncIterator[Workshop]:
    """A running daemon with a profile on a robot that may be built otherwise."""
    app = App(load(profile).profile, built=load(built).profile if built else None, seed=1)
    await app.start()
    shop = Workshop(app)
    try:
        await shop.robot.until(lambda: shop.robot.state == "idle")
        await shop.call("simulation.lift", lifted=lifted)
        yield shop
    finally:
        await shop.robot.hang_up()
        await app.close()


MISWIRED = {
    "wheel reversed": ("drives: {rear_left: {direction: -1}}", "reversed: rear_left rolls backward"),
    "wheels swapped": (
        "drives: {rear_left: {node: 4}, front_right: {node: 2}}",
        "swapped: drive rear_left (node 2) turns wheel front_right",
    ),
    "encoders swapped": (
        "encoders: {rear: {node: 6}, front: {node: 5}}",
        "swapped: encoder front (node 6) tells of the rear pair",
    ),
    "encoder reversed": ("encoders: {rear: {direction: -1}}", "reversed: the encoder of the rear pair"),
    "brake reversed": ("brakes: {front: {energise_to_release: false}}", "reversed: the front brake releases"),
    "brakes swapped": (
        "brakes: {front: {drive: rear_right}, rear: {drive: front_left}}",
        "swapped: the front brake is at the output of the rear brake",
    ),
    "wrong counts": ("drives: {front_right: {encoder_pulses_per_turn: 512}}", "counts: front_right has an encoder"),
    "wrong gear": ("drives: {front_right: {belt_ratio: 2.5}}", "gear: front_right has 35 motor turns"),
    "wrong radius": ("drives: {rear_right: {wheel_radius_m: 0.095}}", "radius: rear_right has 95 mm, not 100 mm"),
}
"""How a robot may be built otherwise than its profile says, and by which name it is found."""


@pytest.mark.parametrize("fault", MISWIRED)
async def test_what_is_wired_wrong_is_found_by_name_and_put_right(fault: str, tmp_path: Path) -> None:
    text, words = MISWIRED[fault]
    mine, built = robot_file(tmp_path / "mine"), robot_file(tmp_path / "built", text)
    async with workshop(mine, built) as shop:
        shop.person.labels = {"front_right": 512} if fault == "wrong counts" else {}
        shop.person.diameters = {"rear_right": 190.0} if fault == "wrong radius" else {}
        findings = await shop.commission()
    assert findings.unsolved == []
    assert any(words in sentence for sentence in findings.wrong), findings.wrong
    write_values(mine, findings.values)
    found, true = load(mine).profile, load(built).profile
    assert (found.drives, found.encoders, found.brakes) == (true.drives, true.encoders, true.brakes)
    assert found.setup == "done"


async def test_everything_wrong_at_once_is_put_right(tmp_path: Path) -> None:
    text = """
drives:
  rear_right: {node: 2, direction: 1}
  rear_left: {node: 1, direction: 1}
  front_left: {encoder_pulses_per_turn: 512}
encoders: {rear: {node: 6, direction: -1}, front: {node: 5}}
brakes:
  rear: {drive: front_left, energise_to_release: false}
  front: {drive: rear_left}
"""
    mine, built = robot_file(tmp_path / "mine"), robot_file(tmp_path / "built", text)
    async with workshop(mine, built) as shop:
        shop.person.labels = {"front_left": 512}
        findings = await shop.commission()
    write_values(mine, findings.values)
    found, true = load(mine).profile, load(built).profile
    assert (found.drives, found.encoders, found.brakes) == (true.drives, true.encoders, true.brakes)


async def test_a_robot_that_is_built_as_its_profile_says_changes_nothing(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        findings = await shop.commission()
        assert (findings.wrong, findings.unsolved) == ([], [])
        assert changes_of(shop.profile, findings.values) == {"setup": ("needed", "done")}


STEERED = {
    "encoder reversed": (
        "encoders: {steering_angle: {direction: -1}}",
        "reversed: the encoder of the steering_angle pair counts the other way",
    ),
    "motor reversed": ("drives: {steering: {direction: -1}}", "reversed: steering steers to the right"),
    "wrong gear": ("drives: {steering: {belt_ratio: 1.5}}", "gear: steering has"),
    "as it should be": ("", ""),
}
"""How a steered axle may be built otherwise than its profile says, and by which name it is found."""


def robot_of(folder: Path, robot: str, text: str) -> Path:
    """A profile that extends a shipped one."""
    folder.mkdir()
    file = folder / "lab1.yaml"
    file.write_text(f"schema_version: 1\nname: lab1\nextends: robots/{robot}\nsetup: needed\n{text}\n")
    return file


@pytest.mark.parametrize("robot", ["ackermann", "semitrailer"])
@pytest.mark.parametrize("fault", STEERED)
async def test_an_axle_that_a_motor_steers_is_found_and_put_right(fault: str, robot: str, tmp_path: Path) -> None:
    text, words = STEERED[fault]
    mine, built = robot_of(tmp_path / "mine", robot, ""), robot_of(tmp_path / "built", robot, text)
    async with workshop(mine, built) as shop:
        findings = await shop.commission()
    assert findings.unsolved == []
    assert all(words in sentence for sentence in findings.wrong), findings.wrong
    assert len(findings.wrong) == bool(words)
    write_values(mine, findings.values)
    found, true = load(mine).profile, load(built).profile
    assert found.setup == "done"
    assert found.encoders == true.encoders
    assert found.drives["steering"].direction == true.drives["steering"].direction
    assert found.drives["steering"].total_ratio == pytest.approx(true.drives["steering"].total_ratio, rel=0.05)


async def test_the_steered_axle_can_be_looked_at_alone(tmp_path: Path) -> None:
    async with workshop(robot_of(tmp_path / "mine", "ackermann", "")) as shop:
        findings = await shop.commission("steering")
        assert (findings.wrong, findings.unsolved, findings.values) == ([], [], {})
        assert not any(heard.startswith("turn wheel") for heard in shop.person.heard)


HELD = """
brakes:
  parking: {kind: holding, drive: rear_left, output: 3, output_bit: 13, open_time_s: 0.03, close_time_s: 0.02}
"""


async def test_a_wheel_with_a_holding_brake_is_looked_at_with_the_brake_released(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path, HELD)) as shop:
        findings = await shop.commission("rear_left")
        assert (findings.wrong, findings.unsolved, findings.values) == ([], [], {})
        assert shop.robot.network.brakes["parking"].engaged


async def test_a_holding_brake_that_is_wired_the_other_way_round_is_found_before_its_motor_turns(
    tmp_path: Path,
) -> None:
    mine = robot_file(tmp_path / "mine", HELD)
    built = robot_file(tmp_path / "built", HELD.replace("output: 3", "energise_to_release: false, output: 3"))
    async with workshop(mine, built) as shop:
        findings = await shop.commission()
    assert findings.wrong == ["reversed: the parking brake releases when it shall lock"]
    assert findings.values == {("brakes", "parking", "energise_to_release"): False}


async def test_motors_at_a_brick_are_not_looked_at_and_that_is_told(tmp_path: Path) -> None:
    file = tmp_path / "lab1.yaml"
    file.write_text("schema_version: 1\nname: lab1\nextends: robots/nxt\nsetup: needed\n")
    async with workshop(file) as shop:
        with pytest.raises(Refused, match="at an NXT brick") as refusal:
            await shop.commission()
        assert "write setup: done" in str(refusal.value.remedy)


@pytest.mark.parametrize("robot", ["max2d", "turtle", "semitrailer", "ackermann", "nxt"])
async def test_no_robot_is_driven_before_its_setup(robot: str, tmp_path: Path) -> None:
    async with workshop(robot_of(tmp_path / "mine", robot, "")) as shop:
        methods = shop.robot.app.service.status()["vehicle"]["methods"]
        assert any(method.startswith("drive.") for method in methods)
        for method in methods:
            with pytest.raises(Interlock, match="was not set up"):
                await shop.call(method)


@pytest.mark.parametrize("what", ["done", "waived"])
async def test_a_robot_is_driven_after_its_setup(what: str, tmp_path: Path) -> None:
    file = robot_file(tmp_path)
    write_values(file, {("setup",): what})
    async with workshop(file) as shop:
        await shop.call("simulation.lift", lifted=False)
        await shop.call("drive.parallel", angle_deg=0.0, speed_m_s=0.1, duration_s=1.0)


async def test_the_current_is_capped_meanwhile_and_then_as_before(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        drive = shop.robot.network.drives["rear_left"]

        class Curious(WorkshopPerson):
            async def ask(self, question: str) -> str:
                if question.startswith("which wheel"):
                    assert drive.dictionary.number("output_current_limit") == 500
                return await super().ask(question)

        shop.person = Curious(shop.call)
        await shop.commission("rear_left")
        assert drive.dictionary.number("output_current_limit") == 5000
        assert "  rear_left output_current_limit: 5000 mA -> 500 mA" in shop.person.heard


async def test_breaking_off_puts_everything_back(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        working = asyncio.create_task(shop.commission())
        await shop.robot.until(lambda: shop.robot.state == "active")
        working.cancel()
        await asyncio.wait([working])
        assert (working.cancelled(), shop.robot.state) == (True, "idle")
        limits = {drive.dictionary.number("output_current_limit") for drive in shop.robot.network.drives.values()}
        assert limits == {5000}
        assert all(brake.engaged for brake in shop.robot.network.brakes.values())


class Interrupted:
    """A daemon and a person; Ctrl-C comes at a certain step, be it a question or a call that is under way.

    A call that was begun goes on in the daemon, as one does whose client has gone.
    """

    def __init__(self, shop: Workshop, step: int) -> None:
        self._shop = shop
        self._left = step
        self.begun: list[asyncio.Task[dict[str, Any]]] = []
        self.working: asyncio.Task[Findings]

    async def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        self.begun.append(asyncio.create_task(self._shop.call(method, **params)))
        self._step()
        return await asyncio.shield(self.begun[-1])

    async def ask(self, question: str) -> str:
        self._step()
        await asyncio.sleep(0.0)
        return await self._shop.person.ask(question)

    def tell(self, text: str) -> None:
        self._shop.person.tell(text)

    def _step(self) -> None:
        self._left -= 1
        if not self._left:
            self.working.cancel()


@pytest.mark.parametrize("what", ["rear_left", "pairs"])
async def test_ctrl_c_at_any_step_leaves_everything_as_it_was(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("daemon.commissioning.wheels.JOG_S", 0.2)
    for room in ("body", "workshop"):
        monkeypatch.setattr(f"drivers.simulated.{room}.HAND_RAD_S", 100.0)
    file = robot_file(tmp_path)
    async with workshop(file) as shop:
        limits, step = current_limits(shop), 0
        while True:
            step += 1
            steps = Interrupted(shop, step)
            steps.working = asyncio.create_task(commission(steps, steps, shop.profile, what, 500))
            await asyncio.wait([steps.working])
            await asyncio.gather(*steps.begun, return_exceptions=True)
            assert (step, current_limits(shop), shop.robot.state) == (step, limits, "idle")
            assert all(brake.engaged for brake in shop.robot.network.brakes.values())
            if not steps.working.cancelled():
                break
        assert step > 15
    assert not file.with_suffix(".calibration.yaml").exists()


def current_limits(shop: Workshop) -> list[int]:
    """Of all drives [mA]."""
    names = ("continuous_current_limit", "output_current_limit")
    return [drive.dictionary.number(name) for drive in shop.robot.network.drives.values() for name in names]


@pytest.mark.parametrize(("again", "unsolved"), [("y", 0), ("n", 1)])
async def test_a_drive_that_faults_is_tried_again_or_left(again: str, unsolved: int, tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        faults = [0x2310]

        class Patient(WorkshopPerson):
            async def ask(self, question: str) -> str:
                if "press Enter and watch" in question and faults:
                    soon = asyncio.get_running_loop().time() + 1.0
                    asyncio.get_running_loop().call_at(soon, drive.trigger_fault, faults.pop())
                return again if question.startswith("try") else await super().ask(question)

        drive = shop.robot.network.drives["rear_left"]
        shop.person = Patient(shop.call)
        findings = await shop.commission("rear_left")
        assert any("over-current (0x2310)" in heard for heard in shop.person.heard)
        assert len(findings.unsolved) == unsolved


class Lazy(WorkshopPerson):
    """Somebody who presses Enter without having turned the wheel, and says later what a look at it tells."""

    lazy = 1
    turned = "n"

    async def ask(self, question: str) -> str:
        if question.startswith("turn wheel") and self.lazy:
            self.lazy -= 1
            return ""
        return self.turned if question.startswith("has wheel") else await super().ask(question)


async def test_a_wheel_that_was_not_turned_by_hand_is_asked_for_again(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        shop.person = Lazy(shop.call)
        findings = await shop.commission("rear_left")
        assert "0 counts of about 56000: not turned, or not connected with its motor" in shop.person.heard
        assert (findings.wrong, findings.unsolved) == ([], [])


async def test_a_wheel_that_turns_without_its_motor_is_loose(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:
        shop.person = Lazy(shop.call)
        shop.person.turned = "y"
        findings = await shop.commission("rear_left")
        assert "is the wheel loose on its shaft?" in findings.unsolved[0]


async def test_who_says_no_gets_nothing_changed(tmp_path: Path) -> None:
    async with workshop(robot_file(tmp_path)) as shop:

        class Cautious(WorkshopPerson):
            async def ask(self, question: str) -> str:
                return "n"

        shop.person = Cautious(shop.call)
        with pytest.raises(GivenUp):
            await shop.commission()


# --- judging ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("answer", "seen"),
    [
        ("forward", ("rear_left", True)),
        ("front_right Backward", ("front_right", False)),
        ("none", ("", False)),
        ("", None),
        ("sideways", None),
        ("nose forward", None),
        ("front_right and rear_left forward", None),
    ],
)
def test_a_persons_words_are_understood_or_asked_for_again(answer: str, seen: tuple[str, bool] | None) -> None:
    assert seen_wheel(answer, "rear_left", MAX2D.drives) == seen


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        (Seen("rear_left", "", forward=False, moved=False), "check motor cable and brake"),
        (Seen("rear_left", "", forward=False, moved=True), "is the shaft loose"),
        (Seen("rear_left", "rear_left", forward=True, moved=False), "its encoder counts nothing"),
        (Seen("rear_left", "rear_left", forward=True, moved=True, turn_qc=-56000), "look again"),
    ],
)
def test_what_a_profile_cannot_put_right_is_left_to_the_person(seen: Seen, words: str) -> None:
    findings = Findings()
    judge_wheel(seen, MAX2D.drives, findings)
    assert words in findings.unsolved[0]
    assert findings.values == {}


def pushes(rear: tuple[bool, bool, bool], front: tuple[bool, bool, bool], turned_deg: float = 20.0) -> list[Push]:
    """Pushes of both pairs with: all locked, their own brake released, the other one released."""
    made = []
    for pair, moved, rounds in (("rear", rear, (LOCKED, "rear", "front")), ("front", front, (LOCKED, "front", "rear"))):
        for released, gave_way in zip(rounds, moved, strict=True):
            made.append(Push(pair, released, gave_way, {pair: turned_deg if gave_way else 0.0}))
    return made


@pytest.mark.parametrize("pattern", [(False, False, False), (True, True, True), (False, True, True)])
def test_a_brake_that_makes_no_sense_is_told(pattern: tuple[bool, bool, bool]) -> None:
    findings = Findings()
    judge_brakes(pushes(pattern, (False, True, False)), MAX2D, findings)
    assert findings.unsolved[0].startswith("the rear brake")
    assert findings.values == {}


def test_each_wiring_of_a_brake_shows_a_pattern_of_its_own() -> None:
    assert len(set(WIRINGS)) == 4


def test_a_pair_without_a_moving_encoder_is_told() -> None:
    findings = Findings()
    judge_encoders(pushes((False, True, False), (False, True, False), 0.5), MAX2D.encoders, findings)
    assert findings.unsolved[0].startswith("no encoder tells of the rear pair")
