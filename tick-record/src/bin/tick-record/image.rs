//! What the ticks in the image `budget` of the firmware are to compute, a text for each instance.
//!
//! The design is not in them: whatever numbers a controller of this shape holds, the tick is the same function of them.
//! Places are those of the types, whose fields lie in their order (`repr(C)`).

use controller_core::drive::{
    FullState, Hold, Joint as JointData, JointDrive, JointModel, Monitored, MotorDrive, Mounting, Position, Speed,
};
use controller_core::{
    Benchmark, Config, ControlLaw, Controller, FlexibleJoint, Gate, Gated, NominalModel, ObserverGains, Options,
    Output, ReachingLaw, Surface, Words as _,
};
use tick_record::drive::DriveFunctions;
use tick_record::joined::Joined;
use tick_record::{Id, Kind, Port, Record, Recorded, Recorder, Role, Symbol, coefficients, drive, monitor, text, tick};

use crate::designs::{JOINT_DRIVE, MOTOR, Nothing, VaryingGain};
use crate::memory::{mark, words};

/// A model over the recording scalar, of numbers that follow the coefficients in memory.
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

/// Where a tick has its arguments and its answer.
#[derive(Clone, Copy)]
enum Call {
    /// (law, state, sample) -> u.
    U,
    /// (output, law, state, sample).
    Output,
}

/// The text of a tick. `law` are the numbers of the law and `state` those of its state, in the order of the memory.
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
    // In memory the model follows.
    let coefficients = coefficients(recorder, MASK);
    let numbers: Vec<Symbol> =
        (0..M::NUMBERS).map(|k| recorder.number(&format!("model_{}", k + 1), Role::Argument)).collect();
    Controller::from_parts(coefficients, M::of(&numbers))
}

/// The numbers of a law in the order of its record's inputs, which is that in memory.
fn law_of(record: &Record) -> Vec<String> {
    record.inputs.iter().filter(|port| port.role == Role::Argument).map(|port| port.name.clone()).collect()
}

/// The words of a state in memory: what a gate has seen, the numbers of the core's `State`, its flag.
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
            // The compiler lays the rows first.
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

/// The text of a tick that is given what it reads by reference. `marked` is the law with marks in place of the numbers
/// of these names and `bytes` where in it one byte is no whole word, `state` the words of its state in their order;
/// `sample` says where behind the sample a port lies.
fn driven<L: ControlLaw<Scalar = f32> + Clone>(
    name: &str,
    record: &Record,
    (marked, names, bytes): (&L, &[String], &[usize]),
    state: &[Port],
    sample: &dyn Fn(&Port) -> Option<String>,
) -> String
where
    L::State: Clone,
{
    let marks = |words: &[u32], k: usize| words.iter().position(|word| *word == mark(k).to_bits());
    let is_flag = |k: usize| state[k].kind == Kind::Truth;
    let made = |word: &dyn Fn(usize) -> u32| {
        words(&L::State::from_words(&mut (0..state.len()).map(word)).expect("the words of a state"))
    };
    let state_words = made(&|k| if is_flag(k) { 0 } else { mark(k).to_bits() });
    let law_words = words(marked);
    let known: Vec<String> = (law_words.iter().zip(0..))
        .filter(|(word, _)| !(0..names.len()).any(|k| mark(k).to_bits() == **word))
        .map(|(word, k)| (4 * k, if bytes.contains(&(4 * k)) { word & 0xff } else { *word }))
        .map(|(at, word)| format!("known r0+{at} {word}\n"))
        .collect();
    let memory = |port: &Port| match port.role {
        Role::State => {
            let k = state.iter().position(|one| one == port)?;
            let word = if is_flag(k) {
                // The only word with a bit, when this flag alone is set.
                made(&|other| u32::from(other == k)).iter().position(|word| word & 0xff == 1)?
            } else {
                marks(&state_words, k)?
            };
            Some(format!("r1+{}", 4 * word))
        }
        Role::Argument if names.contains(&port.name) => {
            let k = names.iter().position(|one| *one == port.name)?;
            Some(format!("r0+{}", 4 * marks(&law_words, k)?))
        }
        Role::Sample(_) | Role::Argument => sample(port),
        _ => None,
    };
    let result = |port: &Port| match port.role {
        Role::State => memory(port).into_iter().collect(),
        Role::Output if port.name == "u" => vec!["s0".into()],
        _ => vec![],
    };
    text::text(&format!("budget::{name}::tick"), record, &memory, &result, &known.concat())
}

