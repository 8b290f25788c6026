//! CSV format of a recording.
//!
//! ```text
//! tick,count_link,count_motor,u_held_a
//! 0,0,-7417,-2.752381
//! 1,0,-7415,-2.690998
//! ```
//!
//! | column | meaning |
//! |---|---|
//! | `tick` or `t_s` | number of the tick, or its time in s: one row per period of the scenario, none left out |
//! | `count_link` | count of the link's encoder as the counter has it; a joint only, and not with `--motor-alone` |
//! | `count_motor` | count of the motor's encoder (a motor: also `count`) |
//! | `u_held_a` | current that is held from this tick to the next, A: after every limit |
//!
//! Columns may have any order; other columns are ignored. Counts may wrap. Sign, offset, bits and gear come from the
//! scenario. A lost sample (no row, or an empty cell) is an error, because the equations are integrated over the whole
//! recording.

use loop_sim::sensor::encoder::Mounted;

use super::{Angle, Record};

/// Known column names.
const COLUMNS: [&str; 6] = ["tick", "t_s", "count_link", "count_motor", "count", "u_held_a"];
/// Longest recording, ticks.
const LONGEST: usize = 1_000_000;
/// Largest mean deviation of the period; the relative error of b is twice as large, within an interval of some percent.
const MOST_DRIFT: f64 = 0.005;

/// Error in a file with its position, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misread {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
    /// Message.
    pub message: String,
}

impl Misread {
    fn at((line, column): (usize, usize), message: impl Into<String>) -> Self {
        Self { line, column, message: message.into() }
    }
}

/// Returns the cells of a line with their columns.
fn cells(line: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut at = 1;
    line.split(',').map(move |cell| {
        let begin = at + cell.chars().take_while(|c| c.is_whitespace()).count();
        at += cell.chars().count() + 1;
        (begin, cell.trim())
    })
}

/// Returns the angle of an encoder from its counts, with counter wraps removed.
pub fn unwrapped(counts: impl IntoIterator<Item = f64>, mounted: &Mounted) -> Angle {
    let (mut last, mut at) = (0, 0_i64);
    let step_rad = mounted.encoder.unit_rad();
    let angle = |count: f64| {
        let count = mounted.upright(count).unwrap_or_default();
        at += mounted.counts_since(count, last);
        last = count;
        at as f64 * step_rad
    };
    Angle { rad: counts.into_iter().map(angle).collect(), step_rad }
}

/// Returns the message for a missing column, with a similar name.
fn missing(names: &[&str], heads: &[(usize, &str)]) -> String {
    let have: Vec<&str> = heads.iter().map(|(_, head)| *head).collect();
    let near = have.iter().find(|have| !COLUMNS.contains(have) && strsim::jaro_winkler(have, names[0]) > 0.8);
    let near = match near {
        Some(near) => format!(" (did you mean {near:?}?)"),
        None if names[0] == "count_link" => {
            " (for a joint without it use --motor-alone; for a motor recording give a scenario with [motor])".into()
        }
        None => String::new(),
    };
    format!("no column {}{near}: found {}", names.join(" or "), have.join(", "))
}

/// Checks the mean period; single steps may jitter with the resolution of the clock.
fn drift(place: (usize, usize), clock: &str, times: &[f64], per_period: f64, period_s: f64) -> Result<(), Misread> {
    let [first, .., last] = times else { return Ok(()) };
    let periods = (last - first) / per_period / (times.len() - 1) as f64;
    if (periods - 1.0).abs() <= MOST_DRIFT {
        return Ok(());
    }
    let message = format!(
        "{clock} advances {periods:.4} periods of {period_s} s per row, expected 1 within {MOST_DRIFT}: drive.period_s \
         must match the recording"
    );
    Err(Misread::at(place, message))
}

/// Kind of recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingKind {
    /// Motor with one encoder.
    Motor,
    /// Joint with both encoders.
    Joint,
    /// Joint without the link count.
    JointAlone,
}

/// Head line: its cells, and the columns that are read, clock first and motor count last.
struct Head<'a> {
    cells: Vec<(usize, &'a str)>,
    read: Vec<usize>,
}

impl<'a> Head<'a> {
    fn of(line: usize, head: &'a str, kind: RecordingKind) -> Result<Self, Misread> {
        let at = |column: usize, message: String| Misread { line, column, message };
        let separators = [(';', "semicolons"), ('\t', "tabs")];
        if let Some((mark, name)) = separators.into_iter().find(|(mark, _)| head.contains(*mark)) {
            let column = head.chars().take_while(|c| *c != mark).count() + 1;
            return Err(at(column, format!("expected commas between columns, found {name}")));
        }
        let cells: Vec<(usize, &str)> = cells(head).collect();
        let is_before = |k: usize, head: &str| cells[..k].iter().any(|(_, before)| !head.is_empty() && *before == head);
        let twice = cells.iter().enumerate().find(|(k, (_, head))| is_before(*k, head));
        if let Some((_, &(column, head))) = twice {
            return Err(at(column, format!("duplicate column {head:?}")));
        }
        let is_joint = kind == RecordingKind::Joint;
        if let Some(&(column, _)) = cells.iter().find(|(_, head)| kind == RecordingKind::Motor && *head == "count_link")
        {
            return Err(at(
                column,
                "column count_link belongs to a joint, but the scenario has [motor]: give a scenario with [joint]"
                    .into(),
            ));
        }
        let place = |names: &[&str]| cells.iter().position(|(_, head)| names.contains(head));
        let needed = |names: &[&str]| place(names).ok_or_else(|| at(1, missing(names, &cells)));
        let mut read = vec![needed(&["tick", "t_s"])?, needed(&["u_held_a"])?];
        if is_joint {
            read.push(needed(&["count_link"])?);
        }
        read.push(needed(if is_joint { &["count_motor"] } else { &["count_motor", "count"] })?);
        Ok(Self { cells, read })
    }

