//! Expected results of the functions `edo_smc_*` of the C library, one text each.
//!
//! A call has valid addresses, a valid design, and a state that `init` has made with the design. The state waits for
//! its first valid sample, or runs. Other calls are covered by `tests`. The numbers of the design may be
//! any.
//!
//! ```text
//! design:  version, instance, design's words ..       state:  address of the design, tag, state's words ..
//! ```

use std::fmt::Write as _;

use controller_core::{Controller, Linear, VERSION_NUMBER};
use tick_record::drive::JET;
use tick_record::joined::Joined;
use tick_record::{Op, Port, Record, Recorder, Role, Symbol, ValueKind, Whole, coefficients, monitor, text, whole};

use crate::watched::Watched;

/// Status values, in the order of `edo_smc.h`.
const REJECTED: u32 = 1;
const NOT_FINITE: u32 = (-6_i32).cast_unsigned();
const NOT_STARTED: u32 = (-12_i32).cast_unsigned();

/// Memory layout of an instance, and its functions.
struct Layout {
    name: String,
    /// Numbers of the design with their offsets from its address, and its size in bytes.
    design: Vec<(String, usize)>,
    design_size: usize,
    /// Other words of the design: `known` lines.
    known: Vec<(usize, u32)>,
    /// Words of the state with their offsets, its size, and its padding bytes.
    state: Vec<(String, usize)>,
    state_size: usize,
    pads: Vec<(usize, usize)>,
    /// Location of each input in the sample, with its kind where it differs from the trace.
    sample: Vec<(String, String)>,
    /// Names of the estimates of a drive, in order.
    known_by: Vec<String>,
    /// Tag of a waiting state; a running state has the complement.
    waiting: u32,
    functions: Vec<(&'static str, Record)>,
}

/// Returns the tag as the library computes it from its version and the instance: FNV-1a.
fn waiting(instance: [u8; 4]) -> u32 {
    let bytes = [VERSION_NUMBER.to_le_bytes(), instance].concat();
    bytes.iter().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

/// Registers that hold the addresses.
#[derive(Default)]
struct Registers {
    design: Option<usize>,
    state: usize,
    sample: Option<usize>,
    output: Option<usize>,
}

impl Registers {
    fn of(function: &str) -> Self {
        match function {
            "tick" | "go_on" => Self { design: Some(0), state: 1, sample: Some(2), output: Some(3) },
            "estimates" => Self { design: Some(0), state: 1, sample: None, output: Some(2) },
            _ => Self::default(),
        }
    }
}
impl Layout {
    /// Returns the functions with their texts.
    fn texts(&self) -> Vec<(String, String)> {
        self.functions.iter().map(|(function, record)| self.text(function, record)).collect()
    }

    fn text(&self, function: &str, record: &Record) -> (String, String) {
        let Self { name, .. } = self;
        let Registers { design, state, sample, output } = Registers::of(function);
        let (running, waiting) = (!self.waiting, self.waiting);
        let among = |all: &[(String, usize)], port: &Port| {
            all.iter().find(|(name, _)| *name == port.name).map(|(_, at)| 8 + at)
        };
        let tag = format!("either r{state}+4 {running} {waiting}");
        let memory = |port: &Port| match port.role {
            Role::State if port.name == "started" => Some(tag.clone()),
            Role::State => Some(format!("r{state}+{}", among(&self.state, port)?)),
            Role::Argument if port.name == "u" => Some("s0".into()),
            Role::Sample(_) | Role::Argument => match self.sample.iter().find(|(name, _)| *name == port.name) {
                Some((_, place)) => Some(place.replace("sample", &format!("r{}", sample?))),
                None => Some(format!("r{}+{}", design?, among(&self.design, port)?)),
            },
            _ => None,
        };
        let not_finite = format!("either r0 0 {NOT_FINITE}");
        let behind = |offset: usize| output.map_or(String::new(), |output| format!("r{output}+{offset}"));
        let columns = record.results.iter().filter(|port| matches!(port.role, Role::Estimate(0, _))).count();
        let result = |port: &Port| match (function, port.role) {
            // A state that no longer waits has no answer except OK.
            ("reset", Role::State) if port.name == "started" => vec![tag.clone(), "either r0 1 0".into()],
            ("estimates" | "reset", Role::State) => vec![],
            // Both return NOT_STARTED for a state that has not started.
            ("report_applied", Role::State) if port.name == "started" => vec![tag.clone(), not_finite.clone()],
            ("estimates", Role::Answer) => vec!["either r0 0 1".into()],
            ("report_applied", Role::Answer) => vec![not_finite.clone()],
            ("go_on", Role::Answer) => vec![format!("either r0 0 {NOT_STARTED}")],
            ("estimates", Role::Output) => {
                let known = self.known_by.iter().position(|one| *one == port.name);
                known.into_iter().map(|word| behind(4 * word)).collect()
            }
            (_, Role::State) => memory(port).into_iter().collect(),
            (_, Role::Output) => {
                let word = ["u", "sigma", "sigma_star"].iter().position(|one| *one == port.name);
                word.into_iter().map(|word| behind(4 * word)).collect()
            }
            ("tick", Role::Flag(0)) => vec![format!("{} bit 0", behind(12)), format!("either r0 {REJECTED} 0")],
            (_, Role::Flag(bit)) => vec![format!("{} bit {bit}", behind(12))],
            (_, Role::Between) => vec![format!("either r0 {REJECTED} 0")],
            (_, Role::Estimate(i, m)) => vec![behind(4 * (columns * i + m))],
            _ => vec![],
        };
        let mut head = format!("size r{state} {}\n", 8 + self.state_size);
        if let Some(design) = design {
            let _ = writeln!(head, "known r{state}+0 r{design}\nsize r{design} {}", 12 + self.design_size);
            for (at, word) in &self.known {
                let _ = writeln!(head, "known r{design}+{} {word}", 8 + at);
            }
        }
        if function == "estimates" {
            let words = record.results.iter().filter(|port| matches!(port.role, Role::Output | Role::Estimate(..)));
            let _ = writeln!(
                head,
                "size {} {}\nknown r{state}+4 {running}",
                behind(0).replace("+0", ""),
                4 * words.count()
            );
        } else if let Some(output) = output {
            let _ = writeln!(head, "size r{output} 16\npad r{output}+14 2");
            for (at, bytes) in &self.pads {
                let _ = writeln!(head, "pad r{state}+{} {bytes}", 8 + at);
            }
        }
        let text = text::text(&format!("edo_smc_{function}_{name}"), record, &memory, &result, &head);
        (format!("{function}_{name}"), text)
    }
}

fn chain<const N: usize, const R: usize, const MASK: u8, const O: usize>(name: &str) -> Layout {
    let named = |recorder: &Recorder, name: &str| -> [Symbol; N] {
        std::array::from_fn(|j| recorder.number(&format!("{name}_{}", j + 1), Role::Argument))
    };
    let whole = whole(&|recorder: &Recorder| {
        let guess = named(recorder, "d_hat");
        let coefficients = coefficients(recorder, MASK);
        let model = Linear::from_row(named(recorder, "drift"));
        (Controller::<Symbol, Linear<Symbol, N>, N, R, MASK, O>::from_parts(coefficients, model), guess)
    });
    // Guess, coefficients, row, in the order of their requests.
    let numbers = whole.tick.inputs.iter().filter(|port| port.role == Role::Argument);
    let design: Vec<String> = numbers.map(|port| port.name.clone()).collect();
    // In memory the flag is last.
    let mut state: Vec<String> = whole.state.iter().map(|port| port.name.clone()).collect();
    state.pop();
    state.rotate_left(1);
    let placed = |names: Vec<String>| names.into_iter().zip((0..).step_by(4)).collect();
    let Whole { tick, report_applied, estimates, reset, .. } = whole;
    Layout {
        name: name.into(),
        design_size: 4 * design.len(),
        design: placed(design),
        known: Vec::new(),
        state_size: 4 * state.len(),
        state: placed(state),
        pads: Vec::new(),
        sample: (0..N).map(|j| (format!("x{}", j + 1), format!("sample+{}", 4 * j))).collect(),
        known_by: Vec::new(),
        waiting: waiting([N as u8, R as u8, MASK, 0]),
        functions: vec![("tick", tick), ("report_applied", report_applied), ("estimates", estimates), ("reset", reset)],
    }
}

/// Returns the layout of a drive; its functions are joined from the traces of its parts.
fn drive(drive: &Watched) -> Layout {
    let Watched { name, functions, shafts, places, forms: [fast, late], .. } = drive;
    let order: Vec<&str> = ["turn"].into_iter().chain(JET.into_iter().take(2 * shafts.len())).collect();
    let targets = ["begin", "end"].map(|when| order.iter().map(move |of| format!("{when}_{of}")));
    let counts = shafts.iter().map(|shaft| format!("count{shaft}"));
    let words = counts.chain(["bits of the lost ones".into()]).chain(targets.into_iter().flatten());
    let lost = shafts.iter().zip(0..);
    let quantities = ["position", "speed", "disturbance", "load"];
    let flags = places.state.iter().filter(|(port, _)| port.kind == ValueKind::Truth);
    Layout {
        name: (*name).into(),
        design: places.numbers.clone(),
        design_size: places.law_size,
        known: places.known.clone(),
        state: places.state.iter().map(|(port, at)| (port.name.clone(), *at)).collect(),
        state_size: places.state_size,
        pads: flags.map(|(_, at)| (at + 1, 3)).collect(),
        sample: (words.zip((0..).step_by(4)).map(|(word, at)| (word, format!("sample+{at}"))))
            .chain(lost.map(|(shaft, i)| (format!("lost{shaft}"), format!("sample+{} bit {i}", 4 * shafts.len()))))
            .collect(),
        known_by: ["turn".into()]
            .into_iter()
            .chain(quantities.iter().flat_map(|of| shafts.iter().map(move |shaft| format!("{of}{shaft}"))))
            .collect(),
        waiting: waiting([shafts.len() as u8, *fast, *late, 1]),
        functions: vec![
            ("tick", ticked(drive, true)),
            ("go_on", ticked(drive, false)),
            ("report_applied", of_all_words(drive, &functions.report_applied, false)),
            ("estimates", of_all_words(drive, &functions.estimates, true)),
            ("reset", functions.reset.clone()),
        ],
    }
}

/// Returns a tick that starts with the first valid sample, or one that waits until another call has started it. Until
/// then the fallback is put out.
fn ticked(drive: &Watched, starts: bool) -> Record {
    let mut joined = Joined::default();
    let started = joined.input("started", Role::State, ValueKind::Truth);
    let was = drive.state(&mut joined);
    let (mut before, mut runs) = (was.clone(), started);
    if starts {
        let shafts = drive.shafts.len();
        let start = joined.call(&drive.functions.start, &|_| None);
        let zeros = [joined.constant(Op::Truth(false)), joined.constant(Op::Constant(0.0))];
        // A drive that has just started waits for agreeing counts.
        let waits = joined.input("start_ticks", Role::Argument, ValueKind::Number);
        for (port, word) in &mut before {
            let first = match port.name.as_str() {
                "doubt" => Some(waits),
                name => start.get(name, Role::State).filter(|_| !monitor::state(shafts).contains(port)),
            };
            let zero = zeros[usize::from(port.kind != ValueKind::Truth)];
            *word = joined.select(started, *word, first.unwrap_or(zero));
        }
        let begins = start.get("answer", Role::Answer).expect("an answer");
        runs = joined.op(Op::Or(started, begins));
    }
    let ticked = drive.ticked(&mut joined, &before);
    let waits = joined.call(&drive.functions.not_started, &|_| None);
    let no = joined.constant(Op::Truth(false));
    let mut results = Vec::new();
    for (port, id) in ticked {
        let other = match port.role {
            Role::State => was.iter().find(|(word, _)| *word == port).map(|(_, id)| *id).expect("a word of the state"),
            _ => waits.all().find(|(other, _)| *other == port).map_or(no, |(_, id)| *id),
        };
        let id = joined.select(runs, id, other);
        if !starts && port.role == Role::Flag(0) {
            // The answer differs for a state that has not started.
            let rejects = joined.op(Op::And(runs, id));
            results.push((Port { name: "rejects".into(), role: Role::Between, kind: ValueKind::Truth }, rejects));
        }
        results.push((port, id));
    }
    results.push((Port { name: "started".into(), role: Role::State, kind: ValueKind::Truth }, runs));
    if !starts {
        results.push((Port { name: "answer".into(), role: Role::Answer, kind: ValueKind::Truth }, runs));
    }
    joined.record(results)
}

/// Returns a function that checks all words of the state, including the words of the monitors; or one that is only
/// called for a started state.
fn of_all_words(drive: &Watched, record: &Record, has_started: bool) -> Record {
    let mut joined = Joined::default();
    drive.state(&mut joined);
    let yes = joined.constant(Op::Truth(true));
    let given = joined.call(record, &|port| (has_started && port.name == "started").then_some(yes));
    joined.record(given.all().cloned().collect())
}

macro_rules! chains {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
        [$((stringify!($name), chain::<$n, $r, $mask, $o> as fn(&str) -> Layout)),*]
    };
}

/// Returns every function of the requested instances with its text.
pub(crate) fn texts(drives: &[Watched], is_wanted: &dyn Fn(&str) -> bool) -> Vec<(String, String)> {
    let chains = controller_core::shapes!(archive => chains);
    let chains = chains.into_iter().filter(|(name, _)| is_wanted(name)).map(|(name, chain)| chain(name));
    let drives = drives.iter().filter(|drive| is_wanted(drive.name)).map(drive);
    chains.chain(drives).flat_map(|layout| layout.texts()).collect()
}
