//! Metrics of a trace.
//!
//! Units: U is the unit of the output y = x_1 (rad for the flexible joint), and n is the order of the plant. σ* is in
//! U/s^(n-1). The disturbance d_i and its error are in U/s^i. u is in the input unit of the plant, and times are in s.
//!
//! In a run that follows a reference, y stands for the tracking error y - r. [`measure`] handles both kinds of run, and
//! [`track`] adds the metrics of tracking.

use std::f64::consts::FRAC_1_SQRT_2;
use std::ops::Range;

use controller_core::Health;

use crate::MAX_ORDER;
use crate::port::ControllerPort;
use crate::sensor::Sensor;
use crate::trace::{Ending, Row, Trace};

/// Ultimate error of one disturbance estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ChannelError {
    /// Index of the channel, from 1.
    pub channel: usize,
    /// Maximum of |d_i - d_hat_i| over the window, U/s^i.
    pub error: f64,
}

/// Factor above which an output counts as unbounded, relative to the larger of |y(0)| and the settling band.
pub const FAR: f64 = 1000.0;

/// Metrics of a run; "ultimate" is the maximum over the metric window. A metric without any tick in its window is NaN
/// (`null` in JSON), because 0 would look like a perfect result.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Metrics {
    /// Maximum of |σ*| over the window, U/s^(n-1).
    pub sigma_star_ultimate: f64,
    /// Maximum of |y| over the window, with a reference of |y - r|, U.
    pub y_ultimate: f64,
    /// Maximum of the held |u| over the whole run, in the input unit of the plant.
    pub u_peak: f64,
    /// Total variation of the held u over the window per second, in the input unit of the plant per s. It scales as 1/T
    /// for a chattering controller, so quote T with it.
    pub u_total_variation_per_s: f64,
    /// Ultimate error of the estimate for each observed channel.
    pub estimation_error_ultimate: Vec<ChannelError>,
    /// Time after which |y| stays within the band, s. `null` if it never does or the run did not finish.
    pub settling_time_s: Option<f64>,
    /// True if the run finished, or was interrupted, with |y| at most [`FAR`] times the larger of |y(0)| and the
    /// settling band.
    pub bounded: bool,
    /// First and last instant of the window, s.
    pub window_s: [f64; 2],
}

/// Returns the rows of a window, or none if the run broke off before the end of the window.
///
/// Half a tick of slack includes a tick at the edge of the window despite the rounding of k T.
fn rows_of(trace: &Trace, window_s: [f64; 2]) -> impl Iterator<Item = &Row> {
    let slack = 0.5 * trace.period_s;
    let [from_s, to_s] = [window_s[0] - slack, window_s[1] + slack];
    let reached = trace.rows.last().is_some_and(|row| row.t_s >= window_s[1] - slack);
    let covered = reached || trace.ending == Ending::Finished;
    trace.rows.iter().filter(move |row| covered && row.t_s >= from_s && row.t_s <= to_s)
}

/// Returns the maximum of |f(row)| over the rows in the window. NaN if there is no row or a value is NaN.
pub fn ultimate(trace: &Trace, window_s: [f64; 2], f: impl Fn(&Row) -> f64) -> f64 {
    let larger = |a: f64, b: f64| if a >= b || a.is_nan() { a } else { b };
    rows_of(trace, window_s).map(|row| f(row).abs()).reduce(larger).unwrap_or(f64::NAN)
}

/// Returns the root mean square of f(row) over the rows in the window. NaN if there is no row.
pub fn rms(trace: &Trace, window_s: [f64; 2], f: impl Fn(&Row) -> f64) -> f64 {
    let (sum, count) =
        rows_of(trace, window_s).fold((0.0, 0_usize), |(sum, count), row| (sum + f(row) * f(row), count + 1));
    (sum / count as f64).sqrt()
}

