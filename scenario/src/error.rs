//! Errors of a scenario, one line each: `FILE:LINE:COLUMN: message` or `--set ARGUMENT: message`.

use std::fmt;

/// Place of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Origin {
    /// Byte offset in the file.
    Text { offset: usize },
    /// Index of the `--set` argument, from 0.
    Set(usize),
}

/// Texts of a scenario.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Name of the file in messages.
    pub file: &'a str,
    /// Content of the file.
    pub text: &'a str,
    /// `KEY=VALUE` arguments, applied in order.
    pub sets: &'a [String],
}

impl Source<'_> {
    pub(super) fn error(&self, origin: Origin, message: impl Into<String>) -> ScenarioError {
        let place = match origin {
            Origin::Text { offset } => {
                let (line, column) = line_and_column(self.text, offset);
                format!("{}:{line}:{column}", self.file)
            }
            Origin::Set(k) => format!("--set {}", self.sets.get(k).map_or("", String::as_str)),
        };
        ScenarioError::of_file(&place, message)
    }

    /// Returns all errors, in the order of the file and then of the arguments.
    pub(super) fn errors(&self, mut faults: Vec<(Origin, String)>) -> ScenarioError {
        faults.sort();
        faults.dedup();
        let lines = faults.into_iter().flat_map(|(origin, message)| self.error(origin, message).lines);
        ScenarioError { lines: lines.collect() }
    }
}

/// Escapes control characters, so that a message is one line.
fn one_line(text: &str) -> String {
    let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.into() };
    text.chars().map(escaped).collect()
}

/// Returns line and column, both from 1. The column counts characters.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// Error of a scenario that cannot run. Its text has one line per error.
///
/// A TOML syntax error is reported alone. Otherwise all unknown keys, invalid values and broken rules are reported in
/// one pass. A file without these errors is designed, and the design reports one error at a time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioError {
    lines: Vec<Line>,
}

/// One error: its place and its message.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Line {
    place: String,
    message: String,
}

/// One error in parts, for a program to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorParts<'a> {
    /// `FILE`, `FILE:LINE:COLUMN` or `--set ARGUMENT`.
    pub place: &'a str,
    /// Message without its place.
    pub message: &'a str,
    /// Invalid key; empty if there is no single one.
    pub key: &'a str,
    /// The cause.
    pub cause: &'a str,
    /// Remedy; empty if the message has none.
    pub remedy: &'a str,
}

/// Beginnings of a remedy within a message.
const REMEDIES: [&str; 11] = [
    "; ",
    ", expected ",
    ": expected ",
    ": take ",
    ": set ",
    ": give ",
    ": leave ",
    ": lower ",
    ": raise ",
    ": if ",
    ": start ",
];

impl Line {
    fn parts(&self) -> ErrorParts<'_> {
        let Self { place, message } = self;
        let named = message.strip_prefix("unknown key `").or_else(|| message.strip_prefix('`'));
        let (key, rest) = named.and_then(|named| named.split_once('`')).unwrap_or(("", message));
        // An unknown key is the cause itself.
        let rest = if message.starts_with('`') { rest.strip_prefix(": ").unwrap_or(rest) } else { message };
        let found = REMEDIES.iter().filter_map(|begin| rest.find(begin)).min();
        // Every beginning has a mark and a blank.
        let (cause, remedy) = found.map_or((rest, ""), |at| (&rest[..at], &rest[at + 2..]));
        ErrorParts { place, message, key, cause, remedy }
    }
}

impl ScenarioError {
    /// Returns an error of the file as a whole.
    pub(super) fn of_file(file: &str, message: impl Into<String>) -> Self {
        Self { lines: vec![Line { place: one_line(file), message: one_line(&message.into()) }] }
    }

    /// Returns every error in parts.
    pub fn parts(&self) -> impl Iterator<Item = ErrorParts<'_>> {
        self.lines.iter().map(Line::parts)
    }

    /// Appends the lines of another error.
    pub(super) fn and(mut self, other: Option<Self>) -> Self {
        self.lines.extend(other.into_iter().flat_map(|other| other.lines));
        self
    }
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines: Vec<String> =
            self.lines.iter().map(|Line { place, message }| format!("{place}: {message}")).collect();
        f.write_str(&lines.join("\n"))
    }
}

