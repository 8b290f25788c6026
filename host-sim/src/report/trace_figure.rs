//! Standard figures of a run without a reference, for any chain plant.
//!
//! | file | shows |
//! |---|---|
//! | `response` | output y = x₁, sliding variable σ*, control u: the whole run and its second half |
//! | `states` | every state (with `--states`) |
//! | `estimates` | lumped disturbance dᵢ of each observed channel, its estimate, and the error d̃ᵢ = dᵢ − d̂ᵢ |
//!
//! Time in saturation is tinted. A start transient may be a hundred times larger than the rest of the run. Therefore
//! the second half has its own scale, and the estimation error is drawn over the range of the second half. The head of
//! this panel shows the peak of the transient.
//!
//! Units follow from the unit U of the output and from the unit of the control. In a chain of integrators dᵢ is in
//! U/sⁱ. σ* is in U/sⁿ⁻¹, because its last coefficient is 1 (Eq. (39), (44)).

use controller_core::Health;
use loop_sim::MAX_ORDER;
use loop_sim::trace::{Row, Trace};
use scenario::StateName;

use crate::report::plot::{BLACK, Figure, GREY, Panel, Series, Shade, Style};

/// Ratio of transient to settled range above which an error is plotted over its settled range only.
const TRANSIENT: f64 = 5.0;

const SUBSCRIPTS: [&str; MAX_ORDER] = ["₁", "₂", "₃", "₄", "₅", "₆"];
const SUPERSCRIPTS: [&str; MAX_ORDER] = ["", "²", "³", "⁴", "⁵", "⁶"];

/// Texts of the figures of a trace: title, units and names of states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Labels<'a> {
    /// Title of every figure.
    pub title: &'a str,
    /// Unit U of the output, as `rad`; empty if unknown.
    pub output_unit: &'a str,
    /// Unit of the control; empty if unknown.
    pub control_unit: &'a str,
    /// Names and units of the states; empty without names.
    pub states: &'a [StateName],
}

/// Returns the figures with the stems of their files. Without an observer there is no `estimates`.
#[must_use]
pub fn run_figures(trace: &Trace, labels: &Labels<'_>) -> Vec<(String, Figure)> {
    let mut figures = vec![("response".to_owned(), response(trace, labels))];
    if trace.observed.iter().any(|&i| i < MAX_ORDER) {
        figures.push(("estimates".to_owned(), estimates(trace, labels)));
    }
    figures
}

fn response(trace: &Trace, labels: &Labels<'_>) -> Figure {
    let rate = trace.order.saturating_sub(1);
    let mut control = vec![held(line(trace, "u held", 0, |row| row.u_held))];
    if trace.rows.iter().any(|row| row.u != row.u_held) {
        control.push(held(line(trace, "u demanded", GREY, |row| row.u).styled(Style::Dashed)));
    }
    let whole = [
        Panel {
            title: "Output".into(),
            y_label: quantity("y", labels.output_unit),
            series: vec![line(trace, "y = x₁", 0, |row| row.x[0])],
            ..panel()
        },
        Panel {
            title: "Sliding variable".into(),
            y_label: quantity("σ*", &per_second(labels.output_unit, rate)),
            series: vec![line(trace, "σ*", 0, |row| row.sigma_star)],
            ..panel()
        },
        Panel {
            title: "Control".into(),
            y_label: quantity("u", labels.control_unit),
            series: control,
            shade: saturation(trace),
            ..panel()
        },
    ];
    let end_s = trace.rows.last().map_or(0.0, |row| row.t_s);
    let second_half = |panel: &Panel| Panel {
        title: format!("{}, second half", panel.title),
        x_range: Some((0.5 * end_s, end_s)),
        ..panel.clone()
    };
    let panels = whole.iter().flat_map(|panel| [panel.clone(), second_half(panel)]).collect();
    Figure { title: labels.title.into(), panels, columns: 2 }
}

/// Returns the figure of every state over the whole run, in two columns.
#[must_use]
pub fn states(trace: &Trace, labels: &Labels<'_>) -> Figure {
    let state = |i: usize| {
        let x = format!("x{}", SUBSCRIPTS[i]);
        let (title, y_label) = match labels.states.get(i) {
            Some((name, unit)) => (format!("State {}: {name}", i + 1), quantity(name, unit)),
            None => (format!("State {}", i + 1), x.clone()),
        };
        Panel { title, y_label, series: vec![line(trace, &x, 0, |row| row.x[i])], ..panel() }
    };
    let panels: Vec<Panel> = (0..trace.order.min(MAX_ORDER)).map(state).collect();
    Figure { title: labels.title.into(), panels, columns: 2 }
}

