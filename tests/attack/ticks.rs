//! Attacks on the tick: designs of six kinds under the most harmful samples and every operation of the interface, and
//! random designs in all 116 configurations, in f32 and f64.

use controller_core::Health;
use integration_tests::oracle::{Spec, power};
use integration_tests::recovery::{Victim, damaged, victims};
use integration_tests::shape::{Precision, SHAPES, controller};
use integration_tests::strategy::{Rng, Trial, any_design};
use std::sync::LazyLock;

static VICTIMS: LazyLock<Vec<Box<dyn Victim>>> = LazyLock::new(victims);

/// Ticks of a running controller in one trial.
const TICKS: usize = 2000;

pub(super) fn run(_: u64, trial: &mut Trial) -> Result<(), String> {
    let victim = trial.rng.one_of(&VICTIMS);
    match trial.rng.integer(0, 3) {
        0 => (0..TICKS / 100).try_for_each(|_| victim.struck(trial).map(drop)),
        1 => victim.driven(TICKS, trial),
        _ => any(trial),
    }
}

/// Returns a valid sample in proportion to the design: x_j grows by a tenth of the tick's rate per channel.
fn good(spec: &Spec, rng: &mut Rng) -> Vec<f64> {
    let n = spec.order();
    (0..n).map(|j| rng.within(-10.0, 10.0) * power(10.0 * spec.period_s, n - 1 - j)).collect()
}

/// Returns an arbitrary entry of a sample. Most f64 bit patterns become infinite or 0 in f32, so both ranges are drawn.
fn entry(rng: &mut Rng) -> f64 {
    match rng.integer(0, 3) {
        0 => f64::from(f32::from_bits(rng.bits() as u32)),
        1 => f64::from_bits(rng.bits()),
        2 => *rng.one_of(&[f64::NAN, f64::INFINITY, 1e12, -1e30, 1e300, -0.0, 5e-324]),
        _ => rng.within(-10.0, 10.0),
    }
}

/// Attacks a random design with valid and invalid samples, reports, starts and damaged states.
fn any(trial: &mut Trial) -> Result<(), String> {
    let (n, capacity, mask) = *trial.rng.one_of(SHAPES);
    let precision = if trial.rng.chance(0.5) { Precision::Single } else { Precision::Double };
    let (spec, model) = any_design(&mut trial.rng, n, capacity, mask);
    // With narrow limits such samples may exceed the demand of any real plant; rejecting them is then correct.
    let is_narrow = trial.rng.chance(0.5);
    let limit = if is_narrow { trial.rng.spread(1e-3, 1e6) } else { 1e12 };
    let spec = Spec { limit, ..spec };
    trial.tell(|| format!("{precision:?}, capacity {capacity}, {spec:?}, {model:?}"));
    let mut shipped = controller(&spec, &model, capacity, precision).map_err(|error| error.to_string())?;
    let start = good(&spec, &mut trial.rng);
    if !shipped.start(&start) {
        return Err(format!("a good sample refused: {start:?}"));
    }
    // True from the damage until a sample is accepted; number of valid samples rejected since.
    let (mut is_damaged, mut lost) = (false, 0);
    for _ in 0..TICKS {
        let rng = &mut trial.rng;
        let mut x = good(&spec, rng);
        let is_good = is_damaged || rng.chance(0.7);
        if !is_good {
            for x in &mut x {
                *x = if rng.chance(0.5) { entry(rng) } else { *x };
            }
        }
        match rng.integer(0, 63) {
            0 => {
                let (x, guess): (Vec<f64>, Vec<f64>) = (0..n).map(|_| (entry(rng), entry(rng))).unzip();
                let started = shipped.start_from(&x, &guess) || shipped.start(&start);
                trial.tell(|| format!("started at {x:?} with {guess:?}: {started}"));
                if !started {
                    return Err(format!("a good sample refused: {start:?}"));
                }
                // A guess may be as harmful as damage.
                (is_damaged, lost) = (true, 0);
            }
            1 if shipped.rewrite(&mut |words| damaged(words, rng)) => {
                trial.tell(|| "state damaged".into());
                (is_damaged, lost) = (true, 0);
            }
            2..=15 => {
                let u = entry(rng);
                trial.tell(|| format!("{u:e} was held"));
                shipped.report_applied(u);
            }
            _ => {}
        }
        let tick = shipped.tick(&x);
        trial.done += 1;
        trial.tell(|| format!("{x:?} -> {tick:?}"));
        // The f32 controller uses the rounded limit.
        if tick.u.is_nan() || tick.u.abs() > limit * (1.0 + 1e-7) {
            return Err(format!("u = {} beyond {limit}", tick.u));
        }
        let is_rejected = tick.health.contains(Health::INPUT_REJECTED);
        let are_finite = tick.sigma.is_finite() && tick.sigma_star.is_finite();
        if !(is_damaged || are_finite) {
            return Err(format!("{x:?} -> {tick:?}"));
        }
        if !is_rejected && x.iter().any(|x| !x.is_finite()) {
            return Err(format!("taken: {x:?}"));
        }
        if is_damaged {
            // The sample at the tick of the damage may be invalid.
            lost += u32::from(is_rejected && is_good);
            is_damaged = is_rejected;
            if lost > 2 && !is_narrow {
                return Err("three good samples refused".into());
            }
        }
    }
    Ok(())
}
