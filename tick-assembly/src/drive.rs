//! The ordinary way of a drive's tick as a straight line: how its loads and stores are cut, its search, and its text
//! with the ways that leave it.
//!
//! Nothing is stored before the tests have passed: where one fails the tick begins anew out of line, in the parts. Of
//! two encoders what the observers know is stored before the demand is known, and the law goes on as a part.

use std::fmt::Write as _;

use tick_record::Kind as Of;

use crate::build::{Build, Mirror, operation};
use crate::cold::{row, words};
use crate::counts::Counts;
use crate::graph::{N, Node};
use crate::layout::DriveLayout;
use crate::ordinary::Ordinary;
use crate::schedule::{Event, Found, Kind, Line, V, search};
use crate::tick::{RETURN, TABLE};
use crate::{Effort, Emitted};

/// How the loads are cut.
#[derive(Clone, Debug)]
struct Cut {
    /// Where groups of the state end.
    state: Vec<usize>,
    /// Is the target at the end loaded apart?
    apart: bool,
    /// Do words of the state come to where they will be stored from?
    at_home: bool,
    /// Does the search say how many words of the state are loaded at once? Then groups are not.
    streamed: bool,
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
    let is_cleared = |word: &String| {
        ordinary.state.iter().any(|(name, n)| name == word && ordinary.graph.nodes[*n] == Node::Number(0))
    };
    if let Some(word) = layout.cleared.iter().find(|word| !is_cleared(word)) {
        return Err(format!("{name}: an ordinary tick does not set `{word}` to 0"));
    }
    // A short look at every way to cut the loads, and a long one at the best. Of two encoders more numbers than
    // registers are in use, and one long search finds more than several.
    let few = layout.groups.len() == 1;
    let Effort { rounds, steps, seed } = *effort;
    let (short, long) = if few {
        (Effort { rounds: 1, steps: steps.div_ceil(4), seed }, *effort)
    } else {
        (Effort { rounds: 1, steps, seed }, Effort { rounds: 1, steps: 3 * rounds * steps, seed })
    };
    // Registers that the caller keeps cost two cycles each: where there are enough others they are left alone.
    let enough: &[usize] = if few { &[16, 18, 20, 24, 28, 32] } else { &[28, 32] };
    let of = |streamed: bool| {
        let look = |registers: usize, effort: &Effort| {
            let cuts = cuts(layout).into_iter().filter(|cut| cut.streamed == streamed);
            let lines = cuts.map(|cut| ordinary.line(layout, &counts, registers, &cut, whole));
            let found = lines.filter_map(|line| search(&line, effort).map(|found| (line, found)));
            found.min_by_key(|(_, found)| found.cycles)
        };
        // What a short look has not found a long one may.
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
    Ok(ordinary.emit(layout, prefix, &name, &counts, &line, &found, whole))
}

/// Where a long search finds no order, searches each twice as long as the last before it is given up.
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
    // Of two encoders the groups that are stored early are the better ones to load.
    for apart in [false, true].into_iter().filter(|_| one_encoder) {
        for at_home in [false, true] {
            cuts.push(Cut { state: vec![all], apart, at_home, streamed: true });
        }
    }
    cuts
}