fn estimates(trace: &Trace, labels: &Labels<'_>) -> Figure {
    let mut panels = vec![];
    for &i in trace.observed.iter().filter(|&&i| i < MAX_ORDER) {
        let index = SUBSCRIPTS[i];
        let unit = per_second(labels.output_unit, i + 1);
        let error = |row: &Row| row.d[i] - row.d_hat[i];
        panels.push(Panel {
            title: format!("Disturbance of channel {}", i + 1),
            y_label: quantity(&format!("d{index}"), &unit),
            series: vec![
                line(trace, &format!("true d{index}"), BLACK, |row| row.d[i]),
                line(trace, &format!("estimate d\u{302}{index}"), 1, |row| row.d_hat[i]).styled(Style::Dashed),
            ],
            ..panel()
        });
        panels.push(Panel {
            title: "Estimation error".into(),
            y_label: quantity(&format!("d\u{303}{index}"), &unit),
            series: vec![line(trace, &format!("d\u{303}{index} = d{index} \u{2212} d\u{302}{index}"), 0, error)],
            y_range: settled_range(trace, error),
            ..panel()
        });
    }
    // One channel is drawn as a column, several channels as one row each.
    let columns = if panels.len() > 2 { 2 } else { 1 };
    Figure { title: labels.title.into(), panels, columns }
}

/// Returns the line as steps: each value holds until the next point.
pub(super) fn held(line: Series) -> Series {
    Series { is_held: true, ..line }
}

pub(super) fn panel() -> Panel {
    Panel { x_label: "t (s)".into(), ..Panel::default() }
}

pub(super) fn line(trace: &Trace, label: &str, color: usize, value: impl Fn(&Row) -> f64) -> Series {
    Series::solid(label, color, trace.rows.iter().map(|row| (row.t_s, value(row))))
}

pub(super) fn quantity(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }
}

/// Returns the unit per second to a power, as `rad/s²`.
fn per_second(unit: &str, power: usize) -> String {
    match (unit, power) {
        ("", _) | (_, 0) => unit.to_owned(),
        _ => format!("{unit}/s{}", SUPERSCRIPTS[(power - 1).min(MAX_ORDER - 1)]),
    }
}

/// Returns the intervals of saturation, if any.
pub(super) fn saturation(trace: &Trace) -> Option<Shade> {
    let saturated = |row: &Row| row.health.contains(Health::SATURATED);
    let intervals: Vec<(f64, f64)> = trace
        .rows
        .chunk_by(|a, b| saturated(a) == saturated(b))
        .filter(|chunk| chunk.first().is_some_and(saturated))
        .filter_map(|chunk| Some((chunk.first()?.t_s, chunk.last()?.t_s + trace.period_s)))
        .collect();
    (!intervals.is_empty()).then(|| Shade { label: "saturated".into(), intervals })
}

/// Returns the range of the second half of the run, if the first half exceeded it by far.
fn settled_range(trace: &Trace, value: impl Fn(&Row) -> f64) -> Option<(f64, f64)> {
    let (before, after) = trace.rows.split_at(trace.rows.len() / 2);
    let finite = |rows: &[Row]| rows.iter().map(&value).filter(|v| v.is_finite()).collect::<Vec<_>>();
    let peak = |values: &[f64]| values.iter().fold(0.0, |peak: f64, v| peak.max(v.abs()));
    let settled = finite(after);
    if peak(&finite(before)) <= TRANSIENT * peak(&settled) {
        return None;
    }
    let lo = settled.iter().copied().fold(f64::INFINITY, f64::min);
    let hi = settled.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Half the span on both sides keeps the end of the transient visible.
    let space = 0.5 * (hi - lo);
    (lo < hi).then_some((lo - space, hi + space))
}

#[cfg(test)]
mod tests {
    use super::*;
    use loop_sim::trace::Ending;

    /// Run of 20 s. The control starts at 279, is limited to 200, and settles at a sine of amplitude 4.
    fn trace() -> Trace {
        let row = |k: i32| {
            let t_s = f64::from(k) * 1e-3;
            let wave = libm::sin(2.0 * t_s);
            let fade = libm::exp(-3.0 * t_s);
            let u = 279.0 * fade * libm::cos(20.0 * t_s) + 4.0 * wave;
            let mut row = Row {
                t_s,
                x: [0.0; MAX_ORDER],
                r: 0.0,
                u,
                u_held: u.clamp(-200.0, 200.0),
                sigma: fade + 0.17 * wave,
                sigma_star: 0.17 * wave,
                d: [0.0; MAX_ORDER],
                d_hat: [0.0; MAX_ORDER],
                health: if u.abs() > 200.0 { Health::SATURATED } else { Health::OK },
            };
            row.x[0] = 0.1 * fade + 0.002 * wave;
            (row.d[1], row.d[3]) = (-3.9 * fade + 0.08 * wave, 1.0 + wave);
            row.d_hat[1] = row.d[1] + 3.9 * fade * fade + 0.008 * wave;
            row.d_hat[3] = row.d[3] * 0.98 - 2.0 * libm::exp(-12.0 * t_s);
            row
        };
        let rows = (0..=20_000).map(row).collect();
        Trace { order: 4, observed: vec![1, 3], follows: None, period_s: 1e-3, rows, ending: Ending::Finished }
    }

