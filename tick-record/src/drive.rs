//! Traces of a drive: counts and targets in, u out, as the parts of its tick.
//!
//! ```text
//! tick:  fresh?  begin --known?--> not_started      else  observe --known?--> give_up --> follow --> carry
//!                  `-----------------> law <---------------'
//!                                       `--> follow --missing?--> carry
//! lost:  waiting?  begin --> not_started
//!        else      observe, nothing there --known?--> give_up, else refuse, then follow, carry
//! ```
//!
//! A part is a function of the core that the tick calls. Values that one part passes to another, and that are not words
//! of the state (sines, cosines, couplings, a lost sample), are matched by their names.

use controller_core::drive::{
    ANY_STAGE, Aim, ChainModel, CoupledDrive, DriveError, DriveEstimates, EncoderForm, FullState, Hold, JointDesign,
    JointDrive, JointModel, Measured, MotorDesign, MotorDrive, MotorModel, Mounting, NumberName, Position, Sample,
    Speed, Target, TwoMass, Watched,
};
use controller_core::{ControlLaw, Controller, Health, Linear, Output, Real, Words as _, as_within};

use crate::law::{Around, Functions, Recorded, Words, around, coefficients_of, functions, of_numbers, recorded};
use crate::record::{Port, Record, Role, ValueKind};
use crate::recorder::{CountSymbol, Recorder, Symbol, port};

/// The functions of a drive, each as a trace. The module page shows how they make a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveFunctions {
    /// The state words, in the order of `words` of a running drive, then `started`.
    pub state: Vec<Port>,
    /// The values that the parts of a tick pass on.
    pub between: Vec<Port>,
    /// [`ControlLaw::start_from`] without a guess: sample -> state. The answer is true if it has started.
    pub start: Record,
    /// [`ControlLaw::not_started`].
    pub not_started: Record,
    /// The first tick of a state, without a previous tick.
    pub begin: Record,
    /// Selects the accepted counts and runs the observers. The answer is false if too many samples are missing.
    pub observe: Record,
    /// The control law, from the estimates to u, and the memory.
    pub law: Record,
    /// Outputs the fallback and restarts the observers, since the position is unknown.
    pub give_up: Record,
    /// Outputs the fallback, since there is no valid demand.
    pub refuse: Record,
    /// A period without a tick. The answer is false if too many samples are missing.
    pub pass: Record,
    /// Moves the base after a tick.
    pub follow: Record,
    /// Law and follow in one trace, with the conditions of an ordinary tick.
    pub followed: Record,
    /// Moves counts with the prediction, after a tick with a missing count.
    pub carry: Record,
    /// The limits of u with the limit of the power stage, `u_low` and `u_high`.
    pub limits: Record,
    /// [`Running::report_applied`](controller_core::Running::report_applied).
    pub report_applied: Record,
    /// [`Running::estimates`](controller_core::Running::estimates); zeros and the answer false before the start.
    pub estimates: Record,
    /// [`Running::reset`](controller_core::Running::reset).
    pub reset: Record,
}

/// A model of a drive with names for its values.
pub trait NamedModel<const E: usize, const N: usize>: ChainModel<Symbol, E, N> + 'static {
    /// Suffixes of the names that belong to each shaft.
    const SHAFTS: [&'static str; E];
    /// Suffixes of the `push` words: couplings and other terms that act on the model.
    const PUSHED: &'static [&'static str];
    /// Names of the values that follow the smoothed innovation of each encoder.
    const LEVELS: [&'static str; E];
    /// Names of the values computed from the positions.
    const SEEN: &'static [&'static str];
    /// Returns these values as numbers.
    fn numbers_of(seen: &Self::Seen) -> Vec<Symbol>;
    /// Returns these values from numbers.
    fn seen_of(numbers: &[Symbol]) -> Self::Seen;
}

impl NamedModel<1, 2> for MotorModel<Symbol> {
    const SHAFTS: [&'static str; 1] = [""];
    const PUSHED: &'static [&'static str] = &[];
    const LEVELS: [&'static str; 1] = ["level"];
    const SEEN: &'static [&'static str] = &[];
    fn numbers_of((): &()) -> Vec<Symbol> {
        Vec::new()
    }
    fn seen_of(_: &[Symbol]) {}
}

