//! What the functions of the archive for C are to compute, `edo_smc_*`, a text for each.
//!
//! A call gets addresses that are good, a design that is one, and a state that `init` has made with it: it waits for
//! its first good sample, or runs. What the interface answers to others is a matter of `tests`. The numbers of the
//! design may be any.
//!
//! ```text
//! design:  version, instance, design's words ..       state:  address of the design, tag, state's words ..
//! ```

use std::fmt::Write as _;

use controller_core::{Controller, Linear, VERSION_NUMBER};
use tick_record::{Port, Record, Recorder, Role, Symbol, Whole, coefficients, text, whole};

/// In the order of `edo_smc.h`.
const REJECTED: u32 = 1;
const NOT_FINITE: u32 = (-6_i32).cast_unsigned();

/// Where an instance has its words.
struct Layout {
    name: String,
    whole: Whole,
    /// Numbers of the design and their words.
    design: Vec<(String, usize)>,
    design_words: usize,
    state: Vec<(String, usize)>,
    state_words: usize,
    /// Tag of a state that waits; its complement if it runs.
    waiting: u32,
}

/// The tag, as the archive makes it of its version and the instance: FNV-1a.
fn waiting(instance: [u8; 4]) -> u32 {
    let bytes = [VERSION_NUMBER.to_le_bytes(), instance].concat();
    bytes.iter().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

/// Which register holds the address of each.
#[derive(Default)]
struct Registers {
    design: Option<usize>,
    state: usize,
    sample: Option<usize>,
    output: Option<usize>,
}

impl Layout {
    /// The functions, each with its text.
    fn texts(&self) -> Vec<(String, String)> {
        let Whole { tick, report_applied, estimates, reset, .. } = &self.whole;
        let of_tick = Registers { design: Some(0), state: 1, sample: Some(2), output: Some(3) };
        let of_estimates = Registers { design: Some(0), state: 1, sample: None, output: Some(2) };
        vec![
            self.text("tick", tick, &of_tick),
            self.text("report_applied", report_applied, &Registers::default()),
            self.text("estimates", estimates, &of_estimates),
            self.text("reset", reset, &Registers::default()),
        ]
    }

    fn text(&self, function: &str, record: &Record, at: &Registers) -> (String, String) {
        let Self { name, .. } = self;
        let &Registers { design, state, sample, output } = at;
        let (running, waiting) = (!self.waiting, self.waiting);
        let among = |all: &[(String, usize)], port: &Port| {
            all.iter().find(|(name, _)| *name == port.name).map(|(_, word)| 8 + 4 * word)
        };
        let tag = format!("either r{state}+4 {running} {waiting}");
        let memory = |port: &Port| match port.role {
            Role::State if port.name == "started" => Some(tag.clone()),
            Role::State => Some(format!("r{state}+{}", among(&self.state, port)?)),
            Role::Sample(j) => Some(format!("r{}+{}", sample?, 4 * j)),
            Role::Argument if port.name == "u" => Some("s0".into()),
            Role::Argument => Some(format!("r{}+{}", design?, among(&self.design, port)?)),
            _ => None,
        };
        let not_finite = format!("either r0 0 {NOT_FINITE}");
        let behind = |offset: usize| output.map_or(String::new(), |output| format!("r{output}+{offset}"));
        let columns = record.results.iter().filter(|port| matches!(port.role, Role::Estimate(0, _))).count();
        let result = |port: &Port| match (function, port.role) {
            // What does not wait any more has no answer but OK.
            ("reset", Role::State) if port.name == "started" => vec![tag.clone(), "either r0 1 0".into()],
            ("estimates" | "reset", Role::State) => vec![],
            // Of a state that has not started both make NOT_STARTED.
            ("report_applied", Role::State) if port.name == "started" => vec![tag.clone(), not_finite.clone()],
            ("estimates", Role::Answer) => vec!["either r0 0 1".into()],
            ("report_applied", Role::Answer) => vec![not_finite.clone()],
            (_, Role::State) => memory(port).into_iter().collect(),
            (_, Role::Output) => {
                let word = ["u", "sigma", "sigma_star"].iter().position(|one| *one == port.name);
                word.into_iter().map(|word| behind(4 * word)).collect()
            }
            (_, Role::Flag(0)) => vec![format!("{} bit 0", behind(12)), format!("either r0 {REJECTED} 0")],
            (_, Role::Flag(bit)) => vec![format!("{} bit {bit}", behind(12))],
            (_, Role::Estimate(i, m)) => vec![behind(4 * (columns * i + m))],
            _ => vec![],
        };
        let mut head = format!("size r{state} {}\n", 8 + 4 * self.state_words);
        if let Some(design) = design {
            let _ = writeln!(head, "known r{state}+0 r{design}\nsize r{design} {}", 12 + 4 * self.design_words);
        }
        if let Some(output) = output {
            let size = if function == "tick" { 16 } else { 4 * (record.results.len() - 1) };
            let _ = writeln!(head, "size r{output} {size}");
            let _ = match function {
                "tick" => writeln!(head, "pad r{output}+13 3"),
                _ => writeln!(head, "known r{state}+4 {running}"),
            };
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
    // Guess, coefficients, row, in the order in which they were asked for.
    let numbers = whole.tick.inputs.iter().filter(|port| port.role == Role::Argument);
    let design: Vec<(String, usize)> = numbers.map(|port| port.name.clone()).zip(0..).collect();
    // In memory the flag is the last one.
    let mut state: Vec<String> = whole.state.iter().map(|port| port.name.clone()).collect();
    state.pop();
    state.rotate_left(1);
    let (design_words, state_words) = (design.len(), state.len());
    let waiting = waiting([N as u8, R as u8, MASK, 0]);
    Layout {
        name: name.into(),
        whole,
        design,
        design_words,
        state: state.into_iter().zip(0..).collect(),
        state_words,
        waiting,
    }
}

macro_rules! chains {
    ($($name:ident: $n:literal $r:literal $mask:literal $o:literal,)*) => {
        vec![$(chain::<$n, $r, $mask, $o>(stringify!($name))),*]
    };
}

/// Every function with its text.
pub(crate) fn texts() -> Vec<(String, String)> {
    let all = controller_core::shapes!(archive => chains);
    all.iter().flat_map(Layout::texts).collect()
}
