"""The calibration of angle sensors: what is fitted, what is kept, and the conversation at the terminal."""

from __future__ import annotations

import json
import math
import os
import random
import re
import select
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from canhelm.client import Client
from canhelm.errors import ConfigError, UsageError
from daemon.calibration.fit import TUKEY, fit
from daemon.calibration.readings import Reading, read_readings, stations, steering_angle, write_readings
from daemon.cli.main import main
from drivers.simulated.angle_sensor import SimulatedAngleSensor
from profiles.loader import load
from profiles.sensors import AngleCalibration, SensorDefects
from profiles.side_file import write_calibration
from vcan_tests.daemon.test_processes import Bench

PROMPT = "wheel [°]: "
DEFECTS = SensorDefects(offset_deg=3.0, gain=1.06, nonlinearity_deg=1.2, hysteresis_deg=0.8)
ROBOT = """
schema_version: 1
name: max2d
extends: robots/max2d
network: {guard_time_ms: 1000, life_time_factor: 4}
simulation:
  sensors:
    front: {offset_deg: 3.0, gain: 1.06, nonlinearity_deg: 1.2, hysteresis_deg: 0.8}
"""


def sensed(
    defects: SensorDefects, range_deg: float = 32.0, step_deg: float = 2.0, noise_deg: float = 0.0
) -> list[Reading]:
    """Readings of all stations with a simulated sensor, the protractor being read with a noise."""
    sensor, chance = SimulatedAngleSensor(defects), random.Random(5)
    readings = []
    for station in stations(range_deg, step_deg):
        angle = math.degrees(sensor.sense(math.radians(station.about_deg)))
        read = station.about_deg + chance.gauss(0.0, noise_deg)
        readings.append(Reading(station.run, station.direction, read, angle))
    return readings


def on_the_way(calibration: AngleCalibration, defects: SensorDefects, true_deg: float) -> float:
    """What a calibrated sensor says at an angle, half way between both directions."""
    sensor = SimulatedAngleSensor(SensorDefects(
        offset_deg=defects.offset_deg, gain=defects.gain, nonlinearity_deg=defects.nonlinearity_deg
    ))  # fmt: skip
    return calibration.correct(math.degrees(sensor.sense(math.radians(true_deg))))


# -- the fit -----------------------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(st.floats(-10, 10), st.floats(0.8, 1.25), st.floats(-2, 2), st.floats(0, 2))
def test_whatever_is_wrong_with_a_sensor_is_corrected(offset: float, gain: float, wave: float, play: float) -> None:
    defects = SensorDefects(offset_deg=offset, gain=gain, nonlinearity_deg=wave, hysteresis_deg=play)
    calibration = fit(sensed(defects)).calibration
    for true in (-30.0, -11.0, 0.0, 7.0, 29.0):
        assert on_the_way(calibration, defects, true) == pytest.approx(true, abs=0.08 * (1 + play))


def test_offset_gain_and_hysteresis_are_told_as_they_are() -> None:
    found = fit(sensed(SensorDefects(offset_deg=2.0, gain=1.1, hysteresis_deg=0.6)))
    assert found.calibration.hysteresis_deg == pytest.approx(0.6, abs=0.03)
    assert found.gain == pytest.approx(1 / 1.1, abs=0.002)
    assert found.offset_deg == pytest.approx(-2.0 / 1.1, abs=0.02)


def test_a_sensor_without_fault_needs_no_correction() -> None:
    found = fit(sensed(SensorDefects(), noise_deg=0.01))
    assert len(found.calibration.correction_deg) == 1
    assert found.offset_deg == pytest.approx(0.0, abs=0.005)
    assert not found.left_out


@pytest.mark.parametrize("slip_deg", [-90.0, 9.0, 30.0, 300.0])
@pytest.mark.parametrize("share", [0.05, 0.2])
def test_slips_of_the_pen_change_nothing(slip_deg: float, share: float) -> None:
    readings = sensed(DEFECTS, noise_deg=0.1)
    slips = random.Random(3).sample(range(len(readings)), round(share * len(readings)))
    wrong = [
        Reading(reading.run, reading.direction, reading.true_deg + slip_deg * (number in slips), reading.sensed_deg)
        for number, reading in enumerate(readings)
    ]
    found = fit(wrong)
    assert set(slips) <= set(found.left_out)
    for true in (-30.0, 0.0, 29.0):
        assert on_the_way(found.calibration, DEFECTS, true) == pytest.approx(true, abs=0.25)


def test_the_order_of_readings_does_not_matter() -> None:
    readings = sensed(DEFECTS, noise_deg=0.1)
    shuffled = random.Random(1).sample(readings, len(readings))
    assert fit(shuffled).calibration.correction_deg == pytest.approx(fit(readings).calibration.correction_deg, abs=1e-6)