impl NamedModel<2, 4> for JointModel<Symbol> {
    const SHAFTS: [&'static str; 2] = ["_link", "_motor"];
    const PUSHED: &'static [&'static str] = &Self::SHAFTS;
    const LEVELS: [&'static str; 2] = ["level_link", "level_motor"];
    const SEEN: &'static [&'static str] = &["g_sin", "g_cos"];
    fn numbers_of(seen: &[Symbol; 2]) -> Vec<Symbol> {
        seen.to_vec()
    }
    fn seen_of(numbers: &[Symbol]) -> [Symbol; 2] {
        core::array::from_fn(|i| numbers[i])
    }
}

impl NamedModel<2, 4> for TwoMass<Symbol> {
    const SHAFTS: [&'static str; 2] = ["_link", "_motor"];
    const PUSHED: &'static [&'static str] = &["_link", "_current", "_asked"];
    const LEVELS: [&'static str; 2] = ["level", "burst"];
    const SEEN: &'static [&'static str] = &["g_sin", "g_cos"];
    fn numbers_of(seen: &[Symbol; 2]) -> Vec<Symbol> {
        seen.to_vec()
    }
    fn seen_of(numbers: &[Symbol]) -> [Symbol; 2] {
        core::array::from_fn(|i| numbers[i])
    }
}

/// A control mode with names for its targets.
pub trait NamedAim<const N: usize>: Aim<Symbol, N> {
    /// Returns the target at the `begin` or the `end` of a tick, from the inputs.
    fn target(recorder: &Recorder, when: &str) -> Self::Target;
}

/// Names of r and its derivatives.
pub const JET: [&str; 4] = ["r", "r_dot", "r_ddot", "r_dddot"];

impl<const N: usize> NamedAim<N> for Position {
    fn target(recorder: &Recorder, when: &str) -> Target<Symbol, CountSymbol, N> {
        let number = |name: &str| recorder.number(&format!("{when}_{name}"), Role::Argument);
        let turn = recorder.count(&format!("{when}_turn"), Role::Argument);
        Target { turn, jet: core::array::from_fn(|j| number(JET[j])) }
    }
}

impl NamedAim<2> for Speed {
    fn target(recorder: &Recorder, when: &str) -> Symbol {
        recorder.number(&format!("{when}_speed"), Role::Argument)
    }
}

/// A drive and the mounting of its encoders.
struct Mounted<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> {
    law: EncoderForm<Symbol, M, A, E, N, S, FAST, LATE>,
    mounting: [Mounting; E],
}

impl<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>
    Mounted<M, A, E, N, S, FAST, LATE>
where
    M: NamedModel<E, N>,
    A: NamedAim<N>,
{
    /// Returns the counts of the sample, `None` for lost ones.
    fn counts(&self, recorder: &Recorder) -> [Option<CountSymbol>; E] {
        core::array::from_fn(|i| {
            let shaft = M::SHAFTS[i];
            let lost = recorder.truth(&format!("lost{shaft}"), Role::Argument);
            let count = recorder.count(&format!("count{shaft}"), Role::Sample(i));
            let mounting = self.mounting[i];
            (!lost).then(|| if mounting == Mounting::UPRIGHT { count } else { mounting.upright(count) })
        })
    }

    /// Runs the control law on the results of the observers.
    fn ask(&self, recorder: &Recorder, state: &mut StateOf<M, A, E, N, S, FAST, LATE>) {
        let begins = recorder.truth("begins", Role::Between);
        let number = |name: &str| recorder.number(name, Role::Between);
        let seen = M::seen_of(&M::SEEN.iter().map(|name| number(name)).collect::<Vec<_>>());
        let push: Vec<u32> = M::PUSHED.iter().map(|shaft| number(&push_before(shaft)).to_words()[0]).collect();
        let push = recorder.silently(|| M::Push::from_words(&mut push.into_iter())).expect("the words of couplings");
        let [begin, end] = ["begin", "end"].map(|when| A::target(recorder, when));
        let sample = Sample { counts: [None; E], begin, end };
        Self::put_output(recorder, &self.law.ask_rest::<ANY_STAGE>(state, &sample, seen, &push, begins));
    }
}

