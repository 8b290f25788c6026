//! The figures of merit of a trace.
//!
//! Units: with U that of the output y = x_1 (rad for the flexible joint) and n the order of the plant, σ* is in
//! U/s^(n-1), the disturbance d_i and its error in U/s^i; u is in the plant's input unit, times in s.

use crate::trace::{Ending, Row, Trace};

/// Ultimate error of one estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ChannelError {
    /// Channel, from 1.
    pub channel: usize,
    /// Maximum of |d_i - d_hat_i| over the window, U/s^i.
    pub error: f64,
}

/// An output that gets so many times farther out than it began, or than where it counts as settled, is not bounded.
pub const FAR: f64 = 1000.0;

/// Figures of merit; "ultimate" is the maximum over the metric window. What no tick speaks for, because the run ended
/// before its window, is NaN (`null` in JSON): not a 0 that looks like a perfect result.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Metrics {
    /// max |σ*|, U/s^(n-1).
    pub sigma_star_ultimate: f64,
    /// max |y|, U.
    pub y_ultimate: f64,
    /// max |u| held, over the whole run, in the plant's input unit.
    pub u_peak: f64,
    /// Total variation of the held u over the window, per second: the plant's input unit per s. Scales as 1/T for a
    /// chattering law: quote T.
    pub u_total_variation_per_s: f64,
    /// Per observed channel.
    pub estimation_error_ultimate: Vec<ChannelError>,
    /// Time after which |y| stays within the band, s; `null` if it never does, or the run did not finish.
    pub settling_time_s: Option<f64>,
    /// Did the run go to its end (or until someone asked to stop), with |y| never more than [`FAR`] times the larger
    /// of |y(0)| and the settling band?
    pub bounded: bool,
    /// First and last instant of the window, s.
    pub window_s: [f64; 2],
}

/// The rows of a window that the run went through to its end; none if it broke off before.
///
/// Half a tick of slack, so that a window edge on a tick includes that tick whatever the rounding of k T.
fn rows_of(trace: &Trace, window_s: [f64; 2]) -> impl Iterator<Item = &Row> {
    let slack = 0.5 * trace.period_s;
    let [from_s, to_s] = [window_s[0] - slack, window_s[1] + slack];
    let reached = trace.rows.last().is_some_and(|row| row.t_s >= window_s[1] - slack);
    let covered = reached || trace.ending == Ending::Finished;
    trace.rows.iter().filter(move |row| covered && row.t_s >= from_s && row.t_s <= to_s)
}

/// Largest of |f(row)| over the rows in the window; NaN if there is none, or one of them is.
pub fn ultimate(trace: &Trace, window_s: [f64; 2], f: impl Fn(&Row) -> f64) -> f64 {
    let larger = |a: f64, b: f64| if a >= b || a.is_nan() { a } else { b };
    rows_of(trace, window_s).map(|row| f(row).abs()).reduce(larger).unwrap_or(f64::NAN)
}

/// Root mean square of f(row) over the rows in the window; NaN if there is none.
pub fn rms(trace: &Trace, window_s: [f64; 2], f: impl Fn(&Row) -> f64) -> f64 {
    let (sum, count) =
        rows_of(trace, window_s).fold((0.0, 0_usize), |(sum, count), row| (sum + f(row) * f(row), count + 1));
    (sum / count as f64).sqrt()
}

/// Computes the figures of merit.
pub fn measure(trace: &Trace, window_s: [f64; 2], settling_band: f64) -> Metrics {
    let window: Vec<&Row> = rows_of(trace, window_s).collect();
    let variation: f64 = window.windows(2).map(|pair| (pair[1].u_held - pair[0].u_held).abs()).sum();
    // 0/0 without two ticks to compare.
    let duration = window.len().saturating_sub(1) as f64 * trace.period_s;
    let outside = trace.rows.iter().rposition(|row| row.x[0].abs() > settling_band);
    let settled = trace.rows.get(outside.map_or(0, |last| last + 1)).filter(|_| trace.ending == Ending::Finished);
    Metrics {
        sigma_star_ultimate: ultimate(trace, window_s, |row| row.sigma_star),
        y_ultimate: ultimate(trace, window_s, |row| row.x[0]),
        u_peak: trace.rows.iter().map(|row| row.u_held.abs()).fold(f64::NAN, f64::max),
        u_total_variation_per_s: variation / duration,
        estimation_error_ultimate: trace
            .observed
            .iter()
            .map(|&i| ChannelError { channel: i + 1, error: ultimate(trace, window_s, |row| row.d[i] - row.d_hat[i]) })
            .collect(),
        settling_time_s: settled.map(|row| row.t_s),
        bounded: matches!(trace.ending, Ending::Finished | Ending::Interrupted { .. })
            && stays_near(trace, settling_band),
        window_s,
    }
}

