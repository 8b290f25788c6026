//! The tick of a drive: its ordinary way as a straight line, all else as the parts that it was recorded in.
//!
//! On the ordinary way every count is there and believed, the base stays, the reference stays within its turn, and the
//! demand is plausible. What is assumed is what the way needs, no more, and each assumption is tested on it. Nothing is
//! stored before all are: where one fails the tick begins anew out of line, in the parts, which give any tick the same
//! bits. Counts come first, in core registers; from there on all is numbers.

use std::collections::HashMap;
use std::fmt::Write as _;

use tick_record::drive::DriveFunctions;
use tick_record::{Block, End, Id, Kind as Of, Op, Port, Record, Role, Test};

use crate::build::{Build, Mirror, clamped, operation};
use crate::cold::{row, words};
use crate::counts::Counts;
use crate::graph::{Graph, N, Node};
use crate::layout::DriveLayout;
use crate::schedule::{Event, Found, Kind, Line, V, search};
use crate::{Effort, Emitted};

/// Cycles of `adr` and of the return: DDI 0439D, a pipeline refill of 2.
const AROUND: u32 = 1 + 3;

/// The ordinary way.
pub(crate) struct Ordinary<'a> {
    pub(crate) graph: Graph,
    pub(crate) inputs: Vec<Port>,
    functions: &'a DriveFunctions,
    /// Words of the state that change, and what they become.
    state: Vec<(String, N)>,
    output: HashMap<String, N>,
    flags: Vec<(u8, N)>,
    /// A size and its limit.
    sizes: Vec<(N, N)>,
    /// Counts that must be equal.
    pub(crate) equal: Vec<(N, N)>,
    /// Values in the order of the records.
    order: Vec<N>,
}

/// What is taken for granted of a value of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Assumed {
    in_law: bool,
    at: usize,
    truth: bool,
}

/// What comes of assumptions: results of both parts, and their values.
struct Resolved {
    observed: Vec<N>,
    asked: Vec<N>,
    of_observe: Vec<N>,
    of_law: Vec<N>,
}

