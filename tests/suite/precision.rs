//! Sufficiency of f32: the f32 controller against the f64 controller, each in its own loop with the f64 plant of
//! Example 2 (`reconstructed`, r = 2 as printed, k_l = 50, 20 s), after the transient.

use controller_core::{JointParameters, Reading, Real};
use integration_tests::close::Gap;
use integration_tests::oracle::{Gains, Model, Spec};
use integration_tests::paper::{Run, joint, joint_spec};
use integration_tests::shape::{Precision as Bits, controller};
use loop_sim::actuator;
use loop_sim::plant::FlexibleJoint;
use loop_sim::port::in_process::Precision;
use loop_sim::sensor::{Ideal, Sensor};
use loop_sim::trace::Trace;

/// Time from which the offset has decayed to e^-10, s; the closed loop's poles (5 rad/s) have settled long before.
const SETTLED_S: f64 = 10.0;

fn plant() -> FlexibleJoint {
    FlexibleJoint::of_the_paper(JointParameters::TABLE_I.chain(Reading::Reconstructed))
}

/// Returns the largest differences of sigma*, y, u from `from_s` on.
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

/// Encoder that counts from 100 rad away, converted to f32 raw. Each angle is rounded to 7.6e-6 rad before the
/// reference is subtracted (exactly).
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

/// A start 100 rad away, observers with both poles at -50. The printed gains' pole at -0.2 would remember the start for
/// a minute. W begins at 12500. Its f32 decrement rounds W by some 1e-3 of itself in 1e5 ticks. The effect on y = W/c_1
/// lasts as long as W: after 20 s it is 2.6e-5.
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

/// Printed p-form of one channel i < n, Eq. (45)-(50), by Euler's rule.
struct PForm<T> {
    l: [T; 2],
    p: [T; 2],
}

impl<T: Real> PForm<T> {
    /// Starts with d_hat(0) = 0: p(0) = -l x(0).
    fn start(l: &[f64], x: f64) -> Self {
        let l = [T::from_f64(l[0]), T::from_f64(l[1])];
        Self { l, p: l.map(|l| -l * T::from_f64(x)) }
    }

    /// Returns d_hat from this sample, then updates p for the next one; x_{i+1} = 0.
    fn tick(&mut self, x: f64, period_s: f64) -> f64 {
        let [d_hat, derivative] = [0, 1].map(|j| self.p[j] + self.l[j] * T::from_f64(x));
        let period = T::from_f64(period_s);
        self.p[0] += period * (derivative - self.l[0] * d_hat);
        self.p[1] += period * (-self.l[1] * d_hat);
        d_hat.to_f64()
    }
}

/// Raw angles enter both observers in f32 (order 2, poles at -50, 1 ms): x_1' = d = sin 2t, from 100 rad in steps of
/// 2^-17 rad. These are whole steps of f32 there, so the sample is one number in f32 and f64. Each observer is compared
/// with its own f64 twin on these samples; the difference is due to its arithmetic.
///
/// The p-form adds T l d_hat to p = -l x = -10^4 and -2.5 10^5, whose f32 steps are 1e-3 and 1.6e-2. Near 0 rad the
/// p-form would suffice; it fails at an offset.
#[test]
fn difference_form_keeps_at_100_rad_what_the_p_form_loses() {
    let (period_s, gains) = (1e-3, Gains::from_bandwidth(50.0, 2));
    let spec = Spec::observing(1, gains.clone(), period_s);
    // Largest |d_hat in f32 - d_hat in f64| over 10 s of [this observer, the p-form].
    let errors = |offset_rad: f64| {
        let x_1 = |k: u32| {
            let counts = ((offset_rad + (1.0 - (2e-3 * f64::from(k)).cos()) / 2.0) * 131_072.0).round();
            counts / 131_072.0
        };
        let model = Model::linear(&[0.0, 0.0], 1.0);
        let [mut single, mut double] =
            [Bits::Single, Bits::Double].map(|bits| controller(&spec, &model, 2, bits).expect("a valid design"));
        assert!(single.start(&[x_1(0), 0.0]) && double.start(&[x_1(0), 0.0]));
        let mut p_single = PForm::<f32>::start(&gains.l, x_1(0));
        let mut p_double = PForm::<f64>::start(&gains.l, x_1(0));
        let (mut ours, mut p_form) = (Gap::default(), Gap::default());
        for k in 0..10_000 {
            let x = x_1(k);
            assert_eq!(f64::from(x as f32), x, "the sample must not be rounded");
            single.tick(&[x, 0.0]);
            double.tick(&[x, 0.0]);
            ours.add(single.estimates()[0][0], double.estimates()[0][0]);
            p_form.add(p_single.tick(x, period_s), p_double.tick(x, period_s));
        }
        let errors = [ours, p_form].map(|gap| gap.difference);
        println!("offset {offset_rad} rad: d_hat off by {:.2e}, in the p-form by {:.2e}", errors[0], errors[1]);
        errors
    };
    let [ours, p_form] = errors(100.0);
    // d_hat is 1 at most, so the threshold is a few f32 steps of 6e-8.
    assert!(ours <= 7e-7, "{ours:e}");
    assert!(p_form >= 1000.0 * ours, "{p_form:e} against {ours:e}");
    let [_, p_form_near_0] = errors(0.0);
    assert!(p_form_near_0 <= p_form / 30.0, "the transcription of the p-form is at fault, not the offset");
}
