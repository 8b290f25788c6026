//! Order and registers of a straight line of float operations, by seeded search.
//!
//! A [`Line`] is a list of items: operations, loads of several words, tests. An order of them, with the sizes of the
//! groups in which constants are loaded, is simulated on the registers of the FPU and costs what DDI 0439D says of it:
//!
//! * an operation 1, a division 14, a load or store of N words 1 + N,
//! * 1 more where an instruction reads what the arithmetic just before it has computed,
//! * 2 for each register that the caller keeps, and 2 for the first.
//!
//! Constants lie in a table in the order of their use and are loaded as they are needed, several at a time, into
//! registers in a row. Results that the state keeps have a register each, that of their word in memory, so that one
//! instruction stores them all. An order for which there is no register, or that reads what is not there, is worth
//! nothing. Annealing moves items by up to eight places: from there on it is luck, and luck has a seed.
//!
//! Words of the state are loaded by items of a size that whoever makes the line has chosen, or, as constants are, when
//! the first of them is needed and as many at a time as the search finds best ([`Line::state`]).

use crate::Effort;

/// A value that a register can hold.
pub(crate) type V = usize;

/// What an item does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Add,
    Sub,
    Mul,
    Div,
    Abs,
    Neg,
    /// Into another register.
    Copy,
    /// Source, upper, lower limit.
    Clamp,
    /// The second if it is greater, else the first.
    Max,
    /// A count, as it lies there, as a number.
    Number,
    /// An angle, its size, a limit, and a constant: beyond the limit the angle is mirrored and the constant changes its
    /// sign, out of line.
    Mirror,
    /// Words in a row, behind one another in memory and in registers: of the sample, or of the state.
    LoadSample,
    LoadState,
    /// To this place of the output.
    Store(usize),
    /// The estimates go on by themselves: here another way joins, with other innovations.
    Resume,
    /// So many pairs of a size and its limit; then what the way beyond needs in registers.
    Guard(usize),
    /// Away if the first is greater than the second, or no number; the rest is what is needed there. The number tells
    /// one from another.
    Leave(usize),
    /// Words in a row to memory, in front of those that were stored before.
    Save,
    /// This bit of the health, if the sources are not equal (`false`), or if the first is greater (`true`).
    Flag(u8, bool),
}

#[derive(Clone, Debug)]
pub(crate) struct Item {
    pub(crate) kind: Kind,
    pub(crate) sources: Vec<V>,
    pub(crate) results: Vec<V>,
}

/// What is to be put in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Line {
    pub(crate) items: Vec<Item>,
    /// Of each value the constant that it is, if it is one.
    pub(crate) constants: Vec<Option<u32>>,
    /// Of each value the register that it must lie in.
    pub(crate) home: Vec<Option<u8>>,
    /// Of each value a register in which it saves a copy.
    pub(crate) better: Vec<Option<u8>>,
    /// Values that stay to the end, from register 0 on.
    pub(crate) finals: Vec<V>,
    /// Values that are in registers from the beginning.
    pub(crate) given: Vec<(V, u8)>,
    /// Which items must come before which: `before[i]` lists those before i.
    pub(crate) before: Vec<Vec<usize>>,
    /// How many registers there are.
    pub(crate) registers: usize,
    /// Words of the state in the order of memory that no item loads: they come when they are needed.
    pub(crate) state: Vec<V>,
}

/// Registers of the FPU that a function need not keep for its caller: the most words of a group for which nothing is
/// saved.
const FREE: usize = 16;

impl Line {
    /// Cycles that no order of it takes less than, with nothing saved: each operation once, each word in or out in
    /// groups as long as there are registers, an equal constant once, no result waited for, no number copied.
    ///
    /// With saved registers it holds too: one costs two cycles, and makes groups longer by one word.
    pub(crate) fn floor(&self) -> u32 {
        let moved = |words: usize| (words + words.div_ceil(FREE)) as u32;
        let (mut state, mut sample, mut stored) = (self.state.len(), 0, self.finals.len());
        let mut used = vec![false; self.constants.len()];
        let mut cycles = 0;
        for item in &self.items {
            item.sources.iter().for_each(|v| used[*v] = true);
            match item.kind {
                Kind::LoadSample => sample += item.results.len(),
                Kind::LoadState => state += item.results.len(),
                Kind::Save => stored += item.sources.len(),
                Kind::Copy => {}
                // CBZ compares and branches.
                Kind::Resume => cycles += 1,
                kind => cycles += kind.cycles(item),
            }
        }
        let constants = (0..self.constants.len()).filter_map(|v| self.constants[v].filter(|_| used[v]));
        let (immediate, loaded): (Vec<u32>, Vec<u32>) = constants.partition(|bits| is_immediate(*bits));
        let loads: u32 = [state, sample, loaded.len(), stored].map(moved).iter().sum();
        cycles + immediate.len() as u32 + loads
    }
}