    const JOINT: Labels<'_> = Labels { title: "Flexible joint", output_unit: "rad", control_unit: "A", states: &[] };

    #[test]
    fn a_run_has_a_response_and_a_row_of_panels_per_observed_channel() {
        let figures = run_figures(&trace(), &JOINT);
        let stems: Vec<&str> = figures.iter().map(|(stem, _)| stem.as_str()).collect();
        assert_eq!(stems, ["response", "estimates"]);
        let labels = |k: usize| figures[k].1.panels.iter().map(|panel| panel.y_label.as_str()).collect::<Vec<_>>();
        assert_eq!(labels(0), ["y (rad)", "y (rad)", "σ* (rad/s³)", "σ* (rad/s³)", "u (A)", "u (A)"]);
        assert_eq!(labels(1), ["d₂ (rad/s²)", "d\u{303}₂ (rad/s²)", "d₄ (rad/s⁴)", "d\u{303}₄ (rad/s⁴)"]);
        assert_eq!(figures[1].1.columns, 2);
    }

    #[test]
    fn the_control_is_held_between_ticks_and_nothing_else_is() {
        for (_, figure) in run_figures(&trace(), &JOINT) {
            for panel in figure.panels {
                assert!(panel.series.iter().all(|line| line.is_held == panel.y_label.starts_with('u')), "{panel:?}");
            }
        }
    }

    #[test]
    fn unknown_units_are_left_out() {
        let figures = run_figures(&trace(), &Labels::default());
        assert_eq!(figures[0].1.panels[2].y_label, "σ*");
        assert_eq!(figures[1].1.panels[0].y_label, "d₂");
    }

    #[test]
    fn saturation_is_tinted_from_its_first_tick_to_the_end_of_its_last() {
        let mut trace = trace();
        for row in &mut trace.rows {
            row.health = Health::OK;
        }
        assert_eq!(saturation(&trace), None);
        for k in [10, 11, 20_000] {
            trace.rows[k].health = Health::SATURATED | Health::INPUT_REJECTED;
        }
        let intervals = saturation(&trace).unwrap().intervals;
        let expected = [(trace.rows[10].t_s, trace.rows[11].t_s + 1e-3), (20.0, 20.0 + 1e-3)];
        assert_eq!(intervals, expected);
    }

    #[test]
    fn only_a_large_transient_is_cut_off() {
        let mut trace = trace();
        let (lo, hi) = settled_range(&trace, |row| row.u_held).unwrap();
        // A sine of amplitude 4, with half its span on both sides.
        assert!((lo + 8.0).abs() < 1e-3 && (hi - 8.0).abs() < 1e-3, "{lo} {hi}");
        for row in &mut trace.rows {
            row.u_held = libm::sin(row.t_s);
        }
        assert_eq!(settled_range(&trace, |row| row.u_held), None);
    }

    #[test]
    fn the_second_half_of_a_response_has_its_own_scale() {
        let (_, figure) = &run_figures(&trace(), &JOINT)[0];
        let ranges: Vec<_> = figure.panels.iter().map(|panel| panel.x_range).collect();
        let half = Some((10.0, 20.0));
        assert_eq!(ranges, [None, half, None, half, None, half]);
        assert!(figure.panels.iter().all(|panel| panel.y_range.is_none()));
    }

    #[test]
    fn short_broken_and_unobserved_runs_still_draw() {
        let whole = trace();
        let mut short = Trace { rows: vec![], observed: vec![], ..whole.clone() };
        assert_eq!(run_figures(&short, &JOINT).len(), 1);
        short.observed = vec![5];
        for rows in [vec![], vec![whole.rows[0]], vec![Row { u: f64::NAN, u_held: f64::INFINITY, ..whole.rows[0] }; 2]]
        {
            short.rows = rows;
            for (_, figure) in run_figures(&short, &JOINT) {
                assert!(figure.png().is_ok());
            }
        }
    }
}
