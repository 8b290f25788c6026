"""Checks exported FMUs with FMPy: python check.py HOST_SIM FOLDER, from the root of the repository.

Every FMU passes FMPy's validator. Fed with the angles or states of `host-sim run`, a controller returns u, sigma,
sigma* and health of that run without a differing bit, in Model Exchange and in Co-Simulation. With the FMU of the
plant it repeats the run within a tolerance.
"""

import csv
import ctypes
import math
import os
import re
import shutil
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.build import build_platform_binary
from fmpy.fmi2 import FMU2Model, FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.validation import validate_fmu

HOST_SIM, FOLDER = sys.argv[1], Path(sys.argv[2]).resolve()
HERE = Path(__file__).parent
MOTOR, JOINT, PAPER = "scenario/scenarios/motor.toml", "scenario/scenarios/joint.toml", "examples/c/paper.toml"
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
SMOOTH = ["friction.coulomb_n_m=0", "friction.static_n_m=0", "friction.cogging_n_m=0"]
SINE = ("sine", 0.1, 0.25, 1.0, 1.0)
# The first target of an FMU is at rest.
LATER = ["reference.start_s=0.1", "reference.duration_s=0.25"]
GEARED = ["encoder.reversed=true", "encoder.offset_counts=700", "encoder.states=10000", "encoder.counts_per_turn=10000",
          "drive.delay_ticks=2", "motor.gear=[7,2]", "reference.kind=move", "reference.start_s=0.1",
          "reference.duration_s=1"]
# Name, scenario, changes, lines behind the scenario, planned motion, lost angles from and to, s.
CASES = [
    ("motor", MOTOR, LATER, "", SINE, None),
    ("lost", MOTOR, LATER, '[[fault]]\nkind = "lost"\nat_s = 1.0\nfor_s = 0.02\n', SINE, (1.0, 1.02)),
    ("geared", MOTOR, [*GEARED, "reference.to_rad=3"], "", ("move", 0.1, 1.0, 3.0), None),
    ("turns", MOTOR, [*GEARED, "reference.to_rad=40"], "", ("move", 0.1, 1.0, 40.0), None),
    ("joint", JOINT, [], "", ("move", 0.1, 1.0, 1.0), None),
    ("coupled", JOINT, ["drive.tuning=coupled"], "", ("move", 0.1, 1.0, 1.0), None),
    ("paper", PAPER, [], "", None, None),
    ("speed", MOTOR, ["drive.mode=speed", "reference.kind=speed", "reference.speed_rad_s=20"], "", "speed", None),
    ("free", MOTOR, [*LATER, *SMOOTH], "", SINE, None),
]


