"""Scenarios from data sheets, dictionaries, text and files; errors in parts."""

import inspect
import json
import pickle

import numpy as np
import pytest

import edo_smc
from edo_smc import _edo_smc


def test_a_data_sheet_becomes_a_scenario_file(motor, tmp_path, host_sim):
    assert (motor.name, motor.kind, motor.period_s, motor.span_s) == ("spindle", "motor", 5e-4, 0.8)
    assert "inertia_kg_m2 = 0.0003" in motor.toml
    path = motor.save(tmp_path / "spindle.toml")
    assert host_sim("run", path, "--no-files").startswith("spindle: ")
    with pytest.raises(FileExistsError, match="force=True"):
        motor.save(path)
    assert motor.save(path, force=True) == path


JOINT = dict(
    link_inertia_kg_m2=0.2,
    motor_inertia_kg_m2=9e-4,
    stiffness_n_m=9.0,
    torque_n_m_per_a=0.12,
    max_current_a=30.0,
    encoder=dict(link=dict(bits=20), motor=dict(bits=20)),
)


@pytest.mark.parametrize(
    ("plant", "keys"),
    [(edo_smc.Motor, dict(inertia_kg_m2=3e-4, torque_n_m_per_a=0.07, max_current_a=8.0, encoder=dict(bits=15))),
     (edo_smc.Joint, JOINT)],
)
def test_no_number_of_the_template_is_in_an_own_plant(plant, keys):
    """Damping, weight, sudden load, friction and load of the template belong to its plant."""
    tomllib = pytest.importorskip("tomllib")
    own = tomllib.loads(plant(**keys).toml)
    sheet = {key: it for key, it in keys.items() if key != "encoder"}
    assert own.pop(plant._sheet) == sheet and own.pop("encoder") == keys["encoder"]
    assert own.pop("drive") == {"period_s": 1e-3} and own.pop("monitor") == {"reaction": "brake"}
    assert own.pop("reference")["kind"] == "move" and set(own) == {"name", "title", "span_s"}
    # The title names no number of the reference, and the text has no key of another table as a comment.
    text = plant(**keys).toml
    assert "rad" not in own["title"] and text.count("#") == 1
    assert plant(**keys).simulate(reference=dict(kind="move", to_rad=0.5)).first_alarm is None


def test_an_own_joint_takes_a_load_up_to_its_motor_torque():
    """The sudden load of the template is 1.3 N m: a joint of 180 N m rejected its load as an encoder fault."""
    encoder = dict(link=dict(bits=19), motor=dict(bits=32, counts_per_turn=16384, states=2**32))
    joint = edo_smc.Joint(
        gear=[100, 1], motor_inertia_kg_m2=2e-4, torque_n_m_per_a=0.3, max_current_a=6.0, link_inertia_kg_m2=4.0,
        stiffness_n_m=9000.0, encoder=encoder,
    )
    trace = joint.simulate(load=dict(kind="step", amplitude=60.0, t0_s=1.5))
    assert trace.first_alarm is None and trace.figures["ticks_with"]["input_rejected"] == 0
    assert abs(trace.error[-1]) < 1e-3


def test_given_keys_join_the_tables_that_stay():
    motor = edo_smc.Motor(
        inertia_kg_m2=3e-4, torque_n_m_per_a=0.07, max_current_a=8.0, encoder=dict(bits=15),
        drive=dict(gain_sets=1), monitor=dict(saturated_s=0.3), reference=dict(kind="rest"), title="mine",
    )
    assert motor.title == "mine" and 'reaction = "brake"' in motor.toml and "saturated_s = 0.3" in motor.toml
    assert "period_s = 0.001" in motor.toml and "to_rad" not in motor.toml


def test_a_joint_and_a_chain_have_their_data_sheets_too():
    assert edo_smc.Joint(**JOINT).kind == "joint"
    chain = edo_smc.Chain(
        order=2,
        a=[0.0, -1.0],
        b=2.0,
        controller=dict(surface_bandwidth_rad_s=4.0, observer=[dict(channel=2, order=1, bandwidth_rad_s=40.0)]),
    )
    assert (chain.kind, chain.order) == ("chain", 2)
    third = edo_smc.Chain(order=3, a=np.array([-6.0, -11.0, -6.0]), b=np.float64(2.0))
    assert third.order == 3 and "nominal" not in third.toml and "30 %" not in third.title


def test_a_dictionary_a_text_and_a_file_are_one_scenario(tmp_path):
    text = edo_smc.Scenario.template("chain").toml
    path = tmp_path / "chain.toml"
    path.write_text(text)
    tables = {"plant": {"kind": "chain", "order": 2, "a": [0, -1], "b": np.float32(2)}}
    tables["controller"] = {"surface_bandwidth_rad_s": 4.0, "k_l": None}
    hashes = {it.design_hash for it in (edo_smc.Scenario(text), edo_smc.Scenario(path), edo_smc.Scenario(str(path)))}
    assert len(hashes) == 1
    assert edo_smc.Scenario(tables).order == 2
    changed = edo_smc.Scenario(path, settings={"controller.k_l": 25.0})
    assert changed.design_hash not in hashes and changed.settings == ["controller.k_l=25.0"]


