//! Correctness of the C reference against which the tick's speed is measured.
//!
//! The joint in closed loop under the shipped tick in f64, 10 kHz, 2 s, from 0.3 rad: it saturates, reaches the layer
//! and settles. The f32 versions get equal samples and equal applied u, so the remaining difference is rounding. u is
//! compared at every tick, in units of its limit.

use benches::{Joint, NOMINAL, Naive, Noise, Tuned, joint, joint_f64};
use controller_core::{ControlLaw, Health, JointParameters, Reading};
use integration_tests::close::Gap;
use loop_sim::plant::FlexibleJoint;
use loop_sim::solver;

/// Control period of the design, s.
const PERIOD_S: f64 = 1e-4;
const TICKS: usize = 20_000;
/// Limit of u.
const LIMIT: f64 = 300.0;
/// Threshold for rounding: u is a sum of some 20 terms of up to a few times the limit, each rounded to 6e-8 of itself.
/// Measured: 4.1e-7 at most, in the shipped tick and in the tuned C.
const ROUNDING: f64 = 1e-6;
/// Threshold for the naive C. It rounds the estimate once for every term, and the observer takes 1/(pole T) = 100 ticks
/// to correct it: 100 times 6e-8. Measured: 4.3e-6 (r = 3), 2.5e-7 (r = 2).
const NAIVE_ROUNDING: f64 = 1e-5;

/// Samples and the applied u after each, both exact in f32.
struct Tick {
    x: [f32; 4],
    u: f32,
}

fn trajectory<const R: usize>() -> Vec<Tick> {
    let plant = FlexibleJoint::of_the_paper(JointParameters::TABLE_I.chain(Reading::Reconstructed));
    let controller = joint_f64::<R>();
    let mut true_x = [0.3, 0.0, 0.0, 0.0];
    let mut state = controller.start(&true_x).expect("a finite sample");
    (0..TICKS)
        .map(|k| {
            let x = true_x.map(|value| value as f32);
            let u = controller.tick(&mut state, &x.map(f64::from)).u as f32;
            Joint::<f64, R>::report_applied(&mut state, f64::from(u));
            let t_s = k as f64 * PERIOD_S;
            solver::advance(&plant, t_s, t_s + PERIOD_S, f64::from(u), &mut true_x).expect("the plant is slow");
            Tick { x, u }
        })
        .collect()
}

/// Returns the largest difference in u from the f64 tick, in units of the limit. The order is the naive C, the naive C
/// with fast math, the tuned C, the tuned C with guard, the shipped f32 tick.
fn differences<const R: usize>() -> [f64; 5] {
    let run = trajectory::<R>();
    let x0 = &run[0].x;
    let mut naive = Naive::<R, false>::new();
    let mut fast = Naive::<R, true>::new();
    let mut tuned = Tuned::<R, false>::start(x0);
    let mut guarded = Tuned::<R, true>::start(x0);
    let shipped: Joint<f32, R> = joint();
    let mut state = shipped.start(x0).expect("a finite sample");
    let mut gaps = [Gap::default(); 5];
    let mut saturated = 0;
    for Tick { x, u } in &run {
        let all = [naive.tick(x), fast.tick(x), tuned.tick(x), guarded.tick(x), shipped.tick(&mut state, x).u];
        for (gap, one) in gaps.iter_mut().zip(all) {
            gap.add(f64::from(one), f64::from(*u));
        }
        naive.applied(*u);
        fast.applied(*u);
        tuned.applied(*u);
        guarded.applied(*u);
        Joint::<f32, R>::report_applied(&mut state, *u);
        saturated += usize::from(u.abs() == LIMIT as f32);
    }
    assert!(saturated > 0 && saturated < TICKS / 2, "{saturated} ticks saturated: the run shows too little");
    gaps.map(|gap| gap.difference / LIMIT)
}

#[test]
fn the_c_versions_compute_the_law_of_the_shipped_tick() {
    for (r, differences) in [(2, differences::<2>()), (3, differences::<3>())] {
        println!("r = {r}: naive, fast, tuned, guarded, shipped: {differences:?}");
        let [naive, fast, tuned, guarded, shipped] = differences;
        assert!(tuned == guarded, "r = {r}: the guard changes a number");
        assert!(shipped <= ROUNDING, "r = {r}: shipped {shipped:e}");
        assert!(tuned <= ROUNDING, "r = {r}: tuned {tuned:e}");
        assert!(naive <= NAIVE_ROUNDING && fast <= NAIVE_ROUNDING, "r = {r}: naive {naive:e}, fast {fast:e}");
    }
}

/// Both start from noise with missing samples now and then: equal answers, and equal recovery.
fn guarded_like_the_shipped_tick<const R: usize>() {
    let mut noise = Noise::new(7);
    let x0 = noise.sample();
    let shipped: Joint<f32, R> = joint();
    let mut state = shipped.start(&x0).expect("a finite sample");
    let mut guarded = Tuned::<R, true>::start(&x0);
    let (mut rejected, mut gap) = (0, Gap::default());
    for k in 0..2000 {
        let mut x = noise.sample();
        if k % 50 > 46 {
            x[k % 4] = [f32::NAN, f32::INFINITY, 1e30][k % 3];
        }
        let output = shipped.tick(&mut state, &x);
        gap.add(f64::from(guarded.tick(&x)), f64::from(output.u));
        // Both get one history, as in closed loop; alone they would integrate their roundings.
        guarded.applied(output.u);
        rejected += usize::from(output.health.contains(Health::INPUT_REJECTED));
    }
    assert_eq!(rejected, 120, "r = {R}");
    println!("r = {R}, with lost samples: {:.2e}", gap.difference / LIMIT);
    assert!(gap.difference / LIMIT <= ROUNDING, "r = {R}: {:e}", gap.difference / LIMIT);
}

#[test]
fn the_guard_in_c_does_with_bad_samples_what_the_shipped_one_does() {
    guarded_like_the_shipped_tick::<2>();
    guarded_like_the_shipped_tick::<3>();
}

#[test]
fn the_c_versions_know_the_joint_that_the_others_are_measured_with() {
    assert_eq!(NOMINAL, integration_tests::paper::NOMINAL);
}