impl Kind {
    /// Cycles of an item whose operands are there: DDI 0439D.
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

/// What is emitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// A constant that is part of the instruction, into this register.
    Immediate { value: V, register: u8 },
    /// Constants, from this register on.
    Constants { first: u8, count: u8 },
    /// Words of the state, from this register on.
    Words { first: u8, count: u8 },
    /// An item, with the registers of its sources and results.
    Item { item: usize, sources: Vec<u8>, results: Vec<u8> },
}

/// A way to execute a [`Line`].
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    order: Vec<u16>,
    /// Of each group of constants the most words.
    groups: Vec<u8>,
    /// Of each group of words of the state.
    words: Vec<u8>,
    /// Of each item where its result goes if it is free to choose.
    choice: Vec<u8>,
    /// Of each value: is it, as a constant, loaded for each use anew?
    again: Vec<bool>,
    /// Of each value: is it, as a constant, part of an instruction?
    immediate: Vec<bool>,
}

/// Cycles of an order that cannot be executed: more, the sooner it ends, by so many for each item that it misses. Few
/// enough for the search to go back now and then.
const NEVER: u32 = 1_000_000;
const SOONER: u32 = 5;
const NONE: u16 = u16::MAX;

/// SplitMix64.
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

/// What the simulation works on, made once.
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
    /// Of each value: may it, as a constant, be loaded for each use anew?
    may_repeat: Vec<bool>,
    /// One more than the highest register that anything was put into.
    above: usize,
    now: Progress,
    /// What is emitted, where that is asked for.
    events: Option<Vec<Event>>,
}

