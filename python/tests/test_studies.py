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
    with pytest.raises(FileExistsError, match="force=True"):
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


@pytest.mark.parametrize("prefix", ["1 bad", "", "a-b", "ü", "a\n"])
def test_a_prefix_is_a_c_identifier(motor, tmp_path, prefix):
    with pytest.raises(edo_smc.ScenarioError, match="expected a C identifier"):
        motor.export_c(tmp_path / "fw", prefix=prefix)
    assert not (tmp_path / "fw").exists()


def test_a_failed_run_is_not_shown_as_a_number(motor):
    found = motor.compare(evaluations=1, noise_a=0.05, progress=False)
    for entry in found.entries:
        entry["load_rad"] = 100.0 if entry["law"] == "P-PI" else 0.01
    line = next(line for line in repr(found).splitlines() if "P-PI" in line)
    assert line.split() == ["P-PI", "failed", "under", "the", "load", "step"]
    rows = found.to_pandas().set_index("law")["load_rad"]
    assert np.isnan(rows["P-PI"]) and rows.max() == 0.01
    tuned = motor.tune(evaluations=1, settling_s=0.01, progress=False)
    tuned.data["found"]["worst"]["settle_s"], tuned.data["missed"] = 100.0, ["settling"]
    assert "NOT MET: settling failed (limit 0.01)" in repr(tuned) and " 100 " not in repr(tuned)


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda m: m.monte_carlo(uncertain_percent=20, trials=-1), "trials"),
        (lambda m: m.monte_carlo(uncertain_percent=20, trials=0), "trials"),
        (lambda m: m.monte_carlo(uncertain_percent="foo"), "uncertain_percent"),
        (lambda m: m.monte_carlo(vary="error.inertia_percent=foo"), "vary"),
        (lambda m: m.tune(evaluations=-1), "evaluations"),
        (lambda m: m.tune(evaluations=0), "evaluations"),
        (lambda m: m.tune(seed=-1), "seed"),
        (lambda m: m.tune(cycles=0), "cycles"),
        (lambda m: m.tune(cycles=1), "cycles"),
        (lambda m: m.tune(phase_deg=100), "phase_deg"),
        (lambda m: m.tune(sensitivity_peak=0.5), "sensitivity_peak"),
        (lambda m: m.tune(settling_s=-1), "settling_s"),
        (lambda m: m.tune(load_rad=-1), "load_rad"),
        (lambda m: m.tune(uncertain_percent=30), "uncertain_percent"),
        (lambda m: m.compare(evaluations=0), "evaluations"),
        (lambda m: m.compare(noise_a=-1), "noise_a"),
        (lambda m: m.map(preset="gain", at_most=float("nan")), "at_most"),
        (lambda m: m.map(preset="gain", figure="foo"), "figure"),
    ],
)
def test_an_error_names_the_argument(motor, call, key):
    with pytest.raises(edo_smc.ScenarioError) as caught:
        call(motor)
    assert caught.value.key == key and str(caught.value).startswith(key) and "--" not in str(caught.value)


def test_no_error_names_an_option_of_the_command_line(motor, joint):
    with pytest.raises(ValueError, match="give x and y, preset=NAME, or corners=PERCENT"):
        motor.map()
    k = np.arange(4000)
    still = dict(tick=k, count_motor=0 * k, u_held_a=0.0 * k)
    with pytest.raises(edo_smc.Refused, match="Record longer moves, or check the column"):
        motor.identify(still)
    with pytest.raises(ValueError, match="give motor_alone=True"):
        joint.identify(still)
    moving = dict(tick=k, count_motor=(1000 * np.sin(k / 50)).astype(int), u_held_a=np.cos(k / 50))
    with pytest.raises(edo_smc.Refused) as caught:
        motor.identify(moving)
    assert "--" not in str(caught.value)
    for call in (lambda: motor.tune(evaluations=2.5), lambda: motor.compare(noise_a="much")):
        with pytest.raises(TypeError, match="expected a"):
            call()


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
    assert found.data["settings"] == told["settings"] and found.missed == told["missed"] == []
    gains = found.scenario.design().gains
    assert gains["surface_rad_s"] == [found.settings["drive.surface_rad_s"]] and "met" in repr(found)
    assert "margins, not limited by the specification" in repr(found)
    assert motor.with_settings(found.settings).design_hash == found.scenario.design_hash


