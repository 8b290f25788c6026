//! Comparison of a drive with an independent implementation on equal counts, targets and applied currents.
//!
//! The recordings are closed loops of that implementation: f64, constants by matrix exponentials, on plants with
//! friction and cogging. Every recorded tick is fed to the controller.

use controller_core::Limits;
use controller_core::drive::{
    Encoder, Joint, JointBandwidths, JointDesign, JointDrive, Motor, MotorBandwidths, MotorDesign, MotorDrive,
    Position, Speed,
};
use integration_tests::data;
use integration_tests::drive::{Row, replay};

/// Motor of the recordings.
const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };

fn motor_rows(name: &str) -> Vec<Row<1, 2>> {
    let columns = ["count", "ok", "u_demand", "u_applied", "sigma_star", "r", "r_1"];
    let rows = data::columns(&format!("motor_{name}.csv"), columns);
    let row = |[count, ok, u_demand, u_applied, sigma_star, r, r_1]: [f64; 7]| Row {
        counts: [(ok == 1.0).then_some(count as i32)],
        u_demand,
        u_applied,
        sigma_star,
        jet: [r, r_1],
    };
    rows.into_iter().map(row).collect()
}

fn motor(period_s: f64, bits: u32, w_c: f64) -> MotorDesign {
    let design =
        MotorDesign::by_rule(period_s, MOTOR, Encoder::absolute(bits), Limits::symmetric(1e6)).with_surface(w_c);
    // The recordings have no innovation gate.
    MotorDesign { gate_steps: f64::INFINITY, ..design }
}

/// Checks the replay of a recording. The recordings have ten digits, which explains the remaining f64 difference in u.
/// The oracle fed with its own files differs by 1.4e-6 A.
fn check(name: &str, double: [f64; 2], single: [f64; 2], bars: [f64; 2]) {
    println!(
        "{name}: f64 u {:.1e} A, sigma* {:.1e}; f32 u {:.1e} A, sigma* {:.1e}",
        double[0], double[1], single[0], single[1]
    );
    assert!(double[0] <= bars[0] && double[1] <= 1e-5, "{name} in f64: {double:?}");
    assert!(single[0] <= bars[1], "{name} in f32: {single:?}");
}

macro_rules! motor_replay {
    ($name:literal, $design:expr, $($types:tt)*) => {{
        let (design, rows) = ($design, motor_rows($name));
        let double = MotorDrive::<f64, $($types)*>::try_design(&design).expect("a good design");
        let single = MotorDrive::<f32, $($types)*>::try_design(&design).expect("a good design");
        let [double, single] = [replay(&double, &rows, |_, _, _| ()), replay(&single, &rows, |_, _, _| ())];
        check($name, double, single, [1e-5, 1e-3]);
    }};
}

#[test]
fn a_move_under_a_load() {
    motor_replay!("move_load_14bit", motor(1e-3, 14, 125.0), Position);
}

#[test]
fn a_sine_with_two_gain_sets_and_lost_samples() {
    motor_replay!("sine_20bit_two_sets_lost", motor(1e-3, 20, 125.0), Position, 1);
}

#[test]
fn many_turns_with_a_wrapping_counter_and_one_tick_of_delay() {
    let bandwidths =
        MotorBandwidths { surface_rad_s: 50.0, observer_rad_s: 75.0, reaching_per_s: 400.0, offset_per_s: 25.0 };
    motor_replay!("turns_wrap_delay_12bit", MotorDesign { bandwidths, ..motor(1e-3, 12, 50.0) }, Position, 0, 1, 4);
}

#[test]
fn a_speed_loop_at_a_tenth_of_a_millisecond() {
    motor_replay!("speed_loop_fine_16bit", motor(1e-4, 16, 286.0), Speed);
}

/// Marker of a missing count in the recordings of the joint.
const LOST: f64 = -1e6;

fn joint_rows(name: &str) -> Vec<Row<2, 4>> {
    let columns = ["link", "motor", "u_demand", "u_applied", "sigma_star", "r", "r_1", "r_2", "r_3"];
    let rows = data::columns(&format!("joint_{name}.csv"), columns);
    let row = |[link, motor, u_demand, u_applied, sigma_star, r, r_1, r_2, r_3]: [f64; 9]| Row {
        counts: [link, motor].map(|count| (count != LOST).then_some(count as i32)),
        u_demand,
        u_applied,
        sigma_star,
        jet: [r, r_1, r_2, r_3],
    };
    rows.into_iter().map(row).collect()
}

fn joint() -> JointDesign {
    let design = JointDesign::new(1e-3, Joint::TABLE_I, [Encoder::absolute(20); 2], Limits::symmetric(1e6), 1.3);
    // The recordings have no innovation gate.
    JointDesign { gate_steps: [f64::INFINITY; 2], ..design }
}

/// Remainders of the oracle's own implementation: f64 u 3e-8 A, σ* 1e-6; f32 u 1.6e-4 A, with missing samples 1.8e-3 A.
macro_rules! joint_replay {
    ($name:literal, $single:literal, $late:literal) => {{
        let (design, rows) = (joint(), joint_rows($name));
        let double = JointDrive::<f64, Position, 1, $late>::try_design(&design).expect("a good design");
        let single = JointDrive::<f32, Position, 1, $late>::try_design(&design).expect("a good design");
        let [double, single] = [replay(&double, &rows, |_, _, _| ()), replay(&single, &rows, |_, _, _| ())];
        check($name, double, single, [1e-6, $single]);
    }};
}

#[test]
fn a_joint_recovers_by_a_plan_and_meets_a_load() {
    joint_replay!("recovery_load", 5e-4, 0);
}

#[test]
fn a_joint_moves_with_one_tick_of_delay() {
    joint_replay!("move9_delay", 5e-4, 1);
}

#[test]
fn a_joint_bridges_lost_samples_of_link_and_motor() {
    joint_replay!("lost_samples", 5e-3, 0);
}

/// All bandwidths change before tick 500.
#[test]
fn a_joint_is_tuned_anew_in_motion() {
    let (design, rows) = (joint(), joint_rows("retune"));
    let firmer = JointBandwidths {
        surface_rad_s: 25.0,
        link_rad_s: 100.0,
        motor_rad_s: 600.0,
        reaching_per_s: 150.0,
        ..design.bandwidths
    };
    let other = JointDesign { bandwidths: firmer, ..design };
    macro_rules! run {
        ($t:ty) => {{
            let [law, other] = [&design, &other]
                .map(|design| JointDrive::<$t, Position, 1>::try_design(design).expect("a good design"));
            replay(&law, &rows, |k, running, sample| {
                if k == 500 {
                    running.retune(other, sample).expect("designs that can take over");
                }
            })
        }};
    }
    check("retune", run!(f64), run!(f32), [1e-6, 5e-4]);
}