/// How far a plan has been executed.
#[derive(Default)]
struct Progress {
    cycles: u32,
    /// Constants of the stream that have been loaded, and in how many groups.
    constants: usize,
    constant_groups: usize,
    /// Words of the state that have been loaded as they were needed, and in how many groups.
    words: usize,
    word_groups: usize,
    /// The register that the arithmetic just before has written.
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
        for item in line.items.iter().filter(|item| item.kind == Kind::Mirror) {
            // It changes where it lies.
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

    /// A value comes from memory; its register is free at once if nobody reads it.
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

    /// The sources of an item are read; what nobody else needs is free.
    fn read(&mut self, item: &Item, again: &[bool]) {
        for &v in &item.sources {
            self.left[v] -= 1;
            let done = self.left[v] == 0 || (again[v] && self.line.constants[v].is_some());
            if done && !self.is_final[v] && self.holds(v) {
                self.release(v);
            }
        }
    }

    /// Registers in a row that are free: the shortest that is long enough, its upper end.
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

    /// The longest row of at most so many free registers, and its length.
    fn longest_row(&self, most: usize) -> Option<(usize, usize)> {
        (1..=most).rev().find_map(|count| self.row(count).map(|first| (first, count)))
    }

    /// Where words of the state go from this one on, and how many at once: at most so many, and as many as there is
    /// room for.
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

    /// Cycles of a plan, and the table that it reads.
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

    /// The registers as they are given, and the constants in the order of their use.
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

    /// One item, with what it needs from memory; `None` where that cannot be.
    fn execute(&mut self, i: usize, plan: &Plan) -> Option<()> {
        let item = &self.line.items[i];
        for &v in &item.sources {
            if !self.holds(v) {
                self.fetch(v, plan)?;
            }
        }
        if item.kind == Kind::Save {
            // It stores what is behind the last word that was read.
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
            [one] if !matches!(item.kind, Kind::LoadSample | Kind::LoadState) => {
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

    /// Brings a constant or a word of the state into a register.
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

    /// The words of the state up to this one, in groups of the plan's sizes.
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

    /// The next group of constants.
    fn load_constants(&mut self, plan: &Plan) -> Option<()> {
        let ahead = &self.stream[self.now.constants..];
        let most = usize::from(plan.groups[self.now.constant_groups % plan.groups.len()]).min(ahead.len());
        // One constant is in one register only.
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

    /// Cycles that an item waits for the arithmetic just before.
    fn waits(&self, item: &Item) -> u32 {
        let read_at_once = match item.kind {
            Kind::LoadSample | Kind::LoadState | Kind::Resume => 0,
            Kind::Clamp => 1,
            Kind::Guard(_) | Kind::Leave(_) => 2,
            Kind::Mirror => 3,
            _ => item.sources.len(),
        };
        let mut read = item.sources.iter().take(read_at_once);
        u32::from(read.any(|v| Some(self.register_of(*v)) == self.now.fresh))
    }

    /// The result of an operation goes into a register.
    fn give(&mut self, item: &Item, result: V, choice: u8) -> Option<()> {
        let chosen = self.destination(item, result, choice)?;
        let in_place = matches!(item.kind, Kind::Clamp | Kind::Max | Kind::Mirror);
        if in_place && self.register_of(item.sources[0]) != chosen {
            // It is copied first, and must not go where a limit is.
            if item.sources[1..].iter().any(|v| self.register_of(*v) == chosen) {
                return None;
            }
            self.now.cycles += 1;
        }
        self.put(result, chosen);
        let arithmetic = matches!(item.kind, Kind::Add | Kind::Sub | Kind::Mul | Kind::Div | Kind::Number);
        self.now.fresh = arithmetic.then_some(chosen);
        Some(())
    }

    /// Which register: its home, where it saves a copy, that of an operand, or any that is free.
    fn destination(&self, item: &Item, result: V, choice: u8) -> Option<usize> {
        let line = self.line;
        let fits = |at: &usize| self.is_free(*at);
        let operand = |k: usize| item.sources.get(k).map(|v| self.register_of(*v)).filter(fits);
        if let Some(home) = line.home[result] {
            return Some(usize::from(home)).filter(fits);
        }
        match item.kind {
            // Compared and then replaced, where it stands.
            Kind::Clamp => return operand(0),
            Kind::Max | Kind::Mirror => return operand(0).or_else(|| self.row(1)),
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

    /// Moves what stands at one place to another, if the order allows that.
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

/// The first order: as the items stand, each behind what it needs, and loads where the first item needs them. `None` if
/// items wait for each other.
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
    let is_load = |i: &usize| matches!(line.items[*i].kind, Kind::LoadSample | Kind::LoadState);
    let (loads, others): (Vec<usize>, Vec<usize>) = (0..line.items.len()).partition(is_load);
    others.into_iter().chain(loads).for_each(|i| put(line, i, &mut done, &mut order));
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(at, i)| place[usize::from(*i)] = at);
    let kept = line.before.iter().enumerate().all(|(i, before)| before.iter().all(|j| place[*j] < place[i]));
    kept.then_some(order)
}

/// Has VMOV a form for this number? ±n/16 2^k with n = 16..=31, k = -3..=4.
fn is_immediate(bits: u32) -> bool {
    let exponent = bits >> 23 & 0xff;
    bits.trailing_zeros() >= 19 && (124..=131).contains(&exponent)
}

/// Cycles to keep what the caller has in registers from 16 up to here, and bring it back.
fn kept(above: usize) -> u32 {
    if above > FREE { 2 * (1 + (above - FREE)) as u32 } else { 0 }
}

/// e^x for x <= 0, to a few percent: the same bits on every machine, which those of a platform are not.
fn exp(x: f64) -> f64 {
    let mut power = (1.0 + x / 64.0).max(0.0);
    for _ in 0..6 {
        power *= power;
    }
    power
}

/// What a search came to.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) cycles: u32,
    pub(crate) events: Vec<Event>,
    /// The constants in the order in which they are loaded.
    pub(crate) table: Vec<u32>,
    /// One more than the highest register that anything is put into.
    pub(crate) above: usize,
}

impl Plan {
    /// Where a round begins.
    fn first(line: &Line, order: &[u16], luck: &mut Luck) -> Self {
        // A size for each group of two constants: where sizes are shared by several groups they are not free to change.
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

    /// Changes it in one thing; `false` where its order may not be changed so.
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

/// The cheapest way that some rounds of annealing find; `None` if none can be executed.
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
