//! Standard figures of a run with a reference.
//!
//! | file | shows |
//! |---|---|
//! | `response` | output y and reference r, error y - r, current: the whole run and a part of it |
//! | `load` | true load torque of each shaft (load, friction, data sheet errors) and its estimate |
//!
//! The part contains the motion of the reference and half its duration after it. If the reference moves most of the
//! time, the part is the last quarter of the run. Time in saturation is tinted. Current limits are drawn if the current
//! comes near them.

use loop_sim::trace::{Row, Trace};
use scenario::Drive;
use study::number::typed;

use super::plot::{BLACK, Figure, GREY, Panel, Style};
use super::trace_figure::{Labels, held, line, panel, quantity, saturation};

/// Share of the limits above which they are drawn; with a smaller current they would compress its curve.
const NEAR: f64 = 0.4;

/// Returns the figures with the stems of their files.
#[must_use]
pub fn drive_figures(trace: &Trace, drive: &Drive, labels: &Labels<'_>) -> Vec<(String, Figure)> {
    vec![("response".to_owned(), response(trace, drive, labels)), ("load".to_owned(), load(trace, drive, labels))]
}

fn response(trace: &Trace, drive: &Drive, labels: &Labels<'_>) -> Figure {
    let output = trace.follows.unwrap_or(0);
    let limit_a = drive.max_current_a;
    let mut current = vec![held(line(trace, "u held", 0, |row| row.u_held))];
    if trace.rows.iter().any(|row| row.u_held.abs() > NEAR * limit_a) {
        let limits = [("limits", limit_a), ("", -limit_a)];
        current.extend(limits.map(|(label, u)| line(trace, label, GREY, |_| u).styled(Style::Dashed)));
    }
    let whole = [
        Panel {
            title: "Output and reference".into(),
            y_label: quantity("y", labels.output_unit),
            series: vec![
                line(trace, "y", 0, |row| row.x[output]),
                line(trace, "r", BLACK, |row| row.r).styled(Style::Dashed),
            ],
            ..panel()
        },
        Panel {
            title: "Error".into(),
            y_label: quantity("y − r", labels.output_unit),
            series: vec![line(trace, "", 1, |row| trace.error(row))],
            ..panel()
        },
        Panel {
            title: format!("Current, limits ±{} A", typed(limit_a, 6)),
            y_label: quantity("u", labels.control_unit),
            series: current,
            shade: saturation(trace),
            ..panel()
        },
    ];
    let (what, range) = part(trace);
    let magnified =
        |panel: &Panel| Panel { title: format!("{}, {what}", panel.title), x_range: Some(range), ..panel.clone() };
    let panels = whole.iter().flat_map(|panel| [panel.clone(), magnified(panel)]).collect();
    Figure { title: labels.title.into(), panels, columns: 2 }
}

/// Returns the name and time range of the magnified part of the run.
fn part(trace: &Trace) -> (&'static str, (f64, f64)) {
    let time = |row: Option<&Row>| row.map_or(0.0, |row| row.t_s);
    let (begin_s, end_s) = (time(trace.rows.first()), time(trace.rows.last()));
    let moves = |pair: &&[Row]| pair[0].r != pair[1].r;
    let mut moving = trace.rows.windows(2).filter(moves).map(|pair| pair[0].t_s);
    if let Some(from_s) = moving.next() {
        let to_s = moving.next_back().unwrap_or(from_s) + trace.period_s;
        let last = to_s - from_s;
        if last < 0.4 * (end_s - begin_s) {
            let edges = (from_s - 0.2 * last).max(begin_s)..(to_s + 0.5 * last).min(end_s);
            return ("during the motion", (edges.start, edges.end));
        }
    }
    ("last quarter", (end_s - 0.25 * (end_s - begin_s), end_s))
}

fn load(trace: &Trace, drive: &Drive, labels: &Labels<'_>) -> Figure {
    let panels = drive.shafts.iter().map(|shaft| {
        let (i, inertia) = (shaft.channel, shaft.inertia_kg_m2);
        Panel {
            title: format!("Load torque on the {}", shaft.name),
            y_label: quantity("torque", "N m"),
            series: vec![
                line(trace, "true", BLACK, |row| -inertia * row.d[i]),
                line(trace, "estimate", 1, |row| -inertia * row.d_hat[i]).styled(Style::Dashed),
            ],
            ..panel()
        }
    });
    Figure { title: labels.title.into(), panels: panels.collect(), columns: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use loop_sim::trace::Ending;
    use scenario::{MOTOR, Source, parse};
    use std::ops::ControlFlow;

    fn ran(sets: &[&str]) -> (Trace, Drive) {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let source = Source { file: "motor.toml", text: MOTOR, sets: &sets };
        let mut experiment = parse(&source, "motor").unwrap_or_else(|error| panic!("{error}"));
        let (trace, _) = experiment.run(&mut |_| ControlFlow::Continue(()));
        (trace, experiment.drive.expect("a drive"))
    }

    const LABELS: Labels<'_> = Labels { title: "Motor", output_unit: "rad", control_unit: "A", states: &[] };

    #[test]
    fn the_current_goes_in_steps_and_limits_are_drawn_where_it_comes_near() {
        let (trace, drive) = ran(&["reference={kind = \"move\", to_rad = 1, start_s = 0.5}"]);
        let figures = drive_figures(&trace, &drive, &LABELS);
        let panels = &figures[0].1.panels;
        let units: Vec<&str> = panels.iter().map(|panel| panel.y_label.as_str()).collect();
        assert_eq!(units, ["y (rad)", "y (rad)", "y − r (rad)", "y − r (rad)", "u (A)", "u (A)"]);
        let current = &panels[4].series;
        assert!(current[0].is_held && current.len() == 3, "{:?}", panels[4].title);
        assert!(
            current[1].points.iter().all(|(_, u)| *u == 10.0) && current[2].points.iter().all(|(_, u)| *u == -10.0)
        );
        // The move, and half its duration after it.
        let (from, to) = panels[1].x_range.expect("a part");
        assert!(from > 0.48 && from < 0.5 && to > 0.55 && to < 0.65, "{from} {to}");
        let (trace, drive) = ran(&[]);
        let panels = &drive_figures(&trace, &drive, &LABELS)[0].1.panels;
        assert_eq!((panels[4].series.len(), panels[5].x_range), (1, Some((1.5, 2.0))));
    }

    #[test]
    fn the_torque_is_that_of_the_data_sheet_s_inertia() {
        let (trace, drive) = ran(&["load=[{kind = \"const\", amplitude = 0.1}]", "friction={}"]);
        let figure = &drive_figures(&trace, &drive, &LABELS)[1].1;
        let [truth, estimate] = &figure.panels[0].series[..] else { panic!("two curves") };
        assert!(truth.points.iter().all(|(_, torque)| (torque - 0.1).abs() < 1e-9));
        let last = estimate.points.last().expect("points").1;
        assert!((last - 0.1).abs() < 0.01, "{last}");
    }

    #[test]
    fn short_and_broken_runs_still_draw() {
        let (whole, drive) = ran(&[]);
        for rows in [vec![], vec![whole.rows[0]], vec![Row { u: f64::NAN, r: f64::NAN, ..whole.rows[0] }; 3]] {
            let short = Trace { rows, ending: Ending::Interrupted { t_s: 0.0 }, ..whole.clone() };
            for (_, figure) in drive_figures(&short, &drive, &LABELS) {
                assert!(figure.png().is_ok());
            }
        }
    }
}