impl<'a> Ordinary<'a> {
    pub(crate) fn of(functions: &'a DriveFunctions) -> Result<Self, String> {
        let DriveFunctions { observe, law, .. } = functions;
        let mut inputs: Vec<Port> = Vec::new();
        for port in observe.inputs.iter().chain(&law.inputs) {
            if port.role != Role::Between && !inputs.contains(port) {
                inputs.push(port.clone());
            }
        }
        let mut graph = Graph::default();
        let candidates = |record: &Record, in_law| -> Vec<Assumed> {
            let op = |id: Id| record.value(id).op;
            let assumed = |at: usize| match record.values[at].op {
                Op::Compare(Test::LessOrEqual, size, _) if matches!(op(size), Op::Abs(_)) => Some(true),
                Op::Compare(Test::NotEqual, moved, _) if matches!(op(moved), Op::NumberOf(_)) => Some(false),
                _ => None,
            };
            let all = (0..record.values.len()).filter_map(|at| assumed(at).map(|truth| Assumed { in_law, at, truth }));
            all.collect()
        };
        let mut assumed = [candidates(observe, false), candidates(law, true)].concat();
        let resolve = |graph: &mut Graph, assumed: &[Assumed]| resolved(graph, functions, &inputs, assumed);
        let all = resolve(&mut graph, &assumed).ok_or("this tick decides more than what is assumed of an ordinary one")?;
        let mut at = 0;
        while at < assumed.len() {
            let mut fewer = assumed.clone();
            fewer.remove(at);
            let same = resolve(&mut graph, &fewer)
                .is_some_and(|fewer| fewer.observed == all.observed && fewer.asked == all.asked);
            if same {
                assumed = fewer;
            } else {
                at += 1;
            }
        }
        let (mut sizes, mut equal) = (Vec::new(), Vec::new());
        for Assumed { in_law, at, .. } in assumed {
            let (record, values) = if in_law { (law, &all.of_law) } else { (observe, &all.of_observe) };
            let of = |id: Id| values[id.index()];
            match record.values[at].op {
                Op::Compare(Test::LessOrEqual, size, limit) => sizes.push((of(size), of(limit))),
                Op::Compare(_, moved, _) => match graph.nodes[of(moved)] {
                    Node::NumberOf(moved) => match graph.nodes[moved] {
                        Node::CountSince(a, b) => equal.push((a, b)),
                        other => return Err(format!("{other:?} is no difference of counts")),
                    },
                    other => return Err(format!("{other:?} is no count")),
                },
                _ => {}
            }
        }
        let answer = observe.results.iter().position(|port| port.role == Role::Answer).ok_or("an answer")?;
        if graph.nodes[all.observed[answer]] != Node::Truth(true) {
            return Err("an ordinary tick that gives up".into());
        }
        let (mut state, mut output, mut flags) = (Vec::new(), HashMap::new(), Vec::new());
        for word in &functions.state {
            let of = |record: &Record, results: &[N]| {
                record.results.iter().position(|port| port == word).map(|at| results[at])
            };
            let Some(n) = of(law, &all.asked).or_else(|| of(observe, &all.observed)) else { continue };
            let stays = matches!(graph.nodes[n], Node::Input(at) if inputs[at] == *word);
            if !stays {
                state.push((word.name.clone(), n));
            }
        }
        for (port, n) in law.results.iter().zip(&all.asked) {
            match port.role {
                Role::Output => {
                    output.insert(port.name.clone(), *n);
                }
                Role::Flag(bit) => match graph.nodes[*n] {
                    Node::Truth(false) => {}
                    Node::Compare(Test::NotEqual, ..) => flags.push((bit, *n)),
                    other => return Err(format!("{other:?} tells the health of an ordinary tick")),
                },
                _ => {}
            }
        }
        let order = all.of_observe.into_iter().chain(all.of_law).collect();
        let ordinary = Self { graph, inputs, functions, state, output, flags, sizes, equal, order };
        ordinary.checked()
    }

    /// Is all that is needed of it computed by the operations there are?
    fn checked(self) -> Result<Self, String> {
        for n in self.needed(true) {
            let good = match self.graph.nodes[n] {
                Node::Select(c, yes, no) => {
                    clamped(&self.graph, n).is_some()
                        || self.graph.nodes[c] == Node::Compare(Test::Greater, yes, no)
                        || Mirror::of(&self.graph, c).is_some_and(|mirror| n == mirror.angle || n == mirror.constant)
                }
                Node::Compare(..) | Node::And(..) | Node::Or(..) | Node::Not(_) => false,
                _ => true,
            };
            if !good {
                return Err(format!("{:?} is no number of an ordinary tick", self.graph.nodes[n]));
            }
        }
        Ok(self)
    }

    /// What is not made of anything but numbers, and that.
    fn operands(&self, n: N) -> Vec<N> {
        let mirror = |c: N| Mirror::of(&self.graph, c);
        match self.graph.nodes[n] {
            Node::NumberOf(_) => Vec::new(),
            Node::Select(c, yes, no) => match (clamped(&self.graph, n), mirror(c)) {
                (Some((x, high, low)), _) => vec![x, high, low],
                (None, Some(mirror)) => vec![mirror.x, mirror.size, mirror.limit],
                (None, None) => vec![yes, no],
            },
            node => node.operands().collect(),
        }
    }

    /// Numbers that results and tests need, in the order of the records.
    fn needed(&self, whole: bool) -> Vec<N> {
        let mut open: Vec<N> = self.state.iter().map(|(_, n)| *n).filter(|n| self.is_number(*n)).collect();
        open.extend(self.sizes.iter().flat_map(|(size, limit)| [*size, *limit]));
        let told = |name: &str| whole || name == "u";
        open.extend(self.output.iter().filter(|(name, _)| told(name)).map(|(_, n)| *n));
        let mut seen = vec![false; self.graph.nodes.len()];
        while let Some(n) = open.pop() {
            if !std::mem::replace(&mut seen[n], true) {
                open.extend(self.operands(n));
            }
        }
        let mut order = Vec::new();
        for n in &self.order {
            if std::mem::replace(&mut seen[*n], false) {
                order.push(*n);
            }
        }
        order
    }

