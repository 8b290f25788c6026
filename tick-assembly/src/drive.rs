//! The ordinary path of a drive's tick as a straight line: the grouping of its loads and stores, its search, and its
//! text with the exits.
//!
//! Nothing is stored before the tests have passed. If a test fails, the tick starts again out of line, in the parts.
//! With two encoders the observer state is stored before the demand is computed, and the law continues as a part.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::Range;

use tick_record::ValueKind;

use crate::build::{Build, Mirror};
use crate::counts::Counts;
use crate::graph::{N, Node};
use crate::layout::DriveLayout;
use crate::ordinary::Ordinary;
use crate::schedule::{Found, Line, Operation, V, search};
use crate::text::{Exit, Flow, bytes, compare, kept, label, put, row, words};
use crate::tick::{RETURN, TABLE};
use crate::{Effort, Emitted};

/// Grouping of the loads.
#[derive(Clone, Debug)]
struct Cut {
    /// Ends of the groups of the state.
    state: Vec<usize>,
    /// Whether the target at the end of the tick is loaded separately.
    apart: bool,
    /// Whether state words are loaded into the registers from which they are stored.
    at_home: bool,
    /// Whether the search selects the number of state words per load; then groups are not used.
    streamed: bool,
}

/// Writes a tick that returns u, or one that fills the output and returns the status.
pub(crate) fn tick(
    ordinary: &Ordinary<'_>,
    layout: &DriveLayout,
    prefix: &str,
    whole: bool,
    effort: &Effort,
) -> Result<Emitted, String> {
    let name = format!("{prefix}_{}", if whole { "tick" } else { "tick_u" });
    let counts = Counts::of(ordinary, layout, whole)?;
    let is_cleared = |word: &String| {
        ordinary.state.iter().any(|(name, n)| name == word && ordinary.graph.nodes[*n] == Node::Number(0))
    };
    if let Some(word) = layout.cleared.iter().find(|word| !is_cleared(word)) {
        return Err(format!("{name}: an ordinary tick does not set `{word}` to 0"));
    }
    // A short search for every grouping, and a long one for the best. Two encoders need more numbers than registers,
    // and one long search is better than several.
    let few = layout.groups.len() == 1;
    let Effort { rounds, steps, seed } = *effort;
    let (short, long) = if few {
        (Effort { rounds: 1, steps: steps.div_ceil(4), seed }, *effort)
    } else {
        (Effort { rounds: 1, steps, seed }, Effort { rounds: 1, steps: 3 * rounds * steps, seed })
    };
    // Registers that the caller keeps cost two cycles each. They stay unused if there are enough others.
    let enough: &[usize] = if few { &[16, 18, 20, 24, 28, 32] } else { &[28, 32] };
    let of = |streamed: bool| {
        let look = |registers: usize, effort: &Effort| {
            let cuts = cuts(layout).into_iter().filter(|cut| cut.streamed == streamed);
            let lines = cuts.map(|cut| ordinary.line(layout, &counts, registers, &cut, whole));
            let found = lines.filter_map(|line| search(&line, effort).map(|found| (line, found)));
            found.min_by_key(|(_, found)| found.cycles)
        };
        // A long search may succeed where a short one fails.
        let first = enough.iter().find_map(|registers| look(*registers, &short));
        let longer = || (0..LONGER).find_map(|k| look(32, &Effort { steps: long.steps << k, ..long }));
        let (line, found) = first.or_else(|| if streamed { None } else { longer() })?;
        let better = search(&line, &long).filter(|better| better.cycles < found.cycles);
        Some((line, better.unwrap_or(found)))
    };
    let found = [of(false), of(true)].into_iter().flatten().min_by_key(|(_, found)| found.cycles);
    let Some((line, found)) = found else {
        return Err(format!(
            "{name}: no order was found in which its numbers fit into the registers; the C file has the same bits \
             (export --standalone)"
        ));
    };
    let flow = Flow::new(&line, counts.table);
    let writer =
        Writer { ordinary, layout, counts: &counts, prefix, name: &name, whole, flow, words: found.table.clone() };
    Ok(writer.tick(&line, &found))
}

/// Number of longer searches, each twice as long as the last, before a line without an order is rejected.
const LONGER: u32 = 6;

fn cuts(layout: &DriveLayout) -> Vec<Cut> {
    let all = layout.numbers.len();
    let mut cuts = Vec::new();
    let one_encoder = layout.groups.len() == 1;
    let states = if one_encoder {
        vec![vec![all], vec![all - 1, all], vec![1, all], vec![1, all - 1, all]]
    } else {
        vec![layout.groups.clone()]
    };
    for state in states {
        for apart in [false, true] {
            for at_home in [false, true].into_iter().filter(|at_home| one_encoder || !at_home) {
                cuts.push(Cut { state: state.clone(), apart, at_home, streamed: false });
            }
        }
    }
    // With two encoders the groups that are stored early are better for loading.
    for apart in [false, true].into_iter().filter(|_| one_encoder) {
        for at_home in [false, true] {
            cuts.push(Cut { state: vec![all], apart, at_home, streamed: true });
        }
    }
    cuts
}