impl<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> ControlLaw
    for Mounted<M, A, E, N, S, FAST, LATE>
where
    M: NamedModel<E, N>,
    A: NamedAim<N>,
{
    as_within!(EncoderForm<Symbol, M, A, E, N, S, FAST, LATE>: self => self.law, from => &from.law);

    fn fingerprint(&self) -> u32 {
        0
    }
}

/// Names of the queued u with three ticks of delay. The u held now comes first; with a shorter delay the other names
/// are absent.
pub const QUEUED: [&str; 3] = ["queued", "queued_2", "queued_3"];

/// Returns the names of the state numbers, in their order, for `states` estimates per shaft, two gain sets and `late`
/// ticks of delay.
fn state_names<M, const E: usize, const N: usize>(states: usize, has_fast: bool, late: usize) -> Vec<String>
where
    M: NamedModel<E, N>,
{
    let (shafts, pushed) = (&M::SHAFTS, M::PUSHED);
    let of = |names: &[&str], shafts: &[&str]| -> Vec<String> {
        shafts.iter().flat_map(|shaft| names.iter().map(move |name| format!("{name}{shaft}"))).collect()
    };
    let mut all = vec!["fresh".into()];
    all.extend(of(&["last"], shafts));
    all.extend(of(&["at"], shafts));
    all.push("turn".into());
    all.extend(of(&["push"], pushed));
    all.extend(of(&["p", "v", "d", "d_dot"][..states], shafts));
    if has_fast {
        let names = shafts.iter().zip(M::LEVELS);
        all.extend(names.flat_map(|(shaft, level)| [format!("smoothed{shaft}"), level.into()]));
    }
    all.push("reach".into());
    all.extend(of(&["missed"], shafts));
    all.extend(of(&["off"], shafts));
    all.extend(["doubt", "offset", "held", "limit", "reported"].map(String::from));
    all.extend(QUEUED[..late].iter().copied().map(String::from));
    all
}

impl<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> Recorded
    for Mounted<M, A, E, N, S, FAST, LATE>
where
    M: NamedModel<E, N>,
    A: NamedAim<N>,
{
    fn state_names() -> Vec<String> {
        state_names::<M, E, N>(S, FAST == 1, LATE)
    }

    fn sample(&self, recorder: &Recorder) -> Self::Sample {
        let [begin, end] = ["begin", "end"].map(|when| A::target(recorder, when));
        Sample { counts: self.counts(recorder), begin, end }
    }

    fn put_output(recorder: &Recorder, output: &Output<Symbol>) {
        for (name, number) in [("u", output.u), ("sigma", output.sigma), ("sigma_star", output.sigma_star)] {
            recorder.put(name, Role::Output, number);
        }
        for (name, flag) in FLAGS {
            recorder.put_truth(name, Role::Flag(flag.bits().trailing_zeros() as u8), output.health.contains(flag));
        }
    }

    fn put_estimates(recorder: &Recorder, estimates: Option<&DriveEstimates<Symbol, CountSymbol, E>>) {
        recorder.put_count("turn", Role::Output, estimates.map_or_else(|| recorder.count_of(0), |known| known.turn));
        for (i, shaft) in M::SHAFTS.iter().enumerate() {
            let all = estimates.map_or([Symbol::ZERO; 4], |known| {
                [known.position[i], known.speed[i], known.disturbance[i], known.load[i]]
            });
            for (name, number) in ["position", "speed", "disturbance", "load"].into_iter().zip(all) {
                recorder.put(&format!("{name}{shaft}"), Role::Output, number);
            }
        }
    }
}

/// Status flags of a drive.
const FLAGS: [(&str, Health); 5] = [
    ("input_rejected", Health::INPUT_REJECTED),
    ("saturated", Health::SATURATED),
    ("sample_lost", Health::SAMPLE_LOST),
    ("position_stepped", Health::POSITION_STEPPED),
    ("waits", Health::WAITS),
];

