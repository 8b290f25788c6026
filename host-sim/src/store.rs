//! Files of Monte Carlo trials, in one of two formats with equal columns.
//!
//! | feature `parquet` | format | source |
//! |---|---|---|
//! | with | Parquet, readable by pyarrow, polars and DuckDB | `form` is `store/parquet.rs` |
//! | without | CSV with numbers at full precision | `form` is `store/csv.rs` |
//!
//! A file contains trials `first .. first + count` of a plan: column `trial`, column `outcome`, then a column of f64
//! for each name of the [`Header`]. A missing number is NaN. The file also contains the header as JSON, the range and a
//! SHA-256. Equal trials give identical bytes: time, machine and shard are not part of a file.
//!
//! A file is written completely or not at all. A damaged file, or one of another plan or version, is detected. One
//! chunk is in memory at a time.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use study::monte_carlo::Outcome;

#[cfg(feature = "parquet")]
#[path = "store/parquet.rs"]
mod form;
#[cfg(not(feature = "parquet"))]
#[path = "store/csv.rs"]
mod form;

pub use form::{EXTENSION, Trials, write};

/// Common header of all files of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Name and version of the program.
    pub program: String,
    /// Name of the scenario.
    pub scenario: String,
    /// SHA-256 of the text of its file.
    pub scenario_sha256: String,
    /// `KEY=VALUE` settings of all trials.
    pub sets: Vec<String>,
    /// `KEY=DISTRIBUTION` of the drawn keys.
    pub vary: Vec<String>,
    /// Master seed.
    pub seed: u64,
    /// Number of trials of the plan.
    pub trials: u64,
    /// Number of trials per chunk.
    pub chunk: u64,
    /// Names of the number columns: drawn keys, then metrics.
    pub columns: Vec<String>,
    /// Units of the columns that have one.
    #[serde(default)]
    pub units: BTreeMap<String, String>,
    /// Values with the parameters of the file, per column; as text, which no JSON reader rounds.
    pub of_file: BTreeMap<String, String>,
}

impl Header {
    /// Returns the first difference to another header as text. Inputs come before the values that follow from them.
    pub fn difference(&self, other: &Self) -> Option<String> {
        const ASKED: [&str; 8] = ["program", "scenario", "sets", "vary", "seed", "trials", "chunk", "scenario_sha256"];
        let [ours, theirs] = [self, other].map(|header| serde_json::to_value(header).unwrap_or_default());
        let rest = ours.as_object()?.keys().map(String::as_str).filter(|key| !ASKED.contains(key));
        let mut keys = ASKED.into_iter().chain(rest);
        keys.find_map(|key| differs(key, ours.get(key), theirs.get(key)))
    }

    /// Returns the name of a column with its unit.
    pub fn label(&self, name: &str) -> String {
        self.units.get(name).map_or_else(|| name.to_owned(), |unit| format!("{name} ({unit})"))
    }

    /// Returns the first trial of a chunk, and the one after its last.
    pub const fn range(&self, chunk: u64) -> [u64; 2] {
        let first = chunk * self.chunk;
        let end = first + self.chunk;
        [first, if end < self.trials { end } else { self.trials }]
    }
}

/// Returns the first difference of two values below `place`.
fn differs(place: &str, ours: Option<&Value>, theirs: Option<&Value>) -> Option<String> {
    if ours == theirs {
        return None;
    }
    match (ours, theirs) {
        (Some(Value::Array(a)), Some(Value::Array(b))) => {
            let mut entries = 0..a.len().max(b.len());
            entries.find_map(|i| differs(&format!("{place}[{}]", i + 1), a.get(i), b.get(i)))
        }
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            let mut keys = a.keys().chain(b.keys());
            keys.find_map(|key| differs(&format!("{place} of {key}"), a.get(key), b.get(key)))
        }
        _ => {
            let [ours, theirs] =
                [ours, theirs].map(|it| it.map_or_else(|| "none".into(), |it| shortened(&it.to_string())));
            Some(match place {
                "scenario_sha256" => "the text of its scenario file differs (scenario_sha256)".into(),
                _ => format!("its {place} is {theirs}, expected {ours}"),
            })
        }
    }
}

fn shortened(text: &str) -> String {
    const LONGEST: usize = 80;
    if text.chars().count() <= LONGEST { text.into() } else { text.chars().take(LONGEST).chain("..".chars()).collect() }
}

/// Consecutive trials.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chunk {
    /// Number of the first trial.
    pub first: u64,
    /// Outcome of each trial.
    pub outcomes: Vec<Outcome>,
    /// Numbers, column by column.
    pub numbers: Vec<Vec<f64>>,
}

/// Returns bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    let digits = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
    digits.filter_map(|digit| char::from_digit(digit.into(), 16)).collect()
}
