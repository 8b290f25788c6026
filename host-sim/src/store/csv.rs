//! Trials as CSV: a line of names, a line per trial, and lines that begin with `#`.
//!
//! The lines with `#` contain the header as JSON, the range, and the SHA-256 of all bytes before it. A reader skips
//! them, as `pandas.read_csv(.., comment="#")`. A number is the shortest text that reads back to identical bits.

use std::fmt::Write as _;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use whole_file::Existing;

use study::monte_carlo::Outcome;

use super::{Chunk, Header, hex};

/// File extension.
pub const EXTENSION: &str = "csv";

const HEADER: &str = "# host-sim monte-carlo: ";
const RANGE: &str = "# first, end: ";
const SHA256: &str = "# sha256: ";

/// Writes a file of the trials `first..end`, completely or not at all. An existing file stays.
///
/// # Errors
/// If the file cannot be written, or if a chunk has an error.
pub fn write(
    path: &Path,
    header: &Header,
    [first, end]: [u64; 2],
    chunks: impl IntoIterator<Item = io::Result<Chunk>>,
) -> io::Result<()> {
    whole_file::write(path, Existing::Keep, |out| {
        let mut hash = Sha256::new();
        let mut put = |text: &str| {
            hash.update(text);
            out.write_all(text.as_bytes())
        };
        let names = ["trial", "outcome"].into_iter().chain(header.columns.iter().map(String::as_str));
        put(&(names.map(field).collect::<Vec<_>>().join(",") + "\n"))?;
        let mut next = first;
        for chunk in chunks {
            let chunk = chunk?;
            if chunk.first != next {
                return Err(io::Error::other(format!("trial {} after trial {next}", chunk.first)));
            }
            let mut text = String::new();
            for (k, outcome) in chunk.outcomes.iter().enumerate() {
                // Writing to a String cannot fail.
                let _ = write!(text, "{next},{}", outcome.word());
                for column in &chunk.numbers {
                    let _ = write!(text, ",{:?}", column[k]);
                }
                text.push('\n');
                next += 1;
            }
            put(&text)?;
        }
        if next != end {
            return Err(io::Error::other(format!("trials {next} to {end} are missing")));
        }
        put(&format!("{HEADER}{}\n{RANGE}{first}, {end}\n", serde_json::to_string(header)?))?;
        writeln!(out, "{SHA256}{}", hex(&hash.finalize()))
    })
}

