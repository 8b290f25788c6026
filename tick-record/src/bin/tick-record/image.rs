//! Expected results of the ticks in the image `budget` of the firmware, one text per instance.
//!
//! The texts do not contain a design: the tick is one function of the numbers of a controller of the configuration.
//! Locations follow from the types, whose fields are in declaration order (`repr(C)`).

use controller_core::drive::{
    FullState, Hold, Joint as JointData, JointDrive, JointModel, MotorDrive, Position, Speed,
};
use controller_core::{
    Benchmark, Config, ControlLaw, Controller, FlexibleJoint, Gate, Gated, NominalModel, ObserverGains, Options,
    Output, ReachingLaw, Surface,
};
use tick_record::joined::Joined;
use tick_record::{Port, Record, Recorded, Recorder, Role, Symbol, ValueKind, coefficients, drive, text, tick};

use crate::designs::{JOINT_DRIVE, MOTOR, Nothing, VaryingGain};
use crate::memory::{Marked, Places, state_words};
use crate::watched::Watched;

/// A model over the recording scalar; its numbers follow the coefficients in memory.
trait Model<const N: usize>: NominalModel<Symbol, N> + 'static {
    const NUMBERS: usize;
    fn of(numbers: &[Symbol]) -> Self;
}

impl Model<4> for FlexibleJoint<Symbol> {
    const NUMBERS: usize = 3;
    fn of(numbers: &[Symbol]) -> Self {
        Self::from_row(std::array::from_fn(|j| numbers[j]))
    }
}

impl Model<4> for VaryingGain<Symbol> {
    const NUMBERS: usize = 3;
    fn of(numbers: &[Symbol]) -> Self {
        Self(FlexibleJoint::of(numbers))
    }
}

impl Model<2> for Benchmark<Nothing> {
    const NUMBERS: usize = 0;
    fn of(_: &[Symbol]) -> Self {
        Self::new()
    }
}

/// Arguments and return value of a tick.
#[derive(Clone, Copy)]
enum Call {
    /// (law, state, sample) -> u.
    U,
    /// (output, law, state, sample).
    Output,
}

/// Returns the text of a tick. `law` and `state` are the names of the numbers of the law and its state in memory order.
fn written(name: &str, record: &Record, call: Call, law: &[String], state: &[String]) -> String {
    let first = match call {
        Call::U => 0,
        Call::Output => 1,
    };
    let among = |all: &[String], port: &Port| all.iter().position(|one| *one == port.name);
    let at = |argument: usize, word: usize| Some(format!("r{}+{}", first + argument, 4 * word));
    let memory = |port: &Port| match port.role {
        Role::Argument => at(0, among(law, port)?),
        Role::State => at(1, among(state, port)?),
        Role::Sample(j) => at(2, j),
        _ => None,
    };
    let result = |port: &Port| match (call, port.role) {
        (_, Role::State) => memory(port).into_iter().collect(),
        (Call::U, Role::Output) if port.name == "u" => vec!["s0".into()],
        (Call::Output, Role::Output) => {
            let word = ["u", "sigma", "sigma_star"].iter().position(|one| *one == port.name);
            word.into_iter().map(|word| format!("r0+{}", 4 * word)).collect()
        }
        (Call::Output, Role::Flag(bit)) => vec![format!("r0+12 bit {bit}")],
        _ => vec![],
    };
    text::text(&format!("budget::{name}::tick"), record, &memory, &result, "")
}

type Chain<M, const N: usize, const R: usize, const MASK: u8, const O: usize> = Controller<Symbol, M, N, R, MASK, O>;
type Tick<D> = fn(&D, &mut <D as ControlLaw>::State, &<D as ControlLaw>::Sample) -> Output<Symbol>;

fn made<M: Model<N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    recorder: &Recorder,
) -> Chain<M, N, R, MASK, O> {
    // The model follows in memory.
    let coefficients = coefficients(recorder, MASK);
    let numbers: Vec<Symbol> =
        (0..M::NUMBERS).map(|k| recorder.number(&format!("model_{}", k + 1), Role::Argument)).collect();
    Controller::from_parts(coefficients, M::of(&numbers))
}

/// Returns the numbers of a law in the order of the inputs of its trace, which is the memory order.
fn law_of(record: &Record) -> Vec<String> {
    record.inputs.iter().filter(|port| port.role == Role::Argument).map(|port| port.name.clone()).collect()
}

/// Returns the state words in memory order: the words of the gate, the numbers of `State` of the core, and its flag.
fn state_of<D: Recorded>() -> Vec<String> {
    let (seen, mut names): (Vec<String>, Vec<String>) =
        D::state_names().into_iter().partition(|name| name.ends_with("_seen"));
    names.rotate_left(1);
    [seen, names].concat()
}

fn chain<M: Model<N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(
    name: &str,
    call: Call,
    with: Tick<Chain<M, N, R, MASK, O>>,
) -> String {
    let record = tick(&made::<M, N, R, MASK, O>, with);
    written(name, &record, call, &law_of(&record), &state_of::<Chain<M, N, R, MASK, O>>())
}