@pytest.mark.parametrize(
    ("keys", "key", "cause", "remedy"),
    [
        (dict(inertia_kg_m2=-1.0), "motor.inertia_kg_m2", "found -1.0", "expected a finite number above 0"),
        (dict(inertia=1.0), "motor.inertia", "unknown key `motor.inertia`", "did you mean `inertia_kg_m2`?"),
        (dict(drive=dict(periods=1.0)), "drive.periods", "unknown key `drive.periods`", "did you mean `period_s`?"),
        (dict(max_current_a=None), "motor.max_current_a", None, None),
    ],
)
def test_an_error_names_key_cause_and_remedy(keys, key, cause, remedy):
    sheet = dict(inertia_kg_m2=3e-4, torque_n_m_per_a=0.07, max_current_a=8.0, encoder=dict(bits=15))
    with pytest.raises(edo_smc.ScenarioError) as caught:
        edo_smc.Motor(**{**sheet, **keys})
    error = caught.value
    assert isinstance(error, ValueError) and error.key == key
    assert cause in (None, error.cause) and remedy in (None, error.remedy)
    # A scenario from keywords has no lines.
    assert "toml" not in str(error) and key in str(error)


@pytest.mark.parametrize(
    ("plant", "missing"),
    [(edo_smc.Motor, ["inertia_kg_m2", "torque_n_m_per_a", "max_current_a", "encoder"]),
     (edo_smc.Joint, list(JOINT)),
     (edo_smc.Chain, ["order", "a", "b"])],
)
def test_missing_keywords_have_their_names(plant, missing):
    with pytest.raises(edo_smc.ScenarioError) as caught:
        plant()
    assert f"missing keywords of {plant.__name__}: {', '.join(missing)};" in str(caught.value)
    assert "host-sim" not in str(caught.value)
    # The example of the message is a scenario.
    eval(f"edo_smc.{caught.value.remedy.removeprefix('as in ')}")


def test_keys_of_other_programs_have_their_form_here():
    sheet = dict(inertia_kg_m2=3e-4, torque_n_m_per_a=0.07, max_current_a=8.0, encoder=dict(bits=15))
    with pytest.raises(edo_smc.ScenarioError, match="current_lag_s=0.000199") as caught:
        edo_smc.Motor(current_loop_hz=800, **sheet)
    assert caught.value.key == "motor.current_loop_hz"
    for encoder, form in [(dict(counts=4096), "counts_per_turn=4096"), (dict(lines=1024), "counts_per_turn=4096")]:
        with pytest.raises(edo_smc.ScenarioError, match=form):
            edo_smc.Motor(**{**sheet, "encoder": encoder})
    with pytest.raises(edo_smc.ScenarioError, match="encoder.link.cpr"):
        edo_smc.Joint(**{**JOINT, "encoder": dict(link=dict(cpr=4096), motor=dict(bits=14))})


def test_a_scenario_has_the_warnings_of_its_design(tmp_path):
    sheet = dict(inertia_kg_m2=3e-4, torque_n_m_per_a=0.07, max_current_a=8.0, encoder=dict(bits=15))
    # An export of an unstable drive is refused without the last key.
    weak = edo_smc.Motor(**sheet, drive=dict(uncertain_percent=50.0, surface_rad_s=250.0, accept_unstable=True))
    assert len(weak.warnings) == 1 and weak.warnings == weak.design().warnings
    assert "unstable in 1 of 4 corners" in weak.warnings[0] and "details: design()" in weak.warnings[0]
    assert weak.simulate().warnings == weak.warnings
    with pytest.warns(UserWarning) as caught:
        weak.export_c(tmp_path)
    assert [str(it.message) for it in caught] == [f"motor_drive.h: {it}" for it in weak.warnings]


def test_an_error_of_a_text_has_its_place_and_all_lines(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('[motor]\ninertia_kg_m2 = -1\ntorque = 2.0\n[encoder]\nbits = 14\n')
    with pytest.raises(edo_smc.ScenarioError) as caught:
        edo_smc.Scenario(path)
    assert str(caught.value).startswith("mine.toml:2:17: `motor.inertia_kg_m2`: found -1")
    assert len(str(caught.value).splitlines()) >= 2
    with pytest.raises(TypeError, match="a scenario has numbers"):
        edo_smc.Scenario({"motor": {"inertia_kg_m2": object()}})


def test_a_scenario_is_copied_by_pickle(motor):
    again = pickle.loads(pickle.dumps(motor.with_settings({"span_s": 0.5})))
    assert (again.design_hash, again.span_s, again.name) == (motor.design_hash, 0.5, "spindle")


@pytest.mark.parametrize("plant", [edo_smc.Motor, edo_smc.Joint])
def test_every_key_of_the_data_sheet_and_every_table_is_a_keyword(plant):
    schema = json.loads(_edo_smc.schema(plant._plant))
    sheet = schema["properties"].pop(plant._sheet)["$ref"].rsplit("/", 1)[1]
    keys = {*schema["properties"], *schema["$defs"][sheet]["properties"]}
    assert keys == set(inspect.signature(plant).parameters) - {"more"}
    # A misspelt one still gets the nearest known key.
    with pytest.raises(edo_smc.ScenarioError, match="inertia_kg_m2"):
        edo_smc.Motor(inertia_kg_m=2e-4, torque_n_m_per_a=0.05, max_current_a=10.0, encoder=dict(bits=14))
