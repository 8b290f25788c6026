//! The controller on its target: it builds without features and with all. What its machine code costs and
//! must not contain, `budget` checks in the images.

use crate::compiler::{Compiler, TARGET};
use crate::step::{Gate, Outcome};

/// Its artifacts must not meet those of the first compiler.
const TARGET_DIR: &str = "target/thumb";

/// Builds the controller for the target with each feature set.
pub(crate) fn run(gate: &mut Gate, feature_sets: &[&str]) -> Outcome {
    let compiler = Compiler::required()?;
    let cargo = |verb| compiler.cargo(verb).with(&["--target-dir", TARGET_DIR]);
    let builds: Vec<_> = feature_sets
        .iter()
        .map(|features| {
            cargo("build").with(&["-p", "controller-core", "--no-default-features", "--features", features])
        })
        .collect();
    gate.commands(&format!("controller-core for {TARGET}, no feature and all features"), &builds)
}
