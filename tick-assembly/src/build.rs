//! From values to the items of a straight line: what is needed, each once, behind what it is made of.

use std::collections::HashMap;
use std::fmt::Write as _;

use tick_record::Test;

use crate::graph::{Graph, N, Node};
use crate::schedule::{Item, Kind, Line, V};

/// A [`Line`] that is being made.
pub(crate) struct Build<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) line: Line,
    /// What stands for a value of the graph.
    pub(crate) known: HashMap<N, V>,
    /// Which item makes a value.
    pub(crate) producer: Vec<Option<usize>>,
}

impl<'a> Build<'a> {
    pub(crate) fn new(graph: &'a Graph, registers: usize) -> Self {
        Self { graph, line: Line { registers, ..Line::default() }, known: HashMap::new(), producer: Vec::new() }
    }

    pub(crate) fn value(&mut self, constant: Option<u32>) -> V {
        self.line.constants.push(constant);
        self.line.home.push(None);
        self.line.better.push(None);
        self.producer.push(None);
        self.line.constants.len() - 1
    }

    pub(crate) fn item(&mut self, kind: Kind, sources: Vec<V>, results: Vec<V>) -> usize {
        let at = self.line.items.len();
        for v in &results {
            self.producer[*v] = Some(at);
        }
        let before = sources.iter().filter_map(|v| self.producer[*v]).collect();
        self.line.before.push(before);
        self.line.items.push(Item { kind, sources, results });
        at
    }

    pub(crate) fn computed(&mut self, kind: Kind, sources: Vec<V>) -> V {
        let result = self.value(None);
        self.item(kind, sources, vec![result]);
        result
    }

    pub(crate) fn need(&mut self, n: N) -> V {
        if let Some(v) = self.known.get(&n) {
            return *v;
        }
        let graph = self.graph;
        let node = graph.nodes[n];
        let v = match node {
            Node::Number(bits) => self.value(Some(bits)),
            Node::Add(a, b) => self.two(Kind::Add, a, b),
            Node::Sub(a, b) => self.two(Kind::Sub, a, b),
            // The same bits but for those of a NaN, which mean nothing.
            Node::Mul(a, b) if graph.nodes[b] == ONE => self.need(a),
            Node::Mul(a, b) if graph.nodes[a] == ONE => self.need(b),
            Node::Mul(a, b) => self.two(Kind::Mul, a, b),
            Node::Div(a, b) => self.two(Kind::Div, a, b),
            Node::Neg(a) => {
                let a = self.need(a);
                self.computed(Kind::Neg, vec![a])
            }
            Node::Abs(a) => {
                let a = self.need(a);
                self.computed(Kind::Abs, vec![a])
            }
            Node::NumberOf(count) => {
                let bits = self.need(count);
                self.computed(Kind::Number, vec![bits])
            }
            Node::Select(c, yes, no) => {
                if let Some((x, high, low)) = clamped(graph, n) {
                    let [x, high, low] = [x, high, low].map(|n| self.need(n));
                    self.computed(Kind::Clamp, vec![x, high, low])
                } else if graph.nodes[c] == Node::Compare(Test::Greater, yes, no) {
                    let (yes, no) = (self.need(yes), self.need(no));
                    self.computed(Kind::Max, vec![no, yes])
                } else {
                    self.mirrored(c);
                    return self.known[&n];
                }
            }
            other => unreachable!("{other:?} is no number of an ordinary tick"),
        };
        self.known.insert(n, v);
        v
    }

    /// An angle that is mirrored where it is large, and the constant that changes its sign with it.
    fn mirrored(&mut self, c: N) {
        let mirror = Mirror::of(self.graph, c).expect("checked before");
        let [x, size, limit] = [mirror.x, mirror.size, mirror.limit].map(|n| self.need(n));
        let (angle, constant) = (self.value(None), self.value(Some(mirror.usual)));
        let item = self.item(Kind::Mirror, vec![x, size, limit, constant], vec![angle]);
        // Who reads the constant comes behind.
        self.producer[constant] = Some(item);
        self.known.extend([(mirror.angle, angle), (mirror.constant, constant)]);
    }

    pub(crate) fn two(&mut self, kind: Kind, a: N, b: N) -> V {
        let (a, b) = (self.need(a), self.need(b));
        self.computed(kind, vec![a, b])
    }

    /// Orders that are not those of operands.
    pub(crate) fn orders(&mut self, resume: Option<usize>, innovations: &[V]) {
        let readers = |line: &Line, v: V| -> Vec<usize> {
            (0..line.items.len()).filter(|i| line.items[*i].sources.contains(&v)).collect()
        };
        if let Some(resume) = resume {
            for v in innovations {
                for reader in readers(&self.line, *v) {
                    if reader != resume {
                        self.line.before[reader].push(resume);
                    }
                }
            }
        }
        // What will be overwritten must have been read.
        for at in 0..self.line.finals.len() {
            let last = self.line.finals[at];
            let Some(writer) = self.producer[last] else { continue };
            for old in 0..self.line.home.len() {
                if old != last && self.line.home[old] == Some(at as u8) {
                    let mut first = readers(&self.line, old);
                    first.extend(self.producer[old]);
                    first.retain(|i| *i != writer);
                    self.line.before[writer].extend(first);
                }
            }
        }
    }

