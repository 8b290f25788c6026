//! The module `budget` without the feature `chip`: accepts any options and returns an error that names the feature.

use std::ffi::OsString;

use clap::Args;

use super::{Console, Failure, bad};

/// Options of the command, which are not evaluated.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct BudgetOptions {
    /// Options of `budget`; they need the feature chip.
    #[arg(value_name = "OPTIONS", trailing_var_arg = true, allow_hyphen_values = true)]
    options: Vec<OsString>,
}

impl Console<'_> {
    #[allow(clippy::unused_self, reason = "the signature of the module `budget`")]
    pub(super) fn budget(&mut self, _: &BudgetOptions) -> Result<u8, Failure> {
        Err(bad("this program was built without the feature chip"))
    }
}
