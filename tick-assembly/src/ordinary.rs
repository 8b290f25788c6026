//! Values of a drive's tick on its ordinary path, derived from the recorded parts and from assumptions.
//!
//! On the ordinary path every count is present and accepted, the base is unchanged, the reference is within its
//! revolution, and the demand is plausible. Only necessary assumptions are made: an assumption without an effect on the
//! values is dropped. Each remaining assumption is tested on the path. Counts come first, in core registers; the rest
//! are numbers.

use std::collections::HashMap;

use tick_record::drive::DriveFunctions;
use tick_record::{Block, End, Id, Op, Port, Record, Role, Test, ValueKind};

use crate::build::{Mirror, clamped};
use crate::graph::{Graph, N, Node};
use crate::layout::DriveLayout;

/// The ordinary path.
pub(crate) struct Ordinary<'a> {
    pub(crate) graph: Graph,
    pub(crate) inputs: Vec<Port>,
    pub(crate) functions: &'a DriveFunctions,
    /// Changed state words with their new values.
    pub(crate) state: Vec<(String, N)>,
    pub(crate) output: HashMap<String, N>,
    pub(crate) flags: Vec<(u8, N)>,
    /// A magnitude and its limit, or a limit and a magnitude that is not less.
    pub(crate) sizes: Vec<(N, N)>,
    /// Values that the observers pass to the law.
    pub(crate) handed: HashMap<String, N>,
    /// Counts that must be equal.
    pub(crate) equal: Vec<(N, N)>,
    /// Values in the order of the traces.
    order: Vec<N>,
}

/// An assumption about a value of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Assumed {
    in_law: bool,
    at: usize,
    truth: bool,
}

/// Results of both parts under assumptions, with their values.
struct Resolved {
    observed: Vec<N>,
    asked: Vec<N>,
    of_observe: Vec<N>,
    of_law: Vec<N>,
}

impl<'a> Ordinary<'a> {
    pub(crate) fn of(functions: &'a DriveFunctions) -> Result<Self, String> {
        let DriveFunctions { observe, followed: law, .. } = functions;
        let mut inputs: Vec<Port> = Vec::new();
        for port in observe.inputs.iter().chain(&law.inputs) {
            if port.role != Role::Between && !inputs.contains(port) {
                inputs.push(port.clone());
            }
        }
        let mut graph = Graph::default();
        let (assumed, all) = fewest(&mut graph, functions, &inputs)?;
        let (sizes, equal) = tested(&graph, functions, &assumed, &all)?;
        let answer = observe.results.iter().position(|port| port.role == Role::Answer).ok_or("an answer")?;
        if graph.nodes[all.observed[answer]] != Node::Truth(true) {
            return Err("an ordinary tick that gives up".into());
        }
        let becomes = |word: &Port| {
            let of = |record: &Record, results: &[N]| {
                record.results.iter().position(|port| port == word).map(|at| results[at])
            };
            let n = of(law, &all.asked).or_else(|| of(observe, &all.observed))?;
            let stays = matches!(graph.nodes[n], Node::Input(at) if inputs[at] == *word);
            (!stays).then(|| (word.name.clone(), n))
        };
        let state = functions.state.iter().filter_map(becomes).collect();
        let named = |port: &Port, n: &N| (port.name.clone(), *n);
        let results = || law.results.iter().zip(&all.asked);
        let output = results().filter(|(port, _)| port.role == Role::Output).map(|(port, n)| named(port, n)).collect();
        let flag = |(port, n): (&Port, &N)| match (port.role, graph.nodes[*n]) {
            (Role::Flag(_), Node::Truth(false)) => None,
            (Role::Flag(bit), Node::Compare(Test::NotEqual, ..)) => Some(Ok((bit, *n))),
            (Role::Flag(_), other) => Some(Err(format!("{other:?} tells the health of an ordinary tick"))),
            _ => None,
        };
        let flags = results().filter_map(flag).collect::<Result<_, _>>()?;
        let results = observe.results.iter().zip(&all.observed);
        let handed = results.filter(|(port, _)| port.role == Role::Between).map(|(port, n)| named(port, n)).collect();
        let order = all.of_observe.into_iter().chain(all.of_law).collect();
        let ordinary = Self { graph, inputs, functions, state, output, flags, sizes, handed, equal, order };
        ordinary.checked()
    }

    /// Checks that the available operations compute all required values.
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

    /// Returns the float operands of a value; a converted count has none.
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

