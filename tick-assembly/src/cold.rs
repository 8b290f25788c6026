//! Code for rare paths: in the order of the requested results, with numbers loaded where they are used.
//!
//! Numbers use FPU registers from the first free one on. Counts and truths (0 or 1) use r4 to r11. If no register is
//! free, the least recently used value moves to the stack. A state word is stored as soon as no later result reads its
//! old value.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use tick_record::{Block, End, Port, Record, Role, Test};

use crate::graph::{Graph, N, Node};
use crate::text::{compare, label, put, saved, words};

/// Locations of the data of a function.
pub(crate) struct Places<'a> {
    /// Returns the core register and the offset of a port in memory.
    pub(crate) place: &'a dyn Fn(&Port) -> Option<(&'static str, i32)>,
    /// Whether u in s0 is the only output.
    pub(crate) u_alone: bool,
    /// Core register that points to the table, and its position.
    pub(crate) table: &'static str,
    pub(crate) table_at: usize,
    /// Inputs in FPU registers.
    pub(crate) arguments: HashMap<N, u8>,
    /// A truth in `ip`.
    pub(crate) flag: Option<N>,
}

/// Registers of one kind, and the value in each.
#[derive(Clone)]
struct Registers {
    held: Vec<Option<N>>,
    /// Time of the last use of each register.
    asked: Vec<usize>,
    /// Registers below belong to another path.
    first: usize,
    /// Highest written register plus one.
    used: usize,
}

/// Reserved for another path.
const OTHERS: N = N::MAX;
/// Holder of a register for one instruction.
const PASSING: N = N::MAX - 1;

impl Registers {
    fn new(count: usize, first: usize) -> Self {
        let held = (0..count).map(|at| (at < first).then_some(OTHERS)).collect();
        Self { held, asked: vec![0; count], first, used: 0 }
    }

    fn of(&self, holder: N) -> Option<usize> {
        self.held.iter().position(|held| *held == Some(holder))
    }
}

/// Kinds of registers.
const FLOATS: usize = 0;
const CORES: usize = 1;

/// Code, and the registers that it uses.
pub(crate) struct Cold<'a> {
    graph: &'a Graph,
    inputs: &'a [Port],
    places: &'a Places<'a>,
    /// Constants of the whole function.
    table: &'a mut Vec<u32>,
    label: &'a str,
    labels: usize,
    pub(crate) code: String,
    files: [Registers; 2],
    /// Values on the stack, one per word.
    slots: Vec<Option<N>>,
    left: HashMap<N, usize>,
    /// Registers that the next instruction reads.
    pinned: Vec<(usize, usize)>,
    clock: usize,
}

/// Error message if there are not enough registers.
const CROWDED: &str = "one instruction needs more values than there are registers";

/// Returns the name of a core register.
fn core(at: usize) -> String {
    if at == FLAG { "ip".into() } else { format!("r{}", 4 + at) }
}

/// Index of `ip`.
const FLAG: usize = usize::MAX;

impl<'a> Cold<'a> {
    pub(crate) fn new(
        graph: &'a Graph,
        inputs: &'a [Port],
        places: &'a Places<'a>,
        table: &'a mut Vec<u32>,
        label: &'a str,
        first_number: usize,
    ) -> Self {
        let mut numbers = Registers::new(32, first_number);
        for (n, register) in &places.arguments {
            numbers.held[usize::from(*register)] = Some(*n);
        }
        Self {
            graph,
            inputs,
            places,
            table,
            label,
            labels: 0,
            code: String::new(),
            files: [numbers, Registers::new(8, 0)],
            slots: Vec::new(),
            left: HashMap::new(),
            pinned: Vec::new(),
            clock: 0,
        }
    }

    /// Returns the instructions that save and restore the caller's registers.
    fn saved(&self) -> (String, String) {
        saved(self.files[FLOATS].used, self.files[CORES].used, self.slots.len())
    }

    /// Returns the code between these instructions.
    pub(crate) fn whole(&self) -> String {
        let (push, pop) = self.saved();
        push + &self.code + &pop
    }

    fn node(&self, n: N) -> Node {
        self.graph.nodes[n]
    }

    /// Returns the offset of a constant from the register of the table.
    fn constant(&mut self, bits: u32) -> i32 {
        let at = self.table.iter().position(|entry| *entry == bits).unwrap_or_else(|| {
            self.table.push(bits);
            self.table.len() - 1
        });
        4 * (at as i32 - self.places.table_at as i32)
    }

