//! Does f32 suffice? The f32 controller against the f64 controller, each in its own loop with the f64 plant of Example
//! 2 (`reconstructed`, r = 2 as printed, k_l = 50, 20 s), after the transient.

use controller_core::{JointParameters, Reading};
use host_sim::actuator;
use host_sim::plant::FlexibleJoint;
use host_sim::port::in_process::Precision;
use host_sim::sensor::{Ideal, Sensor};
use host_sim::trace::Trace;
use integration_tests::close::Gap;
use integration_tests::oracle::{Gains, Spec};
use integration_tests::paper::{Run, joint, joint_spec};

/// The offset has decayed to e^-10 and the closed loop's poles (5 rad/s) long have.
const SETTLED_S: f64 = 10.0;

fn plant() -> FlexibleJoint {
    FlexibleJoint::of_the_paper(JointParameters::TABLE_I.chain(Reading::Reconstructed))
}

/// Largest differences of sigma*, y, u from `from_s` on.
fn differences(one: &Trace, other: &Trace, from_s: f64) -> [f64; 3] {
    assert_eq!(one.rows.len(), other.rows.len());
    let mut gaps = [Gap::default(); 3];
    for (one, other) in one.rows.iter().zip(&other.rows).filter(|(row, _)| row.t_s >= from_s) {
        gaps[0].add(one.sigma_star, other.sigma_star);
        gaps[1].add(one.x[0], other.x[0]);
        gaps[2].add(one.u, other.u);
    }
    gaps.map(|gap| gap.difference)
}

fn with(plant: &FlexibleJoint, period_s: f64, precision: Precision) -> Run<'_> {
    joint(plant, Spec { period_s, ..joint_spec(Reading::Reconstructed, 50.0) }, precision)
}

#[test]
fn f32_controller_follows_the_f64_one_down_to_50_microseconds() {
    let plant = plant();
    for period_s in [1e-3, 1e-4, 5e-5] {
        let [single, double] =
            [Precision::F32, Precision::F64].map(|precision| with(&plant, period_s, precision).trace());
        let [sigma_star, y, u] = differences(&single, &double, SETTLED_S);
        println!("T = {period_s}: sigma* {sigma_star:.2e}, y {y:.2e}, u {u:.2e}");
        assert!(sigma_star <= 6e-5, "T = {period_s}: sigma* {sigma_star:e}");
        assert!(y <= 4e-7, "T = {period_s}: y {y:e}");
        assert!(u <= 1e-3, "T = {period_s}: u {u:e}");
    }
}

/// An encoder that counts from 100 rad away, converted to f32 raw: each angle is rounded to 7.6e-6 rad, and only then
/// is the reference taken off (exactly).
struct RawEncoder {
    offset_rad: f32,
}

impl Sensor for RawEncoder {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        Ideal.measure(x, sample);
        let raw = (x[0] + f64::from(self.offset_rad)) as f32;
        sample[0] = f64::from(raw - self.offset_rad);
    }
}

#[test]
fn raw_offset_of_100_rad() {
    let plant = plant();
    for period_s in [1e-3, 1e-4] {
        let exact = with(&plant, period_s, Precision::F64).trace();
        let mut encoder = RawEncoder { offset_rad: 100.0 };
        let raw = with(&plant, period_s, Precision::F32).trace_through(&mut encoder, &mut actuator::Ideal);
        let [_, y, _] = differences(&raw, &exact, SETTLED_S);
        println!("encoder at 100 rad, T = {period_s}: y {y:.2e}");
        assert!(y <= 2e-6, "T = {period_s}: y {y:e}");
    }
}

/// A start 100 rad away, observers with both poles at -50 (the printed gains' pole at -0.2 would remember the start
/// for a minute). W begins at 12500; its f32 decrement rounds it by some 1e-3 of itself in 1e5 ticks, which is seen in
/// y = W/c_1 as long as there is a W: after 20 s it is 2.6e-5.
#[test]
fn start_at_100_rad_leaves_nothing_behind() {
    let plant = plant();
    let gains = Some(Gains::from_bandwidth(50.0, 2));
    for period_s in [1e-3, 1e-4] {
        let [single, double] = [Precision::F32, Precision::F64].map(|precision| {
            let mut run = Run { x0: vec![100.0, 0.0, 0.0, 0.0], span_s: 22.0, ..with(&plant, period_s, precision) };
            run.spec.observers = vec![None, gains.clone(), None, gains.clone()];
            run.trace()
        });
        let [_, y, _] = differences(&single, &double, 20.0);
        println!("T = {period_s}: y {y:.2e}");
        assert!(y <= 2e-6, "T = {period_s}: y {y:e}");
    }
}
