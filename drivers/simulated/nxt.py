"""A simulated NXT brick: it carries out telegrams and answers as late as one over Bluetooth.

Time is caught up with when a telegram comes or somebody looks: nothing runs in between. Assumed where LEGO's documents
are silent: how long things take, the battery's resistance, that a sleeping brick just falls silent.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Final

from drivers.nxt import codes, replies, requests
from drivers.nxt.layout import Telegram
from drivers.nxt.telegrams import Reply, Unframer, make_frame, make_reply, parse_request
from drivers.simulated.nxt_inputs import NxtInputs
from drivers.simulated.nxt_motor import TICK_S, MotorConstants, NxtMotor
from drivers.simulated.serial_wire import SerialCable

BLUETOOTH_BIT_S: Final = 721_000
"""Net rate of Bluetooth; no terminal has it, so a terminal's rate does not matter, as on a real one."""
MAILBOXES: Final = 20
MAILBOX_DEPTH: Final = 5
FIRMWARE: Final = replies.FirmwareVersion(124, 1, 31, 1)


@dataclass(frozen=True, slots=True)
class NxtTiming:
    """How fast the brick is.

    Attributes:
        execute_s: for a request without a reply.
        turnaround_s: from a request to its reply: the radio goes from receiving to sending.
        switch_s: after a reply until the brick hears again.
    """

    execute_s: float = 0.002
    turnaround_s: float = 0.03
    switch_s: float = 0.03


BLUETOOTH: Final = NxtTiming()
USB: Final = NxtTiming(0.001, 0.001, 0.0)