impl Ordinary<'_> {
    fn line(&self, layout: &DriveLayout, counts: &Counts, registers: usize, cut: &Cut, whole: bool) -> Line {
        let mut build = Build::new(&self.graph, registers);
        // Counts arrive in separate registers.
        for (k, n) in counts.moved.iter().enumerate() {
            let v = build.value(None);
            build.line.given.push((v, (registers - counts.moved.len() + k) as u8));
            build.known.insert(*n, v);
        }
        let mut words = Vec::new();
        for (at, name) in layout.numbers.iter().enumerate() {
            let v = build.value(None);
            build.line.home[v] = cut.at_home.then_some(at as u8);
            build.known.extend(self.input(name).map(|n| (n, v)));
            words.push(v);
        }
        let loads = build.load_state(&words, &cut.state, cut.streamed);
        let needed = self.needed(whole);
        let targets = self.targets(&mut build, layout, &needed, cut.apart);
        let (late, early): (Vec<_>, Vec<_>) = self.sizes.iter().partition(|(size, _)| self.is_asked(*size));
        let mut kept = Kept { ordinary: self, layout, words, targets, values: Vec::new() };
        // First the values that are stored before the demand is known, and their operands.
        let many = layout.groups.len() > 1;
        for n in needed.iter().filter(|n| many && !self.is_asked(**n)) {
            build.need(*n);
        }
        let mut leaves = Vec::new();
        for (k, (size, limit)) in early.iter().enumerate() {
            let sources = vec![build.need(*size), build.need(*limit)];
            leaves.push(build.item(Operation::Leave(k), sources, vec![]));
        }
        let mut stored = loads.last().copied();
        for group in layout.groups.windows(2).rev() {
            let sources = kept.row(&mut build, group[0]..group[1]);
            let save = build.item(Operation::Save, sources, vec![]);
            build.line.before[save].extend(leaves.iter().chain(&stored).copied());
            stored = Some(save);
        }
        for n in &needed {
            build.need(*n);
        }
        // Outputs.
        build.line.finals = kept.row(&mut build, 0..layout.stored_last());
        for (k, (size, limit)) in late.iter().enumerate() {
            let handed = self.handed_on(layout).map(|(n, _)| n).filter(|_| many);
            let sources = [*size, *limit].into_iter().chain(handed).map(|n| build.need(n)).collect();
            let leave = build.item(Operation::Leave(early.len() + k), sources, vec![]);
            build.line.before[leave].extend(stored.filter(|_| many));
        }
        if whole {
            build.store_output(|name| self.output[name]);
            for (bit, n) in &self.flags {
                build.flag(*bit, *n);
            }
        }
        // A value that is limited in place is loaded there at once.
        for item in build.line.items.iter().filter(|item| many && item.kind == Operation::Clamp) {
            build.line.better[item.sources[0]] = build.line.home[item.results[0]];
        }
        build.orders(None, &[]);
        build.line
    }

    /// Loads the targets, with the words between them, up to the last needed one: in one load, or the second
    /// separately.
    fn targets(&self, build: &mut Build<'_>, layout: &DriveLayout, needed: &[N], apart: bool) -> Vec<V> {
        let (mut targets, mut last) = (Vec::new(), 0);
        for name in &layout.targets {
            let v = build.value(None);
            targets.push(v);
            if let Some(n) = name.as_deref().and_then(|name| self.input(name)) {
                build.known.insert(n, v);
                if needed.contains(&n) {
                    last = targets.len();
                }
            }
        }
        let middle = if apart { layout.first_target.min(last) } else { last };
        let mut loaded: Option<usize> = None;
        for row in [&targets[..middle], &targets[middle..last]] {
            if !row.is_empty() {
                let load = build.item(Operation::LoadSample, vec![], row.to_vec());
                build.line.before[load].extend(loaded);
                loaded = Some(load);
            }
        }
        targets
    }

    fn is_late(&self, layout: &DriveLayout, leave: usize) -> bool {
        let early = self.sizes.iter().filter(|(size, _)| !self.is_asked(*size)).count();
        layout.groups.len() > 1 && leave >= early
    }

    fn mirror_constants(&self) -> Option<[u32; 2]> {
        let conditions = self.graph.nodes.iter().filter_map(|node| match *node {
            Node::Select(c, ..) => Mirror::of(&self.graph, c),
            _ => None,
        });
        conditions.map(|mirror| [mirror.pi, mirror.rest]).next()
    }
}

