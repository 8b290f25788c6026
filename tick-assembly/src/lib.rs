#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod build;
mod cold;
mod counts;
mod drive;
mod graph;
mod layout;
mod ordinary;
mod parts;
mod schedule;
mod text;
mod tick;

use std::collections::HashMap;
use std::fmt::Write as _;

use tick_record::{Functions, Port, Record, Role, ValueKind};

use tick_record::drive::DriveFunctions;

use cold::Places;
use graph::Graph;

#[doc(inline)]
pub use layout::DriveLayout;

/// Effort of a search. Equal effort gives identical text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Number of searches from the beginning.
    pub rounds: usize,
    /// Number of changes tried in each.
    pub steps: usize,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Effort {
    /// Effort for firmware; takes some seconds.
    pub const FULL: Self = Self { rounds: 4, steps: 250_000, seed: 1 };
}

/// Memory layout of the state words: numbers first, then the two flags, one byte each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The numbers in order, by name.
    pub words: Vec<String>,
}

impl Layout {
    /// Returns the layout for a plant of order n. u is first, since it is returned in the first register. The sample
    /// follows in memory order, with state words where it is not stored. The other words follow in the order of the
    /// trace, the offset last.
    pub fn of(functions: &Functions, n: usize) -> Self {
        let numbers: Vec<&str> = functions
            .state
            .iter()
            .filter(|word| word.kind == ValueKind::Number)
            .map(|word| word.name.as_str())
            .collect();
        let count = numbers.len();
        let previous = |i: usize| format!("x{i}_prev");
        let mut words = vec![String::new(); count];
        words[0] = "held".into();
        for i in 1..=n.min(count - 1) {
            if numbers.contains(&previous(i).as_str()) {
                words[i] = previous(i);
            }
        }
        let of_channel =
            |name: &&str| name.trim_start_matches(|c: char| !c.is_ascii_digit()).parse::<usize>().unwrap_or(0);
        let is_p = |name: &&str| name.starts_with('p');
        let mut p: Vec<&str> = numbers.iter().copied().filter(|name| is_p(name)).collect();
        p.sort_by_key(|name| (of_channel(name) != n, of_channel(name)));
        let rest = numbers.iter().copied().filter(|name| !is_p(name) && *name != "offset");
        let rest: Vec<&str> = p.into_iter().chain(rest).chain(["offset"]).collect();
        for name in rest {
            if !words.iter().any(|word| word == name) {
                let Some(free) = words.iter().position(String::is_empty) else {
                    unreachable!("a place for every word")
                };
                words[free] = name.into();
            }
        }
        Self { words }
    }

    fn word(&self, name: &str) -> Option<usize> {
        self.words.iter().position(|word| word == name)
    }

    /// Returns the start of the estimates, from this word on.
    fn estimates_from(&self, from: usize) -> usize {
        let of_last_tick = |word: &&String| word.starts_with(['p', 'x', 'h', 'g']);
        from + self.words[from..].iter().take_while(of_last_tick).count()
    }

    fn resuming(&self) -> i32 {
        4 * self.words.len() as i32
    }

    /// Returns the memory locations, with the state at r0 minus this number of bytes; `output` points to the output.
    /// Each row of estimates has this number of words.
    fn places(
        &self,
        state_at: i32,
        output: &'static str,
        columns: usize,
    ) -> impl Fn(&Port) -> Option<(&'static str, i32)> {
        move |port| {
            let word = |at: usize| 4 * at as i32;
            match (port.role, port.name.as_str()) {
                (Role::State, "resuming") => Some(("r0", self.resuming() - state_at)),
                (Role::State, "started") => Some(("r0", self.resuming() + 1 - state_at)),
                (Role::State, name) => self.word(name).map(|at| ("r0", word(at) - state_at)),
                (Role::Sample(j), _) => Some(("r1", word(j))),
                (Role::Output, name) => {
                    ["u", "sigma", "sigma_star"].iter().position(|one| *one == name).map(|at| (output, word(at)))
                }
                (Role::Estimate(i, m), _) => Some(("r1", word(i * columns + m))),
                _ => None,
            }
        }
    }
}

/// The functions of a controller as text for the GNU assembler, with the data that a caller needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assembly {
    /// The functions.
    pub text: String,
    /// Layout of the state words.
    pub layout: Layout,
    /// Typical cycles of a valid sample if only u is read, by the cost model of the search, return included.
    pub cycles: u32,
    /// Typical cycles with the whole output.
    pub cycles_whole: u32,
    /// Lower bound for every order: each operation and each memory word once, without waits and saved registers.
    pub floor: u32,
    /// Lower bound with the whole output.
    pub floor_whole: u32,
}

