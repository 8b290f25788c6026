//! `tick-record FOLDER`: what the ticks in the image `budget` of the firmware are to compute, a text for each instance,
//! for `cycle-bound --means`.
//!
//! The design is not in them: whatever numbers a controller of this shape holds, the tick is the same function of them.
//! Places are those of the types, whose fields lie in their order (`repr(C)`).

use std::process::ExitCode;
use std::{env, fs, path::Path};

use controller_core::{Benchmark, ControlLaw, Controller, Exp, FlexibleJoint, Gate, Gated, NominalModel, Output, Real};
use tick_record::{Port, Record, Recorded, Recorder, Role, Symbol, coefficients, text, tick};

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

/// As in the image.
#[derive(Clone, Copy)]
struct VaryingGain(FlexibleJoint<Symbol>);

impl NominalModel<Symbol, 4> for VaryingGain {
    fn drift(&self, x: &[Symbol; 4]) -> Symbol {
        self.0.drift(x)
    }
    fn gain_ratio(&self, x: &[Symbol; 4]) -> Option<Symbol> {
        Some(Symbol::from_f64(1.0) + Symbol::HALF * x[0] * x[0])
    }
}

impl Model<4> for VaryingGain {
    const NUMBERS: usize = 3;
    fn of(numbers: &[Symbol]) -> Self {
        Self(FlexibleJoint::of(numbers))
    }
}

/// As in the image.
#[derive(Clone, Copy)]
struct Nothing;

impl Exp<Symbol> for Nothing {
    fn exp(x: Symbol) -> Symbol {
        x
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
        (_, Role::State) => memory(port),
        (Call::U, Role::Output) if port.name == "u" => Some("s0".into()),
        (Call::Output, Role::Output) => {
            let word = ["u", "sigma", "sigma_star"].iter().position(|one| *one == port.name)?;
            Some(format!("r0+{}", 4 * word))
        }
        (Call::Output, Role::Flag(bit)) => Some(format!("r0+12 bit {bit}")),
        _ => None,
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

/// Every instance with its text.
fn texts() -> Vec<(&'static str, String)> {
    macro_rules! chains {
        ($($name:ident: $model:ty, $n:literal, $r:literal, $mask:expr, $o:literal, $call:ident, $tick:ident;)*) => {
            vec![$((
                stringify!($name),
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
        joint_r2_varying_gain: VaryingGain, 4, 2, BOTH, 2, U, tick;
        benchmark_without_exponential: Benchmark<Nothing>, 2, 2, 0b11, 2, U, tick;
    };
    all.push(("joint_r2_gated", gated::<Joint, 4, 2, BOTH, 2>("joint_r2_gated")));
    all
}

fn main() -> ExitCode {
    let Some(folder) = env::args_os().nth(1).filter(|_| env::args_os().len() == 2) else {
        eprintln!("usage: tick-record FOLDER");
        return ExitCode::from(2);
    };
    for (name, text) in texts() {
        let path = Path::new(&folder).join(name).with_extension("means");
        if let Err(error) = fs::write(&path, text) {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
