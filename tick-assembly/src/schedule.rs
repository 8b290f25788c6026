//! Order and registers of a straight line of float operations, by seeded search.
//!
//! A [`Line`] is a list of items: operations, loads of several words, tests. An order of the items, with the sizes of
//! the groups in which constants are loaded, is simulated on the FPU registers. Its cost follows DDI 0439D:
//!
//! * an operation 1, a division 14, a load or store of N words 1 + N,
//! * 1 more if an instruction reads the result of the arithmetic instruction just before it,
//! * 2 for each register that the caller keeps, and 2 for the first.
//!
//! Constants lie in a table in the order of their use. They are loaded when needed, several at a time, into consecutive
//! registers. Each result that the state keeps has the register of its word in memory, so that one instruction stores
//! all. An order without enough registers, or with a missing operand, is infeasible. Simulated annealing moves items by
//! up to eight positions, with seeded random numbers.
//!
//! State words are loaded in one of two ways. The creator of the line selects the sizes of the loads; or, like
//! constants, the words are loaded when the first is needed, in groups of the best size found ([`Line::state`]).

use crate::Effort;

/// A value that a register can hold.
pub(crate) type V = usize;

/// Operation of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operation {
    Add,
    Sub,
    Mul,
    Div,
    Abs,
    Neg,
    /// Copies to another register.
    Copy,
    /// Operands: source, upper limit, lower limit.
    Clamp,
    /// The second operand if it is greater, otherwise the first.
    Max,
    /// Converts the bits of a count to a number.
    Number,
    /// Operands: an angle, its magnitude, a limit, and a constant. Beyond the limit the angle is mirrored and the
    /// constant changes its sign, out of line.
    Mirror,
    /// Loads words of the sample or of the state, consecutive in memory and in registers.
    LoadSample,
    LoadState,
    /// Stores to this position of the output.
    Store(usize),
    /// Joins the path after a lost sample, which has other innovations.
    Resume,
    /// Tests this number of pairs of a magnitude and its limit; further operands are needed by the exit.
    Guard(usize),
    /// Leaves if the first operand is greater than the second, or NaN; further operands are needed by the exit. The
    /// number identifies the exit.
    Leave(usize),
    /// Stores consecutive words, before the words stored earlier.
    Save,
    /// Sets this status bit if the sources differ (`false`), or if the first is greater (`true`).
    Flag(u8, bool),
}

#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) kind: Operation,
    pub(crate) sources: Vec<V>,
    pub(crate) results: Vec<V>,
}

/// A set of items to schedule.
#[derive(Clone, Debug, Default)]
pub(crate) struct Line {
    pub(crate) items: Vec<Item>,
    /// Constant of each value, if it is one.
    pub(crate) constants: Vec<Option<u32>>,
    /// Required register of each value.
    pub(crate) home: Vec<Option<u8>>,
    /// Register of each value that saves a copy.
    pub(crate) better: Vec<Option<u8>>,
    /// Values that stay to the end, from register 0 on.
    pub(crate) finals: Vec<V>,
    /// Values in registers at the beginning.
    pub(crate) given: Vec<(V, u8)>,
    /// Order constraints: `before[i]` lists the items before i.
    pub(crate) before: Vec<Vec<usize>>,
    /// Number of registers.
    pub(crate) registers: usize,
    /// State words in memory order that no item loads: they are loaded when needed.
    pub(crate) state: Vec<V>,
}

/// Number of FPU registers that a function need not save for its caller: the maximum size of a group without saved
/// registers.
const FREE: usize = 16;

impl Line {
    /// Returns a lower bound of the cycles of every order, without saved registers. It counts each operation once, each
    /// word once in groups as long as there are registers, and an equal constant once. It counts no waits and no
    /// copies.
    ///
    /// The bound also holds with saved registers: one costs two cycles, and makes groups longer by one word.
    pub(crate) fn floor(&self) -> u32 {
        let moved = |words: usize| (words + words.div_ceil(FREE)) as u32;
        let (mut state, mut sample, mut stored) = (self.state.len(), 0, self.finals.len());
        let mut used = vec![false; self.constants.len()];
        let mut cycles = 0;
        for item in &self.items {
            item.sources.iter().for_each(|v| used[*v] = true);
            match item.kind {
                Operation::LoadSample => sample += item.results.len(),
                Operation::LoadState => state += item.results.len(),
                Operation::Save => stored += item.sources.len(),
                Operation::Copy => {}
                // CBZ compares and branches.
                Operation::Resume => cycles += 1,
                kind => cycles += kind.cycles(item),
            }
        }
        let constants = (0..self.constants.len()).filter_map(|v| self.constants[v].filter(|_| used[v]));
        let (immediate, loaded): (Vec<u32>, Vec<u32>) = constants.partition(|bits| is_immediate(*bits));
        let loads: u32 = [state, sample, loaded.len(), stored].map(moved).iter().sum();
        cycles + immediate.len() as u32 + loads
    }
}

