//! Innovation gate ahead of the controller: it rejects samples that are physically impossible, and nothing else.

use controller_core::{
    Config, ControlLaw, FlexibleJoint, Gate, Gated, Health, Limits, ObserverGains, Options, Output, Real, Running,
    SampleLimits, Words, controller,
};
use integration_tests::paper::{NOMINAL, joint_config};
use integration_tests::strategy::Rng;
use integration_tests::truth::{ExactStep, LinearChain};
use loop_sim::sensor::{self, Sensor};

type Joint<T> = controller!(T, FlexibleJoint<T>, order 4, observers of order 2 in [2, 4]);

/// Sample limits of the joint's encoders: two revolutions, 100 rad/s, and the effect of 300 A in some ticks.
const SAMPLES: SampleLimits<4> =
    SampleLimits { min: [-12.6, -100.0, -2e3, -1e5], max: [12.6, 100.0, 2e3, 1e5], jump: [0.5, 10.0, 200.0, 2e4] };

fn config() -> Config<4, 2> {
    let config = joint_config(ObserverGains::as_printed([100.0, 20.0]));
    let options = Options::NEUTRAL.with_limits(Limits::symmetric(300.0)).with_samples(SAMPLES);
    Config { options, ..config }
}

fn gated() -> Gated<Joint<f32>, 4> {
    Gated::<Joint<f32>, 4>::try_design(&config(), FlexibleJoint::<f32>::new(&NOMINAL)).expect("a good design")
}

/// Runs the joint at rest for a second, then one sample whose x_1 is `wild`. Returns the number of the next 50 000
/// ticks that demand more than 1 A.
fn disturbed(mut tick: impl FnMut(&[f32; 4]) -> f32, wild: f32) -> usize {
    let plant = LinearChain { a: NOMINAL.gradient.to_vec(), b: NOMINAL.input_gain, d: vec![Vec::new(); 4] };
    let step = ExactStep::new(&plant, config().period_s);
    let mut x = vec![0.0; 4];
    let mut disturbed = 0;
    for k in 0..51_000 {
        let mut sample: [f32; 4] = std::array::from_fn(|j| x[j] as f32);
        if k == 1000 {
            sample[0] = wild;
        }
        let u = f64::from(tick(&sample));
        disturbed += usize::from(u.abs() > 1.0);
        step.advance(k, u, &mut x);
    }
    disturbed
}

#[test]
fn one_wild_sample_of_a_resting_joint_moves_nothing_behind_a_gate_and_much_without() {
    let (gated, config) = (gated(), config());
    let free = Config { options: config.options.with_samples(SampleLimits::NONE), ..config };
    let bare = Joint::<f32>::try_design(&free, FlexibleJoint::<f32>::new(&NOMINAL)).expect("a good design");
    // Within the range and beyond it; the tick's own guard rejects larger values.
    for (wild, without) in [(0.6, 200), (6.0, 500), (60.0, 1500), (600.0, 1500), (6e3, 0), (1e6, 0), (1e8, 0)] {
        let mut running = Running::new(&bare);
        let found = disturbed(|x| running.tick(x).u, wild);
        println!("x_1 = {wild:e} once: {found} ticks above 1 A without a gate");
        assert!(found >= without, "without a gate {wild:e} does little harm: {found}");
        let mut running = Running::new(&gated);
        assert_eq!(disturbed(|x| running.tick(x).u, wild), 0, "{wild:e}");
    }
}

/// Second, independent formulation of the limits: which samples are accepted.
#[derive(Default)]
struct SampleGate {
    last: Option<[f64; 4]>,
}

impl SampleGate {
    fn is_taken(&mut self, x: &[f64; 4]) -> bool {
        let within = |row: &[f64; 4], sign: f64| x.iter().zip(row).all(|(x, row)| sign * (row - x) >= 0.0);
        if !within(&SAMPLES.min, -1.0) || !within(&SAMPLES.max, 1.0) {
            return false;
        }
        let before = self.last.replace(*x).unwrap_or(*x);
        (0..4).all(|j| (x[j] - before[j]).abs() <= SAMPLES.jump[j])
    }
}

/// Returns a sample that stays, moves, jumps, leaves the range, or is not a number.
fn any_sample(rng: &mut Rng, last: &[f64; 4]) -> [f64; 4] {
    let size = [0.0, 0.3, 1.0, 1.2, 30.0][rng.integer(0, 4)];
    let mut x = std::array::from_fn(|j| last[j] + size * SAMPLES.jump[j] * rng.within(-1.0, 1.0));
    match rng.integer(0, 19) {
        0 => x[rng.integer(0, 3)] = [f64::NAN, f64::INFINITY, -1e30, 1e6][rng.integer(0, 3)],
        1 => x[rng.integer(0, 3)] *= 1e3,
        2..=9 => x = x.map(|value| 0.5 * value),
        _ => {}
    }
    x
}

