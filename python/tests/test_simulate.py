"""Runs against `host-sim run`, bit for bit."""

import copy
import json
import pickle

import numpy as np
import pytest

import edo_smc
from edo_smc import _health


def trace_of(host_sim, path, folder, *more):
    host_sim("run", path, "--out", folder, *more)
    with (folder / "trace.csv").open() as file:
        names = file.readline().strip().split(",")
        rows = np.array([[float(cell) for cell in line.split(",")] for line in file])
    return names, rows.T, json.loads((folder / "run.json").read_text())


def bits(array):
    return np.ascontiguousarray(array, dtype=np.float64).view(np.uint64)


@pytest.mark.parametrize("plant", ["motor", "joint", "paper", "chain", "own"])
def test_no_bit_of_a_run_differs_from_host_sim(plant, tmp_path, host_sim):
    scenario = edo_smc.Scenario.template(plant)
    path = scenario.save(tmp_path / f"{plant}.toml")
    names, columns, run = trace_of(host_sim, path, tmp_path / "out")
    trace = scenario.simulate()
    assert trace.columns == names and len(trace) == columns.shape[1] > 1000
    differing = sum(int(np.count_nonzero(bits(trace[name]) != bits(it))) for name, it in zip(names, columns))
    assert differing == 0
    assert trace.figures["metrics"] == run["metrics"] and trace.ending == run["ending"]


def test_tables_of_a_run_are_keywords(motor, tmp_path, host_sim):
    tables = dict(
        reference=dict(kind="move", to_rad=0.5),
        load=dict(kind="step", amplitude=0.1, t0_s=0.4),
        friction=dict(coulomb_n_m=0.01),
        error=dict(inertia_percent=20.0),
    )
    trace = motor.simulate(**tables, span_s=0.6)
    settings = {**tables, "load": [tables["load"]], "span_s": 0.6}
    path = motor.with_settings(settings).save(tmp_path / "loaded.toml")
    names, columns, _ = trace_of(host_sim, path, tmp_path / "out")
    assert all(np.array_equal(bits(trace[name]), bits(it)) for name, it in zip(names, columns))
    assert trace["r"][-1] == pytest.approx(0.5) and abs(trace["error"][-1]) < 1e-3
    assert trace.metrics["error_ultimate"] > 0.0 and trace.metrics["arrival_s"] is not None


def test_arrays_have_the_time_last(motor):
    trace = motor.simulate()
    assert trace.t.shape == (1601,) and trace.x.shape == trace.d.shape == (3, 1601)
    assert np.array_equal(trace.x[0], trace["angle_rad"]) and trace["health"].dtype == np.uint32
    assert trace.units["angle_rad"] == trace.units["error"] == "rad" and trace.units["u"] == "A"
    assert "finished" in repr(trace)
    with pytest.raises(KeyError):
        trace["angle"]
    with pytest.raises(TypeError, match="expected the name of a column, one of t_s"):
        trace[0]
    assert trace.failure is None and np.array_equal(trace.error, trace["error"])


def test_every_column_with_a_unit_has_it(motor, joint):
    units = motor.simulate().units
    assert [name for name, unit in units.items() if not unit] == ["health"]
    assert (units["d2"], units["d_hat2"], units["d3"], units["sigma"]) == ("rad/s^2", "rad/s^2", "A/s", "rad/s")
    units = joint.simulate().units
    assert [name for name, unit in units.items() if not unit] == ["health"]
    assert (units["d4"], units["sigma_star"]) == ("rad/s^2", "rad/s^3")


def test_the_estimate_is_a_torque_by_the_inertia(motor):
    """torque = -inertia * d, as docs/python.md has it."""
    trace = motor.simulate(reference=dict(kind="rest"), load=dict(kind="const", amplitude=0.05))
    assert -3e-4 * trace["d2"][-1] == pytest.approx(0.05, rel=1e-3)
    assert -3e-4 * trace["d_hat2"][-1] == pytest.approx(0.05, rel=0.05)


def test_an_alarm_is_named_with_its_time(motor):
    trace = motor.simulate(load=dict(kind="step", amplitude=0.8, t0_s=0.5))
    t_s, flags = trace.first_alarm
    at = np.flatnonzero(trace["health"] & int(edo_smc.Health[flags[0]]))[0]
    assert trace.t[at] == t_s > 0.5 and at == np.flatnonzero(trace["health"] & int(_health.ALARMS))[0]
    told = f"ALARM at t = {t_s:g} s: {', '.join(flags)}"
    assert told in repr(trace).splitlines()[0] and told in trace._repr_html_() and told in trace.warnings[-1]
    assert "stopped the drive" in trace.warnings[-1] and "STOPPED" in repr(trace)
    calm = motor.simulate()
    assert calm.first_alarm is None and calm.warnings == [] and "ALARM" not in repr(calm)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))])
def test_a_trace_is_copied(motor, again):
    trace = motor.simulate()
    other = again(again(trace))
    assert repr(other) == repr(trace) and other.columns == trace.columns and len(other) == len(trace)
    assert all(np.array_equal(bits(other[name]), bits(trace[name])) for name in trace.columns)
    assert np.array_equal(other.d_hat, trace.d_hat) and other.units == trace.units and other.figures == trace.figures


def test_a_trace_goes_to_pandas_xarray_and_matplotlib(motor, tmp_path):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    trace = motor.simulate()
    frame, dataset = trace.to_pandas(), trace.to_xarray()
    assert np.array_equal(frame["u"], trace.u) and frame.index.name == "t_s"
    assert dataset["u"].attrs["units"] == "A" and dataset.sizes == {"t_s": 1601}
    trace.plot().savefig(tmp_path / "run.png")
    trace.plot("u", "error").savefig(tmp_path / "two.png")
    edo_smc.Scenario.template("chain").simulate().plot().savefig(tmp_path / "chain.png")
    assert (tmp_path / "run.png").stat().st_size > 10_000


def test_a_run_that_diverges_says_when():
    scenario = edo_smc.Scenario.template("chain").with_settings({"plant.b": -2.0, "controller.limits": {}})
    trace = scenario.simulate()
    assert trace.ending == "diverged" and trace.ended_at_s > 0.0 and "diverged at t" in repr(trace)
