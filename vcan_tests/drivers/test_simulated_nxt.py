from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

import pytest

from canhelm.errors import BusOff
from drivers.epos.serial_tty import SerialTty
from drivers.nxt import codes, replies, requests
from drivers.nxt.brick import Brick
from drivers.nxt.codes import Output, OutputMode, Regulation, RunState
from drivers.nxt.layout import Telegram
from drivers.nxt.telegrams import Reply, Unframer, make_frame, make_request, parse_reply
from drivers.simulated.nxt import BLUETOOTH, SimulatedNxt
from drivers.simulated.nxt_motor import NxtMotor
from drivers.simulated.serial_wire import SerialPty

DRIVEN = OutputMode.MOTOR_ON | OutputMode.BRAKE
REGULATED = DRIVEN | OutputMode.REGULATED


def order(
    power: int, limit: int = 0, mode: int = REGULATED, state: int = RunState.RUNNING, port: int = Output.A
) -> requests.SetOutputState:
    return requests.SetOutputState(port, power, mode, Regulation.SPEED, 0, state, limit)


def run(motor: NxtMotor, seconds: float, battery_v: float = 8.0) -> NxtMotor:
    for _ in range(round(seconds * 1000)):
        motor.tick(battery_v)
    return motor


def tacho(motor: NxtMotor) -> int:
    return motor.state(0).tacho_deg


# The motor


def test_at_nine_volts_a_motor_does_what_was_measured() -> None:
    motor = NxtMotor()
    motor.set_output(order(100, mode=DRIVEN))
    run(motor, 2.0, 9.0)
    assert motor.speed_rad_s * 60 / math.tau == pytest.approx(170, rel=0.01)
    assert motor.current_a == pytest.approx(0.06, rel=0.05)
    motor.blocked = True
    assert run(motor, 0.1, 9.0).current_a == pytest.approx(2.0)


@pytest.mark.parametrize("load_n_m", [0.0, 0.05])
@pytest.mark.parametrize("power", [10, 40, -40, 70])
def test_a_regulated_speed_holds_under_load(power: int, load_n_m: float) -> None:
    motor = NxtMotor()
    motor.load_n_m = load_n_m
    motor.set_output(order(power))
    start = tacho(run(motor, 2.0))
    assert (tacho(run(motor, 2.0)) - start) / 2.0 == pytest.approx(10 * power, rel=0.03)


def test_without_regulation_a_load_costs_speed() -> None:
    free, loaded = NxtMotor(), NxtMotor()
    loaded.load_n_m = 0.05
    for motor in (free, loaded):
        motor.set_output(order(50, mode=DRIVEN))
        run(motor, 1.0)
    assert loaded.speed_rad_s < 0.8 * free.speed_rad_s


def test_a_limited_run_ends_idle_and_overshoots() -> None:
    motor = NxtMotor()
    motor.set_output(order(40, limit=360))
    run(motor, 3.0)
    assert motor.state(0).run_state == RunState.IDLE
    assert 380 < tacho(motor) < 480
    assert motor.at_rest


def test_the_next_limited_run_makes_up_for_the_overshoot() -> None:
    motor = NxtMotor()
    for _ in range(3):
        motor.set_output(order(40, limit=360))
        run(motor, 3.0)
    assert 3 * 360 < tacho(motor) < 3 * 360 + 120


def test_a_run_for_ever_takes_the_count_to_run_along() -> None:
    motor = NxtMotor()
    motor.set_output(order(40, limit=3600))
    run(motor, 1.0)
    motor.set_output(order(0))
    run(motor, 0.5)
    start = tacho(motor)
    motor.set_output(order(40))
    run(motor, 0.002)
    motor.set_output(order(40, limit=360))
    run(motor, 3.0)
    assert 360 <= tacho(motor) - start < 480


def test_each_counter_is_zeroed_by_its_own_reset() -> None:
    motor = NxtMotor()
    motor.set_output(order(50, limit=200))
    run(motor, 2.0)
    motor.reset_position(relative=True)
    state = motor.state(1)
    assert (state.block_deg, state.rotation_deg) == (0, state.tacho_deg)
    motor.reset_position(relative=False)
    assert motor.state(1).rotation_deg == 0
    assert motor.state(1).tacho_deg == state.tacho_deg > 0