/// The code of a tick, and the cycles of its ordinary path.
struct Emitted {
    text: String,
    cycles: u32,
    floor: u32,
}

/// The functions of a drive as text for the GNU assembler, with the data that a caller needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DriveAssembly {
    /// The functions.
    pub text: String,
    /// Layout of the state words.
    pub layout: DriveLayout,
    /// Typical cycles of an ordinary tick if only u is read, by the cost model of the search, return included.
    pub cycles: u32,
    /// Typical cycles with the whole output.
    pub cycles_whole: u32,
    /// Lower bound for every order: each operation and each memory word once, without waits and saved registers.
    pub floor: u32,
    /// Lower bound with the whole output.
    pub floor_whole: u32,
}

/// Text of functions, each in its own section.
struct Text(String);

impl Text {
    fn new() -> Self {
        Self("\t.syntax unified\n\t.cpu cortex-m4\n\t.fpu fpv4-sp-d16\n\t.thumb\n".into())
    }

    fn function(&mut self, name: &str, code: &str) {
        let _ = write!(
            self.0,
            "\n\t.section .text.{name}, \"ax\", %progbits\n\t.balign 8\n\t.global {name}\n\t.type {name}, %function\n\
             \t.thumb_func\n{name}:\n{code}\t.size {name}, .-{name}\n"
        );
    }
}

/// Writes the functions of a drive. All names begin with `prefix`.
///
/// # Errors
/// If a function cannot be scheduled, with the reason.
pub fn drive_assembly(functions: &DriveFunctions, prefix: &str, effort: &Effort) -> Result<DriveAssembly, String> {
    let layout = DriveLayout::of(functions);
    let ordinary = ordinary::Ordinary::of(functions)?;
    let mut text = Text::new();
    let u = drive::tick(&ordinary, &layout, prefix, false, effort)?;
    text.function(&format!("{prefix}_tick_u"), &u.text);
    let whole = drive::tick(&ordinary, &layout, prefix, true, effort)?;
    text.function(&format!("{prefix}_tick"), &whole.text);
    text.function(&format!("{prefix}_rest"), &parts::rest(&layout, prefix)?);
    for (what, record) in parts::all(functions) {
        let name = format!("{prefix}_{what}");
        text.function(&name, &parts::part(what, record, &layout, &name)?);
    }
    let (cycles, cycles_whole) = (u.cycles, whole.cycles);
    Ok(DriveAssembly { text: text.0, layout, cycles, cycles_whole, floor: u.floor, floor_whole: whole.floor })
}

/// Writes the functions of a controller of plant order n and highest observer order r. All names begin with `prefix`.
///
/// # Errors
/// If a function cannot be scheduled, with the reason.
pub fn assembly(functions: &Functions, n: usize, r: usize, prefix: &str, effort: &Effort) -> Result<Assembly, String> {
    let layout = Layout::of(functions, n);
    let mut text = Text::new();
    let name = |what: &str| format!("{prefix}_{what}");
    let u = tick::tick(&functions.tick, &layout, &name("tick_u"), false, effort)?;
    text.function(&name("tick_u"), &u.text);
    let whole = tick::tick(&functions.tick, &layout, &name("tick"), true, effort)?;
    text.function(&name("tick"), &whole.text);
    for (what, record) in [
        ("start", &functions.start),
        ("not_started", &functions.not_started),
        ("report_applied", &functions.report_applied),
        ("estimates", &functions.estimates),
        ("reset", &functions.reset),
    ] {
        let code = plain(record, &layout, &name(what), r)?;
        text.function(&name(what), &code);
    }
    let (cycles, cycles_whole) = (u.cycles, whole.cycles);
    Ok(Assembly { text: text.0, layout, cycles, cycles_whole, floor: u.floor, floor_whole: whole.floor })
}

/// Writes a function in the order of its results.
fn plain(record: &Record, layout: &Layout, name: &str, r: usize) -> Result<String, String> {
    let mut graph = Graph::default();
    let values = graph.values(record, &HashMap::new());
    let argument = |(at, port): (usize, &Port)| {
        let node = graph.nodes.iter().position(|node| *node == graph::Node::Input(at))?;
        (port.role == Role::Argument).then_some((node, 0_u8))
    };
    let has_state = record.inputs.iter().chain(&record.results).any(|port| port.role == Role::State);
    // A function that only fills an output has it as its first argument.
    let place = layout.places(0, if has_state { "r2" } else { "r0" }, r);
    let places = Places {
        place: &place,
        u_alone: false,
        table: "r3",
        table_at: 0,
        arguments: record.inputs.iter().enumerate().filter_map(argument).collect(),
        flag: None,
    };
    cold::function(record, &graph, &values, &places, name)
}
