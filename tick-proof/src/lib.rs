#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

use tick_record::Record;
use tick_record::drive::DriveFunctions;

pub mod certificate;
pub mod chain;
pub mod check;
pub mod drive;
pub mod faults;
pub mod instances;
pub mod monitor;
pub mod page;
pub mod run;
pub mod smt;
pub mod solver;
pub mod statement;

/// A law as its records.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one at a time")]
pub enum Functions {
    /// A law on a state that is measured.
    Chain(tick_record::Functions),
    /// A drive's law on a state that is measured, through the map of its model.
    Measured(tick_record::Functions),
    /// A drive on the counts of encoders.
    Drive(DriveFunctions),
    /// The monitors around any drive: where it brakes at an alarm, where an alarm stops it, and where they only tell.
    Monitors {
        /// Every alarm makes it brake, or stops it.
        braking: Record,
        /// Every alarm stops.
        stopping: Record,
        /// None does.
        telling: Record,
    },
}

/// Everything that is asked of an instance: the check of the translation, then what is claimed.
pub fn statements(functions: &Functions) -> Vec<statement::Statement> {
    [check::statement(functions)].into_iter().chain(claims(functions)).collect()
}

/// What is claimed of an instance.
pub fn claims(functions: &Functions) -> Vec<statement::Statement> {
    match functions {
        Functions::Chain(functions) => chain::statements(functions),
        Functions::Measured(functions) => chain::of_a_map(functions),
        Functions::Drive(functions) => drive::statements(functions),
        Functions::Monitors { braking, stopping, telling } => monitor::statements(braking, stopping, telling),
    }
}