def call(*words, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
    return done.stdout


def sets(changes):
    return [word for change in changes for word in ("--set", change)]


class Case:
    """Scenario with its FMUs, its run and its targets."""

    def __init__(self, name, scenario, changes, more, motion, lost):
        self.name, self.motion, self.lost = name, motion, lost
        self.file = FOLDER / f"{name}.toml"
        text = Path(scenario).read_text() + more
        if any(change.startswith("reference.kind") for change in changes):
            # Keys of the sine of the template.
            text = re.sub("^(amplitude_rad|frequency_hz).*$", "", text, flags=re.M)
        self.file.write_text(text)
        self.changes = sets(changes)
        self.fmu, self.plant = FOLDER / f"{name}.fmu", FOLDER / f"{name}_plant.fmu"
        said = self.export("--fmu", self.fmu)
        assert "binaries/linux64" in said, said
        call(HOST_SIM, "run", self.file, *self.changes, "--out", FOLDER / name)
        with open(FOLDER / name / "trace.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.trace = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
        self.ticks = len(rows)
        self.period = float(read_model_description(self.fmu).defaultExperiment.stepSize)

    def export(self, *words, **options):
        return call(HOST_SIM, "export", self.file, *self.changes, *words, **options)

    def targets(self):
        """Returns target and derivatives of every tick: the exported C file computes the plan of the run."""
        if self.motion == "speed":
            # A speed ramp has no plan in C.
            return None
        header, program = FOLDER / f"{self.name}.h", FOLDER / f"{self.name}_targets"
        self.export("--standalone", "-o", header)
        call("cc", *STRICT, f'-DDRIVE="{header}"', HERE / "targets.c", "-o", program, "-lm")
        kind, start, duration, *goal = self.motion
        start, duration = round(start / self.period), round(duration / self.period)
        if kind == "move":
            turn = math.floor(goal[0] / math.tau + 0.5)
            goal = ["m", turn, repr(goal[0] - turn * math.tau)]
        else:
            goal = ["s", *goal]
        return np.loadtxt(call(program, start, duration, self.ticks, *goal).splitlines())

    @cache
    def inputs(self):
        """Returns the names of the inputs and their values in every tick of the run."""
        if self.motion is None:
            names = [f"x[{i}]" for i in range(1, 5)]
            return names, np.column_stack([self.trace[f"x{i}"] for i in range(1, 5)])
        angles = [name for name in self.trace if name.endswith("angle_rad")]
        values = np.column_stack([self.trace[name] for name in angles])
        if self.lost:
            values[round(self.lost[0] / self.period) : round(self.lost[1] / self.period)] = math.nan
        targets = self.targets()
        names = ["target", "target_dot", "target_ddot", "target_dddot"][: targets.shape[1]]
        names = [name.removesuffix("_rad") for name in angles] + names
        return names, np.column_stack([values, targets[: self.ticks]])


def unzipped(path):
    """Returns the folder of an FMU. A library in use is not overwritten."""
    folder = FOLDER / "unzipped" / path.stem
    if not folder.exists():
        extract(str(path), unzipdir=str(folder))
    return str(folder)


def opened(path, kind):
    """Returns an initialised instance of an FMU and the references of its variables."""
    about = read_model_description(path)
    of = FMU2Slave if kind == "CS" else FMU2Model
    name = (about.coSimulation if kind == "CS" else about.modelExchange).modelIdentifier
    fmu = of(guid=about.guid, unzipDirectory=unzipped(path), modelIdentifier=name, instanceName=kind)
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    return fmu, {variable.name: variable.valueReference for variable in about.modelVariables}


def closed(fmu):
    fmu.terminate()
    fmu.freeInstance()


def tick(fmu, kind, k, period, inputs, values):
    """Computes tick k with these inputs."""
    if kind == "ME":
        if k > 0:
            fmu.setTime(k * period)
            fmu.enterEventMode()
        fmu.setReal(inputs, values)
        needed, _, _, _, is_defined, following = fmu.newDiscreteStates()
        assert not needed and is_defined and following == (k + 1) * period, (k, following)
        fmu.enterContinuousTimeMode()
    else:
        fmu.setReal(inputs, values)
        fmu.doStep(k * period, period)


def different(found, expected):
    """Returns the number of values with other bits."""
    return int((np.ascontiguousarray(found).view(np.uint64) != np.ascontiguousarray(expected).view(np.uint64)).sum())


def replays(case):
    """The FMU computes the outputs of the run, bit for bit, and again from a saved state."""
    names, values = case.inputs()
    expected = np.column_stack([case.trace[name] for name in ("u", "sigma", "sigma_star")])
    for kind in ("ME", "CS"):
        fmu, of = opened(case.fmu, kind)
        fmu.exitInitializationMode()
        inputs, outputs = [of[name] for name in names], [of[name] for name in ("u", "sigma", "sigma_star")]
        found, health = np.empty_like(expected), np.empty(case.ticks)
        saved = None
        for k in range(case.ticks):
            if k == case.ticks // 2:
                saved = fmu.serializeFMUstate(fmu.getFMUstate())
            tick(fmu, kind, k, case.period, inputs, list(values[k]))
            found[k], health[k] = fmu.getReal(outputs), fmu.getInteger([0])[0]
        off, flags = different(found, expected), int((health != case.trace["health"]).sum())
        fmu.setFMUstate(fmu.deSerializeFMUstate(saved))
        again = np.empty((100, 3))
        for k in range(case.ticks // 2, case.ticks // 2 + 100):
            tick(fmu, kind, k, case.period, inputs, list(values[k]))
            again[k - case.ticks // 2] = fmu.getReal(outputs)
        repeated = different(again, found[case.ticks // 2 :][:100])
        closed(fmu)
        print(f"{case.name:8} {kind}: {case.ticks} ticks, {off} of {found.size} values and {flags} flags differ; "
              f"{repeated} of {again.size} differ from a saved state")
        if case.name == "turns":
            # Beyond half a revolution the plan and the FMU split a target into other revolutions: rounding only.
            assert np.abs(found - expected).max() < 1e-3 and flags == repeated == 0
        else:
            assert off == flags == repeated == 0, case.name


def fourth_order(plant, time, period, parts=50):
    """Integrates a plant over a tick by the method of order 4."""
    h, order = period / parts, len(read_states(plant))
    rates = (ctypes.c_double * order)()

    def f(at, x):
        plant.setTime(at)
        plant.setContinuousStates((ctypes.c_double * order)(*x), order)
        plant.getDerivatives(rates, order)
        return np.array(rates)

    x = read_states(plant)
    for part in range(parts):
        at = time + part * h
        k1 = f(at, x)
        k2 = f(at + h / 2, x + h / 2 * k1)
        k3 = f(at + h / 2, x + h / 2 * k2)
        k4 = f(at + h, x + h * k3)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    f(time + period, x)


def read_states(plant):
    x = (ctypes.c_double * plant.order)()
    plant.getContinuousStates(x, plant.order)
    return np.array(x)


def loop(case, way, load):
    """Closes the loop of controller and plant, both FMUs. Returns the largest deviations of angle and u."""
    kind = "ME" if way == "ME" else "CS"
    controller, of = opened(case.fmu, kind)
    plant, at = opened(case.plant, kind)
    plant.order = sum(name.startswith("der(") for name in at)
    controller.exitInitializationMode()
    plant.exitInitializationMode()
    if kind == "ME":
        plant.newDiscreteStates()
        plant.enterContinuousTimeMode()
    names, values = case.inputs()
    angles = [name for name in names if name.endswith("angle")]
    inputs = [of[name] for name in names]
    measured = np.column_stack([case.trace[f"{name}_rad"] for name in angles])
    off, u = np.zeros(2), 0.0
    for k in range(case.ticks):
        seen = plant.getReal([at[name] for name in angles])
        off[0] = max(off[0], np.abs(np.array(seen) - measured[k]).max())
        if way != "Jacobi":
            tick(controller, kind, k, case.period, inputs, [*seen, *values[k][len(angles) :]])
            u = controller.getReal([of["u"]])[0]
            off[1] = max(off[1], abs(u - case.trace["u"][k]))
        plant.setReal([at["u"], at["load"]], [u, load(k * case.period)])
        if kind == "ME":
            fourth_order(plant, k * case.period, case.period)
        else:
            plant.doStep(k * case.period, case.period)
        if way == "Jacobi":
            tick(controller, kind, k, case.period, inputs, [*seen, *values[k][len(angles) :]])
            u = controller.getReal([of["u"]])[0]
            off[1] = max(off[1], abs(u - case.trace["u"][k]))
    closed(controller)
    closed(plant)
    print(f"{case.name:8} loop, {way}: largest deviation from the run {off[0]:.1e} rad, {off[1]:.1e} A")
    return off


def refuses(case):
    """The binary of one design refuses the GUID of another one."""
    said = []
    about = read_model_description(case.fmu)
    fmu = FMU2Slave(guid="another design", unzipDirectory=unzipped(case.fmu), instanceName="a",
                    modelIdentifier=about.coSimulation.modelIdentifier)
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(lambda *words: said.append(words))
    try:
        fmu.instantiate(callbacks=callbacks)
    except Exception:
        assert len(said) == 1, said
        print("another GUID is refused")
        return
    sys.exit("an FMU takes the GUID of another design")


def sources(case):
    """Strict compilers accept the sources, and no wrong call crashes them. Importers can build them."""
    for path in [case.fmu] + ([case.plant] if case.plant.exists() else []):
        folder = FOLDER / "sources" / path.stem
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        main = next((folder / "sources").glob("*.c"))
        for compiler in ("gcc", "clang"):
            if shutil.which(compiler):
                call(compiler, *STRICT, "-fsyntax-only", main)
        program = folder / "misuse"
        call("gcc", *STRICT, "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", f'-DFMU="{main}"',
             HERE / "misuse.c", "-o", program, "-lm")
        print(f"{path.stem:14}", call(program).strip())


def without_compiler(case):
    """Without `cc` the FMU has sources only, and an importer builds them."""
    path = FOLDER / "sources_only.fmu"
    said = case.export("--fmu", path, env={"PATH": ""})
    assert "C sources only: there is no C compiler `cc`" in said, said
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(case.fmu) as whole:
        assert not [name for name in archive.namelist() if name.startswith("binaries")]
        assert all(archive.read(name) == whole.read(name) for name in archive.namelist())
    again = FOLDER / "again.fmu"
    case.export("--fmu", again)
    assert again.read_bytes() == case.fmu.read_bytes(), "two exports differ"
    folder = FOLDER / "built"
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    if shutil.which("cmake"):
        build_platform_binary(folder, cmake_options={})
        shutil.make_archive(str(FOLDER / "built"), "zip", folder)
        os.replace(FOLDER / "built.zip", FOLDER / "built.fmu")
        case.fmu = FOLDER / "built.fmu"
        replays(case)
        print("built by FMPy from the sources: the same bits")


def main():
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    cases = {case[0]: Case(*case) for case in CASES}
    for name in ("motor", "free", "joint"):
        cases[name].export("--fmu-plant", cases[name].plant)
    for case in cases.values():
        for path in [case.fmu] + ([case.plant] if case.plant.exists() else []):
            problems = validate_fmu(str(path))
            assert not problems, (path, problems)
            print(f"{path.name:16} FMPy's validator finds no problem; {path.stat().st_size} bytes")
    for case in cases.values():
        if case.motion != "speed":
            replays(case)
    refuses(cases["motor"])
    for name, load in (("free", lambda t: 0.0), ("joint", lambda t: 0.5 if t >= 2.0 else 0.0)):
        for way in ("ME", "Gauss-Seidel"):
            angle, u = loop(cases[name], way, load)
            # Another integration and another sine: far below a count, so u has no difference.
            assert angle < 1e-12 and u == 0.0, (name, way)
        loop(cases[name], "Jacobi", load)
    for case in cases.values():
        sources(case)
    without_compiler(cases["joint"])
    print("FMU: all checks passed")


main()
