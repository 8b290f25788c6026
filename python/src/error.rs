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

/// Options of the command line with their keywords, if other than the option with underscores.
const KEYWORDS: [(&str, &str); 10] = [
    ("cogging", "cogging_per_turn"),
    ("load", "load_rad"),
    ("move", "move_rad"),
    ("noise", "noise_a"),
    ("noise-steps", "noise_counts"),
    ("phase", "phase_deg"),
    ("sensitivity", "sensitivity_peak"),
    ("settling", "settling_s"),
    ("tolerance", "tolerance_percent"),
    ("uncertain", "uncertain_percent"),
];

/// Phrases of the command line with their form in Python. The commissioning of a drive has no form here.
const PHRASES: [(&str, &str); 12] = [
    ("`host-sim commission --motor-alone`", "`host-sim commission`"),
    (" (commission --way)", ""),
    (" (commission --peak)", ""),
    (" (--way)", ""),
    (" (--peak)", ""),
    ("use --motor-alone", "give motor_alone=True"),
    ("--preset NAME", "preset=NAME"),
    ("--corners PERCENT", "corners=PERCENT"),
    ("--cogging N", "cogging_per_turn=N"),
    ("`host-sim monte-carlo ", "`monte_carlo` with `"),
    ("details: host-sim design", "details: design()"),
    ("`host-sim tune`", "`tune`"),
];

/// Returns the keyword of an option without its dashes.
fn keyword(option: &str) -> String {
    let known = KEYWORDS.iter().find(|(it, _)| *it == option);
    known.map_or_else(|| option.replace('-', "_"), |(_, keyword)| (*keyword).to_owned())
}

/// Returns a message in which the options of the command line are keywords.
pub(crate) fn for_python(text: &str) -> String {
    let text = PHRASES.iter().fold(text.to_owned(), |text, (phrase, ours)| text.replace(phrase, ours));
    let mut parts = text.split("--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(part.len());
        let (option, rest) = part.split_at(end);
        // A name of a file may have two dashes inside.
        let is_inside = out.ends_with(|c: char| c.is_alphanumeric() || "_-./".contains(c));
        match option {
            "set" if !is_inside => out.push_str("the setting"),
            // An option of `host-sim new`.
            "" | "plant" => out.extend(["--", option]),
            option if is_inside => out.extend(["--", option]),
            option => out.push_str(&keyword(option)),
        }
        out.push_str(rest);
    }
    out
}

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
        let message = for_python(message);
        if is_shown { format!("{place}: {message}") } else { message }
    };
    let lines: Vec<String> = error.parts().map(line).collect();
    let first = error.parts().next().map_or([""; 3], |it| [it.key, it.cause, it.remedy]);
    let [key, cause, remedy] = first.map(for_python);
    with_parts(lines.join("\n"), [&key, &cause, &remedy])
}

/// Returns the exception for a study.
pub(crate) fn of_study(error: &study::Error) -> PyErr {
    // The options of the command line are arguments here, and a key is an option with its value.
    let (key, place) = match error.key.strip_prefix("--").map(|option| option.split_once(' ').unwrap_or((option, ""))) {
        None => (error.key.clone(), error.key.clone()),
        Some((option, "")) => (keyword(option), keyword(option)),
        Some((option, value)) => (keyword(option), format!("{} = {value}", keyword(option))),
    };
    let [cause, remedy] = [&error.what, &error.remedy].map(|text| for_python(text));
    let text = study::Error::input(cause.as_str()).at(place).with_remedy(remedy.as_str()).to_string();
    if error.is_input { with_parts(text, [&key, &cause, &remedy]) } else { Refused::new_err(text) }
}

/// Returns the exception for an invalid argument.
pub(crate) fn of_argument(key: &str, cause: &str, remedy: &str) -> PyErr {
    let end = if remedy.is_empty() { String::new() } else { format!("; {remedy}") };
    with_parts(format!("{key}: {cause}{end}"), [key, cause, remedy])
}