def test_the_wide_range_of_a_bending_angle_is_corrected_as_well() -> None:
    calibration = fit(sensed(DEFECTS, 120.0, 10.0, 0.1)).calibration
    for true in range(-115, 116, 23):
        assert on_the_way(calibration, DEFECTS, true) == pytest.approx(true, abs=0.4)


def test_readings_further_than_a_few_deviations_are_left_out() -> None:
    readings = sensed(SensorDefects(), noise_deg=0.1)
    found = fit([*readings, Reading(3, 0, 1.0, 0.0)])
    assert found.left_out == (len(readings),)
    assert found.worst_deg <= TUKEY * 0.2


def test_too_few_readings_are_refused() -> None:
    with pytest.raises(UsageError, match="7 readings"):
        fit(sensed(DEFECTS)[:7])


def test_readings_of_one_angle_are_refused() -> None:
    with pytest.raises(UsageError, match="make no calibration"):
        fit([Reading(1, 0, 5.0, 5.0)] * 20)


def test_a_sensor_that_counts_backwards_is_named() -> None:
    readings = [Reading(r.run, r.direction, r.true_deg, -r.sensed_deg) for r in sensed(DEFECTS)]
    with pytest.raises(ConfigError, match="counts against the axis"):
        fit(readings)


def test_a_sensor_that_does_not_follow_is_named() -> None:
    readings = [Reading(1, 0, abs(angle), angle) for angle in range(-30, 31, 2)]
    with pytest.raises(ConfigError, match="does not follow"):
        fit(readings)


# -- readings ----------------------------------------------------------------------------------------------------------


def test_there_are_three_passes_in_both_directions() -> None:
    planned = list(stations(30.0, 10.0))
    assert {station.run for station in planned} == {1, 2, 3}
    assert [station.about_deg for station in planned if station.run == 2] == [30, 20, 10, 0, -10, -20, -30]
    assert all(station.direction == -1 for station in planned if station.run == 2 and station.about_deg != 30)
    assert [station.direction for station in planned if station.run == 1] == [0, -1, -1, -1, 0, 1, 1, 1]


@given(st.floats(-80, 80), st.floats(0.05, 1.0))
def test_both_wheels_make_the_angle_of_their_common_centre(angle: float, half_track: float) -> None:
    assume(abs(angle) > 10)
    tangent = math.tan(math.radians(angle))
    left, right = (math.degrees(math.atan2(abs(tangent), 1 + side * half_track * tangent)) for side in (-1, 1))
    assume(max(left, right) < 90)
    sense = math.copysign(1, angle)
    assert steering_angle(sense * left, sense * right) == pytest.approx(angle, abs=1e-6)


def test_near_straight_ahead_the_angle_is_the_mean() -> None:
    assert steering_angle(0.4, -0.2) == pytest.approx(0.1)
    assert steering_angle(-10.0, 12.0) == pytest.approx(1.0)


def test_readings_come_back_from_their_file(tmp_path: Path) -> None:
    readings = sensed(DEFECTS)
    write_readings(tmp_path / "front.csv", readings)
    assert read_readings(tmp_path / "front.csv") == readings


@pytest.mark.parametrize("line", ["1,0,5", "1,0,five,5", "1,2,5,5", "1,0,nan,5"])
def test_a_line_that_is_no_reading_is_named(tmp_path: Path, line: str) -> None:
    path = tmp_path / "front.csv"
    write_readings(path, sensed(DEFECTS)[:1])
    with path.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
    with pytest.raises(UsageError, match=f"{path}:3"):
        read_readings(path)


# -- the profile -------------------------------------------------------------------------------------------------------


@given(st.floats(-400, 400))
def test_beyond_the_range_the_correction_stays(angle: float) -> None:
    calibration = AngleCalibration(
        from_deg=-30.0, to_deg=40.0, correction_deg=(1.0, 2.0, -0.5), hysteresis_deg=0.0, residual_deg=0.0, readings=9
    )
    at_end = calibration.correct(min(max(angle, -30.0), 40.0)) - min(max(angle, -30.0), 40.0)
    assert calibration.correct(angle) - angle == pytest.approx(at_end, abs=1e-9)


def test_the_side_file_keeps_what_else_stands_in_it(tmp_path: Path) -> None:
    profile = tmp_path / "lab1.yaml"
    profile.write_text("schema_version: 1\nextends: robots/max2d\n", encoding="utf-8")
    found = fit(sensed(DEFECTS)).calibration
    write_calibration(profile, "rear", found)
    side = write_calibration(profile, "front", found)
    assert side.name == "lab1.calibration.yaml"
    encoders = load(profile).profile.encoders
    for name in ("front", "rear"):
        calibration = encoders[name].calibration
        assert calibration is not None
        assert calibration.correct(20.0) == pytest.approx(found.correct(20.0), abs=0.001)
    assert profile.read_text(encoding="utf-8") == "schema_version: 1\nextends: robots/max2d\n"


def test_a_side_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "lab1.calibration.yaml.new").mkdir()
    with pytest.raises(ConfigError, match="cannot write"):
        write_calibration(tmp_path / "lab1.yaml", "front", fit(sensed(DEFECTS)).calibration)