/// Where the targets lie behind the sample: behind what is measured, each with its turn last.
fn target(record: &Record, port: &Port, behind: usize) -> Option<String> {
    let order = ["r", "r_dot", "r_ddot", "r_dddot", "speed", "turn"];
    let (when, of) = port.name.split_once('_')?;
    let there = |one: &&str| record.inputs.iter().any(|port| port.name == format!("{when}_{one}"));
    let target: Vec<&str> = order.into_iter().filter(there).collect();
    let at = target.iter().position(|one| *one == of)? + if when == "end" { target.len() } else { 0 };
    Some(format!("r2+{}", 4 * (behind + at)))
}

/// Where counts and targets lie: each count is an `Option`, a tag and the count.
fn counted(record: &Record, port: &Port) -> Option<String> {
    let lost = || record.inputs.iter().filter(|port| port.role == Role::Argument && port.kind == Kind::Truth);
    match port.role {
        Role::Sample(i) => Some(format!("r2+{}", 8 * i + 4)),
        _ => match lost().position(|one| one == port) {
            Some(i) => Some(format!("either r2+{} 0 1", 8 * i)),
            None => target(record, port, 2 * lost().count()),
        },
    }
}

/// Where a measured state and targets lie.
fn measured(record: &Record, port: &Port) -> Option<String> {
    match port.role {
        Role::Sample(j) => Some(format!("r2+{}", 4 * j)),
        _ => target(record, port, record.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_))).count()),
    }
}

/// The words of the state that a record begins with.
fn state_words(record: &Record) -> Vec<Port> {
    record.inputs.iter().filter(|port| port.role == Role::State).cloned().collect()
}

/// The tick of a drive with monitors that stop it.
fn watched(functions: &DriveFunctions, tick: &Record, shafts: &[&str]) -> (Record, Vec<Port>) {
    let monitors = if shafts.len() == 1 { monitor::monitor::<1>(true) } else { monitor::monitor::<2>(true) };
    let state = [monitor::state().to_vec(), state_words(tick)].concat();
    let mut joined = Joined::default();
    let before: Vec<(Port, Id)> =
        state.iter().map(|port| (port.clone(), joined.input(&port.name, port.role, port.kind))).collect();
    let results = monitor::watched(&mut joined, [tick, &functions.not_started, &monitors], &before, shafts);
    (joined.record(results), state)
}

/// Names of numbers, and marks in their place.
#[derive(Default)]
struct Marked(Vec<String>);

impl Marked {
    fn number(&mut self, name: &str) -> f32 {
        self.0.push(name.to_owned());
        mark(self.0.len() - 1)
    }
}

/// A joint's law over four measured states, which observes the channels 2, 3 and 4.
type Measuring<T, A> = FullState<T, JointModel<T>, A, 2, 4, 2, UPPER, 3, 0>;

const UPPER: u8 = 0b1110;

/// Of this shape; no number of it is in a text.
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

