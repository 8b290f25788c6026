"""Export and studies against `host-sim`."""

import json
import os
import signal
import threading
import time

import numpy as np
import pytest

import edo_smc


@pytest.mark.parametrize("plant", ["motor", "joint", "chain"])
def test_the_c_file_has_the_bytes_of_host_sim(plant, tmp_path, host_sim):
    path = edo_smc.Scenario.template(plant).save(tmp_path / f"{plant}.toml")
    host_sim("export", path, "--standalone", "-o", tmp_path / "theirs.h")
    ours = edo_smc.Scenario(path).export_c(tmp_path / "ours")
    assert ours.read_bytes() == (tmp_path / "theirs.h").read_bytes()
    with pytest.raises(FileExistsError):
        edo_smc.Scenario(path).export_c(tmp_path / "ours")
    assert edo_smc.Scenario(path).export_c(tmp_path / "ours", force=True) == ours


def test_what_must_not_be_exported_is_refused(tmp_path):
    with pytest.raises(edo_smc.ScenarioError) as caught:
        edo_smc.Scenario.template("paper").export_c(tmp_path)
    assert caught.value.key == "plant.reading" and "paper=True" in caught.value.remedy
    without = edo_smc.Scenario.template("chain").with_settings({"controller.limits": {}})
    with pytest.raises(edo_smc.ScenarioError, match="no_limits=True"):
        without.export_c(tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_comparison_is_that_of_host_sim(motor, tmp_path, host_sim):
    path = motor.save(tmp_path / "motor.toml")
    host_sim("compare", path, "--evaluations", 3, "--noise", "0.05", "--out", tmp_path / "out")
    found = motor.compare(evaluations=3, noise_a=[0.05])
    assert found.data == json.loads((tmp_path / "out/compare.json").read_text())
    assert "edo-smc" in repr(found) and len(found.to_pandas()) == len(found.entries)


def test_a_tuned_drive_is_that_of_host_sim(motor, tmp_path, host_sim):
    path = motor.save(tmp_path / "motor.toml")
    told = json.loads(host_sim("tune", path, "--evaluations", 6, "--move", 0.5, "--to", tmp_path / "tuned.toml",
                               "--out", tmp_path / "out", "--json"))
    found = motor.tune(evaluations=6, move_rad=0.5)
    assert found.settings == dict(told["settings"]) and found.missed == told["missed"] == []
    gains = found.scenario.design().gains
    assert gains["surface_rad_s"] == found.settings["surface_rad_s"] and "met" in repr(found)


def test_a_map_is_that_of_host_sim(motor, tmp_path, host_sim):
    path = motor.save(tmp_path / "motor.toml")
    axes = ("error.inertia_percent=-50..100:5", "error.torque_percent=-50..100:4")
    told = json.loads(host_sim("map", path, "--x", axes[0], "--y", axes[1], "--out", tmp_path / "out", "--json"))
    found = motor.map(x=axes[0], y=axes[1])
    assert {key: it for key, it in found.data.items() if key != "scenario"} == {
        key: it for key, it in told.items() if key != "scenario"
    }
    assert found.values.shape == found.good.shape == (4, 5) and found.good.any()
    found.plot().savefig(tmp_path / "map.png")
    corners = motor.map(preset="corners")
    assert corners.data["points"] and "corners" in repr(corners)


def number_at(told, name):
    """Returns a number of run.json by its path."""
    for key in name.split("."):
        told = told[int(key) if isinstance(told, list) else key]
    return np.nan if told is None else told


def test_trials_are_those_of_host_sim(motor, tmp_path, host_sim):
    short = motor.with_settings({"span_s": 0.3})
    path = short.save(tmp_path / "motor.toml")
    found = short.monte_carlo(uncertain_percent=50, trials=20, seed=3)
    assert len(found) == 20
    for trial in (0, 7, 19):
        words = ("--uncertain", 50, "--trials", 20, "--seed", 3, "--replay", trial, "--json", "--out", tmp_path / "out")
        told = json.loads(host_sim("monte-carlo", path, *words))
        drawn = dict(entry.split("=") for entry in told["sets"])
        for name in found.columns:
            value = float(drawn[name]) if name in drawn else number_at(told, name)
            assert np.array_equal(found[name][trial], value, equal_nan=True), name
        assert found.outcomes[trial] == told["ending"]
    assert found.to_pandas().shape[0] == 20 and "finished" in repr(found)
    by_key = short.monte_carlo(vary={"error.inertia_percent": "uniform(-50,50)"}, trials=5)
    assert np.all(np.abs(by_key["error.inertia_percent"]) <= 50.0)


def recording(motor):
    """Returns a recording of a motor that is not that of the data sheet."""
    moves = dict(kind="sine", amplitude_rad=2.0, frequency_hz=2.0)
    trace = motor.simulate(reference=moves, friction=dict(coulomb_n_m=0.003), error=dict(inertia_percent=15.0), span_s=3.0)
    counts = motor.controller().counts(trace["angle_rad"])
    return {"tick": np.arange(len(trace)), "count_motor": counts.astype(int), "u_held_a": trace["u_held"]}


def test_identified_parameters_are_those_of_host_sim(motor, tmp_path, host_sim):
    path, record = motor.save(tmp_path / "motor.toml"), recording(motor)
    csv = tmp_path / "record.csv"
    rows = zip(*(column.tolist() for column in record.values()))
    csv.write_text(",".join(record) + "\n" + "".join(f"{k},{count},{u!r}\n" for k, count, u in rows))
    told = json.loads(host_sim("identify", csv, path, "--to", tmp_path / "found.toml", "--out", tmp_path / "out", "--json"))
    for given in (record, csv):
        found = motor.identify(given)
        assert found.parameters == told["parameters"]
    assert found["b"] == pytest.approx(0.07 / 3e-4 / 1.15, rel=0.05)
    assert found.scenario.design().is_stable and "b, torque constant" in repr(found)


def test_a_recording_that_supports_no_design_is_refused(motor):
    record = recording(motor)
    record["count_motor"] = record["count_motor"] * 0
    with pytest.raises(edo_smc.Refused, match="record"):
        motor.identify(record)
    with pytest.raises(edo_smc.ScenarioError, match="no column u_held_a"):
        motor.identify({key: it for key, it in record.items() if key != "u_held_a"})


@pytest.mark.parametrize("study", ["simulate", "compare", "tune", "monte_carlo"])
def test_ctrl_c_is_answered_within_a_fifth_of_a_second(motor, study):
    long = {
        "simulate": lambda: motor.simulate(span_s=400.0, progress=False),
        "compare": lambda: motor.compare(evaluations=100_000, progress=False),
        "tune": lambda: motor.tune(evaluations=100_000, progress=False),
        "monte_carlo": lambda: motor.monte_carlo(uncertain_percent=50, trials=1_000_000, progress=False),
    }[study]
    sent = []

    def press():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(1.0, press)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            long()
    finally:
        timer.join()
    assert time.perf_counter() - sent[0] < 0.2


def test_other_threads_go_on_during_a_run(motor):
    steps, done = [], threading.Event()

    def count():
        while not done.wait(0.01):
            steps.append(time.perf_counter())

    thread = threading.Thread(target=count)
    thread.start()
    started = time.perf_counter()
    motor.simulate(span_s=20.0, progress=False)
    took = time.perf_counter() - started
    done.set()
    thread.join()
    assert len(steps) > 0.3 * took / 0.01


def test_a_preset_and_a_column_are_told_by_their_nearest_name():
    motor = edo_smc.Scenario.template("motor")
    with pytest.raises(ValueError, match="preset plants: did you mean plant"):
        motor.map(preset="plants")
    with pytest.raises(KeyError, match="did you mean"):
        motor.simulate(span_s=0.01)["u_held_a"]
