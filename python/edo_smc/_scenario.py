"""Scenarios: from dictionaries, text, files or a data sheet."""

from __future__ import annotations

import functools
import json
import math
import os
import pathlib
import re
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _edo_smc, _errors, _progress, _studies, _toml
from ._design import Design
from ._edo_smc import Controller, Refused, ScenarioError
from ._trace import Trace


class Scenario:
    """A plant with its controller, sensor, reference and load: all keys of a scenario file.

    `source` is a dictionary of its tables, a TOML text, or a path (`os.PathLike`, or a `str` that ends in `.toml`).
    `settings` are keys on top of it: `{"drive.period_s": 5e-4}`. The scenario is checked at once.

    Raises `ScenarioError` with `key`, `cause` and `remedy` of the first error.
    """

    def __init__(
        self,
        source: Mapping[str, Any] | str | os.PathLike[str],
        *,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        sets = _toml.settings(settings or {})
        if isinstance(source, Mapping):
            text = _edo_smc.rewritten("", list(_toml.changes(source)))
            name = str(source.get("name", "scenario"))
            self._core = _edo_smc.Core(text, f"{name}.toml", name, sets, False)
        elif isinstance(source, str) and not (source.endswith(".toml") and "\n" not in source):
            self._core = _edo_smc.Core(source, "scenario.toml", "scenario", sets, True)
        else:
            path = pathlib.Path(source)
            # Only the name of the file is exported: the same scenario gives the same bytes in every folder.
            self._core = _edo_smc.Core(path.read_text(encoding="utf-8"), path.name, path.stem, sets, True)

    @classmethod
    def template(cls, plant: str, name: str | None = None) -> Scenario:
        """Returns the template of a plant: `motor`, `joint`, `chain`, `own` or `paper`."""
        return cls._of(_edo_smc.template(name or plant, plant), name or plant)

    @classmethod
    def _of(cls, text: str, name: str, file: str | None = None, sets: Sequence[str] = (), places: bool = True) -> Scenario:
        it = Scenario.__new__(Scenario)
        it._core = _edo_smc.Core(text, file or f"{name}.toml", name, list(sets), places)
        return it

    def with_settings(self, settings: Mapping[str, Any]) -> Scenario:
        """Returns the scenario with these keys on top: `{"drive.period_s": 5e-4}`, or whole tables."""
        text, file, name, sets, places = self._core.parts()
        return Scenario._of(text, name, file, [*sets, *_toml.settings(settings)], places)

    @functools.cached_property
    def _facts(self) -> dict[str, Any]:
        return json.loads(self._core.facts())

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self._facts["name"]

    @property
    def title(self) -> str:
        """Title of the scenario."""
        return self._facts["title"]

    @property
    def kind(self) -> str:
        """`motor`, `joint` or `chain`."""
        return self._facts["kind"]

    @property
    def period_s(self) -> float:
        """Sampling period, s."""
        return self._facts["period_s"]

    @property
    def span_s(self) -> float:
        """Length of a run, s."""
        return self._facts["span_s"]

    @property
    def order(self) -> int:
        """Number of states of the plant."""
        return self._facts["order"]

    @functools.cached_property
    def _warnings(self) -> list[str]:
        try:
            return self.design().warnings
        except (Refused, ScenarioError):
            # A loop without margins has its other warnings.
            return self._core.warnings()

    @property
    def warnings(self) -> list[str]:
        """Warnings of the design, as `design().warnings`. `export_c` emits each as a `UserWarning`."""
        return list(self._warnings)

    @property
    def design_hash(self) -> str | None:
        """Fingerprint of the controller, as in its exported files."""
        return self._facts["design_hash"]

    @property
    def toml(self) -> str:
        """Text of the scenario, without its settings."""
        return self._core.parts()[0]

    @property
    def settings(self) -> list[str]:
        """Settings on top of the text, each `KEY=VALUE` as for `host-sim --set`."""
        return self._core.parts()[3]

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> pathlib.Path:
        """Writes the text with its settings as a scenario file for `host-sim` and returns its path.

        An existing file is an error unless `force` is set.
        """
        text, _, _, sets, _ = self._core.parts()
        changes = [(key, it) for key, it in (entry.split("=", 1) for entry in sets)]
        path = pathlib.Path(path)
        text = _edo_smc.rewritten(text, changes)
        with _errors.opened(path, force) as file:
            file.write(text)
        return path

    def design(self, *, margin: str | float | None = None, uncertain_percent: float | None = None) -> Design:
        """Returns the closed loop at rest: poles, margins of all gain sets, worst corners, noise.

        `margin` (drives) is `"fast"`, `"standard"`, or a peak sensitivity from 1.2 to 3. `uncertain_percent` is the
        tolerance of the data sheet.
        """
        wanted = {"drive.margin": margin, "drive.uncertain_percent": uncertain_percent}
        given = {key: it for key, it in wanted.items() if it is not None}
        return Design((self.with_settings(given) if given else self)._core.design())

    def controller(self) -> Controller:
        """Returns the controller alone, before its first tick.

        A drive has its monitors and its rest band, as `edo_smc_watched_tick` in C.
        """
        return self._core.controller()

    def simulate(
        self,
        *,
        reference: Mapping[str, Any] | None = None,
        load: Sequence[Mapping[str, Any]] | Mapping[str, Any] | None = None,
        friction: Mapping[str, Any] | None = None,
        error: Mapping[str, Any] | None = None,
        progress: bool = True,
        **tables: Any,
    ) -> Trace:
        """Runs the closed loop and returns its trace.

        Each argument replaces a table of the scenario: `reference=dict(kind="move", to_rad=1.0)`,
        `load=[dict(kind="step", amplitude=0.1, t0_s=1.0)]`, `friction=dict(coulomb_n_m=0.01)`,
        `error=dict(inertia_percent=50.0)`. Other tables and keys of the scenario are keywords too: `span_s=1.0`.
        """
        if isinstance(load, Mapping):
            load = [load]
        given = {"reference": reference, "load": load, "friction": friction, "error": error, **tables}
        given = {key: it for key, it in given.items() if it is not None}
        scenario = self.with_settings(given) if given else self
        ticks = round(scenario.span_s / scenario.period_s) + 1
        with _progress.bar(ticks, " ticks", progress) as told:
            return Trace(scenario._core.simulate(told))

    def reference(self) -> np.ndarray:
        """Returns r, r', .. at the begin of every tick of a run, shape (J, K + 1). Drives only."""
        return self._core.reference()

    def export_c(
        self,
        folder: str | os.PathLike[str],
        *,
        prefix: str = "edo_smc",
        force: bool = False,
        paper: bool = False,
        no_limits: bool = False,
    ) -> pathlib.Path:
        """Writes the controller as one C99 file and returns its path.

        The bytes are those of `host-sim export FILE --standalone`. The file is `NAME_drive.h`, for a chain `NAME.h`. An
        existing file is an error unless `force` is set. `prefix` begins every name of the file: a C identifier. Each of
        `warnings` is emitted as a `UserWarning`.
        """
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", prefix):
            remedy = "expected a C identifier: letters, digits and underscores, with no digit first"
            raise _errors.invalid("prefix", f"found {prefix!r}", remedy)
        text, _ = self._core.c_text(prefix, paper, no_limits)
        end = "" if self.kind == "chain" else "_drive"
        path = pathlib.Path(folder) / f"{self.name}{end}.h"
        path.parent.mkdir(parents=True, exist_ok=True)
        with _errors.opened(path, force, "\n") as file:
            file.write(text)
        for warning in self.warnings:
            warnings.warn(f"{path.name}: {warning}", stacklevel=2)
        return path

    def compare(
        self,
        *,
        evaluations: int = 150,
        seed: int = 1,
        noise_a: float | Sequence[float] = (),
        progress: bool = True,
    ) -> _studies.Comparison:
        """Compares edo-smc with baseline controllers, all tuned with the same search budget. Drives only.

        `noise_a` is a limit of the current noise or a list of them, A rms. The default is three limits by rule.
        """
        return _studies.compare(self._core, evaluations, seed, noise_a, progress)

    def tune(
        self,
        *,
        noise_a: float | None = None,
        settling_s: float | None = None,
        move_rad: float | None = None,
        load_rad: float | None = None,
        phase_deg: float | None = None,
        sensitivity_peak: float | None = None,
        cycles: int | None = None,
        uncertain_percent: int | None = None,
        evaluations: int = 150,
        seed: int = 1,
        progress: bool = True,
    ) -> _studies.Tuned:
        """Tunes a drive to a specification; metrics without a limit are minimised.

        `phase_deg` is the least phase margin with the data sheet, `sensitivity_peak` the largest |S| in the corners
        of the scenario. `uncertain_percent` is 20 or 50. The result has the tuned scenario and the margins of its
        gains. `evaluations` is the number of each search: there are six, for two numbers of gain sets and three noise
        limits.
        """
        limits = (noise_a, settling_s, move_rad, load_rad, phase_deg, sensitivity_peak)
        effort = (evaluations, seed, cycles)
        return _studies.tune(self._core, limits, uncertain_percent, effort, progress)

    def map(
        self,
        *,
        x: str | None = None,
        y: str | None = None,
        preset: str | None = None,
        corners: float | None = None,
        figure: str | None = None,
        at_most: float | None = None,
        at_least: float | None = None,
        simulate: bool = False,
        progress: bool = True,
    ) -> _studies.Map:
        """Computes stability and performance over two keys, `x="drive.period_s=1e-4..1e-2:log:40"`, or a preset.

        The presets are `gain`, `rate`, `delay`, `jitter`, `plant` and `corners`.
        """
        words = (x, y, preset, figure)
        return _studies.map(self._core, words, (corners, at_most, at_least), simulate, progress)

    def monte_carlo(
        self,
        *,
        vary: Sequence[str] | Mapping[str, str] = (),
        uncertain_percent: float | str | None = None,
        trials: int = 1000,
        seed: int = 1,
        progress: bool = True,
    ) -> _studies.MonteCarlo:
        """Simulates random variations: `vary={"error.inertia_percent": "uniform(-50,50)"}`, or all plant parameters.

        `uncertain_percent` is a number, or `"50:corners"`, `"50:sobol"`. Trial i depends on the seed and i only.
        """
        if isinstance(vary, str):
            vary = [vary]
        if isinstance(vary, Mapping):
            vary = [f"{key}={it}" for key, it in vary.items()]
        percent = None if uncertain_percent is None else str(uncertain_percent)
        return _studies.monte_carlo(self._core, list(vary), percent, trials, seed, progress)

    def identify(
        self,
        record: Any,
        *,
        cogging_per_turn: float | None = None,
        tolerance_percent: float = 60.0,
        noise_counts: float = 0.0,
        motor_alone: bool = False,
    ) -> _studies.Identified:
        """Identifies the parameters of a motor or joint from a recording.

        `record` is a path of a CSV file, a `pandas.DataFrame`, or a dictionary of arrays, shape (K,): `tick` or `t_s`,
        `count_motor`, `u_held_a`, and for a joint `count_link`. The motion needs excitation: moves to and fro with a
        multisine on the current, as docs/python.md describes.

        Raises `Refused` if the recording cannot support a design.
        """
        text, _, name, _, _ = self._core.parts()
        found = _studies.identify(self._core, record, cogging_per_turn, tolerance_percent, noise_counts, motor_alone)
        found.scenario = Scenario._of(found.toml, name)
        return found

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._facts['headline']}>"

    def __str__(self) -> str:
        return self._facts["headline"]

    def __reduce__(self) -> Any:
        text, file, name, sets, places = self._core.parts()
        return _restored, (text, name, file, sets, places)