impl Operation {
    /// Returns the cycles of an item whose operands are in registers: DDI 0439D.
    fn cycles(self, item: &Item) -> u32 {
        match self {
            Self::Add | Self::Sub | Self::Mul | Self::Abs | Self::Neg | Self::Copy | Self::Number => 1,
            Self::Div => 14,
            Self::Clamp => 8,
            Self::LoadSample | Self::LoadState => 1 + item.results.len() as u32,
            Self::Store(_) | Self::Resume => 2,
            Self::Guard(tests) => 3 * tests as u32,
            Self::Flag(..) | Self::Max => 4,
            Self::Mirror | Self::Leave(_) => 3,
            Self::Save => 1 + item.sources.len() as u32,
        }
    }
}

/// An emitted instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// A constant in the instruction, into this register.
    Immediate { value: V, register: u8 },
    /// Constants, from this register on.
    Constants { first: u8, count: u8 },
    /// State words, from this register on.
    Words { first: u8, count: u8 },
    /// An item, with the registers of its sources and results.
    Item { item: usize, sources: Vec<u8>, results: Vec<u8> },
}

/// An execution plan of a [`Line`].
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    order: Vec<u16>,
    /// Maximum number of words of each group of constants.
    groups: Vec<u8>,
    /// Maximum number of words of each group of state words.
    words: Vec<u8>,
    /// Preferred register of the result of each item, if it is free to choose.
    choice: Vec<u8>,
    /// Whether each constant is loaded again for each use.
    again: Vec<bool>,
    /// Whether each constant is part of an instruction.
    immediate: Vec<bool>,
}

/// Cost of an infeasible order, per missing item: the sooner it fails, the higher the cost. The cost is low enough for
/// the search to go back sometimes.
const NEVER: u32 = 1_000_000;
const SOONER: u32 = 5;
const NONE: u16 = u16::MAX;

/// Random numbers by SplitMix64.
struct Luck(u64);

impl Luck {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }
}

/// Data of the simulation, created once.
struct Simulation<'a> {
    line: &'a Line,
    uses: Vec<u16>,
    is_final: Vec<bool>,
    is_home: [bool; 32],
    /// `ahead[i * items + j]`: i must come before j.
    ahead: Vec<bool>,
    register: [u16; 32],
    place: Vec<u8>,
    left: Vec<u16>,
    stream: Vec<u16>,
    loaded: Vec<bool>,
    /// Whether each constant may be loaded again for each use.
    may_repeat: Vec<bool>,
    /// Highest used register plus one.
    above: usize,
    now: Progress,
    /// The emitted instructions, if requested.
    events: Option<Vec<Event>>,
}

/// Progress of a plan.
#[derive(Default)]
struct Progress {
    cycles: u32,
    /// Number of loaded constants and of their groups.
    constants: usize,
    constant_groups: usize,
    /// Number of state words loaded on demand and of their groups.
    words: usize,
    word_groups: usize,
    /// Register written by the previous arithmetic instruction.
    fresh: Option<usize>,
}

impl<'a> Simulation<'a> {
    fn new(line: &'a Line) -> Self {
        let (values, items) = (line.constants.len(), line.items.len());
        let mut uses = vec![0; values];
        line.items.iter().flat_map(|item| &item.sources).for_each(|v| uses[*v] += 1);
        let mut is_final = vec![false; values];
        line.finals.iter().for_each(|v| is_final[*v] = true);
        let mut is_home = [false; 32];
        line.home.iter().flatten().for_each(|home| is_home[usize::from(*home)] = true);
        let mut ahead = vec![false; items * items];
        for (j, before) in line.before.iter().enumerate() {
            for i in before {
                ahead[i * items + j] = true;
            }
        }
        let mut may_repeat: Vec<bool> = (0..values).map(|v| line.constants[v].is_some() && uses[v] > 1).collect();
        for item in line.items.iter().filter(|item| item.kind == Operation::Mirror) {
            // It changes in place.
            may_repeat[item.sources[3]] = false;
        }
        Self {
            line,
            may_repeat,
            above: 0,
            uses,
            is_final,
            is_home,
            ahead,
            register: [NONE; 32],
            place: vec![0; values],
            left: vec![0; values],
            stream: Vec::new(),
            loaded: vec![false; values],
            now: Progress::default(),
            events: None,
        }
    }

