//! Builds the items of a straight line from values: each needed value once, after its operands.

use std::collections::HashMap;

use tick_record::Test;

use crate::graph::{Graph, N, Node};
use crate::schedule::{Item, Line, Operation, V};

/// A [`Line`] under construction.
pub(crate) struct Build<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) line: Line,
    /// Value of the line for each value of the graph.
    pub(crate) known: HashMap<N, V>,
    /// Item that computes a value.
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

    pub(crate) fn item(&mut self, kind: Operation, sources: Vec<V>, results: Vec<V>) -> usize {
        let at = self.line.items.len();
        for v in &results {
            self.producer[*v] = Some(at);
        }
        let before = sources.iter().filter_map(|v| self.producer[*v]).collect();
        self.line.before.push(before);
        self.line.items.push(Item { kind, sources, results });
        at
    }

    pub(crate) fn computed(&mut self, kind: Operation, sources: Vec<V>) -> V {
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
            Node::Add(a, b) => self.two(Operation::Add, a, b),
            Node::Sub(a, b) => self.two(Operation::Sub, a, b),
            // Equal bits except for those of a NaN, which have no meaning.
            Node::Mul(a, b) if graph.nodes[b] == ONE => self.need(a),
            Node::Mul(a, b) if graph.nodes[a] == ONE => self.need(b),
            Node::Mul(a, b) => self.two(Operation::Mul, a, b),
            Node::Div(a, b) => self.two(Operation::Div, a, b),
            Node::Neg(a) => {
                let a = self.need(a);
                self.computed(Operation::Neg, vec![a])
            }
            Node::Abs(a) => {
                let a = self.need(a);
                self.computed(Operation::Abs, vec![a])
            }
            Node::NumberOf(count) => {
                let bits = self.need(count);
                self.computed(Operation::Number, vec![bits])
            }
            Node::Select(c, yes, no) => {
                if let Some((x, high, low)) = clamped(graph, n) {
                    let [x, high, low] = [x, high, low].map(|n| self.need(n));
                    self.computed(Operation::Clamp, vec![x, high, low])
                } else if graph.nodes[c] == Node::Compare(Test::Greater, yes, no) {
                    let (yes, no) = (self.need(yes), self.need(no));
                    self.computed(Operation::Max, vec![no, yes])
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

    /// Adds an angle that is mirrored if it is large, and the constant whose sign changes with it.
    fn mirrored(&mut self, c: N) {
        let mirror = Mirror::of(self.graph, c).expect("checked before");
        let [x, size, limit] = [mirror.x, mirror.size, mirror.limit].map(|n| self.need(n));
        let (angle, constant) = (self.value(None), self.value(Some(mirror.usual)));
        let item = self.item(Operation::Mirror, vec![x, size, limit, constant], vec![angle]);
        // Readers of the constant come after this item.
        self.producer[constant] = Some(item);
        self.known.extend([(mirror.angle, angle), (mirror.constant, constant)]);
    }

    /// Loads state words in groups with these ends, in sequence; or the search selects the group sizes.
    pub(crate) fn load_state(&mut self, words: &[V], ends: &[usize], streamed: bool) -> Vec<usize> {
        if streamed {
            self.line.state = words.to_vec();
            return Vec::new();
        }
        let (mut from, mut loads) = (0, Vec::new());
        for &end in ends {
            if from < end {
                let load = self.item(Operation::LoadState, vec![], words[from..end].to_vec());
                self.line.before[load].extend(loads.last());
                loads.push(load);
                from = end;
            }
        }
        loads
    }

    /// Stores u, σ and σ* from these values.
    pub(crate) fn store_output(&mut self, of: impl Fn(&str) -> N) {
        for (at, name) in ["u", "sigma", "sigma_star"].into_iter().enumerate() {
            let v = self.need(of(name));
            self.item(Operation::Store(at), vec![v], vec![]);
        }
    }

    /// Adds a status bit if a comparison decides it.
    pub(crate) fn flag(&mut self, bit: u8, n: N) -> Option<usize> {
        let (greater, a, b) = match self.graph.nodes[n] {
            Node::Compare(Test::NotEqual, a, b) => (false, a, b),
            Node::Compare(Test::Greater, a, b) => (true, a, b),
            _ => return None,
        };
        let sources = vec![self.need(a), self.need(b)];
        Some(self.item(Operation::Flag(bit, greater), sources, vec![]))
    }

    pub(crate) fn two(&mut self, kind: Operation, a: N, b: N) -> V {
        let (a, b) = (self.need(a), self.need(b));
        self.computed(kind, vec![a, b])
    }

    /// Adds order constraints that do not follow from operands.
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
        // A word must be read before it is overwritten.
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

/// Returns x, upper and lower limit if the value is a clamp. The comparison with the upper limit must come first, and
/// the limits must be ordered constants, so that two clamps in sequence give an equal result.
pub(crate) fn clamped(graph: &Graph, n: N) -> Option<(N, N, N)> {
    let Node::Select(above, high, inner) = graph.nodes[n] else { return None };
    let Node::Select(below, low, x) = graph.nodes[inner] else { return None };
    let number = |n: N| if let Node::Number(bits) = graph.nodes[n] { Some(f32::from_bits(bits)) } else { None };
    let is = |c: N, test: Test, limit: N| graph.nodes[c] == Node::Compare(test, x, limit);
    let ordered = number(low)? <= number(high)?;
    let is_above = is(above, Test::Greater, high) || graph.nodes[above] == Node::Compare(Test::Less, high, x);
    (ordered && is_above && is(below, Test::Less, low)).then_some((x, high, low))
}

/// An angle x beyond a limit is mirrored to ±((pi - |x|) + rest) with the sign of x, and a constant changes its sign. A
/// sine and its cosine begin with this operation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirror {
    pub(crate) x: N,
    /// |x|
    pub(crate) size: N,
    pub(crate) limit: N,
    /// Results for the angle and the constant.
    pub(crate) angle: N,
    pub(crate) constant: N,
    /// The constant without mirroring.
    pub(crate) usual: u32,
    pub(crate) pi: u32,
    pub(crate) rest: u32,
}

impl Mirror {
    /// Returns the mirrored angle if this condition decides one.
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
/// Sign bit of a number.
const SIGN: u32 = 0x8000_0000;
