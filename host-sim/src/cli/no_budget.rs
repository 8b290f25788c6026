//! The module `budget` without the feature `chip`: any options, and the reason.

use std::ffi::OsString;

use clap::Args;

use super::{Console, Failure, bad};

/// Options that are not read.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct BudgetOptions {
    /// The options of this command need the feature chip.
    #[arg(value_name = "OPTIONS", trailing_var_arg = true, allow_hyphen_values = true)]
    options: Vec<OsString>,
}

impl Console<'_> {
    #[allow(clippy::unused_self, reason = "the signature of the module `budget`")]
    pub(super) fn budget(&mut self, _: &BudgetOptions) -> Result<u8, Failure> {
        Err(bad("this program was built without the feature chip"))
    }
}
