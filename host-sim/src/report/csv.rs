//! Trace as comma-separated values, one line per tick.
//!
//! ```text
//! t_s,x1,..,xn,[r,error,]u,u_held,sigma,sigma_star,d1,..,dn,d_hat<i>..,health
//! ```
//!
//! * `t_s` is in seconds, all other columns are in the units of the plant. For a drive u is in A and d in rad/s².
//! * `r` (reference) and `error` (output minus `r`) exist only with a reference.
//! * The states of a drive have names instead of x1 .. xn: `angle_rad`, `motor_speed_rad_s`, `current_a`.
//! * Channels count from 1. An estimate has a column only if its channel has an observer.
//! * `health` is the sum of the status bits of [`controller_core::Health`].
//! * Every column is numeric. A number is the shortest text that reads back to identical bits.
//!
//! | bit of `health` | meaning |
//! |---|---|
//! | 1 | input rejected |
//! | 2 | saturated |
//! | 4 | σ* over its bound |
//! | 8 | a count missing or rejected |
//! | 16 | a disturbance over its bound |
//! | 32 | at a limit for too long |
//! | 64 | stopped by a monitor |
//! | 128 and above | see [`controller_core::Health`] |

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::Path;

use loop_sim::trace::Trace;
use scenario::StateName;

use crate::report::write_whole;

/// Writes every `every`-th tick of the trace as the file `path`, completely or not at all.
///
/// # Errors
/// If the file cannot be written.
pub fn write(trace: &Trace, states: &[StateName], every: NonZeroUsize, path: &Path) -> io::Result<()> {
    write_whole(path, |out| write_to(trace, states, every, out))
}

/// Writes every `every`-th tick of the trace as a line of text, and the first and the last tick.
///
/// # Errors
/// If `out` cannot be written.
pub fn write_to(trace: &Trace, states: &[StateName], every: NonZeroUsize, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{}", trace.columns(states).join(","))?;
    let last = trace.rows.len().saturating_sub(1);
    for (_, row) in trace.rows.iter().enumerate().filter(|(k, _)| *k % every == 0 || *k == last) {
        for value in trace.values(row) {
            // `Debug` of an f64 is its shortest exact text, with an exponent where that is shorter.
            write!(out, "{value:?},")?;
        }
        writeln!(out, "{}", row.health.bits())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller_core::Health;
    use loop_sim::MAX_ORDER;
    use loop_sim::trace::{Ending, Row};

    /// Numbers without a finite decimal expansion, subnormal, huge, negative zero.
    const AWKWARD: [f64; 6] = [0.1, 1.0 / 3.0, 5e-324, f64::MAX, -0.0, -1.234_567_890_123_456_7e-7];

    fn trace() -> Trace {
        let row = Row {
            t_s: 0.1 + 0.2,
            x: AWKWARD,
            r: 0.0,
            u: -7.661,
            u_held: f64::INFINITY,
            sigma: f64::NAN,
            sigma_star: 1e22,
            d: [AWKWARD[1]; MAX_ORDER],
            d_hat: [0.0, AWKWARD[5], 0.0, AWKWARD[2], 0.0, 0.0],
            health: Health::SATURATED | Health::INPUT_REJECTED,
        };
        Trace {
            order: 4,
            observed: vec![1, 3],
            follows: None,
            period_s: 1e-3,
            rows: vec![row; 3],
            ending: Ending::Finished,
        }
    }

    #[test]
    fn every_number_reads_back_as_the_same_bits() {
        let trace = trace();
        let mut text = Vec::new();
        write_to(&trace, &[], NonZeroUsize::MIN, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("t_s,x1,x2,x3,x4,u,u_held,sigma,sigma_star,d1,d2,d3,d4,d_hat2,d_hat4,health"));
        let expected: Vec<u64> = trace.values(&trace.rows[0]).map(f64::to_bits).collect();
        assert_eq!(expected.len(), 15);
        for line in lines.by_ref().take(3) {
            let (numbers, health) = line.rsplit_once(',').unwrap();
            let read: Vec<u64> = numbers.split(',').map(|cell| cell.parse::<f64>().unwrap().to_bits()).collect();
            assert_eq!(read, expected);
            assert_eq!(health, "3");
        }
        assert_eq!(lines.next(), None);
    }

    #[test]
    fn a_reference_and_what_is_left_of_it_have_columns() {
        let mut trace = trace();
        (trace.follows, trace.rows[0].x[1], trace.rows[0].r) = (Some(1), 3.0, 1.25);
        let mut text = Vec::new();
        write_to(&trace, &[], NonZeroUsize::MIN, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let (names, row) = (lines.next().unwrap(), lines.next().unwrap());
        assert_eq!((&names[4..8], &row[5..7]), (&["x4", "r", "error", "u"][..], &["1.25", "1.75"][..]));
        assert_eq!(names.len(), row.len());
    }

    #[test]
    fn the_states_of_a_drive_have_their_names() {
        let mut text = Vec::new();
        let states = [("angle", "rad"), ("motor speed", "rad/s"), ("current", "A")];
        write_to(&trace(), &states, NonZeroUsize::MIN, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(text.starts_with("t_s,angle_rad,motor_speed_rad_s,current_a,x4,u,"), "{text}");
    }

    #[test]
    fn the_file_holds_the_same_text() {
        let folder = crate::report::tests::folder("csv");
        let path = folder.join("deep").join("trace.csv");
        write(&trace(), &[], NonZeroUsize::MIN, &path).unwrap();
        let mut text = Vec::new();
        write_to(&trace(), &[], NonZeroUsize::MIN, &mut text).unwrap();
        assert_eq!(std::fs::read(path).unwrap(), text);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
