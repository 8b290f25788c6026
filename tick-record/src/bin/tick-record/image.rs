//! What the ticks in the image `budget` of the firmware are to compute, a text for each instance.
//!
//! The design is not in them: whatever numbers a controller of this shape holds, the tick is the same function of them.
//! Places are those of the types, whose fields lie in their order (`repr(C)`).

use controller_core::drive::{Hold, JointDrive, MotorDrive, Position, Speed};
use controller_core::{
    Benchmark, ControlLaw, Controller, FlexibleJoint, Gate, Gated, NominalModel, Output, Words as _,
};
use tick_record::{Kind, Port, Record, Recorded, Recorder, Role, Symbol, coefficients, drive, text, tick};

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

/// The text of a drive's tick. `marked` is the drive with marks in place of the numbers of these names.
fn driven<L: ControlLaw<Scalar = f32> + Clone>(name: &str, record: &Record, marked: &L, names: &[String]) -> String
where
    L::State: Clone,
{
    let marks = |words: &[u32], k: usize| words.iter().position(|word| *word == mark(k).to_bits());
    // The first word of a state is its flag.
    let state: Vec<&Port> = record.inputs.iter().filter(|port| port.role == Role::State).collect();
    let given = (0..state.len()).map(|k| if k == 0 { 0 } else { mark(k).to_bits() });
    let state_words = words(&L::State::from_words(&mut given.into_iter()).expect("the words of a state"));
    let law_words = words(marked);
    let flag = L::State::from_words(&mut (0..state.len()).map(|k| u32::from(k == 0))).expect("a state that is fresh");
    let fresh = words(&flag).iter().position(|word| *word & 0xff == 1).expect("a flag");
    let known: Vec<String> = (law_words.iter().zip(0..))
        .filter(|(word, _)| !(0..names.len()).any(|k| mark(k).to_bits() == **word))
        .map(|(word, k)| format!("known r0+{} {word}\n", 4 * k))
        .collect();
    let shafts = record.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_))).count();
    let lost: Vec<&Port> =
        record.inputs.iter().filter(|port| port.role == Role::Argument && port.kind == Kind::Truth).collect();
    let memory = |port: &Port| match port.role {
        Role::State if port.kind == Kind::Truth => Some(format!("r1+{}", 4 * fresh)),
        Role::State => {
            let k = state.iter().position(|one| *one == port)?;
            Some(format!("r1+{}", 4 * marks(&state_words, k)?))
        }
        // Each count is an `Option`: a tag, and the count.
        Role::Sample(i) => Some(format!("r2+{}", 8 * i + 4)),
        Role::Argument => {
            if let Some(i) = lost.iter().position(|one| *one == port) {
                return Some(format!("either r2+{} 0 1", 8 * i));
            }
            if let Some(k) = names.iter().position(|one| *one == port.name) {
                return Some(format!("r0+{}", 4 * marks(&law_words, k)?));
            }
            // Behind the counts the targets, in which the turn comes last.
            let order = ["r", "r_dot", "r_ddot", "r_dddot", "speed", "turn"];
            let (when, of) = port.name.split_once('_')?;
            let there = |one: &&str| record.inputs.iter().any(|port| port.name == format!("{when}_{one}"));
            let target: Vec<&str> = order.into_iter().filter(there).collect();
            let at = target.iter().position(|one| *one == of)? + if when == "end" { target.len() } else { 0 };
            Some(format!("r2+{}", 8 * shafts + 4 * at))
        }
        _ => None,
    };
    let result = |port: &Port| match port.role {
        Role::State => memory(port).into_iter().collect(),
        Role::Output if port.name == "u" => vec!["s0".into()],
        _ => vec![],
    };
    text::text(&format!("budget::{name}::tick"), record, &memory, &result, &known.concat())
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
    macro_rules! drives {
        ($($name:ident: $drive:ty, $symbols:ident, $design:expr;)*) => {$({
            let drive = <$drive>::design($design);
            let record = drive::tick(&|recorder| {
                drive::$symbols(&drive, &mut |name| recorder.number(name, Role::Argument))
            });
            let mut names = Vec::new();
            let marked = drive::$symbols(&drive, &mut |name| {
                names.push(name.to_owned());
                mark(names.len() - 1)
            });
            all.push((stringify!($name).into(), driven(stringify!($name), &record, &marked, &names)));
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
    all.push(("joint_r2_gated".into(), gated::<Joint, 4, 2, BOTH, 2>("joint_r2_gated")));
    all
}