impl std::error::Error for ScenarioError {}

/// Returns a number in the notation of a scenario: 1e300 instead of 300 digits, nan instead of NaN.
pub(super) fn shown(value: f64) -> String {
    match value.abs() {
        size if size == 0.0 || (1e-4..1e15).contains(&size) => value.to_string(),
        _ => format!("{value:?}").replace("NaN", "nan"),
    }
}

/// Returns `; did you mean `NAME`?` for the nearest of `names`, or the whole list if none is near.
pub(crate) fn nearest<'a>(found: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    // No name has a capital letter.
    let found = &found.to_lowercase();
    let distance = |name: &str| {
        // The unit at the end of a name is the part most often left out.
        if name.starts_with(&format!("{found}_")) { 0 } else { strsim::damerau_levenshtein(found, name) }
    };
    // `kl` is as far from `k` as from `k_l`: of two equally near names, the one with the same letters wins.
    let other_letters = |name: &str| name.replace('_', "") != found.replace('_', "");
    match names.clone().map(|name| (distance(name), other_letters(name), name)).min() {
        Some((far, _, name)) if far <= 1 + found.chars().count().min(30) / 4 => format!("; did you mean `{name}`?"),
        _ => format!("; expected one of {}", names.collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_and_column_count_characters_from_one() {
        assert_eq!(line_and_column("a\nbσ = 1", 0), (1, 1));
        assert_eq!(line_and_column("a\nbσ = 1", "a\nbσ".len()), (2, 3));
        // Beyond the end and inside a character there is still a place, never a panic.
        assert_eq!(line_and_column("a\n", 99), (2, 1));
        assert_eq!(line_and_column("σ", 1), (1, 2));
    }

    #[test]
    fn an_error_comes_apart_into_key_cause_and_remedy() {
        let parts = |message: &str| {
            let error = ScenarioError::of_file("a.toml:1:2", message);
            let ErrorParts { place, key, cause, remedy, .. } = error.parts().next().expect("an error");
            assert_eq!(place, "a.toml:1:2");
            [key, cause, remedy].map(str::to_owned)
        };
        for (message, expected) in [
            (
                "`motor.inertia_kg_m2`: found -1, expected a number above 0",
                ["motor.inertia_kg_m2", "found -1", "expected a number above 0"],
            ),
            ("unknown key `k_ll`; did you mean `k_l`?", ["k_ll", "unknown key `k_ll`", "did you mean `k_l`?"]),
            ("`drive.x`: no speed: leave it out, or not", ["drive.x", "no speed", "leave it out, or not"]),
            ("not TOML", ["", "not TOML", ""]),
        ] {
            assert_eq!(parts(message), expected);
        }
    }

    #[test]
    fn a_number_is_shown_as_toml_writes_it() {
        let shown = [0.0, -7.0, 1e-3, 1e-9, -1e300, f64::NAN, f64::NEG_INFINITY].map(shown);
        assert_eq!(shown, ["0", "-7", "0.001", "1e-9", "-1e300", "nan", "-inf"]);
    }

    #[test]
    fn the_nearest_name_is_offered_only_if_it_is_near() {
        let names = ["period_s", "k_l", "k_s", "omega_rad_s"];
        assert_eq!(nearest("perio_s", names.into_iter()), "; did you mean `period_s`?");
        assert_eq!(nearest("omega", names.into_iter()), "; did you mean `omega_rad_s`?");
        assert_eq!(nearest("J11", ["b11", "j11", "j12"].into_iter()), "; did you mean `j11`?");
        assert_eq!(nearest("xy1", ["b11", "j11"].into_iter()), "; expected one of b11, j11");
        assert_eq!(nearest("kl", ["k", "k_l"].into_iter()), "; did you mean `k_l`?");
        assert_eq!(nearest("banana", names.into_iter()), "; expected one of period_s, k_l, k_s, omega_rad_s");
    }
}