    pub(crate) fn is_number(&self, n: N) -> bool {
        matches!(
            self.graph.nodes[n],
            Node::Add(..)
                | Node::Sub(..)
                | Node::Mul(..)
                | Node::Div(..)
                | Node::Neg(..)
                | Node::Abs(..)
                | Node::NumberOf(_)
                | Node::Select(..)
        )
    }
}

/// x, upper and lower limit, if that is what a value is: the comparison with the upper limit decides first, and the
/// limits are constants in their order, so that one after the other is the same.
pub(crate) fn clamped(graph: &Graph, n: N) -> Option<(N, N, N)> {
    let Node::Select(above, high, inner) = graph.nodes[n] else { return None };
    let Node::Select(below, low, x) = graph.nodes[inner] else { return None };
    let number = |n: N| if let Node::Number(bits) = graph.nodes[n] { Some(f32::from_bits(bits)) } else { None };
    let is = |c: N, test: Test, limit: N| graph.nodes[c] == Node::Compare(test, x, limit);
    let ordered = number(low)? <= number(high)?;
    (ordered && is(above, Test::Greater, high) && is(below, Test::Less, low)).then_some((x, high, low))
}

/// An angle x beyond a limit is taken from the other side, ±((pi - |x|) + rest) with the sign of x, and a constant then
/// has the other sign: what a sine and its cosine begin with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirror {
    pub(crate) x: N,
    /// |x|
    pub(crate) size: N,
    pub(crate) limit: N,
    /// What the angle and the constant become.
    pub(crate) angle: N,
    pub(crate) constant: N,
    /// The constant as it is where nothing is mirrored.
    pub(crate) usual: u32,
    pub(crate) pi: u32,
    pub(crate) rest: u32,
}

impl Mirror {
    /// What this condition decides, if it is that.
    pub(crate) fn of(graph: &Graph, c: N) -> Option<Self> {
        let bits = |n: N| if let Node::Number(bits) = graph.nodes[n] { Some(bits) } else { None };
        let Node::Compare(Test::Greater, size, limit) = graph.nodes[c] else { return None };
        let Node::Abs(x) = graph.nodes[size] else { return None };
        let mut selects =
            graph.nodes.iter().enumerate().filter(|(_, node)| matches!(node, Node::Select(d, ..) if *d == c));
        let (mut angle, mut constant) = (None, None);
        for (n, node) in selects.by_ref() {
            let Node::Select(_, yes, no) = *node else { continue };
            if no == x {
                let Node::Select(below, turned, back) = graph.nodes[yes] else { return None };
                let Node::Compare(Test::Less, of, zero) = graph.nodes[below] else { return None };
                let Node::Add(difference, rest) = graph.nodes[back] else { return None };
                let Node::Sub(pi, from) = graph.nodes[difference] else { return None };
                let fits = graph.nodes[turned] == Node::Neg(back) && of == x && bits(zero)? == 0 && from == size;
                angle = fits.then_some((n, bits(pi)?, bits(rest)?));
            } else {
                let (yes, no) = (bits(yes)?, bits(no)?);
                constant = (yes == no ^ SIGN).then_some((n, no));
            }
        }
        let ((angle, pi, rest), (constant, usual)) = angle.zip(constant)?;
        Some(Self { x, size, limit, angle, constant, usual, pi, rest })
    }
}

/// 1.0
const ONE: Node = Node::Number(0x3f80_0000);
/// The sign of a number.
const SIGN: u32 = 0x8000_0000;

/// The text of an operation on registers; bits of the health are added up in a core register.
pub(crate) fn operation(kind: Kind, d: u8, sources: &[u8], health: &str) -> String {
    let s = |k: usize| sources[k];
    let mut text = String::new();
    macro_rules! put {
        ($($text:tt)*) => {{ let _ = writeln!(text, "\t{}", format_args!($($text)*)); }};
    }
    match kind {
        Kind::Add => put!("vadd.f32 s{d}, s{}, s{}", s(0), s(1)),
        Kind::Sub => put!("vsub.f32 s{d}, s{}, s{}", s(0), s(1)),
        Kind::Mul => put!("vmul.f32 s{d}, s{}, s{}", s(0), s(1)),
        Kind::Div => put!("vdiv.f32 s{d}, s{}, s{}", s(0), s(1)),
        Kind::Abs => put!("vabs.f32 s{d}, s{}", s(0)),
        Kind::Neg => put!("vneg.f32 s{d}, s{}", s(0)),
        Kind::Copy => put!("vmov.f32 s{d}, s{}", s(0)),
        Kind::Number => put!("vcvt.f32.s32 s{d}, s{}", s(0)),
        Kind::Clamp | Kind::Max => {
            if s(0) != d {
                put!("vmov.f32 s{d}, s{}", s(0));
            }
            for (limit, condition) in sources[1..].iter().zip(if kind == Kind::Max { ["mi"; 2] } else { ["gt", "mi"] })
            {
                put!("vcmp.f32 s{d}, s{limit}\n\tvmrs APSR_nzcv, fpscr");
                put!("it {condition}\n\tvmov{condition}.f32 s{d}, s{limit}");
            }
        }
        Kind::Store(at) => put!("vstr s{}, [r2, #{}]", s(0), 4 * at),
        Kind::Flag(bit, greater) => {
            let condition = if greater { "gt" } else { "ne" };
            put!("vcmp.f32 s{}, s{}\n\tvmrs APSR_nzcv, fpscr", s(0), s(1));
            put!("it {condition}\n\tadd{condition} {health}, #{}", 1 << bit);
        }
        other => unreachable!("{other:?} is more than an operation"),
    }
    text
}
