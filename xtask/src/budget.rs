//! What the images cost, held to its ceilings by `cycle-bound`.

use crate::step::{Gate, Outcome};
use crate::{capi, firmware};

/// Ceilings of what the images cost.
pub(crate) const CEILINGS: &str = "firmware/budgets.toml";

/// Builds the images, then holds what they cost to its ceilings.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    firmware::run(gate)?;
    capi::run(gate, capi::Cores::Emulated)?;
    judge(gate)
}

/// Every shipped instance of the tick, and the interrupt of `drive`, against their ceilings.
pub(crate) fn judge(gate: &mut Gate) -> Outcome {
    gate.step("ceilings of every instance of the tick and of the interrupt", |gate| {
        gate.built()?.program("cycle-bound")?.with(&["--ceilings", CEILINGS]).run(gate)
    })
}
