"""Sensor ports of the simulated NXT: values that a test sets, and digital sensors that answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from drivers.nxt import codes, replies, requests
from drivers.nxt.layout import Telegram

FULL_SCALE: Final = 1023
_DIGITAL: Final = (codes.SensorType.LOW_SPEED, codes.SensorType.LOW_SPEED_9V)


@dataclass(slots=True)
class InputPort:
    """One port.

    Attributes:
        raw: reading of its converter, 0 to 1023.
        digital: what answers at it: takes what was written and how many bytes are wanted. None for no such sensor.
    """

    raw: int = FULL_SCALE
    digital: Callable[[bytes, int], bytes] | None = None
    sensor_type: int = codes.SensorType.NONE
    sensor_mode: int = codes.SensorMode.RAW
    zero: int = 0
    answer: bytes = b""

    def scaled(self) -> int:
        """The value by the port's mode; modes other than boolean and percent give the raw value."""
        if self.sensor_mode == codes.SensorMode.BOOLEAN:
            return int(self.raw < FULL_SCALE // 2)
        if self.sensor_mode == codes.SensorMode.PERCENT:
            return 100 - 100 * self.raw // FULL_SCALE
        return self.raw - self.zero


class NxtInputs:
    """The four ports, and what the brick does with them.

    Attributes:
        ports: S1 to S4.
        handlers: what carries out a request, by its class: each returns a status or what was asked for.
    """

    def __init__(self) -> None:
        self.ports = tuple(InputPort() for _ in codes.Input)
        tasks: dict[type[Telegram], Callable[[InputPort, Any], Telegram | int]] = {
            requests.SetInputMode: _set_mode,
            requests.GetInputValues: _read,
            requests.ResetInputScaledValue: _reset,
            requests.LowSpeedGetStatus: _digital_status,
            requests.LowSpeedWrite: _digital_write,
            requests.LowSpeedRead: _digital_read,
        }
        self.handlers = {kind: self._with_port(task) for kind, task in tasks.items()}

    def _with_port(self, task: Callable[[InputPort, Any], Telegram | int]) -> Callable[[Any], Telegram | int]:
        def handle(request: Any) -> Telegram | int:
            return task(self.ports[request.port], request) if request.port < len(self.ports) else codes.OUT_OF_RANGE

        return handle


def _set_mode(port: InputPort, request: requests.SetInputMode) -> int:
    port.sensor_type, port.sensor_mode, port.zero = request.sensor_type, request.sensor_mode, 0
    return codes.OK


def _read(port: InputPort, request: requests.GetInputValues) -> Telegram:
    return replies.InputValues(
        request.port, True, False, port.sensor_type, port.sensor_mode, port.raw, port.raw, port.scaled(), port.raw
    )


def _reset(port: InputPort, _: requests.ResetInputScaledValue) -> int:
    port.zero = port.raw
    return codes.OK


def _digital_trouble(port: InputPort) -> int:
    if port.sensor_type not in _DIGITAL:
        return codes.NOT_CONFIGURED
    return codes.OK if port.digital is not None else codes.SENSOR_BUS_ERROR


def _digital_status(port: InputPort, _: requests.LowSpeedGetStatus) -> Telegram | int:
    return _digital_trouble(port) or replies.LowSpeedStatus(len(port.answer))


def _digital_write(port: InputPort, request: requests.LowSpeedWrite) -> int:
    trouble = _digital_trouble(port)
    if port.digital is not None and not trouble:
        port.answer = port.digital(request.data, request.answer_size)[: requests.MAX_LOW_SPEED]
    return trouble


def _digital_read(port: InputPort, _: requests.LowSpeedRead) -> Telegram | int:
    trouble = _digital_trouble(port)
    data, port.answer = port.answer, b""
    return trouble or replies.LowSpeedData(data)
