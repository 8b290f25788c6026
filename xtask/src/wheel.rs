//! Python package: the wheel is built, installed in an environment of its own, and tested against `host-sim`.

use crate::python::Environment;
use crate::step::{Gate, Invocation, Outcome};

const MANIFEST: &str = "python/Cargo.toml";
/// Separate target folder, because the module has features and profiles of its own.
const TARGET_DIR: &str = "target/python";
const WHEELS: &str = "target/python/wheels";
const RERUN: &str = "cargo xtask test --deep python";
/// Code that writes C files, in every configuration: small in a wheel, which is downloaded. It compiles five times as
/// long as in `python/Cargo.toml`.
const SMALL: [&str; 4] = [
    "--config",
    "profile.release.package.tick-record.opt-level='s'",
    "--config",
    "profile.release.package.edo-smc-forms.opt-level='s'",
];
/// maturin builds the wheel. Tests and notebooks need the other packages, all wheels of PyPI.
const ENVIRONMENT: Environment = Environment {
    folder: "target/python-env",
    packages: &[
        "maturin==1.16.0",
        "numpy==2.4.6",
        "pytest==9.2.0",
        "mypy==2.4.1",
        "matplotlib==3.11.2",
        "pandas==3.1.1",
        "xarray==2026.9.0",
        "control==0.10.2",
        "tqdm==4.70.1",
        "nbclient==0.11.0",
        "nbformat==5.11.1",
        "ipykernel==7.4.0",
        // The simulator of a notebook.
        "mujoco==4.0.0",
    ],
    rerun: RERUN,
};

/// Builds the wheel.
pub(crate) fn build(gate: &mut Gate) -> Outcome {
    gate.step("environment of the Python package", |gate| ENVIRONMENT.ready(gate))?;
    gate.empty_folder(WHEELS, RERUN)?;
    let build = Invocation::new(&ENVIRONMENT.program("maturin"), &["build", "--release", "--manifest-path", MANIFEST])
        .with(&["--target-dir", TARGET_DIR, "--out", WHEELS])
        .with(&SMALL);
    gate.commands("wheel of the Python package", &[build])
}

/// Builds and installs the wheel, and runs its tests.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    let cargo = |arguments: &[&str]| Invocation::cargo(arguments).env("CARGO_TARGET_DIR", TARGET_DIR);
    let format = cargo(&["fmt", "--manifest-path", MANIFEST, "--check"]);
    let clippy = cargo(&["clippy", "--release", "--manifest-path", MANIFEST, "--", "-D", "warnings"]);
    gate.commands("format and lints, Python package", &[format, clippy])?;
    build(gate)?;
    let python = ENVIRONMENT.program("python");
    // From the folder of the wheels only, so that no other package of this name is installed.
    let install = Invocation::new(&python, &["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"])
        .with(&["--no-index", "--find-links", WHEELS, "edo-smc"]);
    gate.commands("installation of the wheel", &[install])?;
    let program = gate.built()?.path("host-sim")?.display().to_string();
    let tests = Invocation::new(&python, &["-m", "pytest", "-q", "-p", "no:cacheprovider", "--import-mode=importlib"])
        .with(&["--rootdir", "python", "-c", "python/pyproject.toml", "python/tests"])
        .env("EDO_SMC_HOST_SIM", &program);
    gate.commands("tests of the Python package", &[tests])
}