fn gated<M: Model<N>, const N: usize, const R: usize, const MASK: u8, const O: usize>(name: &str) -> String {
    let record = tick(
        &|recorder: &Recorder| {
            // The compiler places the rows first.
            let [min, max, jump] = ["x_min", "x_max", "x_jump"]
                .map(|row| std::array::from_fn(|j| recorder.number(&format!("{row}_{}", j + 1), Role::Argument)));
            Gated::new(made::<M, N, R, MASK, O>(recorder), Gate::from_rows(min, max, jump))
        },
        Gated::tick,
    );
    written(name, &record, Call::U, &law_of(&record), &state_of::<Gated<Chain<M, N, R, MASK, O>, N>>())
}

const DRIVEN: u8 = 0b1000;
const BOTH: u8 = 0b1010;
const ALL: u8 = 0b1111;
type Joint = FlexibleJoint<Symbol>;

/// Returns the text of a tick with arguments by reference; `sample` returns the location of a port in the sample.
fn driven(name: &str, record: &Record, places: &Places, sample: &dyn Fn(&Port) -> Option<String>) -> String {
    let known: Vec<String> = places.known.iter().map(|(at, word)| format!("known r0+{at} {word}\n")).collect();
    let memory = |port: &Port| match port.role {
        Role::State => Some(format!("r1+{}", places.word(port)?)),
        Role::Sample(_) => sample(port),
        Role::Argument => places.number(&port.name).map(|at| format!("r0+{at}")).or_else(|| sample(port)),
        _ => None,
    };
    let result = |port: &Port| match port.role {
        Role::State => memory(port).into_iter().collect(),
        Role::Output if port.name == "u" => vec!["s0".into()],
        _ => vec![],
    };
    text::text(&format!("budget::{name}::tick"), record, &memory, &result, &known.concat())
}

/// Returns the location of the targets in the sample: after the measurements, each with its revolutions last.
fn target(record: &Record, port: &Port, behind: usize) -> Option<String> {
    let order = ["r", "r_dot", "r_ddot", "r_dddot", "speed", "turn"];
    let (when, of) = port.name.split_once('_')?;
    let there = |one: &&str| record.inputs.iter().any(|port| port.name == format!("{when}_{one}"));
    let target: Vec<&str> = order.into_iter().filter(there).collect();
    let at = target.iter().position(|one| *one == of)? + if when == "end" { target.len() } else { 0 };
    Some(format!("r2+{}", 4 * (behind + at)))
}

/// Returns the location of counts and targets: each count is an `Option`, a tag and the count.
fn counted(record: &Record, port: &Port) -> Option<String> {
    let lost = || record.inputs.iter().filter(|port| port.role == Role::Argument && port.kind == ValueKind::Truth);
    match port.role {
        Role::Sample(i) => Some(format!("r2+{}", 8 * i + 4)),
        _ => match lost().position(|one| one == port) {
            Some(i) => Some(format!("either r2+{} 0 1", 8 * i)),
            None => target(record, port, 2 * lost().count()),
        },
    }
}

/// Returns the location of a measured state and targets.
fn measured(record: &Record, port: &Port) -> Option<String> {
    match port.role {
        Role::Sample(j) => Some(format!("r2+{}", 4 * j)),
        _ => target(record, port, record.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_))).count()),
    }
}

/// A joint's law on four measured states, which observes the channels 2, 3 and 4.
type Measuring<T, A> = FullState<T, JointModel<T>, A, 2, 4, 2, UPPER, 3, 0>;

const UPPER: u8 = 0b1110;

/// Returns a law of this configuration; the texts contain none of its numbers.
fn measuring<A>() -> Measuring<f32, A> {
    let gains = Some(ObserverGains::from_bandwidth::<2>(100.0));
    let config = Config {
        period_s: 1e-3,
        surface: Surface::from_bandwidth(10.0, 10.0),
        observers: [None, gains, gains, gains],
        reaching: ReachingLaw { k_l: 50.0, k_s: 0.5, epsilon: 0.01 },
        nominal: JointData::TABLE_I.model().nominal(),
        options: Options::NEUTRAL,
    };
    Measuring::<f32, A>::try_design(&config, JointData::TABLE_I.model().in_f32()).expect("a good design")
}

/// The texts of the requested instances.
struct Texts<'a> {
    is_wanted: &'a dyn Fn(&str) -> bool,
    all: Vec<(String, String)>,
}

impl Texts<'_> {
    fn add(&mut self, name: &str, text: impl FnOnce(&str) -> String) {
        if (self.is_wanted)(name) {
            self.all.push((name.into(), text(name)));
        }
    }
}

