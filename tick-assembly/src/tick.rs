//! The ordinary path of a tick as a straight line, its search, and its text with the three exits.
//!
//! After a lost sample the observers predict. This equals the ordinary path with innovations of -0, since adding -0
//! changes no bit. So this path consists of two loads and joins the ordinary one. An implausible demand is checked
//! again out of line. A rejected sample restarts from memory, since nothing of the state has been stored.

use std::collections::HashMap;
use std::fmt::Write as _;

use tick_record::{Block, End, Id, Op, Port, Record, Role, Test};

use crate::build::{Build, clamped};
use crate::cold::{Cold, Places};
use crate::graph::{Graph, N, Node};
use crate::schedule::{Found, Line, Operation, V, search};
use crate::text::{Exit, Flow, compare, kept, label, put, row, words};
use crate::{Effort, Emitted, Layout};

/// Cycles of `adr`: a caller could pass the table instead.
pub(crate) const TABLE: u32 = 1;
/// Core register that points to the table.
const TABLE_AT: &str = "r3";
/// Cycles of the return: DDI 0439D, a pipeline refill of 2.
pub(crate) const RETURN: u32 = 3;
/// Cycles to load the flag; without an observer, to load a zero and store it.
const FLAG: u32 = 2;
/// Innovation that changes no estimate: -0.
const NOTHING: u32 = 0x8000_0000;

/// Writes a tick that returns u, or one that fills the output and returns the status.
pub(crate) fn tick(
    record: &Record,
    layout: &Layout,
    name: &str,
    whole: bool,
    effort: &Effort,
) -> Result<Emitted, String> {
    let straight = Straight::of(record, whole)?;
    // A short search for every grouping of the loads, and a long one for the best. Registers that the caller keeps cost
    // two cycles each, and are only used if the others do not suffice.
    let short = Effort { rounds: 1, steps: effort.steps.div_ceil(4), ..*effort };
    let attempt = |moved, streamed| {
        let cuts = || Cut::all(layout).filter(move |cut| cut.streamed == streamed);
        let mut best: Option<(Line, Found)> = None;
        for registers in [16, 18, 20, 24, 28, 32].into_iter().filter(|registers| layout.words.len() + 3 < *registers) {
            for cut in cuts() {
                let line = straight.line(layout, registers, Cut { moved, ..cut });
                let Some(found) = search(&line, &short) else { continue };
                if best.as_ref().is_none_or(|(_, best)| found.cycles < best.cycles) {
                    best = Some((line, found));
                }
            }
            if best.is_some() {
                break;
            }
        }
        // A long search may succeed where a short one fails.
        let long = |cut| {
            let line = straight.line(layout, 32, Cut { moved, ..cut });
            search(&line, effort).map(|found| (line, found))
        };
        let (line, found) = best.or_else(|| if streamed { None } else { cuts().find_map(long) })?;
        let better = search(&line, effort).filter(|better| better.cycles < found.cycles);
        Some((line, better.unwrap_or(found)))
    };
    let of = |streamed| attempt(false, streamed).or_else(|| attempt(true, streamed));
    let found = [of(false), of(true)].into_iter().flatten().min_by_key(|(_, found)| found.cycles);
    let Some((line, found)) = found else {
        return Err(format!("{name}: no order was found in which its numbers fit into the registers"));
    };
    straight.emit(layout, name, &line, &found)
}

/// Variants that cost a cycle or an operation and free registers for a time.
#[derive(Clone, Copy)]
#[allow(clippy::struct_excessive_bools, reason = "each is a choice of its own")]
struct Cut {
    /// The last state word is loaded when it is needed.
    late: bool,
    /// The prediction is computed separately for the innovation and for the memory.
    twice: bool,
    /// Words of the last tick that are not adjacent to the sample are loaded without the estimates.
    apart: bool,
    /// A word in the location of a sample is computed elsewhere and moved there, because other values of this sample
    /// may need the word first.
    moved: bool,
    /// The search selects the number of state words per load.
    streamed: bool,
}

impl Cut {
    const NONE: Self = Self { late: false, twice: false, apart: false, moved: false, streamed: false };

