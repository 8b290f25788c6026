//! Errors as data: key, cause and remedy, for any program to format.

use std::fmt;

use scenario::ScenarioError;
use serde::Serialize;

/// Error with key, cause and remedy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Error {
    /// Invalid key, file or argument; empty if there is no single one.
    pub key: String,
    /// The cause.
    pub what: String,
    /// Remedy; empty if there is none.
    pub remedy: String,
    /// True for invalid input, false for a failed computation.
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