fn stays_near(trace: &Trace, settling_band: f64) -> bool {
    let began = trace.rows.first().map_or(0.0, |row| row.x[0].abs());
    trace.rows.iter().all(|row| row.x[0].abs() <= FAR * began.max(settling_band))
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller_core::Health;

    /// y = 1, 0.5, 0.25, .. at T = 1 s; u alternates between 1 and 3.
    fn trace(ticks: usize, ending: Ending) -> Trace {
        let row = |k: usize| {
            let mut row = Row {
                t_s: k as f64,
                x: [0.0; 6],
                u: 0.0,
                u_held: [1.0, 3.0][k % 2],
                sigma: 0.0,
                sigma_star: -2.0,
                d: [0.0; 6],
                d_hat: [0.0; 6],
                health: Health::OK,
            };
            row.x[0] = 0.5_f64.powi(k as i32);
            row.d[0] = 3.0;
            row
        };
        Trace { order: 2, observed: vec![0], period_s: 1.0, rows: (0..ticks).map(row).collect(), ending }
    }

    #[test]
    fn figures_of_merit_of_a_known_trace() {
        let found = measure(&trace(11, Ending::Finished), [5.0, 10.0], 0.1);
        assert_eq!((found.sigma_star_ultimate, found.y_ultimate, found.u_peak), (2.0, 1.0 / 32.0, 3.0));
        assert_eq!(found.u_total_variation_per_s, 2.0);
        assert_eq!(found.estimation_error_ultimate, [ChannelError { channel: 1, error: 3.0 }]);
        assert_eq!(found.settling_time_s, Some(4.0));
        assert_eq!(rms(&trace(11, Ending::Finished), [0.0, 10.0], |row| row.sigma_star), 2.0);
    }

    #[test]
    fn a_run_that_broke_off_inside_its_window_speaks_for_nothing() {
        for ending in [Ending::Diverged { t_s: 8.0 }, Ending::BrokenOff { t_s: 8.0 }] {
            let found = measure(&trace(8, ending), [5.0, 10.0], 0.1);
            assert!(found.sigma_star_ultimate.is_nan() && found.y_ultimate.is_nan());
            assert!(found.u_total_variation_per_s.is_nan() && found.estimation_error_ultimate[0].error.is_nan());
            assert_eq!((found.settling_time_s, found.bounded), (None, false));
            assert_eq!(found.u_peak, 3.0);
        }
    }

    #[test]
    fn what_ends_a_thousand_times_farther_out_than_it_began_is_not_bounded() {
        let bounded = |y: f64, band: f64| {
            let mut trace = trace(11, Ending::Finished);
            trace.rows[7].x[0] = y;
            measure(&trace, [5.0, 10.0], band).bounded
        };
        // It begins at 1.
        assert!(bounded(-FAR, 0.1) && !bounded(1.001 * FAR, 0.1) && !bounded(-3e6, 0.1));
        assert!(bounded(3e6, 3e3) && !bounded(3.001e6, 3e3));
        assert!(!bounded(f64::NAN, 0.1) && !bounded(f64::INFINITY, 0.1));
    }

    #[test]
    fn a_value_that_is_not_a_number_is_not_overlooked() {
        let mut trace = trace(11, Ending::Finished);
        trace.rows[7].sigma_star = f64::NAN;
        assert!(ultimate(&trace, [5.0, 10.0], |row| row.sigma_star).is_nan());
    }
}