# -- the command -------------------------------------------------------------------------------------------------------


def test_readings_taken_before_are_fitted_without_a_daemon(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    profile, taken = tmp_path / "lab1.yaml", tmp_path / "taken.csv"
    profile.write_text(ROBOT, encoding="utf-8")
    write_readings(taken, sensed(DEFECTS))
    line = f"calibrate steering --profile {profile} --encoder front --from {taken} --out {tmp_path} --yes --json"
    assert main(line.split()) == 0
    assert json.loads(capsys.readouterr().out)["hysteresis_deg"] == pytest.approx(0.8, abs=0.05)
    assert (tmp_path / "front.png").stat().st_size > 10_000
    assert load(profile).profile.encoders["front"].calibration is not None


@pytest.mark.parametrize("angle", ["1e175", "-361", "inf", "nan"])
def test_an_angle_of_more_than_a_turn_is_no_reading(tmp_path: Path, angle: str) -> None:
    taken = tmp_path / "taken.csv"
    taken.write_text(f"run,direction,true_deg,sensed_deg\n1,1,0.0,0.5\n1,1,4.0,{angle}\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"taken\.csv:3 is no reading"):
        read_readings(taken)


def test_an_encoder_that_the_profile_lacks_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "bending", "--profile", "max2d", "--from", "none.csv", "--out", str(tmp_path)]) == 7
    assert "front" in capsys.readouterr().err


def test_without_a_terminal_nobody_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = f"calibrate steering --profile max2d --encoder front --out {tmp_path} --socket {tmp_path}/none"
    assert main(line.split()) == 3


class Person:
    """Somebody at a terminal, who turns the axis by hand as told, and reads the protractor."""

    def __init__(self, bench: Bench, arguments: list[str]) -> None:
        self.client: Client = bench.client
        self._terminal, theirs = os.openpty()
        environment = {**os.environ, "CANHELM_SOCKET": str(bench.socket), "NO_COLOR": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "daemon", *arguments],
            stdin=theirs, stderr=theirs, stdout=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip
        os.close(theirs)
        self._seen = b""

    def reads_until(self, *wanted: str) -> str:
        """What has appeared up to one of some words."""
        pattern = re.compile("|".join(map(re.escape, wanted)))
        while not (found := pattern.search(self._seen.decode(errors="replace"))):
            assert select.select([self._terminal], [], [], 60)[0], self._seen
            self._seen += os.read(self._terminal, 4096)
        told = self._seen.decode(errors="replace")[: found.end()]
        self._seen = self._seen[len(told.encode()) :]
        return told

    def types(self, line: str) -> None:
        os.write(self._terminal, f"{line}\n".encode())

    def turns(self, angle_deg: float) -> None:
        """Turn the axis, and wait until the daemon has seen it."""
        self.client.call("simulation.turn", node="front", angle_deg=angle_deg)
        seen = self.client.status()["cycle"]["cycles"]
        while self.client.status()["cycle"]["cycles"] < seen + 3:
            pass


@pytest.mark.real_time
def test_a_person_calibrates_a_simulated_sensor_at_a_terminal(tmp_path: Path) -> None:
    bench = Bench(tmp_path, profile_text=ROBOT)
    profile = tmp_path / "max2d.yaml"
    try:
        line = f"calibrate steering --profile {profile} --encoder front --range 30 --step 5 --out {tmp_path} --json"
        person = Person(bench, line.split())
        person.reads_until(PROMPT)
        person.types("one two")
        assert "is not what is asked for" in person.reads_until(PROMPT)
        person.types("99 99")
        person.reads_until(PROMPT)
        person.types("back")
        asked = person.reads_until(PROMPT)
        while "[y/N]" not in asked:
            angle = float(re.findall(r"about (-?[\d.]+)°", asked)[-1])
            person.turns(angle)
            person.types(f"{angle} {angle}")
            asked = person.reads_until(PROMPT, "[y/N]")
        person.types("y")
        person.reads_until("next start")
        told = json.loads(person.process.communicate(timeout=60)[0])
        assert person.process.returncode == 0
    finally:
        bench.kill()
    assert told["hysteresis_deg"] == pytest.approx(0.8, abs=0.15)
    assert (tmp_path / "front.csv").is_file()
    calibration = load(profile).profile.encoders["front"].calibration
    assert calibration is not None
    for true in (-25.0, 0.0, 25.0):
        assert on_the_way(calibration, DEFECTS, true) == pytest.approx(true, abs=0.2)


@pytest.mark.parametrize("data", [None, b"\x89PNG\xff\xfe"])
def test_readings_that_cannot_be_read_are_told_without_a_number_of_the_system(
    data: bytes | None, tmp_path: Path
) -> None:
    path = tmp_path / "nope.csv"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(UsageError, match=r"nope\.csv") as caught:
        read_readings(path)
    assert "Errno" not in caught.value.message
