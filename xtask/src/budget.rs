//! Cycle budgets of the images, checked by `cycle-bound`.

use crate::step::{Gate, Outcome};
use crate::{capi, firmware};

/// File with the limits of the images.
pub(crate) const CEILINGS: &str = "firmware/budgets.toml";

/// Builds the images and checks their limits.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    firmware::run(gate)?;
    capi::run(gate, capi::Cores::Emulated)?;
    judge(gate)
}

/// Checks the limits of every shipped instance of the tick and of the control interrupts.
pub(crate) fn judge(gate: &mut Gate) -> Outcome {
    gate.step("limits of every instance of the tick and of the interrupts", |gate| {
        gate.built()?.program("cycle-bound")?.with(&["--ceilings", CEILINGS]).run(gate)
    })
}
