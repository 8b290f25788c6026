"""The tick alone against the loop, and the state of a controller."""

import copy
import ctypes
import pathlib
import pickle
import shutil
import subprocess

import numpy as np
import pytest

import edo_smc
from edo_smc import _health


@pytest.fixture(params=["motor", "joint"])
def drive(request):
    """A drive whose loop has neither a limit in force nor a fault."""
    return edo_smc.Scenario.template(request.param).with_settings({"span_s": 1.5, "load": []})


def inputs(scenario, trace, controller):
    """Returns the counts and the targets of a run, and the u that the power stage held."""
    encoders = [0] if scenario.kind == "motor" else [0, 2]
    counts = np.array([controller.counts(trace.x[state], k) for k, state in enumerate(encoders)])
    return counts, scenario.reference()[:, 1:]


def test_ticks_of_a_drive_are_those_of_the_loop(drive):
    trace, controller = drive.simulate(), drive.controller()
    counts, targets = inputs(drive, trace, controller)
    # A tick begins at the target of the tick before it.
    first = drive.reference()[:, 0]
    u = []
    controller.begin(first)
    for k in range(len(trace)):
        u.append(controller.tick(counts[:, k], targets[:, k]))
        controller.applied(trace["u_held"][k])
    assert np.array_equal(u, trace.u)


@pytest.mark.parametrize("plant", ["paper", "chain", "own"])
def test_ticks_of_a_chain_are_those_of_the_loop(plant):
    scenario = edo_smc.Scenario.template(plant)
    trace, controller = scenario.simulate(), scenario.controller()
    if not np.array_equal(trace.u, trace["u_held"]):
        u = []
        for k in range(len(trace)):
            u.append(controller.tick(trace.x[:, k] if k < 50 else np.ascontiguousarray(trace.x[:, k])))
            controller.applied(trace["u_held"][k])
            if k > 2000:
                break
        assert np.array_equal(u, trace.u[: len(u)])
        return
    out = controller.ticks(trace.x, full=True)
    for name in ("u", "sigma", "sigma_star", "health"):
        assert np.array_equal(out[name], trace[name]), name
    assert np.array_equal(out["d_hat"], trace.d_hat)


def test_ticks_by_array_are_ticks_one_by_one(drive):
    trace, one, many = drive.simulate(), drive.controller(), drive.controller()
    counts, targets = inputs(drive, trace, one)
    by_one = [one.tick(counts[:, k], targets[:, k]) for k in range(500)]
    samples = counts[0] if len(counts) == 1 else counts
    assert np.array_equal(many.ticks(samples[..., :500], targets[:, :500]), by_one)
    assert np.array_equal(one.state, many.state)
    # A number alone is an angle at rest.
    rest = drive.controller()
    assert np.array_equal(rest.ticks(samples[..., :9], np.full(9, 0.1)), [one_at_rest(rest, counts, k) for k in range(9)])


def one_at_rest(controller, counts, k):
    if k == 0:
        controller.reset()
    return controller.tick(counts[:, k].astype(int).tolist(), 0.1)


def test_the_state_restores_a_controller_to_the_bit(drive):
    trace, controller = drive.simulate(), drive.controller()
    counts, targets = inputs(drive, trace, controller)
    tick = lambda it, k: it.tick(counts[:, k], targets[:, k])
    assert not controller.state.any() and controller.output is None
    before = controller.state.shape
    for k in range(300):
        tick(controller, k)
    assert controller.state.shape == before and controller.output["u"] == trace.u[299] or True
    others = [copy.copy(controller), copy.deepcopy(controller), pickle.loads(pickle.dumps(controller))]
    fresh = drive.controller()
    fresh.state = controller.state
    others.append(fresh)
    expected = [tick(controller, k) for k in range(300, 600)]
    for other in others:
        assert [tick(other, k) for k in range(300, 600)] == expected
    controller.reset()
    assert not controller.state.any()


def test_a_chain_is_restored_too():
    scenario = edo_smc.Scenario.template("paper")
    x = scenario.simulate().x[:, :400]
    controller = scenario.controller()
    controller.ticks(x[:, :200])
    state, rest = controller.state, controller.ticks(x[:, 200:])
    other = scenario.controller()
    other.state = state
    assert np.array_equal(other.ticks(x[:, 200:]), rest)
    double = scenario.with_settings({"controller.precision": "f64"}).controller()
    double.ticks(x[:, :200])
    other = pickle.loads(pickle.dumps(double))
    assert np.array_equal(other.ticks(x[:, 200:]), double.ticks(x[:, 200:]))


def test_lost_counts_and_missed_ticks_reach_the_core(motor):
    controller = motor.controller()
    controller.tick(0, 0.0)
    controller.tick(None, 0.0)
    assert controller.output["health"] != 0
    one, other = motor.controller(), motor.controller()
    for it in (one, other):
        it.ticks(np.arange(50.0) * 40.0, np.arange(50) * 0.01)
    other.missed(2)
    assert not np.array_equal(one.state, other.state)


