//! The ordinary way of a tick as a straight line, its search, and its text with the three ways that leave it.
//!
//! After a lost sample the estimates go on by themselves, which is the ordinary way with innovations of -0: adding -0
//! changes no bit. So that way is two loads long and joins again. A demand beyond what is plausible is looked at again
//! out of line, and a sample that is rejected begins anew from memory, since nothing of the state has been stored.

use std::collections::HashMap;
use std::fmt::Write as _;

use tick_record::{Block, End, Id, Op, Port, Record, Role, Test};

use crate::build::{Build, clamped, operation};
use crate::cold::{Cold, Places, row, words};
use crate::graph::{Graph, N, Node};
use crate::schedule::{Event, Found, Kind, Line, V, search};
use crate::{Effort, Emitted, Layout};

/// Cycles of `adr`: a caller could hand the table over.
pub(crate) const TABLE: u32 = 1;
/// Of the return: DDI 0439D, a pipeline refill of 2.
pub(crate) const RETURN: u32 = 3;
/// Of the load of the flag; without an observer of a zero and its store.
const FLAG: u32 = 2;
/// An innovation that changes no estimate: -0.
const NOTHING: u32 = 0x8000_0000;

/// A tick that returns u, or one that fills the output and returns the health.
pub(crate) fn tick(
    record: &Record,
    layout: &Layout,
    name: &str,
    whole: bool,
    effort: &Effort,
) -> Result<Emitted, String> {
    let straight = Straight::of(record, whole)?;
    // A short look at every way to cut the loads, and a long one at the best. Registers that the caller keeps cost two
    // cycles each: they are taken where the others do not suffice.
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
        // What a short look has not found a long one may.
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

/// What costs a cycle or an operation more and frees registers for a while.
#[derive(Clone, Copy)]
#[allow(clippy::struct_excessive_bools, reason = "each is a choice of its own")]
struct Cut {
    /// The last word of the state is loaded when it is needed.
    late: bool,
    /// What is foreseen is computed for the innovation and for the memory each.
    twice: bool,
    /// Words of the last tick that do not lie beside the sample are loaded without the estimates.
    apart: bool,
    /// A word that lies where a sample is loaded is computed elsewhere and moved there: what is still to be made of
    /// that sample may need the word first.
    moved: bool,
    /// The search says how many words of the state are loaded at once.
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
    /// Without a lost sample before.
    ordinary: Vec<N>,
    innovations: Vec<N>,
    good: Vec<N>,
    bad: Vec<N>,
    condition: N,
    ordinary_tests: Vec<(N, N)>,
    /// Foreseen parts of the innovations, which are cheap to compute twice.
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
        // What is assumed of a value stands for it everywhere.
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
        // After a lost sample: the same with other innovations, to the last bit, or not at all.
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

    fn line(&self, layout: &Layout, registers: usize, cut: Cut) -> Line {
        let mut build = Build::new(&self.graph, registers);
        self.all(&mut build, layout, cut);
        build.line
    }
}

/// Every return.
fn ends<'a>(block: &'a Block, visit: &mut dyn FnMut(&'a [Id])) {
    match &block.end {
        End::Return(results) => visit(results),
        End::Branch { yes, no, .. } => {
            ends(yes, visit);
            ends(no, visit);
        }
    }
}

/// When a sample is taken: all decisions on the way as one.
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

/// Tests |value| <= limit that are together enough for a condition.
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

impl Straight<'_> {
    #[allow(clippy::too_many_lines, reason = "what comes in, what goes out, and what is between")]
    fn all(&self, build: &mut Build<'_>, layout: &Layout, cut: Cut) {
        let straight = self;
        let record = straight.record;
        // What comes in.
        let mut samples = Vec::new();
        let mut words = vec![None; layout.words.len()];
        for (at, port) in record.inputs.iter().enumerate() {
            let Some(n) = straight.graph.nodes.iter().position(|node| *node == Node::Input(at)) else { continue };
            let v = match port.role {
                Role::Sample(j) => {
                    let v = build.value(None);
                    samples.push((j, v));
                    v
                }
                Role::State => {
                    let Some(word) = layout.word(&port.name) else { continue };
                    let v = build.value(None);
                    words[word] = Some(v);
                    v
                }
                _ => {
                    let v = build.value(None);
                    let register = build.line.given.len() as u8;
                    build.line.given.push((v, register));
                    // The first stays where u will go; another makes room for the sample.
                    if register == 0 { v } else { build.computed(Kind::Copy, vec![v]) }
                }
            };
            build.known.insert(n, v);
        }
        samples.sort_by_key(|(j, _)| *j);
        for (j, v) in &samples {
            build.line.home[*v] = Some(1 + *j as u8);
        }
        let words: Vec<V> = words.into_iter().map(|word| word.unwrap_or_else(|| build.value(None))).collect();
        // The first words lie where the sample will: they pass through other registers.
        let beside = (1 + samples.len()).min(words.len());
        let mut ends = vec![beside];
        ends.extend(cut.apart.then(|| layout.estimates_from(beside)).filter(|at| *at < words.len()));
        ends.extend(cut.late.then_some((words.len() - 1).max(beside)));
        ends.push(words.len());
        let mut from = 0;
        let mut loads = Vec::new();
        for end in ends {
            if from < end {
                if from >= beside {
                    (from..end).for_each(|at| build.line.home[words[at]] = Some(at as u8));
                }
                if cut.streamed {
                    build.line.state.extend(&words[from..end]);
                    from = end;
                    continue;
                }
                let load = build.item(Kind::LoadState, vec![], words[from..end].to_vec());
                if let Some(before) = loads.last() {
                    build.line.before[load].push(*before);
                }
                loads.push(load);
            }
            from = end;
        }
        build.item(Kind::LoadSample, vec![], samples.iter().map(|(_, v)| *v).collect());

        // What goes out, in the order of the record.
        let good = |name: &str| straight.result(name).expect("a result of the tick");
        if cut.twice {
            // Each use of what is foreseen by a value of its own: innovations first.
            for n in &straight.innovations {
                build.need(*n);
            }
            for n in &straight.foreseen {
                build.known.remove(n);
            }
        }
        let innovations: Vec<V> = straight.innovations.iter().map(|n| build.need(*n)).collect();
        let mut resume = None;
        if !innovations.is_empty() {
            resume = Some(build.item(Kind::Resume, innovations.clone(), vec![]));
        }
        let roots: Vec<N> = {
            let order = straight.values_in_order();
            order.into_iter().filter(|n| build.is_number(*n)).collect()
        };
        for n in roots {
            build.need(n);
        }
        let finals: Vec<N> = layout.words.iter().map(|word| good(word)).collect();
        let mut final_values: Vec<V> = Vec::new();
        for (at, n) in finals.iter().enumerate() {
            let mut v = build.need(*n);
            let elsewhere = build.line.home[v].is_some_and(|home| usize::from(home) != at);
            let came =
                matches!(straight.graph.nodes[*n], Node::Input(port) if record.inputs[port].role == Role::Argument);
            let in_the_way = cut.moved && (1..=samples.len()).contains(&at) && build.line.home[v].is_none();
            let taken = build.line.constants[v].is_some() || final_values.contains(&v) || words[at] == v;
            if elsewhere || came || in_the_way || taken {
                v = build.computed(Kind::Copy, vec![v]);
            }
            build.line.home[v] = Some(at as u8);
            final_values.push(v);
        }
        build.line.finals = final_values;

        let tests: Vec<(V, V)> =
            straight.ordinary_tests.iter().map(|(size, limit)| (build.need(*size), build.need(*limit))).collect();
        let mut sources: Vec<V> = tests.iter().flat_map(|(size, limit)| [*size, *limit]).collect();
        for n in straight.demands() {
            sources.push(build.need(n));
        }
        let guard = build.item(Kind::Guard(tests.len()), sources, vec![]);
        let held = build.producer[build.line.finals[0]].expect("u is computed");
        build.line.before[held].push(guard);
        if straight.whole {
            for (at, name) in ["u", "sigma", "sigma_star"].into_iter().enumerate() {
                let v = build.need(good(name));
                build.item(Kind::Store(at), vec![v], vec![]);
            }
            for (port, n) in record.results.iter().zip(&straight.good) {
                let Role::Flag(bit) = port.role else { continue };
                let flag = match straight.graph.nodes[*n] {
                    Node::Compare(Test::NotEqual, a, b) => Some((false, a, b)),
                    Node::Compare(Test::Greater, a, b) => Some((true, a, b)),
                    _ => None,
                };
                if let Some((greater, a, b)) = flag {
                    let sources = vec![build.need(a), build.need(b)];
                    let item = build.item(Kind::Flag(bit, greater), sources, vec![]);
                    build.line.before[item].push(guard);
                }
            }
        }
        build.line.before[guard].extend(loads);
        build.orders(resume, &innovations);
    }
}

