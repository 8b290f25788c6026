//! Command `cluster`: a Monte Carlo run in shards on two Dask workers, one of which is killed in the middle of a shard,
//! produces the bytes of an undisturbed run. pyarrow reads the expected trials from the files
//! ([docs/evidence/monte-carlo-speed.md](../../docs/evidence/monte-carlo-speed.md)).

use std::fs;
use std::io::ErrorKind;

use crate::python::Environment;
use crate::step::{Failure, Gate, Invocation, Outcome};

/// Dask, BSD-3-Clause: wheels of PyPI.
const DASK: Environment =
    Environment { folder: "target/cluster", packages: &["distributed==2026.8.0"], rerun: "cargo xtask cluster" };
/// pyarrow, Apache-2.0: a wheel of PyPI, 55 MB.
const PYARROW: Environment =
    Environment { folder: "target/pyarrow", packages: &["pyarrow==26.0.1"], rerun: "cargo xtask cluster" };
/// Folder of the runs during their comparison.
const RUNS: &str = "target/cluster-runs";
const TEST: &str = "examples/cluster/test_dask_shards.py";
const READ: &str = "host-sim/tests/parquet.py";

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("Dask, for shards", |gate| DASK.ready(gate))?;
    gate.step("shards on two workers, one killed", |gate| {
        match fs::remove_dir_all(gate.root.join(RUNS)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                let rerun = String::from("cargo xtask cluster");
                return Err(Failure { reason: format!("{RUNS}: {error}"), rerun });
            }
            _ => {}
        }
        Invocation::new(&DASK.program("python"), &[TEST, &program(gate)?, RUNS]).run(gate)
    })?;
    gate.step("pyarrow, for reading trials", |gate| PYARROW.ready(gate))?;
    gate.step("trials read by pyarrow", |gate| {
        let folder = format!("{RUNS}/read");
        Invocation::new(&PYARROW.program("python"), &[READ, &program(gate)?, &folder]).run(gate)
    })
}

/// Returns the path of the built `host-sim`.
fn program(gate: &Gate) -> Result<String, Failure> {
    Ok(gate.built()?.path("host-sim")?.display().to_string())
}
