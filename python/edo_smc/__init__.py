"""Design, simulation and C export of motor and joint drives from their data sheet.

    import edo_smc
    motor = edo_smc.Motor(inertia_kg_m2=2e-4, torque_n_m_per_a=0.05, max_current_a=10.0, encoder=dict(bits=14))
    print(motor.design())                      # poles, margins, noise
    motor.simulate().plot()                    # the motor of the scenario, with friction
    motor.export_c("firmware")                 # one C99 file

All units are SI and end the names. Time is the last axis of an array.
"""

import enum

from ._design import Design
from ._edo_smc import Controller, Refused, ScenarioError, __version__
from ._scenario import Chain, Joint, Motor, Scenario
from ._studies import Comparison, Identified, Map, MonteCarlo, Tuned
from ._trace import Trace



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


__all__ = [
    "Chain",
    "Comparison",
    "Controller",
    "Design",
    "Health",
    "Identified",
    "Joint",
    "Map",
    "MonteCarlo",
    "Motor",
    "Refused",
    "Scenario",
    "ScenarioError",
    "Trace",
    "Tuned",
    "__version__",
]