/// Flags that a tick adds to the status of its law: observations of the observers, by their names between the parts.
pub const TOLD: [(&str, Health); 2] = [("missing", Health::SAMPLE_LOST), ("stepped", Health::POSITION_STEPPED)];

/// Records a drive in its parts. `design` creates it from [constants](Recorder::constant), or from
/// [numbers](Recorder::number) that any design may hold.
///
/// # Panics
/// If the names of a model or of a control mode do not fit its state.
pub fn drive<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    design: &dyn Fn(&Recorder) -> EncoderForm<Symbol, M, A, E, N, S, FAST, LATE>,
    mounting: [Mounting; E],
) -> DriveFunctions
where
    M: NamedModel<E, N>,
    A: NamedAim<N>,
    EncoderForm<Symbol, M, A, E, N, S, FAST, LATE>: 'static,
{
    let mounted = |recorder: &Recorder| -> Mounted<M, A, E, N, S, FAST, LATE> {
        Mounted { law: recorder.silently(|| design(recorder)), mounting }
    };
    let (words, Around { start, not_started, report_applied, estimates, reset }) =
        around(&|recorder| (mounted(recorder), EncoderForm::<Symbol, M, A, E, N, S, FAST, LATE>::NO_GUESS));
    // A state that is not fresh and stays so.
    let going_on = words.without("fresh");
    let part = |words: &Words, f: &Part<'_, Mounted<M, A, E, N, S, FAST, LATE>, StateOf<M, A, E, N, S, FAST, LATE>>| {
        recorded(&mounted, &|recorder, law| {
            let mut state = words.state(recorder);
            f(recorder, law, &mut state);
            words.put(recorder, &state.words().collect::<Vec<_>>());
        })
    };
    let law = part(&going_on, &|recorder, law, state| law.ask(recorder, state));
    let mut between: Vec<Port> =
        law.inputs.iter().filter(|port| port.role == Role::Between && law.reads(port)).cloned().collect();
    // The flags of the tick besides the flags of the law.
    between.extend(TOLD.map(|(name, _)| port(name, Role::Between, ValueKind::Truth)));
    let put_seen = |recorder: &Recorder, seen: &M::Seen| {
        M::SEEN.iter().zip(M::numbers_of(seen)).for_each(|(name, number)| hand_on(recorder, &between, name, number));
    };
    // Couplings of the previous tick are passed on unchanged.
    let put_before = |recorder: &Recorder| {
        for shaft in M::PUSHED {
            hand_on(recorder, &between, &push_before(shaft), recorder.number(&format!("push{shaft}"), Role::State));
        }
    };
    let begin = part(&words, &|recorder, law, state| {
        put_before(recorder);
        let (seen, begins, known) = law.law.begun(state, &law.counts(recorder));
        put_seen(recorder, &seen);
        recorder.put_truth("missing", Role::Between, false);
        recorder.put_truth("stepped", Role::Between, false);
        recorder.put_truth("begins", Role::Between, begins);
        recorder.put_truth("answer", Role::Answer, known);
    });
    let observe = part(&going_on, &|recorder, law, state| {
        put_before(recorder);
        let seen = law.law.observe_rest(state, &law.counts(recorder));
        put_seen(recorder, &seen.seen);
        recorder.put_truth("missing", Role::Between, seen.missing);
        recorder.put_truth("stepped", Role::Between, seen.stepped);
        recorder.put_truth("begins", Role::Between, false);
        recorder.put_truth("answer", Role::Answer, seen.known);
    });
    let give_up = part(&words, &|recorder, law, state| {
        let output = law.law.give_up(state, &law.counts(recorder));
        Mounted::<M, A, E, N, S, FAST, LATE>::put_output(recorder, &output);
    });
    let refuse = part(&going_on, &|recorder, law, state| {
        let output = law.law.refuse(state, Health::SAMPLE_LOST);
        Mounted::<M, A, E, N, S, FAST, LATE>::put_output(recorder, &output);
    });
    let pass = part(&going_on, &|recorder, law, state| {
        let known = law.law.pass(state);
        recorder.put_truth("answer", Role::Answer, known);
    });
    let follow = part(&going_on, &|_, law, state| law.law.follow(state));
    let followed = part(&going_on, &|recorder, law, state| {
        law.ask(recorder, state);
        law.law.follow(state);
    });
    let carry = part(&going_on, &|_, law, state| law.law.carry(state));
    let limits = part(&going_on, &|recorder, law, state| {
        let [low, high] = law.law.range(state);
        recorder.put("u_low", Role::Between, low);
        recorder.put("u_high", Role::Between, high);
    });
    DriveFunctions {
        state: words.ports(),
        between,
        start,
        not_started,
        begin,
        observe,
        law,
        give_up,
        refuse,
        pass,
        follow,
        followed,
        carry,
        limits,
        report_applied,
        estimates,
        reset,
    }
}

