//! `cluster`: a Monte Carlo run in shards on Dask, with two workers of which one is killed in the middle of a shard,
//! leaves the bytes of an undisturbed run ([docs/monte-carlo.md](../../docs/monte-carlo.md)).

use std::fs;
use std::io::ErrorKind;

use crate::step::{Failure, Gate, Invocation, Outcome};

/// An environment of Python that nothing else uses.
const ENVIRONMENT: &str = "target/cluster";
const PYTHON: &str = "target/cluster/bin/python";
/// BSD-3-Clause: wheels of PyPI.
const DASK: &str = "distributed==2026.8.0";
/// Where the runs are kept while they are compared.
const RUNS: &str = "target/cluster-runs";
const PROGRAM: &str = "target/debug/host-sim";
const TEST: &str = "examples/cluster/test_dask_shards.py";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("Dask for shards", dask)?;
    gate.commands("host-sim, for shards", &[Invocation::cargo(&["build", "--quiet", "-p", "host-sim"])])?;
    gate.step("shards on two workers, one of them killed", |gate| {
        match fs::remove_dir_all(gate.root.join(RUNS)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                let rerun = String::from("cargo xtask cluster");
                return Err(Failure { reason: format!("{RUNS}: {error}"), rerun });
            }
            _ => {}
        }
        Invocation::new(PYTHON, &[TEST, PROGRAM, RUNS]).run(gate)
    })
}

/// Is it there? If not it is installed.
fn dask(gate: &Gate) -> Outcome {
    let present = Invocation::new(PYTHON, &["-c", "import distributed; print('Dask', distributed.__version__)"]);
    if let Some(version) = present.answer_in(gate) {
        println!("{version}");
        return Ok(());
    }
    let install = [
        Invocation::new("python3", &["-m", "venv", ENVIRONMENT]),
        Invocation::new(PYTHON, &["-m", "pip", "install", "--quiet", DASK]),
        present,
    ];
    install.iter().try_for_each(|command| command.run(gate)).map_err(|failure| Failure {
        reason: format!(
            "{}\n{DASK} is missing; it needs Python 3.10 or later with its module venv (on Debian: apt-get install \
             python3-venv) and a way to its package",
            failure.reason
        ),
        ..failure
    })
}
