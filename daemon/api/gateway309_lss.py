"""The LSS commands of the CiA 309-3 gateway, carried out by the LSS master (CiA 305)."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Container

from canhelm.errors import DeviceFault, NodeAbsent, Refused
from daemon.api.gateway309_answers import ErrorNumber, GatewayError
from drivers.canopen.lss import BIT_TIMINGS, Identity, LssMaster

FAST_SCAN_TIMEOUT_MS = 100
"""How long devices may take to answer each question of a fast scan, unless the request says it."""
FIRST_NODE = 2
"""First node id that ``lss_allnodes`` gives, unless the request says it."""
_VENDOR_ERROR = 0xFF
_BIT_RATES = {index: bit_rate for bit_rate, index in BIT_TIMINGS.items()}


class LssCommands:
    """Carries out LSS commands.

    Args:
        lss: the master.
        taken: node ids that ``lss_allnodes`` must not give away.
    """

    def __init__(self, lss: LssMaster, taken: Container[int]) -> None:
        self._lss = lss
        self._taken = taken
        self._handlers: dict[str, Callable[[tuple[int, ...]], Awaitable[str]]] = {
            "lss_switch_glob": self._switch_global,
            "lss_switch_sel": self._switch_selective,
            "lss_set_node": self._set_node,
            "lss_conf_bitrate": self._set_bit_rate,
            "lss_activate_bitrate": self._activate,
            "lss_store": self._store,
            "lss_inquire_addr": self._inquire_address,
            "lss_get_node": self._inquire_node,
            "_lss_fastscan": self._fast_scan,
            "lss_allnodes": self._all_nodes,
        }

    async def carry_out(self, name: str, numbers: tuple[int, ...]) -> str:
        """Carry out one command.

        Args:
            name: the command's word.
            numbers: its numbers, in range.

        Returns:
            The value for its answer, or ``OK``.

        Raises:
            GatewayError: the device does not answer or refuses.
        """
        try:
            return await self._handlers[name](numbers)
        except (NodeAbsent, DeviceFault) as error:
            raise GatewayError(ErrorNumber.TIME_OUT, error.message) from None

    async def _switch_global(self, numbers: tuple[int, ...]) -> str:
        self._lss.switch_global(bool(numbers[0]))
        return "OK"

    async def _switch_selective(self, numbers: tuple[int, ...]) -> str:
        await self._lss.select(Identity(*numbers))
        return "OK"

    async def _set_node(self, numbers: tuple[int, ...]) -> str:
        if not numbers[0]:
            raise GatewayError(ErrorNumber.LSS_NODE_ID, "0 stands for all nodes; give 1 to 127, or 255 for none")
        return await _confirmed(self._lss.set_node_id(numbers[0]), ErrorNumber.LSS_NODE_ID)

    async def _set_bit_rate(self, numbers: tuple[int, ...]) -> str:
        bit_rate = _BIT_RATES.get(numbers[1])
        if bit_rate is None:
            raise GatewayError(ErrorNumber.LSS_BIT_RATE)
        return await _confirmed(self._lss.set_bit_rate(bit_rate), ErrorNumber.LSS_BIT_RATE)

    async def _activate(self, numbers: tuple[int, ...]) -> str:
        self._lss.activate(numbers[0])
        return "OK"

    async def _store(self, numbers: tuple[int, ...]) -> str:
        return await _confirmed(self._lss.store(), ErrorNumber.LSS_STORE)

    async def _inquire_address(self, numbers: tuple[int, ...]) -> str:
        identity = await self._lss.inquire_identity()
        return _words(identity) if not numbers else f"0x{identity[numbers[0]]:08X}"

    async def _inquire_node(self, numbers: tuple[int, ...]) -> str:
        return f"0x{await self._lss.inquire_node_id():02X}"

    async def _fast_scan(self, numbers: tuple[int, ...]) -> str:
        found = await self._lss.find(_answer_time_s(numbers))
        if found is None:
            raise GatewayError(ErrorNumber.TIME_OUT, "no device is without a node id")
        return _words(found)

    async def _all_nodes(self, numbers: tuple[int, ...]) -> str:
        """Give a node id to every device that has none: find one, name it, store it, let it go, look for the next."""
        if any(numbers[3::2]):
            raise GatewayError(ErrorNumber.NOT_SUPPORTED, "only searches for every identity (SCAN 0) are supported")
        first, store = numbers[1:3] if len(numbers) > 1 else (FIRST_NODE, True)
        lines = []
        for node in (node for node in range(first, 128) if node not in self._taken):
            found = await self._lss.find(_answer_time_s(numbers))
            if found is None:
                break
            await _confirmed(self._lss.set_node_id(node), ErrorNumber.LSS_NODE_ID)
            if store:
                await _confirmed(self._lss.store(), ErrorNumber.LSS_STORE)
            self._lss.switch_global(False)
            lines.append(f"# node {node}: {_words(found)}\n")
        return "".join(lines) + f"# devices that were given a node id: {len(lines)}"


def _answer_time_s(numbers: tuple[int, ...]) -> float:
    return (numbers[0] if numbers and numbers[0] else FAST_SCAN_TIMEOUT_MS) / 1e3


def _words(identity: Identity) -> str:
    return " ".join(f"0x{number:08X}" for number in identity)


async def _confirmed(service: Awaitable[None], refused: ErrorNumber) -> str:
    try:
        await service
    except Refused as error:
        number = ErrorNumber.LSS_VENDOR if error.value == _VENDOR_ERROR else refused
        raise GatewayError(number, error.message) from None
    except DeviceFault as error:
        raise GatewayError(ErrorNumber.LSS_MEDIA, error.message) from None
    return "OK"