/// The new state, each value in the register of its word.
struct Kept<'a> {
    ordinary: &'a Ordinary<'a>,
    layout: &'a DriveLayout,
    /// Words loaded from memory.
    words: Vec<V>,
    targets: Vec<V>,
    values: Vec<V>,
}

impl Kept<'_> {
    fn row(&mut self, build: &mut Build<'_>, words: Range<usize>) -> Vec<V> {
        let from = self.values.len();
        for at in words {
            let mut becomes = self.ordinary.state.iter().filter(|(word, _)| *word == self.layout.numbers[at]);
            let mut v = becomes.next().map_or(self.words[at], |(_, n)| build.need(*n));
            let elsewhere = [&self.values, &self.words, &self.targets].iter().any(|all| all.contains(&v));
            if elsewhere || build.line.constants[v].is_some() {
                v = build.computed(Operation::Copy, vec![v]);
            }
            build.line.home[v] = Some(at as u8);
            self.values.push(v);
        }
        self.values[from..].to_vec()
    }
}

/// The text of a tick under construction.
struct Writer<'a> {
    ordinary: &'a Ordinary<'a>,
    layout: &'a DriveLayout,
    counts: &'a Counts,
    prefix: &'a str,
    name: &'a str,
    whole: bool,
    flow: Flow<'a>,
    /// The table after the code.
    words: Vec<u32>,
}

/// The exits of the ordinary path: a restart after this number of bytes of state and sample, a mirrored angle with its
/// register, the law as a part.
#[derive(Default)]
struct Ways<'a> {
    away: BTreeSet<(i32, i32)>,
    mirrored: Option<(Exit<'a>, u8)>,
    by_law: Option<Exit<'a>>,
}

impl<'a> Writer<'a> {
    fn tick(mut self, line: &Line, found: &'a Found) -> Emitted {
        let Self { counts, name, layout, .. } = self;
        let (keep, restore) = kept(found.above);
        let pop = restore + &counts.pop;
        let text = &mut self.flow.text;
        *text += &counts.flags;
        put!(text, "bne.w .L{name}_rest");
        *text += &counts.push;
        *text += &keep;
        *text += &counts.text(line.registers - counts.moved.len(), &format!(".L{name}_away_0_0"));
        put!(text, "adr.w {}, .L{name}_table", counts.table);
        if self.whole {
            put!(text, "mov.w {}, #0", counts.health);
        }
        let ways = self.ordinary_way(found);
        let text = &mut self.flow.text;
        put!(text, "vstmdb r0!, {}", row(0, layout.stored_last()));
        if layout.groups.len() == 1 {
            *text += &counts.stores(0, self.flow.at.sample);
        }
        if self.whole {
            put!(text, "mov.w r0, {}", counts.health);
        }
        *text += &pop;
        put!(text, "bx lr");
        if let Some((exit, angle)) = ways.mirrored {
            self.mirror(exit, angle);
        }
        if let Some(exit) = ways.by_law {
            self.go_on_by_law(exit, &pop);
        }
        self.anew(ways.away, &pop);
        self.flow.text += &words(name, &self.words);
        let around = counts.cycles + RETURN + if self.whole { 2 } else { 0 };
        let cycles = found.cycles + TABLE + around + counts.saved;
        Emitted { text: self.flow.text, cycles, floor: line.floor() + around }
    }