/// Returns every requested instance with its text. Drives of the C library are already recorded there.
pub(crate) fn texts(drives: &[Watched], is_wanted: &dyn Fn(&str) -> bool) -> Vec<(String, String)> {
    let mut texts = Texts { is_wanted, all: Vec::new() };
    chains(&mut texts);
    on_counts(&mut texts, drives);
    for (name, drive) in [("motor_watched", "motor"), ("joint_drive_watched", "joint")] {
        texts.add(name, |name| {
            let drive = watched(drives, drive);
            let mut joined = Joined::default();
            let before = drive.state(&mut joined);
            let results = drive.ticked(&mut joined, &before);
            let record = joined.record(results);
            driven(name, &record, &drive.places, &|port| counted(&record, port))
        });
    }
    on_states(&mut texts);
    texts.add("joint_r2_gated", gated::<Joint, 4, 2, BOTH, 2>);
    texts.all
}

fn watched<'a>(drives: &'a [Watched], name: &str) -> &'a Watched {
    drives.iter().find(|drive| drive.name == name).expect("a drive of the archive")
}

fn argument(recorder: &Recorder, name: &str) -> Symbol {
    recorder.number(name, Role::Argument)
}

fn chains(texts: &mut Texts<'_>) {
    macro_rules! chains {
        ($($name:ident: $model:ty, $n:literal, $r:literal, $mask:expr, $o:literal, $call:ident, $tick:ident;)*) => {
            $(texts.add(stringify!($name), |name| {
                chain::<$model, $n, $r, { $mask }, $o>(name, Call::$call, Controller::$tick)
            });)*
        };
    }
    chains! {
        joint_r1: Joint, 4, 1, DRIVEN, 1, U, tick;
        joint_r2: Joint, 4, 2, BOTH, 2, U, tick;
        joint_r3: Joint, 4, 3, BOTH, 2, U, tick;
        joint_r2_driven: Joint, 4, 2, DRIVEN, 1, U, tick;
        joint_r3_all: Joint, 4, 3, ALL, 4, U, tick;
        joint_r2_output: Joint, 4, 2, BOTH, 2, Output, tick;
        joint_r3_output: Joint, 4, 3, BOTH, 2, Output, tick;
        joint_r2_unguarded: Joint, 4, 2, BOTH, 2, U, tick_unguarded;
        joint_r3_unguarded: Joint, 4, 3, BOTH, 2, U, tick_unguarded;
        joint_r2_varying_gain: VaryingGain<Symbol>, 4, 2, BOTH, 2, U, tick;
        benchmark_without_exponential: Benchmark<Nothing>, 2, 2, 0b11, 2, U, tick;
    }
}

/// Adds drives on encoder counts. Drives of the C library are already recorded.
fn on_counts(texts: &mut Texts<'_>, recorded: &[Watched]) {
    macro_rules! drives {
        ($($name:ident: $drive:ty, $symbols:ident, $design:expr, $record:expr;)*) => {$(
            texts.add(stringify!($name), |name| {
                let drive = <$drive>::design($design);
                let in_archive: Option<&str> = $record;
                let record = in_archive.map_or_else(
                    || drive::tick(&|recorder| drive::$symbols(&drive, &mut |name| argument(recorder, name))),
                    |name| watched(recorded, name).tick.clone(),
                );
                let mut marked = Marked::default();
                let law = drive::$symbols(&drive, &mut |name| marked.number(name));
                let places = Places::of(&law, &marked, &[(<$drive>::FLAG_AT, 0xff)], &state_words(&record));
                driven(name, &record, &places, &|port| counted(&record, port))
            });
        )*};
    }
    drives! {
        motor: MotorDrive, motor_of, &MOTOR, Some("motor");
        motor_two_sets: MotorDrive<f32, Position, 1>, motor_of, &MOTOR, Some("motor_fast");
        motor_late: MotorDrive<f32, Position, 0, 1>, motor_of, &MOTOR, Some("motor_late");
        motor_speed: MotorDrive<f32, Speed>, motor_of, &MOTOR, None;
        joint_drive: JointDrive, joint_of, &JOINT_DRIVE, Some("joint");
        joint_drive_held: JointDrive<f32, Hold>, joint_of, &JOINT_DRIVE, None;
        joint_drive_two_sets: JointDrive<f32, Position, 1>, joint_of, &JOINT_DRIVE, Some("joint_fast");
        joint_drive_late: JointDrive<f32, Position, 0, 1>, joint_of, &JOINT_DRIVE, Some("joint_late");
    }
}

/// Adds laws on a measured state.
fn on_states(texts: &mut Texts<'_>) {
    macro_rules! measured_laws {
        ($($name:ident: $aim:ty;)*) => {$(texts.add(stringify!($name), |name| {
            let law: Measuring<f32, $aim> = measuring();
            let record = tick(
                &|recorder| drive::measured_of(&law, &mut |name| argument(recorder, name)),
                Measuring::<Symbol, $aim>::tick,
            );
            let mut marked = Marked::default();
            let law = drive::measured_of(&law, &mut |name| marked.number(name));
            let places = Places::of(&law, &marked, &[], &state_words(&record));
            driven(name, &record, &places, &|port| measured(&record, port))
        });)*};
    }
    measured_laws! {
        joint_measured: Position;
        joint_measured_held: Hold;
    }
}
