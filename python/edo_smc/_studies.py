"""Results of the studies that take seconds."""

from __future__ import annotations

import csv
import io
import json
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _edo_smc, _errors, _progress, _text

if TYPE_CHECKING:
    from ._scenario import Scenario


#: Value of a metric whose run failed. Searches need a number, a reader does not.
_FAILED = 100.0


def _metric(it: float | None) -> Any:
    return "failed" if it is not None and it >= _FAILED else it


class Comparison:
    """edo-smc and baseline controllers at each noise limit.

    `entries` has a dictionary for each controller and limit: `law`, `limit_a`, `cost`, `knobs`, and the metrics. A
    metric of 100 belongs to a run that failed; `to_pandas` has NaN there. `data["of_file"]` has the metrics of the
    scenario itself, without tuning.
    """

    def __init__(self, told: str) -> None:
        self.data: dict[str, Any] = json.loads(told)

    @property
    def entries(self) -> list[dict[str, Any]]:
        """Controllers at their noise limits."""
        return self.data["entries"]

    def to_pandas(self) -> Any:
        """Returns a `pandas.DataFrame` with a row for each controller and limit. A metric of a failed run is NaN."""
        import pandas

        def cell(key: str, it: Any) -> Any:
            return np.nan if key.endswith(("_rad", "_s")) and _metric(it) == "failed" else it

        return pandas.DataFrame(
            [{key: cell(key, it) for key, it in entry.items() if key != "knobs"} for entry in self.entries]
        )

    def __repr__(self) -> str:
        def rows(limit: float) -> list[_text.Row]:
            of_limit = sorted((it for it in self.entries if it["limit_a"] == limit), key=lambda it: it["cost"])
            return [(it["law"], *_under_load(it)) for it in of_limit]

        limits = sorted({entry["limit_a"] for entry in self.entries})
        blocks = [(f"current noise up to {limit:.3g} A rms", rows(limit)) for limit in limits]
        if of_file := self.data["of_file"]:
            row = ("edo-smc, not tuned", *_under_load(of_file))
            blocks.append((f"this scenario: {of_file['noise_a']:.3g} A rms", [row]))
        return _text.text("Comparison", blocks)


def _under_load(metrics: Mapping[str, Any]) -> tuple[Any, str]:
    load = _metric(metrics["load_rad"])
    return load, "under the load step" if load == "failed" else "rad under the load step"


def compare(core: Any, evaluations: int, seed: int, noise_a: float | Sequence[float], progress: bool) -> Comparison:
    evaluations, seed = _errors.whole("evaluations", evaluations, 1), _errors.whole("seed", seed, 0, _errors.MOST)
    try:
        given = np.atleast_1d(np.asarray(noise_a, dtype=float)).ravel().tolist()
    except (TypeError, ValueError):
        raise TypeError(f"noise_a = {noise_a!r}: expected a number or a list of numbers, A rms") from None
    laws, limits = _edo_smc.compared(core)
    total = laws * (len(given) or limits) * evaluations
    with _progress.bar(total, " evaluations", progress) as told:
        return Comparison(_edo_smc.compare(core, evaluations, seed, given, told))


