//! Another control law: a motor with one encoder that follows a set-point. Its counts wrap, its observer has two gain
//! sets, and its law has a feed-forward. It is a prototype of the requirements of a drive on `ControlLaw`, `Running`
//! and the trace. It is not a design; its gains are plausible numbers.

use crate::drive::{Ask, Bits, Driven, Plan, Samples, bits, compare, number};
use controller_core::{ControlLaw, Count, Real, RetuneError, Running, Words};
use std::f64::consts::TAU;
use tick_record::{Recorded, Recorder, Role, Symbol};

/// Bits of the encoder.
const BITS: u32 = 14;
const TURN: u32 = 1 << BITS;

/// Factors of the tick, in the order of `NAMES`.
#[derive(Clone, Copy)]
struct Motor<T: Real> {
    k: [T; 24],
    turn: T::Count,
    back: T::Count,
}

#[rustfmt::skip]
const NAMES: [&str; 24] = [
    "unit", "two_pi", "far", "b", "t1", "t2", "phi", "slow1", "slow2", "slow3", "more1", "more2", "more3", "smooth",
    "keep", "calm", "alert", "w_c", "kx", "kw", "us", "ahead", "slope", "decay",
];
#[rustfmt::skip]
const NUMBERS: [f64; 24] = [
    3.835e-4, TAU, 4.712, 250.0, 1e-3, 5e-7, 0.999_95, 0.31, 47.0, 3200.0, 0.2, 70.0, 9000.0, 0.28,
    0.951, 5.75e-4, 9.6e-4, 125.0, -0.47, -0.22, -3.7, 4.0, 2e-4, 0.06,
];

/// Count, set-point and its rate at the end of the next tick; `good` is false if the encoder did not answer.
struct Sample<T: Real> {
    count: T::Count,
    r: T,
    rate: T,
    good: bool,
}

#[derive(Clone)]
struct State<T: Real> {
    last: T::Count,
    position: T::Count,
    /// p, v, d, r, rate, eps, level, offset, held.
    numbers: [T; 9],
    resting: bool,
}

impl<T: Real> Words for State<T> {
    fn words(&self) -> impl Iterator<Item = u32> {
        let counts = [u32::from(self.resting), self.last.to_word(), self.position.to_word()];
        counts.into_iter().chain(self.numbers.words().collect::<Vec<_>>())
    }
    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let resting = words.next()? == 1;
        let (last, position) = (T::Count::from_word(words.next()?), T::Count::from_word(words.next()?));
        Some(Self { last, position, numbers: <[T; 9]>::from_words(words)?, resting })
    }
}

#[derive(Clone, Copy, PartialEq)]
struct Output<T> {
    u: T,
    sigma_star: T,
    health: u8,
}

impl<T: Real> ControlLaw for Motor<T> {
    type Scalar = T;
    type Sample = Sample<T>;
    type Output = Output<T>;
    type State = State<T>;
    type Guess = [T; 0];
    /// Speed, rad/s, and disturbance, rad/s^2.
    type Estimates = [T; 2];
    const NO_GUESS: [T; 0] = [];

    fn start_from(&self, sample: &Sample<T>, _: &[T; 0]) -> Option<State<T>> {
        let [_, w_c] = [0, 17].map(|i: usize| self.k[i]);
        let offset = (-w_c * sample.r - sample.rate).called("offset", 0);
        let zero = T::ZERO;
        let numbers = [zero, zero, zero, sample.r, sample.rate, zero, zero, offset, zero];
        let last = sample.count;
        let sound = sample.good && offset.abs() <= T::from_f64(1e6) && sample.r.abs() <= T::from_f64(1e3);
        sound.then_some(State { last, position: last.since(last), numbers, resting: true })
    }

    fn not_started(&self) -> Output<T> {
        Output { u: T::ZERO, sigma_star: T::ZERO, health: 1 }
    }

    fn lost(&self, state: &mut State<T>) -> Output<T> {
        let [_, _, _, r, rate, ..] = state.numbers;
        self.tick(state, &Sample { count: state.last, r, rate, good: false })
    }