    /// Returns the numbers that results and tests need, in the order of the traces.
    pub(crate) fn needed(&self, whole: bool) -> Vec<N> {
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

    /// Returns whether the value depends on a target.
    pub(crate) fn is_asked(&self, n: N) -> bool {
        self.cone(n).any(|at| {
            let port = &self.inputs[at];
            port.role == Role::Argument || port.name == "offset"
        })
    }

    /// Returns the numbers that the observers pass to the law, with their locations.
    pub(crate) fn handed_on(&self, layout: &DriveLayout) -> impl Iterator<Item = (N, usize)> {
        let numbers = layout.handed().filter(|(port, _)| port.kind == ValueKind::Number);
        numbers.filter_map(|(port, at)| Some((*self.handed.get(&port.name)?, at)))
    }

    pub(crate) fn is_number(&self, n: N) -> bool {
        match self.graph.nodes[n] {
            Node::Input(at) => self.inputs[at].kind == ValueKind::Number,
            Node::Select(_, yes, _) => self.is_number(yes),
            Node::Count(_)
            | Node::CountSince(..)
            | Node::CountPlus(..)
            | Node::CountSigned(..)
            | Node::CountWhole(..)
            | Node::Truth(_) => false,
            _ => true,
        }
    }

    /// Returns counts that are converted to numbers.
    pub(crate) fn counts(&self, whole: bool) -> Vec<N> {
        let of = |n: &N| if let Node::NumberOf(count) = self.graph.nodes[*n] { Some(count) } else { None };
        self.needed(whole).iter().filter_map(of).collect()
    }

    /// Returns state words that are counts, with their new values.
    pub(crate) fn counts_of_state(&self) -> Vec<(&Port, N)> {
        let words = self.functions.state.iter().filter(|word| word.kind == ValueKind::Count);
        words
            .filter_map(|word| self.state.iter().find(|(name, _)| *name == word.name).map(|(_, n)| (word, *n)))
            .collect()
    }

    /// Returns the inputs on which a value depends.
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

    pub(crate) fn input(&self, name: &str) -> Option<N> {
        let at = self.inputs.iter().position(|port| port.name == name)?;
        self.graph.nodes.iter().position(|node| *node == Node::Input(at))
    }
}

/// Returns possible assumptions about a trace: magnitudes within or not below their limits, and an unchanged base.
fn candidates(record: &Record, in_law: bool) -> impl Iterator<Item = Assumed> {
    let op = |id: Id| record.value(id).op;
    let truth = move |at: usize| match record.values[at].op {
        Op::Compare(Test::LessOrEqual, size, _) if matches!(op(size), Op::Abs(_)) => Some(true),
        Op::Compare(Test::Less, size, _) if matches!(op(size), Op::Abs(_)) => Some(false),
        Op::Compare(Test::NotEqual, moved, _) if matches!(op(moved), Op::NumberOf(_)) => Some(false),
        _ => None,
    };
    (0..record.values.len()).filter_map(move |at| truth(at).map(|truth| Assumed { in_law, at, truth }))
}

/// Returns the assumptions that affect the results, and the results under these assumptions.
fn fewest(graph: &mut Graph, functions: &DriveFunctions, inputs: &[Port]) -> Result<(Vec<Assumed>, Resolved), String> {
    let mut assumed: Vec<Assumed> =
        candidates(&functions.observe, false).chain(candidates(&functions.followed, true)).collect();
    let all = resolved(graph, functions, inputs, &assumed)
        .ok_or("this tick decides more than what is assumed of an ordinary one")?;
    let mut at = 0;
    while at < assumed.len() {
        let mut fewer = assumed.clone();
        fewer.remove(at);
        let same = resolved(graph, functions, inputs, &fewer)
            .is_some_and(|fewer| fewer.observed == all.observed && fewer.asked == all.asked);
        if same {
            assumed = fewer;
        } else {
            at += 1;
        }
    }
    Ok((assumed, all))
}

/// Pairs of values.
type Pairs = Vec<(N, N)>;

/// Returns the tests of the assumptions: magnitudes with their limits, and counts that must be equal.
fn tested(
    graph: &Graph,
    functions: &DriveFunctions,
    assumed: &[Assumed],
    all: &Resolved,
) -> Result<(Pairs, Pairs), String> {
    let (mut sizes, mut equal) = (Vec::new(), Vec::new());
    for Assumed { in_law, at, .. } in assumed {
        let (record, values) =
            if *in_law { (&functions.followed, &all.of_law) } else { (&functions.observe, &all.of_observe) };
        let of = |id: Id| values[id.index()];
        match record.values[*at].op {
            Op::Compare(Test::LessOrEqual, size, limit) => sizes.push((of(size), of(limit))),
            Op::Compare(Test::Less, size, limit) => sizes.push((of(limit), of(size))),
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
    Ok((sizes, equal))
}

/// Returns the results under assumptions; `None` if a decision remains.
fn resolved(graph: &mut Graph, functions: &DriveFunctions, inputs: &[Port], assumed: &[Assumed]) -> Option<Resolved> {
    let DriveFunctions { observe, followed: law, .. } = functions;
    let mut part = |record: &Record, in_law: bool, before: &dyn Fn(&Port) -> Option<N>| {
        let mut given = HashMap::new();
        for (at, value) in record.values.iter().enumerate() {
            if let Op::Input(port) = value.op {
                let port = &record.inputs[port];
                let known = before(port).unwrap_or_else(|| {
                    // A lost sample is not ordinary.
                    let lost = port.kind == ValueKind::Truth && port.role == Role::Argument;
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
        observe
            .results
            .iter()
            .position(|result| result.name == port.name && result.role == port.role)
            .map(|at| observed[at])
    };
    let (of_law, asked) = part(law, true, &handed)?;
    Some(Resolved { observed, asked, of_observe, of_law })
}