    fn is_number(&self, n: N) -> bool {
        match self.graph.nodes[n] {
            Node::Input(at) => self.inputs[at].kind == Of::Number,
            Node::Select(_, yes, _) => self.is_number(yes),
            Node::Count(_) | Node::CountSince(..) | Node::CountPlus(..) | Node::CountSigned(..) | Node::CountWhole(..) => false,
            Node::Truth(_) => false,
            _ => true,
        }
    }

    /// Counts that become numbers.
    pub(crate) fn counts(&self, whole: bool) -> Vec<N> {
        let of = |n: &N| if let Node::NumberOf(count) = self.graph.nodes[*n] { Some(count) } else { None };
        self.needed(whole).iter().filter_map(of).collect()
    }

    /// Words of the state that are counts, and what they become.
    pub(crate) fn counts_of_state(&self) -> Vec<(&Port, N)> {
        let words = self.functions.state.iter().filter(|word| word.kind == Of::Count);
        words.filter_map(|word| self.state.iter().find(|(name, _)| *name == word.name).map(|(_, n)| (word, *n))).collect()
    }

    /// The inputs that a value is made of.
    pub(crate) fn cone(&self, n: N) -> impl Iterator<Item = usize> {
        let (mut open, mut inputs) = (vec![n], Vec::new());
        while let Some(n) = open.pop() {
            if let Node::Input(at) = self.graph.nodes[n] {
                inputs.push(at);
            }
            open.extend(self.graph.nodes[n].operands());
        }
        inputs.into_iter()
    }

    pub(crate) fn functions_inputs(&self) -> impl Iterator<Item = &Port> {
        self.functions.observe.inputs.iter()
    }

    fn input(&self, name: &str) -> Option<N> {
        let at = self.inputs.iter().position(|port| port.name == name)?;
        self.graph.nodes.iter().position(|node| *node == Node::Input(at))
    }
}

/// The results under assumptions; `None` where a decision is left.
fn resolved(
    graph: &mut Graph,
    functions: &DriveFunctions,
    inputs: &[Port],
    assumed: &[Assumed],
) -> Option<Resolved> {
    let DriveFunctions { observe, law, .. } = functions;
    let mut part = |record: &Record, in_law: bool, before: &dyn Fn(&Port) -> Option<N>| {
        let mut given = HashMap::new();
        for (at, value) in record.values.iter().enumerate() {
            if let Op::Input(port) = value.op {
                let port = &record.inputs[port];
                let known = before(port).unwrap_or_else(|| {
                    // A sample that is lost is not ordinary.
                    let lost = port.kind == Of::Truth && port.role == Role::Argument;
                    let own = inputs.iter().position(|input| input == port).unwrap_or_default();
                    graph.add(if lost { Node::Truth(false) } else { Node::Input(own) })
                });
                given.insert(at, known);
            }
        }
        for one in assumed.iter().filter(|one| one.in_law == in_law) {
            given.insert(one.at, graph.add(Node::Truth(one.truth)));
        }
        let values = graph.values(record, &given);
        let mut block: &Block = &record.body;
        loop {
            match &block.end {
                End::Return(results) => {
                    let results: Vec<N> = results.iter().map(|id| values[id.index()]).collect();
                    return Some((values, results));
                }
                End::Branch { condition, yes, no } => match graph.nodes[values[condition.index()]] {
                    Node::Truth(truth) => block = if truth { yes } else { no },
                    _ => return None,
                },
            }
        }
    };
    let (of_observe, observed) = part(observe, false, &|_| None)?;
    let handed = |port: &Port| {
        observe.results.iter().position(|result| result.name == port.name && result.role == port.role).map(|at| observed[at])
    };
    let (of_law, asked) = part(law, true, &handed)?;
    Some(Resolved { observed, asked, of_observe, of_law })
}

