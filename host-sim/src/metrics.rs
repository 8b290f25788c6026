//! The figures of merit of a trace.

use crate::trace::{Ending, Row, Trace};

/// Ultimate error of one estimate.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ChannelError {
    /// Channel, from 1.
    pub channel: usize,
    /// Maximum of |d_i - d_hat_i| over the window.
    pub error: f64,
}

/// Figures of merit; "ultimate" is the maximum over the metric window. What no tick speaks for, because the run ended
/// before its window, is NaN (`null` in JSON): not a 0 that looks like a perfect result.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Metrics {
    /// max |σ*|.
    pub sigma_star_ultimate: f64,
    /// max |y|.
    pub y_ultimate: f64,
    /// max |u| held, over the whole run.
    pub u_peak: f64,
    /// Total variation of the held u over the window, per second. Scales as 1/T for a chattering law: quote T.
    pub u_total_variation_per_s: f64,
    /// Per observed channel.
    pub estimation_error_ultimate: Vec<ChannelError>,
    /// Time after which |y| stays within the band; `null` if it never does.
    pub settling_time_s: Option<f64>,
    /// Did the state stay within reasonable range to the end?
    pub bounded: bool,
    /// The window.
    pub window_s: [f64; 2],
}

/// Half a tick of slack, so that a window edge on a tick includes that tick whatever the rounding of k T.
fn in_window(window_s: [f64; 2], period_s: f64, row: &Row) -> bool {
    row.t_s >= window_s[0] - 0.5 * period_s && row.t_s <= window_s[1] + 0.5 * period_s
}

/// Largest of |f(row)| over the rows in the window; NaN if there is none.
pub fn ultimate(trace: &Trace, window_s: [f64; 2], f: impl Fn(&Row) -> f64) -> f64 {
    let rows = trace.rows.iter().filter(|row| in_window(window_s, trace.period_s, row));
    // max takes the number beside a NaN, so NaN is what stays if there is no row.
    rows.map(|row| f(row).abs()).fold(f64::NAN, f64::max)
}

/// Root mean square of f(row) over the rows in the window; NaN if there is none.
pub fn rms(trace: &Trace, window_s: [f64; 2], f: impl Fn(&Row) -> f64) -> f64 {
    let rows = trace.rows.iter().filter(|row| in_window(window_s, trace.period_s, row));
    let (sum, count) = rows.fold((0.0, 0_usize), |(sum, count), row| (sum + f(row) * f(row), count + 1));
    (sum / count as f64).sqrt()
}

/// Computes the figures of merit.
pub fn measure(trace: &Trace, window_s: [f64; 2], settling_band: f64) -> Metrics {
    let window: Vec<&Row> = trace.rows.iter().filter(|row| in_window(window_s, trace.period_s, row)).collect();
    let variation: f64 = window.windows(2).map(|pair| (pair[1].u_held - pair[0].u_held).abs()).sum();
    // 0/0 without two ticks to compare.
    let duration = window.len().saturating_sub(1) as f64 * trace.period_s;
    let outside = trace.rows.iter().rposition(|row| row.x[0].abs() > settling_band);
    let settled = outside.map_or(Some(0), |last| (last + 1 < trace.rows.len()).then_some(last + 1));
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
        settling_time_s: settled.and_then(|k| trace.rows.get(k)).map(|row| row.t_s),
        bounded: !matches!(trace.ending, Ending::Diverged { .. }),
        window_s,
    }
}