class SimulatedNxt:
    """One brick with three motors.

    Args:
        name: what it calls itself.
        motors: constants of those at A, B and C.
        timing: how fast it is.

    Attributes:
        cable: its line; the host writes to it, or a :class:`SerialPty` does.
        motors: outputs A, B and C.
        inputs: its four sensor ports.
        battery_v: voltage without load.
        battery_ohm: resistance of the battery.
        files: programs and sounds on it.
        program: the one that runs.
        sleep_limit_s: time without a keep-alive after which it falls asleep; 0 for never.
        mute: set it to True to let nothing be heard of it.
        refuse: status to answer by opcode, instead of doing what is asked.
        on_tick: called after each millisecond in which a motor turns.
        bad_telegrams: what it did not understand.
        carried_out: requests by their class.
    """

    def __init__(
        self,
        name: str = "NXT",
        motors: Iterable[MotorConstants] = (MotorConstants(),) * 3,
        timing: NxtTiming = BLUETOOTH,
    ) -> None:
        self.name = name
        self.motors = tuple(map(NxtMotor, motors))
        self.inputs = NxtInputs()
        self.battery_v = 8.0
        self.battery_ohm = 0.4
        self.files = {"demo.rxe", "! Attention.rso"}
        self.program: str | None = None
        self.mailboxes: tuple[deque[bytes], ...] = tuple(deque(maxlen=MAILBOX_DEPTH) for _ in range(MAILBOXES))
        self.sleep_limit_s = 600.0
        self.mute = False
        self.refuse: dict[int, int] = {}
        self.on_tick: Callable[[], None] | None = None
        self.bad_telegrams = 0
        self.carried_out: dict[type[Telegram], int] = {}
        self.cable = SerialCable(BLUETOOTH_BIT_S, self._receive)
        self._timing = timing
        self._unframer = Unframer()
        self._now_s = self._alive_s = asyncio.get_running_loop().time()
        self._ready_s = self._now_s
        self._handlers = self._make_handlers()

    # Time

    def catch_up(self, to_s: float | None = None) -> None:
        """Let the motors turn up to loop time ``to_s``, now by default."""
        end_s = asyncio.get_running_loop().time() if to_s is None else to_s
        ticks = int((end_s - self._now_s) / TICK_S + 1e-6)
        for _ in range(ticks):
            if all(motor.at_rest for motor in self.motors):
                break
            battery_v = self.loaded_battery_v
            for motor in self.motors:
                motor.tick(battery_v)
            if self.on_tick is not None:
                self.on_tick()
        self._now_s += max(ticks, 0) * TICK_S

    @property
    def loaded_battery_v(self) -> float:
        """The battery's voltage with what the motors take."""
        return self.battery_v - self.battery_ohm * sum(motor.current_a for motor in self.motors)

    # The line

    def _receive(self, data: bytes, end_s: float) -> None:
        for telegram in self._unframer.feed(data):
            at_s = max(end_s, self._ready_s)
            if telegram[0] & codes.NO_REPLY:
                self._ready_s = at_s + self._timing.execute_s
            else:
                self._ready_s = at_s + self._timing.turnaround_s + self._timing.switch_s
            asyncio.get_running_loop().call_at(at_s, self._execute, telegram, at_s)

    def _execute(self, telegram: bytes, at_s: float) -> None:
        self.catch_up(at_s)
        if self._fallen_asleep(at_s) or self.mute:
            return
        reply = self._answer(telegram)
        if not telegram[0] & codes.NO_REPLY:
            self.cable.to_host.send(make_frame(make_reply(reply)), at_s + self._timing.turnaround_s)

    def _fallen_asleep(self, at_s: float) -> bool:
        asleep = 0 < self.sleep_limit_s < at_s - self._alive_s
        if asleep:
            self._stop_motors()
        return asleep

    def switch_off(self) -> None:
        """No power: motors coast, and all counts are gone when it is on again."""
        self.catch_up()
        self._stop_motors()
        self.program = None
        for motor in self.motors:
            motor.forget_counts()

    def _answer(self, telegram: bytes) -> Reply:
        opcode, request = telegram[1], parse_request(telegram)
        if isinstance(request, str):
            self.bad_telegrams += 1
            known = (telegram[0] & ~codes.NO_REPLY, opcode) in requests.REQUESTS
            return Reply(opcode, codes.INSANE_PACKET if known else codes.UNKNOWN_OPCODE)
        if opcode in self.refuse:
            return Reply(opcode, self.refuse[opcode])
        kind = type(request.content)
        self.carried_out[kind] = self.carried_out.get(kind, 0) + 1
        result = self._handlers[kind](request.content)
        return Reply(opcode, result) if isinstance(result, int) else Reply(opcode, codes.OK, result)

    # Commands: each returns a status or what it was asked for

    def _make_handlers(self) -> dict[type[Telegram], Callable[[Any], Telegram | int]]:
        return {
            requests.StartProgram: self._start_program,
            requests.StopProgram: self._stop_program,
            requests.PlaySoundFile: lambda request: codes.OK if request.file_name in self.files else codes.OUT_OF_RANGE,
            requests.PlayTone: lambda _: codes.OK,
            requests.SetOutputState: self._set_output,
            requests.GetOutputState: self._get_output,
            requests.ResetMotorPosition: self._reset_position,
            requests.MessageWrite: self._write_message,
            requests.MessageRead: self._read_message,
            requests.GetBatteryLevel: lambda _: replies.BatteryLevel(round(self.loaded_battery_v * 1000)),
            requests.StopSound: lambda _: codes.OK,
            requests.KeepAlive: self._keep_alive,
            requests.GetCurrentProgram: self._current_program,
            requests.GetFirmwareVersion: lambda _: FIRMWARE,
            requests.SetBrickName: self._set_name,
            requests.GetDeviceInfo: lambda _: replies.DeviceInfo(self.name, "00:16:53:01:02:03", bytes(4), 65536),
            **self.inputs.handlers,
        }

    def _set_output(self, request: requests.SetOutputState) -> int:
        if request.port == codes.Output.ALL:
            for motor in self.motors:
                motor.set_output(request)
        elif request.port < len(self.motors):
            self.motors[request.port].set_output(request)
        else:
            return codes.OUT_OF_RANGE
        return codes.OK

    def _get_output(self, request: requests.GetOutputState) -> Telegram | int:
        if request.port >= len(self.motors):
            return codes.OUT_OF_RANGE
        return self.motors[request.port].state(request.port)

    def _reset_position(self, request: requests.ResetMotorPosition) -> int:
        if request.port >= len(self.motors):
            return codes.OUT_OF_RANGE
        self.motors[request.port].reset_position(request.relative)
        return codes.OK

    def _stop_motors(self) -> None:
        self._set_output(requests.SetOutputState(codes.Output.ALL, 0, 0, 0, 0, codes.RunState.IDLE, 0))

    def _start_program(self, request: requests.StartProgram) -> int:
        if request.file_name not in self.files:
            return codes.REQUEST_FAILED
        self.program = request.file_name
        return codes.OK

    def _stop_program(self, _: requests.StopProgram) -> int:
        if self.program is None:
            return codes.NO_PROGRAM
        self.program = None
        self._stop_motors()
        return codes.OK

    def _current_program(self, _: requests.GetCurrentProgram) -> Telegram | int:
        return codes.NO_PROGRAM if self.program is None else replies.CurrentProgram(self.program)

    def _write_message(self, request: requests.MessageWrite) -> int:
        if request.mailbox >= MAILBOXES:
            return codes.ILLEGAL_MAILBOX
        if self.program is None:
            return codes.NO_PROGRAM
        self.mailboxes[request.mailbox].append(request.data)
        return codes.OK

    def _read_message(self, request: requests.MessageRead) -> Telegram | int:
        if request.remote_mailbox >= MAILBOXES:
            return codes.ILLEGAL_MAILBOX
        box = self.mailboxes[request.remote_mailbox]
        if self.program is None or not box:
            return codes.NO_PROGRAM if self.program is None else codes.MAILBOX_EMPTY
        return replies.Message(request.local_mailbox, box.popleft() if request.remove else box[0])

    def _keep_alive(self, _: requests.KeepAlive) -> Telegram:
        self._alive_s = self._now_s
        return replies.SleepLimit(round(self.sleep_limit_s * 1000))

    def _set_name(self, request: requests.SetBrickName) -> int:
        self.name = request.name
        return codes.OK