/// Computes the metrics.
pub fn measure(trace: &Trace, window_s: [f64; 2], settling_band: f64) -> Metrics {
    let window: Vec<&Row> = rows_of(trace, window_s).collect();
    let variation: f64 = window.windows(2).map(|pair| (pair[1].u_held - pair[0].u_held).abs()).sum();
    // 0/0 = NaN without two ticks to compare.
    let duration = window.len().saturating_sub(1) as f64 * trace.period_s;
    let outside = trace.rows.iter().rposition(|row| trace.error(row).abs() > settling_band);
    let settled = trace.rows.get(outside.map_or(0, |last| last + 1)).filter(|_| trace.ending == Ending::Finished);
    Metrics {
        sigma_star_ultimate: ultimate(trace, window_s, |row| row.sigma_star),
        y_ultimate: ultimate(trace, window_s, |row| trace.error(row)),
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
    let began = trace.rows.first().map_or(0.0, |row| trace.error(row).abs());
    trace.rows.iter().all(|row| trace.error(row).abs() <= FAR * began.max(settling_band))
}

/// Time within the band that counts as arrival, s.
const STAYS_S: f64 = 0.05;

/// Tracking metrics of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Tracking {
    /// Root mean square of y - r over the window, U.
    pub error_rms: f64,
    /// Time at which y enters the band about the last r and stays there for 50 ms, s. `null` if it never does, the
    /// reference does not end at rest, or the run did not finish.
    pub arrival_s: Option<f64>,
    /// Share of all ticks in which the demand exceeds the limits, 0..=1.
    pub saturated_share: f64,
}

/// Computes the tracking metrics. The reference ends at rest if it does not change in the last tenth of the run.
pub fn track(trace: &Trace, window_s: [f64; 2], settling_band: f64) -> Tracking {
    let rows = &trace.rows;
    let last = rows.last().map_or(f64::NAN, |row| row.r);
    let rests = rows.iter().rev().take(rows.len() / 10 + 2).all(|row| row.r == last);
    let output = trace.follows.unwrap_or(0);
    let stays = ((STAYS_S / trace.period_s).round() as usize).max(1);
    let arrived = rows.windows(stays).find(|rows| rows.iter().all(|row| (row.x[output] - last).abs() <= settling_band));
    let saturated = rows.iter().filter(|row| row.health.contains(Health::SATURATED)).count();
    Tracking {
        error_rms: rms(trace, window_s, |row| trace.error(row)),
        arrival_s: arrived.filter(|_| rests && trace.ending == Ending::Finished).map(|rows| rows[0].t_s),
        saturated_share: saturated as f64 / rows.len() as f64,
    }
}

/// RMS noise of u that the quantisation of a sensor causes, in the input unit of the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Noise {
    /// RMS difference between u and the u with a better sensor, while r moves. NaN (`null`) if r does not move.
    pub moving: f64,
    /// RMS change of u per tick over √2, while r has stood still for 50 ms and the load for 0.2 s. It is the standard
    /// deviation of white noise, without an offset that friction holds.
    pub at_rest: f64,
}