    /// Counts the remaining uses of each value for these results.
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
        for file in &mut self.files {
            for held in &mut file.held {
                *held = held.filter(|n| *n == OTHERS || self.left.contains_key(n));
            }
        }
        for slot in &mut self.slots {
            *slot = slot.filter(|n| self.left.contains_key(n));
        }
    }

    fn is_held(&self, n: N) -> bool {
        self.files.iter().any(|file| file.of(n).is_some())
            || self.slots.contains(&Some(n))
            || self.places.flag == Some(n)
    }

    fn used(&mut self, n: N) {
        let left = self.left.entry(n).or_default();
        *left = left.saturating_sub(1);
        if *left == 0 {
            self.gone(n);
        }
    }

    fn gone(&mut self, holder: N) {
        let gone = |held: &mut Option<N>| *held = held.filter(|held| *held != holder);
        self.files.iter_mut().flat_map(|file| &mut file.held).for_each(gone);
        self.slots.iter_mut().for_each(gone);
    }

    /// Returns a register for a value: a free one, or the least recently used one, whose value moves to the stack.
    fn free(&mut self, kind: usize, holder: N) -> Result<usize, String> {
        self.clock += 1;
        let file = &self.files[kind];
        let at = if let Some(at) = (file.first..file.held.len()).find(|at| file.held[*at].is_none()) {
            at
        } else {
            let may_go = |at: &usize| {
                file.held[*at].is_some_and(|holder| holder < PASSING) && !self.pinned.contains(&(kind, *at))
            };
            let at = (file.first..file.held.len()).filter(may_go).min_by_key(|at| file.asked[*at]).ok_or(CROWDED)?;
            let holder = file.held[at].ok_or(CROWDED)?;
            if !self.slots.contains(&Some(holder)) {
                let slot = self.slots.iter().position(Option::is_none).unwrap_or_else(|| {
                    self.slots.push(None);
                    self.slots.len() - 1
                });
                self.slots[slot] = Some(holder);
                match kind {
                    FLOATS => put!(self.code, "vstr s{at}, [sp, #{}]", 4 * slot),
                    _ => put!(self.code, "str.w {}, [sp, #{}]", core(at), 4 * slot),
                }
            }
            at
        };
        let file = &mut self.files[kind];
        file.held[at] = Some(holder);
        file.asked[at] = self.clock;
        file.used = file.used.max(at + 1);
        Ok(at)
    }

    /// Returns the register of a computed value, and reloads the value from the stack if necessary.
    fn found(&mut self, kind: usize, holder: N) -> Result<Option<usize>, String> {
        self.clock += 1;
        if let Some(at) = self.files[kind].of(holder) {
            self.files[kind].asked[at] = self.clock;
            return Ok(Some(at));
        }
        let Some(slot) = self.slots.iter().position(|slot| *slot == Some(holder)) else { return Ok(None) };
        let at = self.free(kind, holder)?;
        match kind {
            FLOATS => put!(self.code, "vldr s{at}, [sp, #{}]", 4 * slot),
            _ => put!(self.code, "ldr.w {}, [sp, #{}]", core(at), 4 * slot),
        }
        Ok(Some(at))
    }

    fn place(&self, port: &Port) -> Result<(&'static str, i32), String> {
        (self.places.place)(port).ok_or_else(|| format!("`{}` is in no register and has no place", port.name))
    }

    /// Returns a number in a register. The caller releases a number that is loaded for this use only.
    fn number(&mut self, n: N) -> Result<(usize, bool), String> {
        if let Some(at) = self.found(FLOATS, n)? {
            return Ok((at, false));
        }
        match self.node(n) {
            Node::Input(port) => {
                let (base, at) = self.place(&self.inputs[port])?;
                let register = self.free(FLOATS, PASSING)?;
                put!(self.code, "vldr s{register}, [{base}, #{at}]");
                Ok((register, true))
            }
            Node::Number(bits) => {
                let at = self.constant(bits);
                let register = self.free(FLOATS, PASSING)?;
                put!(self.code, "vldr s{register}, [{}, #{at}]", self.places.table);
                Ok((register, true))
            }
            _ => self.computed(n).map(|register| (register, false)),
        }
    }

    /// Returns the operands in registers for the next operation, and releases unused values.
    fn operands(&mut self, all: &[N]) -> Result<Vec<usize>, String> {
        let (pinned, mut loaded) = (self.pinned.len(), Vec::new());
        for n in all {
            let (register, only_here) = self.number(*n)?;
            self.pinned.push((FLOATS, register));
            loaded.push((register, only_here));
        }
        self.pinned.truncate(pinned);
        for (n, (register, only_here)) in all.iter().zip(&loaded) {
            if *only_here {
                self.files[FLOATS].held[*register] = None;
            }
            self.used(*n);
        }
        Ok(loaded.into_iter().map(|(register, _)| register).collect())
    }

    /// Returns counts and truths as operands in core registers.
    fn core_operands(&mut self, all: &[N]) -> Result<Vec<String>, String> {
        let (pinned, mut registers) = (self.pinned.len(), Vec::new());
        for n in all {
            let register = self.core_value(*n)?;
            self.pinned.push((CORES, register));
            registers.push(core(register));
        }
        self.pinned.truncate(pinned);
        for n in all {
            self.used(*n);
        }
        Ok(registers)
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
            Node::NumberOf(a) => {
                let source = self.core_operands(&[a])?;
                let register = self.free(FLOATS, n)?;
                put!(self.code, "vmov s{register}, {}\n\tvcvt.f32.s32 s{register}, s{register}", source[0]);
                return Ok(register);
            }
            other => return Err(format!("{other:?} is no number to compute")),
        };
        let sources = self.operands(&operands)?;
        let register = self.free(FLOATS, n)?;
        let sources: Vec<String> = sources.iter().map(|at| format!("s{at}")).collect();
        put!(self.code, "{name}.f32 s{register}, {}", sources.join(", "));
        Ok(register)
    }

    /// Sets the flags and returns the condition under which a truth holds.
    fn flags(&mut self, c: N) -> Result<&'static str, String> {
        // A comparison with this single use stays in the flags.
        match self.node(c) {
            Node::Compare(test, x, limit) if self.left.get(&c) == Some(&1) && !self.is_held(c) => {
                let sources = self.operands(&[x, limit])?;
                compare(&mut self.code, sources[0], sources[1]);
                Ok(condition(test).0)
            }
            _ => {
                let truth = self.core_value(c)?;
                put!(self.code, "cmp.w {}, #0", core(truth));
                Ok("ne")
            }
        }
    }

    fn selected(&mut self, n: N, c: N, a: N, b: N) -> Result<usize, String> {
        // All operands come before the flags are set.
        let pinned = self.pinned.len();
        let (yes, yes_only) = self.number(a)?;
        self.pinned.push((FLOATS, yes));
        let (no, no_only) = self.number(b)?;
        self.pinned.push((FLOATS, no));
        let holds = self.flags(c)?;
        let register = if no_only {
            self.files[FLOATS].held[no] = Some(n);
            no
        } else {
            let register = self.free(FLOATS, n)?;
            put!(self.code, "vmov.f32 s{register}, s{no}");
            register
        };
        self.pinned.truncate(pinned);
        put!(self.code, "it {holds}\n\tvmov{holds}.f32 s{register}, s{yes}");
        if yes_only {
            self.files[FLOATS].held[yes] = None;
        }
        for n in [a, b, c] {
            self.used(n);
        }
        Ok(register)
    }

    /// Returns a count, or a truth as 0 or 1, in a core register.
    fn core_value(&mut self, n: N) -> Result<usize, String> {
        if self.places.flag == Some(n) {
            return Ok(FLAG);
        }
        if let Some(at) = self.found(CORES, n)? {
            return Ok(at);
        }
        let table = self.places.table;
        match self.node(n) {
            Node::Truth(truth) => self.core_computed(n, &[], |at, _| format!("mov.w {at}, #{}", u8::from(truth))),
            Node::Count(bits) => {
                let from = self.constant(bits);
                self.core_computed(n, &[], |at, _| format!("ldr.w {at}, [{table}, #{from}]"))
            }
            Node::Input(port) => {
                let port = &self.inputs[port];
                let (base, from) = self.place(port)?;
                let load = if port.kind == tick_record::ValueKind::Truth { "ldrb.w" } else { "ldr.w" };
                self.core_computed(n, &[], |at, _| format!("{load} {at}, [{base}, #{from}]"))
            }
            Node::Compare(test, a, b) => {
                let sources = self.operands(&[a, b])?;
                let at = self.free(CORES, n)?;
                let (yes, no) = condition(test);
                compare(&mut self.code, sources[0], sources[1]);
                put!(self.code, "ite {yes}\n\tmov{yes}.w {r}, #1\n\tmov{no}.w {r}, #0", r = core(at));
                Ok(at)
            }
            Node::And(a, b) | Node::Or(a, b) => {
                // A chain starts from its end, so that it holds two values at a time.
                let (a, b) = if matches!(self.node(b), Node::And(..) | Node::Or(..)) { (b, a) } else { (a, b) };
                let name = if matches!(self.node(n), Node::And(..)) { "and.w" } else { "orr.w" };
                self.of_two(n, name, a, b)
            }
            Node::Not(a) => self.core_computed(n, &[a], |at, of| format!("eor.w {at}, {}, #1", of[0])),
            Node::CountSince(a, b) => self.of_two(n, "sub.w", a, b),
            Node::CountPlus(a, b) => self.of_two(n, "add.w", a, b),
            Node::CountSigned(a, bits) => {
                self.core_computed(n, &[a], |at, of| format!("sbfx {at}, {}, #0, #{bits}", of[0]))
            }
            Node::CountWhole(a, of, each) => self.whole_ones(n, a, of, each),
            Node::Select(c, a, b) => self.core_selected(n, c, a, b),
            other => Err(format!("{other:?} is no count and no truth to compute")),
        }
    }

    /// Writes an instruction on core registers: `text` contains the registers of its result and operands.
    fn core_computed(
        &mut self,
        n: N,
        operands: &[N],
        text: impl FnOnce(String, &[String]) -> String,
    ) -> Result<usize, String> {
        let of = self.core_operands(operands)?;
        let at = self.free(CORES, n)?;
        put!(self.code, "{}", text(core(at), &of));
        Ok(at)
    }

    fn of_two(&mut self, n: N, name: &str, a: N, b: N) -> Result<usize, String> {
        self.core_computed(n, &[a, b], |at, of| format!("{name} {at}, {}, {}", of[0], of[1]))
    }

    fn whole_ones(&mut self, n: N, a: N, of: u32, each: u32) -> Result<usize, String> {
        let one = self.core_operands(&[a])?;
        let at = self.free(CORES, n)?;
        let whole = self.passing(of)?;
        put!(self.code, "sdiv {}, {}, {}", core(at), one[0], core(whole));
        if each != 1 {
            let each = self.passing(each)?;
            put!(self.code, "mul {}, {}, {}", core(at), core(at), core(each));
        }
        Ok(at)
    }

    fn core_selected(&mut self, n: N, c: N, a: N, b: N) -> Result<usize, String> {
        let pinned = self.pinned.len();
        let yes = self.core_value(a)?;
        self.pinned.push((CORES, yes));
        let no = self.core_value(b)?;
        self.pinned.push((CORES, no));
        let at = self.free(CORES, n)?;
        self.pinned.push((CORES, at));
        let holds = self.flags(c)?;
        self.pinned.truncate(pinned);
        let (at_, yes, no) = (core(at), core(yes), core(no));
        put!(self.code, "mov.w {at_}, {no}\n\tit {holds}\n\tmov{holds}.w {at_}, {yes}");
        for n in [a, b, c] {
            self.used(n);
        }
        Ok(at)
    }

    /// Returns a number in a core register for the next instruction only.
    fn passing(&mut self, bits: u32) -> Result<usize, String> {
        let from = self.constant(bits);
        let at = self.free(CORES, PASSING)?;
        self.files[CORES].held[at] = None;
        put!(self.code, "ldr.w {}, [{}, #{from}]", core(at), self.places.table);
        Ok(at)
    }

    /// Writes the truth of a value into the flags: `ne` if it holds. Values that `later` needs are kept.
    pub(crate) fn decide(&mut self, n: N, later: &[N]) -> Result<(), String> {
        self.expect(&[&[n], later].concat());
        let truth = self.core_value(n)?;
        put!(self.code, "cmp.w {}, #0", core(truth));
        Ok(())
    }

    /// Writes a block with all following blocks; `leave` is written at its end.
    pub(crate) fn block(&mut self, record: &Record, block: &Block, values: &[N], leave: &str) -> Result<(), String> {
        match &block.end {
            End::Return(results) => {
                let results: Vec<N> = results.iter().map(|id| values[id.index()]).collect();
                self.give(record, &results, leave)
            }
            End::Branch { condition, yes, no } => {
                let condition = values[condition.index()];
                if let Node::Truth(truth) = self.node(condition) {
                    return self.block(record, if truth { yes } else { no }, values, leave);
                }
                let mut later = Vec::new();
                wanted(yes, values, &mut later);
                wanted(no, values, &mut later);
                self.decide(condition, &later)?;
                self.labels += 1;
                let label = format!(".L{}_{}", self.label, self.labels);
                put!(self.code, "beq.w {label}");
                let before = (self.files.clone(), self.slots.clone());
                self.block(record, yes, values, leave)?;
                let [numbers, cores] = [FLOATS, CORES].map(|kind| self.files[kind].used);
                let slots = self.slots.len();
                (self.files, self.slots) = before;
                (self.files[FLOATS].used, self.files[CORES].used) = (numbers, cores);
                self.slots.resize(slots, None);
                label!(self.code, "{label}");
                self.block(record, no, values, leave)
            }
        }
    }

    /// Writes all results to their locations, and the answer or the status to r0.
    pub(crate) fn give(&mut self, record: &Record, results: &[N], leave: &str) -> Result<(), String> {
        let mut open = self.open(record, results);
        self.expect(&open.iter().map(|result| result.n).collect::<Vec<_>>());
        let (told, mut order): (Vec<usize>, Vec<usize>) = (0..open.len()).partition(|k| open[*k].is_told());
        // Results that block many others come first.
        order.sort_by_key(|k| (open[*k].own.is_none(), open[*k].reads.len()));
        order.reverse();
        // Truths for r0 stay in their registers; they are few.
        for k in &told {
            if !matches!(self.node(open[*k].n), Node::Truth(_)) {
                self.core_value(open[*k].n)?;
            }
            open[*k].computed = true;
        }
        for k in order {
            if waits(&open, k) {
                open[k].holder = self.hold(k, &open[k])?;
            } else {
                self.store(&open[k])?;
                open[k].stored = true;
            }
            open[k].computed = true;
            for j in 0..open.len() {
                if open[j].computed && !open[j].stored && !open[j].is_told() && !waits(&open, j) {
                    self.store(&open[j])?;
                    open[j].stored = true;
                }
            }
        }
        let told: Vec<&Open<'_>> = told.into_iter().map(|k| &open[k]).collect();
        self.tell(&told)?;
        self.code.push_str(leave);
        Ok(())
    }

    /// Returns the results to write.
    fn open<'r>(&self, record: &'r Record, results: &[N]) -> Vec<Open<'r>> {
        let stays = |port: &Port, n: N| {
            port.role == Role::State && matches!(self.node(n), Node::Input(at) if self.inputs[at].name == port.name)
        };
        let own = |port: &Port| self.inputs.iter().position(|input| input.name == port.name && input.role == port.role);
        let all = record.results.iter().zip(results.iter().copied());
        all.filter(|(port, n)| !stays(port, *n) && (!self.places.u_alone || is_told(port)))
            .map(|(port, n)| {
                let own = own(port).and_then(|at| self.graph_input(at));
                Open { port, n, own, reads: self.inputs_of(n), computed: false, stored: false, holder: None }
            })
            .collect()
    }

    /// Computes a result that is stored later, and returns the name under which it waits in a register or on the stack.
    fn hold(&mut self, k: usize, result: &Open<'_>) -> Result<Option<N>, String> {
        if result.port.kind != tick_record::ValueKind::Number {
            self.core_value(result.n)?;
            return Ok(None);
        }
        let (register, only_here) = self.number(result.n)?;
        let holder = if only_here { PASSING - 1 - k } else { result.n };
        self.files[FLOATS].held[register] = Some(holder);
        Ok(Some(holder))
    }

    /// Writes the answer, or the status bits, to r0.
    fn tell(&mut self, told: &[&Open<'_>]) -> Result<(), String> {
        if told.is_empty() {
            return Ok(());
        }
        let bit = |result: &Open<'_>| if let Role::Flag(bit) = result.port.role { 1_u32 << bit } else { 1 };
        let holds = |result: &&&Open<'_>| self.node(result.n) == Node::Truth(true);
        let always: u32 = told.iter().filter(holds).map(|result| bit(result)).sum();
        // Values above eight bits need the other encoding.
        let mov = if always < 256 { "mov.w" } else { "movw" };
        put!(self.code, "{mov} r0, #{always}");
        for result in told {
            if !matches!(self.node(result.n), Node::Truth(_)) {
                let truth = core(self.core_value(result.n)?);
                put!(self.code, "cmp.w {truth}, #0\n\tit ne\n\torrne.w r0, r0, #{}", bit(result));
            }
        }
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

    fn store(&mut self, result: &Open<'_>) -> Result<(), String> {
        let Open { port, n, holder: held, .. } = *result;
        if port.kind != tick_record::ValueKind::Number {
            let (base, at) = self.place(port)?;
            let value = core(self.core_value(n)?);
            let store = if port.kind == tick_record::ValueKind::Truth { "strb.w" } else { "str.w" };
            put!(self.code, "{store} {value}, [{base}, #{at}]");
            self.used(n);
            return Ok(());
        }
        let waiting = match held {
            Some(holder) => self.found(FLOATS, holder)?,
            None => None,
        };
        let (register, only_here) = match waiting {
            Some(register) => (register, held != Some(n)),
            None => self.number(n)?,
        };
        if self.places.u_alone && port.role == Role::Output {
            put!(self.code, "vmov.f32 s0, s{register}");
        } else {
            let (base, at) = self.place(port)?;
            put!(self.code, "vstr s{register}, [{base}, #{at}]");
        }
        if only_here {
            self.files[FLOATS].held[register] = None;
            if let Some(holder) = held {
                self.gone(holder);
            }
        }
        self.used(n);
        Ok(())
    }
}

/// A result before it is stored.
struct Open<'a> {
    port: &'a Port,
    n: N,
    /// The input that it overwrites.
    own: Option<N>,
    /// The inputs on which it depends.
    reads: HashSet<N>,
    computed: bool,
    stored: bool,
    /// The name under which it waits, if it does.
    holder: Option<N>,
}

