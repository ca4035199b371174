"""LSS frames and SDO block transfers in words: what this project's own codecs make is read back."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen import lss, sdo_block
from drivers.explain_frame import frame_readings

ME = lss.Identity(0xFB, 0x192, 0x2210, 0x77)

SAID = [
    (0x7E5, lss.make_switch_global(True), "request: all devices into configuration"),
    (0x7E5, lss.make_switch_global(False), "request: all devices into waiting"),
    (0x7E5, lss.make_select(ME)[0], "request: select the device with vendor number 0xFB"),
    (0x7E5, lss.make_select(ME)[3], "request: select the device with serial number 0x77"),
    (0x7E5, lss.make_inquire(1), "request: tell your product number"),
    (0x7E5, lss.make_set_node_id(7), "request: take node id 7"),
    (0x7E5, lss.make_set_bit_timing(250_000), "request: take 250000 bit/s"),
    (0x7E5, lss.make_activate(500), "request: change the bit rate after 500 ms"),
    (0x7E5, lss.make_store(), "request: keep node id and bit rate"),
    (0x7E5, lss.make_fast_scan(0, 0x80, 0, 0), "is any device without a node id there"),
    (0x7E5, lss.make_fast_scan(0xF0, 4, 3, 3), "a serial number 0xF0, compared down to bit 4"),
    (0x7E4, bytes.fromhex("4400000000000000"), "answer: selected"),
    (0x7E4, bytes.fromhex("1100000000000000"), "answer: node id done"),
    (0x7E4, bytes.fromhex("1301000000000000"), "answer: bit rate refused"),
    (0x7E4, bytes.fromhex("5AFB000000000000"), "answer: vendor number 0xFB"),
    (0x7E4, bytes.fromhex("5E05000000000000"), "answer: node id 5"),
    (0x7E4, b"\x44", "malformed"),
    (0x605, sdo_block.make_block_download(0x1010, 1, 500), "write 0x1010/1 in blocks, 500 bytes"),
    (0x605, sdo_block.make_block_upload(0x1008, 0, 32), "read 0x1008/0 in blocks of 32 segments"),
    (0x605, sdo_block.make_upload_start(), "send the first block"),
    (0x605, sdo_block.make_block_answer(5, 32), "received up to segment 5"),
    (0x605, sdo_block.make_download_end(500, 0xBEEF), "checksum 0xBEEF"),
    (0x605, sdo_block.make_upload_end(), "all blocks received"),
    (0x585, bytes.fromhex("A4101001 20000000"), "0x1010/1 may be written in blocks of 32 segments"),
    (0x585, bytes.fromhex("C6081000 F4010000"), "0x1008/0 comes in blocks, 500 bytes"),
    (0x585, bytes.fromhex("A205200000000000"), "received up to segment 5; the next block may have 32"),
    (0x585, bytes.fromhex("E500000000000000"), "command byte 0xE5"),
]


@pytest.mark.parametrize(("can_id", "data", "words"), SAID, ids=[words for _, _, words in SAID])
def test_a_frame_is_put_into_words(can_id: int, data: bytes, words: str) -> None:
    (reading,) = frame_readings(f"{can_id:03X}#{data.hex().upper()}")
    assert words in reading.title + reading.meaning


@given(can_id=st.sampled_from([0x7E4, 0x7E5, 0x585, 0x605]), data=st.binary(max_size=8))
def test_any_bytes_have_a_reading(can_id: int, data: bytes) -> None:
    assert all(reading.title for reading in frame_readings(f"{can_id:03X}#{data.hex().upper()}"))
