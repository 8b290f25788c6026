//! Code for what is seldom executed: in the order in which results are asked for, numbers loaded where they are used.
//!
//! Numbers take registers of the FPU from the first that is free, truths r4 to r7 as 0 or 1. A word of the state is
//! stored as soon as no result that is still to come reads what it was.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use tick_record::{Block, End, Port, Record, Role, Test};

use crate::graph::{Graph, N, Node};

/// Where a function finds things.
pub(crate) struct Places<'a> {
    /// Of a word of the state, its place in bytes.
    pub(crate) word: &'a dyn Fn(&Port) -> i32,
    /// What r0 points at, from the state on.
    pub(crate) state_at: i32,
    /// The core register with the sample, or with the estimates.
    pub(crate) other: &'static str,
    /// The core register with the output; without one u goes out in s0.
    pub(crate) output: Option<&'static str>,
    /// Words in a row of the estimates.
    pub(crate) columns: usize,
    /// Where r3 points in the table.
    pub(crate) table_at: usize,
    /// Inputs that are in registers of the FPU.
    pub(crate) arguments: HashMap<N, u8>,
    /// A truth that is in `ip`.
    pub(crate) flag: Option<N>,
}

/// Code, and what it uses.
pub(crate) struct Cold<'a> {
    graph: &'a Graph,
    inputs: &'a [Port],
    places: &'a Places<'a>,
    /// Constants of the whole function.
    table: &'a mut Vec<u32>,
    label: &'a str,
    labels: usize,
    pub(crate) code: String,
    numbers: [Option<N>; 32],
    first_number: usize,
    truths: [Option<N>; 4],
    left: HashMap<N, usize>,
    pub(crate) numbers_used: usize,
    pub(crate) truths_used: usize,
}

/// Not enough registers: what to say of it.
const CROWDED: &str = "more numbers live at once than there are registers";

macro_rules! line {
    ($cold:expr, $($text:tt)*) => {{
        let _ = writeln!($cold.code, "\t{}", format_args!($($text)*));
    }};
}

impl<'a> Cold<'a> {
    pub(crate) fn new(
        graph: &'a Graph,
        inputs: &'a [Port],
        places: &'a Places<'a>,
        table: &'a mut Vec<u32>,
        label: &'a str,
        first_number: usize,
    ) -> Self {
        let mut numbers = [None; 32];
        // Those below belong to another way.
        numbers[..first_number].fill(Some(N::MAX));
        for (n, register) in &places.arguments {
            numbers[usize::from(*register)] = Some(*n);
        }
        Self {
            graph,
            inputs,
            places,
            table,
            label,
            labels: 0,
            code: String::new(),
            numbers,
            first_number,
            truths: [None; 4],
            left: HashMap::new(),
            numbers_used: 0,
            truths_used: 0,
        }
    }

    fn node(&self, n: N) -> Node {
        self.graph.nodes[n]
    }

    /// The place of a constant from r3 on.
    fn constant(&mut self, bits: u32) -> i32 {
        let at = self.table.iter().position(|entry| *entry == bits).unwrap_or_else(|| {
            self.table.push(bits);
            self.table.len() - 1
        });
        4 * (at as i32 - self.places.table_at as i32)
    }

    /// Counts how often each value is still asked for on the way to these.
    fn expect(&mut self, roots: &[N]) {
        self.left.clear();
        let mut open = roots.to_vec();
        while let Some(n) = open.pop() {
            let count = self.left.entry(n).or_default();
            *count += 1;
            if *count == 1 && !self.is_held(n) {
                open.extend(self.node(n).operands());
            }
        }
        let wanted = |held: &Option<N>| held.filter(|n| *n == N::MAX || self.left.contains_key(n));
        self.numbers = self.numbers.each_ref().map(wanted);
        self.truths = self.truths.each_ref().map(wanted);
    }

    fn is_held(&self, n: N) -> bool {
        self.numbers.contains(&Some(n)) || self.truths.contains(&Some(n)) || self.places.flag == Some(n)
    }

    fn used(&mut self, n: N) {
        let left = self.left.entry(n).or_default();
        *left = left.saturating_sub(1);
        if *left == 0 {
            let gone = |held: &mut Option<N>| *held = held.filter(|held| *held != n);
            self.numbers.iter_mut().for_each(gone);
            self.truths.iter_mut().for_each(gone);
        }
    }

    fn free_number(&mut self, holder: N) -> Result<usize, String> {
        let free = self.numbers[self.first_number..].iter().position(Option::is_none).ok_or(CROWDED)?;
        let at = self.first_number + free;
        self.numbers[at] = Some(holder);
        self.numbers_used = self.numbers_used.max(at + 1);
        Ok(at)
    }