class Tuned:
    """A drive tuned to a specification.

    `scenario` is the tuned scenario, `settings` its keys, `missed` the limits that are not met, and `data` everything
    as dictionaries. `m.with_settings(tuned.settings)` is the tuned drive too, if `m` has no `drive.tuning`.
    """

    def __init__(self, told: str, toml: str, scenario: Scenario) -> None:
        self.data: dict[str, Any] = json.loads(told)
        self.toml = toml
        self.scenario = scenario

    @property
    def missed(self) -> list[str]:
        """Limits that are not met; empty if the specification is met."""
        return self.data["missed"]

    @property
    def settings(self) -> dict[str, Any]:
        """Tuned keys for `with_settings`: `{"drive.surface_rad_s": 125.0, ..}`."""
        return {f"drive.{key}": _setting(key, values) for key, values in self.data["settings"]}

    def _measured(self) -> dict[str, tuple[Any, Any, str]]:
        """Returns value, limit and unit of each metric that a limit may have, by its name in `missed`."""
        worst, of, sets = self.data["found"]["worst"], self.data["asked"], self.data["gain_sets"]
        # An unstable gain set has no margins.
        phases = [(it["margins"] or {"phase_deg": 0.0})["phase_deg"] for it in sets]
        peaks = [it["worst"]["sensitivity_peak"] for it in sets if it["worst"] is not None]
        phase = min((it for it in phases if it is not None), default=None)
        peak = "UNSTABLE" if None in peaks else max(peaks, default=None)
        return {
            "noise": (self.data["found"]["noise_a"], of["noise_a"], "A rms"),
            "settling": (_metric(worst["settle_s"]), of.get("settle_s"), "s"),
            "move": (_metric(worst["move_rad"]), of.get("move_rad"), "rad"),
            "load": (_metric(worst["load_rad"]), of.get("load_rad"), "rad"),
            "phase margin": (phase, of.get("phase_deg"), "deg"),
            "peak |S|": (peak, of.get("sensitivity_peak"), ""),
            "stability": (f"{worst['unstable']} of {worst['corners']} corners unstable", None, ""),
            "sine": (_metric(worst["sine_rad"]), None, "rad"),
        }

    def _missed(self, name: str) -> str:
        value, limit, unit = self._measured().get(name, ("", None, ""))
        shown = _text.number(value) if value == "failed" else f"{_text.number(value)} {unit}".strip()
        return f"{name} {shown}" + (f" (limit {_text.number(limit)})" if limit is not None else "")

    def __repr__(self) -> str:
        worst = self.data["found"]["worst"]
        names = dict(noise="current noise", sine="error in a sine", move="error in a move", load="error under a load")
        rows: list[_text.Row] = []
        for name, (value, limit, unit) in self._measured().items():
            if name in ("noise", "settling", "move", "load", "sine"):
                beside = ", ".join([unit] * (value != "failed") + [f"limit {_text.number(limit)}"] * (limit is not None))
                rows.append((names.get(name, name), value, beside))
        rows.append(("unstable corners", worst["unstable"], f"of {worst['corners']}"))
        settings = [(key.partition(".")[2], str(it) if isinstance(it, list) else it, "") for key, it in self.settings.items()]
        verdict = f"NOT MET: {', '.join(self._missed(name) for name in self.missed)}" if self.missed else "met"
        title = f"Tuned {self.data['scenario']}: specification {verdict}"
        of = self.data["asked"]
        least, most = of.get("phase_deg"), of.get("sensitivity_peak")
        limited = [f"phase margin at least {_text.number(least)} deg"] * (least is not None)
        limited += [f"Ms at most {_text.number(most)}"] * (most is not None)
        heading = f"margins, {' and '.join(limited) or 'not limited by the specification'}"
        peaks: list[_text.Row] = []
        for it in self.data["gain_sets"]:
            of, worst = it["margins"] or {}, it["worst"] or {"sensitivity_peak": None, "name": ""}
            corner = worst["sensitivity_peak"]
            peaks.append((f"phase margin, {it['name']} gains", of.get("phase_deg"), "deg"))
            peaks.append((f"Ms, {it['name']} gains", of.get("sensitivity_peak", "UNSTABLE"), ""))
            peaks.append(("in the worst corner", "UNSTABLE" if corner is None else corner, worst["name"]))
        return _text.text(title, [("worst corner", rows), (heading, peaks), ("[drive]", settings)])


def _setting(key: str, values: Sequence[float]) -> Any:
    """Returns a tuned value as in a scenario."""
    if len(values) > 1:
        return list(values)
    return int(values[0]) if key == "gain_sets" else values[0]


def tune(core: Any, limits: Sequence[float | None], percent: int | None, effort: Any, progress: bool) -> Tuned:
    from ._scenario import Scenario

    if percent not in (None, 20, 50):
        raise _errors.invalid("uncertain_percent", f"found {percent}", "expected 20 or 50")
    evaluations, seed, cycles = effort
    whole = _errors.whole
    cycles = None if cycles is None else whole("cycles", cycles, 1)
    effort = (whole("evaluations", evaluations, 1), whole("seed", seed, 0, _errors.MOST), cycles)
    with _progress.bar(None, " evaluations", progress) as told:
        found, toml = _edo_smc.tune(core, list(limits), None if percent is None else percent == 50, effort, told)
    _, _, name, _, _ = core.parts()
    return Tuned(found, toml, Scenario._of(toml, f"{name}-tuned"))