/// Every instance with its text.
pub(crate) fn texts() -> Vec<(String, String)> {
    macro_rules! chains {
        ($($name:ident: $model:ty, $n:literal, $r:literal, $mask:expr, $o:literal, $call:ident, $tick:ident;)*) => {
            vec![$((
                stringify!($name).into(),
                chain::<$model, $n, $r, { $mask }, $o>(stringify!($name), Call::$call, Controller::$tick),
            ),)*]
        };
    }
    let mut all = chains! {
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
    };
    let argument = |recorder: &Recorder, name: &str| recorder.number(name, Role::Argument);
    macro_rules! drives {
        ($($name:ident: $drive:ty, $symbols:ident, $design:expr;)*) => {$({
            let drive = <$drive>::design($design);
            let record = drive::tick(&|recorder| drive::$symbols(&drive, &mut |name| argument(recorder, name)));
            let mut marked = Marked::default();
            let law = drive::$symbols(&drive, &mut |name| marked.number(name));
            let sample = |port: &Port| counted(&record, port);
            let marked = (&law, &marked.0[..], &[<$drive>::FLAG_AT][..]);
            all.push((stringify!($name).into(), driven(stringify!($name), &record, marked, &state_words(&record), &sample)));
        })*};
    }
    drives! {
        motor: MotorDrive, motor_of, &MOTOR;
        motor_two_sets: MotorDrive<f32, Position, 1>, motor_of, &MOTOR;
        motor_late: MotorDrive<f32, Position, 0, 1>, motor_of, &MOTOR;
        motor_speed: MotorDrive<f32, Speed>, motor_of, &MOTOR;
        joint_drive: JointDrive, joint_of, &JOINT_DRIVE;
        joint_drive_held: JointDrive<f32, Hold>, joint_of, &JOINT_DRIVE;
        joint_drive_two_sets: JointDrive<f32, Position, 1>, joint_of, &JOINT_DRIVE;
        joint_drive_late: JointDrive<f32, Position, 0, 1>, joint_of, &JOINT_DRIVE;
    }
    macro_rules! watched_drives {
        ($($name:ident: $drive:ty, $symbols:ident, $design:expr, $shafts:expr;)*) => {$({
            let drive = <$drive>::design($design);
            let symbols =
                |recorder: &Recorder| drive::$symbols(&drive, &mut |name| argument(recorder, name));
            let functions = drive::drive(&symbols, $shafts.map(|_| Mounting::UPRIGHT));
            let (record, state) = watched(&functions, &drive::tick(&symbols), &$shafts);
            let mut marked = Marked::default();
            let law = drive::$symbols(&drive, &mut |name| marked.number(name));
            let mut bound = 0;
            let bounds = $shafts.map(|_| {
                bound += 1;
                marked.number(&format!("d{bound}_bound"))
            });
            let [sigma_star, stuck] = ["sigma_star_bound", "stuck_ticks"].map(|name| marked.number(name));
            let law = Monitored::from_parts(law, bounds, sigma_star, stuck).stopping();
            let sample = |port: &Port| counted(&record, port);
            let marked = (&law, &marked.0[..], &Monitored::<$drive, { $shafts.len() }>::BYTES_AT[..]);
            all.push((stringify!($name).into(), driven(stringify!($name), &record, marked, &state, &sample)));
        })*};
    }
    watched_drives! {
        motor_watched: MotorDrive, motor_of, &MOTOR, [""];
        joint_drive_watched: JointDrive, joint_of, &JOINT_DRIVE, ["_link", "_motor"];
    }
    macro_rules! measured_laws {
        ($($name:ident: $aim:ty;)*) => {$({
            let law: Measuring<f32, $aim> = measuring();
            let record = tick(
                &|recorder| drive::measured_of(&law, &mut |name| argument(recorder, name)),
                Measuring::<Symbol, $aim>::tick,
            );
            let mut marked = Marked::default();
            let law = drive::measured_of(&law, &mut |name| marked.number(name));
            let sample = |port: &Port| measured(&record, port);
            let marked = (&law, &marked.0[..], &[][..]);
            all.push((stringify!($name).into(), driven(stringify!($name), &record, marked, &state_words(&record), &sample)));
        })*};
    }
    measured_laws! {
        joint_measured: Position;
        joint_measured_held: Hold;
    }
    all.push(("joint_r2_gated".into(), gated::<Joint, 4, 2, BOTH, 2>("joint_r2_gated")));
    all
}
