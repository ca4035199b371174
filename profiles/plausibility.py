"""What a profile says of readings that contradict each other: how far they may, before the vehicle is stopped."""

from __future__ import annotations

from profiles.parts import Part, Positive


class PlausibilityConfig(Part, frozen=True, kw_only=True):
    """Limits of the checks while driving (docs/plausibility.md); what is left out is derived from the vehicle."""

    encoder_jump_deg: Positive | None = None
    """Between two readings of an encoder, beyond twice the way at its axis' fastest turning; None: 1 and two counts."""
    encoder_off_deg: Positive | None = None
    """Between what an encoder and the wheels of its axis have turned, beyond 30 % of that; None: as much as a jump."""
    wheel_off_m: Positive | None = None
    """What wheels at rest may roll otherwise than any motion of the body; None: a cycle at `wheel_speed_m_s`."""
    current_s: Positive | None = None
    """For how long a motor's current may not fit the motion of its wheel; None: 0.25 s."""