def test_a_ramp_up_comes_to_its_power_over_its_limit() -> None:
    motor = NxtMotor()
    motor.set_output(order(80, limit=720, mode=DRIVEN, state=RunState.RAMP_UP))
    run(motor, 0.3)
    slow = motor.speed_rad_s
    while motor.state(0).run_state == RunState.RAMP_UP:
        motor.tick(8.0)
    assert motor.speed_rad_s > 2 * slow
    assert 720 <= tacho(motor) < 740


def test_a_ramp_down_ends_at_rest_without_much_overshoot() -> None:
    motor = NxtMotor()
    motor.set_output(order(80, mode=DRIVEN))
    run(motor, 1.0)
    start = tacho(motor)
    motor.set_output(order(0, limit=720, mode=DRIVEN, state=RunState.RAMP_DOWN))
    run(motor, 5.0)
    assert motor.at_rest
    assert 720 <= tacho(motor) - start < 735


def test_without_brake_a_motor_coasts() -> None:
    braked, coasting = NxtMotor(), NxtMotor()
    for motor, mode, state in ((braked, DRIVEN, RunState.RUNNING), (coasting, OutputMode.IDLE, RunState.IDLE)):
        motor.set_output(order(60, mode=DRIVEN))
        run(motor, 1.0)
        motor.set_output(order(0, mode=mode, state=state))
        start = tacho(motor)
        run(motor, 1.0)
        motor.shaft_rad -= math.radians(start)
    assert coasting.shaft_rad > 2 * braked.shaft_rad


# The brick


class Host:
    """Asks over the cable, telegram by telegram."""

    def __init__(self, nxt: SimulatedNxt) -> None:
        self.nxt = nxt
        self._unframer = Unframer()
        self._came: asyncio.Queue[bytes] = asyncio.Queue()
        nxt.cable.host = self._hear

    def _hear(self, data: bytes, _: float) -> None:
        for telegram in self._unframer.feed(data):
            self._came.put_nowait(telegram)

    async def raw(self, telegram: bytes) -> Reply:
        self.nxt.cable.write(make_frame(telegram))
        reply = parse_reply(await asyncio.wait_for(self._came.get(), 1.0))
        assert isinstance(reply, Reply)
        return reply

    async def ask(self, content: Telegram) -> Reply:
        return await self.raw(make_request(content))


@pytest.fixture
async def host() -> Host:
    return Host(SimulatedNxt("Rover"))


@pytest.mark.parametrize(
    ("content", "status"),
    [
        (requests.GetOutputState(3), codes.OUT_OF_RANGE),
        (order(50, port=7), codes.OUT_OF_RANGE),
        (requests.ResetMotorPosition(3, True), codes.OUT_OF_RANGE),
        (requests.GetInputValues(4), codes.OUT_OF_RANGE),
        (requests.StartProgram("none.rxe"), codes.REQUEST_FAILED),
        (requests.StopProgram(), codes.NO_PROGRAM),
        (requests.GetCurrentProgram(), codes.NO_PROGRAM),
        (requests.MessageWrite(0, b"x"), codes.NO_PROGRAM),
        (requests.MessageWrite(20, b"x"), codes.ILLEGAL_MAILBOX),
        (requests.LowSpeedGetStatus(0), codes.NOT_CONFIGURED),
        (requests.PlayTone(440, 100), codes.OK),
    ],
)
async def test_a_request_gets_its_status(host: Host, content: Telegram, status: int) -> None:
    assert await host.ask(content) == Reply(content.OPCODE, status)


async def test_what_makes_no_sense_is_refused_and_counted(host: Host) -> None:
    assert (await host.raw(b"\x00\x42")).status == codes.UNKNOWN_OPCODE
    assert (await host.raw(b"\x00\x06")).status == codes.INSANE_PACKET
    assert host.nxt.bad_telegrams == 2


async def test_a_reply_comes_after_the_turnaround_and_the_next_after_the_switch(host: Host) -> None:
    loop = asyncio.get_running_loop()
    await host.ask(requests.GetBatteryLevel())
    first_s = loop.time()
    await host.ask(requests.GetBatteryLevel())
    assert first_s == pytest.approx(BLUETOOTH.turnaround_s, abs=0.001)
    assert loop.time() - first_s == pytest.approx(BLUETOOTH.switch_s + BLUETOOTH.turnaround_s, abs=0.001)