    fn all(layout: &Layout) -> impl Iterator<Item = Self> {
        let both = [false, true];
        let with = move |apart| {
            let twice = both.into_iter();
            twice.flat_map(move |twice| both.map(|late| Self { late, twice, apart, ..Self::NONE }))
        };
        let beside = layout.words.iter().rposition(|word| word.starts_with('x')).map_or(0, |at| at + 1);
        let any = layout.estimates_from(beside) > beside;
        let streamed = both.map(|twice| Self { twice, streamed: true, ..Self::NONE });
        with(false).chain(with(true).filter(move |_| any)).chain(streamed)
    }
}

struct Straight<'a> {
    record: &'a Record,
    graph: Graph,
    whole: bool,
    /// Innovations without a previous lost sample.
    ordinary: Vec<N>,
    innovations: Vec<N>,
    good: Vec<N>,
    bad: Vec<N>,
    condition: N,
    ordinary_tests: Vec<(N, N)>,
    /// Predicted parts of the innovations, which are cheap to compute twice.
    foreseen: Vec<N>,
}

fn input_rejected(port: &Port) -> bool {
    matches!(port.role, Role::Flag(0))
}

impl<'a> Straight<'a> {
    fn of(record: &'a Record, whole: bool) -> Result<Self, String> {
        let flag = record.results.iter().position(input_rejected).ok_or("a tick says whether it rejects")?;
        let is_taken = |results: &[Id]| record.value(results[flag]).op == Op::Truth(false);
        let (mut taken, mut rejected) = (Vec::new(), Vec::new());
        ends(&record.body, &mut |results| if is_taken(results) { taken.push(results) } else { rejected.push(results) });
        let (Some(yes), Some(no)) = (taken.first(), rejected.first()) else {
            return Err("a tick that takes or rejects a sample is scheduled; this one does not decide".into());
        };
        if taken.iter().any(|other| other != yes) || rejected.iter().any(|other| other != no) {
            return Err("a tick that takes a sample in one way and rejects it in one is scheduled; this one has more \
                        ways, as with a gate"
                .into());
        }
        let mut graph = Graph::default();
        let values = graph.values(record, &HashMap::new());
        // An assumption about a value replaces the value everywhere.
        let with = |graph: &mut Graph, op: &dyn Fn(&Op) -> bool, node: Node| {
            let node = graph.add(node);
            let ids = (0..record.values.len()).filter(|at| op(&record.values[*at].op));
            ids.map(|at| (at, node)).collect::<HashMap<usize, N>>()
        };
        let resuming = record.inputs.iter().position(|port| port.name == "resuming").ok_or("a flag `resuming`")?;
        let is_flag = |op: &Op| *op == Op::Input(resuming);
        let (good_sample, lost) =
            (with(&mut graph, &is_flag, Node::Truth(false)), with(&mut graph, &is_flag, Node::Truth(true)));
        let ordinary = graph.values(record, &good_sample);
        let resumed = graph.values(record, &lost);
        let named = |letter: char| {
            let is = move |name: &String| {
                name.strip_prefix(letter)
                    .is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|c| c.is_ascii_digit()))
            };
            (0..record.values.len()).filter(move |at| record.values[*at].name.as_ref().is_some_and(is))
        };
        let good: Vec<N> = yes.iter().map(|id| ordinary[id.index()]).collect();
        // After a lost sample: bit-identical except for the innovations, otherwise rejected.
        let mut innovations = Vec::new();
        let mut nothing = good_sample;
        for at in named('e') {
            let zero = graph.add(Node::Number(NOTHING));
            innovations.push(ordinary[at]);
            nothing.insert(at, zero);
        }
        let coasting = graph.values(record, &nothing);
        if yes.iter().any(|id| coasting[id.index()] != resumed[id.index()]) {
            return Err("after a lost sample this tick is not the ordinary one with innovations of -0".into());
        }
        let condition = decision(&mut graph, &record.body, &ordinary, &is_taken);
        if decision(&mut graph, &record.body, &coasting, &is_taken)
            != decision(&mut graph, &record.body, &resumed, &is_taken)
        {
            return Err("after a lost sample this tick decides otherwise".into());
        }
        let mut ordinary_tests = Vec::new();
        sufficient(&graph, condition, &mut ordinary_tests)?;
        let foreseen = named('h').map(|at| ordinary[at]).collect();
        let bad = no.iter().map(|id| values[id.index()]).collect();
        Ok(Self { record, graph, whole, ordinary, innovations, good, bad, condition, ordinary_tests, foreseen })
    }

    fn result(&self, name: &str) -> Option<N> {
        self.record.results.iter().position(|port| port.name == name).map(|at| self.good[at])
    }
}

