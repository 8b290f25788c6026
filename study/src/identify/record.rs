//! A record as a file.
//!
//! ```text
//! tick,count_link,count_motor,u_held_a
//! 0,0,-7417,-2.752381
//! 1,0,-7415,-2.690998
//! ```
//!
//! | column | is |
//! |---|---|
//! | `tick` or `t_s` | number of the tick, or its time in s: one row per period of the scenario, none left out |
//! | `count_link` | count of the link's encoder as the counter has it; a joint only, and not with `--motor-alone` |
//! | `count_motor` | count of the motor's encoder (a motor: also `count`) |
//! | `u_held_a` | current that is held from this tick to the next, A: after every limit |
//!
//! In any order; other columns are not read. Counts may wrap; sign, offset, bits and gear are those of the scenario. A
//! sample that was lost (no row, or an empty cell) is an error: the equations are integrated over the whole record.

use loop_sim::sensor::encoder::Mounted;

use super::{Angle, Record};

/// What a column may be called.
const COLUMNS: [&str; 6] = ["tick", "t_s", "count_link", "count_motor", "count", "u_held_a"];
/// Longest record that is read, ticks.
const LONGEST: usize = 1_000_000;
/// What a period may be off on the average: b errs by twice as much, and its interval is some percent.
const MOST_DRIFT: f64 = 0.005;

/// A mistake in a file, with its place from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misread {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
    /// What is wrong.
    pub message: String,
}

/// Cells of a line with their columns.
fn cells(line: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut at = 1;
    line.split(',').map(move |cell| {
        let begin = at + cell.chars().take_while(|c| c.is_whitespace()).count();
        at += cell.chars().count() + 1;
        (begin, cell.trim())
    })
}

/// The angle of an encoder from its counts, without the wraps of its counter.
pub fn unwrapped(counts: impl IntoIterator<Item = f64>, mounted: &Mounted) -> Angle {
    let unread = 32 - mounted.encoder.bits;
    let signed = |count: i32| i64::from(count << unread >> unread);
    let (mut last, mut at) = (None, 0_i64);
    let step_rad = mounted.encoder.unit_rad();
    let angle = |count: f64| {
        let count = mounted.upright(count).unwrap_or_default();
        at += signed(last.map_or(count, |last| count.wrapping_sub(last)));
        last = Some(count);
        at as f64 * step_rad
    };
    Angle { rad: counts.into_iter().map(angle).collect(), step_rad }
}

/// That a column is missing, and which is near.
fn missing(names: &[&str], heads: &[(usize, &str)]) -> String {
    let have: Vec<&str> = heads.iter().map(|(_, head)| *head).collect();
    let near = have.iter().find(|have| !COLUMNS.contains(have) && strsim::jaro_winkler(have, names[0]) > 0.8);
    let near = match near {
        Some(near) => format!(" ({near:?} is near)"),
        None if names[0] == "count_link" => " (a record without it: --motor-alone)".into(),
        None => String::new(),
    };
    format!("no column {}{near}: there are {}", names.join(" or "), have.join(", "))
}

/// A step may be as long as its clock can tell, all of them together not.
fn drift(times: &[f64], per_period: f64, period_s: f64) -> Result<(), String> {
    let [first, .., last] = times else { return Ok(()) };
    let periods = (last - first) / per_period / (times.len() - 1) as f64;
    if (periods - 1.0).abs() <= MOST_DRIFT {
        return Ok(());
    }
    Err(format!(
        "{periods:.4} periods of {period_s} s a row, expected 1 within {MOST_DRIFT}: is drive.period_s of the scenario \
         that of the record?"
    ))
}

