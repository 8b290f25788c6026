//! What is said of the run of a drive.

use controller_core::drive::ALARMS;
use cycle_bound::table::Table;
use loop_sim::metrics::{self, Metrics, Noise, Tracking};
use loop_sim::trace::{Ending, Trace};
use scenario::{Drive, Experiment};

use super::how_it_went;
use crate::report::number::significant;

pub(super) fn table(
    experiment: &Experiment,
    drive: &Drive,
    metrics: &Metrics,
    tracking: &Tracking,
    noise: Option<&Noise>,
    trace: &Trace,
) -> Table {
    let [from, to] = metrics.window_s.map(|t_s| significant(t_s, 4));
    // Nothing is said of a window that the run did not go through.
    let spoken = !metrics.y_ultimate.is_nan();
    let over = |what: &str| {
        if spoken { format!("{what} over [{from}, {to}] s") } else { format!("the run ended before {to} s") }
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
    if let Some(arrival_s) = tracking.arrival_s {
        let after =
            format!("within {band} {unit} of the goal, after the start at {} s", significant(drive.begins_s, 4));
        row("arrival (s)", number((arrival_s - drive.begins_s).max(0.0)), &after);
    }
    if let Some(Noise { moving, at_rest }) = noise {
        for (name, value) in
            [("r moving", *moving), ("r at rest", *at_rest)].into_iter().filter(|(_, value)| !value.is_nan())
        {
            row(&format!("noise of u, {name} (A rms)"), number(value), &over("of the encoder's steps,"));
        }
    }
    for shaft in &drive.shafts {
        let i = shaft.channel;
        let error = metrics::rms(trace, metrics.window_s, |row| shaft.inertia_kg_m2 * (row.d[i] - row.d_hat[i]));
        let name = format!("torque on the {}, error of its estimate (N m rms)", shaft.name);
        row(&name, number(error), &over("load and friction,"));
    }
    row("|u| peak (A)", number(metrics.u_peak), &format!("of {} A, over the whole run", drive.max_current_a));
    let share = format!("{} %", significant(100.0 * tracking.saturated_share, 3));
    row("saturated", share, "of all ticks");
    if let Some(alarm) = trace.rows.iter().find(|row| row.health.intersects(ALARMS)) {
        row("first alarm (s)", number(alarm.t_s), &alarm.health.to_string());
    }
    how_it_went(experiment, metrics, trace, &mut row);
    table
}
