"""A first look at the EPOS 24/5 on a serial line, whose node id nobody knows yet."""

from __future__ import annotations

from drivers.canopen.objects import ObjectDef
from drivers.epos.first_look import FirstLook, first_look
from drivers.epos.objects import OBJECTS
from drivers.epos.serial_conversation import Transport
from drivers.epos.serial_frames import make_read_object
from drivers.epos.serial_handshake import Exchange
from drivers.epos.serial_line import SerialLine

ITSELF = 0
"""Node id by which a request means the drive on the line (maxon EPOS Communication Guide 6.3)."""
NODE_MASK = 0x7F


async def first_look_over(transport: Transport, exchange: Exchange, baud: int, name: str) -> FirstLook:
    """Look at the drive on a line; its identifier for SDO tells its node id, whichever switches have set it.

    Args:
        transport: an open line.
        exchange: how one request and its answer go over it.
        baud: bit/s of the line.
        name: the device, for people.

    Raises:
        Refused: it is no EPOS 24/5.
        BusOff, Timeout, Aborted: the drive does not answer, or lacks an object.
    """
    line = SerialLine(transport, baud, name, exchange)

    async def read(entry: ObjectDef) -> int:
        answer = await line.request(make_read_object(ITSELF, entry.index, entry.sub))
        return int.from_bytes(answer.data[: entry.type.bits // 8], "little")

    return await first_look(await read(OBJECTS["cob_id_sdo_client_to_server"]) & NODE_MASK, read)