async def test_all_motors_at_once_are_port_255(host: Host) -> None:
    await host.ask(order(50, port=Output.ALL))
    await asyncio.sleep(1.0)
    host.nxt.catch_up()
    assert all(motor.speed_rad_s > 5 for motor in host.nxt.motors)


async def test_the_battery_sags_under_load(host: Host) -> None:
    host.nxt.motors[0].blocked = True
    await host.ask(order(100, mode=DRIVEN))
    await asyncio.sleep(0.2)
    reply = (await host.ask(requests.GetBatteryLevel())).content
    assert isinstance(reply, replies.BatteryLevel)
    assert 7000 < reply.voltage_mv < 7600


async def test_a_brick_without_keep_alive_falls_asleep(host: Host) -> None:
    await asyncio.sleep(601)
    with pytest.raises(TimeoutError):
        await host.ask(requests.GetBatteryLevel())


async def test_a_program_gets_and_gives_messages(host: Host) -> None:
    await host.ask(requests.StartProgram("demo.rxe"))
    assert (await host.ask(requests.GetCurrentProgram())).content == replies.CurrentProgram("demo.rxe")
    await host.ask(requests.MessageWrite(3, b"hello"))
    assert (await host.ask(requests.MessageRead(3, 0, True))).content == replies.Message(0, b"hello")
    assert (await host.ask(requests.MessageRead(3, 0, True))).status == codes.MAILBOX_EMPTY
    await host.ask(requests.StopProgram())


async def test_a_sensor_is_read_as_its_mode_says(host: Host) -> None:
    host.nxt.inputs.ports[2].raw = 100
    await host.ask(requests.SetInputMode(2, codes.SensorType.SWITCH, codes.SensorMode.BOOLEAN))
    values = (await host.ask(requests.GetInputValues(2))).content
    assert isinstance(values, replies.InputValues)
    assert (values.raw, values.scaled) == (100, 1)


async def test_a_digital_sensor_answers(host: Host) -> None:
    host.nxt.inputs.ports[0].digital = lambda data, size: bytes(reversed(data))[:size]
    await host.ask(requests.SetInputMode(0, codes.SensorType.LOW_SPEED_9V, codes.SensorMode.RAW))
    await host.ask(requests.LowSpeedWrite(0, b"\x02\x42", 2))
    assert (await host.ask(requests.LowSpeedGetStatus(0))).content == replies.LowSpeedStatus(2)
    assert (await host.ask(requests.LowSpeedRead(0))).content == replies.LowSpeedData(b"\x42\x02")


async def test_the_brick_takes_a_name(host: Host) -> None:
    await host.ask(requests.SetBrickName("Nemo"))
    info = (await host.ask(requests.GetDeviceInfo())).content
    assert isinstance(info, replies.DeviceInfo)
    assert info.name == "Nemo"


async def test_the_brick_can_be_told_to_refuse(host: Host) -> None:
    host.nxt.refuse[requests.GetBatteryLevel.OPCODE] = 0xFB
    assert (await host.ask(requests.GetBatteryLevel())).status == 0xFB


# On a terminal


def over(pty: SerialPty) -> Brick:
    def connect(on_lost: Callable[[str], None]) -> SerialTty:
        port = SerialTty(pty.device, 115200)
        port.on_lost = on_lost
        port.open()
        return port

    return Brick(pty.device, connect)


@pytest.fixture
async def pty() -> SerialPty:
    return SerialPty(SimulatedNxt("Rover").cable)


@pytest.mark.real_time
async def test_the_driver_drives_a_brick_on_a_terminal(pty: SerialPty) -> None:
    brick = over(pty)
    brick.start()
    await asyncio.wait_for(brick.wait_ready(), 5.0)
    await brick.move({Output.B: (60, 90)})
    assert (await brick.output(Output.B)).tacho_deg >= 90
    await brick.close()
    pty.close()


@pytest.mark.real_time
async def test_a_terminal_that_hangs_up_is_told_within_a_second(pty: SerialPty) -> None:
    brick = over(pty)
    brick.start()
    await asyncio.wait_for(brick.wait_ready(), 5.0)
    move = asyncio.ensure_future(brick.move({Output.B: (30, 3600)}))
    await asyncio.sleep(0.2)
    pty.close()
    with pytest.raises(BusOff, match="is gone"):
        await asyncio.wait_for(move, 1.0)
    await brick.close()
