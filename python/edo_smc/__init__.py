"""Design, simulation and C export of motor and joint drives from their data sheet.

    import edo_smc
    motor = edo_smc.Motor(inertia_kg_m2=2e-4, torque_n_m_per_a=0.05, max_current_a=10.0, encoder=dict(bits=14))
    print(motor.design())                      # poles, margins, noise
    motor.simulate().plot()                    # a move of 1 rad
    motor.export_c("firmware")                 # one C99 file

All units are SI and end the names. Time is the last axis of an array.
"""

from ._design import Design
from ._edo_smc import Controller, Refused, ScenarioError, __version__
from ._health import Health
from ._scenario import Chain, Joint, Motor, Scenario
from ._studies import Comparison, Identified, Map, MonteCarlo, Tuned
from ._trace import Trace

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
