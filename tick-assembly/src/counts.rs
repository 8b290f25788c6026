//! The counts of an ordinary tick in core registers: the required conditions, differences of counts and revolutions,
//! and their transfer to the FPU. Loads are adjacent, because each load after the first is one cycle cheaper. Two words
//! are transferred at once.

use std::fmt::Write as _;

use tick_record::{Port, Role, ValueKind};

use crate::graph::{N, Node};
use crate::layout::{DriveLayout, Pointers};
use crate::ordinary::Ordinary;
use crate::text;

/// The beginning of a tick, with the data for its end.
pub(crate) struct Counts {
    /// Tests for a tick that the ordinary path cannot handle. The flags are then `ne`.
    pub(crate) flags: String,
    pub(crate) push: String,
    pub(crate) pop: String,
    code: Vec<Line>,
    /// Counts transferred to consecutive FPU registers; they hold the bits of a count.
    pub(crate) moved: Vec<N>,
    /// Changed state words, with their registers.
    stores: Vec<(&'static str, i32)>,
    /// Changed state words that equal a count of the sample and are loaded again: source and destination offsets.
    again: Vec<(i32, i32)>,
    /// Words that become 0.
    cleared: Vec<i32>,
    /// Register of the table and the status from here on.
    pub(crate) table: &'static str,
    pub(crate) health: &'static str,
    /// Final offset of the register of the sample.
    pub(crate) sample_at: i32,
    /// Whether a path leaves before this register has moved.
    pub(crate) leaves: bool,
    /// Cycles without saved registers.
    pub(crate) cycles: u32,
    /// Cycles to save and restore the caller's registers, or to use fewer registers.
    pub(crate) saved: u32,
}

enum Line {
    Text(String),
    /// Leave if not equal.
    Leave,
    /// Transfers these core registers to the next FPU registers.
    Move(Vec<&'static str>),
}

struct Writer<'a> {
    ordinary: &'a Ordinary<'a>,
    layout: &'a DriveLayout,
    /// Number of encoders.
    shafts: usize,
    /// Whether counts that are stored unchanged are loaded again.
    anew: bool,
    names: Vec<&'static str>,
    held: Vec<Option<N>>,
    used: usize,
    left: Vec<usize>,
    code: Vec<Line>,
    cycles: u32,
    loaded: bool,
}

/// Cycles of [`Writer::flags`].
const FLAGS: u32 = 2 + 1 + 1 + 1;

/// Stores from a register, and words that are loaded again.
type Kept = (Vec<(&'static str, i32)>, Vec<(i32, i32)>);

const BOTH: Pointers = Pointers { state: Some("r0"), sample: Some("r1"), between: None, output: None };

impl Counts {
    /// Returns the cheaper variant: a count that is stored unchanged stays in its register, or is loaded again.
    pub(crate) fn of(ordinary: &Ordinary<'_>, layout: &DriveLayout, whole: bool) -> Result<Self, String> {
        let stays = Self::written(ordinary, layout, whole, false)?;
        let again = Self::written(ordinary, layout, whole, true)?;
        let all = |counts: &Self| counts.cycles + counts.saved;
        if all(&again) >= all(&stays) {
            return Ok(stays);
        }
        // The cost of fewer registers is not part of the lower bound.
        Ok(Self { cycles: stays.cycles, saved: all(&again) - stays.cycles, ..again })
    }

    fn written(ordinary: &Ordinary<'_>, layout: &DriveLayout, whole: bool, anew: bool) -> Result<Self, String> {
        let mut writer = Writer::new(ordinary, layout, whole, anew);
        let moved = ordinary.counts(whole);
        let is_kept = |n: &N| !writer.is_fetched(*n);
        let kept: Vec<N> = ordinary.counts_of_state().iter().map(|(_, n)| *n).filter(is_kept).collect();
        let equal = ordinary.equal.iter().flat_map(|(a, b)| [*a, *b]);
        for n in moved.iter().copied().chain(kept).chain(equal) {
            writer.expect(n);
        }
        let moved = writer.go_over(&moved)?;
        let sample_at = layout.targets_at();
        writer.put(1, format!("add.w r1, r1, #{sample_at}"));
        let (stores, again) = writer.kept()?;
        let cleared =
            layout.cleared.iter().map(|name| writer.word(name, ValueKind::Number)).collect::<Result<Vec<_>, _>>()?;
        let table = writer.free(N::MAX)?;
        let health = if whole { writer.free(N::MAX)? } else { "r1" };
        let fetched = again.len() + usize::from(!again.is_empty());
        let cycles = writer.cycles + (stores.len() + again.len() + fetched + 1 + cleared.len()) as u32;
        let scratch = writer.names.iter().position(|name| *name == "r4").unwrap_or_default();
        let cores = writer.used.saturating_sub(scratch);
        let (push, pop) = text::saved(0, cores, 0);
        Ok(Self {
            flags: writer.flags()?,
            push,
            pop,
            leaves: !ordinary.equal.is_empty(),
            code: writer.code,
            moved,
            stores,
            again,
            cleared,
            table,
            health,
            sample_at,
            cycles: cycles + FLAGS,
            saved: if cores > 0 { 2 * (1 + cores.next_multiple_of(2) as u32) } else { 0 },
        })
    }

    /// Returns the text, with the FPU registers from `top` on.
    pub(crate) fn text(&self, top: usize, away: &str) -> String {
        let (mut text, mut top) = (String::new(), top);
        for line in &self.code {
            let _ = match line {
                Line::Text(line) => writeln!(text, "\t{line}"),
                Line::Leave => writeln!(text, "\tbne.w {away}"),
                Line::Move(registers) => {
                    top += registers.len();
                    match registers.as_slice() {
                        [one, other] => writeln!(text, "\tvmov s{}, s{}, {one}, {other}", top - 2, top - 1),
                        _ => writeln!(text, "\tvmov s{}, {}", top - 1, registers[0]),
                    }
                }
            };
        }
        text
    }

    /// Returns the stores of the counts, for these offsets of r0 and r1 from state and sample.
    pub(crate) fn stores(&self, state: i32, sample: i32) -> String {
        let store = |register: &str, at: i32| format!("\tstr.w {register}, [r0, #{}]\n", at - state);
        let mut text: String = self.stores.iter().map(|(register, at)| store(register, *at)).collect();
        let fetched = || self.stores.iter().map(|(register, _)| register).zip(&self.again);
        for (register, (from, _)) in fetched() {
            // After r1 only the wide form exists, and not every assembler accepts its name.
            let wide = if *from < sample { "" } else { ".w" };
            let _ = writeln!(text, "\tldr{wide} {register}, [r1, #{}]", from - sample);
        }
        text.extend(fetched().map(|(register, (_, at))| store(register, *at)));
        if let Some((zero, _)) = self.stores.first() {
            let _ = writeln!(text, "\tmov.w {zero}, #0");
            text.extend(self.cleared.iter().map(|at| store(zero, *at)));
        }
        text
    }
}

impl<'a> Writer<'a> {
    fn new(ordinary: &'a Ordinary<'a>, layout: &'a DriveLayout, whole: bool, anew: bool) -> Self {
        let names = if whole {
            vec!["ip", "r3", "r4", "r5", "r6", "r7", "r8", "r9"]
        } else {
            vec!["ip", "r3", "r2", "r4", "r5", "r6", "r7", "r8"]
        };
        Self {
            ordinary,
            layout,
            shafts: ordinary.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_))).count(),
            anew,
            held: vec![None; names.len()],
            names,
            used: 0,
            left: vec![0; ordinary.graph.nodes.len()],
            code: Vec::new(),
            cycles: 0,
            loaded: false,
        }
    }