    fn free_truth(&mut self, holder: N) -> Result<usize, String> {
        let at = self.truths.iter().position(Option::is_none).ok_or("more truths live at once than registers")?;
        self.truths[at] = Some(holder);
        self.truths_used = self.truths_used.max(at + 1);
        Ok(at)
    }

    /// A number in a register; one that is loaded for this use alone is let go by the caller.
    fn number(&mut self, n: N) -> Result<(usize, bool), String> {
        if let Some(at) = self.numbers.iter().position(|held| *held == Some(n)) {
            return Ok((at, false));
        }
        match self.node(n) {
            Node::Input(port) => {
                let port = &self.inputs[port];
                let (base, at) = match port.role {
                    Role::Sample(j) => (self.places.other, 4 * j as i32),
                    Role::State => ("r0", (self.places.word)(port) - self.places.state_at),
                    _ => return Err(format!("`{}` is in no register", port.name)),
                };
                let register = self.free_number(N::MAX - 1)?;
                line!(self, "vldr s{register}, [{base}, #{at}]");
                Ok((register, true))
            }
            Node::Number(bits) => {
                let at = self.constant(bits);
                let register = self.free_number(N::MAX - 1)?;
                line!(self, "vldr s{register}, [r3, #{at}]");
                Ok((register, true))
            }
            _ => self.computed(n).map(|register| (register, false)),
        }
    }

    /// The operands in registers, for an operation that is then written; afterwards what nobody needs is let go.
    fn operands(&mut self, all: &[N]) -> Result<Vec<usize>, String> {
        let mut loaded = Vec::new();
        for n in all {
            let (register, only_here) = self.number(*n)?;
            loaded.push((register, only_here));
        }
        for (n, (register, only_here)) in all.iter().zip(&loaded) {
            if *only_here {
                self.numbers[*register] = None;
            }
            self.used(*n);
        }
        Ok(loaded.into_iter().map(|(register, _)| register).collect())
    }

    fn computed(&mut self, n: N) -> Result<usize, String> {
        let two = |name: &str, a: N, b: N| (name.to_owned(), vec![a, b]);
        let (name, operands) = match self.node(n) {
            Node::Neg(a) => ("vneg".into(), vec![a]),
            Node::Abs(a) => ("vabs".into(), vec![a]),
            Node::Add(a, b) => two("vadd", a, b),
            Node::Sub(a, b) => two("vsub", a, b),
            Node::Mul(a, b) => two("vmul", a, b),
            Node::Div(a, b) => two("vdiv", a, b),
            Node::Select(c, a, b) => return self.selected(n, c, a, b),
            other => return Err(format!("{other:?} is no number to compute")),
        };
        let sources = self.operands(&operands)?;
        let register = self.free_number(n)?;
        let sources: Vec<String> = sources.iter().map(|at| format!("s{at}")).collect();
        line!(self, "{name}.f32 s{register}, {}", sources.join(", "));
        Ok(register)
    }

    fn selected(&mut self, n: N, c: N, a: N, b: N) -> Result<usize, String> {
        // All before the flags are set.
        let (yes, yes_only) = self.number(a)?;
        let (no, no_only) = self.number(b)?;
        // A comparison for this alone stays in the flags.
        let holds = match self.node(c) {
            Node::Compare(test, x, limit) if self.left.get(&c) == Some(&1) && !self.is_held(c) => {
                let sources = self.operands(&[x, limit])?;
                line!(self, "vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr", sources[0], sources[1]);
                condition(test).0
            }
            _ => {
                let truth = self.truth(c)?;
                line!(self, "cmp.w {truth}, #0");
                "ne"
            }
        };
        let register = if no_only {
            self.numbers[no] = Some(n);
            no
        } else {
            let register = self.free_number(n)?;
            line!(self, "vmov.f32 s{register}, s{no}");
            register
        };
        line!(self, "it {holds}\n\tvmov{holds}.f32 s{register}, s{yes}");
        if yes_only {
            self.numbers[yes] = None;
        }
        for n in [a, b, c] {
            self.used(n);
        }
        Ok(register)
    }