class Map:
    """Stability and performance over two keys, or in all corners.

    `x` and `y` are the values of the axes; `values` has the shape (len(y), len(x)) and `good` too. A point without a
    design is NaN. A map over one key has no `y`, a map of corners neither.
    """

    def __init__(self, told: str) -> None:
        whole = json.loads(told)
        self.data: dict[str, Any] = whole["map"]
        axes = self.data["axes"]
        self._names = [axis["key"] for axis in axes]
        points = self.data["points"]
        figure = "figure" if any("figure" in point for point in points) else "decay_per_s"
        values = [np.nan if "refused" in it or it[figure] is None else it[figure] for it in points]
        shape = (-1, len(axes[0]["values"])) if axes else (-1,)
        #: Value of each point.
        self.values: np.ndarray = np.array(values, dtype=float).reshape(shape)
        #: True where a point is good.
        self.good: np.ndarray = np.array(whole["good"], dtype=bool).reshape(shape) if axes else np.array([], bool)
        #: Values of the axes as written in a scenario.
        self.axes: list[list[str]] = [axis["values"] for axis in axes]

    @property
    def x(self) -> np.ndarray | None:
        """Values of the first key, shape (K,): numbers, or words as written in a scenario."""
        return _axis(self.axes[0]) if self.axes else None

    @property
    def y(self) -> np.ndarray | None:
        """Values of the second key."""
        return _axis(self.axes[1]) if len(self.axes) > 1 else None

    @property
    def figure(self) -> str:
        """Name of the value."""
        return self.data["figure"]

    def plot(self, axes: Any = None) -> Any:
        """Draws the map with matplotlib; the line encloses the good points. Returns the figure."""
        import matplotlib.pyplot as plt

        if not self.axes:
            raise ValueError("a map of corners has no axes: see `data`")
        if axes is None:
            _, axes = plt.subplots(layout="constrained")
        values = np.atleast_2d(self.values)
        x = _numbers(self.axes[0])
        y = _numbers(self.axes[1]) if len(self.axes) > 1 else np.arange(values.shape[0])
        drawn = axes.pcolormesh(x, y, values, shading="nearest")
        good = np.atleast_2d(self.good)
        if min(good.shape) > 1 and good.any() and not good.all():
            axes.contour(x, y, good.astype(float), levels=[0.5], colors="white")
        axes.figure.colorbar(drawn, ax=axes, label=self.figure)
        axes.set_xlabel(self._names[0])
        axes.set_ylabel(self._names[1] if len(self._names) > 1 else "")
        return axes.figure

    def __repr__(self) -> str:
        if self.axes:
            return f"<Map of {self.figure} over {' and '.join(self._names)}: {int(self.good.sum())} of {self.good.size} good>"
        return f"<Map of {len(self.data['points'])} corners>"


def _axis(values: Sequence[str]) -> np.ndarray:
    try:
        return np.array([float(it) for it in values])
    except ValueError:
        return np.array(values)


def _numbers(values: Sequence[str]) -> np.ndarray:
    """Returns the values of an axis to draw: the indices of words."""
    axis = _axis(values)
    return axis if axis.dtype == float else np.arange(len(values))


def map(core: Any, words: Sequence[str | None], numbers: Sequence[float | None], simulate: bool, progress: bool) -> Map:
    with _progress.bar(None, " points", progress) as told:
        return Map(_edo_smc.map(core, list(words), list(numbers), simulate, told))


