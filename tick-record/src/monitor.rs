//! The monitors around a drive as a record, around any law at all: what goes out of the law comes in, and so do the
//! thresholds. What holds of this record holds for every drive, design and threshold.

use controller_core::drive::{Monitored, Watched};
use controller_core::{ControlLaw, Health, Output, Real, RetuneError, Words};

use crate::law::{Recorded, tick};
use crate::record::{Record, Role};
use crate::recorder::{Recorder, Symbol};

/// A law of which nothing is known: its output is an input.
struct AnyLaw<const E: usize>;

/// The disturbances that it sees after its tick.
#[derive(Clone)]
struct Seen<const E: usize>([Symbol; E]);

impl<const E: usize> Words for Seen<E> {
    fn words(&self) -> impl Iterator<Item = u32> {
        self.0.iter().map(|d| d.to_words()[0])
    }
    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        Some(Self(core::array::from_fn(|_| Symbol::from_words([words.next().unwrap_or(0), 0]))))
    }
}

/// What it may say of itself.
const SAID: [(&str, Health); 3] =
    [("law_rejected", Health::INPUT_REJECTED), ("law_saturated", Health::SATURATED), ("law_lost", Health::SAMPLE_LOST)];

fn argument(name: &str) -> Symbol {
    Recorder::of_this_thread().number(name, Role::Argument)
}

impl<const E: usize> ControlLaw for AnyLaw<E> {
    type Scalar = Symbol;
    type Sample = ();
    type Output = Output<Symbol>;
    type State = Seen<E>;
    type Guess = [Symbol; 0];
    type Estimates = ();
    const NO_GUESS: [Symbol; 0] = [];

    fn start_from(&self, (): &(), _: &[Symbol; 0]) -> Option<Seen<E>> {
        Some(Seen([Symbol::ZERO; E]))
    }
    fn not_started(&self) -> Output<Symbol> {
        let (sigma, sigma_star) = (Symbol::ZERO, Symbol::ZERO);
        Output { u: argument("fallback"), sigma, sigma_star, health: Health::INPUT_REJECTED }
    }
    fn tick(&self, _: &mut Seen<E>, (): &()) -> Output<Symbol> {
        let mut health = Health::OK;
        for (name, flag) in SAID {
            if Recorder::of_this_thread().truth(name, Role::Argument) {
                health |= flag;
            }
        }
        let [u, sigma, sigma_star] = ["law_u", "law_sigma", "law_sigma_star"].map(argument);
        Output { u, sigma, sigma_star, health }
    }
    fn lost(&self, state: &mut Seen<E>) -> Output<Symbol> {
        self.tick(state, &())
    }
    fn report_applied(_: &mut Seen<E>, _: Symbol) -> bool {
        false
    }
    fn estimates(&self, _: &Seen<E>) {}
    fn take_over(&self, _: &Self, _: &Seen<E>, (): &()) -> Result<Seen<E>, RetuneError> {
        Err(RetuneError::Sample)
    }
    fn fingerprint(&self) -> u32 {
        0
    }
}

impl<const E: usize> Watched<E> for AnyLaw<E> {
    fn disturbance(state: &Seen<E>) -> [Symbol; E] {
        state.0
    }
    fn per_rad(&self, _: usize) -> Symbol {
        Symbol::from_f64(1.0)
    }
}

/// What a drive with its monitors says.
const FLAGS: [(&str, Health); 7] = [
    ("input_rejected", Health::INPUT_REJECTED),
    ("saturated", Health::SATURATED),
    ("sigma_star_over_bound", Health::SIGMA_STAR_OVER_BOUND),
    ("sample_lost", Health::SAMPLE_LOST),
    ("disturbance_over_bound", Health::DISTURBANCE_OVER_BOUND),
    ("stuck_at_limit", Health::STUCK_AT_LIMIT),
    ("stopped_now", Health::STOPPED),
];

impl<const E: usize> Recorded for Monitored<AnyLaw<E>, E> {
    fn state_names() -> Vec<String> {
        ["stopped", "stuck", "last"].map(String::from).into_iter().chain((1..=E).map(|i| format!("d{i}"))).collect()
    }
    fn sample(&self, _: &Recorder) {}
    fn put_output(recorder: &Recorder, output: &Output<Symbol>) {
        for (name, number) in [("u", output.u), ("sigma", output.sigma), ("sigma_star", output.sigma_star)] {
            recorder.put(name, Role::Output, number);
        }
        for (name, flag) in FLAGS {
            recorder.put_truth(name, Role::Flag(flag.bits().trailing_zeros() as u8), output.health.contains(flag));
        }
    }
    fn put_estimates(_: &Recorder, _: Option<&()>) {}
}

/// Records what the monitors of E shafts make of what a law put out (`law_u`, `law_sigma`, `law_saturated`, ..), of the
/// disturbances `d1`, .. that it sees, and of the thresholds `d1_bound`, .., `sigma_star_bound` and `stuck_ticks`. If
/// they are `stopping` every alarm stops the drive. A tick with a sample and one without are the same to them.
pub fn monitor<const E: usize>(stopping: bool) -> Record {
    let design = |recorder: &Recorder| {
        let bounds = core::array::from_fn(|i| recorder.number(&format!("d{}_bound", i + 1), Role::Argument));
        let [sigma_star, stuck] = ["sigma_star_bound", "stuck_ticks"].map(argument);
        let watched = Monitored::from_parts(AnyLaw::<E>, bounds, sigma_star, stuck);
        if stopping { watched.stopping() } else { watched }
    };
    tick(&design, Monitored::tick)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Word;

    /// The record against the monitors themselves, around a law that says what it is told.
    #[test]
    fn the_record_is_the_monitors() {
        let record = monitor::<1>(true);
        let numbers = |given: &[(&str, f32)]| {
            let inputs: Vec<Word<f32>> = record
                .inputs
                .iter()
                .map(|port| match given.iter().find(|(name, _)| *name == port.name) {
                    Some((_, truth)) if port.kind == crate::Kind::Truth => Word::Truth(*truth != 0.0),
                    None if port.kind == crate::Kind::Truth => Word::Truth(false),
                    Some((_, number)) => Word::Number(*number),
                    None => Word::Number(0.0),
                })
                .collect();
            record.run(&inputs)
        };
        let at = |name: &str| record.results.iter().position(|port| port.name == name).expect(name);
        // 5 A, and 2 rad/s² where 1 are allowed: it stops at 0.5 A.
        let over = numbers(&[("law_u", 5.0), ("fallback", 0.5), ("d1", -2.0), ("d1_bound", 1.0)]);
        assert_eq!((over[at("u")].number(), over[at("stopped")].truth()), (0.5, true));
        assert!(over[at("disturbance_over_bound")].truth() && over[at("stopped_now")].truth());
        // Within the bound nothing happens.
        let calm = numbers(&[("law_u", 5.0), ("fallback", 0.5), ("d1", -0.5), ("d1_bound", 1.0)]);
        assert_eq!((calm[at("u")].number(), calm[at("stopped")].truth()), (5.0, false));
        // The third tick at a limit, where two are allowed.
        let stuck = [("law_saturated", 1.0), ("stuck", 2.0), ("stuck_ticks", 2.0), ("law_sigma", 1.0)];
        assert!(numbers(&stuck)[at("stuck_at_limit")].truth());
        assert_eq!(numbers(&stuck)[at("stuck")].number(), 3.0);
    }
}