impl Ordinary<'_> {
    #[allow(clippy::too_many_lines, reason = "what comes in, what goes out, and what is between")]
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
            if cut.streamed {
                build.line.state.clone_from(&words);
                break;
            }
            let load = build.item(Kind::LoadState, vec![], words[from..end].to_vec());
            if let Some(before) = loads.last() {
                build.line.before[load].push(*before);
            }
            loads.push(load);
            from = end;
        }
        // The targets, with what lies between them.
        let of_sample: Vec<(Option<N>, V)> = layout
            .targets
            .iter()
            .map(|name| (name.as_deref().and_then(|name| self.input(name)), build.value(None)))
            .collect();
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
        let (late, early): (Vec<_>, Vec<_>) = self.sizes.iter().partition(|(size, _)| self.is_asked(*size));
        let becomes = |name: &String| self.state.iter().find(|(word, _)| word == name).map(|(_, n)| *n);
        let mut finals: Vec<V> = Vec::new();
        let mut stays = |build: &mut Build<'_>, at: usize| {
            let mut v = becomes(&layout.numbers[at]).map_or(words[at], |n| build.need(n));
            let taken = build.line.constants[v].is_some() || finals.contains(&v) || words.contains(&v);
            if taken || of_sample.iter().any(|(_, of)| *of == v) {
                v = build.computed(Kind::Copy, vec![v]);
            }
            build.line.home[v] = Some(at as u8);
            finals.push(v);
            v
        };
        // First all that is stored before the demand is known, and what must be known before.
        let mut leaves = Vec::new();
        for n in needed.iter().filter(|n| layout.groups.len() > 1 && !self.is_asked(**n)) {
            build.need(*n);
        }
        for (k, (size, limit)) in early.iter().enumerate() {
            let sources = vec![build.need(*size), build.need(*limit)];
            leaves.push(build.item(Kind::Leave(k), sources, vec![]));
        }
        let mut stored = loads.last().copied();
        for group in layout.groups.windows(2).rev() {
            let sources: Vec<V> = (group[0]..group[1]).map(|at| stays(&mut build, at)).collect();
            let save = build.item(Kind::Save, sources, vec![]);
            build.line.before[save].extend(leaves.iter().chain(&stored).copied());
            stored = Some(save);
        }
        for n in &needed {
            build.need(*n);
        }
        // What goes out.
        build.line.finals = (0..layout.stored_last()).map(|at| stays(&mut build, at)).collect();
        for (k, (size, limit)) in late.iter().enumerate() {
            let mut sources = vec![build.need(*size), build.need(*limit)];
            if layout.groups.len() > 1 {
                sources.extend(self.handed_on(layout).map(|(n, _)| build.need(n)));
            }
            let leave = build.item(Kind::Leave(early.len() + k), sources, vec![]);
            if layout.groups.len() > 1 {
                build.line.before[leave].extend(stored);
            }
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
        // What is limited where it stands comes there at once.
        for item in build.line.items.iter().filter(|item| layout.groups.len() > 1 && item.kind == Kind::Clamp) {
            build.line.better[item.sources[0]] = build.line.home[item.results[0]];
        }
        build.orders(None, &[]);
        build.line
    }

    fn is_late(&self, layout: &DriveLayout, leave: usize) -> bool {
        let early = self.sizes.iter().filter(|(size, _)| !self.is_asked(*size)).count();
        layout.groups.len() > 1 && leave >= early
    }

    /// The demand is not plausible, and what the observers know is stored already: the part `law` goes on from there.
    #[allow(clippy::too_many_arguments, reason = "all of one text")]
    fn go_on_by_law(
        &self,
        layout: &DriveLayout,
        prefix: &str,
        name: &str,
        pop: &str,
        (state, sample): (i32, i32),
        handed: &[u8],
        whole: bool,
        text: &mut String,
    ) {
        macro_rules! put {
            ($($text:tt)*) => {{ let _ = writeln!(text, "\t{}", format_args!($($text)*)); }};
        }
        let bytes = layout.between_bytes();
        let all = bytes + 16;
        let _ = writeln!(text, ".L{name}_law:");
        put!("sub.w r0, r0, #{state}\n\tsub.w r1, r1, #{sample}\n\tpush.w {{r4, lr}}\n\tsub.w sp, sp, #{all}");
        for ((_, at), register) in self.handed_on(layout).zip(handed) {
            put!("vstr s{register}, [sp, #{at}]");
        }
        put!("mov.w ip, #0");
        for (port, at) in layout.handed().filter(|(port, _)| port.kind == Of::Truth) {
            // Of an ordinary tick none is true.
            debug_assert_eq!(self.graph.nodes[self.handed[&port.name]], Node::Truth(false));
            put!("strb.w ip, [sp, #{at}]");
        }
        if whole {
            put!("mov r3, r2");
        } else {
            put!("add.w r3, sp, #{bytes}");
        }
        put!("mov r2, sp\n\tbl {prefix}_law");
        if !whole {
            put!("vldr s0, [sp, #{bytes}]");
        }
        put!("add.w sp, sp, #{all}\n\tpop.w {{r4, lr}}");
        *text += pop;
        put!("bx lr");
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
        let above = found.above;
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
        let mut by_law = None;
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
                Event::Words { first, count } => {
                    put!("vldmia r0!, {}", row(*first, usize::from(*count)));
                    state += bytes(usize::from(*count));
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
                        Kind::Leave(k) => {
                            put!("vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr", s(0), s(1));
                            if self.is_late(layout, k) {
                                put!("bhi.w .L{name}_law");
                                by_law = Some((state, sample, sources[2..].to_vec()));
                            } else {
                                put!("bhi.w .L{name}_away_{state}_{sample}");
                                away.push((state, sample));
                            }
                        }
                        Kind::Save => {
                            put!("vstmdb r0!, {}", row(s(0), sources.len()));
                            state -= bytes(sources.len());
                            if state == bytes(layout.stored_last()) {
                                text += &counts.stores(state, sample);
                            }
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
        put!("vstmdb r0!, {}", row(0, layout.stored_last()));
        if layout.groups.len() == 1 {
            text += &counts.stores(0, sample);
        }
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
        if let Some((state, sample, handed)) = by_law {
            self.go_on_by_law(layout, prefix, name, &pop, (state, sample), &handed, whole, &mut text);
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
        let around = counts.cycles + RETURN + if whole { 2 } else { 0 };
        let cycles = found.cycles + TABLE + around + counts.saved;
        let floor = line.floor() + around;
        Emitted { text, cycles, floor }
    }
}
