from __future__ import annotations

import canopen
import pytest

from drivers.canopen.codes import (
    ERROR_REGISTER_BITS,
    NMT_COMMANDS,
    NMT_STATES,
    SDO_ABORTS,
    NmtCommand,
    NmtState,
    emcy_class,
)
from drivers.epos.codes import EMERGENCIES, GATEWAY_ABORTS
from drivers.epos.objects import OBJECTS
from drivers.epos.value_tables import VALUE_TABLES

TROUBLE = [*SDO_ABORTS.values(), *GATEWAY_ABORTS.values(), *EMERGENCIES.values()]
EMERGENCIES_2011H = [code for code in EMERGENCIES.values() if code.code and code.register is not None]


def test_every_code_of_trouble_has_meaning_cause_cure_and_source() -> None:
    parts = {hex(code.code): (code.name, code.meaning, code.cause, code.cure, code.source) for code in TROUBLE}
    assert [code for code, texts in parts.items() if not all(texts)] == []


def test_meaning_cause_and_cure_are_sentences() -> None:
    texts = [text for code in TROUBLE for text in (code.meaning, code.cause, code.cure)]
    assert [text for text in texts if text[0].islower() or not text.endswith(".")] == []


def test_the_abort_codes_of_an_independent_implementation_are_all_there() -> None:
    known = set(canopen.SdoAbortedError.CODES) - {0x060A0023}
    assert known <= set(SDO_ABORTS)


def test_there_are_31_abort_codes_and_5_of_the_gateway() -> None:
    assert (len(SDO_ABORTS), len(GATEWAY_ABORTS)) == (31, 5)


def test_there_are_32_emergency_codes() -> None:
    assert len(EMERGENCIES) == 32


def test_every_emergency_of_the_base_firmware_has_a_fault_reaction() -> None:
    assert {code.reaction for code in EMERGENCIES_2011H} == {"D", "Q"}


def test_losing_the_master_stops_by_the_quick_stop_ramp() -> None:
    assert (EMERGENCIES[0x8130].reaction, EMERGENCIES[0x8130].register) == ("Q", 0x10)


def test_every_nmt_command_and_state_is_described() -> None:
    assert (set(NMT_COMMANDS), set(NMT_STATES)) == (set(NmtCommand), set(NmtState))


def test_the_error_register_has_eight_bits() -> None:
    assert [bit.bit for bit in ERROR_REGISTER_BITS] == list(range(8))


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x8611, "monitoring"),
        (0x2310, "current at the output side"),
        (0x5441, "device hardware"),
        (0xB000, "unknown kind"),
    ],
)
def test_an_unknown_emergency_is_named_by_its_class(code: int, words: str) -> None:
    assert emcy_class(code) == words


@pytest.mark.parametrize("name", VALUE_TABLES)
def test_value_tables_belong_to_objects_and_stay_within_their_limits(name: str) -> None:
    entry = OBJECTS[name]
    assert all((entry.low or 0) <= value <= (255 if entry.high is None else entry.high) for value in VALUE_TABLES[name])