    fn put(&mut self, v: V, register: usize) {
        self.register[register] = v as u16;
        self.place[v] = register as u8;
        self.above = self.above.max(register + 1);
    }

    fn holds(&self, v: V) -> bool {
        self.register[usize::from(self.place[v])] == v as u16
    }

    fn release(&mut self, v: V) {
        self.register[usize::from(self.place[v])] = NONE;
    }

    /// Loads a value from memory. Its register is free at once if the value is unused.
    fn bring(&mut self, v: V, register: usize) {
        self.put(v, register);
        if self.uses[v] == 0 && !self.is_final[v] {
            self.release(v);
        }
    }

    fn is_free(&self, register: usize) -> bool {
        self.register[register] == NONE
    }

    fn register_of(&self, v: V) -> usize {
        usize::from(self.place[v])
    }

    /// Reads the sources of an item, and frees values without further uses.
    fn read(&mut self, item: &Item, again: &[bool]) {
        for &v in &item.sources {
            self.left[v] -= 1;
            let done = self.left[v] == 0 || (again[v] && self.line.constants[v].is_some());
            if done && !self.is_final[v] && self.holds(v) {
                self.release(v);
            }
        }
    }

    /// Returns the upper end of the shortest sufficient row of free registers.
    fn row(&self, count: usize) -> Option<usize> {
        let (mut best, mut run): (Option<(usize, usize)>, usize) = (None, 0);
        for register in 0..=self.line.registers {
            if register < self.line.registers && self.is_free(register) {
                run += 1;
                continue;
            }
            if run >= count && best.is_none_or(|(length, _)| run <= length) {
                best = Some((run, register - count));
            }
            run = 0;
        }
        best.map(|(_, first)| first)
    }

    /// Returns the longest row of at most this number of free registers, with its length.
    fn longest_row(&self, most: usize) -> Option<(usize, usize)> {
        (1..=most).rev().find_map(|count| self.row(count).map(|first| (first, count)))
    }

    /// Returns the registers for state words from this one on, and their number: at most `most`, and as many as there
    /// is room for.
    fn word_row(&self, from: usize, most: usize) -> Option<(usize, usize)> {
        let words = &self.line.state[from..];
        let home = |word: &V| self.line.home[*word].map(usize::from);
        if let Some(first) = home(&words[0]) {
            let fits = |k: &usize| home(&words[*k]) == Some(first + k) && self.is_free(first + k);
            let count = (0..most.min(words.len())).take_while(fits).count();
            return (count > 0).then_some((first, count));
        }
        let free = words.iter().take(most).take_while(|word| home(word).is_none()).count();
        self.longest_row(free)
    }

    /// Returns the cycles of a plan, and computes the table that it reads.
    fn run(&mut self, plan: &Plan) -> u32 {
        self.begin(plan);
        for (at, &i) in plan.order.iter().enumerate() {
            if self.execute(usize::from(i), plan).is_none() {
                return NEVER - SOONER * at as u32;
            }
        }
        let Progress { cycles, constants, words, fresh, .. } = self.now;
        let finals = &self.line.finals;
        let stored = finals.iter().enumerate().all(|(at, v)| self.register[at] == *v as u16);
        if !stored || constants != self.stream.len() || words < self.line.state.len() {
            return NEVER;
        }
        let waits = u32::from(fresh.is_some_and(|fresh| fresh < finals.len()));
        cycles + 1 + finals.len() as u32 + waits + kept(self.above)
    }

    /// Sets the initial registers, and the constants in the order of their use.
    fn begin(&mut self, plan: &Plan) {
        let line = self.line;
        self.now = Progress::default();
        self.register = [NONE; 32];
        self.above = 0;
        self.left.copy_from_slice(&self.uses);
        for &(v, register) in &line.given {
            self.put(v, usize::from(register));
        }
        self.stream.clear();
        self.loaded.fill(false);
        for &v in plan.order.iter().flat_map(|i| &line.items[usize::from(*i)].sources) {
            if line.constants[v].is_some() && !self.loaded[v] && !plan.immediate[v] {
                self.stream.push(v as u16);
                self.loaded[v] = !plan.again[v];
            }
        }
    }

