#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

use host_sim::export::Functions;

pub mod certificate;
pub mod chain;
pub mod check;
pub mod drive;
pub mod faults;
pub mod instances;
pub mod run;
pub mod sha256;
pub mod smt;
pub mod solver;
pub mod statement;

/// Everything that is asked of an instance: the check of the translation, then what is claimed.
pub fn statements(functions: &Functions) -> Vec<statement::Statement> {
    let claims = match functions {
        Functions::Chain(functions) => chain::statements(functions),
        Functions::Drive(functions) => drive::statements(functions),
    };
    [check::statement(functions)].into_iter().chain(claims).collect()
}
