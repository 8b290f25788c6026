"""Result of a design."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from . import _text

#: |z| below which a pole decays within a tick: the logarithm of its rounding noise is no rate.
_DEADBEAT = 1e-5

_MARGINS = [
    ("phase_deg", "phase margin", "deg"),
    ("delay_s", "delay margin", "s"),
    ("gain_up", "gain margin, up", "times"),
    ("gain_down", "gain margin, down", "times"),
    ("crossover_rad_s", "crossover", "rad/s"),
    ("sensitivity_peak", "sensitivity peak Ms", ""),
    ("peak_rad_s", "frequency of the peak", "rad/s"),
]


class Design:
    """Closed loop of a scenario at rest: poles, margins, noise, limits.

    `data` is everything as dictionaries, as `host-sim design --json` prints it.
    """

    def __init__(self, told: str) -> None:
        whole = json.loads(told)
        self.data: dict[str, Any] = whole["design"]
        self._facts = whole["facts"]
        self._matrices = whole["matrices"]
        self._unit = whole["control_unit"]
        self._gains = whole["gains"]
        self._chosen = whole["chosen"]
        self._warnings = whole["warnings"]
        if self._is_weak("high"):
            self._warnings.append(
                "the high gains are unstable in a corner if they stay on; the drive limits their time (docs/joints.md)"
            )

    def _is_weak(self, name: str) -> bool:
        worst = self.gain_sets.get(name, {}).get("worst")
        return worst is not None and worst["sensitivity_peak"] is None

    @property
    def period_s(self) -> float:
        """Sampling period, s."""
        return self.data["period_s"]

    @property
    def gains(self) -> dict[str, Any]:
        """Gains by the keys of the scenario; for a drive each is a list."""
        return self._gains

    @property
    def chosen(self) -> list[str]:
        """Bandwidths and their limiting factor, one line each; empty for a chain."""
        return self._chosen

    @property
    def warnings(self) -> list[str]:
        """Warnings of the design: an unstable loop or corner, missing limits of u, a reference beyond the current."""
        return self._warnings

    @property
    def poles(self) -> np.ndarray:
        """Poles of the closed loop ln(z)/T, slowest first, rad/s, shape (n,).

        Complex poles come in pairs. A negative real z has no partner: its imaginary part is pi/T. A pole with
        |z| < 1e-5, as of a delay, is left out: it decays within a tick, and its logarithm is rounding noise. So is the
        decay alpha of the start-up offset, which `to_control` has. `data["poles"]` has all numbers.
        """
        poles = _roots(self.data["poles"])
        return poles[poles.real * self.period_s > np.log(_DEADBEAT)]

    @property
    def poles_asked(self) -> dict[str, np.ndarray]:
        """Poles of the design by their part, rad/s."""
        return {part["name"]: _roots(part["poles"]) for part in self.data["asked"]}

    @property
    def is_stable(self) -> bool:
        """True if the loop is stable with the base gains, with the nominal plant and in all corners."""
        return self.data["margins"] is not None and not self.data.get("unstable_corners")

    @property
    def margins(self) -> dict[str, float | None] | None:
        """Margins with the base gains, which act at rest. `None` for an unstable loop, a value `None` for no limit."""
        return self.data["margins"]

    @property
    def gain_sets(self) -> dict[str, dict[str, Any]]:
        """Gain sets of a drive: `margins`, and the `worst` corner with its sensitivity peak."""
        return {it["name"]: {"margins": it["margins"], "worst": it["worst"]} for it in self.data.get("gain_sets", [])}

    @property
    def worst_corners(self) -> dict[str, dict[str, Any]]:
        """Worst corner of each gain set: `name` and `sensitivity_peak`."""
        return {name: it["worst"] for name, it in self.gain_sets.items() if it["worst"] is not None}

    @property
    def unstable_corners(self) -> list[dict[str, Any]]:
        """Unstable corners, worst first."""
        return self.data.get("unstable_corners", [])

    @property
    def noise(self) -> list[dict[str, Any]]:
        """Noise of u from each sensor."""
        return self.data["noise"]

    @property
    def noise_rms(self) -> float | None:
        """Noise of u from all sensors, rms, in the unit of u; `None` for an unstable loop."""
        rms = float(np.sqrt(sum(it["u_rms"] ** 2 for it in self.noise)))
        return rms if self.margins is not None else None

    @property
    def limits(self) -> list[dict[str, Any]]:
        """Used share of each limit of the design, largest first."""
        return self.data["limits"]

    @property
    def suggested(self) -> dict[str, Any] | None:
        """Suggested design with its closed loop."""
        return self.data["suggested"]

    def to_control(self) -> tuple[Any, Any]:
        """Returns the open and the closed loop as `control.StateSpace` with the sampling period.

        The open loop is L, broken at the input of the plant. The closed loop goes from w, which is added to u at the
        input of the plant, to u: S - 1 = -L/(1 + L). Both have the base gains.

        The open loop of a joint has poles close to |z| = 1, at which `control.stability_margins(L)` finds false
        margins. Give it the frequency response: `control.stability_margins(control.frd(L, w))`.
        """
        import control

        def system(it: dict[str, Any], names: tuple[str, str, str]) -> Any:
            a, b, c = np.array(it["a"]), np.array(it["b"])[:, None], np.array(it["c"])[None, :]
            return control.ss(a, b, c, 0.0, self.period_s, name=names[0], inputs=[names[1]], outputs=[names[2]])

        open_loop, closed = self._matrices
        return system(open_loop, ("open loop", "v", "minus u")), system(closed, ("closed loop", "w", "u"))

    def _sections(self) -> list[tuple[str, list[_text.Row]]]:
        def margins(of: dict[str, Any] | None) -> list[_text.Row]:
            return [(label, of[key], unit) for key, label, unit in _MARGINS] if of else [("stable", False, "")]

        sections: list[tuple[str, list[_text.Row]]] = []
        if self.gain_sets:
            for name, found in self.gain_sets.items():
                rows = margins(found["margins"])
                worst = found["worst"]
                if worst is not None:
                    peak = worst["sensitivity_peak"]
                    rows.append(("Ms in the worst corner", "UNSTABLE" if peak is None else peak, worst["name"]))
                sections.append((f"margins, {name} gains", rows))
        else:
            sections.append(("margins", margins(self.margins)))
        slow = self.poles[:3]
        sections.append(("slowest poles", [(f"pole {k + 1}", f"{pole:.4g}", "rad/s") for k, pole in enumerate(slow)]))
        unit = f"{self._unit} rms".strip()
        sections.append(("noise of u", [(it["sensor"], it["u_rms"], unit) for it in self.noise]))
        gains = [(key, it[0] if len(it) == 1 else str(it), "") for key, it in _gains(self.gains)]
        sections.append(("gains", gains))
        used = [(it["what"], f"{100 * it['used']:.0f} %", it["meaning"]) for it in self.limits]
        sections.append(("used of each limit", used))
        sections.append(("warnings", [(it, "", "") for it in self.warnings]))
        return sections

    def __repr__(self) -> str:
        return _text.text(f"Design of {self._facts['name']}, T = {self.period_s:g} s", self._sections())

    def _repr_html_(self) -> str:
        return _text.page(f"Design of {self._facts['name']}, T = {self.period_s:g} s", self._sections())


def _roots(roots: list[dict[str, float]]) -> np.ndarray:
    return np.array([complex(it["re"], it["im"]) for it in roots], dtype=complex)


def _gains(gains: dict[str, Any] | None) -> list[tuple[str, list[Any]]]:
    return [(key, it if isinstance(it, list) else [it]) for key, it in (gains or {}).items()]