/// Passes a number to the law if the law reads it.
fn hand_on(recorder: &Recorder, between: &[Port], name: &str, number: Symbol) {
    if between.iter().any(|port| port.name == name) {
        recorder.put(name, Role::Between, number);
    }
}

/// Returns the name of a coupling of the previous tick.
fn push_before(shaft: &str) -> String {
    format!("push{shaft}_before")
}

/// A recorded function of a law and a state.
type Part<'a, L, S> = dyn Fn(&Recorder, &L, &mut S) + 'a;

type StateOf<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize> =
    <EncoderForm<Symbol, M, A, E, N, S, FAST, LATE> as ControlLaw>::State;

/// Returns a number of the design as a named constant: `unit_link`, `gain_motor_2`, `kx_3`.
fn named<M: NamedModel<E, N>, const E: usize, const N: usize>(
    recorder: &Recorder,
    name: NumberName,
    number: f32,
) -> Symbol {
    recorder.constant(&full_name::<M, E, N>(name), f64::from(number))
}

fn full_name<M: NamedModel<E, N>, const E: usize, const N: usize>(name: NumberName) -> String {
    let NumberName { name, encoder, entry } = name;
    let shaft = if encoder == 0 { "" } else { M::SHAFTS[encoder - 1] };
    let entry = if entry == 0 { String::new() } else { format!("_{entry}") };
    format!("{name}{shaft}{entry}")
}

impl<const N: usize> NamedAim<N> for Hold {
    fn target(_: &Recorder, _: &str) {}
}

/// Records one tick of a drive as a whole. `design` creates it from constants or from [numbers](Recorder::number) that
/// any design may hold. Its encoders count in the direction of the shafts.
pub fn tick<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    design: &dyn Fn(&Recorder) -> EncoderForm<Symbol, M, A, E, N, S, FAST, LATE>,
) -> Record
where
    M: NamedModel<E, N>,
    A: NamedAim<N>,
{
    mounted_tick(design, [Mounting::UPRIGHT; E])
}

fn mounted_tick<M, A, const E: usize, const N: usize, const S: usize, const FAST: usize, const LATE: usize>(
    design: &dyn Fn(&Recorder) -> EncoderForm<Symbol, M, A, E, N, S, FAST, LATE>,
    mounting: [Mounting; E],
) -> Record
where
    M: NamedModel<E, N>,
    A: NamedAim<N>,
{
    let mounted = |recorder: &Recorder| Mounted { law: design(recorder), mounting };
    crate::tick::<Mounted<M, A, E, N, S, FAST, LATE>>(&mounted, Mounted::tick)
}

/// Returns the drive of a motor with the numbers that `number` returns by name.
pub fn motor_of<U: Real, A: Aim<f32, 2>, const FAST: usize, const LATE: usize, const S: usize>(
    drive: &MotorDrive<f32, A, FAST, LATE, S>,
    number: &mut dyn FnMut(&str) -> U,
) -> MotorDrive<U, A, FAST, LATE, S> {
    let model = drive.model().converted(&mut |name, _| number(&format!("model_{name}")));
    drive.converted(model, &mut |name, _| number(&full_name::<MotorModel<Symbol>, 1, 2>(name)))
}

