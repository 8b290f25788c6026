"""What the tests share: `host-sim`, a motor, a joint."""

import os
import pathlib
import subprocess

import matplotlib
import pytest

import edo_smc

matplotlib.use("Agg")

ROOT = pathlib.Path(__file__).parents[2]


@pytest.fixture(scope="session")
def host_sim():
    """Runs host-sim, the independent way to the same results."""
    given = os.environ.get("EDO_SMC_HOST_SIM")
    tried = [pathlib.Path(given)] if given else [ROOT / f"target/{built}/host-sim" for built in ("debug", "release")]
    program = next((path for path in tried if path.exists()), None)
    assert program, f"no host-sim at {tried}: run `cargo build --release`, or set EDO_SMC_HOST_SIM"

    def run(*arguments, status=0):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        return done.stdout

    return run


@pytest.fixture
def motor():
    """A motor that the template does not have."""
    return edo_smc.Motor(
        name="spindle",
        inertia_kg_m2=3e-4,
        torque_n_m_per_a=0.07,
        max_current_a=8.0,
        encoder=dict(bits=15),
        drive=dict(period_s=5e-4),
        span_s=0.8,
    )


@pytest.fixture
def joint():
    """The template joint, in a short run."""
    return edo_smc.Scenario.template("joint").with_settings({"span_s": 1.5, "load": []})