    /// Executes an item with its loads; `None` if this is not possible.
    fn execute(&mut self, i: usize, plan: &Plan) -> Option<()> {
        let item = &self.line.items[i];
        for &v in &item.sources {
            if !self.holds(v) {
                self.fetch(v, plan)?;
            }
        }
        if item.kind == Operation::Save {
            // It stores the words after the last word read.
            let row = self.register_of(item.sources[0])..;
            let apart = item.sources.iter().zip(row).any(|(v, at)| self.register_of(*v) != at);
            if apart || self.now.words < self.line.state.len() {
                return None;
            }
        }
        self.now.cycles += item.kind.cycles(item) + self.waits(item);
        self.now.fresh = None;
        self.read(item, &plan.again);
        match item.results.as_slice() {
            [] => {}
            [one] if !matches!(item.kind, Operation::LoadSample | Operation::LoadState) => {
                self.give(item, *one, plan.choice[i])?;
            }
            row => {
                let first = match self.line.home[row[0]].map(usize::from) {
                    Some(home) => (home..home + row.len()).all(|at| self.is_free(at)).then_some(home),
                    None => self.row(row.len()),
                }?;
                row.iter().zip(first..).for_each(|(v, register)| self.bring(*v, register));
            }
        }
        if let Some(events) = &mut self.events {
            let [sources, results] =
                [&item.sources, &item.results].map(|all| all.iter().map(|v| self.place[*v]).collect());
            events.push(Event::Item { item: i, sources, results });
        }
        Some(())
    }

    /// Loads a constant or a state word into a register.
    fn fetch(&mut self, v: V, plan: &Plan) -> Option<()> {
        if self.line.constants[v].is_none() {
            self.load_words(v, plan)
        } else if plan.immediate[v] {
            let register = self.row(1)?;
            self.put(v, register);
            self.fetched(1, Event::Immediate { value: v, register: register as u8 });
            Some(())
        } else {
            self.load_constants(plan)?;
            self.holds(v).then_some(())
        }
    }

    /// Loads the state words up to this one, in groups of the plan's sizes.
    fn load_words(&mut self, v: V, plan: &Plan) -> Option<()> {
        let state = &self.line.state;
        let to = self.now.words + state[self.now.words..].iter().position(|word| *word == v)?;
        while self.now.words <= to {
            let most = usize::from(plan.words[self.now.word_groups % plan.words.len()]);
            let (first, count) = self.word_row(self.now.words, most)?;
            let group = &state[self.now.words..self.now.words + count];
            group.iter().zip(first..).for_each(|(word, register)| self.bring(*word, register));
            self.now.words += count;
            self.now.word_groups += 1;
            self.fetched(1 + count, Event::Words { first: first as u8, count: count as u8 });
        }
        Some(())
    }

    /// Loads the next group of constants.
    fn load_constants(&mut self, plan: &Plan) -> Option<()> {
        let ahead = &self.stream[self.now.constants..];
        let most = usize::from(plan.groups[self.now.constant_groups % plan.groups.len()]).min(ahead.len());
        // A constant is in one register only.
        let twice = |k: &usize| self.holds(usize::from(ahead[*k])) || ahead[..*k].contains(&ahead[*k]);
        let most = (0..most).find(twice).unwrap_or(most);
        let (first, count) = self.longest_row(most)?;
        for k in 0..count {
            self.put(usize::from(self.stream[self.now.constants + k]), first + k);
        }
        self.now.constants += count;
        self.now.constant_groups += 1;
        self.fetched(1 + count, Event::Constants { first: first as u8, count: count as u8 });
        Some(())
    }

    fn fetched(&mut self, cycles: usize, event: Event) {
        self.now.cycles += cycles as u32;
        self.now.fresh = None;
        if let Some(events) = &mut self.events {
            events.push(event);
        }
    }

    /// Returns the cycles that an item waits for the previous arithmetic instruction.
    fn waits(&self, item: &Item) -> u32 {
        let read_at_once = match item.kind {
            Operation::LoadSample | Operation::LoadState | Operation::Resume => 0,
            Operation::Clamp => 1,
            Operation::Guard(_) | Operation::Leave(_) => 2,
            Operation::Mirror => 3,
            _ => item.sources.len(),
        };
        let mut read = item.sources.iter().take(read_at_once);
        u32::from(read.any(|v| Some(self.register_of(*v)) == self.now.fresh))
    }