    fn clock(&self) -> (usize, &'a str) {
        self.cells[self.read[0]]
    }

    /// Returns the numbers of a line, one per column that is read.
    fn row(&self, line_at: usize, line: &str) -> Result<Vec<f64>, Misread> {
        let at = |column: usize, message: String| Misread { line: line_at, column, message };
        let found: Vec<(usize, &str)> = cells(line).collect();
        let heads = self.cells.len();
        if let Some(&(begin, cell)) = found.get(heads).filter(|(_, cell)| !cell.is_empty()) {
            return Err(at(begin, format!("{cell:?} has no column: the head has {heads}")));
        }
        let number = |column: &usize| {
            let name = self.cells[*column].1;
            let end = || at(line.chars().count() + 1, format!("the line ends before {name}"));
            let &(begin, cell) = found.get(*column).ok_or_else(end)?;
            number((line_at, begin), name, cell)
        };
        self.read.iter().map(number).collect()
    }
}

/// Parses a cell of the column with this name.
fn number(place: (usize, usize), name: &str, cell: &str) -> Result<f64, Misread> {
    let misread = |message| Misread::at(place, format!("{name}{message}"));
    if cell.is_empty() {
        return Err(misread(
            " is empty: a sample was lost. Cut the recording before or after it if 2 s with moves to and fro remain, \
             or record again"
                .into(),
        ));
    }
    let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
    let value = value.ok_or_else(|| misread(format!(": expected a number, found {cell:?}")))?;
    if name.starts_with("count") && (value.fract() != 0.0 || value.abs() > 4_294_967_296.0) {
        return Err(misread(format!(": expected a whole count, found {cell}")));
    }
    Ok(value)
}

/// Checks that a row is one period after the last one.
fn next(
    place: (usize, usize),
    clock: &str,
    [before, now]: [f64; 2],
    per_period: f64,
    period_s: f64,
) -> Result<(), Misread> {
    let periods = (now - before) / per_period;
    if (periods - 1.0).abs() <= 0.1 {
        return Ok(());
    }
    let message = if periods > 1.0 && (periods - periods.round()).abs() <= 0.1 {
        format!("{:.0} ticks were lost before this one: record again without a gap", periods.round() - 1.0)
    } else {
        format!(
            "{clock} = {now} after {before} is {periods:.3} periods of {period_s} s, expected 1: drive.period_s must \
             match the recording"
        )
    };
    Err(Misread::at(place, message))
}

/// Reads a recording of this kind. The encoders are motor, or link and motor.
///
/// # Errors
/// The first error and its position.
pub fn read(text: &str, period_s: f64, kind: RecordingKind, encoders: &[Mounted]) -> Result<Record, Misread> {
    let at = |line: usize, column: usize, message: String| Misread { line, column, message };
    // Some programs start a file with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((head_at, head)) = lines.next() else {
        return Err(at(1, 1, "the file is empty: expected tick,count_link,count_motor,u_held_a".into()));
    };
    let head = Head::of(head_at + 1, head, kind)?;
    let (clock_at, clock) = head.clock();
    let per_period = if clock == "tick" { 1.0 } else { period_s };
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); head.read.len()];
    for (k, line) in lines {
        for (column, number) in columns.iter_mut().zip(head.row(k + 1, line)?) {
            column.push(number);
        }
        let times = &columns[0];
        if let [.., before, now] = *times.as_slice() {
            let column = cells(line).nth(head.read[0]).map_or(1, |(begin, _)| begin);
            next((k + 1, column), clock, [before, now], per_period, period_s)?;
        }
        if times.len() > LONGEST {
            return Err(at(k + 1, 1, format!("more than {LONGEST} ticks: a few seconds are enough")));
        }
    }
    let last = text.lines().count().max(1);
    drift((last, clock_at), clock, &columns[0], per_period, period_s)?;
    let mut columns = columns.into_iter().skip(1);
    let held_a = columns.next().unwrap_or_default();
    let (rows, seconds) = (held_a.len(), held_a.len() as f64 * period_s);
    if seconds < 1.0 {
        return Err(at(last, 1, format!("{rows} ticks are {seconds} s: at least 1 s is needed")));
    }
    let mut angles = columns.zip(encoders).map(|(counts, mounted)| unwrapped(counts, mounted));
    let link = if kind == RecordingKind::Joint { angles.next() } else { None };
    Ok(Record { period_s, link, motor: angles.next().unwrap_or_default(), held_a })
}
