"""The ``motor.*`` methods: one motor at a time."""

from __future__ import annotations

from typing import Any

from canhelm.errors import LimitExceeded, NodeAbsent, Refused, UsageError
from daemon.runtime.handlers import Handler, Params, holder, run_motion
from daemon.runtime.motions import AsideVelocity, DriveMove, Motion, WheelVelocity
from daemon.runtime.supervisor import Supervisor
from drivers.contract import Drive, DriveState


class MotorCommands:
    """Handlers of the ``motor.*`` methods, by name in :attr:`handlers`.

    Args:
        supervisor: what decides.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        self.handlers: dict[str, Handler] = {
            "motor.enable": self._enable,
            "motor.disable": self._disable,
            "motor.velocity": self._velocity,
            "motor.position": self._position,
            "motor.current": self._current,
            "motor.home": self._home,
            "motor.stop": self._stop,
            "motor.quick_stop": self._quick_stop,
            "motor.reset": self._reset,
            "motor.step": self._velocity,
        }

    def drive(self, node: int | str) -> Drive:
        """The drive that a person means by node id or name. Raises NodeAbsent where the profile has none."""
        for drive in self._supervisor.devices.drives.values():
            if node in (drive.name, drive.node, str(drive.node)):
                return drive
        drives = self._supervisor.devices.drives.values()
        have = ", ".join(f"{drive.node} ({drive.name})" if drive.node else drive.name for drive in drives)
        raise NodeAbsent(f"no drive {node} in this profile", remedy=f"drives: {have}")

    async def _enable(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self.drive(params["node"])
        self._supervisor.require_ready((drive.name,))
        await drive.enable()
        return drive.status()

    async def _disable(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self._present(params)
        await self._end_motions_of(drive)
        await self._supervisor.power_off(drive)
        return drive.status()

    async def _velocity(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self.drive(params["node"])
        speed = params.get("wheel_speed_m_s")
        if speed is None:
            if params.get("velocity_rpm") is None:
                raise UsageError("motor.velocity needs velocity_rpm or wheel_speed_m_s")
            speed = drive.speed_from_rpm(float(params["velocity_rpm"]))
        limit = self._supervisor.vehicle.wheel_limit_m_s(drive.name)
        if not abs(speed) <= limit:
            raise _too_fast(drive, drive.rpm_from_speed(speed), limit)
        duration = params.get("duration_s")
        held = holder(params, lease, endless=duration is None)
        if drive in self._supervisor.vehicle.aside:
            aside = AsideVelocity("motor.velocity", drive, self._wheels(), speed, duration, held)
            return await run_motion(self._supervisor, aside, params, lease)
        wheel, count = self._supervisor.vehicle.wheel_of(drive.name)
        motion = WheelVelocity("motor.velocity", drive, wheel, count, speed, duration, held)
        return await run_motion(self._supervisor, motion, params, lease)

    async def _position(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self.drive(params["node"])
        speed_rpm = float(params.get("velocity_rpm") or abs(drive.rpm_from_speed(0.1)))
        limit = self._supervisor.vehicle.wheel_limit_m_s(drive.name)
        if abs(drive.speed_from_rpm(speed_rpm)) > limit:
            raise _too_fast(drive, speed_rpm, limit)

        async def command() -> None:
            relative = bool(params.get("relative", False))
            await drive.move_to(int(params["position_qc"]), relative=relative, speed_rpm=speed_rpm)

        motion = DriveMove("motor.position", drive, self._wheels(), holder(params, lease), command)
        return await run_motion(self._supervisor, motion, params, lease)

    async def _home(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self.drive(params["node"])

        async def command() -> None:
            await drive.home(int(params["method"]))

        motion = DriveMove("motor.home", drive, self._wheels(), holder(params, lease), command)
        return await run_motion(self._supervisor, motion, params, lease)

    async def _current(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self.drive(params["node"])
        current_a = float(params["current_ma"]) / 1000.0
        limit_a = self._supervisor.vehicle.current_limit_a(drive.name)
        if not abs(current_a) <= limit_a:
            raise LimitExceeded(
                f"{current_a * 1000:.0f} mA is beyond the continuous current of {drive.name}",
                node=drive.node,
                value=params["current_ma"],
                limit=f"{limit_a * 1000:.0f} mA",
                remedy="ask for less, or raise the motor's continuous current in the profile",
            )
        duration = params.get("duration_s")
        held = holder(params, lease, endless=duration is None)

        async def command() -> None:
            await drive.set_current(current_a)

        motion = DriveMove(
            "motor.current", drive, self._wheels(), held, command, duration_s=duration, until_stopped=duration is None
        )
        return await run_motion(self._supervisor, motion, params, lease)

    async def _stop(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self._present(params)
        await self._end_motions_of(drive)
        return drive.status()

    async def _quick_stop(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self._present(params)
        for motion in self._motions_of(drive):
            motion.fail(Refused("the motion was stopped: quick stop was commanded"))
        drive.quick_stop()
        await self._supervisor.until_rest()
        return drive.status()

    async def _reset(self, params: Params, lease: str | None) -> dict[str, Any]:
        drive = self._present(params)
        if drive.state is DriveState.FAULT:
            await drive.reset_fault()
        drive.fault = None
        return drive.status()

    def _present(self, params: Params) -> Drive:
        drive = self.drive(params["node"])
        drive.require_ready()
        return drive

    def _wheels(self) -> int:
        return len(self._supervisor.vehicle.drives)

    def _motions_of(self, drive: Drive) -> list[Motion]:
        return [motion for motion in self._supervisor.motions.values() if drive.name in motion.drives]

    async def _end_motions_of(self, drive: Drive) -> None:
        for motion in self._motions_of(drive):
            motion.stop(f"stop of {drive.name} was commanded")
        await self._supervisor.until_rest()


def _too_fast(drive: Drive, velocity_rpm: float, limit_m_s: float) -> LimitExceeded:
    return LimitExceeded(
        f"{abs(velocity_rpm):.0f} rpm is beyond the limit of {drive.name}",
        node=drive.node,
        value=round(abs(velocity_rpm), 1),
        limit=f"{abs(drive.rpm_from_speed(limit_m_s)):.0f} rpm at the motor, {limit_m_s:g} m/s at the wheel",
        remedy="ask for less, or raise the limit in the profile",
    )
