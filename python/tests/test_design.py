"""Designs against `host-sim design` and against python-control."""

import json

import numpy as np
import pytest

import edo_smc


@pytest.mark.parametrize("plant", ["motor", "joint", "chain"])
def test_a_design_is_that_of_host_sim(plant, tmp_path, host_sim):
    scenario = edo_smc.Scenario.template(plant)
    path = scenario.save(tmp_path / f"{plant}.toml")
    assert scenario.design().data == json.loads(host_sim("design", path, "--json"))


def test_keywords_of_a_design_are_keys_of_the_drive(motor):
    fast, standard = motor.design(), motor.design(margin="standard", uncertain_percent=10.0)
    assert standard.margins["sensitivity_peak"] < fast.margins["sensitivity_peak"]
    assert standard.gains["surface_rad_s"] != fast.gains["surface_rad_s"]
    assert fast.is_stable and set(fast.gain_sets) == {"base", "high"}
    assert set(fast.worst_corners["high"]) == {"name", "sensitivity_peak"}
    assert fast.noise_rms == pytest.approx(fast.noise[0]["u_rms"])
    with pytest.raises(edo_smc.ScenarioError) as caught:
        motor.design(margin=9.0)
    assert caught.value.key == "drive.margin"


def test_a_design_shows_its_numbers_aligned(motor):
    design = motor.design()
    lines = repr(design).splitlines()
    assert lines[0] == "Design of spindle, T = 0.0005 s"
    assert any(line.split()[:2] == ["phase", "margin"] and line.endswith("deg") for line in lines)
    assert "<table>" in design._repr_html_() and "phase margin" in design._repr_html_()


def test_help_of_a_design_has_every_result():
    for name in ("chosen", "gains", "warnings"):
        assert isinstance(getattr(edo_smc.Design, name), property) and getattr(edo_smc.Design, name).__doc__, name


@pytest.mark.parametrize("plant", ["motor", "joint", "chain"])
def test_complex_poles_come_in_pairs(plant):
    """The logarithm of a z that is rounding noise about 0 is no pole."""
    scenario = edo_smc.Scenario.template(plant)
    for settings in ({}, {"drive.delay_ticks": 2}) if plant != "chain" else ({},):
        design = scenario.with_settings(settings).design()
        z = np.exp(design.poles * design.period_s)
        paired = design.poles[np.abs(z.imag) > 1e-6 * np.abs(z)]
        assert np.allclose(np.sort_complex(paired), np.sort_complex(paired.conj()))
        assert np.all(np.abs(z) > 1e-5) and len(design.poles) > 2


@pytest.mark.parametrize("plant", ["motor", "joint", "chain"])
def test_control_finds_the_poles_and_margins_of_the_design(plant):
    control = pytest.importorskip("control")
    design = edo_smc.Scenario.template(plant).design()
    open_loop, closed = design.to_control()
    assert open_loop.dt == closed.dt == design.period_s
    # The pole of the offset is apart from the poles of the design.
    poles = np.sort_complex(np.log(closed.poles().astype(complex)) / design.period_s)
    for pole in design.poles:
        if np.isfinite(pole) and abs(pole) < 0.5 / design.period_s:
            assert np.min(np.abs(poles - pole)) < 1e-3 * abs(pole) + 1e-6
    assert np.max(np.abs(closed.poles())) == pytest.approx(design.data["spectral_radius"], rel=1e-9)
    # S = 1/(1 + L) = 1 + (u for w) at any frequency.
    for omega in [3.0, 30.0, 300.0]:
        z = np.exp(1j * omega * design.period_s)
        assert 1.0 / (1.0 + open_loop(z)) == pytest.approx(1.0 + closed(z), rel=1e-6)
    _, _, _, gain_at, phase_at, _ = control.stability_margins(open_loop)
    assert np.isfinite(phase_at) or np.isfinite(gain_at)
