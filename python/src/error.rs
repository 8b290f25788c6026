//! Exceptions.

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use scenario::ErrorParts;

create_exception!(
    edo_smc,
    ScenarioError,
    PyValueError,
    "A scenario or an argument is invalid. `key`, `cause` and `remedy` are the parts of the first error; the text has \
     every error, one line each."
);
create_exception!(
    edo_smc,
    Refused,
    PyRuntimeError,
    "A computation has no result: a recording that cannot support a design, or a loop without margins."
);

/// Returns an exception with its parts as attributes.
fn with_parts(text: String, [key, cause, remedy]: [&str; 3]) -> PyErr {
    let error = ScenarioError::new_err(text);
    Python::attach(|py| {
        let value = error.value(py);
        for (name, part) in [("key", key), ("cause", cause), ("remedy", remedy)] {
            // An exception accepts any attribute.
            _ = value.setattr(name, part);
        }
    });
    error
}

/// Returns the exception for a scenario. Without places, for a scenario from keywords, a line has its message only.
pub(crate) fn of_scenario(error: &scenario::ScenarioError, has_places: bool) -> PyErr {
    let line = |ErrorParts { place, message, .. }: ErrorParts<'_>| {
        let is_shown = has_places && !place.starts_with("--set ");
        if is_shown { format!("{place}: {message}") } else { message.to_owned() }
    };
    let lines: Vec<String> = error.parts().map(line).collect();
    let first = error.parts().next().map_or([""; 3], |it| [it.key, it.cause, it.remedy]);
    with_parts(lines.join("\n"), first)
}

/// Returns the exception for a study.
pub(crate) fn of_study(error: &study::Error) -> PyErr {
    // The options of the command line are arguments here.
    let key = error.key.trim_start_matches("--");
    let text = error.to_string().replace(&error.key, key);
    if error.is_input { with_parts(text, [key, &error.what, &error.remedy]) } else { Refused::new_err(text) }
}

/// Returns the exception for an invalid argument.
pub(crate) fn of_argument(key: &str, cause: &str, remedy: &str) -> PyErr {
    let end = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
    with_parts(format!("{key}: {cause}{end}"), [key, cause, remedy])
}
