"""canhelm's control cycle over a socket pair: its back end, master, devices, supervisor, law, gate and recorders."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.cycle_floors import PERIOD_S, LoopedCycles
from benchmarks.cycle_link import Link, make_pair
from benchmarks.cycle_robot import SocketRobot
from daemon.runs.store import RunStore
from daemon.runtime.cycle import Cycle
from daemon.runtime.gathering import Gathering
from daemon.runtime.paired_steer_vehicle import PairedSteerVehicle
from daemon.runtime.recorder import BusRecorder
from daemon.runtime.run_recorder import RunRecorder
from daemon.runtime.supervisor import Supervisor
from daemon.runtime.vehicle import VehicleState
from daemon.runtime.vehicles import make_vehicle
from drivers.bus.socketcan import SocketCanBus
from drivers.canopen.guarding import Guard
from drivers.canopen.master import Master
from drivers.canopen.nmt import ERROR_CONTROL_COB_ID
from drivers.contract import NodeState
from drivers.devices import Devices
from profiles.loader import load

MEMORY = Path("/dev/shm")
"""Where recordings go, so that no disk and its driver are measured."""
RENEWED_EACH = 50
"""Cycles between two renewals of the lease: half a second."""
FRAMES = 11
"""Of one cycle."""
DRIVE = {"angle_deg": 0.0, "speed_m_s": 0.5, "duration_s": 1e6}
WARM_UP = 300
"""Cycles until brakes are engaged, the ramp is over, and the wheels roll at one speed."""


class HandPace:
    """Ticks when it is told to; fulfils :class:`daemon.runtime.cycle.Pace`."""

    def __init__(self, period_s: float, tick: Callable[[], None]) -> None:
        self.tick = tick
        self.max_lateness_s = 0.0
        self.synced = False

    def start(self) -> None:
        """Nothing."""

    def stop(self) -> None:
        """Nothing."""


class CanhelmCycle:
    """A MAX2D that drives straight on.

    Args:
        recording: write every frame to a candump log, and the motion to a run, and keep what a fault would leave.
    """

    def __init__(self, *, recording: bool) -> None:
        self.name = f"canhelm, recording {'on' if recording else 'off'}"
        self.key = "canhelm" if recording else "canhelm_without_recording"
        self._cycles = LoopedCycles(self._tick)
        self.run = self._cycles.run
        self.loop = self._cycles.loop
        end, far = make_pair()
        self._robot, self._far = SocketRobot(far), far
        self._folder = TemporaryDirectory(prefix="canhelm-bench-", dir=MEMORY if MEMORY.is_dir() else None)
        self._ran = 0
        self.loop.run_until_complete(self._begin(Link(end, far), recording=recording))
        self.run(WARM_UP)

    async def _begin(self, link: Link, *, recording: bool) -> None:
        profile = load("max2d").profile
        self.bus = SocketCanBus("bench0", profile.network.bit_rate, lambda: link)
        self.master = Master(self.bus, profile.network)
        self._devices = Devices(self.master, profile)
        vehicle = make_vehicle(profile, self._devices)
        assert isinstance(vehicle, PairedSteerVehicle)
        self.supervisor = Supervisor(self.master, self._devices, vehicle, PERIOD_S)
        self.cycle = Cycle(self.master, self._devices, PERIOD_S, self.supervisor.step, self._make_pace)
        self.cycle.on_good = self._on_good
        self.recorder: BusRecorder | None = None
        self.runs: RunRecorder | None = None
        if recording:
            folder, gathering = Path(self._folder.name), Gathering(self.bus)
            self.recorder = BusRecorder(gathering, folder / "all.log", profile.name, self.supervisor.log)
            self.recorder.start()
            store = RunStore(folder / "runs")
            self.runs = RunRecorder(store, self.supervisor, gathering, profile, "socketcan:bench0")
            self.runs.start()
        await self.master.start()
        self.cycle.start()
        self._make_ready()
        self._lease = self.supervisor.open_lease("bench")
        self.motion = vehicle.motion("drive.parallel", DRIVE, self._lease)

    def _make_ready(self) -> None:
        """Every node as its boot-up leaves it: ready and guarded."""
        for node, device in self._devices.by_node.items():
            device.node_state = NodeState.READY
            device.on_ready()
            guard = self.master.guard(node, lambda _: None)
            self.master.subscribe(ERROR_CONTROL_COB_ID + node, partial(_answer, guard))
            guard.arm(self.loop.time())

    def _make_pace(self, period_s: float, tick: Callable[[], None]) -> HandPace:
        self._pace = HandPace(period_s, tick)
        return self._pace

    def _tick(self) -> None:
        self._ran += 1
        if self._ran % RENEWED_EACH == 1:
            self.supervisor.renew_lease(self._lease)
        if self._ran == RENEWED_EACH:
            self.supervisor.admit(self.motion, self._lease)
        self._pace.tick()
        self._robot.answer()

    def _on_good(self, now_s: float) -> None:
        self._cycles.ended()

    def require_whole(self) -> None:
        """Raise RuntimeError unless the robot has driven all the time, and every frame was recorded."""
        supervisor, counters = self.supervisor, self.cycle.counters
        if supervisor.state is not VehicleState.ACTIVE or counters.late_cycles or counters.incomplete:
            raise RuntimeError(f"{self.name}: {supervisor.sentence}, {counters}, {supervisor.log.last(3)}")
        if self.recorder is not None and (self.recorder.lost or self.recorder.frames < FRAMES * (self._ran - 2)):
            raise RuntimeError(f"{self.name}: {self.recorder.status()} after {self._ran} cycles")

    def close(self) -> None:
        """Take everything down; :meth:`require_whole` tells afterwards, too."""
        self.loop.run_until_complete(self._end())
        self.loop.close()
        self._far.close()
        self._folder.cleanup()

    async def _end(self) -> None:
        for recorder in (self.runs, self.recorder):
            if recorder is not None:
                recorder.close()
        self.cycle.stop()
        await self.master.close()
        for task in asyncio.all_tasks() - {asyncio.current_task()}:
            while not task.done():
                task.cancel()
                await asyncio.sleep(0)


class LawAlone:
    """The law's arithmetic alone, on what the robot of another row measures.

    Args:
        robot: the other row.
    """

    name, key = "the law's arithmetic alone", "law"

    def __init__(self, robot: CanhelmCycle) -> None:
        self._robot = robot

    def run(self, count: int) -> None:
        """So many steps."""
        measurement, step = self._robot.supervisor.measurement, self._robot.motion.step
        assert measurement is not None
        for _ in range(count):
            step(measurement, PERIOD_S)

    def close(self) -> None:
        """Nothing is open."""


def _answer(guard: Guard, can_id: int, data: bytes, timestamp_s: float) -> None:
    guard.answer(data[0] >> 7)
