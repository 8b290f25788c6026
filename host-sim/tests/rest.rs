//! Figures of docs/evidence/tuning.md about rest, play and margin: drawn from runs and compared with the files there.
//!
//! `GOLDEN=write cargo test -p host-sim --test rest` draws them again.

use std::ops::ControlFlow;
use std::path::Path;

use host_sim::report::plot::{BLACK, Figure, GREY, Panel, Series, Style};
use loop_sim::trace::Trace;
use scenario::{Experiment, MOTOR, Source, parse};
use study::gain_sets::gain_sets;

fn built(sets: &[String]) -> Experiment {
    parse(&Source { file: "figure.toml", text: MOTOR, sets }, "figure").unwrap_or_else(|error| panic!("{error}"))
}

fn ran(sets: &[&str]) -> (Experiment, Trace) {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let mut experiment = built(&sets);
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None, "{sets:?}");
    (experiment, trace)
}

/// Compares the figure with its file in the docs; with `GOLDEN` it writes the file first.
fn held(figure: &Figure, stem: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../docs/figures/{stem}.svg"));
    let svg = figure.svg();
    if std::env::var_os("GOLDEN").is_some() {
        std::fs::write(&path, &svg).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(there == svg, "{} differs from the runs: GOLDEN=write cargo test -p host-sim --test rest", path.display());
}

/// Returns the figure of error (mrad) and current (A) of two drives on one plant. Ranges: time, error, current.
fn before_and_after(title: &str, [before, after]: [(&str, Trace); 2], ranges: [(f64, f64); 3], band: &str) -> Figure {
    let [span, error_range, current_range] = ranges;
    let rows = |trace: &Trace| trace.rows.iter().filter(|row| (span.0..=span.1).contains(&row.t_s)).copied().collect();
    let runs = [before, after].map(|(name, trace)| (name, rows(&trace)) as (&str, Vec<_>));
    let panels = runs.iter().enumerate().flat_map(|(k, (name, rows))| {
        let error = rows.iter().map(|row: &loop_sim::trace::Row| (row.t_s, 1e3 * (row.x[0] - row.r)));
        let current = rows.iter().map(|row| (row.t_s, row.u));
        let color = 1 - k;
        let panel = |title: String, y_label: &str, series: Series, y_range| Panel {
            title,
            x_label: "t (s)".into(),
            y_label: y_label.into(),
            series: vec![series],
            x_range: Some(span),
            y_range: Some(y_range),
            ..Panel::default()
        };
        [
            panel(format!("{name}: error"), "y − r (mrad)", Series::solid(band, color, error), error_range),
            panel(
                format!("{name}: current"),
                "u (A)",
                Series { is_held: true, ..Series::solid("", color, current) },
                current_range,
            ),
        ]
    });
    Figure { title: title.into(), panels: panels.collect(), columns: 2 }
}

const TO_REST: &str = "reference={kind=\"move\", to_rad=1.0, duration_s=0.5}";

#[test]
fn a_motor_hunts_in_friction_and_rests_in_its_band() {
    let run = |band: &str| {
        let band = format!("drive.rest_band=\"{band}\"");
        let friction = "friction={coulomb_n_m=0.02, static_n_m=0.03}";
        ran(&[TO_REST, friction, "load=[]", "span_s=3", &band]).1
    };
    let runs = [("without a rest band", run("off")), ("with a rest band (default)", run("learns"))];
    let figure = before_and_after(
        "At rest in friction: 14 bits, 10 A, friction 0.02 and 0.03 N m, after a move of 1 rad",
        runs,
        [(0.4, 3.0), (-2.5, 2.5), (-1.0, 1.0)],
        "",
    );
    held(&figure, "hunting");
}

#[test]
fn a_shaft_swings_in_play_and_is_held_by_lower_gains() {
    let run = |more: &[&str]| {
        let sheet = "motor={inertia_kg_m2=2e-8, torque_n_m_per_a=0.0045, max_current_a=0.7, gear=[288, 1], \
                     load_inertia_kg_m2=1e-4, current_lag_s=1e-3, play_rad=0.01}";
        let own = "drive={period_s=2e-3, surface_rad_s=40, gain_sets=2}";
        let encoder = "encoder={bits=12, behind_gear=true}";
        let to = "reference={kind=\"move\", to_rad=0.5, duration_s=0.3}";
        let friction = "friction={coulomb_n_m=0.0288, static_n_m=0.0432}";
        let all = [&[sheet, own, encoder, to, friction, "load=[]", "span_s=1.6"], more].concat();
        ran(&all).1
    };
    let runs = [("full gains", run(&["drive.rest_band=\"fixed\""])), ("lower gains (default)", run(&[]))];
    let figure = before_and_after(
        "Play of 0.01 rad behind a gear of 288, encoder on the load, 0.7 A, after a move of 0.5 rad",
        runs,
        [(0.3, 1.6), (-60.0, 60.0), (-0.8, 0.8)],
        "",
    );
    held(&figure, "play");
}

/// Four motors: name; J (kg m²), K_t (N m/A), largest current (A); encoder bits; period (s).
const MOTORS: [(&str, [f64; 3], u32, f64); 4] = [
    ("template, 14 bits, 1 kHz", [2e-4, 0.05, 10.0], 14, 1e-3),
    ("gimbal, 14 bits, 1 kHz", [2e-6, 0.03, 1.0], 14, 1e-3),
    ("servo, 20 bits, 8 kHz", [1e-2, 1.0, 15.0], 20, 1.25e-4),
    ("direct drive, 12 bits, 1 kHz", [5e-3, 0.5, 6.0], 12, 1e-3),
];

/// Returns the nominal peak of |S|, the largest peak in a corner with high gains, and the deflection under a load of 14
/// % of the torque (rad).
fn with_margin((_, [inertia, torque, limit], bits, period_s): (&str, [f64; 3], u32, f64), margin: f64) -> [f64; 3] {
    let (experiment, trace) = ran(&[
        &format!("motor={{inertia_kg_m2={inertia}, torque_n_m_per_a={torque}, max_current_a={limit}}}"),
        &format!("encoder.bits={bits}"),
        &format!("drive={{period_s={period_s}, margin={margin:?}}}"),
        "reference={kind=\"rest\"}",
        "friction={}",
        &format!("load=[{{kind=\"step\", amplitude={}, t0_s=0.05}}]", 0.14 * torque * limit),
        "span_s=0.4",
        "monitor.reaction=\"tell\"",
    ]);
    let drive = experiment.drive.as_ref().expect("a drive");
    let at_rest = experiment.at_rest.as_ref().unwrap_or_else(|error| panic!("{error}"));
    let sets = gain_sets(&drive.designed, at_rest).unwrap_or_else(|error| panic!("{error}"));
    let quiet = sets[0].margins.as_ref().map_or(f64::INFINITY, |margins| margins.sensitivity_peak);
    let worst = sets.last().and_then(|set| set.worst.as_ref()?.sensitivity_peak).unwrap_or(f64::INFINITY);
    let dip = trace.rows.iter().map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max);
    [quiet, worst, dip]
}

