//! Builds of the controller for its target, without features and with all features. `budget` checks the cost and the
//! forbidden instructions in the images.

use crate::compiler::{Compiler, TARGET};
use crate::step::{Gate, Outcome};

/// Separate target folder, because the artifacts come from another compiler.
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