def _restored(*parts: Any) -> Scenario:
    return Scenario._of(*parts)


@functools.cache
def _known(plant: str, sheet: str) -> tuple[frozenset[str], frozenset[str]]:
    """Returns the keys of a scenario outside of its tables with the names of its tables, and the keys of a table."""
    schema = json.loads(_edo_smc.schema(plant))
    table = schema["properties"][sheet]["$ref"].rsplit("/", 1)[1]
    return frozenset(schema["properties"]), frozenset(schema["$defs"][table]["properties"])


#: Names of other programs for the counts and for the lines of an encoder.
_COUNTS = ("counts", "cpr", "counts_per_rev", "counts_per_revolution", "resolution")
_LINES = ("lines", "ppr", "pulses", "pulses_per_turn", "pulses_per_rev", "pulses_per_revolution")


def _refuse_encoder(encoder: Any, path: str) -> None:
    """Refuses the keys of an encoder that other programs have, with their form here."""
    if not isinstance(encoder, Mapping):
        return
    for key, it in encoder.items():
        _refuse_encoder(it, f"{path}.{key}")
        number = it if isinstance(it, int) else None
        for names, factor, meaning in ((_COUNTS, 1, "counts"), (_LINES, 4, "four counts for each line")):
            if key in names:
                shown = f"counts_per_turn={factor * number}" if number else "counts_per_turn"
                remedy = f"did you mean `{shown}` ({meaning}), with `bits` or `states` of the counter?"
                raise _errors.invalid(f"{path}.{key}", f"unknown key `{path}.{key}`", remedy)