    fn tick(&self, state: &mut State<T>, sample: &Sample<T>) -> Output<T> {
        let [unit, two_pi, far, b, t1, t2, phi, slow @ .., w_c, kx, kw, us, ahead, slope, decay] = self.k;
        let [slow1, slow2, slow3, more1, more2, more3, smooth, keep, calm, alert] = slow;
        let [p, v, d, r, rate, eps, level, offset, held] = state.numbers;

        T::section("Observer.");
        let m = (b * held + d).called("m", 0);
        let mut p = (p + (t1 * v + t2 * m)).called("p", 0);
        let mut v = (phi * v + t1 * m).called("v", 0);
        let (mut d, mut eps, mut level) = (d, eps, level);
        let (mut last, mut position) = (state.last, state.position);
        if sample.good {
            let moved = sample.count.since(last).signed(32 - BITS);
            last = sample.count;
            position = position.plus(moved);
            p -= unit * T::from_count(moved);
            let e = (-p).called("e", 0);
            // Fast gains while the smoothed innovation exceeds the noise.
            eps += smooth * (e - eps);
            let noisy = ((eps.abs() - calm) / alert).limited(T::ZERO, T::from_f64(1.0)).called("noisy", 0);
            level = (level * keep).called("level", 0);
            if noisy > level {
                level = noisy;
            }
            p += (slow1 + level * more1) * e;
            v += (slow2 + level * more2) * e;
            d += (slow3 + level * more3) * e;
        }

        T::section("Whole turns, so that the numbers stay small.");
        let (mut r, mut r_next) = (r, sample.r);
        let angle = (unit * T::from_count(position)).called("angle", 0);
        if angle > far {
            position = position.plus(self.back);
            r -= two_pi;
            r_next -= two_pi;
        } else if angle < -far {
            position = position.plus(self.turn);
            r += two_pi;
            r_next += two_pi;
        }

        T::section("Law.");
        let x = (unit * T::from_count(position) + p).called("angle", 0);
        let e2 = (v - rate).called("e", 2);
        let sigma_star = (w_c * (x - r) + e2 - offset).called("sigma_star", 0);
        let forward = (sample.rate - rate) * ahead + slope * v;
        let demand = (kx * e2 + kw * offset + us * sigma_star + forward - d / b).called("demand", 0);
        // No demand contains the set-point at the end of the tick yet, so it is checked too.
        if !(demand.abs() <= T::from_f64(1e6) && r_next.abs() <= T::from_f64(1e3)) {
            T::section("Not with this.");
            state.resting = false;
            return Output { u: held, sigma_star: T::ZERO, health: 1 };
        }

        T::section("Memory.");
        let mut u = demand.limited(-T::from_f64(10.0), T::from_f64(10.0)).called("u", 0);
        if state.resting {
            u = T::ZERO;
        }
        *state = State {
            last,
            position,
            numbers: [p, v, d, r_next, sample.rate, eps, level, offset - decay * offset, u],
            resting: false,
        };
        Output { u, sigma_star, health: 2 * u8::from(u != demand) }
    }

    fn report_applied(state: &mut State<T>, u: T) -> bool {
        let taken = u.abs() <= T::from_f64(1e6);
        if taken {
            state.numbers[8] = u;
        }
        taken
    }

    fn estimates(&self, state: &State<T>) -> [T; 2] {
        [state.numbers[1], state.numbers[2]]
    }

    fn take_over(&self, _: &Self, state: &State<T>, _: &Sample<T>) -> Result<State<T>, RetuneError> {
        Ok(state.clone())
    }

    fn fingerprint(&self) -> u32 {
        1
    }
}

#[rustfmt::skip]
const WORDS: [&str; 12] =
    ["resting", "last", "position", "p", "v", "d", "r", "rate", "eps", "level", "offset", "held"];