/// How the loads are cut.
#[derive(Clone, Debug)]
struct Cut {
    /// Where groups of the state end.
    state: Vec<usize>,
    /// Is the target at the end loaded apart?
    apart: bool,
    /// Do words of the state come to where they will be stored from?
    at_home: bool,
}

/// A tick that returns u, or one that fills the output and returns the health.
pub(crate) fn tick(
    ordinary: &Ordinary<'_>,
    layout: &DriveLayout,
    prefix: &str,
    whole: bool,
    effort: &Effort,
) -> Result<Emitted, String> {
    let name = format!("{prefix}_{}", if whole { "tick" } else { "tick_u" });
    let counts = Counts::of(ordinary, layout, whole)?;
    let short = Effort { rounds: 1, steps: effort.steps.div_ceil(4), ..*effort };
    let mut best: Option<(u32, Line, Found)> = None;
    for registers in [16, 20, 24, 28, 32] {
        for cut in cuts(layout) {
            let line = ordinary.line(layout, &counts, registers, &cut, whole);
            let Some(found) = search(&line, &short) else { continue };
            let cycles = found.cycles + kept(&found);
            if best.as_ref().is_none_or(|(least, ..)| cycles < *least) {
                best = Some((cycles, line, found));
            }
        }
    }
    let Some((cycles, line, mut found)) = best else {
        return Err(format!("{name}: no order was found in which its numbers fit into the registers"));
    };
    if let Some(better) = search(&line, effort).filter(|better| better.cycles + kept(better) < cycles) {
        found = better;
    }
    Ok(ordinary.emit(layout, prefix, &name, &counts, &line, &found, whole))
}

/// Cycles to keep what the caller needs, and bring it back.
fn kept(found: &Found) -> u32 {
    match found.used_above() {
        above if above > 16 => 2 * (1 + (above as u32 - 16)),
        _ => 0,
    }
}

fn cuts(layout: &DriveLayout) -> Vec<Cut> {
    let all = layout.numbers.len();
    let mut cuts = Vec::new();
    for state in [vec![all], vec![all - 1, all], vec![1, all], vec![1, all - 1, all]] {
        for apart in [false, true] {
            for at_home in [false, true] {
                cuts.push(Cut { state: state.clone(), apart, at_home });
            }
        }
    }
    cuts
}

