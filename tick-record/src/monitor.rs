//! The monitors around a drive as a record, around any law at all: what goes out of the law comes in, and so do the
//! thresholds. What holds of this record holds for every drive, design and threshold. Around the record of a drive's
//! tick it is that of the tick with its monitors ([`watched`]).

use controller_core::drive::{Monitored, Watched};
use controller_core::{ControlLaw, Health, Output, Real, RetuneError, Words};

use crate::joined::Joined;
use crate::law::{Recorded, tick};
use crate::record::{Id, Kind, Port, Record, Role};
use crate::recorder::{Recorder, Symbol, port};

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
        ["stopped", "stuck", "last_sigma"]
            .map(String::from)
            .into_iter()
            .chain((1..=E).map(|i| format!("d{i}")))
            .collect()
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

/// The words that the monitors add to the state of a drive, before its own.
pub fn state() -> [Port; 3] {
    let word = |(name, kind)| port(name, Role::State, kind);
    [("stopped", Kind::Truth), ("stuck", Kind::Number), ("last_sigma", Kind::Number)].map(word)
}

/// Joins the tick of a drive with its monitors, of the records of its `tick`, of what it puts out before it has
/// started, and of the monitors ([`monitor`]). `before` is the state that it begins with, of all words of it; `shafts`
/// is what the name of each disturbance ends with.
///
/// # Panics
/// If the records are not those of a drive and of monitors for so many shafts.
pub fn watched(
    joined: &mut Joined,
    [tick, not_started, monitors]: [&Record; 3],
    before: &[(Port, Id)],
    shafts: &[&str],
) -> Vec<(Port, Id)> {
    let was = |name: &str| before.iter().find(|(port, _)| port.name == name).map(|(_, id)| *id);
    let of_state = |port: &Port| if port.role == Role::State { was(&port.name) } else { None };
    let told = joined.call(tick, &of_state);
    let fallback = joined.call(not_started, &|_| None).get("u", Role::Output);
    let given = |port: &Port| match (port.name.as_str(), port.role) {
        ("fallback", _) => fallback,
        (name, Role::State) => match name.strip_prefix('d').and_then(|shaft| shaft.parse::<usize>().ok()) {
            Some(shaft) => told.get(&format!("d{}", shafts[shaft - 1]), Role::State),
            None => was(name),
        },
        (name, _) => match SAID.iter().find(|(said, _)| *said == name) {
            Some((_, flag)) => told.get_flag(*flag),
            None => told.get(name.strip_prefix("law_")?, Role::Output),
        },
    };
    let judged = joined.call(monitors, &given);
    let stopped = was("stopped").expect("the words of the monitors");
    let mut results: Vec<(Port, Id)> = (judged.all().filter(|(port, _)| match port.role {
        Role::State => state().contains(port),
        _ => true,
    }))
    .cloned()
    .collect();
    // A drive that has stopped stays as it is.
    for (port, id) in told.all().filter(|(port, _)| port.role == Role::State) {
        let before = was(&port.name).expect("every word of the state");
        results.push((port.clone(), joined.select(stopped, before, *id)));
    }
    results
}

#[cfg(test)]
mod tests {
    use controller_core::drive::{Encoder, Motor, MotorDesign, MotorDrive, Mounting, Position, Sample, Target};
    use controller_core::{Limits, Words as _};

    use super::*;
    use crate::drive;
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
                    Some((_, truth)) if port.kind == Kind::Truth => Word::Truth(*truth != 0.0),
                    None if port.kind == Kind::Truth => Word::Truth(false),
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

