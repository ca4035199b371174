"""What the page is told of objects, codes and kinds of faults."""

from __future__ import annotations

import pytest

from canhelm.errors import UsageError
from daemon.station.faults import fault_kinds
from daemon.station.objects import TABLES, code_readings, device_objects
from drivers.encoder.encoder import Cia406Encoder
from drivers.epos.drive import EposDrive
from profiles.faults import KINDS


def test_devices_are_called_as_the_status_calls_them() -> None:
    assert set(TABLES) == {EposDrive.kind, Cia406Encoder.kind}


def test_a_drive_has_its_statusword_that_can_only_be_read() -> None:
    objects = {entry["name"]: entry for entry in device_objects("epos24_5")["objects"]}
    word = objects["statusword"]
    assert (word["object"], word["index"], word["subindex"], word["access"]) == ("0x6041", 0x6041, 0, "ro")


def test_an_object_that_tells_of_trouble_has_its_cause_and_cure() -> None:
    objects = {entry["name"]: entry for entry in device_objects("cia406")["objects"]}
    assert objects["error_register"]["cause"] == "Any bit set: the encoder has an error."
    assert objects["error_register"]["cure"] == "Read alarms (0x6503) and error history (0x1003)."


def test_an_object_with_limits_tells_them_with_its_unit() -> None:
    objects = {entry["object"]: entry for entry in device_objects("epos24_5")["objects"]}
    limit = objects["0x6410/2"]
    assert (limit["low"], limit["high"], limit["unit"]) == (0, 10000, "mA")


def test_a_device_without_a_dictionary_is_refused_and_the_others_are_named() -> None:
    with pytest.raises(UsageError, match="NXT motor B has no object dictionary") as refused:
        device_objects("NXT motor B")
    assert refused.value.remedy == "give epos24_5, cia406"


def test_a_statusword_is_told_in_words() -> None:
    reading = code_readings("0x0137", "statusword")["readings"][0]
    assert reading["title"] == "statusword 0x0137: operation enabled"
    assert "bit 2" in reading["details"]


def test_a_code_that_is_none_is_refused() -> None:
    with pytest.raises(UsageError, match="cannot be read as statusword"):
        code_readings("moved", "statusword")


def test_every_kind_of_fault_is_offered_with_all_that_it_takes_and_nothing_else() -> None:
    told = {kind["kind"]: {*kind["needs"], *kind["takes"], "kind"} for kind in fault_kinds()["kinds"]}
    assert told == {name: set(kind.fields) for name, kind in KINDS.items()}


def test_every_parameter_of_a_kind_is_explained() -> None:
    told = fault_kinds()
    named = {field for kind in told["kinds"] for field in (*kind["needs"], *kind["takes"])}
    assert named == set(told["fields"])


def test_a_coefficient_of_friction_has_its_range() -> None:
    friction = fault_kinds()["fields"]["friction"]
    assert (friction["minimum"], friction["maximum"]) == (0.0, 2.0)