#[test]
fn margin_has_its_price() {
    let margins = [1.3, 1.35, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0, 2.1];
    let (mut dips, mut corners) = (Vec::new(), Vec::new());
    for (color, motor) in MOTORS.into_iter().enumerate() {
        let found = margins.map(|margin| with_margin(motor, margin));
        let reference = found[margins.len() - 1][2];
        let dotted = |points: Vec<(f64, f64)>| Series { has_dots: true, ..Series::solid(motor.0, color, points) };
        dips.push(dotted(found.map(|[peak, _, dip]| (peak, dip / reference)).to_vec()));
        corners.push(dotted(found.map(|[peak, worst, _]| (peak, worst)).to_vec()));
    }
    let usual = Series::solid("2, a usual limit", GREY, [(1.3, 2.0), (2.1, 2.0)]).styled(Style::Dashed);
    corners.push(usual);
    let one = Series::solid("", BLACK, [(1.3, 1.0), (2.1, 1.0)]).styled(Style::Dotted);
    dips.push(one);
    let panel = |title: &str, y_label: &str, series| Panel {
        title: title.into(),
        x_label: "peak |S|, base gains, nominal".into(),
        y_label: y_label.into(),
        series,
        ..Panel::default()
    };
    let figure = Figure {
        title: "Cost of the stability margin for a motor: drive.margin from 1.3 to 2.1".into(),
        panels: vec![
            panel("Deflection under a load of 14 % of the torque", "relative to peak |S| = 2.1", dips),
            panel("High gains, J and K_t off by ±20 %", "peak |S|, worst corner", corners),
        ],
        columns: 2,
    };
    held(&figure, "margin");
}