/// Visits every return.
fn ends<'a>(block: &'a Block, visit: &mut dyn FnMut(&'a [Id])) {
    match &block.end {
        End::Return(results) => visit(results),
        End::Branch { yes, no, .. } => {
            ends(yes, visit);
            ends(no, visit);
        }
    }
}

/// Returns the condition for an accepted sample: all decisions on the path as one.
fn decision(graph: &mut Graph, block: &Block, values: &[N], is_taken: &dyn Fn(&[Id]) -> bool) -> N {
    match &block.end {
        End::Return(results) => graph.add(Node::Truth(is_taken(results))),
        End::Branch { condition, yes, no } => {
            let condition = values[condition.index()];
            let [yes, no] = [yes, no].map(|block| decision(graph, block, values, is_taken));
            let yes = graph.add(Node::And(condition, yes));
            let not = graph.add(Node::Not(condition));
            let no = graph.add(Node::And(not, no));
            graph.add(Node::Or(yes, no))
        }
    }
}

/// Collects tests |value| <= limit that together are sufficient for a condition.
fn sufficient(graph: &Graph, condition: N, tests: &mut Vec<(N, N)>) -> Result<(), String> {
    match graph.nodes[condition] {
        Node::And(a, b) => {
            sufficient(graph, a, tests)?;
            sufficient(graph, b, tests)
        }
        Node::Or(a, _) => sufficient(graph, a, tests),
        Node::Compare(Test::LessOrEqual, size, limit) => {
            tests.push((size, limit));
            Ok(())
        }
        other => Err(format!("{other:?} is no test of a size")),
    }
}

/// The inputs: the sample, and the state words in memory order.
struct Given {
    sample: Vec<V>,
    words: Vec<V>,
}

impl Straight<'_> {
    fn line(&self, layout: &Layout, registers: usize, cut: Cut) -> Line {
        let mut build = Build::new(&self.graph, registers);
        let given = self.given(&mut build, layout);
        let loads = given.load(&mut build, layout, cut);
        // The outputs, in the order of the trace.
        if cut.twice {
            // Each use of the prediction gets its own value; innovations first.
            for n in &self.innovations {
                build.need(*n);
            }
            for n in &self.foreseen {
                build.known.remove(n);
            }
        }
        let innovations: Vec<V> = self.innovations.iter().map(|n| build.need(*n)).collect();
        let resume = (!innovations.is_empty()).then(|| build.item(Operation::Resume, innovations.clone(), vec![]));
        let mut order = self.values_in_order();
        order.retain(|n| build.is_number(*n));
        for n in order {
            build.need(n);
        }
        self.keep(&mut build, layout, cut, &given);
        let guard = self.guard(&mut build);
        if self.whole {
            build.store_output(|name| self.result(name).expect("a result of the tick"));
            for (port, n) in self.record.results.iter().zip(&self.good) {
                let Role::Flag(bit) = port.role else { continue };
                if let Some(flag) = build.flag(bit, *n) {
                    build.line.before[flag].push(guard);
                }
            }
        }
        build.line.before[guard].extend(loads);
        build.orders(resume, &innovations);
        build.line
    }

    fn given(&self, build: &mut Build<'_>, layout: &Layout) -> Given {
        let mut sample = Vec::new();
        let mut words = vec![None; layout.words.len()];
        for (at, port) in self.record.inputs.iter().enumerate() {
            let Some(n) = self.graph.nodes.iter().position(|node| *node == Node::Input(at)) else { continue };
            let word = layout.word(&port.name);
            if port.role == Role::State && word.is_none() {
                continue;
            }
            let mut v = build.value(None);
            match (port.role, word) {
                (Role::Sample(j), _) => sample.push((j, v)),
                (Role::State, Some(word)) => words[word] = Some(v),
                _ => {
                    let register = build.line.given.len() as u8;
                    build.line.given.push((v, register));
                    // The first stays in the register of u; another makes room for the sample.
                    if register > 0 {
                        v = build.computed(Operation::Copy, vec![v]);
                    }
                }
            }
            build.known.insert(n, v);
        }
        sample.sort_by_key(|(j, _)| *j);
        for (j, v) in &sample {
            build.line.home[*v] = Some(1 + *j as u8);
        }
        let sample = sample.into_iter().map(|(_, v)| v).collect();
        Given { sample, words: words.into_iter().map(|word| word.unwrap_or_else(|| build.value(None))).collect() }
    }

    /// Keeps the new state words in consecutive registers.
    fn keep(&self, build: &mut Build<'_>, layout: &Layout, cut: Cut, given: &Given) {
        for (at, word) in layout.words.iter().enumerate() {
            let n = self.result(word).expect("a result of the tick");
            let mut v = build.need(n);
            let elsewhere = build.line.home[v].is_some_and(|home| usize::from(home) != at);
            let came =
                matches!(self.graph.nodes[n], Node::Input(port) if self.record.inputs[port].role == Role::Argument);
            let in_the_way = cut.moved && (1..=given.sample.len()).contains(&at) && build.line.home[v].is_none();
            let taken = build.line.constants[v].is_some() || build.line.finals.contains(&v) || given.words[at] == v;
            if elsewhere || came || in_the_way || taken {
                v = build.computed(Operation::Copy, vec![v]);
            }
            build.line.home[v] = Some(at as u8);
            build.line.finals.push(v);
        }
    }

    /// Adds the tests of an ordinary tick, before u is limited.
    fn guard(&self, build: &mut Build<'_>) -> usize {
        let tests = self.ordinary_tests.iter().flat_map(|(size, limit)| [*size, *limit]);
        let sources = tests.chain(self.demands()).map(|n| build.need(n)).collect();
        let guard = build.item(Operation::Guard(self.ordinary_tests.len()), sources, vec![]);
        let held = build.producer[build.line.finals[0]].expect("u is computed");
        build.line.before[held].push(guard);
        guard
    }
}