/// Returns the drive of a joint with the numbers that `number` returns by name.
pub fn joint_of<U: Real, A: Aim<f32, 4>, const FAST: usize, const LATE: usize>(
    drive: &JointDrive<f32, A, FAST, LATE>,
    number: &mut dyn FnMut(&str) -> U,
) -> JointDrive<U, A, FAST, LATE> {
    let model = drive.model().converted(&mut |name, _| number(&format!("model_{name}")));
    drive.converted(model, &mut |name, _| number(&full_name::<JointModel<Symbol>, 2, 4>(name)))
}

/// Returns the law of a joint on a measured state with the numbers that `number` returns by name.
pub fn measured_of<U: Real, A: Aim<f32, 4>, const R: usize, const MASK: u8, const O: usize>(
    law: &FullState<f32, JointModel<f32>, A, 2, 4, R, MASK, O, 0>,
    number: &mut dyn FnMut(&str) -> U,
) -> FullState<U, JointModel<U>, A, 2, 4, R, MASK, O, 0> {
    // The results of the map replace the row.
    let within = Controller::from_parts(coefficients_of(MASK, number), Linear::from_row([U::ZERO; 4]));
    let map = law.model().converted(&mut |name, _| number(&format!("model_{name}")));
    law.converted(within, map, &mut |name, entry, _| {
        let entry = if entry == 0 { String::new() } else { format!("_{entry}") };
        number(&format!("{name}{entry}"))
    })
}

/// Records the parts of a motor's drive in f32.
///
/// # Errors
/// If the design is invalid.
pub fn motor<A, const FAST: usize, const LATE: usize, const S: usize>(
    design: &MotorDesign,
    mounting: Mounting,
) -> Result<DriveFunctions, DriveError>
where
    A: NamedAim<2> + Aim<f32, 2> + Aim<f64, 2>,
{
    let drive = MotorDrive::<f32, A, FAST, LATE, S>::try_design(design)?;
    Ok(self::drive(&|recorder| motor_of_constants(&drive, recorder), [mounting]))
}

/// Records one tick of a motor's drive in f32, as a whole.
///
/// # Errors
/// If the design is invalid.
pub fn motor_tick<A, const FAST: usize, const LATE: usize, const S: usize>(
    design: &MotorDesign,
    mounting: Mounting,
) -> Result<Record, DriveError>
where
    A: NamedAim<2> + Aim<f32, 2> + Aim<f64, 2>,
{
    let drive = MotorDrive::<f32, A, FAST, LATE, S>::try_design(design)?;
    Ok(mounted_tick(&|recorder| recorder.silently(|| motor_of_constants(&drive, recorder)), [mounting]))
}

fn motor_of_constants<A: Aim<f32, 2> + Aim<Symbol, 2>, const FAST: usize, const LATE: usize, const S: usize>(
    drive: &MotorDrive<f32, A, FAST, LATE, S>,
    recorder: &Recorder,
) -> MotorDrive<Symbol, A, FAST, LATE, S> {
    let model = drive.model().converted(&mut |name, number| recorder.constant(name, f64::from(number)));
    drive.converted(model, &mut |name, number| named::<MotorModel<Symbol>, 1, 2>(recorder, name, number))
}

/// Records the parts of a joint's drive in f32.
///
/// # Errors
/// If the design is invalid.
pub fn joint<A, const FAST: usize, const LATE: usize>(
    design: &JointDesign,
    mounting: [Mounting; 2],
) -> Result<DriveFunctions, DriveError>
where
    A: NamedAim<4> + Aim<f32, 4> + Aim<f64, 4>,
{
    if design.coupled.is_some() {
        let drive = CoupledDrive::<f32, A, FAST, LATE>::try_design(design)?;
        return Ok(self::drive(&|recorder| coupled_of_constants(&drive, recorder), mounting));
    }
    let drive = JointDrive::<f32, A, FAST, LATE>::try_design(design)?;
    Ok(self::drive(&|recorder| joint_of_constants(&drive, recorder), mounting))
}

