"""Result of a run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _health, _text

#: What a trace reads from a run.
_FACTS = ("ending", "states", "units", "figures", "error", "title", "warnings", "window_s", "period_s", "follows")
_ARRAYS = ("columns", "x", "d", "d_hat")


class _Kept:
    """A run as Python objects, for pickle and copies."""

    def __init__(self, run: Any) -> None:
        self._facts = {name: getattr(run, name)() for name in (*_FACTS, *_ARRAYS)}
        self._columns = {name: run.column(name) for name in run.columns()}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._facts:
            raise AttributeError(name)
        return lambda: self._facts[name]

    def column(self, name: str) -> np.ndarray:
        return self._columns[name]

    def __len__(self) -> int:
        return len(self._columns["t_s"])


class Trace:
    """Rows of a run as numpy arrays, time last.

    `trace["u"]` is a column, shape (K,). `trace.x`, `trace.d` and `trace.d_hat` have a row per state or channel, shape
    (n, K). The columns and their bits are those of `trace.csv` of `host-sim run`. A trace can be pickled and copied.
    """

    def __init__(self, run: Any) -> None:
        self._run = run
        self._kept: dict[str, np.ndarray] = {}
        #: Numbers of the run, as in run.json.
        self.figures: dict[str, Any] = json.loads(run.figures()) or {}
        #: `finished`, `diverged`, `broken off` or `interrupted`.
        self.ending: str = run.ending()[0]
        #: Time of an early end, s.
        self.ended_at_s: float | None = run.ending()[1]
        #: Reason of a run that broke off; `None` for every other run.
        self.failure: str | None = run.error()
        #: Window of the ultimate metrics, s.
        self.window_s: tuple[float, float] = tuple(run.window_s())
        #: Sampling period, s.
        self.period_s: float = run.period_s()

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return self._run.columns()

    def __getitem__(self, name: str) -> np.ndarray:
        if not isinstance(name, str):
            raise TypeError(f"trace[{name!r}]: expected the name of a column, one of {', '.join(self.columns)}")
        if name not in self._kept:
            if name not in self.columns:
                raise KeyError(_text.unknown(name, self.columns))
            self._kept[name] = self._run.column(name)
        return self._kept[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self._run)

    def keys(self) -> list[str]:
        """Returns the names of the columns."""
        return self.columns

    @property
    def t(self) -> np.ndarray:
        """Time of each tick, s, shape (K,)."""
        return self["t_s"]

    @property
    def u(self) -> np.ndarray:
        """Demanded u, shape (K,)."""
        return self["u"]

    @property
    def error(self) -> np.ndarray:
        """Tracking error, shape (K,): the column `error`, of a run with a reference. `failure` is another thing."""
        if "error" not in self.columns:
            raise AttributeError("a run without a reference has no column `error`; the reason of a broken run is `failure`")
        return self["error"]

    @property
    def first_alarm(self) -> tuple[float, list[str]] | None:
        """Time of the first alarm, s, and the names of its status flags; `None` without an alarm. Drives only.

        With `monitor.reaction = "brake"`, the default of `Motor` and `Joint`, the drive follows no target from then on.
        """
        if self._run.follows() is None:
            return None
        alarms = self["health"] & int(_health.ALARMS)
        at = np.flatnonzero(alarms)
        return (float(self.t[at[0]]), _health.names(int(alarms[at[0]]))) if at.size else None

    @property
    def warnings(self) -> list[str]:
        """Warnings of the design, and the first alarm of the run."""
        warnings = list(self._run.warnings())
        if (alarm := self.first_alarm) is not None:
            warnings.append(f"ALARM at t = {alarm[0]:g} s: {', '.join(alarm[1])}{self._reaction()}")
        return warnings

    def _reaction(self) -> str:
        seen = int(np.bitwise_or.reduce(self["health"]))
        if seen & _health.Health.STOPPED:
            return "; the monitors stopped the drive"
        return "; the monitors braked the drive" if seen & _health.Health.BRAKES else ""

    @property
    def x(self) -> np.ndarray:
        """True states, shape (n, K)."""
        return self._run.x()

    @property
    def d(self) -> np.ndarray:
        """True lumped disturbances, shape (n, K)."""
        return self._run.d()

    @property
    def d_hat(self) -> np.ndarray:
        """Estimates of the disturbances, shape (n, K); 0 in a channel without an observer."""
        return self._run.d_hat()

    @property
    def metrics(self) -> dict[str, Any]:
        """Metrics of the run, with its tracking errors if it has a reference."""
        return {**self.figures.get("metrics", {}), **(self.figures.get("tracking") or {})}

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column; empty if unknown, and for `health`, which has bits."""
        output, control = self._run.units()
        states = [unit for _, unit in self._run.states()]
        names = self.columns
        units = dict.fromkeys(names, "")
        units.update(t_s="s", u=control, u_held=control)
        units.update(zip(names[1:], states))
        # A disturbance is added to the derivative of its state.
        rates = [f"{unit}/s" if "/" not in unit else f"{unit}^2" for unit in states]
        for k, rate in enumerate(rates, 1):
            units.update({name: rate for name in (f"d{k}", f"d_hat{k}") if name in units})
        if output:
            # sigma is a derivative of the angle: two for each shaft with an observer, less one. The order of a chain is
            # the number of its states.
            shafts = sum(name.startswith("d_hat") for name in names)
            order = 2 * shafts - 1 if states else len(self.x) - 1
            units["sigma"] = units["sigma_star"] = f"{'rad' if states else output}/s" + (f"^{order}" if order > 1 else "")
        if "r" in units:
            follows = self._run.follows()
            units["r"] = units["error"] = states[follows] if follows < len(states) else output
        return units

    def to_pandas(self) -> Any:
        """Returns a `pandas.DataFrame` with the time as its index."""
        import pandas

        columns = {name: self[name] for name in self.columns[1:]}
        return pandas.DataFrame(columns, index=pandas.Index(self.t, name="t_s"))

    def to_xarray(self) -> Any:
        """Returns an `xarray.Dataset` with the dimension `t_s` and units as attributes."""
        import xarray

        units = self.units
        columns = {name: ("t_s", self[name], {"units": units[name]}) for name in self.columns[1:]}
        return xarray.Dataset(columns, {"t_s": ("t_s", self.t, {"units": "s"})}, {"title": self._run.title()})

    def plot(self, *columns: str, axes: Any = None) -> Any:
        """Draws columns over time, one panel each, with matplotlib. Returns the figure.

        The default is output and reference, error, u, and disturbances with their estimates.
        """
        import matplotlib.pyplot as plt

        panels = [[name] for name in columns] or self._panels()
        if axes is None:
            size = (8.0, 2.0 * len(panels) + 0.6)
            figure, axes = plt.subplots(len(panels), 1, sharex=True, figsize=size, squeeze=False, layout="constrained")
            axes = axes[:, 0]
            figure.suptitle(self._run.title())
        axes = np.atleast_1d(axes)
        units = self.units
        for panel, drawn in zip(axes, panels):
            for name in drawn:
                panel.plot(self.t, self[name], label=name, drawstyle="steps-post" if name in ("u", "u_held") else None)
            unit = next((units[name] for name in drawn if units[name]), "")
            panel.set_ylabel(unit)
            panel.legend(loc="upper right")
            panel.grid(alpha=0.3)
        axes[-1].set_xlabel("t (s)")
        return axes[0].figure

    def _panels(self) -> list[list[str]]:
        names = self.columns
        follows = self._run.follows()
        if follows is None:
            panels = [[name for name in names[1:] if name in ("x1", "x2", "x3", "x4", "x5", "x6")] or [names[1]]]
        else:
            panels = [[names[1 + follows], "r"], ["error"]]
        panels.append(["u_held"])
        observed = [name for name in names if name.startswith("d_hat")]
        return panels + [[name.replace("d_hat", "d"), name] for name in observed]

    def __reduce__(self) -> Any:
        return Trace, (_Kept(self._run),)

    def _title(self) -> str:
        when = f" at t = {self.ended_at_s:g} s" if self.ended_at_s is not None else ""
        alarm = self.first_alarm
        told = f", ALARM at t = {alarm[0]:g} s: {', '.join(alarm[1])}" if alarm is not None else ""
        return f"{self._run.title()}: {self.ending}{when}{told}, {len(self)} ticks of {self.period_s:g} s"

    def _sections(self) -> list[tuple[str, list[_text.Row]]]:
        output, control = self._run.units()
        named = {"u_peak": control, "y_ultimate": output, "error_ultimate": output, "error_rms": output}
        unit = {"settling_time_s": "s", "arrival_s": "s", "u_total_variation_per_s": f"{control}/s", **named}
        sections: list[tuple[str, list[_text.Row]]] = []
        rows = [(key, it, unit.get(key, "")) for key, it in self.metrics.items() if not isinstance(it, list)]
        sections.append(("metrics", rows))
        counts = self.figures.get("ticks_with", {})
        sections.append(("status flags", [(name.upper(), count, "ticks") for name, count in counts.items() if count]))
        reason = [] if self.failure is None else [self.failure]
        sections.append(("warnings", [(it, "", "") for it in [*reason, *self.warnings]]))
        return sections

    def __repr__(self) -> str:
        return _text.text(self._title(), self._sections())

    def _repr_html_(self) -> str:
        return _text.page(self._title(), self._sections())
