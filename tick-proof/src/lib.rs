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

/// The operation traces of a control law.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one at a time")]
pub enum Functions {
    /// A control law on a measured state.
    Chain(tick_record::Functions),
    /// The control law of a drive on a measured state, through the map of its model.
    Measured(tick_record::Functions),
    /// A drive on encoder counts.
    Drive(DriveFunctions),
    /// The monitors around any drive, with three reactions to an alarm: brake, stop, report only.
    Monitors {
        /// Every alarm brakes or stops the drive.
        braking: Record,
        /// Every alarm stops the drive.
        stopping: Record,
        /// No configured alarm stops the drive.
        telling: Record,
    },
}

/// Returns all statements about an instance: the check of the translation, then the claims.
pub fn statements(functions: &Functions) -> Vec<statement::Statement> {
    [check::statement(functions)].into_iter().chain(claims(functions)).collect()
}

/// Returns the claims about an instance.
pub fn claims(functions: &Functions) -> Vec<statement::Statement> {
    match functions {
        Functions::Chain(functions) => chain::statements(functions),
        Functions::Measured(functions) => chain::of_a_map(functions),
        Functions::Drive(functions) => drive::statements(functions),
        Functions::Monitors { braking, stopping, telling } => monitor::statements(braking, stopping, telling),
    }
}