def test_a_missed_limit_has_its_value(motor):
    found = motor.tune(evaluations=2, noise_a=1e-4, phase_deg=80, sensitivity_peak=1.1)
    assert {"noise", "phase margin"} <= set(found.missed)
    first = repr(found).splitlines()[0]
    assert "NOT MET: noise " in first and "A rms (limit 0.0001)" in first and "deg (limit 80)" in first
    assert "margins, phase margin at least 80 deg and Ms at most 1.1" in repr(found)


def test_tuned_settings_of_a_joint_are_settings(joint):
    found = joint.tune(evaluations=1)
    assert len(found.settings["drive.fast_ratios"] if "drive.fast_ratios" in found.settings else [0, 0]) == 2
    assert joint.with_settings(found.settings).design_hash == found.scenario.design_hash


def test_a_map_is_that_of_host_sim(motor, tmp_path, host_sim):
    path = motor.save(tmp_path / "motor.toml")
    axes = ("error.inertia_percent=-50..100:5", "error.torque_percent=-50..100:4")
    told = json.loads(host_sim("map", path, "--x", axes[0], "--y", axes[1], "--out", tmp_path / "out", "--json"))
    found = motor.map(x=axes[0], y=axes[1])
    assert {key: it for key, it in found.data.items() if key != "scenario"} == {
        key: it for key, it in told.items() if key != "scenario"
    }
    assert found.values.shape == found.good.shape == (4, 5) and found.good.any()
    assert np.array_equal(found.x, np.linspace(-50.0, 100.0, 5)) and np.array_equal(found.y, np.linspace(-50.0, 100.0, 4))
    found.plot().savefig(tmp_path / "map.png")
    corners = motor.map(preset="corners")
    assert corners.data["points"] and "corners" in repr(corners) and corners.x is corners.y is None


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


def test_a_recording_that_is_none_is_refused(motor):
    pandas = pytest.importorskip("pandas")
    record = recording(motor)
    with pytest.raises(ValueError, match="different lengths: tick 6001, count_motor 6000"):
        motor.identify({**record, "count_motor": record["count_motor"][:-1]})
    with pytest.raises(ValueError, match=r"record\['u_held_a'\]: found shape"):
        motor.identify({**record, "u_held_a": np.zeros((3, 2))})
    for wrong in (3, np.zeros((3, 3)), pandas.Series([1.0])):
        with pytest.raises(TypeError, match="expected a path of a CSV file, a pandas.DataFrame, or a dictionary"):
            motor.identify(wrong)


@pytest.mark.parametrize("study", ["simulate", "compare", "tune", "monte_carlo"])
def test_ctrl_c_is_answered_within_a_fifth_of_a_second(motor, study):
    long = {
        # With friction a run takes longer.
        "simulate": lambda: motor.simulate(span_s=400.0, friction=dict(coulomb_n_m=0.003), progress=False),
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
    motor.simulate(span_s=100.0, friction=dict(coulomb_n_m=0.003), progress=False)
    took = time.perf_counter() - started
    done.set()
    thread.join()
    assert len(steps) > 0.3 * took / 0.01


def test_a_preset_and_a_column_are_told_by_their_nearest_name():
    motor = edo_smc.Scenario.template("motor")
    with pytest.raises(ValueError, match="preset = plants: did you mean plant"):
        motor.map(preset="plants")
    with pytest.raises(KeyError, match="did you mean"):
        motor.simulate(span_s=0.01)["u_held_a"]