    /// Puts the result of an operation into a register.
    fn give(&mut self, item: &Item, result: V, choice: u8) -> Option<()> {
        let chosen = self.destination(item, result, choice)?;
        let in_place = matches!(item.kind, Operation::Clamp | Operation::Max | Operation::Mirror);
        if in_place && self.register_of(item.sources[0]) != chosen {
            // It is copied first, and must not overwrite a limit.
            if item.sources[1..].iter().any(|v| self.register_of(*v) == chosen) {
                return None;
            }
            self.now.cycles += 1;
        }
        self.put(result, chosen);
        let arithmetic =
            matches!(item.kind, Operation::Add | Operation::Sub | Operation::Mul | Operation::Div | Operation::Number);
        self.now.fresh = arithmetic.then_some(chosen);
        Some(())
    }

    /// Returns the register of a result: its home, the one that saves a copy, the one of an operand, or any free one.
    fn destination(&self, item: &Item, result: V, choice: u8) -> Option<usize> {
        let line = self.line;
        let fits = |at: &usize| self.is_free(*at);
        let operand = |k: usize| item.sources.get(k).map(|v| self.register_of(*v)).filter(fits);
        if let Some(home) = line.home[result] {
            return Some(usize::from(home)).filter(fits);
        }
        match item.kind {
            // Compared and replaced in place.
            Operation::Clamp => return operand(0),
            Operation::Max | Operation::Mirror => return operand(0).or_else(|| self.row(1)),
            _ => {}
        }
        let better = line.better[result].map(usize::from).filter(fits);
        let good = better.or_else(|| match choice {
            0 => operand(0).or_else(|| operand(1)),
            1 => operand(1).or_else(|| operand(0)),
            _ => None,
        });
        let quiet = |at: &usize| self.is_free(*at) && !self.is_home[*at];
        let all = || 0..line.registers;
        good.or_else(|| match choice {
            2 => all().rfind(quiet).or_else(|| all().rfind(fits)),
            _ => all().find(quiet).or_else(|| all().find(fits)),
        })
    }

    /// Moves an item to another position, if the order allows it.
    fn moved(&self, order: &mut [u16], from: usize, to: usize) -> bool {
        let items = self.line.items.len();
        let i = usize::from(order[from]);
        let is_ahead = |a: usize, b: usize| self.ahead[a * items + b];
        if from < to {
            if order[from + 1..=to].iter().any(|j| is_ahead(i, usize::from(*j))) {
                return false;
            }
            order[from..=to].rotate_left(1);
        } else {
            if order[to..from].iter().any(|j| is_ahead(usize::from(*j), i)) {
                return false;
            }
            order[to..=from].rotate_right(1);
        }
        true
    }
}

/// Returns the first order: the items as listed, each after its operands, and loads where the first item needs them.
/// `None` for circular dependencies.
fn natural(line: &Line) -> Option<Vec<u16>> {
    fn put(line: &Line, i: usize, done: &mut [bool], order: &mut Vec<u16>) {
        if !std::mem::replace(&mut done[i], true) {
            let mut before = line.before[i].clone();
            before.sort_unstable();
            for j in before {
                put(line, j, done, order);
            }
            order.push(i as u16);
        }
    }
    let mut order = Vec::with_capacity(line.items.len());
    let mut done = vec![false; line.items.len()];
    let is_load = |i: &usize| matches!(line.items[*i].kind, Operation::LoadSample | Operation::LoadState);
    let (loads, others): (Vec<usize>, Vec<usize>) = (0..line.items.len()).partition(is_load);
    others.into_iter().chain(loads).for_each(|i| put(line, i, &mut done, &mut order));
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(at, i)| place[usize::from(*i)] = at);
    let kept = line.before.iter().enumerate().all(|(i, before)| before.iter().all(|j| place[*j] < place[i]));
    kept.then_some(order)
}

/// Returns whether VMOV has a form for this number: ±n/16 2^k with n = 16..=31, k = -3..=4.
fn is_immediate(bits: u32) -> bool {
    let exponent = bits >> 23 & 0xff;
    bits.trailing_zeros() >= 19 && (124..=131).contains(&exponent)
}

/// Returns the cycles to save and restore the caller's registers from 16 up to here.
fn kept(above: usize) -> u32 {
    if above > FREE { 2 * (1 + (above - FREE)) as u32 } else { 0 }
}

