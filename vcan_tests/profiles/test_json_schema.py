"""The JSON Schema for editors."""

from __future__ import annotations

from typing import Any

import pytest

from profiles.json_schema import json_schema


@pytest.fixture(scope="module")
def definitions() -> dict[str, Any]:
    """The schema's definitions by class."""
    found: dict[str, Any] = json_schema()["$defs"]
    return found


def test_a_fields_docstring_is_its_description(definitions: dict[str, Any]) -> None:
    assert definitions["DriveConfig"]["properties"]["belt_ratio"]["description"].startswith(
        "Turns of the gear's output"
    )


def test_every_mapping_may_extend_another(definitions: dict[str, Any]) -> None:
    assert all("extends" in definition["properties"] for definition in definitions.values())


def test_a_file_that_extends_may_leave_everything_out(definitions: dict[str, Any]) -> None:
    assert not any("required" in definition for definition in definitions.values())


def test_a_node_id_has_its_range(definitions: dict[str, Any]) -> None:
    node = definitions["DriveConfig"]["properties"]["node"]
    assert (node["minimum"], node["maximum"]) == (1, 127)


def test_an_unknown_key_is_refused(definitions: dict[str, Any]) -> None:
    assert definitions["Limits"]["additionalProperties"] is False


@pytest.mark.parametrize(
    ("part", "field"),
    [("SensorDefects", "hysteresis_deg"), ("LocalisationConfig", "way_noise_m"), ("SteeredAxle", "drive")],
)
def test_parts_from_files_of_their_own_are_described_too(part: str, field: str) -> None:
    assert json_schema()["$defs"][part]["properties"][field]["description"]