impl Recorded for Motor<Symbol> {
    fn state_names() -> Vec<String> {
        WORDS.map(String::from).to_vec()
    }
    fn sample(&self, recorder: &Recorder) -> Sample<Symbol> {
        Sample {
            count: recorder.count("count", Role::Sample(0)),
            r: recorder.number("r_end", Role::Sample(1)),
            rate: recorder.number("rate_end", Role::Sample(2)),
            good: recorder.truth("good", Role::Sample(3)),
        }
    }
    fn put_output(recorder: &Recorder, output: &Output<Symbol>) {
        recorder.put("u", Role::Output, output.u);
        recorder.put("sigma_star", Role::Output, output.sigma_star);
        recorder.put_truth("rejected", Role::Flag(0), output.health & 1 != 0);
        recorder.put_truth("saturated", Role::Flag(1), output.health & 2 != 0);
    }
    fn put_estimates(recorder: &Recorder, estimates: Option<&[Symbol; 2]>) {
        for (m, name) in ["speed", "disturbance"].into_iter().enumerate() {
            recorder.put(name, Role::Estimate(0, m), estimates.map_or(Symbol::ZERO, |estimates| estimates[m]));
        }
    }
}

/// The motor under test, and the position of its encoder.
struct Turning<T: Real> {
    running: Running<Motor<T>>,
    count: u64,
    speed: f64,
}

impl<T: Real<Count = i32>> Driven for Turning<T> {
    fn lengths(&self) -> [usize; 3] {
        [4, 1, 2]
    }
    fn applied(&self) -> usize {
        1
    }
    fn names(&self) -> Vec<String> {
        Motor::<Symbol>::state_names()
    }
    fn next(&mut self, samples: &mut Samples, double: bool) -> Vec<u64> {
        let numbers = samples.next(2, double);
        let rng = &mut samples.rng;
        self.speed += 20.0 * rng.number();
        self.speed *= if rng.below(200) == 0 { 100.0 } else { 0.99 };
        self.count = self.count.wrapping_add((self.speed + 3.0 * rng.number()) as i64 as u64);
        let read = if rng.below(100) == 0 { rng.bits() } else { self.count % u64::from(TURN) };
        vec![read & 0xffff_ffff, numbers[0], numbers[1], u64::from(rng.below(30) != 0)]
    }
    fn ask(&mut self, ask: Ask, x: &[u64]) -> Bits {
        let sample = Sample { count: x[0] as u32 as i32, r: number(x[1]), rate: number(x[2]), good: x[3] == 1 };
        match ask {
            Ask::Tick => {
                let output = self.running.tick(&sample);
                vec![bits(output.u), bits(output.sigma_star), u64::from(output.health)]
            }
            Ask::ReportApplied => vec![u64::from(self.running.report_applied(number(x[1])))],
            Ask::Start => {
                if self.running.design().start(&sample).is_none() {
                    return vec![0];
                }
                self.running.reset();
                self.ask(Ask::Tick, x)
            }
            Ask::Reset => {
                self.running.reset();
                vec![0]
            }
        }
    }
    fn estimates(&self) -> Option<Bits> {
        self.running.estimates().map(|estimates| estimates.map(bits).to_vec())
    }
    fn words(&self) -> Vec<u32> {
        self.running.words().collect()
    }
}

fn records<T: Real<Count = i32>>(double: bool) {
    let functions = tick_record::functions(&|recorder| {
        let k = std::array::from_fn(|i| recorder.constant(NAMES[i], T::from_f64(NUMBERS[i]).to_f64()));
        let (turn, back) = (recorder.count_of(TURN), recorder.count_of(TURN.wrapping_neg()));
        (Motor::<Symbol> { k, turn, back }, [])
    });
    let motor = Motor::<T> { k: NUMBERS.map(T::from_f64), turn: TURN as i32, back: -(TURN as i32) };
    let mut turning = Turning { running: Running::new(motor), count: 0, speed: 0.0 };
    compare(&mut turning, &functions, &Plan { name: "motor", ticks: 100_000, executed: 100_000, seed: 7, double });
}

#[test]
fn a_motor_with_one_encoder_records_too_in_f32() {
    records::<f32>(false);
}

#[test]
fn a_motor_with_one_encoder_records_too_in_f64() {
    records::<f64>(true);
}
