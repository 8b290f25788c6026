//! Stability margin of four motors and its cost: the table of docs/evidence/tuning.md.

use std::ops::ControlFlow;

use integration_tests::golden;
use loop_sim::trace::Trace;
use scenario::{Experiment, MOTOR, Source, parse};
use study::gain_sets::{GainSet, gain_sets};

/// J, K_t, current limit, bits, period.
const MOTORS: [(&str, [f64; 3], u32, f64); 4] = [
    ("template, 14 bits", [2e-4, 0.05, 10.0], 14, 1e-3),
    ("gimbal, 2e-6 kg m², 14 bits", [2e-6, 0.03, 1.0], 14, 1e-3),
    ("direct drive, 5e-3 kg m², 12 bits", [5e-3, 0.5, 6.0], 12, 1e-3),
    ("servo, 1e-2 kg m², 20 bits, 8 kHz", [1e-2, 1.0, 15.0], 20, 1.25e-4),
];

/// Runs the template with these settings to its end.
pub(crate) fn run(sets: &[String]) -> (Experiment, Trace) {
    let source = Source { file: "margin.toml", text: MOTOR, sets };
    let mut experiment = parse(&source, "margin").unwrap_or_else(|error| panic!("{error}"));
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert_eq!(error, None, "{sets:?}");
    (experiment, trace)
}

/// Returns the largest error, rad, under a load of 14 % of the torque, over J and K_t off by ±`percent`.
fn dip(sheet: &[String], torque_n_m: f64, percent: f64) -> f64 {
    let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let dips = corners[..if percent > 0.0 { 4 } else { 1 }].iter().map(|[inertia, torque]| {
        let more = [
            "reference={kind=\"rest\"}".to_owned(),
            "span_s=0.5".into(),
            format!("load=[{{kind=\"step\", amplitude={}, t0_s=0.05}}]", 0.14 * torque_n_m),
            format!("error={{inertia_percent={}, torque_percent={}}}", inertia * percent, torque * percent),
        ];
        peak(&run(&[sheet, &more].concat()).1)
    });
    dips.fold(0.0, f64::max)
}

fn peak(trace: &Trace) -> f64 {
    trace.rows.iter().map(|row| (row.x[0] - row.r).abs()).fold(0.0, f64::max)
}

/// Returns the peaks of |S| of a gain set: for the data sheet, and in its worst corner.
fn peaks(set: &GainSet) -> String {
    let of = |peak: Option<f64>| peak.map_or_else(|| "unstable".into(), |peak| format!("{peak:.2}"));
    let worst = set.worst.as_ref().and_then(|worst| worst.sensitivity_peak);
    format!("{}, {}", of(set.margins.as_ref().map(|margins| margins.sensitivity_peak)), of(worst))
}

#[test]
fn margin_is_paid_for_in_stiffness() {
    let mut table = vec![String::from(
        "| motor | `margin` | \\|S\\| base gains, ±20 % | high gains, ±20 % | current noise, % | move of 1 rad, peak \
         error, mrad | load of 14 %: way, mrad | ±20 % | ±50 % |\n|---|---|---|---|---:|---:|---:|---:|---:|\n",
    )];
    for (name, [inertia, torque, limit], bits, period_s) in MOTORS {
        let mut dips = Vec::new();
        for margin in ["fast", "standard"] {
            let sheet = [
                format!("motor={{inertia_kg_m2={inertia}, torque_n_m_per_a={torque}, max_current_a={limit}}}"),
                format!("encoder.bits={bits}"),
                format!("drive={{period_s={period_s}, margin={margin:?}}}"),
                "friction={}".into(),
                "monitor.reaction=\"tell\"".into(),
            ];
            // Duration of the move at 60 % of the torque.
            let duration_s = (10.0 / 3_f64.sqrt() * inertia / (0.6 * torque * limit)).sqrt();
            let way = [
                format!("reference={{kind=\"move\", to_rad=1.0, start_s=0.02, duration_s={duration_s}}}"),
                format!("span_s={}", duration_s + 0.3),
                "error.inertia_percent=20".into(),
            ];
            let (experiment, moved) = run(&[&sheet[..], &way].concat());
            let at_rest = experiment.at_rest.as_ref().unwrap_or_else(|error| panic!("{error}"));
            let designed = &experiment.drive.as_ref().expect("a drive").designed;
            let sets = gain_sets(designed, at_rest).unwrap_or_else(|error| panic!("{error}"));
            let noise = study::design(&experiment).ok().and_then(|design| design.noise()).expect("a stable loop");
            let [way, way_20, way_50] = [0.0, 20.0, 50.0].map(|percent| dip(&sheet, torque * limit, percent));
            let row = format!(
                "| {name} | {margin} | {} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |\n",
                peaks(&sets[0]),
                peaks(&sets[1]),
                100.0 * noise / limit,
                1e3 * peak(&moved),
                1e3 * way,
                1e3 * way_20,
                1e3 * way_50
            );
            table.push(row);
            dips.push(way);
        }
        let price = dips[1] / dips[0];
        assert!((0.9..2.2).contains(&price), "{name}: the standard margin costs {price} times the way under a load");
    }
    golden::in_docs("evidence/tuning.md", "margin", &table.concat()).unwrap_or_else(|differs| panic!("{differs}"));
}