/// Computes the noise of u in a recorded run over a window, without ticks in saturation. `other` is the same controller
/// behind a better sensor. It receives the true states through `sensor` and the held u. `jumps_s` are the load jumps,
/// s.
pub fn noise(
    trace: &Trace,
    window_s: [f64; 2],
    jumps_s: &[f64],
    sensor: &mut dyn Sensor,
    other: &mut dyn ControllerPort,
) -> Noise {
    const AFTER_JUMP_S: f64 = 0.2;
    let inside: Range<f64> = window_s[0] - 0.5 * trace.period_s..window_s[1] + 0.5 * trace.period_s;
    let mut sums = [(0.0, 0_usize); 2];
    let (mut last, mut moved_s, mut before) = (f64::NAN, 0.0, f64::NAN);
    for row in &trace.rows {
        let mut sample = [0.0; MAX_ORDER];
        sensor.measure(&row.x[..trace.order], &mut sample[..trace.order]);
        let Ok(tick) = other.tick(&sample[..trace.order]) else { break };
        other.report_applied(row.u_held);
        if row.r != last {
            (last, moved_s) = (row.r, row.t_s);
        }
        let before = std::mem::replace(&mut before, row.u);
        // Ticks soon after the motion count neither as moving nor as at rest.
        let kind = match row.t_s - moved_s {
            still_s if still_s < 0.5 * trace.period_s => 0,
            still_s if still_s > STAYS_S => 1,
            _ => continue,
        };
        if jumps_s.iter().any(|jump_s| (0.0..AFTER_JUMP_S).contains(&(row.t_s - jump_s))) {
            continue;
        }
        let difference = if kind == 0 { row.u - tick.u } else { (row.u - before) * FRAC_1_SQRT_2 };
        if inside.contains(&row.t_s) && (row.health | tick.health).is_ok() {
            sums[kind] = (sums[kind].0 + difference * difference, sums[kind].1 + 1);
        }
    }
    let [moving, at_rest] = sums.map(|(sum, count)| (sum / count as f64).sqrt());
    Noise { moving, at_rest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use controller_core::Health;

    /// Returns a trace with y = 1, 0.5, 0.25, .. at T = 1 s, where u alternates between 1 and 3.
    fn trace(ticks: usize, ending: Ending) -> Trace {
        let row = |k: usize| {
            let mut row = Row {
                t_s: k as f64,
                x: [0.0; 6],
                r: 0.0,
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
        Trace { order: 2, observed: vec![0], follows: None, period_s: 1.0, rows: (0..ticks).map(row).collect(), ending }
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

    /// Returns a trace with r = 0 for three ticks and r = 2 from 3 s on, where y starts at 1.
    fn following() -> Trace {
        let mut trace = trace(21, Ending::Finished);
        trace.follows = Some(1);
        for (k, row) in trace.rows.iter_mut().enumerate() {
            row.r = if k < 3 { 0.0 } else { 2.0 };
            row.x[1] = 2.0 - 0.5_f64.powi(k as i32);
            row.health = if k < 7 { Health::SATURATED } else { Health::OK };
        }
        trace
    }

    #[test]
    fn a_reference_is_what_errors_are_taken_from() {
        let trace = following();
        let found = measure(&trace, [10.0, 20.0], 0.1);
        assert_eq!((found.y_ultimate, found.settling_time_s, found.bounded), (0.5_f64.powi(10), Some(4.0), true));
        let followed = track(&trace, [19.0, 20.0], 0.1);
        let rms = (0.5 * (0.25_f64.powi(19) + 0.25_f64.powi(20))).sqrt();
        assert_eq!((followed.error_rms, followed.arrival_s, followed.saturated_share), (rms, Some(4.0), 7.0 / 21.0));
        let mut moving = following();
        moving.rows[20].r = 2.1;
        assert_eq!(track(&moving, [10.0, 20.0], 0.1).arrival_s, None);
    }

    /// Controller whose output is its sample.
    struct Echo;

    impl ControllerPort for Echo {
        fn tick(&mut self, sample: &[f64]) -> Result<crate::port::Tick, crate::port::PortError> {
            let none = [[0.0; controller_core::MAX_R]; MAX_ORDER];
            Ok(crate::port::Tick { u: sample[1], sigma: 0.0, sigma_star: 0.0, estimates: none, health: Health::OK })
        }
        fn report_applied(&mut self, _: f64) {}
        fn reset(&mut self) -> Result<(), crate::port::PortError> {
            Ok(())
        }
        fn observed(&self) -> &[usize] {
            &[]
        }
    }

    #[test]
    fn noise_is_the_difference_from_a_better_sensor_apart_from_saturation() {
        let mut trace = following();
        for (k, row) in trace.rows.iter_mut().enumerate() {
            // r moves up to tick 12.
            row.r = row.r.max((k as f64 - 5.0).clamp(2.0, 7.0));
            row.u = row.x[1] + if k < 7 { 100.0 } else { [0.3, -0.4][k % 2] };
        }
        let found = noise(&trace, [5.0, 20.0], &[16.9], &mut crate::sensor::Ideal, &mut Echo);
        // Ticks 8 to 12 move, with -0.4 in the odd ones. Ticks 7, 13 and later stand still, except the jump before 17.
        assert!((found.moving - ((2.0 * 0.16 + 3.0 * 0.09) / 5.0_f64).sqrt()).abs() < 1e-12, "{found:?}");
        // u changes by 0.7 per tick, and y by less than 0.01. At tick 7 saturation has just ended.
        let steps = |k: usize| trace.rows[k].u - trace.rows[k - 1].u;
        let squares: f64 = [7, 13, 14, 15, 16, 18, 19, 20].into_iter().map(|k| steps(k) * steps(k)).sum();
        assert!((found.at_rest - (0.5 * squares / 8.0).sqrt()).abs() < 1e-12, "{found:?}");
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
        // y starts at 1.
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
