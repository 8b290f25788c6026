"""Result of a run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _text


class Trace:
    """Rows of a run as numpy arrays, time last.

    `trace["u"]` is a column, shape (K,). `trace.x`, `trace.d` and `trace.d_hat` have a row per state or channel, shape
    (n, K). The columns and their bits are those of `trace.csv` of `host-sim run`.
    """

    def __init__(self, run: Any) -> None:
        self._run = run
        self._kept: dict[str, np.ndarray] = {}
        #: Numbers of the run, as in run.json.
        self.figures: dict[str, Any] = json.loads(run.figures()) or {}
        #: Warnings of the design.
        self.warnings: list[str] = run.warnings()
        #: `finished`, `diverged`, `broken off` or `interrupted`.
        self.ending: str = run.ending()[0]
        #: Time of an early end, s.
        self.ended_at_s: float | None = run.ending()[1]
        #: Reason of a run that broke off.
        self.error: str | None = run.error()
        #: Window of the ultimate metrics, s.
        self.window_s: tuple[float, float] = tuple(run.window_s())
        #: Sampling period, s.
        self.period_s: float = run.period_s()

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return self._run.columns()

    def __getitem__(self, name: str) -> np.ndarray:
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
        """Unit of each column; empty if unknown."""
        output, control = self._run.units()
        states = [unit for _, unit in self._run.states()]
        names = self.columns
        units = dict.fromkeys(names, "")
        units.update(t_s="s", u=control, u_held=control)
        units.update(zip(names[1:], states))
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

    def __repr__(self) -> str:
        output, control = self._run.units()
        when = f" at t = {self.ended_at_s:g} s" if self.ended_at_s is not None else ""
        title = f"{self._run.title()}: {self.ending}{when}, {len(self)} ticks of {self.period_s:g} s"
        named = {"u_peak": control, "y_ultimate": output, "error_ultimate": output, "error_rms": output}
        unit = {"settling_time_s": "s", "arrival_s": "s", "u_total_variation_per_s": f"{control}/s", **named}
        rows = [(key, it, unit.get(key, "")) for key, it in self.metrics.items() if not isinstance(it, list)]
        warnings = [(it, "", "") for it in self.warnings]
        return _text.text(title, [("metrics", rows), ("warnings", warnings)])
