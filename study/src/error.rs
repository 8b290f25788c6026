//! Errors as data: the key, the cause and the remedy, to be put into the words of any program.

use std::fmt;

use scenario::ScenarioError;
use serde::Serialize;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Error {
    /// The key, file or argument that is wrong; empty if no single one is.
    pub key: String,
    /// The cause.
    pub what: String,
    /// The remedy; empty if there is none to suggest.
    pub remedy: String,
    /// True if other input mends it, false if the computation failed.
    pub is_input: bool,
}

impl Error {
    /// Returns an error of the input.
    pub fn input(what: impl Into<String>) -> Self {
        Self { key: String::new(), what: what.into(), remedy: String::new(), is_input: true }
    }

    /// Returns an error of the computation.
    pub fn failed(what: impl Into<String>) -> Self {
        Self { is_input: false, ..Self::input(what) }
    }

    /// Names the key.
    #[must_use]
    pub fn at(self, key: impl Into<String>) -> Self {
        Self { key: key.into(), ..self }
    }

    /// Adds the remedy.
    #[must_use]
    pub fn with_remedy(self, remedy: impl Into<String>) -> Self {
        Self { remedy: remedy.into(), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, what, remedy, .. } = self;
        if !key.is_empty() {
            write!(f, "{key}: ")?;
        }
        f.write_str(what)?;
        if !remedy.is_empty() {
            write!(f, "; {remedy}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

impl From<ScenarioError> for Error {
    fn from(error: ScenarioError) -> Self {
        Self::input(error.to_string())
    }
}

impl From<&ScenarioError> for Error {
    fn from(error: &ScenarioError) -> Self {
        Self::input(error.to_string())
    }
}

impl From<String> for Error {
    fn from(what: String) -> Self {
        Self::input(what)
    }
}