impl Given {
    /// Adds the loads of the state, then of the sample.
    fn load(&self, build: &mut Build<'_>, layout: &Layout, cut: Cut) -> Vec<usize> {
        let words = self.words.len();
        // The first words use the registers of the sample and pass through others.
        let beside = (1 + self.sample.len()).min(words);
        for at in beside..words {
            build.line.home[self.words[at]] = Some(at as u8);
        }
        let mut ends = vec![beside];
        ends.extend(cut.apart.then(|| layout.estimates_from(beside)).filter(|at| *at < words));
        ends.extend(cut.late.then_some((words - 1).max(beside)));
        ends.push(words);
        let loads = build.load_state(&self.words, &ends, cut.streamed);
        build.item(Operation::LoadSample, vec![], self.sample.clone());
        loads
    }
}

impl Straight<'_> {
    /// Returns the tested values without their magnitudes.
    fn demands(&self) -> impl Iterator<Item = N> {
        self.ordinary_tests.iter().filter_map(|(size, _)| match self.graph.nodes[*size] {
            Node::Abs(n) => Some(n),
            _ => None,
        })
    }

    /// Returns the values that results and tests of an ordinary tick need, in the order of the trace.
    fn values_in_order(&self) -> Vec<N> {
        let told = |port: &Port| match port.role {
            Role::Output => self.whole || port.name == "u",
            Role::Flag(_) => self.whole,
            _ => true,
        };
        let mut open: Vec<N> =
            self.record.results.iter().zip(&self.good).filter(|(port, _)| told(port)).map(|(_, n)| *n).collect();
        open.extend(self.ordinary_tests.iter().flat_map(|(size, limit)| [*size, *limit]));
        let mut seen = vec![false; self.graph.nodes.len()];
        while let Some(n) = open.pop() {
            if !std::mem::replace(&mut seen[n], true) {
                match clamped(&self.graph, n) {
                    Some((x, high, low)) => open.extend([x, high, low]),
                    None => open.extend(self.graph.nodes[n].operands()),
                }
            }
        }
        let mut order = Vec::new();
        for n in &self.ordinary {
            if std::mem::replace(&mut seen[*n], false) {
                order.push(*n);
            }
        }
        order
    }
}

