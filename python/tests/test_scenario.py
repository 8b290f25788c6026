"""Scenarios from data sheets, dictionaries, text and files; errors in parts."""

import inspect
import json
import pickle

import numpy as np
import pytest

import edo_smc
from edo_smc import _edo_smc


def test_a_data_sheet_becomes_the_template_with_its_numbers(motor, tmp_path, host_sim):
    assert (motor.name, motor.kind, motor.period_s, motor.span_s) == ("spindle", "motor", 5e-4, 0.8)
    assert "inertia_kg_m2 = 0.0003" in motor.toml and "damping_n_m_s = 1e-5" not in motor.toml
    path = motor.save(tmp_path / "spindle.toml")
    assert host_sim("run", path, "--no-files").startswith("spindle: ")
    with pytest.raises(FileExistsError):
        motor.save(path)


def test_a_joint_and_a_chain_have_their_data_sheets_too():
    encoder = dict(link=dict(bits=20), motor=dict(bits=20))
    sheet = dict(link_inertia_kg_m2=0.2, motor_inertia_kg_m2=9e-4, stiffness_n_m=9.0, torque_n_m_per_a=0.12)
    joint = edo_smc.Joint(max_current_a=30.0, encoder=encoder, **sheet)
    assert joint.kind == "joint" and "sudden_load_n_m = 1.3" in joint.toml
    chain = edo_smc.Chain(
        order=2,
        a=[0.0, -1.0],
        b=2.0,
        controller=dict(surface_bandwidth_rad_s=4.0, observer=[dict(channel=2, order=1, bandwidth_rad_s=40.0)]),
    )
    assert (chain.kind, chain.order) == ("chain", 2)
    assert edo_smc.Chain(order=3, a=np.array([-6.0, -11.0, -6.0]), b=np.float64(2.0)).order == 3


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