    /// A truth in a core register, as 0 or 1.
    fn truth(&mut self, n: N) -> Result<String, String> {
        if self.places.flag == Some(n) {
            return Ok("ip".into());
        }
        let name = |at: usize| format!("r{}", 4 + at);
        if let Some(at) = self.truths.iter().position(|held| *held == Some(n)) {
            return Ok(name(at));
        }
        let at = match self.node(n) {
            Node::Truth(truth) => {
                let at = self.free_truth(n)?;
                line!(self, "mov.w {}, #{}", name(at), u8::from(truth));
                at
            }
            Node::Input(port) => {
                let from = (self.places.word)(&self.inputs[port]) - self.places.state_at;
                let at = self.free_truth(n)?;
                line!(self, "ldrb.w {}, [r0, #{from}]", name(at));
                at
            }
            Node::Compare(test, a, b) => {
                let sources = self.operands(&[a, b])?;
                let at = self.free_truth(n)?;
                let (yes, no) = condition(test);
                line!(self, "vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr", sources[0], sources[1]);
                line!(self, "ite {yes}\n\tmov{yes}.w {r}, #1\n\tmov{no}.w {r}, #0", r = name(at));
                at
            }
            Node::And(a, b) | Node::Or(a, b) => {
                // A chain from its end, so that it holds two at a time.
                let (a, b) = if matches!(self.node(b), Node::And(..) | Node::Or(..)) { (b, a) } else { (a, b) };
                let (one, other) = (self.truth(a)?, self.truth(b)?);
                self.used(a);
                self.used(b);
                let at = self.free_truth(n)?;
                let name_of = if matches!(self.node(n), Node::And(..)) { "and" } else { "orr" };
                line!(self, "{name_of}.w {}, {one}, {other}", name(at));
                at
            }
            Node::Not(a) => {
                let one = self.truth(a)?;
                self.used(a);
                let at = self.free_truth(n)?;
                line!(self, "eor.w {}, {one}, #1", name(at));
                at
            }
            other => return Err(format!("{other:?} is no truth to compute")),
        };
        Ok(name(at))
    }

    /// The truth of one value, in the flags: `ne` if it holds.
    pub(crate) fn decide(&mut self, n: N) -> Result<(), String> {
        self.expect(&[n]);
        let truth = self.truth(n)?;
        line!(self, "cmp.w {truth}, #0");
        Ok(())
    }

    /// A block with all that follows; `leave` is written where it ends.
    pub(crate) fn block(&mut self, record: &Record, block: &Block, values: &[N], leave: &str) -> Result<(), String> {
        match &block.end {
            End::Return(results) => {
                let results: Vec<N> = results.iter().map(|id| values[id.index()]).collect();
                self.give(record, &results, leave)
            }
            End::Branch { condition, yes, no } => {
                let condition = values[condition.index()];
                self.decide(condition)?;
                self.labels += 1;
                let label = format!(".L{}_{}", self.label, self.labels);
                line!(self, "beq.w {label}");
                let (numbers, truths) = (self.numbers, self.truths);
                self.block(record, yes, values, leave)?;
                (self.numbers, self.truths) = (numbers, truths);
                let _ = writeln!(self.code, "{label}:");
                self.block(record, no, values, leave)
            }
        }
    }