class MonteCarlo:
    """Random variations of a scenario.

    `trials["metrics.u_peak"]` is a column, shape (N,); `outcomes` has a word for each trial.
    """

    def __init__(self, names: list[str], outcomes: list[str], numbers: np.ndarray, facts: str) -> None:
        #: Names of the columns: drawn keys, `ended_at_s`, metrics.
        self.columns = names
        self.outcomes: np.ndarray = np.array(outcomes)
        #: All numbers, shape (columns, N).
        self.numbers = numbers
        known = json.loads(facts)
        #: Unit of each column that has one.
        self.units: dict[str, str] = known["units"]
        #: Numbers of the scenario without drawn values.
        self.of_file: dict[str, float] = known["of_file"]

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise KeyError(name)
        return self.numbers[self.columns.index(name)]

    def __len__(self) -> int:
        return len(self.outcomes)

    def to_pandas(self) -> Any:
        """Returns a `pandas.DataFrame` with a row for each trial."""
        import pandas

        return pandas.DataFrame({"outcome": self.outcomes, **{name: self[name] for name in self.columns}})

    def __repr__(self) -> str:
        words, counts = np.unique(self.outcomes, return_counts=True)
        outcomes = [(str(w), int(n), "trials") for w, n in zip(words, counts)]
        worst = []
        for name, own in self.of_file.items():
            values = self[name][np.isfinite(self[name])] if name in self.columns else np.array([])
            if values.size:
                spread = f"{self.units.get(name, '')} to {_text.number(values.max())}; scenario {_text.number(own)}"
                worst.append((name, values.min(), spread))
        return _text.text(f"{len(self)} trials", [("outcome", outcomes), ("smallest to largest", worst)])


def monte_carlo(core: Any, vary: list[str], percent: str | None, trials: int, seed: int, progress: bool) -> MonteCarlo:
    trials, seed = _errors.whole("trials", trials, 1), _errors.whole("seed", seed, 0, _errors.MOST)
    with _progress.bar(trials, " trials", progress) as told:
        return MonteCarlo(*_edo_smc.monte_carlo(core, vary, percent, trials, seed, told))


class Identified:
    """Parameters identified from a recording.

    `parameters` has a dictionary for each: `name`, `meaning`, `unit`, `value`, `interval`, `sheet`. `scenario` is the
    scenario with them.
    """

    scenario: Scenario

    def __init__(self, told: str, toml: str) -> None:
        self.data: dict[str, Any] = json.loads(told)
        self.toml = toml

    @property
    def parameters(self) -> list[dict[str, Any]]:
        """Identified parameters with their intervals."""
        return self.data["parameters"]

    def __getitem__(self, name: str) -> float:
        return next(it["value"] for it in self.parameters if it["name"] == name)

    def __repr__(self) -> str:
        rows = [
            (f"{it['name']}, {it['meaning']}", it["value"], f"± {_text.number(it['interval'])} {it['unit']}")
            for it in self.parameters
        ]
        return _text.text("Identified", [("parameters", rows)])


def identify(
    core: Any, record: Any, cogging: float | None, tolerance: float, noise: float, motor_alone: bool
) -> Identified:
    if isinstance(record, (str, os.PathLike)):
        path = pathlib.Path(record)
        text, file = path.read_text(encoding="utf-8"), str(path)
    else:
        text, file = _csv(record), "record"
    return Identified(*_edo_smc.identify(core, text, file, cogging, [tolerance, noise], motor_alone))


def _csv(record: Any) -> str:
    """Returns columns as CSV; each number is the shortest text that reads back to its bits."""
    if not isinstance(record, Mapping) and not hasattr(record, "columns"):
        raise TypeError(
            f"record: found {type(record).__name__}; expected a path of a CSV file, a pandas.DataFrame, or a dictionary "
            "of arrays: tick or t_s, count_motor, u_held_a, and for a joint count_link"
        )
    names = list(record.keys() if isinstance(record, Mapping) else record.columns)
    arrays = []
    for name in names:
        array = np.asarray(record[name])
        if array.ndim != 1:
            raise _errors.invalid(f"record[{name!r}]", f"found shape {array.shape}", "expected shape (K,)")
        try:
            arrays.append(array if array.dtype.kind in "biuf" else array.astype(float))
        except (TypeError, ValueError):
            raise _errors.invalid(f"record[{name!r}]", f"found {array.dtype}", "expected numbers") from None
    lengths = {name: len(array) for name, array in zip(names, arrays)}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise _errors.invalid("record", f"columns of different lengths: {found}", "expected one length")
    columns = [array.tolist() for array in arrays]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([int(it) if float(it).is_integer() else repr(it) for it in row] for row in zip(*columns))
    return out.getvalue()