    /// Random ticks, whatever they are told, of a motor whose thresholds are low: every alarm, and what follows it.
    #[test]
    fn a_joined_tick_is_that_of_the_drive_with_its_monitors() {
        const MOTOR: Motor = Motor { inertia_kg_m2: 2e-4, torque_n_m_per_a: 0.05, damping_n_m_s: 1e-5 };
        const DESIGN: MotorDesign = MotorDesign::by_rule(1e-3, MOTOR, Encoder::absolute(14), Limits::symmetric(10.0));
        let (tick, functions) = (
            drive::motor_tick::<Position, 0, 0, 3>(&DESIGN, Mounting::UPRIGHT).expect("a design"),
            drive::motor::<Position, 0, 0, 3>(&DESIGN, Mounting::UPRIGHT).expect("a design"),
        );
        let of_drive = tick.inputs.iter().filter(|port| port.role == Role::State).cloned();
        let words: Vec<Port> = state().into_iter().chain(of_drive).collect();
        let mut joined = Joined::default();
        let before: Vec<(Port, Id)> =
            words.iter().map(|port| (port.clone(), joined.input(&port.name, port.role, port.kind))).collect();
        let results = watched(&mut joined, [&tick, &functions.not_started, &monitor::<1>(true)], &before, &[""]);
        let record = joined.record(results);

        let thresholds = [("d1_bound", 4000.0), ("sigma_star_bound", 5.0), ("stuck_ticks", 3.0)];
        let [d, star, stuck] = thresholds.map(|(_, threshold)| threshold);
        let law = Monitored::from_parts(MotorDrive::<f32, Position>::design(&DESIGN), [d], star, stuck).stopping();
        let mut random = 1_u32;
        let mut below = |end: u32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) % end
        };
        let (mut held, mut seen, mut stopped) = (None, 0, 0);
        let mut count = 0_i32;
        for _ in 0..20_000 {
            let step = [3, 40, 400, 16_384][below(20).saturating_sub(16) as usize];
            count = count.wrapping_add(below(2 * step + 1) as i32 - step as i32);
            let far = [1e-3, 1.0, 1e4, f32::NAN][below(40).saturating_sub(36) as usize];
            let target = |turn: u32, share: u32| Target { turn: turn as i32, jet: [far * share as f32 / 100.0, far] };
            let (begin, end) = (target(below(2), below(100)), target(below(2), below(100)));
            let sample = Sample { counts: [(below(8) > 0).then_some(count)], begin, end };
            let Some(state) = &mut held else {
                held = law.start(&sample);
                continue;
            };
            let inputs: Vec<u32> = state.words().collect();
            let word = |name: &str| words.iter().position(|port| port.name == name);
            let of_kind = |port: &Port, bits: u32| match port.kind {
                Kind::Number => Word::Number(f32::from_bits(bits)),
                Kind::Count => Word::Count(bits as i32),
                Kind::Truth => Word::Truth(bits == 1),
            };
            let given = |port: &Port| match (port.role, port.name.as_str()) {
                (Role::State, name) => of_kind(port, inputs[word(name).expect("a word")]),
                (Role::Sample(_), _) => Word::Count(sample.counts[0].unwrap_or(7)),
                (_, "lost") => Word::Truth(sample.counts[0].is_none()),
                (_, "begin_turn") => Word::Count(begin.turn),
                (_, "end_turn") => Word::Count(end.turn),
                (_, "begin_r") => Word::Number(begin.jet[0]),
                (_, "begin_r_dot") => Word::Number(begin.jet[1]),
                (_, "end_r") => Word::Number(end.jet[0]),
                (_, "end_r_dot") => Word::Number(end.jet[1]),
                (_, name) => {
                    Word::Number(thresholds.iter().find(|(threshold, _)| *threshold == name).expect("a threshold").1)
                }
            };
            let found = record.run(&record.inputs.iter().map(given).collect::<Vec<_>>());
            let output = law.tick(state, &sample);
            let after: Vec<u32> = state.words().collect();
            for (port, found) in record.results.iter().zip(found) {
                let wanted = match port.role {
                    Role::State => of_kind(port, after[word(&port.name).expect("a word")]),
                    Role::Flag(bit) => Word::Truth(output.health.bits() >> bit & 1 == 1),
                    _ if port.name == "u" => Word::Number(output.u),
                    _ if port.name == "sigma" => Word::Number(output.sigma),
                    _ => Word::Number(output.sigma_star),
                };
                let bits = |word: Word<f32>| match word {
                    Word::Number(number) if number.is_nan() => f32::NAN.to_bits(),
                    Word::Number(number) => number.to_bits(),
                    Word::Count(count) => count as u32,
                    Word::Truth(truth) => truth.into(),
                };
                assert_eq!(bits(found), bits(wanted), "{}", port.name);
            }
            seen |= output.health.bits();
            stopped += u32::from(output.health.contains(Health::STOPPED));
            if stopped % 4 == 3 {
                (held, stopped) = (None, 0);
            }
        }
        assert_eq!(seen, 127, "every alarm was raised");
    }
}
