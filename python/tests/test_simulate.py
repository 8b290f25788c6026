"""Runs against `host-sim run`, bit for bit."""

import json

import numpy as np
import pytest

import edo_smc


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
