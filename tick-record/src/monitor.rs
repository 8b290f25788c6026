//! Trace of the monitors around a drive, for any control law: the outputs of the law and the thresholds are inputs.
//! Claims about this trace hold for every drive, design and threshold. [`watched`] joins it with the trace of a drive's
//! tick to the trace of the monitored tick.

use controller_core::drive::{Monitored, WatchTicks, Watched};
use controller_core::{ControlLaw, Health, Output, Real, RetuneError, Words};

use crate::drive::QUEUED;
use crate::joined::{Given, Joined};
use crate::law::{self, Recorded};
use crate::record::{Id, Op, Port, Record, Role, ValueKind};
use crate::recorder::{Recorder, Symbol, port};

/// A control law without assumptions: its output is an input.
struct AnyLaw<const E: usize>;

/// The disturbances after its tick, and the speed of the driven shaft.
#[derive(Clone)]
struct Seen<const E: usize>([Symbol; E], Symbol);

impl<const E: usize> Words for Seen<E> {
    fn words(&self) -> impl Iterator<Item = u32> {
        self.0.iter().chain([&self.1]).map(|number| number.to_words()[0])
    }
    fn from_words(words: &mut impl Iterator<Item = u32>) -> Option<Self> {
        let mut next = || Symbol::from_words([words.next().unwrap_or(0), 0]);
        Some(Self(core::array::from_fn(|_| next()), next()))
    }
}

/// Status flags of the law.
const SAID: [(&str, Health); 5] = [
    ("law_rejected", Health::INPUT_REJECTED),
    ("law_saturated", Health::SATURATED),
    ("law_lost", Health::SAMPLE_LOST),
    ("law_stepped", Health::POSITION_STEPPED),
    ("law_waits", Health::WAITS),
];

/// Returns the output of the law with these status bits.
fn said(bits: u16) -> Output<Symbol> {
    let mut health = Health::OK;
    for (name, flag) in SAID.into_iter().filter(|(_, flag)| flag.bits() & bits != 0) {
        if Recorder::of_this_thread().truth(name, Role::Argument) {
            health |= flag;
        }
    }
    let [u, sigma, sigma_star] = ["law_u", "law_sigma", "law_sigma_star"].map(argument);
    Output { u, sigma, sigma_star, health }
}

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
        Some(Seen([Symbol::ZERO; E], Symbol::ZERO))
    }
    fn not_started(&self) -> Output<Symbol> {
        let (sigma, sigma_star) = (Symbol::ZERO, Symbol::ZERO);
        Output { u: argument("fallback"), sigma, sigma_star, health: Health::INPUT_REJECTED }
    }
    fn tick(&self, _: &mut Seen<E>, (): &()) -> Output<Symbol> {
        said(Health::ALL)
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
    fn speed(state: &Seen<E>) -> Symbol {
        state.1
    }
    fn gain(&self) -> Symbol {
        argument("gain")
    }
    fn per_gain(&self) -> Symbol {
        argument("per_gain")
    }
    fn nominal_limits(&self) -> [Symbol; 2] {
        ["nominal_min", "nominal_max"].map(argument)
    }
    fn range(&self, _: &Seen<E>) -> [Symbol; 2] {
        ["u_min", "u_max"].map(argument)
    }
    fn put_instead(_: &mut Seen<E>, _: Symbol) {}
    fn per_rad(&self, _: usize) -> Symbol {
        Symbol::from_f64(1.0)
    }
}

/// Status flags of a monitored drive.
const FLAGS: [(&str, Health); 12] = [
    ("input_rejected", Health::INPUT_REJECTED),
    ("saturated", Health::SATURATED),
    ("sigma_star_over_bound", Health::SIGMA_STAR_OVER_BOUND),
    ("sample_lost", Health::SAMPLE_LOST),
    ("disturbance_over_bound", Health::DISTURBANCE_OVER_BOUND),
    ("stuck_at_limit", Health::STUCK_AT_LIMIT),
    ("stopped_now", Health::STOPPED),
    ("position_stepped", Health::POSITION_STEPPED),
    ("waits", Health::WAITS),
    ("wrong_way", Health::WRONG_WAY),
    ("oscillates", Health::OSCILLATES),
    ("brakes", Health::BRAKES),
];