class _OfDataSheet(Scenario):
    """A scenario by its data sheet. No number of another plant is in it."""

    _plant: str
    _sheet: str
    _title: str
    #: Keywords without a default, and a call with them.
    _required: tuple[str, ...]
    _example: str
    #: Tables that stay unless they are given. A given table replaces `reference` and `controller`, and changes the
    #: given keys of the others.
    _start: dict[str, dict[str, Any]] = {
        "drive": {"period_s": 1e-3},
        # The duration follows by rule from the current limit, so any motor can do it.
        "reference": {"kind": "move", "to_rad": 1.0},
        "monitor": {"reaction": "brake"},
    }
    _span_s = 2.0

    def __init__(self, **keys: Any) -> None:
        top, known = _known(self._plant, self._sheet)
        sheet = {key: it for key, it in keys.items() if key not in top}
        tables = {key: it for key, it in keys.items() if key in top and it is not None}
        self._refuse(sheet, tables, known)
        whole: dict[str, Any] = {"name": self._plant, "title": self._title, "span_s": self._span_s}
        whole |= {self._sheet: {**self._own(), **sheet}, "encoder": None, **self._start}
        for key, it in tables.items():
            is_merged = key in ("drive", "monitor") and isinstance(it, Mapping)
            whole[key] = {**whole.get(key, {}), **it} if is_merged else it
        name = str(whole["name"])
        text = f"# {self._title}. All keys: `host-sim schema --plant {self._plant}`, docs/reference/keys.md.\n\n"
        text += _edo_smc.rewritten("", list(_toml.changes(whole)))
        self._core = _edo_smc.Core(text, f"{name}.toml", name, [], False)

    def _refuse(self, sheet: Mapping[str, Any], tables: Mapping[str, Any], known: frozenset[str]) -> None:
        """Refuses missing keywords by their names, and keys of other programs with their form here."""
        kind = type(self).__name__
        for key, it in sheet.items():
            if key not in known and re.fullmatch(r"current\w*_hz", key):
                is_number = isinstance(it, (int, float)) and it > 0
                of = f": {it:g} Hz are current_lag_s={1.0 / (2.0 * math.pi * it):.3g}" if is_number else ""
                remedy = f"give `current_lag_s`, the time constant 1/(2 pi f) of the current loop{of}"
                raise _errors.invalid(f"{self._sheet}.{key}", f"unknown key `{self._sheet}.{key}`", remedy)
        _refuse_encoder(tables.get("encoder"), "encoder")
        given = {**sheet, **tables}
        missing = [key for key in self._required if given.get(key) is None]
        # An unknown key may be a missing one with another name: the error of the scenario has both.
        if missing and known.issuperset(sheet):
            key = missing[0] if missing[0] == "encoder" else f"{self._sheet}.{missing[0]}"
            cause = f"missing keyword{'s' if len(missing) > 1 else ''} of {kind}: {', '.join(missing)}"
            raise _errors.invalid(key, cause, f"as in {self._example}")

    def _own(self) -> dict[str, Any]:
        return {}


