"""The package itself: first steps, import time, types."""

import pathlib
import re
import subprocess
import sys
import time

import numpy as np
import pytest

import edo_smc

ROOT = pathlib.Path(__file__).parents[2]


def test_the_lines_of_the_readme_run_as_they_stand(tmp_path):
    code = re.search(r"```python\n(.*?)```", (ROOT / "python/README.md").read_text(), re.S)[1]
    assert len([line for line in code.splitlines() if line]) <= 10
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env={"MPLBACKEND": "Agg"}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "phase margin" in done.stdout
    assert (tmp_path / "move.png").stat().st_size > 10_000
    assert (tmp_path / "firmware/motor_drive.h").read_text().count("edo_smc_tick") > 1


def test_importing_takes_less_than_a_fifth_of_a_second_beyond_numpy():
    code = "import numpy, time; t = time.process_time(); import edo_smc; print(time.process_time() - t)"
    took = min(float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(3))
    assert took < 0.2


def test_matplotlib_pandas_and_tqdm_are_imported_late():
    code = "import sys, edo_smc; print([m for m in ('matplotlib', 'pandas', 'xarray', 'tqdm') if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_ticks_by_array_and_one_by_one_are_fast():
    """Bars with room for a busy machine; the guide has the measured figures."""
    scenario = edo_smc.Scenario.template("paper")
    controller, x = scenario.controller(), np.zeros((4, 500_000))

    def rate(ticks, work):
        best = []
        for _ in range(3):
            started = time.process_time()
            work()
            best.append(time.process_time() - started)
        return ticks / min(best)

    sample = np.zeros(4)

    def one_by_one():
        for _ in range(50_000):
            controller.tick(sample)

    assert rate(x.shape[1], lambda: controller.ticks(x)) > 3e6
    assert rate(50_000, one_by_one) > 0.4e6


def test_every_public_name_has_a_docstring_and_a_stub():
    stub = (pathlib.Path(edo_smc.__file__).parent / "_edo_smc.pyi").read_text()
    for name in edo_smc.__all__:
        it = getattr(edo_smc, name)
        assert name.startswith("__") or it.__doc__, name
    for name in [it for it in dir(edo_smc.Controller) if not it.startswith("_")]:
        assert f"def {name}(" in stub and getattr(edo_smc.Controller, name).__doc__, name
    assert (pathlib.Path(edo_smc.__file__).parent / "py.typed").exists()


def test_types_hold_for_mypy(tmp_path):
    pytest.importorskip("mypy")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--ignore-missing-imports", "--cache-dir", "/dev/null", "-p", "edo_smc"],
        capture_output=True, text=True, cwd=tmp_path,
    )
    assert done.returncode == 0, done.stdout