/// Names of the tick thresholds of the monitors.
pub const TICKS: [&str; 4] = ["stuck_ticks", "wrong_way_ticks", "patience_ticks", "brake_ticks"];

/// Returns the tick thresholds as numbers.
pub fn ticks<T>(of: impl FnMut(&'static str) -> T) -> WatchTicks<T> {
    let [stuck, wrong_way, patience, brake] = TICKS.map(of);
    WatchTicks { stuck, wrong_way, patience, brake }
}

/// Adds the output of the monitors to the results.
fn put_answer(recorder: &Recorder, output: &Output<Symbol>) {
    for (name, number) in [("u", output.u), ("sigma", output.sigma), ("sigma_star", output.sigma_star)] {
        recorder.put(name, Role::Output, number);
    }
    for (name, flag) in FLAGS {
        recorder.put_truth(name, Role::Flag(flag.bits().trailing_zeros() as u8), output.health.contains(flag));
    }
}

impl<const E: usize> Recorded for Monitored<AnyLaw<E>, E> {
    fn state_names() -> Vec<String> {
        let words = state(E).into_iter().map(|port| port.name);
        words.chain((1..=E).map(|i| format!("d{i}"))).chain(["v".into()]).collect()
    }
    fn sample(&self, _: &Recorder) {}
    fn put_output(recorder: &Recorder, output: &Output<Symbol>) {
        put_answer(recorder, output);
    }
    fn put_estimates(_: &Recorder, _: Option<&()>) {}
}

/// Records the monitors of E shafts. The inputs are:
///
/// * the output of a law: `law_u`, `law_sigma`, `law_saturated`, ...,
/// * the disturbances `d1`, .. and the speed `v`,
/// * the `gain` and its inverse `per_gain`,
/// * the present limits of u, `u_min` and `u_max`, and the limits of the design, `nominal_min` and `nominal_max`,
/// * the thresholds `d1_bound`, .., `sigma_star_bound`, [`TICKS`], and `brake`, the u per unit of speed during a brake.
///
/// The alarms `stops_at` stop the drive. Ticks with and without a sample are treated equally.
///
/// # Panics
/// Never: each part has the required results.
pub fn monitor<const E: usize>(stops_at: Health) -> Record {
    let design = |recorder: &Recorder| {
        let bounds = core::array::from_fn(|i| recorder.number(&format!("d{}_bound", i + 1), Role::Argument));
        let sigma_star = argument("sigma_star_bound");
        let watched = Monitored::from_parts(AnyLaw::<E>, bounds, sigma_star, ticks(argument), argument("brake"));
        watched.stopping_at(stops_at)
    };
    // Recording all parts at once has too many paths.
    let part = |f: &dyn Fn(&Recorder, &Monitored<AnyLaw<E>, E>, &mut StateOf<E>)| law::part(&design, f);
    let truth = |name: &str| Recorder::of_this_thread().truth(name, Role::Between);
    let slowing_of = || (Recorder::of_this_thread().number("slowing", Role::Between), truth("is_short"));
    let looked_at = Health::ALL & !Health::POSITION_STEPPED.bits();
    let calm = part(&|recorder, law, state| {
        let output = said((Health::SATURATED | Health::INPUT_REJECTED).bits());
        recorder.put_truth("is_calm", Role::Between, law.is_calm(state, &output));
    });
    let braking = part(&|recorder, law, state| {
        recorder.put_truth("is_braking", Role::Between, law.is_braking(state));
    });
    let watch = part(&|recorder, law, state| {
        let [any, star] = law.watch(state, &said(looked_at & !Health::WAITS.bits()));
        recorder.put_truth("is_any_over", Role::Between, any);
        recorder.put_truth("is_star_over", Role::Between, star);
    });
    let answer = part(&|recorder, law, state| {
        let over = ["is_any_over", "is_star_over"].map(truth);
        put_answer(recorder, &law.answer(state, said(looked_at & !Health::WAITS.bits()), over));
    });
    let begin = part(&|_, law, state| law.begin_brake(state));
    let first = part(&|recorder, _, state| {
        recorder.put_truth("is_first", Role::Between, Monitored::<AnyLaw<E>, E>::is_first(state));
    });
    let slowing = part(&|recorder, law, state| {
        let (slowing, is_short) = law.slowing(state);
        recorder.put("slowing", Role::Between, slowing);
        recorder.put_truth("is_short", Role::Between, is_short);
    });
    let watch_brake =
        part(&|_, law, state| law.watch_brake(state, &said(looked_at & !Health::WAITS.bits()), slowing_of()));
    let slow_down = part(&|recorder, law, state| {
        put_answer(recorder, &law.slow_down(state, said(looked_at & !Health::WAITS.bits()), slowing_of()));
    });
    let waits = part(&|recorder, law, state| {
        put_answer(recorder, &law.wait_for_counts(state, said(looked_at)));
    });

    let mut joined = Joined::default();
    let watched = joined.call(&watch, &|_| None);
    let answered = joined.call(&answer, &|port| watched.get(&port.name, port.role));
    let begun = joined.call(&begin, &|_| None);
    let is_first = joined.call(&first, &|_| None).get("is_first", Role::Between).expect("whether it is the first");
    let slowing = joined.call(&slowing, &|_| None);
    let of_slowing = |port: &Port| slowing.get(&port.name, port.role).filter(|_| port.role == Role::Between);
    let braked = joined.call(&watch_brake, &of_slowing);
    let begins = joined.call(&slow_down, &|port| begun.get(&port.name, port.role).or_else(|| of_slowing(port)));
    let slowed = joined.call(&slow_down, &|port| braked.get(&port.name, port.role).or_else(|| of_slowing(port)));
    let waited = joined.call(&waits, &|_| None);
    let is_braking = joined.call(&braking, &|_| None).get("is_braking", Role::Between).expect("whether it brakes");
    let is_waiting = joined.input("law_waits", Role::Argument, ValueKind::Truth);
    let is_calm = joined.call(&calm, &|_| None).get("is_calm", Role::Between).expect("whether it is calm");
    let stopped = joined.input("stopped", Role::State, ValueKind::Truth);
    let [yes, no] = [true, false].map(|truth| joined.constant(Op::Truth(truth)));
    let zero = joined.constant(Op::Constant(0.0));
    let mut results = Vec::new();
    for (port, answer) in answered.all() {
        let mut input = |name: &str, kind| joined.input(name, Role::Argument, kind);
        // Values for a tick that is not checked, and for a stopped drive.
        let (calm, at_rest) = match port.role {
            Role::State => {
                let before = joined.input(&port.name, port.role, port.kind);
                (before, before)
            }
            Role::Flag(bit) => {
                let told = SAID.iter().find(|(_, flag)| flag.bits() == 1 << bit);
                let told = told.map_or(no, |(name, _)| input(name, ValueKind::Truth));
                let flags = Health::INPUT_REJECTED | Health::STOPPED;
                (told, if flags.bits() >> bit & 1 == 1 { yes } else { no })
            }
            _ => {
                let told = input(&format!("law_{}", port.name), ValueKind::Number);
                (told, if port.name == "u" { input("fallback", ValueKind::Number) } else { zero })
            }
        };
        let handed_on = port.role == Role::Flag(Health::POSITION_STEPPED.bits().trailing_zeros() as u8);
        let of = |given: &Given| given.get(&port.name, port.role).expect("the same results of all");
        let slowed = joined.select(is_first, of(&begins), of(&slowed));
        let looked = joined.select(is_braking, slowed, *answer);
        let looked = joined.select(is_waiting, of(&waited), looked);
        let goes_on = if handed_on { calm } else { joined.select(is_calm, calm, looked) };
        results.push((port.clone(), joined.select(stopped, at_rest, goes_on)));
    }
    joined.record(results)
}

/// The state of a drive without assumptions, with its monitors.
type StateOf<const E: usize> = <Monitored<AnyLaw<E>, E> as ControlLaw>::State;

/// Returns the words that the monitors add before the state of a drive with this number of shafts.
pub fn state(shafts: usize) -> Vec<Port> {
    let numbers =
        ["counted", "stuck", "last_sigma", "swings", "against", "last_speed", "over", "braking", "brake_most"];
    let numbers = numbers.map(String::from);
    let sides = (1..=shafts).map(|shaft| format!("side{shaft}"));
    let number = |name: String| port(&name, Role::State, ValueKind::Number);
    let stopped = port("stopped", Role::State, ValueKind::Truth);
    [stopped].into_iter().chain(numbers.into_iter().chain(sides).map(number)).collect()
}

/// Joins the tick of a drive with its monitors. The inputs are the traces of its `tick`, of its output before the
/// start, of its `limits`, and of the monitors ([`monitor`]). `before` holds all words of the initial state. `shafts`
/// are the suffixes of the names of the disturbances.
///
/// # Panics
/// If the traces do not belong to a drive and to monitors for this number of shafts.
pub fn watched(
    joined: &mut Joined,
    [tick, not_started, limits, monitors]: [&Record; 4],
    before: &[(Port, Id)],
    shafts: &[&str],
) -> Vec<(Port, Id)> {
    let was = |name: &str| before.iter().find(|(port, _)| port.name == name).map(|(_, id)| *id);
    let of_state = |port: &Port| if port.role == Role::State { was(&port.name) } else { None };
    let told = joined.call(tick, &of_state);
    let fallback = joined.call(not_started, &|_| None).get("u", Role::Output);
    let mut of_law = |name: &str| {
        let port = tick.inputs.iter().find(|port| port.name == name);
        port.map(|port| joined.input(&port.name, port.role, port.kind))
    };
    let [gain, per_gain, nominal_min, nominal_max] = ["model_b", "per_b", "u_min", "u_max"].map(&mut of_law);
    let limits =
        joined.call(limits, &|port| if port.role == Role::State { told.get(&port.name, port.role) } else { None });
    let [u_min, u_max] = ["u_low", "u_high"].map(|name| limits.get(name, Role::Between));
    let driven = shafts.last().map(|shaft| format!("v{shaft}")).unwrap_or_default();
    let given = |port: &Port| match (port.name.as_str(), port.role) {
        ("fallback", _) => fallback,
        ("gain", _) => gain,
        ("per_gain", _) => per_gain,
        ("nominal_min", _) => nominal_min,
        ("nominal_max", _) => nominal_max,
        ("u_min", _) => u_min,
        ("u_max", _) => u_max,
        ("v", Role::State) => told.get(&driven, Role::State),
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
        Role::State => state(shafts.len()).contains(port),
        _ => true,
    }))
    .cloned()
    .collect();
    let (brakes, u) = (judged.get_flag(Health::BRAKES), judged.get("u", Role::Output));
    // The last command is the newest one in the queue.
    let commanded = QUEUED.into_iter().rev().find(|name| told.get(name, Role::State).is_some()).unwrap_or("held");
    let zero = joined.constant(Op::Constant(0.0));
    // A stopped drive keeps its state. A braking drive has put out another u, and continues from there.
    for (port, id) in told.all().filter(|(port, _)| port.role == Role::State) {
        let instead = if port.name == "offset" { Some(zero) } else { u.filter(|_| port.name == commanded) };
        let id = match (brakes, instead) {
            (Some(brakes), Some(instead)) => joined.select(brakes, instead, *id),
            _ => *id,
        };
        let before = was(&port.name).expect("every word of the state");
        results.push((port.clone(), joined.select(stopped, before, id)));
    }
    results
}