impl Straight<'_> {
    fn emit(&self, layout: &Layout, name: &str, line: &Line, found: &Found) -> Result<Emitted, String> {
        let mut flow = Flow::new(line, TABLE_AT);
        let mut table = found.table.clone();
        let (push, leave) = kept(found.above);
        flow.text += &push;
        put!(flow.text, "adr.w {TABLE_AT}, .L{name}_table");
        if !self.innovations.is_empty() {
            put!(flow.text, "ldrb.w ip, [r0, #{}]", layout.resuming());
        }
        let (mut at_guard, mut at_resume) = (None, None);
        for event in &found.events {
            let Some((kind, sources, results)) = flow.load(event) else { continue };
            match kind {
                Operation::LoadSample => put!(flow.text, "vldmia r1, {}", row(results[0], results.len())),
                Operation::Resume => {
                    put!(flow.text, "cmp.w ip, #0\n\tbne.w .L{name}_resume");
                    label!(flow.text, ".L{name}_observed");
                    at_resume = Some(flow.exit(sources));
                }
                Operation::Guard(tests) => {
                    let (tests, demands) = sources.split_at(2 * tests);
                    self.test(&mut flow, layout, name, tests);
                    at_guard = Some(flow.exit(demands));
                }
                kind => flow.operation(kind, sources, results, "r1"),
            }
        }
        let mut text = flow.text;
        put!(text, "vstmdb r0!, {}", row(0, layout.words.len()));
        text += &leave;
        if self.whole {
            put!(text, "mov.w r0, r1");
        }
        put!(text, "bx lr");
        if let Some(exit) = at_resume {
            text += &resume(layout, name, exit, &mut table);
        }
        text += &self.beyond(layout, name, &leave, at_guard.ok_or("a guard")?, &mut table)?;
        text += &words(name, &table);
        let around = RETURN + FLAG + if self.whole { 2 } else { 0 };
        let cycles = found.cycles + TABLE + around;
        let floor = self.line(layout, 32, Cut::NONE).floor() + around;
        Ok(Emitted { text, cycles, floor })
    }

    /// Writes the tests of magnitudes, each followed by its limit.
    fn test(&self, flow: &mut Flow<'_>, layout: &Layout, name: &str, tests: &[u8]) {
        let text = &mut flow.text;
        for test in tests.chunks_exact(2) {
            compare(text, test[0], test[1]);
            put!(text, "bhi.w .L{name}_beyond");
        }
        label!(text, ".L{name}_plausible");
        if self.whole {
            put!(text, "mov.w r1, #0");
        }
        if self.innovations.is_empty() {
            put!(text, "mov.w ip, #0\n\tstrb.w ip, [r0, #{}]", layout.resuming() - flow.at.state);
        }
    }

    /// Writes the exit for an implausible demand: the whole condition; a rejected sample restarts the tick.
    fn beyond(
        &self,
        layout: &Layout,
        name: &str,
        leave: &str,
        exit: Exit<'_>,
        table: &mut Vec<u32>,
    ) -> Result<String, String> {
        let (inputs, mut text) = (&self.record.inputs, format!(".L{name}_beyond:\n"));
        let place = layout.places(exit.at.state, "r2", 0);
        let mut places = Places {
            place: &place,
            u_alone: !self.whole,
            table: TABLE_AT,
            table_at: exit.at.constants,
            arguments: self.demands().zip(exit.registers.iter().copied()).collect(),
            flag: None,
        };
        let label = format!("{name}_again");
        let mut again = Cold::new(&self.graph, inputs, &places, table, &label, 16);
        again.decide(self.condition, &[])?;
        text += &again.whole();
        put!(text, "bne.w .L{name}_plausible");
        text += leave;
        places.arguments = HashMap::new();
        let flag = inputs.iter().position(|port| port.name == "resuming");
        let flag = flag.and_then(|at| self.graph.nodes.iter().position(|node| *node == Node::Input(at)));
        places.flag = flag.filter(|_| !self.innovations.is_empty());
        let label = format!("{name}_rejected");
        let mut rejected = Cold::new(&self.graph, inputs, &places, table, &label, usize::from(!self.whole));
        rejected.give(self.record, &self.bad, "")?;
        text += &rejected.whole();
        put!(text, "bx lr");
        Ok(text)
    }
}

/// Writes the exit after a lost sample: the ordinary path continues with innovations without effect.
fn resume(layout: &Layout, name: &str, exit: Exit<'_>, table: &mut Vec<u32>) -> String {
    let mut text = format!(".L{name}_resume:\n");
    let nothing = exit.at.to_word(table.len());
    table.push(NOTHING);
    for register in exit.registers {
        put!(text, "vldr s{register}, [{TABLE_AT}, #{nothing}]");
    }
    // The flag itself is still read if this sample is rejected too.
    put!(text, "mov.w ip, #0\n\tstrb.w ip, [r0, #{}]\n\tmov.w ip, #1", layout.resuming() - exit.at.state);
    put!(text, "b.w .L{name}_observed");
    text
}
