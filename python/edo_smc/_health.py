"""Status flags of a tick."""

from __future__ import annotations

import enum


class Health(enum.IntFlag):
    """Status flags of a tick: `Health(output["health"])`. The meanings are in docs/reference/status.md."""

    INPUT_REJECTED = 1 << 0
    SATURATED = 1 << 1
    SIGMA_STAR_OVER_BOUND = 1 << 2
    SAMPLE_LOST = 1 << 3
    DISTURBANCE_OVER_BOUND = 1 << 4
    STUCK_AT_LIMIT = 1 << 5
    STOPPED = 1 << 6
    POSITION_STEPPED = 1 << 7
    WAITS = 1 << 8
    WRONG_WAY = 1 << 9
    OSCILLATES = 1 << 10
    BRAKES = 1 << 11
    OVERSPEED = 1 << 12
    FOLLOWING_ERROR = 1 << 13
    END_OF_RANGE = 1 << 14
    HUNTS = 1 << 15


#: Flags to which the monitors of a drive react. The others are only reported.
ALARMS = (
    Health.INPUT_REJECTED
    | Health.SIGMA_STAR_OVER_BOUND
    | Health.DISTURBANCE_OVER_BOUND
    | Health.STUCK_AT_LIMIT
    | Health.WRONG_WAY
    | Health.OSCILLATES
    | Health.OVERSPEED
    | Health.FOLLOWING_ERROR
    | Health.END_OF_RANGE
)


def names(flags: int) -> list[str]:
    """Returns the names of the flags, lowest bit first."""
    return [str(flag.name) for flag in Health.__members__.values() if flags & flag]
