//! The counts of an ordinary tick, in core registers: what is to be there at all, differences of counts and turns, and
//! their way into the FPU. Loads stand together, where each behind the first is one cycle cheaper, and two words go
//! over at once.

use std::fmt::Write as _;

use tick_record::{Kind, Role};

use crate::graph::{N, Node};
use crate::layout::{DriveLayout, Pointers};
use crate::ordinary::Ordinary;

/// The beginning of a tick, and what it leaves for the end.
pub(crate) struct Counts {
    /// Is there anything that the ordinary way cannot do? The flags say `ne`.
    pub(crate) flags: String,
    pub(crate) push: String,
    pub(crate) pop: String,
    code: Vec<Line>,
    /// Counts that go over into the FPU, into registers in a row; they hold the bits of a count.
    pub(crate) moved: Vec<N>,
    /// Words of the state that have become others, and in which registers they are.
    stores: Vec<(&'static str, i32)>,
    /// Those that are counts of the sample as they lie there, and are fetched anew: from where, and to where.
    again: Vec<(i32, i32)>,
    /// Words that become 0.
    cleared: Vec<i32>,
    /// Where the table and the health are from here on.
    pub(crate) table: &'static str,
    pub(crate) health: &'static str,
    /// Where the sample's register points at the end.
    pub(crate) sample_at: i32,
    /// Is there a way away before it has moved?
    pub(crate) leaves: bool,
    /// What is saved aside.
    pub(crate) cycles: u32,
    /// Cycles to keep what the caller needs, and bring it back, or to do with fewer registers.
    pub(crate) saved: u32,
}

enum Line {
    Text(String),
    /// Away, if not equal.
    Leave,
    /// These of the core registers to the next of the FPU.
    Move(Vec<&'static str>),
}

struct Writer<'a> {
    ordinary: &'a Ordinary<'a>,
    layout: &'a DriveLayout,
    names: Vec<&'static str>,
    held: Vec<Option<N>>,
    used: usize,
    left: Vec<usize>,
    code: Vec<Line>,
    cycles: u32,
    loaded: bool,
}

const BOTH: Pointers = Pointers { state: Some("r0"), sample: Some("r1"), between: None, output: None };

impl Counts {
    /// A count that is stored as it came stays in its register, or is fetched anew: the cheaper of both.
    pub(crate) fn of(ordinary: &Ordinary<'_>, layout: &DriveLayout, whole: bool) -> Result<Self, String> {
        let stays = Self::written(ordinary, layout, whole, false)?;
        let again = Self::written(ordinary, layout, whole, true)?;
        let all = |counts: &Self| counts.cycles + counts.saved;
        if all(&again) >= all(&stays) {
            return Ok(stays);
        }
        // What fewer registers cost is none of what must be done.
        Ok(Self { cycles: stays.cycles, saved: all(&again) - stays.cycles, ..again })
    }