    /// Returns whether the value is an unchanged count in memory, which is loaded again to be stored.
    fn is_fetched(&self, n: N) -> bool {
        self.anew && matches!(self.ordinary.graph.nodes[n], Node::Input(_))
    }

    /// Transfers the revolutions, then each encoder; returns the counts in the order of their transfer.
    fn go_over(&mut self, moved: &[N]) -> Result<Vec<N>, String> {
        let shaft = |n: N| {
            self.ordinary.cone(n).find_map(|input| match self.ordinary.inputs[input].role {
                Role::Sample(i) => Some(i),
                _ => None,
            })
        };
        let shaft_of: Vec<Option<usize>> = moved.iter().map(|n| shaft(*n)).collect();
        let mut order = Vec::new();
        for i in 0..=self.shafts {
            let group = moved.iter().zip(&shaft_of).filter(|(_, shaft)| **shaft == i.checked_sub(1));
            let group: Vec<N> = group.map(|(n, _)| *n).collect();
            // All at once, except for the last encoder if registers are short.
            if !self.anew || i < self.shafts {
                group.iter().try_for_each(|n| self.load_inputs(*n))?;
            }
            if i == 0 {
                self.test()?;
            }
            self.move_over(&group)?;
            order.extend(group);
        }
        Ok(order)
    }

    /// Writes the tests of counts that must be equal.
    fn test(&mut self) -> Result<(), String> {
        let equal = &self.ordinary.equal;
        equal.iter().flat_map(|(a, b)| [a, b]).try_for_each(|n| self.load_inputs(*n))?;
        for (a, b) in equal {
            let (one, other) = (self.value(*a)?, self.value(*b)?);
            self.put(1, format!("cmp.w {one}, {other}"));
            self.code.push(Line::Leave);
            self.cycles += 1;
            self.used(*a);
            self.used(*b);
        }
        Ok(())
    }

    fn move_over(&mut self, counts: &[N]) -> Result<(), String> {
        let ready: Vec<&'static str> = counts.iter().map(|n| self.value(*n)).collect::<Result<_, _>>()?;
        for pair in ready.chunks(2) {
            self.code.push(Line::Move(pair.to_vec()));
            self.cycles += 2;
            self.loaded = false;
        }
        for n in counts {
            self.used(*n);
        }
        Ok(())
    }

