//! Reproduction of the paper's figures; the controllers in them behave like their continuous originals.

use controller_core::Health;
use host_sim::figures::CATALOGUE;
use integration_tests::data::columns;
use integration_tests::golden::compare;
use integration_tests::program::{CommandResult, Folder, host_sim};
use loop_sim::trace::Trace;
use std::ops::ControlFlow;
use study::number::significant;
use terminal::table::Table;

#[test]
fn every_claim_that_held_still_holds_and_the_numbers_are_those_of_the_golden_table() {
    let folder = Folder::new("figures");
    let CommandResult { status, out, .. } = host_sim(&["figures", "--json", "--out", &folder.path("")]);
    let claims: Vec<serde_json::Value> = serde_json::from_str(&out).expect("an array of claims");
    let mut table = Table::new(["figure", "claim", "published", "reproduced", "range of what is open", "holds"]);
    for claim in &claims {
        let text = |key: &str| claim[key].as_str().unwrap_or("?").to_owned();
        // f32 rounding is amplified in a spread near zero, so only one digit is meaningful.
        let shown = |value: &serde_json::Value| {
            let value = value.as_f64().unwrap_or(f64::NAN);
            significant(value, if value.abs() < 1e-4 { 1 } else { 4 })
        };
        let range = claim["range"].as_array().map_or_else(String::new, |range| {
            let [least, most] = [0, 1].map(|end| shown(&range[end]));
            format!("{least} .. {most}")
        });
        let holds = claim["holds"].as_bool().map_or("open", |holds| if holds { "yes" } else { "no" });
        let reproduced = shown(&claim["reproduced"]);
        table.row([&*text("figure"), &text("claim"), &text("published"), &reproduced, &range, holds]);
    }
    for figure in CATALOGUE {
        for ending in ["svg", "png"] {
            let file = folder.path(&format!("{}.{ending}", figure.id));
            assert!(std::fs::metadata(&file).is_ok_and(|file| file.len() > 10_000), "{file}");
        }
    }
    compare("claims.txt", &table.to_string()).unwrap_or_else(|difference| panic!("{difference}"));
    assert_eq!(status, 0, "a claim that held no longer does");
}

/// Returns the largest |x1 - reference| over all rows of a file, by the trace's tick at that time.
fn distance(trace: &Trace, file: &str) -> f64 {
    let reference = columns(file, ["t", "x1"]);
    let gaps = reference.iter().map(|row| {
        let tick = (row[0] / trace.period_s).round() as usize;
        (trace.rows[tick].x[0] - row[1]).abs()
    });
    gaps.fold(0.0, f64::max)
}

/// The runs of Fig. 1 and 2 (T = 0.1 ms) against the continuous trajectories. The smooth controller is first order in
/// T: 1.2e-5 measured. The baseline chatters by k T = 3e-4 and 4e-4 in x_2; its reference has a boundary layer of 1e-3
/// instead. x_1 follows x_2 within that chatter: 2.5e-5 and 1.8e-4 measured.
#[test]
fn example_1_follows_the_continuous_trajectories_of_both_controllers() {
    let files = [
        [("ex1_p1_prop_r1_l10_kl10.csv", 2e-5), ("ex1_p1_base_l10_k3_bl1e-3.csv", 3e-4)],
        [("ex1_p2_prop_r2_l100_20_kl50.csv", 2e-5), ("ex1_p2_base_l10_k4_bl1e-3.csv", 4e-4)],
    ];
    for (figure, files) in CATALOGUE.iter().zip(files) {
        for ((label, mut experiment), (file, bar)) in figure.experiments().expect("a right file").into_iter().zip(files)
        {
            let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
            assert!(error.is_none());
            assert!(trace.rows.iter().all(|row| row.health == Health::OK), "{label}");
            let distance = distance(&trace, file);
            assert!(distance < bar, "{} {label}: {distance:.2e}", figure.id);
        }
    }
}
