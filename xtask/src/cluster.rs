//! `cluster`: a Monte Carlo run in shards on Dask, with two workers of which one is killed in the middle of a shard,
//! leaves the bytes of an undisturbed run; and pyarrow reads out of them what was told
//! ([docs/monte-carlo.md](../../docs/monte-carlo.md)).

use std::fs;
use std::io::ErrorKind;

use crate::python::Environment;
use crate::step::{Failure, Gate, Invocation, Outcome};

/// BSD-3-Clause: wheels of PyPI.
const DASK: Environment =
    Environment { folder: "target/cluster", packages: &["distributed==2026.8.0"], rerun: "cargo xtask cluster" };
/// Apache-2.0: a wheel of PyPI, 55 MB.
const PYARROW: Environment =
    Environment { folder: "target/pyarrow", packages: &["pyarrow==26.0.1"], rerun: "cargo xtask cluster" };
/// Where the runs are kept while they are compared.
const RUNS: &str = "target/cluster-runs";
const TEST: &str = "examples/cluster/test_dask_shards.py";
const READ: &str = "host-sim/tests/parquet.py";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("Dask for shards", |gate| DASK.ready(gate))?;
    gate.step("shards on two workers, one of them killed", |gate| {
        match fs::remove_dir_all(gate.root.join(RUNS)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                let rerun = String::from("cargo xtask cluster");
                return Err(Failure { reason: format!("{RUNS}: {error}"), rerun });
            }
            _ => {}
        }
        Invocation::new(&DASK.program("python"), &[TEST, &program(gate)?, RUNS]).run(gate)
    })?;
    gate.step("pyarrow, to read trials", |gate| PYARROW.ready(gate))?;
    gate.step("trials as pyarrow reads them", |gate| {
        let folder = format!("{RUNS}/read");
        Invocation::new(&PYARROW.program("python"), &[READ, &program(gate)?, &folder]).run(gate)
    })
}

/// The path of `host-sim` as it was built.
fn program(gate: &Gate) -> Result<String, Failure> {
    Ok(gate.built()?.path("host-sim")?.display().to_string())
}