    #[allow(clippy::too_many_lines, reason = "one text, from its first line to its last")]
    fn written(ordinary: &Ordinary<'_>, layout: &DriveLayout, whole: bool, anew: bool) -> Result<Self, String> {
        let names = if whole {
            vec!["ip", "r3", "r4", "r5", "r6", "r7", "r8", "r9"]
        } else {
            vec!["ip", "r3", "r2", "r4", "r5", "r6", "r7", "r8"]
        };
        let mut writer = Writer {
            ordinary,
            layout,
            held: vec![None; names.len()],
            names,
            used: 0,
            left: vec![0; ordinary.graph.nodes.len()],
            code: Vec::new(),
            cycles: 0,
            loaded: false,
        };
        let (moved, kept) = (ordinary.counts(whole), ordinary.counts_of_state());
        let is_fetched = |n: N| anew && matches!(ordinary.graph.nodes[n], Node::Input(_));
        let mut roots = moved.clone();
        roots.extend(kept.iter().map(|(_, n)| *n).filter(|n| !is_fetched(*n)));
        roots.extend(ordinary.equal.iter().flat_map(|(a, b)| [*a, *b]));
        for n in &roots {
            writer.expect(*n);
        }
        // The turns, then each encoder.
        let mut groups: Vec<Vec<N>> = Vec::new();
        let shaft = |n: N| {
            ordinary.cone(n).find_map(|input| match ordinary.inputs[input].role {
                Role::Sample(i) => Some(i),
                _ => None,
            })
        };
        let shafts = ordinary.inputs.iter().filter(|port| matches!(port.role, Role::Sample(_))).count();
        for i in [None].into_iter().chain((0..shafts).map(Some)) {
            groups.push(moved.iter().copied().filter(|n| shaft(*n) == i).collect());
        }
        let mut order = Vec::new();
        for (i, group) in groups.iter().enumerate() {
            let turns = i == 0;
            let also: Vec<N> =
                if turns { ordinary.equal.iter().flat_map(|(a, b)| [*a, *b]).collect() } else { Vec::new() };
            // All at once, but for the last encoder where registers are short.
            if !anew || i < shafts {
                for n in group.iter().chain(&also) {
                    writer.load_inputs(*n)?;
                }
            }
            if turns {
                for (a, b) in &ordinary.equal {
                    let (one, other) = (writer.value(*a)?, writer.value(*b)?);
                    writer.put(1, format!("cmp.w {one}, {other}"));
                    writer.code.push(Line::Leave);
                    writer.cycles += 1;
                    for n in [a, b] {
                        writer.used(*n);
                    }
                }
            }
            let mut ready = Vec::new();
            for n in group {
                ready.push(writer.value(*n)?);
            }
            for pair in ready.chunks(2) {
                writer.code.push(Line::Move(pair.to_vec()));
                writer.cycles += 2;
                writer.loaded = false;
            }
            for n in group {
                writer.used(*n);
            }
            order.extend(group);
        }
        let sample_at = layout.targets_at();
        writer.put(1, format!("add.w r1, r1, #{sample_at}"));
        let (mut stores, mut again) = (Vec::new(), Vec::new());
        for (port, n) in &kept {
            let (_, at) = layout.place(port, &BOTH, &[]).ok_or("a word of the state")?;
            match ordinary.graph.nodes[*n] {
                Node::Input(input) if anew => {
                    let (_, from) = layout.place(&ordinary.inputs[input], &BOTH, &[]).ok_or("a count in memory")?;
                    again.push((from, at));
                }
                _ => stores.push((writer.value(*n)?, at)),
            }
        }
        // Each into a register that has been stored.
        if again.len() > stores.len() {
            return Err("more counts to fetch anew than registers".into());
        }
        let mut cleared = Vec::new();
        for name in &layout.cleared {
            let port = tick_record::Port { name: name.clone(), role: Role::State, kind: Kind::Number };
            let (_, at) = layout.place(&port, &BOTH, &[]).ok_or("a word of the state")?;
            cleared.push(at);
        }
        let table = writer.free(N::MAX)?;
        let health = if whole { writer.free(N::MAX)? } else { "r1" };
        let scratch = writer.names.iter().position(|name| *name == "r4").unwrap_or_default();
        let (mut push, mut pop) = (String::new(), String::new());
        let mut saved = 0;
        let fetched = again.len() + usize::from(!again.is_empty());
        let cycles = writer.cycles + (kept.len() + fetched + 1 + layout.cleared.len()) as u32;
        if writer.used > scratch {
            let last = 3 + (writer.used - scratch).next_multiple_of(2);
            let _ = writeln!(push, "\tpush.w {{r4-r{last}}}");
            let _ = writeln!(pop, "\tpop.w {{r4-r{last}}}");
            saved = 2 * (1 + last as u32 - 3);
        }
        let (flags, of_flags) = flags(ordinary, layout, shafts)?;
        Ok(Self {
            flags,
            push,
            pop,
            leaves: !ordinary.equal.is_empty(),
            code: writer.code,
            moved: order,
            stores,
            again,
            cleared,
            table,
            health,
            sample_at,
            cycles: cycles + of_flags,
            saved,
        })
    }

    /// The text, with the registers of the FPU from `top` on.
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

    /// Their stores, where r0 and r1 point so far behind state and sample.
    pub(crate) fn stores(&self, state: i32, sample: i32) -> String {
        let store = |register: &str, at: i32| format!("\tstr.w {register}, [r0, #{}]\n", at - state);
        let mut text: String = self.stores.iter().map(|(register, at)| store(register, *at)).collect();
        let fetched = || self.stores.iter().map(|(register, _)| register).zip(&self.again);
        for (register, (from, _)) in fetched() {
            // Behind r1 there is a wide form alone, and not every assembler knows it by that name.
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

/// Is it the first tick, or is a sample lost?
fn flags(ordinary: &Ordinary<'_>, layout: &DriveLayout, shafts: usize) -> Result<(String, u32), String> {
    let state = |name: &str| tick_record::Port { name: name.into(), role: Role::State, kind: Kind::Truth };
    let (_, fresh) = layout.place(&state("fresh"), &BOTH, &[]).ok_or("a flag `fresh`")?;
    let lost = ordinary.functions_inputs().find(|port| port.role == Role::Argument && port.kind == Kind::Truth);
    let (_, lost) = lost.and_then(|port| layout.place(port, &BOTH, &[])).ok_or("flags of lost samples")?;
    // Two bytes beside one another at once.
    let load = if shafts == 2 { "ldrh.w" } else { "ldrb.w" };
    Ok((format!("\tldrb.w ip, [r0, #{fresh}]\n\t{load} r3, [r1, #{lost}]\n\torrs.w ip, ip, r3\n"), 2 + 1 + 1 + 1))
}

impl Writer<'_> {
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
                let (base, at) = self.layout.place(port, &BOTH, &[]).ok_or("a count in memory")?;
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