    /// Returns state words that are stored from a register, and words that are loaded again with source and
    /// destination.
    fn kept(&mut self) -> Result<Kept, String> {
        let (mut stores, mut again) = (Vec::new(), Vec::new());
        for (port, n) in self.ordinary.counts_of_state() {
            let (_, at) = self.place(port, "a word of the state")?;
            match self.ordinary.graph.nodes[n] {
                Node::Input(input) if self.anew => {
                    let (_, from) = self.place(&self.ordinary.inputs[input], "a count in memory")?;
                    again.push((from, at));
                }
                _ => stores.push((self.value(n)?, at)),
            }
        }
        // Each uses a register that has been stored.
        if again.len() > stores.len() {
            return Err("more counts to fetch anew than registers".into());
        }
        Ok((stores, again))
    }

    /// Returns the tests for the first tick and for a lost sample.
    fn flags(&self) -> Result<String, String> {
        let fresh = self.word("fresh", ValueKind::Truth)?;
        let mut inputs = self.ordinary.functions_inputs();
        let lost = inputs.find(|port| port.role == Role::Argument && port.kind == ValueKind::Truth);
        let (_, lost) = self.place(lost.ok_or("flags of lost samples")?, "flags of lost samples")?;
        // Loads two adjacent bytes at once.
        let load = if self.shafts == 2 { "ldrh.w" } else { "ldrb.w" };
        Ok(format!("\tldrb.w ip, [r0, #{fresh}]\n\t{load} r3, [r1, #{lost}]\n\torrs.w ip, ip, r3\n"))
    }

    /// Returns the offset of a state word.
    fn word(&self, name: &str, kind: ValueKind) -> Result<i32, String> {
        let port = Port { name: name.into(), role: Role::State, kind };
        self.place(&port, "a word of the state").map(|(_, at)| at)
    }

    fn place(&self, port: &Port, what: &str) -> Result<(&'static str, i32), String> {
        self.layout.place(port, &BOTH, &[]).ok_or_else(|| what.into())
    }

    fn expect(&mut self, n: N) {
        self.left[n] += 1;
        if self.left[n] == 1 {
            let operands: Vec<N> = self.ordinary.graph.nodes[n].operands().collect();
            for n in operands {
                self.expect(n);
            }
        }
    }

    fn put(&mut self, cycles: u32, text: String) {
        self.code.push(Line::Text(text));
        self.cycles += cycles;
        self.loaded = false;
    }

    fn used(&mut self, n: N) {
        self.left[n] -= 1;
        if self.left[n] == 0 {
            self.held.iter_mut().for_each(|held| *held = held.filter(|held| *held != n));
        }
    }

    fn free(&mut self, n: N) -> Result<&'static str, String> {
        let at = self.held.iter().position(Option::is_none).ok_or("more counts at once than core registers")?;
        self.held[at] = Some(n);
        self.used = self.used.max(at + 1);
        Ok(self.names[at])
    }

    fn load_inputs(&mut self, n: N) -> Result<(), String> {
        if self.held.contains(&Some(n)) {
            return Ok(());
        }
        if let Node::Input(_) = self.ordinary.graph.nodes[n] {
            return self.value(n).map(|_| ());
        }
        let operands: Vec<N> = self.ordinary.graph.nodes[n].operands().collect();
        operands.into_iter().try_for_each(|n| self.load_inputs(n))
    }

    fn value(&mut self, n: N) -> Result<&'static str, String> {
        if let Some(at) = self.held.iter().position(|held| *held == Some(n)) {
            return Ok(self.names[at]);
        }
        let node = self.ordinary.graph.nodes[n];
        match node {
            Node::Input(at) => {
                let port = &self.ordinary.inputs[at];
                let (base, at) = self.place(port, "a count in memory")?;
                let to = self.free(n)?;
                let cycles = if self.loaded { 1 } else { 2 };
                self.put(cycles, format!("ldr.w {to}, [{base}, #{at}]"));
                self.loaded = true;
                Ok(to)
            }
            Node::Count(bits) => {
                let to = self.free(n)?;
                self.put(1, format!("movw {to}, #{}", bits & 0xffff));
                if bits >> 16 != 0 {
                    self.put(1, format!("movt {to}, #{}", bits >> 16));
                }
                Ok(to)
            }
            Node::CountSince(a, b) | Node::CountPlus(a, b) => {
                let (one, other) = (self.value(a)?, self.value(b)?);
                for n in [a, b] {
                    self.used(n);
                }
                let to = self.free(n)?;
                let name = if matches!(node, Node::CountPlus(..)) { "add.w" } else { "sub.w" };
                self.put(1, format!("{name} {to}, {one}, {other}"));
                Ok(to)
            }
            Node::CountSigned(a, bits) => {
                let one = self.value(a)?;
                self.used(a);
                let to = self.free(n)?;
                self.put(1, format!("sbfx {to}, {one}, #0, #{bits}"));
                Ok(to)
            }
            other => Err(format!("{other:?} is no count of an ordinary tick")),
        }
    }
}