fn field(name: &str) -> String {
    if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

/// File of trials whose checksum is valid.
pub struct Trials {
    path: PathBuf,
    /// Header of the plan.
    pub header: Header,
    /// First trial, and the one after the last.
    pub range: [u64; 2],
}

impl Trials {
    /// Opens a file and checks all of it.
    ///
    /// # Errors
    /// If the file cannot be read, is not a file of trials, or is damaged. The message contains its path.
    pub fn open(path: &Path) -> Result<Self, String> {
        Self::checked(path).map_err(|why| format!("{}: {why}", path.display()))
    }

    fn checked(path: &Path) -> Result<Self, String> {
        let file = whole_file::open(path)?;
        let mut hash = Sha256::new();
        let (mut header, mut range, mut told) = (None, None, None);
        for line in BufReader::new(file).lines() {
            let line = line.map_err(|error| format!("not a readable CSV file: {error}"))?;
            if let Some(sum) = line.strip_prefix(SHA256) {
                told = Some(sum.to_owned());
                break;
            }
            hash.update(&line);
            hash.update("\n");
            if let Some(json) = line.strip_prefix(HEADER) {
                let read: Header =
                    serde_json::from_str(json).map_err(|error| format!("its header is damaged: {error}"))?;
                header = Some(read);
            } else if let Some(numbers) = line.strip_prefix(RANGE) {
                let numbers = numbers.split(", ").map(str::parse::<u64>).collect::<Result<Vec<_>, _>>();
                range = numbers.ok().and_then(|numbers| <[u64; 2]>::try_from(numbers).ok());
            }
        }
        let header = header.ok_or("not a file of trials: it has no such header")?;
        if header.scenario.contains(['/', '\\']) {
            return Err("its header is damaged: a scenario of that name would leave its folder".into());
        }
        let range = range.filter(|[first, end]| first <= end && *end <= header.trials).ok_or("its range is damaged")?;
        if told.as_deref() != Some(&hex(&hash.finalize())) {
            return Err("damaged: the checksum of header and values is wrong".into());
        }
        let trials = Self { path: path.to_owned(), header, range };
        let count = trials.rows()?.try_fold(0, |count, row| row.map(|_| count + 1))?;
        if count == range[1] - range[0] { Ok(trials) } else { Err("damaged: trials are missing".into()) }
    }

    /// Returns the rows in order, each checked.
    fn rows(&self) -> Result<impl Iterator<Item = Result<Row, String>>, String> {
        let file = BufReader::new(whole_file::open(&self.path)?);
        let (columns, [first, end]) = (self.header.columns.len(), self.range);
        Ok(file.lines().skip(1).zip(first..end).map(move |(line, trial)| {
            let line = line.map_err(|error| format!("damaged: {error}"))?;
            let mut fields = line.splitn(3, ',');
            let (number, word, numbers) = (fields.next(), fields.next(), fields.next().unwrap_or_default());
            if number.and_then(|number| number.parse().ok()) != Some(trial) {
                return Err(format!("damaged: trial {trial} is missing"));
            }
            if columns != if numbers.is_empty() { 0 } else { 1 + numbers.matches(',').count() } {
                return Err("damaged: its columns differ from its header".into());
            }
            let outcome = Outcome::ALL.into_iter().find(|outcome| Some(outcome.word()) == word);
            Ok(Row { outcome: outcome.ok_or("damaged: outcomes")?, numbers: numbers.to_owned() })
        }))
    }

    /// Returns the chunks in order.
    pub fn chunks(&self) -> impl Iterator<Item = io::Result<Chunk>> {
        let told = |why| io::Error::other(format!("{}: {why}", self.path.display()));
        let (mut rows, refused) = match self.rows() {
            Ok(rows) => (Some(rows), None),
            Err(why) => (None, Some(Err(told(why)))),
        };
        let (size, [mut next, end]) = (self.header.chunk.max(1), self.range);
        let read = std::iter::from_fn(move || {
            let rows = rows.as_mut()?;
            let until = (next / size + 1).saturating_mul(size).min(end);
            let first = std::mem::replace(&mut next, until);
            (first < end).then(|| self.chunk(first, rows.take((until - first) as usize)).map_err(told))
        });
        refused.into_iter().chain(read)
    }

    fn chunk(&self, first: u64, rows: impl Iterator<Item = Result<Row, String>>) -> Result<Chunk, String> {
        let mut chunk = Chunk { first, outcomes: Vec::new(), numbers: vec![Vec::new(); self.header.columns.len()] };
        for row in rows {
            let Row { outcome, numbers } = row?;
            chunk.outcomes.push(outcome);
            for (column, text) in chunk.numbers.iter_mut().zip(numbers.split(',')) {
                column.push(number(text)?);
            }
        }
        Ok(chunk)
    }

    /// Returns the outcome of each trial.
    ///
    /// # Errors
    /// If the file can no longer be read.
    pub fn outcomes(&self) -> Result<Vec<Outcome>, String> {
        self.each(|row| Ok(row.outcome))
    }

    /// Returns the column with this index in [`Header::columns`].
    ///
    /// # Errors
    /// If the file can no longer be read.
    pub fn column(&self, k: usize) -> Result<Vec<f64>, String> {
        self.each(|row| number(row.numbers.split(',').nth(k).unwrap_or_default()))
    }

    fn each<T>(&self, of: impl Fn(&Row) -> Result<T, String>) -> Result<Vec<T>, String> {
        let all = self.rows().and_then(|rows| rows.map(|row| of(&row?)).collect::<Result<Vec<T>, _>>());
        let all = all.and_then(|all| {
            let is_whole = all.len() as u64 == self.range[1] - self.range[0];
            if is_whole { Ok(all) } else { Err("damaged: trials are missing".into()) }
        });
        all.map_err(|why| format!("{}: {why}", self.path.display()))
    }
}

/// Row of a trial.
struct Row {
    outcome: Outcome,
    numbers: String,
}

fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "damaged: a column of numbers".into())
}