/// Returns e^x for x <= 0 within a few percent, with identical bits on every machine, unlike a platform's exponential.
fn exp(x: f64) -> f64 {
    let mut power = (1.0 + x / 64.0).max(0.0);
    for _ in 0..6 {
        power *= power;
    }
    power
}

/// Result of a search.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) cycles: u32,
    pub(crate) events: Vec<Event>,
    /// The constants in the order of their loads.
    pub(crate) table: Vec<u32>,
    /// Highest used register plus one.
    pub(crate) above: usize,
}

impl Plan {
    /// Returns the start of a round.
    fn first(line: &Line, order: &[u16], luck: &mut Luck) -> Self {
        // One size per two constants: sizes shared by several groups cannot change freely.
        let sizes = (line.constants.iter().flatten().count() / 2).clamp(16, 32);
        Self {
            order: order.to_vec(),
            groups: (0..sizes).map(|_| [1, 1, 2, 2, 3][luck.below(5)]).collect(),
            choice: line.items.iter().map(|_| [0, 0, 1, 2, 3][luck.below(5)]).collect(),
            again: vec![false; line.constants.len()],
            immediate: line.constants.iter().map(|bits| bits.is_some_and(is_immediate)).collect(),
            words: if line.state.is_empty() { vec![0] } else { (0..16).map(|_| 1 + luck.below(8) as u8).collect() },
        }
    }

    /// Changes the plan in one place; `false` if the order does not allow it.
    fn change(&mut self, simulation: &Simulation<'_>, luck: &mut Luck) -> bool {
        let line = simulation.line;
        let (items, values) = (line.items.len(), line.constants.len());
        match luck.below(32) {
            0..24 => {
                let mut legal = true;
                for _ in 0..=usize::from(luck.below(10) > 6) {
                    let (from, by) = (luck.below(items), 1 + luck.below(8));
                    let to = if luck.below(2) == 0 { from.saturating_sub(by) } else { (from + by).min(items - 1) };
                    legal &= simulation.moved(&mut self.order, from, to);
                }
                return legal;
            }
            24..28 if !line.state.is_empty() && luck.below(2) == 0 => {
                let at = luck.below(self.words.len());
                self.words[at] = 1 + luck.below(16) as u8;
            }
            24..28 => {
                let at = luck.below(self.groups.len());
                self.groups[at] = 1 + luck.below(8) as u8;
            }
            28..31 => {
                let at = luck.below(items);
                self.choice[at] = luck.below(4) as u8;
            }
            31 if luck.below(2) == 0 => {
                let at = luck.below(values);
                self.immediate[at] = !self.immediate[at] && line.constants[at].is_some_and(is_immediate);
            }
            _ => {
                let at = luck.below(values);
                self.again[at] = !self.again[at] && simulation.may_repeat[at];
            }
        }
        true
    }
}

/// Returns the cheapest plan of several rounds of annealing; `None` if no plan is feasible.
pub(crate) fn search(line: &Line, effort: &Effort) -> Option<Found> {
    let Effort { rounds, steps, seed } = *effort;
    let mut simulation = Simulation::new(line);
    let natural = natural(line)?;
    let mut best: Option<(u32, Plan)> = None;
    for round in 0..rounds {
        let mut luck = Luck(seed.wrapping_mul(1000).wrapping_add(round as u64));
        let mut now = Plan::first(line, &natural, &mut luck);
        let mut cost = simulation.run(&now);
        let mut trial = now.clone();
        for step in 0..steps {
            let heat = (3.0 * (1.0 - step as f64 / (0.9 * steps as f64))).max(0.15);
            trial.clone_from(&now);
            if !trial.change(&simulation, &mut luck) {
                continue;
            }
            let costs = simulation.run(&trial);
            let likely = (f64::from(cost) - f64::from(costs)) / heat;
            if costs <= cost || (luck.next() >> 11) as f64 / (1_u64 << 53) as f64 <= exp(likely) {
                std::mem::swap(&mut now, &mut trial);
                cost = costs;
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, now.clone()));
                }
            }
        }
    }
    let (cycles, plan) = best.filter(|(cycles, _)| *cycles < NEVER / 2)?;
    simulation.events = Some(Vec::new());
    simulation.run(&plan);
    let table = simulation.stream.iter().filter_map(|v| line.constants[usize::from(*v)]).collect();
    Some(Found { cycles, events: simulation.events.take()?, table, above: simulation.above })
}