impl Straight<'_> {
    /// What is tested, without its size.
    fn demands(&self) -> impl Iterator<Item = N> {
        self.ordinary_tests.iter().filter_map(|(size, _)| match self.graph.nodes[*size] {
            Node::Abs(n) => Some(n),
            _ => None,
        })
    }

    /// The values that results and tests of an ordinary tick need, in the order of the record.
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
    #[allow(clippy::too_many_lines, reason = "one text, from its first line to its last")]
    fn emit(&self, layout: &Layout, name: &str, line: &Line, found: &Found) -> Result<Emitted, String> {
        let mut text = String::new();
        let mut table = found.table.clone();
        let bytes = |words: usize| 4 * words as i32;
        let kept = found.above;
        macro_rules! put {
            ($($text:tt)*) => {{ let _ = writeln!(text, "\t{}", format_args!($($text)*)); }};
        }
        if kept > 16 {
            put!("vpush {}", row(16, kept - 16));
        }
        put!("adr.w r3, .L{name}_table");
        if !self.innovations.is_empty() {
            put!("ldrb.w ip, [r0, #{}]", layout.resuming());
        }
        // How far the state and the table have been read.
        let (mut state, mut constants) = (0_usize, 0_usize);
        let (mut at_guard, mut at_resume) = (None, None);
        for event in &found.events {
            match event {
                Event::Immediate { value, register } => {
                    let number = line.constants[*value].map(f32::from_bits).unwrap_or_default();
                    put!("vmov.f32 s{register}, #{number:?}");
                }
                Event::Constants { first, count } => {
                    put!("vldmia r3!, {}", row(*first, usize::from(*count)));
                    constants += usize::from(*count);
                }
                Event::Words { first, count } => {
                    put!("vldmia r0!, {}", row(*first, usize::from(*count)));
                    state += usize::from(*count);
                }
                Event::Item { item, sources, results } => {
                    let s = |k: usize| sources[k];
                    let d = results.first().copied().unwrap_or_default();
                    match line.items[*item].kind {
                        Kind::LoadSample => put!("vldmia r1, {}", row(d, results.len())),
                        Kind::LoadState => {
                            put!("vldmia r0!, {}", row(d, results.len()));
                            state += results.len();
                        }
                        Kind::Resume => {
                            put!("cmp.w ip, #0\n\tbne.w .L{name}_resume");
                            let _ = writeln!(text, ".L{name}_observed:");
                            at_resume = Some((state, constants, sources.clone()));
                        }
                        Kind::Guard(tests) => {
                            for k in 0..tests {
                                put!("vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr", s(2 * k), s(2 * k + 1));
                                put!("bhi.w .L{name}_beyond");
                            }
                            let _ = writeln!(text, ".L{name}_plausible:");
                            if self.whole {
                                put!("mov.w r1, #0");
                            }
                            if self.innovations.is_empty() {
                                put!("mov.w ip, #0\n\tstrb.w ip, [r0, #{}]", layout.resuming() - bytes(state));
                            }
                            at_guard = Some((state, constants, sources[2 * tests..].to_vec()));
                        }
                        kind => text += &operation(kind, d, sources, "r1"),
                    }
                }
            }
        }
        put!("vstmdb r0!, {}", row(0, layout.words.len()));
        let leave = if kept > 16 { format!("\tvpop {}\n", row(16, kept - 16)) } else { String::new() };
        text += &leave;
        if self.whole {
            put!("mov.w r0, r1");
        }
        put!("bx lr");
        if let Some((state, constants, innovations)) = at_resume {
            let _ = writeln!(text, ".L{name}_resume:");
            table.push(NOTHING);
            for register in &innovations {
                let at = table.len() - 1;
                put!("vldr s{register}, [r3, #{}]", bytes(at) - bytes(constants));
            }
            // The flag itself is still asked for if this sample is rejected too.
            put!("mov.w ip, #0\n\tstrb.w ip, [r0, #{}]\n\tmov.w ip, #1", layout.resuming() - bytes(state));
            put!("b.w .L{name}_observed");
        }
        let (state, constants, demands) = at_guard.ok_or("a guard")?;
        let place = layout.places(bytes(state), "r2", 0);
        // Beyond what is plausible: the whole condition.
        let _ = writeln!(text, ".L{name}_beyond:");
        let mut places = Places {
            place: &place,
            u_alone: !self.whole,
            table: "r3",
            table_at: constants,
            arguments: self.demands().zip(demands).collect(),
            flag: None,
        };
        let label = format!("{name}_again");
        let mut again = Cold::new(&self.graph, &self.record.inputs, &places, &mut table, &label, 16);
        again.decide(self.condition, &[])?;
        let (push, pop) = again.saved();
        text += &(push + &again.code + &pop);
        put!("bne.w .L{name}_plausible");
        text += &leave;
        // Rejected: all anew.
        places.arguments = HashMap::new();
        let flag = self.record.inputs.iter().position(|port| port.name == "resuming");
        let flag = flag.and_then(|at| self.graph.nodes.iter().position(|node| *node == Node::Input(at)));
        places.flag = flag.filter(|_| !self.innovations.is_empty());
        let label = format!("{name}_rejected");
        let mut rejected =
            Cold::new(&self.graph, &self.record.inputs, &places, &mut table, &label, usize::from(!self.whole));
        rejected.give(self.record, &self.bad, "")?;
        let (push, pop) = rejected.saved();
        text += &(push + &rejected.code + &pop);
        put!("bx lr");
        text += &words(name, &table);
        let around = RETURN + FLAG + if self.whole { 2 } else { 0 };
        let cycles = found.cycles + TABLE + around;
        let floor = self.line(layout, 32, Cut::NONE).floor() + around;
        Ok(Emitted { text, cycles, floor })
    }
}