    /// All results to their places, and the answer or the health into r0.
    pub(crate) fn give(&mut self, record: &Record, results: &[N], leave: &str) -> Result<(), String> {
        let stays = |port: &Port, n: N| {
            port.role == Role::State && matches!(self.node(n), Node::Input(at) if self.inputs[at].name == port.name)
        };
        let last = |role: Role| matches!(role, Role::Flag(_) | Role::Answer);
        let mut open: Vec<(&Port, N)> = record.results.iter().zip(results.iter().copied()).collect();
        open.retain(|(port, n)| !stays(port, *n) && (self.places.output.is_some() || is_told(port)));
        // What other words are made of is overwritten last.
        let reads: Vec<HashSet<N>> = open.iter().map(|(_, n)| self.inputs_of(*n)).collect();
        let own = |port: &Port| self.inputs.iter().position(|input| input.name == port.name && input.role == port.role);
        let own_input: Vec<Option<N>> =
            open.iter().map(|(port, _)| own(port).and_then(|at| self.graph_input(at))).collect();
        let waits_for = |k: usize, done: &[bool]| {
            own_input[k].is_some_and(|own| {
                reads.iter().enumerate().any(|(j, reads)| j != k && !done[j] && reads.contains(&own))
            })
        };
        self.expect(&open.iter().map(|(_, n)| *n).collect::<Vec<_>>());
        let mut computed = vec![false; open.len()];
        let mut stored = vec![false; open.len()];
        // Those that many wait for first.
        let mut order: Vec<usize> = (0..open.len()).filter(|k| !last(open[*k].0.role)).collect();
        order.sort_by_key(|k| (own_input[*k].is_none(), reads[*k].len()));
        order.reverse();
        let flags: Vec<usize> = (0..open.len()).filter(|k| last(open[*k].0.role)).collect();
        // Truths that are told stay in their registers; they are few.
        for k in flags.iter().copied() {
            if !matches!(self.node(open[k].1), Node::Truth(_)) {
                self.truth(open[k].1)?;
            }
            computed[k] = true;
        }
        let mut held: HashMap<usize, usize> = HashMap::new();
        for k in order {
            let (port, n) = open[k];
            if waits_for(k, &computed) {
                // It is computed now and stored later.
                if port.kind == tick_record::Kind::Truth {
                    self.truth(n)?;
                } else {
                    let (register, only_here) = self.number(n)?;
                    if only_here {
                        self.numbers[register] = Some(N::MAX - 2 - k);
                    }
                    held.insert(k, register);
                }
                computed[k] = true;
            } else {
                self.store(port, n, None)?;
                computed[k] = true;
                stored[k] = true;
            }
            for j in 0..open.len() {
                if computed[j] && !stored[j] && !last(open[j].0.role) && !waits_for(j, &computed) {
                    let (port, n) = open[j];
                    self.store(port, n, held.get(&j).copied())?;
                    if let Some(register) = held.remove(&j)
                        && self.numbers[register] == Some(N::MAX - 2 - j)
                    {
                        self.numbers[register] = None;
                    }
                    stored[j] = true;
                }
            }
        }
        let constant = |n: N| if let Node::Truth(truth) = self.graph.nodes[n] { Some(truth) } else { None };
        let bit = |role: Role| if let Role::Flag(bit) = role { 1_u32 << bit } else { 1 };
        if !flags.is_empty() {
            let always: u32 =
                flags.iter().filter(|k| constant(open[**k].1) == Some(true)).map(|k| bit(open[*k].0.role)).sum();
            line!(self, "mov.w r0, #{always}");
            for k in flags {
                let (port, n) = open[k];
                if constant(n).is_none() {
                    let truth = self.truth(n)?;
                    line!(self, "cmp.w {truth}, #0\n\tit ne\n\torrne.w r0, r0, #{}", bit(port.role));
                }
            }
        }
        self.code.push_str(leave);
        Ok(())
    }

    fn graph_input(&self, port: usize) -> Option<N> {
        self.graph.nodes.iter().position(|node| *node == Node::Input(port))
    }

    fn inputs_of(&self, n: N) -> HashSet<N> {
        let (mut open, mut seen, mut inputs) = (vec![n], HashSet::new(), HashSet::new());
        while let Some(n) = open.pop() {
            if seen.insert(n) {
                if matches!(self.node(n), Node::Input(_)) {
                    inputs.insert(n);
                }
                open.extend(self.node(n).operands());
            }
        }
        inputs
    }

    fn store(&mut self, port: &Port, n: N, held: Option<usize>) -> Result<(), String> {
        if port.kind == tick_record::Kind::Truth {
            let at = (self.places.word)(port) - self.places.state_at;
            let truth = self.truth(n)?;
            line!(self, "strb.w {truth}, [r0, #{at}]");
            self.used(n);
            return Ok(());
        }
        let (register, only_here) = match held {
            Some(register) => (register, false),
            None => self.number(n)?,
        };
        match (port.role, self.places.output) {
            (Role::State, _) => {
                line!(self, "vstr s{register}, [r0, #{}]", (self.places.word)(port) - self.places.state_at);
            }
            (Role::Output, Some(output)) => {
                let at = ["u", "sigma", "sigma_star"].iter().position(|name| *name == port.name).ok_or("an output")?;
                line!(self, "vstr s{register}, [{output}, #{}]", 4 * at);
            }
            (Role::Output, None) => {
                line!(self, "vmov.f32 s0, s{register}");
            }
            (Role::Estimate(i, m), _) => {
                line!(self, "vstr s{register}, [{}, #{}]", self.places.other, 4 * (i * self.places.columns + m));
            }
            (role, _) => return Err(format!("{role:?} has no place")),
        }
        if only_here {
            self.numbers[register] = None;
        }
        self.used(n);
        Ok(())
    }
}

/// Without an output only u is.
fn is_told(port: &Port) -> bool {
    match port.role {
        Role::Output => port.name == "u",
        Role::Flag(_) => false,
        _ => true,
    }
}

/// The conditions after a comparison of floats under which a test holds, and does not, NaN included.
fn condition(test: Test) -> (&'static str, &'static str) {
    match test {
        Test::Less => ("mi", "pl"),
        Test::LessOrEqual => ("ls", "hi"),
        Test::Greater => ("gt", "le"),
        Test::GreaterOrEqual => ("ge", "lt"),
        Test::Equal => ("eq", "ne"),
        Test::NotEqual => ("ne", "eq"),
    }
}