def _given(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the keywords of a call that have a value, from its `locals()`."""
    named = {key: it for key, it in arguments.items() if it is not None and key not in ("self", "more", "__class__")}
    return {**named, **arguments["more"]}


#: A table of a scenario, and a number or its range.
_Table = Mapping[str, Any]
_Range = float | Sequence[float]


class Motor(_OfDataSheet):
    """A motor with one encoder, by its data sheet.

    Keywords are the keys of the table `motor`: `inertia_kg_m2`, `torque_n_m_per_a`, `max_current_a` (required),
    `damping_n_m_s`, `gear`, .. Other tables are dictionaries: `encoder=dict(bits=14)` (required), `drive=..`,
    `limits=..`.

    `max_current_a` is the limit that the controller may demand: the smaller of the peak current of the motor and the
    limit of the inverter, not the rated current. Of a three-phase motor, amperes are the peak of a phase current:
    `torque_n_m_per_a` and `max_current_a` refer to them, and a K_t per ampere rms is divided by the square root of 2.
    `resistance_ohm` of a three-phase motor is 1.5 times the resistance of a phase, or 0.75 times the resistance between
    two terminals. Of a motor with brushes it is the resistance between the terminals.

    A key that is not given has its default of docs/reference/keys.md: no damping, no friction, no load. Only three
    tables are set besides: `drive=dict(period_s=1e-3)`, `monitor=dict(reaction="brake")`, and a move of 1 rad as
    `reference`, whose duration follows from the current limit.
    """

    _plant = _sheet = "motor"
    _title = "Motor by its data sheet"
    _required = ("inertia_kg_m2", "torque_n_m_per_a", "max_current_a", "encoder")
    _example = "Motor(inertia_kg_m2=3e-4, torque_n_m_per_a=0.07, max_current_a=8.0, encoder=dict(bits=15))"

    def __init__(
        self,
        *,
        inertia_kg_m2: _Range | None = None,
        torque_n_m_per_a: float | None = None,
        max_current_a: float | None = None,
        encoder: _Table | None = None,
        damping_n_m_s: float | None = None,
        current_lag_s: float | None = None,
        gear: Sequence[int] | None = None,
        load_inertia_kg_m2: _Range | None = None,
        play_rad: float | None = None,
        gear_stiffness_n_m: float | None = None,
        supply_v: float | None = None,
        resistance_ohm: float | None = None,
        no_load_rad_s: float | None = None,
        start_rad: float | None = None,
        drive: _Table | None = None,
        limits: _Table | None = None,
        monitor: _Table | None = None,
        reference: _Table | None = None,
        load: Sequence[_Table] | None = None,
        friction: _Table | None = None,
        error: _Table | None = None,
        fault: Sequence[_Table] | None = None,
        name: str | None = None,
        title: str | None = None,
        span_s: float | None = None,
        window_s: Sequence[float] | None = None,
        settling_band: float | None = None,
        seed: int | None = None,
        **more: Any,
    ) -> None:
        super().__init__(**_given(locals()))


class Joint(_OfDataSheet):
    """A flexible joint with two encoders, by its data sheet.

    Keywords are the keys of the table `joint`: `link_inertia_kg_m2`, `motor_inertia_kg_m2`, `stiffness_n_m`,
    `torque_n_m_per_a`, `max_current_a` (required), `weight_n_m`, .. Other tables are dictionaries:
    `encoder=dict(link=dict(bits=20), motor=dict(bits=20))` (required), `drive=..`, `limits=..`.

    Motor values are at the motor shaft, link values and the stiffness behind the gear. `load` acts on the link.
    `friction` acts on the motor shaft, with its torques behind the gear; friction of the link is `link_damping_n_m_s`.
    `max_current_a`, `torque_n_m_per_a` and `resistance_ohm` are described for `Motor`.

    A key that is not given has its default of docs/reference/keys.md: no damping, weight, friction or load, and a
    sudden load of up to the largest motor torque. Only three tables are set besides: `drive=dict(period_s=1e-3)`,
    `monitor=dict(reaction="brake")`, and a move of 1 rad in 1 s as `reference`.
    """

    _plant = _sheet = "joint"
    # By rule, the duration of a joint follows from the current alone unless the supply is given: a warning of each joint.
    _start = {**_OfDataSheet._start, "reference": {**_OfDataSheet._start["reference"], "duration_s": 1.0}}
    _title = "Flexible joint by its data sheet"
    _required = (
        "link_inertia_kg_m2",
        "motor_inertia_kg_m2",
        "stiffness_n_m",
        "torque_n_m_per_a",
        "max_current_a",
        "encoder",
    )
    _example = (
        "Joint(link_inertia_kg_m2=0.2, motor_inertia_kg_m2=9e-4, stiffness_n_m=9.0, torque_n_m_per_a=0.12, "
        "max_current_a=30.0, encoder=dict(link=dict(bits=20), motor=dict(bits=20)))"
    )

    def __init__(
        self,
        *,
        link_inertia_kg_m2: float | None = None,
        motor_inertia_kg_m2: float | None = None,
        stiffness_n_m: float | None = None,
        torque_n_m_per_a: float | None = None,
        max_current_a: float | None = None,
        encoder: _Table | None = None,
        weight_n_m: float | None = None,
        link_damping_n_m_s: float | None = None,
        motor_damping_n_m_s: float | None = None,
        spring_damping_n_m_s: float | None = None,
        current_lag_s: float | None = None,
        gear: Sequence[int] | None = None,
        supply_v: float | None = None,
        resistance_ohm: float | None = None,
        no_load_rad_s: float | None = None,
        start_rad: float | None = None,
        drive: _Table | None = None,
        limits: _Table | None = None,
        monitor: _Table | None = None,
        reference: _Table | None = None,
        load: Sequence[_Table] | None = None,
        friction: _Table | None = None,
        error: _Table | None = None,
        fault: Sequence[_Table] | None = None,
        name: str | None = None,
        title: str | None = None,
        span_s: float | None = None,
        window_s: Sequence[float] | None = None,
        settling_band: float | None = None,
        seed: int | None = None,
        **more: Any,
    ) -> None:
        super().__init__(**_given(locals()))


class Chain(_OfDataSheet):
    """A plant as a chain of n integrators.

    Keywords are the keys of the table `plant`: `order`, `a`, `b` (required), `x0`, `disturbance`. The controller is a
    dictionary: `controller=dict(surface_bandwidth_rad_s=4.0, observer=[dict(channel=2, order=1, bandwidth_rad_s=40.0)])`.
    Without one, a chain of order 3 or more has the bandwidths of the template of `host-sim new --plant chain`, and
    neither a nominal model other than `a` and `b` nor limits of u.
    """

    _plant = "chain"
    _sheet = "plant"
    _title = "Chain of integrators"
    _required = ("order", "a", "b")
    _example = "Chain(order=2, a=[0.0, -1.0], b=2.0, controller=dict(surface_bandwidth_rad_s=4.0))"
    _start = {
        "controller": {
            "surface_bandwidth_rad_s": 4.0,
            "k_l": 20.0,
            "observer": [dict(channel=channel, order=2, bandwidth_rad_s=40.0) for channel in (2, 3)],
        },
    }
    _span_s = 10.0

    def _own(self) -> dict[str, Any]:
        return {"kind": "chain"}