/// Records one tick of a joint's drive in f32, as a whole.
///
/// # Errors
/// If the design is invalid.
pub fn joint_tick<A, const FAST: usize, const LATE: usize>(
    design: &JointDesign,
    mounting: [Mounting; 2],
) -> Result<Record, DriveError>
where
    A: NamedAim<4> + Aim<f32, 4> + Aim<f64, 4>,
{
    if design.coupled.is_some() {
        let drive = CoupledDrive::<f32, A, FAST, LATE>::try_design(design)?;
        return Ok(mounted_tick(&|recorder| recorder.silently(|| coupled_of_constants(&drive, recorder)), mounting));
    }
    let drive = JointDrive::<f32, A, FAST, LATE>::try_design(design)?;
    Ok(mounted_tick(&|recorder| recorder.silently(|| joint_of_constants(&drive, recorder)), mounting))
}

fn joint_of_constants<A: Aim<f32, 4> + Aim<Symbol, 4>, const FAST: usize, const LATE: usize>(
    drive: &JointDrive<f32, A, FAST, LATE>,
    recorder: &Recorder,
) -> JointDrive<Symbol, A, FAST, LATE> {
    let model = drive.model().converted(&mut |name, number| recorder.constant(name, f64::from(number)));
    drive.converted(model, &mut |name, number| named::<JointModel<Symbol>, 2, 4>(recorder, name, number))
}

fn coupled_of_constants<A: Aim<f32, 4> + Aim<Symbol, 4>, const FAST: usize, const LATE: usize>(
    drive: &CoupledDrive<f32, A, FAST, LATE>,
    recorder: &Recorder,
) -> CoupledDrive<Symbol, A, FAST, LATE> {
    let model = drive.model().converted(&mut |name, number| named::<TwoMass<Symbol>, 2, 4>(recorder, name, number));
    drive.converted(model, &mut |name, number| named::<TwoMass<Symbol>, 2, 4>(recorder, name, number))
}

impl<M, A, const E: usize, const N: usize, const R: usize, const MASK: u8, const O: usize> Recorded
    for FullState<Symbol, M, A, E, N, R, MASK, O, 0>
where
    M: ChainModel<Symbol, E, N> + 'static,
    A: NamedAim<N> + 'static,
{
    fn state_names() -> Vec<String> {
        <Controller<Symbol, Linear<Symbol, N>, N, R, MASK, O>>::state_names()
    }

    fn sample(&self, recorder: &Recorder) -> Self::Sample {
        let [begin, end] = ["begin", "end"].map(|when| A::target(recorder, when));
        Measured { x: self.controller().sample(recorder), begin, end }
    }

    fn put_output(recorder: &Recorder, output: &Output<Symbol>) {
        <Controller<Symbol, Linear<Symbol, N>, N, R, MASK, O>>::put_output(recorder, output);
    }

    fn put_estimates(recorder: &Recorder, estimates: Option<&[[Symbol; R]; N]>) {
        <Controller<Symbol, Linear<Symbol, N>, N, R, MASK, O>>::put_estimates(recorder, estimates);
    }
}

/// Records the law of a joint on a measured state, in f32.
pub fn measured<A, const R: usize, const MASK: u8, const O: usize>(
    law: &FullState<f32, JointModel<f32>, A, 2, 4, R, MASK, O, 0>,
) -> Functions
where
    A: NamedAim<4> + Aim<f32, 4> + 'static,
{
    let numbers: Vec<f64> = law.controller().coefficients().numbers().map(f64::from).collect();
    functions(&|recorder| {
        let coefficients = of_numbers(recorder, &numbers, MASK);
        // The results of the map replace the row.
        let within = Controller::from_parts(coefficients, Linear::from_row([Symbol::ZERO; 4]));
        let map = law.model().converted(&mut |name, number| recorder.constant(name, f64::from(number)));
        let converted = law.converted(within, map, &mut |name, entry, number| {
            let entry = if entry == 0 { String::new() } else { format!("_{entry}") };
            recorder.constant(&format!("{name}{entry}"), f64::from(number))
        });
        (converted, [Symbol::ZERO; 4])
    })
}