    fn ordinary_way(&mut self, found: &'a Found) -> Ways<'a> {
        let Self { counts, name, layout, flow, .. } = self;
        let mut ways = Ways::default();
        ways.away.extend(counts.leaves.then_some((0, 0)));
        flow.at.sample = counts.sample_at;
        for event in &found.events {
            let Some((kind, sources, results)) = flow.load(event) else { continue };
            match kind {
                Operation::LoadSample => {
                    put!(flow.text, "vldmia r1!, {}", row(results[0], results.len()));
                    flow.at.sample += bytes(results.len());
                }
                Operation::Leave(k) => {
                    compare(&mut flow.text, sources[0], sources[1]);
                    if self.ordinary.is_late(layout, k) {
                        put!(flow.text, "bhi.w .L{name}_law");
                        ways.by_law = Some(flow.exit(&sources[2..]));
                    } else {
                        let (state, sample) = (flow.at.state, flow.at.sample);
                        put!(flow.text, "bhi.w .L{name}_away_{state}_{sample}");
                        ways.away.insert((state, sample));
                    }
                }
                Operation::Save => {
                    put!(flow.text, "vstmdb r0!, {}", row(sources[0], sources.len()));
                    flow.at.state -= bytes(sources.len());
                    if flow.at.state == bytes(layout.stored_last()) {
                        flow.text += &counts.stores(flow.at.state, flow.at.sample);
                    }
                }
                Operation::Mirror => {
                    let angle = results[0];
                    if sources[0] != angle {
                        put!(flow.text, "vmov.f32 s{angle}, s{}", sources[0]);
                    }
                    compare(&mut flow.text, sources[1], sources[2]);
                    put!(flow.text, "bgt.w .L{name}_mirrored");
                    label!(flow.text, ".L{name}_turned");
                    ways.mirrored = Some((flow.exit(sources), angle));
                }
                kind => flow.operation(kind, sources, results, counts.health),
            }
        }
        ways
    }

    /// Mirrors a large angle.
    fn mirror(&mut self, exit: Exit<'_>, angle: u8) {
        let (text, table, name) = (&mut self.flow.text, self.counts.table, self.name);
        label!(text, ".L{name}_mirrored");
        let [pi, rest] = self.ordinary.mirror_constants().unwrap_or_default().map(|bits| {
            self.words.push(bits);
            exit.at.to_word(self.words.len() - 1)
        });
        let &[x, size, _, constant] = exit.registers else { unreachable!("the sources of a mirror") };
        // A register that this path does not use.
        let t = (0..32).find(|t| *t != angle && !exit.registers.contains(t)).unwrap_or_default();
        put!(text, "vcmp.f32 s{x}, #0.0\n\tvmrs APSR_nzcv, fpscr\n\tvpush {{s{t}}}");
        put!(text, "vldr s{t}, [{table}, #{pi}]\n\tvsub.f32 s{angle}, s{t}, s{size}");
        put!(text, "vldr s{t}, [{table}, #{rest}]\n\tvadd.f32 s{angle}, s{angle}, s{t}");
        put!(text, "it mi\n\tvnegmi.f32 s{angle}, s{angle}");
        put!(text, "vneg.f32 s{constant}, s{constant}\n\tvpop {{s{t}}}\n\tb.w .L{name}_turned");
    }

    /// Continues with the part `law` for an implausible demand; the observer state is already stored.
    fn go_on_by_law(&mut self, exit: Exit<'_>, pop: &str) {
        let Self { ordinary, layout, prefix, name, .. } = *self;
        let text = &mut self.flow.text;
        let bytes = layout.between_bytes();
        let all = bytes + 16;
        label!(text, ".L{name}_law");
        put!(text, "sub.w r0, r0, #{}\n\tsub.w r1, r1, #{}", exit.at.state, exit.at.sample);
        put!(text, "push.w {{r4, lr}}\n\tsub.w sp, sp, #{all}");
        for ((_, at), register) in ordinary.handed_on(layout).zip(exit.registers) {
            put!(text, "vstr s{register}, [sp, #{at}]");
        }
        put!(text, "mov.w ip, #0");
        for (port, at) in layout.handed().filter(|(port, _)| port.kind == ValueKind::Truth) {
            // None is true in an ordinary tick.
            debug_assert_eq!(ordinary.graph.nodes[ordinary.handed[&port.name]], Node::Truth(false));
            put!(text, "strb.w ip, [sp, #{at}]");
        }
        if self.whole {
            put!(text, "mov r3, r2");
        } else {
            put!(text, "add.w r3, sp, #{bytes}");
        }
        put!(text, "mov r2, sp\n\tbl {prefix}_law");
        if !self.whole {
            put!(text, "vldr s0, [sp, #{bytes}]");
        }
        put!(text, "add.w sp, sp, #{all}\n\tpop.w {{r4, lr}}");
        *text += pop;
        put!(text, "bx lr");
    }

    /// Restarts the tick from its beginning.
    fn anew(&mut self, away: BTreeSet<(i32, i32)>, pop: &str) {
        let (text, name, prefix) = (&mut self.flow.text, self.name, self.prefix);
        for (state, sample) in away {
            label!(text, ".L{name}_away_{state}_{sample}");
            for (register, by) in [("r0", state), ("r1", sample)].into_iter().filter(|(_, by)| *by != 0) {
                put!(text, "sub.w {register}, {register}, #{by}");
            }
            put!(text, "b.w .L{name}_leave");
        }
        label!(text, ".L{name}_leave");
        *text += pop;
        label!(text, ".L{name}_rest");
        if self.whole {
            put!(text, "b.w {prefix}_rest");
        } else {
            put!(text, "push {{r4, lr}}\n\tsub.w sp, sp, #16\n\tmov r2, sp\n\tbl {prefix}_rest");
            put!(text, "vldr s0, [sp]\n\tadd.w sp, sp, #16\n\tpop {{r4, pc}}");
        }
    }
}
