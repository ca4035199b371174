"""The limits and times that the fault campaign holds the robot to, each with its source."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from daemon.campaigns.faults.strikes import Reach
from daemon.loops.plausibility import WHEELS_SHARE
from daemon.loops.plausibility_limits import encoder_rates_rad_s, turning_limits_rad
from daemon.loops.steering import SETTLE_TIME_S
from daemon.runtime.rest import AT_REST_CYCLES, AT_REST_M_S
from daemon.runtime.stopping import OVERRUN_S
from daemon.runtime.watch import SILENT_CYCLES
from drivers.epos.drive import INSIST_CYCLES
from drivers.epos.transitions import TRANSITION_S
from profiles.schema import PairedSteerGeometry, Profile

SWING_S: Final = 0.08
"""What tyres and a turning pair have stored turns wheels for this long after the ramp (docs/service.md: they stand
0.45 s after `kill -9`, of which 0.41 s are life time and ramp)."""
SETTLING_M: Final = 0.008
"""What a wheel may turn after that, as torque goes or comes: 1.3 mm where nothing else is wrong (docs/service.md), more
where drives have worked against each other (docs/fault-campaign.md)."""
WOUND_UP_M: Final = 0.02
"""Likewise where a wheel is blocked, and the others have pushed against it at the limit of their current."""
OFF_CYCLES: Final = 8
"""Control cycles in which drives that hear their PDOs are switched off: command, SYNC, answer, a frame that was lost;
once more where a second stop cuts in."""
SPEED_SHARE: Final = 0.05
"""Overshoot of a drive's speed regulator."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a profile and the documentation promise.

    Attributes:
        at_rest_m_s: rim speed that counts as rest (``daemon/runtime/rest.py``).
        settling_m: way of a rim that is no motion any more.
        wound_up_m: likewise where a wheel is blocked.
        fastest_m_s: of a rim, whatever is wrong (``limits.wheel_speed_m_s``).
        steering_m_s: of a rim that turns a pair (``limits.steering_rim_speed_m_s``).
        heading_rad: of a pair, whatever is wrong (``limits.heading_deg``).
        astray_rad: of a pair beside its target, before the check of its readings stops it (docs/plausibility.md), and
            the way of its ramp.
        wrong_target_m_s: what a drive gains by a wrong target before the right one comes: two cycles of its ramp.
        noticed_s: until a node that says nothing, or an interface that does not work, is a fault, while anything has
            power (``SILENT_CYCLES`` of ``daemon/runtime/watch.py``).
        slowing_m_s2: of a stop by the motion's own ramp (``limits.acceleration_m_s2``).
        quick_stop_m_s2: of the drives' ramp, the slowest of them.
        reach_s: until a drive begins its ramp after a stop was commanded, or its master was lost.
        off_s: from rest until every drive is off.
        overrun_s: until a wheel that goes on after its ramp is switched off (``daemon/runtime/stopping.py``).
        settled_s: as long drives keep the wheels at rest before they are switched off, after a stop by the motion's own
            ramp (``SETTLE_TIME_S`` of ``daemon/loops/steering.py``).
        off_otherwise_s: from rest until drives are off of which one is silent, so that it is waited for as long, or has
            to be told by SDO.
        braked_s: until a released brake has engaged, once its drive can be told.
        ready_s: until a node is ready again once nothing is wrong any more (``boot_deadline_s``, twice: an attempt that
            was under way may fail first).
    """

    at_rest_m_s: float
    settling_m: float
    wound_up_m: float
    fastest_m_s: float
    steering_m_s: float
    heading_rad: float
    astray_rad: float
    wrong_target_m_s: float
    noticed_s: float
    slowing_m_s2: float
    quick_stop_m_s2: float
    reach_s: dict[Reach, float]
    off_s: float
    overrun_s: float
    settled_s: float
    off_otherwise_s: float
    braked_s: float
    ready_s: float

    def rest_s(self, speed_m_s: float, reach: Reach) -> float:
        """Time to rest from a rim speed, from the moment when a stop is commanded or the master is lost."""
        return self.reach_s[reach] + speed_m_s / self.quick_stop_m_s2 + SWING_S


def limits_of(profile: Profile) -> Limits:
    """The limits of a robot that steers in pairs."""
    network, limits, vehicle = profile.network, profile.limits, profile.vehicle
    assert isinstance(vehicle, PairedSteerGeometry)
    cycle_s = 1.0 / network.cycle_hz
    ramp_m_s2 = min(drive.quick_stop_m_s2 for drive in profile.drives.values())
    turn_rad = max(turning_limits_rad(profile, vehicle.encoders)) / (1.0 - WHEELS_SHARE)
    rate_rad_s = max(encoder_rates_rad_s(profile))
    ramp_s = limits.steering_rim_speed_m_s / ramp_m_s2
    off_s = (AT_REST_CYCLES + OFF_CYCLES) * cycle_s
    life_s = network.guard_time_ms * 1e-3 * network.life_time_factor
    return Limits(
        at_rest_m_s=AT_REST_M_S,
        settling_m=SETTLING_M,
        wound_up_m=WOUND_UP_M,
        fastest_m_s=limits.wheel_speed_m_s,
        steering_m_s=limits.steering_rim_speed_m_s,
        heading_rad=math.radians(limits.heading_deg),
        astray_rad=turn_rad + rate_rad_s * (0.5 * ramp_s + 2.0 * cycle_s),
        wrong_target_m_s=2.0 * cycle_s * max(drive.acceleration_m_s2 for drive in profile.drives.values()),
        noticed_s=(SILENT_CYCLES + 2) * cycle_s,
        slowing_m_s2=limits.acceleration_m_s2,
        quick_stop_m_s2=ramp_m_s2,
        reach_s={"pdo": 2.0 * cycle_s, "sdo": (INSIST_CYCLES + 2) * cycle_s, "life": life_s + cycle_s},
        off_s=off_s,
        overrun_s=OVERRUN_S,
        settled_s=SETTLE_TIME_S,
        off_otherwise_s=off_s + OVERRUN_S + TRANSITION_S + network.sdo_timeout_s,
        braked_s=max(brake.close_time_s for brake in profile.brakes.values()) + network.sdo_timeout_s,
        ready_s=2.0 * network.boot_deadline_s,
    )