macro_rules! law_fed_nan {
    ($name:ident, $t:ty) => {
        /// Compares the gated controller with two references. One is the controller without a gate, which gets NaN for
        /// every rejected sample; the other is a simulated sensor with an equal gate.
        #[test]
        fn $name() {
            let config = config();
            let model = FlexibleJoint::<$t>::new(&NOMINAL);
            let gated = Gated::<Joint<$t>, 4>::try_design(&config, model).expect("a good design");
            let (law, mut state) = (gated.law(), None);
            let mut rng = Rng::new(0x6A7E);
            let (mut running, mut said) = (Running::new(&gated), SampleGate::default());
            let mut sensor = sensor::Gated::new(
                sensor::Ideal,
                Gate::<$t, 6>::new(&SampleLimits {
                    min: padded(&SAMPLES.min),
                    max: padded(&SAMPLES.max),
                    jump: padded(&SAMPLES.jump),
                }),
            );
            let (mut x, mut taken) = ([0.0; 4], 0);
            for k in 0..200_000 {
                let asked = any_sample(&mut rng, &x);
                // The controller compares the sample in its own precision, so this check does too.
                let sample = asked.map(|value| value as $t);
                let read = sample.map(f64::from);
                let mut measured = [0.0; 4];
                sensor.measure(&asked, &mut measured);
                let is_taken = said.is_taken(&read);
                assert_eq!(measured.map(f64::to_bits) == asked.map(f64::to_bits), is_taken, "tick {k}: {asked:?}");
                assert!(is_taken || measured.iter().all(|value| value.is_nan()));
                let fed = if is_taken { sample } else { [<$t>::NAN; 4] };
                if state.is_none() {
                    state = law.start(&fed);
                }
                let expected = state.as_mut().map_or_else(|| law.not_started(), |state| law.tick(state, &fed));
                assert_eq!(bits(&running.tick(&sample)), bits(&expected), "tick {k}: {asked:?}");
                if is_taken {
                    taken += 1;
                    x = read;
                }
            }
            assert!((20_000..180_000).contains(&taken), "{taken} samples taken: the run shows too little");
        }
    };
}
law_fed_nan!(a_gated_law_is_the_law_fed_nan_for_what_does_not_pass_in_f32, f32);
law_fed_nan!(a_gated_law_is_the_law_fed_nan_for_what_does_not_pass_in_f64, f64);

fn padded(row: &[f64; 4]) -> [f64; 6] {
    std::array::from_fn(|j| row.get(j).copied().unwrap_or(0.0))
}

fn bits<T: Real>(output: &Output<T>) -> ([[u32; 2]; 3], Health) {
    ([output.u, output.sigma, output.sigma_star].map(T::to_words), output.health)
}

#[test]
fn a_sample_that_never_came_is_a_sample_of_nan() {
    let gated = gated();
    let (mut lost, mut fed) = (Running::new(&gated), Running::new(&gated));
    let mut rng = Rng::new(0x1057);
    let mut x = [0.0; 4];
    for k in 0..50_000 {
        x = any_sample(&mut rng, &x).map(|value| if value.is_finite() { value } else { 0.0 });
        let sample = x.map(|value| value as f32);
        let [a, b] = if rng.chance(0.3) {
            [lost.lost(), fed.tick(&[f32::NAN; 4])]
        } else {
            [lost.tick(&sample), fed.tick(&sample)]
        };
        assert_eq!(bits(&a), bits(&b), "tick {k}");
        assert!(lost.words().eq(fed.words()), "the state after tick {k}");
    }
}

/// The state of a gate gets arbitrary values; module `recovery` covers the state of the controller.
#[test]
fn whatever_a_gate_remembers_the_second_of_two_good_samples_is_taken() {
    type State = <Gated<Joint<f32>, 4> as ControlLaw>::State;
    let (gated, good) = (gated(), [0.1_f32, 0.0, 0.0, 0.0]);
    let mut healthy = gated.start(&good).expect("a good sample");
    for _ in 0..100 {
        gated.tick(&mut healthy, &good);
    }
    let mut rng = Rng::new(0x57A7E);
    let (mut lost, mut words) = (0, healthy.words().collect::<Vec<u32>>());
    let first = words.len() - 4;
    for attempt in 0..100_000 {
        let at = rng.integer(first, first + 3);
        words[at] = rng.bits() as u32;
        let Some(mut state) = State::from_words(&mut words.iter().copied()) else {
            words[at] = 0;
            continue;
        };
        let [one, two] = [(); 2].map(|()| gated.tick(&mut state, &good).health.contains(Health::INPUT_REJECTED));
        lost += usize::from(one);
        assert!(!two, "attempt {attempt}: {state:?}");
    }
    assert!(lost > 50_000, "the gate believed {lost} of them only: nothing was tried");
}
