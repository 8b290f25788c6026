//! Trials in files, of one of two forms with the same names of columns.
//!
//! | feature `parquet` | form | file |
//! |---|---|---|
//! | with | Parquet, which pyarrow, polars and DuckDB read | `form` is `store/parquet.rs` |
//! | without | CSV with numbers at full precision | `form` is `store/csv.rs` |
//!
//! A file holds trials `first .. first + count` of a plan: column `trial`, column `outcome`, then a column of f64 for
//! each name of the [`Header`]; what is no number is NaN. The header stands in the file as JSON, with the range and a
//! SHA-256. The same trials are the same bytes, whoever computed them: nothing in a file tells of its time, machine or
//! shard.
//!
//! A file is written whole or not at all. One that was damaged since, or is of another plan or version, is told from
//! what was asked for. A chunk is in memory at a time.

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

/// What all files of a plan have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Name and version of the program.
    pub program: String,
    /// Name of the scenario.
    pub scenario: String,
    /// SHA-256 of the text of its file.
    pub scenario_sha256: String,
    /// `KEY=VALUE` for all trials.
    pub sets: Vec<String>,
    /// What differs from trial to trial.
    pub vary: Vec<String>,
    /// Master seed.
    pub seed: u64,
    /// Trials of the plan.
    pub trials: u64,
    /// Trials of a chunk.
    pub chunk: u64,
    /// Names of the columns of numbers: what was drawn, then what came out.
    pub columns: Vec<String>,
    /// Units of the columns that have one.
    #[serde(default)]
    pub units: BTreeMap<String, String>,
    /// What the scenario comes to with nothing drawn, per column that has it; as text, which a reader cannot round.
    pub of_file: BTreeMap<String, String>,
}

impl Header {
    /// The first thing in which another differs, in words: what was asked for before what follows from it.
    pub fn difference(&self, other: &Self) -> Option<String> {
        const ASKED: [&str; 8] = ["program", "scenario", "sets", "vary", "seed", "trials", "chunk", "scenario_sha256"];
        let [ours, theirs] = [self, other].map(|header| serde_json::to_value(header).unwrap_or_default());
        let rest = ours.as_object()?.keys().map(String::as_str).filter(|key| !ASKED.contains(key));
        let mut keys = ASKED.into_iter().chain(rest);
        keys.find_map(|key| differs(key, ours.get(key), theirs.get(key)))
    }

    /// The name of a column and its unit.
    pub fn label(&self, name: &str) -> String {
        self.units.get(name).map_or_else(|| name.to_owned(), |unit| format!("{name} ({unit})"))
    }

    /// Trials of a chunk.
    pub const fn range(&self, chunk: u64) -> [u64; 2] {
        let first = chunk * self.chunk;
        let end = first + self.chunk;
        [first, if end < self.trials { end } else { self.trials }]
    }
}

/// The first place below this one where two values differ.
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
                "scenario_sha256" => "the text of its scenario file is another (scenario_sha256)".into(),
                _ => format!("its {place} is {theirs}, expected {ours}"),
            })
        }
    }
}

fn shortened(text: &str) -> String {
    const LONGEST: usize = 80;
    if text.chars().count() <= LONGEST { text.into() } else { text.chars().take(LONGEST).chain("..".chars()).collect() }
}

/// Some trials one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chunk {
    /// Number of the first.
    pub first: u64,
    /// Of each.
    pub outcomes: Vec<Outcome>,
    /// Column by column.
    pub numbers: Vec<Vec<f64>>,
}

/// Bytes as digits.
pub fn hex(bytes: &[u8]) -> String {
    let digits = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
    digits.filter_map(|digit| char::from_digit(digit.into(), 16)).collect()
}
