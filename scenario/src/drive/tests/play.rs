//! Tests of the backlash of a file.

use super::*;

const GRIPPER: [&str; 10] = [
    "motor={inertia_kg_m2=2e-8, torque_n_m_per_a=0.0045, max_current_a=0.7, gear=[288, 1], load_inertia_kg_m2=1e-4, \
     current_lag_s=1e-3}",
    "encoder={bits=12, behind_gear=true}",
    "drive.period_s=2e-3",
    "reference={kind=\"move\", to_rad=0.5, duration_s=0.3}",
    "friction={coulomb_n_m=0.0288, static_n_m=0.0432}",
    "load=[]",
    "span_s=5",
    "window_s=[3, 5]",
    "monitor.reaction=\"tell\"",
    "motor.play_rad=0.01",
];

fn gripper<'a>(more: &[&'a str]) -> Vec<&'a str> {
    GRIPPER.iter().chain(more).copied().collect()
}

fn surface(experiment: &Experiment) -> f64 {
    let DriveDesign::Motor(DriveOf { design, .. }) = &experiment.drive.as_ref().expect("a drive").designed else {
        panic!("a motor")
    };
    design.bandwidths.surface_rad_s
}

/// Standard deviation of u over the last two seconds, A.
fn deviation(trace: &Trace) -> f64 {
    let rows = || trace.rows.iter().filter(|row| row.t_s >= 3.0).map(|row| row.u);
    let mean = rows().sum::<f64>() / rows().count() as f64;
    (rows().map(|u| (u - mean).powi(2)).sum::<f64>() / rows().count() as f64).sqrt()
}

/// With the encoder behind the gear the rule lowers the bandwidth with the backlash, with a warning, and the shaft
/// rests. Bandwidths of the file stay, with a warning about the limit cycle.
#[test]
fn a_rule_that_knows_of_the_play_does_not_swing_in_it() {
    let [off, free] = ["drive.rest_band=\"off\"", "friction={}"];
    let mut last = f64::INFINITY;
    for (play, expected) in [(0.0, 40.0), (0.005, 28.0), (0.01, 20.0), (0.02, 14.0)] {
        let play = format!("motor.play_rad={play}");
        let (experiment, trace) = ran(MOTOR, &gripper(&[&play, off, free]));
        let [w_c, varies] = [surface(&experiment), deviation(&trace)];
        assert!((w_c - expected).abs() < 0.01 && w_c < last && varies <= 0.02, "{play}: {w_c} rad/s, {varies} A");
        let limits = "behind the gear limits the position bandwidth to ";
        let is_told = experiment.warnings.iter().any(|warning| warning.contains(limits));
        assert_eq!(is_told, w_c < 39.0, "{play}: {:?}", experiment.warnings);
        last = w_c;
    }
    let (experiment, trace) = ran(MOTOR, &gripper(&["drive.surface_rad_s=40", "drive.gain_sets=2", off, free]));
    let varies = deviation(&trace);
    assert!(varies > 0.3, "{varies} A");
    let warning = experiment.warnings.iter().find(|warning| warning.contains("limit-cycles at rest, with "));
    assert!(warning.is_some_and(|it| it.contains("encoder.behind_gear = false")), "{:?}", experiment.warnings);
}

/// An encoder on the motor does not measure the backlash: full bandwidth, rest, and a load known to the backlash.
#[test]
fn an_encoder_on_the_motor_does_not_see_the_play() {
    let (experiment, trace) = ran(MOTOR, &gripper(&["encoder.behind_gear=false"]));
    let row = trace.rows.last().expect("rows");
    assert!((surface(&experiment) - 40.0).abs() < 0.01 && experiment.warnings.is_empty(), "{:?}", experiment.warnings);
    assert!(deviation(&trace) < 1e-3 && (row.x[0] - 0.5).abs() < 8e-3 && (row.x[2] - 0.5).abs() < 2e-3, "{:?}", row.x);
}

#[test]
fn play_without_a_load_and_flanks_without_play_are_refused() {
    for (sets, message) in [
        (["motor.play_rad=0.01", "motor.gear=[9, 1]"], "`motor.play_rad`: needs motor.load_inertia_kg_m2"),
        (["motor.gear_stiffness_n_m=5", "motor.gear=[9, 1]"], "`motor.gear_stiffness_n_m`: only with play_rad"),
        (["motor.play_rad=-1", "motor.gear=[9, 1]"], "`motor.play_rad`: found -1"),
        (
            [
                "motor={inertia_kg_m2=1e-5, torque_n_m_per_a=0.05, max_current_a=5, load_inertia_kg_m2=1e-5, \
                 play_rad=0.01}",
                "motor.gear_stiffness_n_m=1e6",
            ],
            "`motor.gear_stiffness_n_m`: found 1000000, expected 0.0005 to 2000",
        ),
    ] {
        let error = build(MOTOR, &sets).err().unwrap_or_default();
        assert!(error.contains(message), "{error}");
    }
}
