"""EDS and DCF files: what this program writes is read by others, and what others write badly is read with warnings."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from canopen.objectdictionary import ODRecord, ODVariable
from canopen.objectdictionary.eds import export_dcf, import_eds
from hypothesis import given
from hypothesis import strategies as st

from canhelm.errors import ConfigError
from drivers.canopen.dcf import Commissioning, make_dcf, make_eds
from drivers.canopen.eds import dictionary_of, load_eds, object_table
from drivers.canopen.eds_text import EdsText, parse_eds_text, parse_number
from drivers.epos.objects import OBJECTS
from drivers.epos.parameters import EPOS_24_5, SETTINGS

NODE_3 = Commissioning(3, "front_left", 1_000_000)
EDS = make_eds(OBJECTS.objects, EPOS_24_5)


def parsed(text: str) -> EdsText:
    return parse_eds_text(text.encode(), "vendor.eds")


def value_of(text: EdsText, index: int) -> ODVariable:
    """A variable as the library canopen reads it."""
    found = dictionary_of(text)[index]
    assert isinstance(found, ODVariable)
    return found


def variable(address: str = "2000", **more: str) -> str:
    """A section of an object that is right but for what is given."""
    keys = {"ParameterName": "thing", "ObjectType": "0x7", "DataType": "0x0007", "AccessType": "rw"} | more
    return "\n".join([f"[{address}]", *(f"{key}={value}" for key, value in keys.items()), ""])


# --- what is written -------------------------------------------------------------------------------------------------


def test_a_written_eds_file_needs_no_mending() -> None:
    assert parsed(EDS).warnings == ()


def test_the_library_canopen_reads_every_object_as_it_was_written() -> None:
    read = object_table(dictionary_of(parsed(EDS), 3), "test")
    for entry in OBJECTS.objects:
        found = read.by_address[entry.index, entry.sub]
        default = int(entry.default or 0) + 3 if entry.plus_node_id else entry.default
        as_written = (entry.type, entry.access, entry.low, entry.high, default)
        assert (found.type, found.access, found.low, found.high, found.default) == as_written, entry.address


@st.composite
def settings(draw: st.DrawFn) -> tuple[tuple[int, int], int]:
    """A setting, and a value that its type can hold."""
    entry = draw(st.sampled_from(SETTINGS))
    low = -(1 << (entry.type.bits - 1)) if entry.type.name.startswith("I") else 0
    return (entry.index, entry.sub), draw(st.integers(low, low + (1 << entry.type.bits) - 1))


@given(st.lists(settings(), max_size=5))
def test_every_setting_comes_back_from_a_dcf_file(chosen: list[tuple[tuple[int, int], int]]) -> None:
    values = dict(chosen)
    entries = [entry for entry in SETTINGS if (entry.index, entry.sub) in values]
    read = parsed(make_dcf(entries, EPOS_24_5, NODE_3, values))
    assert (read.warnings, read.values(3)) == ((), values)


def test_the_library_canopen_reads_the_same_settings_negative_ones_too() -> None:
    values = {(0x607D, 1): -5, (0x2210, 1): 500, (0x1400, 1): 0x203}
    dictionary = import_eds(io.StringIO(make_dcf(SETTINGS, EPOS_24_5, NODE_3, values)), None)  # type: ignore[no-untyped-call]
    assert (dictionary.node_id, dictionary.bitrate) == (3, 1_000_000)
    assert {address: dictionary[address[0]][address[1]].value for address in values} == values


def test_an_identifier_follows_the_node_that_the_file_is_applied_to() -> None:
    file = make_dcf(SETTINGS, EPOS_24_5, NODE_3, {(0x1400, 1): 0x203, (0x6083, 0): 3})
    assert parsed(file).values(4) == {(0x1400, 1): 0x204, (0x6083, 0): 3}


def test_a_file_that_the_library_canopen_writes_is_read() -> None:
    dictionary = dictionary_of(parsed(make_dcf(SETTINGS, EPOS_24_5, NODE_3, {(0x6083, 0): 4000})))
    written = io.StringIO()
    export_dcf(dictionary, written)  # type: ignore[no-untyped-call]
    read = parsed(written.getvalue())
    assert read.warnings == ()
    assert read.values(3) == {(0x6083, 0): 4000}


# --- what vendors write ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [("0x1F", 31), ("1Fh", 31), ("001", 1), ("0.0", 0), (" 12 ", 12), ("-5", -5), ("0X0a", 10), ("+7", 7)],
)
def test_a_number_is_read_as_people_write_it(text: str, value: int) -> None:
    assert parse_number(text) == value


@pytest.mark.parametrize("text", ["", "x", "1.5", "0x", "--1", "1e3", "$NODEID$NODEID0x1x", "9" * 60])
def test_what_is_no_whole_number_is_none(text: str) -> None:
    assert parse_number(text) is None


@pytest.mark.parametrize("text", ["$NODEID+0x200", "0x200+$NODEID", "$nodeid + 0x200", " $NODEID+ 512"])
def test_an_identifier_with_the_node_id_is_read_in_every_form(text: str) -> None:
    assert parse_number(text, 5) == 0x205


BROKEN = [
    (variable(DefaultValue="001"), "vendor.eds:6: DefaultValue=001 in [2000] is read as 1"),
    (variable(DefaultValue="0.0"), "vendor.eds:6: DefaultValue=0.0 in [2000] is read as 0"),
    (variable(DefaultValue="1.5"), "vendor.eds:6: DefaultValue=1.5 in [2000] is no whole number; left out"),
    (variable(HighLimit="0x1FFFFFFFF"), "vendor.eds:6: HighLimit=0x1FFFFFFFF in [2000] does not fit 32 bits; left out"),
    (variable(DataType="0x99"), "vendor.eds:4: data type 0x99 of [2000] is read as bytes"),
    (variable(DataType="text"), "vendor.eds:1: [2000] has no DataType; left out"),
    (variable(AccessType="readwrite"), "vendor.eds:5: [2000] has no AccessType; read as ro"),
    (variable(ParameterName=""), "vendor.eds:1: [2000] has no ParameterName"),
    (variable("2001sub1"), "vendor.eds:1: [2001sub1] has no [2001]; one was added"),
    (variable("2001 sub 1"), "vendor.eds:1: [2001 sub 1] is read as [2001sub1]"),
    (variable() + variable("2000sub1"), "vendor.eds:1: [2000] has entries; it is read as a record"),
    (variable() + variable(), "vendor.eds:6: [2000] stands here twice; the first counts (line 1)"),
    (variable() + "AccessType=ro", "vendor.eds:6: AccessType stands in [2000] twice; the first counts"),
    (variable() + "what is this", "vendor.eds:6: what is this is neither section nor entry; left out"),
    (variable().replace("]", ""), "vendor.eds:1: [2000 has no closing bracket"),
    ("[DeviceInfo]\nNrOfRXPDO=many\n" + variable(), "vendor.eds:2: NrOfRXPDO=many in [DeviceInfo] is no whole number"),
]


@pytest.mark.parametrize(("text", "warning"), BROKEN, ids=[warning for _, warning in BROKEN])
def test_a_vendors_mistake_is_told_with_its_line_and_the_rest_is_read(text: str, warning: str) -> None:
    read = parsed(text + "\n" + variable("3000", DefaultValue="7"))
    assert any(found.startswith(warning) for found in read.warnings), read.warnings
    assert value_of(read, 0x3000).default == 7


@pytest.mark.parametrize(
    "written", ["LowLimit=", "DefaultValue=", "PDOMapping=0", "; a comment", "DefaultValue=5 ; five"]
)
def test_what_is_usual_is_not_complained_about(written: str) -> None:
    assert parsed(variable() + written).warnings == ()


def test_a_negative_default_in_twos_complement_is_negative() -> None:
    read = value_of(parsed(variable(DataType="0x0003", DefaultValue="0xFFFF", LowLimit="0x8000")), 0x2000)
    assert (read.default, read.min) == (-1, -32768)


def test_an_entry_without_its_record_is_in_the_dictionary() -> None:
    record = dictionary_of(parsed(variable("2001sub1")))[0x2001]
    assert isinstance(record, ODRecord)
    assert record[1].name == "thing"


def test_line_ends_and_encodings_of_all_kinds_are_read() -> None:
    text = variable(ParameterName="Größe").replace("\n", "\r\n")
    for content in (text.encode(), text.encode("latin-1"), text.encode("utf-8-sig")):
        assert parse_eds_text(content).objects[0x2000, None].values["ParameterName"] == "Größe"


@given(st.binary(max_size=400))
def test_any_bytes_end_without_an_exception(content: bytes) -> None:
    dictionary_of(parse_eds_text(content))


LINES = EDS.splitlines()[40:400]


@given(st.lists(st.tuples(st.integers(0, len(LINES) - 1), st.text("[]=;0x$NODEIDsub. -\t", max_size=12)), max_size=12))
def test_a_file_with_damaged_lines_is_read(damage: list[tuple[int, str]]) -> None:
    lines = list(LINES)
    for place, text in damage:
        lines[place] = lines[place][: len(text)] + text
    dictionary_of(parsed("\n".join(lines)))


def test_a_file_that_holds_nothing_is_refused(tmp_path: Path) -> None:
    for content in (None, b"", b"\x00\xff"):
        path = tmp_path / "empty.eds"
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(ConfigError, match=r"empty\.eds"):
            load_eds(path)


def test_an_entry_whose_name_begins_with_a_colon_is_left_out_with_its_line() -> None:
    text = parsed("[2000]\n:=\nParameterName=speed\nDataType=0x7\nAccessType=rw\n:x=1\n")
    assert [warning.partition(" ")[0] for warning in text.warnings] == ["vendor.eds:2:", "vendor.eds:6:"]
    assert dictionary_of(text)[0x2000].name == "speed"


def test_what_the_library_cannot_read_is_told_with_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ValueError("no")

    monkeypatch.setattr("drivers.canopen.eds.import_eds", fail)
    path = tmp_path / "odd.eds"
    path.write_text("[2000]\nParameterName=speed\nDataType=0x7\nAccessType=rw\n")
    with pytest.raises(ConfigError, match=r"odd\.eds: the library canopen cannot read the file: no"):
        load_eds(path)
