//! Results of Example 2, and of every scenario file, as tables to read. They indicate a change; the thresholds are in
//! the other modules.

use controller_core::{JointParameters, Reading};
use integration_tests::data::{SCENARIOS, path, scenario_file};
use integration_tests::golden::{REGENERATE, compare};
use integration_tests::oracle::Spec;
use integration_tests::paper::{joint, joint_spec};
use loop_sim::metrics::{Metrics, measure};
use loop_sim::plant::FlexibleJoint;
use loop_sim::port::in_process::Precision;
use scenario::load;
use std::fmt::Write;
use std::ops::ControlFlow;

fn table() -> String {
    let mut table = String::from(
        "Example 2, 20 s, T = 1 ms, gains printed for r = 2, f32 controller; ultimate over [10, 20] s\n\
         reading           k_l    k_s   sigma*     y          d~2        d~4        peak u    TV u /s   \
         |y| <= 0.01 after s\n",
    );
    for reading in [Reading::Reconstructed, Reading::Stiff, Reading::Physical] {
        let plant = FlexibleJoint::of_the_paper(JointParameters::TABLE_I.chain(reading));
        for (k_l, k_s) in [(10.0, 0.0), (50.0, 0.0), (100.0, 0.0), (10.0, 1.0)] {
            let spec = Spec { k_s, ..joint_spec(reading, k_l) };
            let found = measure(&joint(&plant, spec, Precision::F32).trace(), [10.0, 20.0], 0.01);
            let [d_2, d_4] = [0, 1].map(|slot| found.estimation_error_ultimate[slot].error);
            let settled = found.settling_time_s.map_or_else(|| "never".into(), |t_s| format!("{t_s:.3}"));
            let (reading, peak) = (format!("{reading:?}"), found.u_peak);
            let (sigma_star, y, tv) = (found.sigma_star_ultimate, found.y_ultimate, found.u_total_variation_per_s);
            writeln!(
                table,
                "{reading:14}{k_l:7} {k_s:6}   {sigma_star:.3e}  {y:.3e}  {d_2:.3e}  {d_4:.3e}  {peak:8.2}  {tv:9.2}   \
                 {settled}"
            )
            .expect("a string takes all");
        }
    }
    table
}

#[test]
fn metrics_of_the_flexible_joint_are_those_of_the_golden_table() {
    compare("flexible_joint.txt", &table()).unwrap_or_else(|difference| panic!("{difference}"));
}

#[test]
fn difference_shows_both_tables_and_how_to_regenerate() {
    if std::env::var_os(REGENERATE).is_some() {
        return;
    }
    let told = compare("no_such_table.txt", "k_l  sigma*\n10   0.17\n").expect_err("there is no such table");
    for part in ["no_such_table.txt", "10   0.17", "cannot be read", "GOLDEN=write cargo test"] {
        assert!(told.contains(part), "{part} in {told}");
    }
}

/// Returns one row of the table of scenarios: the file on disk, loaded and run as `host-sim run` does.
fn scenario_row(file: &str, label: &str, sets: &[&str]) -> String {
    let path = scenario_file(&format!("{file}.toml"));
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let mut experiment = load(&path, &sets).unwrap_or_else(|error| panic!("{error}"));
    let (trace, error) = experiment.run(&mut |_| ControlFlow::Continue(()));
    assert!(error.is_none(), "{file} {label}: {error:?}");
    let Metrics { sigma_star_ultimate, y_ultimate, u_peak, bounded, .. } = experiment.metrics(&trace);
    assert!(bounded, "{file} {label}: what the project ships must not run away");
    let name = format!("{file} {label}");
    format!("{name:30} {sigma_star_ultimate:9.3e}  {y_ultimate:9.3e}  {u_peak:9.3e}  {bounded}\n")
}

const ERRORS: [&str; 7] = ["k1", "k1_x3", "b1", "k2_x1", "k2_x3", "b2", "b"];

fn scenario_table() -> String {
    let mut table = format!(
        "The scenario files as they run; ultimate over each file's own window\n\
         {:30} {:9}  {:9}  {:9}  bounded\n",
        "scenario", "sigma*", "y", "peak u"
    );
    let mut files: Vec<String> = SCENARIOS
        .iter()
        .flat_map(|folder| std::fs::read_dir(path(folder)).expect("a folder of scenarios"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|file| file.extension().is_some_and(|extension| extension == "toml"))
        .map(|file| file.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    files.sort();
    for file in &files {
        table += &scenario_row(file, "", &[]);
    }
    for reading in ["literal", "stiff", "physical"] {
        table += &scenario_row("default", reading, &[&format!("plant.reading={reading}")]);
    }
    // b_1 is not in the nominal model; a factor of 4.5/0.07 makes it the damping B_11 on the link.
    table += &scenario_row("default", "B11 on the link", &["plant.error.b1=63.2857142857"]);
    table += &scenario_row("default", "jitter 20 %", &["sensor.jitter=0.2"]);
    table += &scenario_row("default", "lambda halved", &["controller.lambda_per_s=37.6"]);
    for error in ["0.5", "-0.5"] {
        let sets = ERRORS.map(|key| format!("plant.error.{key}={error}"));
        let percent = if error == "0.5" { "all +50 %" } else { "all -50 %" };
        table += &scenario_row("default", percent, &sets.each_ref().map(String::as_str));
    }
    table
}

#[test]
fn scenario_files_run_to_the_figures_of_the_golden_table() {
    compare("scenarios.txt", &scenario_table()).unwrap_or_else(|difference| panic!("{difference}"));
}
