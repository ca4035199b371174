"""The SDO server of a simulated node: expedited and segmented transfer, block transfer as an option (CiA 301 7.2.4)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.simulated.dictionary import TOO_LONG, WRONG_LENGTH, SdoAbort, SimulatedDictionary
from drivers.simulated.sdo_block_server import BlockServer

UNKNOWN_COMMAND = 0x0504_0001
TOGGLE_NOT_ALTERNATED = 0x0503_0000
OUT_OF_MEMORY = 0x0504_0005

_MAX_DOWNLOAD = 1024
"""Bytes that the server takes in one download."""

_INITIATE = struct.Struct("<BHB4s")
_ABORT = struct.Struct("<BHBI")


@dataclass(slots=True)
class _Transfer:
    """A segmented transfer that is under way."""

    index: int
    sub: int
    upload: bool
    data: bytearray
    size: int | None
    toggle: int = 0


class SdoServer:
    """Answers SDO requests from a dictionary.

    Args:
        dictionary: what is read and written.
        blocks: its block transfer; None for a node without.
    """

    def __init__(self, dictionary: SimulatedDictionary, blocks: BlockServer | None = None) -> None:
        self._dictionary = dictionary
        self._blocks = blocks
        self._transfer: _Transfer | None = None

    def reset(self) -> None:
        """Forget a transfer that is under way."""
        self._transfer = None
        if self._blocks is not None:
            self._blocks.reset()

    def answer(self, request: bytes) -> bytes | None:
        """The answer to a request of 8 bytes; None where the protocol gives none (the client's abort)."""
        command, index, sub, _ = _INITIATE.unpack(request)
        service = command >> 5
        blocks = self._blocks
        receiving = blocks is not None and blocks.receiving
        if command == 0x80 or (service == 4 and not receiving):
            self.reset()
            return None
        if service in (0, 3) and self._transfer is not None:
            index, sub = self._transfer.index, self._transfer.sub
        elif blocks is not None and blocks.address is not None:
            index, sub = blocks.address
        try:
            if blocks is not None and (receiving or service in (5, 6)):
                return _serve_block(blocks, request)
            return self._serve(service, request, index, sub)
        except SdoAbort as abort:
            self.reset()
            return _ABORT.pack(0x80, index, sub, abort.code)

    def _serve(self, service: int, request: bytes, index: int, sub: int) -> bytes:
        if service == 0:
            return self._download_segment(request)
        if service == 1:
            return self._initiate_download(request, index, sub)
        if service == 2:
            return self._initiate_upload(index, sub)
        if service == 3:
            return self._upload_segment(request)
        raise SdoAbort(UNKNOWN_COMMAND)

    def _initiate_upload(self, index: int, sub: int) -> bytes:
        self._transfer = None
        data = self._dictionary.read(index, sub)
        if 1 <= len(data) <= 4:
            return _INITIATE.pack(0x43 | (4 - len(data)) << 2, index, sub, data)
        self._transfer = _Transfer(index, sub, True, bytearray(data), None)
        return _INITIATE.pack(0x41, index, sub, len(data).to_bytes(4, "little"))

    def _upload_segment(self, request: bytes) -> bytes:
        transfer = self._running(upload=True, toggle=request[0] >> 4 & 1)
        segment = bytes(transfer.data[:7])
        del transfer.data[:7]
        last = not transfer.data
        head = transfer.toggle << 4 | (7 - len(segment)) << 1 | last
        transfer.toggle ^= 1
        if last:
            self._transfer = None
        return bytes((head,)) + segment.ljust(7, b"\0")

    def _initiate_download(self, request: bytes, index: int, sub: int) -> bytes:
        self._transfer = None
        command, sized = request[0], request[0] & 0x01
        if command & 0x02:
            self._dictionary.write(index, sub, request[4 : 8 - (command >> 2 & 3)] if sized else self._fit(request))
        else:
            self._dictionary.find(index, sub)
            size = int.from_bytes(request[4:8], "little") if sized else None
            if size is not None and size > _MAX_DOWNLOAD:
                raise SdoAbort(OUT_OF_MEMORY)
            self._transfer = _Transfer(index, sub, False, bytearray(), size)
        return _INITIATE.pack(0x60, index, sub, b"")

    def _fit(self, request: bytes) -> bytes:
        """Data of an expedited download that does not tell its size: as long as the object is."""
        bits = self._dictionary.find(request[1] | request[2] << 8, request[3]).type.bits
        return request[4 : 4 + bits // 8] if 0 < bits <= 32 else request[4:8]

    def _download_segment(self, request: bytes) -> bytes:
        transfer = self._running(upload=False, toggle=request[0] >> 4 & 1)
        transfer.data += request[1 : 8 - (request[0] >> 1 & 7)]
        if len(transfer.data) > (_MAX_DOWNLOAD if transfer.size is None else transfer.size):
            raise SdoAbort(TOO_LONG)
        if request[0] & 1:
            self._finish_download(transfer)
        head = 0x20 | transfer.toggle << 4
        transfer.toggle ^= 1
        return bytes((head,)) + bytes(7)

    def _finish_download(self, transfer: _Transfer) -> None:
        if transfer.size is not None and len(transfer.data) != transfer.size:
            raise SdoAbort(WRONG_LENGTH)
        self._dictionary.write(transfer.index, transfer.sub, bytes(transfer.data))
        self._transfer = None

    def _running(self, *, upload: bool, toggle: int) -> _Transfer:
        transfer = self._transfer
        if transfer is None or transfer.upload is not upload:
            raise SdoAbort(UNKNOWN_COMMAND)
        if toggle != transfer.toggle:
            raise SdoAbort(TOGGLE_NOT_ALTERNATED)
        return transfer


def _serve_block(blocks: BlockServer, request: bytes) -> bytes | None:
    """A request of a block transfer: a segment, or client command 6 (download) or 5 (upload) with its sub-command."""
    if blocks.receiving:
        return blocks.take_segment(request)
    if request[0] >> 5 == 6:
        return blocks.end_download(request) if request[0] & 1 else blocks.begin_download(request)
    return blocks.continue_upload(request) if request[0] & 3 else blocks.begin_upload(request)