/// A record of a drive with these encoders: motor, or link and motor.
///
/// # Errors
/// The first mistake and its place.
pub fn read(text: &str, period_s: f64, encoders: &[Mounted]) -> Result<Record, Misread> {
    let at = |line: usize, column: usize, message: String| Misread { line, column, message };
    // A byte order mark is how some programs begin a file.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((head_at, head)) = lines.next() else {
        return Err(at(1, 1, "the file is empty: expected tick,count_link,count_motor,u_held_a".into()));
    };
    if let Some((mark, name)) = [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|(mark, _)| head.contains(*mark))
    {
        let column = head.chars().take_while(|c| *c != mark).count() + 1;
        return Err(at(head_at + 1, column, format!("columns stand between commas, these between {name}")));
    }
    let heads: Vec<(usize, &str)> = cells(head).collect();
    let is_before = |k: usize, head: &str| heads[..k].iter().any(|(_, before)| !head.is_empty() && *before == head);
    let twice = heads.iter().enumerate().find(|(k, (_, head))| is_before(*k, head));
    if let Some((_, &(column, head))) = twice {
        return Err(at(head_at + 1, column, format!("there are two columns {head:?}")));
    }
    let place = |names: &[&str]| heads.iter().position(|(_, head)| names.contains(head));
    let needed = |names: &[&str]| place(names).ok_or_else(|| at(head_at + 1, 1, missing(names, &heads)));
    let is_joint = encoders.len() > 1;
    let clock = needed(&["tick", "t_s"])?;
    let per_period = if heads[clock].1 == "tick" { 1.0 } else { period_s };
    let motor: &[&str] = if is_joint { &["count_motor"] } else { &["count_motor", "count"] };
    let mut columns = vec![clock, needed(&["u_held_a"])?];
    if is_joint {
        columns.push(needed(&["count_link"])?);
    }
    columns.push(needed(motor)?);

    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
    for (k, line) in lines {
        let found: Vec<(usize, &str)> = cells(line).collect();
        if let Some(&(begin, cell)) = found.get(heads.len()).filter(|(_, cell)| !cell.is_empty()) {
            return Err(at(k + 1, begin, format!("{cell:?} has no column: the head has {}", heads.len())));
        }
        for (row, &column) in rows.iter_mut().zip(&columns) {
            let name = heads[column].1;
            let Some(&(begin, cell)) = found.get(column) else {
                return Err(at(k + 1, line.chars().count() + 1, format!("the line ends before {name}")));
            };
            let lost = || {
                format!(
                    "{name} is empty: a sample was lost. Cut the record before or after it if 2 s with moves to and \
                     fro remain, or record again"
                )
            };
            if cell.is_empty() {
                return Err(at(k + 1, begin, lost()));
            }
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
            let Some(value) = value else {
                return Err(at(k + 1, begin, format!("{name}: expected a number, found {cell:?}")));
            };
            if name.starts_with("count") && (value.fract() != 0.0 || value.abs() > 4_294_967_296.0) {
                return Err(at(k + 1, begin, format!("{name}: expected a whole count, found {cell}")));
            }
            row.push(value);
        }
        let times = &rows[0];
        if let [.., before, now] = times.as_slice() {
            let periods = (now - before) / per_period;
            if (periods - 1.0).abs() > 0.1 {
                let message = if periods > 1.0 && (periods - periods.round()).abs() <= 0.1 {
                    format!("{:.0} ticks were lost before this one: record again without a gap", periods.round() - 1.0)
                } else {
                    format!(
                        "{} = {now} after {before} is {periods:.3} periods of {period_s} s, expected 1: is \
                         drive.period_s of the scenario that of the record?",
                        heads[clock].1
                    )
                };
                return Err(at(k + 1, found[clock].0, message));
            }
        }
        if times.len() > LONGEST {
            return Err(at(k + 1, 1, format!("more than {LONGEST} ticks: some seconds are enough")));
        }
    }
    drift(&rows[0], per_period, period_s)
        .map_err(|why| at(text.lines().count().max(1), heads[clock].0, format!("{} goes {why}", heads[clock].1)))?;
    let mut rows = rows.into_iter().skip(1);
    let held_a = rows.next().unwrap_or_default();
    let seconds = held_a.len() as f64 * period_s;
    if seconds < 1.0 {
        let rows = held_a.len();
        return Err(at(
            text.lines().count().max(1),
            1,
            format!("{rows} ticks are {seconds} s: at least 1 s is needed"),
        ));
    }
    let mut angles = rows.zip(encoders).map(|(counts, mounted)| unwrapped(counts, mounted));
    let link = if is_joint { angles.next() } else { None };
    Ok(Record { period_s, link, motor: angles.next().unwrap_or_default(), held_a })
}