impl Open<'_> {
    /// Returns whether it is returned in r0.
    fn is_told(&self) -> bool {
        matches!(self.port.role, Role::Flag(_) | Role::Answer)
    }
}

/// Returns whether other words depend on the word that this result overwrites.
fn waits(open: &[Open<'_>], k: usize) -> bool {
    let needs =
        |own: N| open.iter().enumerate().any(|(j, other)| j != k && !other.computed && other.reads.contains(&own));
    open[k].own.is_some_and(needs)
}

/// Writes a function in the order of its results, with its table after it.
pub(crate) fn function(
    record: &Record,
    graph: &Graph,
    values: &[N],
    places: &Places<'_>,
    name: &str,
) -> Result<String, String> {
    const LEAVE: &str = "\tb.w @leave\n";
    let mut table = Vec::new();
    let mut cold = Cold::new(graph, &record.inputs, places, &mut table, name, 0);
    cold.block(record, &record.body, values, LEAVE)?;
    let (push, pop) = cold.saved();
    let code = cold.code.replace(LEAVE, &format!("{pop}\tbx lr\n"));
    // ADR reaches 4 kB; rare code may be longer.
    let adr = if table.is_empty() {
        String::new()
    } else {
        let to = places.table;
        format!("\tmovw {to}, #:lower16:.L{name}_table\n\tmovt {to}, #:upper16:.L{name}_table\n")
    };
    Ok(format!("{push}{adr}{code}{}", words(name, &table)))
}

/// Collects all decisions and returns of a block and of the following blocks.
fn wanted(block: &Block, values: &[N], all: &mut Vec<N>) {
    match &block.end {
        End::Return(results) => all.extend(results.iter().map(|id| values[id.index()])),
        End::Branch { condition, yes, no } => {
            all.push(values[condition.index()]);
            wanted(yes, values, all);
            wanted(no, values, all);
        }
    }
}

/// Without an output only u is returned.
fn is_told(port: &Port) -> bool {
    match port.role {
        Role::Output => port.name == "u",
        Role::Flag(_) => false,
        _ => true,
    }
}

/// Returns the conditions after a float comparison under which a test holds, and does not hold, NaN included.
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
