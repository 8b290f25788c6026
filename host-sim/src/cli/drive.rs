//! The metrics table of a drive.

use controller_core::Health;
use controller_core::drive::{ALARMS, FENCED};
use loop_sim::metrics::{Metrics, Noise, Tracking};
use loop_sim::port::drive::Goal;
use loop_sim::trace::{Ending, Trace};
use scenario::{Drive, Experiment};
use study::figures::{TorqueError, torque_errors};
use study::number::{significant, typed};
use terminal::table::Table;

use super::run::how_it_went;

/// Returns the metrics table of a drive. `of_loop_a` is the current noise of the linearised loop, A rms.
pub(super) fn table(
    experiment: &Experiment,
    drive: &Drive,
    metrics: &Metrics,
    tracking: &Tracking,
    noise: Option<&Noise>,
    of_loop_a: Option<f64>,
    trace: &Trace,
) -> Table {
    let [from, to] = metrics.window_s.map(|t_s| significant(t_s, 4));
    // A run that ended before the window has no metric of it.
    let spoken = !metrics.y_ultimate.is_nan();
    let over = |metric: &str| {
        if spoken { format!("{metric} over [{from}, {to}] s") } else { format!("the run ended before {to} s") }
    };
    let mut table = Table::new(["metric", "value", "meaning"]);
    let mut row = |name: &str, value: String, meaning: &str| table.row([name, &value, meaning]);
    let number = |value: f64| if value.is_nan() { "-".into() } else { significant(value, 3) };
    let unit = experiment.output_unit;
    let band = significant(experiment.settling_band, 3);
    row(&format!("|y - r| peak ({unit})"), number(metrics.y_ultimate), &over("largest"));
    row(&format!("y - r rms ({unit})"), number(tracking.error_rms), &over("root mean square"));
    let unsettled = if trace.ending == Ending::Finished { "never" } else { "-" };
    let settled = metrics.settling_time_s.map_or_else(|| unsettled.into(), number);
    row("settling time (s)", settled, &format!("|y - r| within {band} {unit} from then on"));
    if let Goal::Rest { .. } = drive.motion.goal
        && drive.motion.ticks > 1
    {
        let taken_s = f64::from(drive.motion.ticks) * experiment.period_s;
        row("duration of the move (s)", typed(taken_s, 6), "of the reference, from rest to rest");
    }
    if let Some(arrival_s) = tracking.arrival_s {
        let after = number((arrival_s - drive.begins_s).max(0.0));
        let after = format!("within {band} {unit} of the goal, {after} s after it began");
        row("arrival (s)", number(arrival_s), &after);
    }
    if let Some(Noise { moving, at_rest }) = noise {
        let sensed = experiment.at_rest.iter().flat_map(|at_rest| &at_rest.sensed);
        let of = if sensed.into_iter().any(|it| it.noise > 0.0) { "quantisation and noise" } else { "quantisation" };
        // With the finest encoders there are no finer ones to compare with: the noise follows from the matrices.
        if let (true, Some(of_loop_a)) = (moving.is_nan(), of_loop_a) {
            let meaning = format!("from encoder {of}, computed for the linearised loop at rest");
            row("current noise (A rms)", number(of_loop_a), &meaning);
        }
        for (name, value) in
            [("r moving", *moving), ("r at rest", *at_rest)].into_iter().filter(|(_, value)| !value.is_nan())
        {
            row(
                &format!("current noise, {name} (A rms)"),
                number(value),
                &over(&format!("simulated, from encoder {of},")),
            );
        }
    }
    for TorqueError { shaft, rms_n_m } in torque_errors(drive, metrics, trace) {
        let name = format!("load estimate error, {shaft} (N m rms)");
        row(&name, number(rms_n_m), &over("load and friction torque,"));
    }
    row("|u| peak (A)", number(metrics.u_peak), &format!("of {} A, over the whole run", typed(drive.max_current_a, 6)));
    let share = format!("{} %", significant(100.0 * tracking.saturated_share, 3));
    row("saturated", share, "of all ticks");
    if let Some((tick, t_s, alarms)) = first_alarm(trace) {
        row("first alarm (s)", typed(t_s, 6), &format!("tick {tick}: {alarms}"));
    }
    if let Some(hunting) = trace.rows.iter().find(|row| row.health.contains(Health::HUNTS)) {
        let remedy = "limit cycle or stick-slip at rest: widen drive.rest_band or lower the gains";
        row("hunting from (s)", typed(hunting.t_s, 6), remedy);
    }
    how_it_went(experiment, metrics, trace, &mut row);
    table
}

/// Returns tick, time and flags of the first alarm of a run.
pub(super) fn first_alarm(trace: &Trace) -> Option<(usize, f64, Health)> {
    let every = ALARMS | FENCED;
    let (tick, row) = trace.rows.iter().enumerate().find(|(_, row)| row.health.intersects(every))?;
    Some((tick, row.t_s, Health::from_bits(row.health.bits() & every.bits())))
}