impl Ordinary<'_> {
    fn line(&self, layout: &DriveLayout, counts: &Counts, registers: usize, cut: &Cut, whole: bool) -> Line {
        let mut build = Build::new(&self.graph, registers);
        // Counts come in registers of their own.
        for (k, n) in counts.moved.iter().enumerate() {
            let v = build.value(None);
            build.line.given.push((v, (registers - counts.moved.len() + k) as u8));
            build.known.insert(*n, v);
        }
        let words: Vec<V> = (0..layout.numbers.len()).map(|_| build.value(None)).collect();
        for (name, v) in layout.numbers.iter().zip(&words) {
            build.known.extend(self.input(name).map(|n| (n, *v)));
        }
        let mut loads = Vec::new();
        let mut from = 0;
        for &end in &cut.state {
            if cut.at_home {
                (from..end).for_each(|at| build.line.home[words[at]] = Some(at as u8));
            }
            let load = build.item(Kind::LoadState, vec![], words[from..end].to_vec());
            if let Some(before) = loads.last() {
                build.line.before[load].push(*before);
            }
            loads.push(load);
            from = end;
        }
        // The targets, with what lies between them.
        let of_sample: Vec<(Option<N>, V)> =
            layout.targets.iter().map(|name| (name.as_deref().and_then(|name| self.input(name)), build.value(None))).collect();
        for (n, v) in &of_sample {
            build.known.extend(n.map(|n| (n, *v)));
        }
        let needed = self.needed(whole);
        let is_read = |(n, _): &(Option<N>, V)| n.is_some_and(|n| needed.contains(&n));
        let last = of_sample.iter().rposition(is_read).map_or(0, |at| at + 1);
        let middle = if cut.apart { layout.first_target.min(last) } else { last };
        let mut loaded: Option<usize> = None;
        for row in [&of_sample[..middle], &of_sample[middle..last]] {
            if !row.is_empty() {
                let load = build.item(Kind::LoadSample, vec![], row.iter().map(|(_, v)| *v).collect());
                build.line.before[load].extend(loaded);
                loaded = Some(load);
            }
        }
        for n in &needed {
            if build.is_number(*n) {
                build.need(*n);
            }
        }
        // What goes out.
        let mut finals: Vec<V> = Vec::new();
        for (at, name) in layout.numbers.iter().enumerate() {
            let becomes = self.state.iter().find(|(word, _)| word == name).map(|(_, n)| *n);
            let mut v = becomes.map_or(words[at], |n| build.need(n));
            let taken = build.line.constants[v].is_some() || finals.contains(&v) || words.contains(&v);
            let sampled = of_sample.iter().any(|(_, of)| *of == v);
            if taken || sampled {
                v = build.computed(Kind::Copy, vec![v]);
            }
            build.line.home[v] = Some(at as u8);
            finals.push(v);
        }
        build.line.finals = finals;
        for (k, (size, limit)) in self.sizes.iter().enumerate() {
            let sources = vec![build.need(*size), build.need(*limit)];
            build.item(Kind::Leave(k), sources, vec![]);
        }
        if whole {
            for (at, name) in ["u", "sigma", "sigma_star"].into_iter().enumerate() {
                let v = build.need(self.output[name]);
                build.item(Kind::Store(at), vec![v], vec![]);
            }
            for (bit, n) in &self.flags {
                if let Node::Compare(_, a, b) = self.graph.nodes[*n] {
                    let sources = vec![build.need(a), build.need(b)];
                    build.item(Kind::Flag(*bit, false), sources, vec![]);
                }
            }
        }
        build.orders(None, &[]);
        build.line
    }

    fn mirror_constants(&self) -> Option<[u32; 2]> {
        let conditions = self.graph.nodes.iter().filter_map(|node| match *node {
            Node::Select(c, ..) => Mirror::of(&self.graph, c),
            _ => None,
        });
        conditions.map(|mirror| [mirror.pi, mirror.rest]).next()
    }

    #[allow(clippy::too_many_arguments, clippy::too_many_lines, reason = "one text, from its first line to its last")]
    fn emit(
        &self,
        layout: &DriveLayout,
        prefix: &str,
        name: &str,
        counts: &Counts,
        line: &Line,
        found: &Found,
        whole: bool,
    ) -> Emitted {
        let mut text = String::new();
        let mut table = found.table.clone();
        let bytes = |words: usize| 4 * words as i32;
        macro_rules! put {
            ($($text:tt)*) => {{ let _ = writeln!(text, "\t{}", format_args!($($text)*)); }};
        }
        let above = found.used_above();
        let (mut push, mut pop) = (counts.push.clone(), counts.pop.clone());
        if above > 16 {
            let _ = writeln!(push, "\tvpush {}", row(16, above - 16));
            pop = format!("\tvpop {}\n{pop}", row(16, above - 16));
        }
        text += &counts.flags;
        put!("bne.w .L{name}_rest");
        text += &push;
        let top = line.registers - counts.moved.len();
        text += &counts.text(top, &format!(".L{name}_away_0_0"));
        let (tab, health) = (counts.table, counts.health);
        put!("adr.w {tab}, .L{name}_table");
        if whole {
            put!("mov.w {health}, #0");
        }
        // How far state, sample and table have been read, and the ways that leave from there.
        let (mut state, mut sample, mut constants) = (0, counts.sample_at, 0_usize);
        let mut away: Vec<(i32, i32)> = if counts.leaves { vec![(0, 0)] } else { Vec::new() };
        let mut mirrored = None;
        for event in &found.events {
            match event {
                Event::Immediate { value, register } => {
                    let number = line.constants[*value].map(f32::from_bits).unwrap_or_default();
                    put!("vmov.f32 s{register}, #{number:?}");
                }
                Event::Constants { first, count } => {
                    put!("vldmia {tab}!, {}", row(*first, usize::from(*count)));
                    constants += usize::from(*count);
                }
                Event::Item { item, sources, results } => {
                    let s = |k: usize| sources[k];
                    let d = results.first().copied().unwrap_or_default();
                    match line.items[*item].kind {
                        Kind::LoadSample => {
                            put!("vldmia r1!, {}", row(d, results.len()));
                            sample += bytes(results.len());
                        }
                        Kind::LoadState => {
                            put!("vldmia r0!, {}", row(d, results.len()));
                            state += bytes(results.len());
                        }
                        Kind::Leave(_) => {
                            put!("vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr", s(0), s(1));
                            put!("bhi.w .L{name}_away_{state}_{sample}");
                            away.push((state, sample));
                        }
                        Kind::Mirror => {
                            if s(0) != d {
                                put!("vmov.f32 s{d}, s{}", s(0));
                            }
                            put!("vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr\n\tbgt.w .L{name}_mirrored", s(1), s(2));
                            let _ = writeln!(text, ".L{name}_turned:");
                            mirrored = Some((sources.clone(), d, constants));
                        }
                        kind => text += &operation(kind, d, sources, health),
                    }
                }
            }
        }
        put!("vstmdb r0!, {}", row(0, layout.numbers.len()));
        text += counts.stores();
        if whole {
            put!("mov.w r0, {health}");
        }
        text += &pop;
        put!("bx lr");
        if let Some((sources, d, constants)) = mirrored {
            let _ = writeln!(text, ".L{name}_mirrored:");
            let [pi, rest] = self.mirror_constants().unwrap_or_default().map(|bits| {
                table.push(bits);
                bytes(table.len() - 1) - bytes(constants)
            });
            // A register of someone else.
            let t = (0..32).find(|t| *t != d && !sources.contains(t)).unwrap_or_default();
            let (size, constant) = (sources[1], sources[3]);
            put!("vcmp.f32 s{}, #0.0\n\tvmrs APSR_nzcv, fpscr\n\tvpush {{s{t}}}", sources[0]);
            put!("vldr s{t}, [{tab}, #{pi}]\n\tvsub.f32 s{d}, s{t}, s{size}");
            put!("vldr s{t}, [{tab}, #{rest}]\n\tvadd.f32 s{d}, s{d}, s{t}\n\tit mi\n\tvnegmi.f32 s{d}, s{d}");
            put!("vneg.f32 s{constant}, s{constant}\n\tvpop {{s{t}}}\n\tb.w .L{name}_turned");
        }
        // Anew, from where it began.
        away.sort_unstable();
        away.dedup();
        for (state, sample) in away {
            let _ = writeln!(text, ".L{name}_away_{state}_{sample}:");
            for (register, by) in [("r0", state), ("r1", sample)] {
                if by != 0 {
                    put!("sub.w {register}, {register}, #{by}");
                }
            }
            put!("b.w .L{name}_leave");
        }
        let _ = writeln!(text, ".L{name}_leave:");
        text += &pop;
        let _ = writeln!(text, ".L{name}_rest:");
        if whole {
            put!("b.w {prefix}_rest");
        } else {
            put!("push {{r4, lr}}\n\tsub.w sp, sp, #16\n\tmov r2, sp\n\tbl {prefix}_rest");
            put!("vldr s0, [sp]\n\tadd.w sp, sp, #16\n\tpop {{r4, pc}}");
        }
        text += &words(name, &table);
        let cycles = found.cycles + kept(found) + counts.cycles + AROUND + if whole { 2 } else { 0 };
        Emitted { text, cycles }
    }
}
