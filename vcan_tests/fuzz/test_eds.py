"""Any EDS or DCF file: its objects and values are read, what was left out is told, or it is refused with its name."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.dcf import make_dcf, make_eds
from drivers.canopen.eds import load_eds, object_table
from drivers.canopen.eds_text import read_eds_text
from drivers.epos.parameters import EPOS_24_5, SETTINGS
from vcan_tests.drivers.test_eds import NODE_3
from vcan_tests.fuzz.files import file_of, read_or_told
from vcan_tests.fuzz.mutation import damaged, damaged_text
from vcan_tests.fuzz.target import Target, few

NAME = "device.eds"
NODE = 3
SOME = SETTINGS[:: max(len(SETTINGS) // 12, 1)]
USUAL = (
    make_eds(SOME, EPOS_24_5).encode(),
    make_dcf(SOME, EPOS_24_5, NODE_3, {(entry.index, entry.sub): 1 for entry in SOME}).encode(),
    b"[1018]\nParameterName=Identity\nObjectType=0x9\nSubNumber=2\n"
    b"[1018sub0]\nParameterName=Highest\nDataType=0x0005\nAccessType=ro\nDefaultValue=1\n"
    b"[2000]\nParameterName=Values\nObjectType=0x8\nDataType=0x0004\nAccessType=rw\nCompactSubObj=4\n"
    b"[2001]\nParameterName=Speed\nDataType=0x0008\nAccessType=rw\nDefaultValue=1.5\nLowLimit=-2\nHighLimit=3\n"
    b"[2002]\nParameterName=COB-ID\nDataType=0x0007\nAccessType=rw\nDefaultValue=$NODEID+0x200\nPDOMapping=1\n",
)


def attempt(content: bytes) -> None:
    with file_of(content, NAME) as path:
        text = read_or_told(lambda: read_eds_text(path), path)
        loaded = read_or_told(lambda: load_eds(path, NODE), path)
        assert (text is None) == (loaded is None)
        if text is not None and loaded is not None:
            assert all(isinstance(value, int) for value in text.values(NODE).values())
            object_table(loaded.dictionary, NAME)


EDS = Target("eds", damaged_text(USUAL) | damaged(USUAL) | st.sampled_from(USUAL), attempt)


@few(30)
@given(EDS.inputs)
def test_an_eds_file_is_read_or_refused_with_its_name(content: bytes) -> None:
    EDS.check(content)