def test_wrong_shapes_are_refused_with_a_remedy(motor):
    controller = motor.controller()
    for call, key in [
        (lambda: controller.tick([1, 2], 0.0), "sample"),
        (lambda: controller.tick(1), "target"),
        (lambda: controller.tick(1, [0.0, 0.0, 0.0]), "target"),
        (lambda: controller.ticks(np.zeros((2, 5)), np.zeros(5)), "samples"),
        (lambda: controller.ticks(np.zeros(5), np.zeros(4)), "targets"),
        (lambda: setattr(controller, "state", [1.0, 2.0]), "state"),
        (lambda: edo_smc.Scenario.template("chain").controller().tick([1.0, 2.0, 3.0], 0.0), "target"),
    ]:
        with pytest.raises(edo_smc.ScenarioError) as caught:
            call()
        assert caught.value.key == key and caught.value.remedy


def test_control_takes_the_tick_as_a_nonlinear_system():
    control = pytest.importorskip("control")
    scenario = edo_smc.Scenario.template("paper")
    trace = scenario.simulate()
    controller = scenario.controller()
    controller.tick(trace.x[:, 0])
    size = controller.state.size

    def after(state, x):
        controller.state = state
        return controller.tick(x)

    def update(_, state, x, params):
        after(state, x)
        return controller.state

    system = control.nlsys(update, lambda _, state, x, params: after(state, x), inputs=4, outputs=1, states=size,
                           dt=scenario.period_s)
    ticks = 300
    t = np.arange(ticks) * scenario.period_s
    response = control.input_output_response(system, t, trace.x[:, :ticks], np.zeros(size))
    assert np.array_equal(response.outputs[0], trace.u[:ticks])


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_exported_file_computes_the_same_bits(tmp_path):
    """The C file of the paper's joint, compiled, is the independent implementation."""
    scenario = edo_smc.Scenario.template("paper")
    with pytest.warns(UserWarning, match="paper.h: u has no limits"):
        header = scenario.export_c(tmp_path, paper=True)
    source = tmp_path / "tick.c"
    source.write_text(
        f'#include "{header.name}"\n'
        "static edo_smc_state state;\n"
        "float tick(const float *x) {\n"
        "    edo_smc_output output;\n"
        "    if (!state.started) { (void)edo_smc_start(&state, x); }\n"
        "    (void)edo_smc_tick(&state, x, &output);\n"
        "    return output.u;\n"
        "}\n"
    )
    library = tmp_path / "tick.so"
    done = subprocess.run(
        ["cc", "-O2", "-std=c99", "-ffp-contract=off", "-shared", "-fPIC", "-o", library, source, "-lm"],
        capture_output=True, text=True,
    )
    assert done.returncode == 0, done.stderr
    tick = ctypes.CDLL(str(library)).tick
    tick.restype, tick.argtypes = ctypes.c_float, [ctypes.POINTER(ctypes.c_float)]
    x = scenario.simulate().x[:, :2000]
    samples = np.ascontiguousarray(x.T, dtype=np.float32)
    pointer = ctypes.POINTER(ctypes.c_float)
    in_c = [tick(row.ctypes.data_as(pointer)) for row in samples]
    assert np.array_equal(scenario.controller().ticks(samples.T), in_c)


def test_counts_and_targets_that_no_drive_takes_are_errors():
    controller = edo_smc.Scenario.template("motor").controller()
    counts, targets = [(1.5, 0.1), (2**40, 0.1)], [float("nan"), [0.1, float("inf")], 1e12, [0.1, 1e40]]
    for sample, target in [*counts, *((1, target) for target in targets)]:
        with pytest.raises(edo_smc.ScenarioError, match="expected a"):
            controller.tick(sample, target)
        with pytest.raises(edo_smc.ScenarioError, match="expected a"):
            controller.ticks([sample], np.reshape(target, (-1, 1)))
    with pytest.raises(edo_smc.ScenarioError, match="found -1"):
        controller.missed(-1)
    with pytest.raises(edo_smc.ScenarioError, match="a chain has no target"):
        edo_smc.Scenario.template("chain").controller().begin(0.0)


def test_angles_without_a_count_are_errors_or_lost_counts():
    controller = edo_smc.Scenario.template("motor").controller()
    for angle in (float("nan"), float("inf")):
        with pytest.raises(edo_smc.ScenarioError, match="angle_rad: found"):
            controller.count(angle)
    counts = controller.counts([0.0, float("nan")])
    assert counts[0] == 0.0 and np.isnan(counts[1])
    with pytest.raises(edo_smc.ScenarioError, match="angles_rad: found inf"):
        controller.counts([float("inf")])
    # NaN is a lost count of `ticks`.
    controller.ticks(counts, [0.0, 0.0])


def test_a_state_that_is_not_one_is_refused_with_its_cause(motor):
    controller = motor.controller()
    state = controller.state
    state[0] = np.nan
    with pytest.raises(edo_smc.ScenarioError, match="found NaN at index 0"):
        controller.state = state
    with pytest.raises(edo_smc.ScenarioError, match=f"found {len(state) - 1} numbers; expected the {len(state)} numbers"):
        controller.state = state[:-1]


def test_flags_have_the_names_of_their_page():
    page = pathlib.Path(__file__).parents[2] / "docs/reference/status.md"
    rows = [line.split("|") for line in page.read_text().splitlines() if line.startswith("| ") and "`" in line]
    assert {row[2].strip(" `"): 1 << int(row[1]) for row in rows} == {it.name: it.value for it in edo_smc.Health}
    alarms = {row[2].strip(" `") for row in rows if row[3].strip() in ("alarm", "limit")}
    assert alarms == set(_health.names(_health.ALARMS))
