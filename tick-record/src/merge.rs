//! Merges the runs of a function into one trace: a tree of decisions in which common operations of both branches are
//! done once.
//!
//! 1. The runs share their beginnings. Together they are a tree with a decision at every fork.
//! 2. From the leaves up, the two branches of each decision c are aligned. A source statement (a kind of operation, a
//!    source location, an equation group) that is in both branches becomes one operation. An operand that differs
//!    becomes `Select(c, yes, no)`. Operations that one branch has between two common statements are always computed.
//!    So a clamp, the saturation flag and waiting estimates become selects, and the code after them is not duplicated.
//!    If the branches have nothing in common, as beyond the guard, the decision remains.
//! 3. Values are placed where they are first needed on each path. Unused values are left out.
//!
//! Every alignment gives an equal result: under c each operation has the operands of one branch, otherwise the operands
//! of the other, and no operation has an effect besides its value. No step changes an operation on numbers.

use std::collections::{HashMap, HashSet};
use std::panic::Location;

use crate::record::{Block, End, Id, Op, Port, Record, Role, Step, Table, Value};
use crate::recorder::{self, Event, Graph, What};

/// Maximum number of operations of one branch before the end that are always computed, since a decision would cost
/// more. Comparisons do not count, because decisions consist of them.
const FEW: usize = 4;
/// Maximum number of events of both branches between two common statements. All of them are always computed, to avoid
/// duplicating the code after them.
const NEAR: usize = 200;

/// Steps and names in sequence, and the end.
#[derive(Clone, Debug)]
struct Draft {
    events: Vec<Event>,
    end: DraftEnd,
}

#[derive(Clone, Debug)]
enum DraftEnd {
    Return(Vec<Id>),
    Branch { condition: Id, at: &'static Location<'static>, yes: Box<Draft>, no: Box<Draft> },
}

type TracePath = (Vec<Event>, Vec<(Port, Id)>);

pub(crate) fn record(mut graph: Graph, ways: &[TracePath]) -> Record {
    let results: Vec<Port> = ways[0].1.iter().map(|(port, _)| port.clone()).collect();
    for (_, puts) in ways {
        assert!(puts.iter().map(|(port, _)| port).eq(&results), "every way has the same results in the same order");
    }
    let ways: Vec<(&[Event], Vec<Id>)> =
        ways.iter().map(|(events, puts)| (&events[..], puts.iter().map(|(_, id)| *id).collect())).collect();
    let draft = tree(&ways);
    let draft = Merge { graph: &mut graph }.converted(draft);
    placed(graph, results, &draft)
}

/// Returns the paths as a tree. Events before a decision are equal on all paths that reach it.
fn tree(ways: &[(&[Event], Vec<Id>)]) -> Draft {
    let (first, results) = &ways[0];
    let fork = first.iter().position(|event| matches!(event.what, What::Decide { .. }));
    let events = first[..fork.unwrap_or(first.len())].to_vec();
    let Some(fork) = fork else {
        assert!(ways.len() == 1, "the function does not do the same each time");
        return Draft { events, end: DraftEnd::Return(results.clone()) };
    };
    let Event { what: What::Decide { condition, .. }, at, .. } = first[fork] else { unreachable!("found as such") };
    let branch = |wanted: bool| {
        let of: Vec<_> = (ways.iter())
            .filter_map(|(events, results)| {
                assert!(events[..fork] == first[..fork], "the function does not do the same each time");
                match events[fork].what {
                    What::Decide { answer, condition: c } if c == condition => {
                        (answer == wanted).then(|| (&events[fork + 1..], results.clone()))
                    }
                    _ => panic!("the function does not do the same each time"),
                }
            })
            .collect();
        Box::new(tree(&of))
    };
    Draft { events, end: DraftEnd::Branch { condition, at, yes: branch(true), no: branch(false) } }
}

struct Merge<'a> {
    graph: &'a mut Graph,
}

/// New values of the values of a branch.
type Becomes = Table<Id>;

impl Merge<'_> {
    fn converted(&mut self, draft: Draft) -> Draft {
        let Draft { mut events, end } = draft;
        match end {
            DraftEnd::Return(_) => Draft { events, end },
            DraftEnd::Branch { condition, at, yes, no } => {
                let (yes, no) = (self.converted(*yes), self.converted(*no));
                let merged = self.merged(condition, at, yes, no);
                events.extend(merged.events);
                Draft { events, end: merged.end }
            }
        }
    }

    /// Returns the value that is `yes` under c, otherwise `no`.
    fn either(&mut self, c: Id, yes: Id, no: Id) -> Id {
        let truth = |graph: &Graph, id| match graph.op(id) {
            Op::Truth(truth) => Some(truth),
            _ => None,
        };
        let op = match (truth(self.graph, yes), truth(self.graph, no)) {
            _ if yes == no => return yes,
            (Some(true), Some(false)) => return c,
            (Some(false), Some(true)) => Op::Not(c),
            (Some(true), _) => Op::Or(c, no),
            (_, Some(false)) => Op::And(c, yes),
            (Some(false), _) => Op::And(self.graph.value(Op::Not(c)), no),
            (_, Some(true)) => Op::Or(self.graph.value(Op::Not(c)), yes),
            _ => match (self.graph.op(yes), self.graph.op(no)) {
                (Op::Select(d, a, b), Op::Select(e, other_a, other_b)) if d == e => {
                    Op::Select(d, self.either(c, a, other_a), self.either(c, b, other_b))
                }
                (Op::Select(d, a, b), _) if b == no => Op::Select(self.graph.value(Op::And(c, d)), a, b),
                (_, Op::Select(d, a, b)) if a == yes => Op::Select(self.graph.value(Op::Or(c, d)), a, b),
                (Op::Select(d, a, b), _) if a == no => {
                    let not = self.graph.value(Op::Not(c));
                    Op::Select(self.graph.value(Op::Or(not, d)), a, b)
                }
                (_, Op::Select(d, a, b)) if b == yes => {
                    let not = self.graph.value(Op::Not(c));
                    Op::Select(self.graph.value(Op::And(not, d)), a, b)
                }
                _ => Op::Select(c, yes, no),
            },
        };
        self.graph.value(op)
    }

    /// Returns the value with its new operands.
    fn rewritten(&mut self, id: Id, becomes: &mut Becomes) -> Id {
        if let Some(now) = becomes.get(id) {
            return now;
        }
        let op = self.graph.op(id);
        let now = match op {
            Op::Input(_) | Op::Constant(_) | Op::Truth(_) | Op::CountOf(_) => id,
            _ => {
                let op = op.map(|operand| self.rewritten(operand, becomes));
                self.graph.value(op)
            }
        };
        becomes.set(id, now);
        now
    }

    /// Returns the event with the new operands of its value.
    fn event(&mut self, event: Event, becomes: &mut Becomes) -> Event {
        let what = match event.what {
            What::Compute(id) => What::Compute(self.rewritten(id, becomes)),
            What::Name { value, name, given } => What::Name { value: self.rewritten(value, becomes), name, given },
            What::Decide { .. } => unreachable!("decisions are ends"),
        };
        Event { what, ..event }
    }

    fn draft(&mut self, draft: Draft, becomes: &mut Becomes) -> Draft {
        let events = draft.events.into_iter().map(|event| self.event(event, becomes)).collect();
        let end = match draft.end {
            DraftEnd::Return(results) => {
                DraftEnd::Return(results.into_iter().map(|id| self.rewritten(id, becomes)).collect())
            }
            DraftEnd::Branch { condition, at, yes, no } => DraftEnd::Branch {
                condition: self.rewritten(condition, becomes),
                at,
                yes: Box::new(self.draft(*yes, becomes)),
                no: Box::new(self.draft(*no, becomes)),
            },
        };
        Draft { events, end }
    }

    /// Returns whether both events are one source statement.
    fn same_statement(&self, a: &Event, b: &Event) -> bool {
        a.at == b.at
            && a.section == b.section
            && a.channel == b.channel
            && match (a.what, b.what) {
                (What::Compute(a), What::Compute(b)) => {
                    let (a, b) = (self.graph.op(a), self.graph.op(b));
                    std::mem::discriminant(&a) == std::mem::discriminant(&b)
                        && match (a, b) {
                            (Op::Compare(a, ..), Op::Compare(b, ..)) => a == b,
                            (Op::CountSigned(_, a), Op::CountSigned(_, b)) => a == b,
                            (Op::CountWhole(_, a, b), Op::CountWhole(_, c, d)) => (a, b) == (c, d),
                            _ => true,
                        }
                }
                (What::Name { name: a, .. }, What::Name { name: b, .. }) => a == b,
                _ => false,
            }
    }

    fn cost(&self, events: &[Event]) -> usize {
        let cost = |event: &Event| match event.what {
            What::Compute(id) => match self.graph.op(id) {
                Op::Compare(..) | Op::Abs(_) | Op::Neg(_) => 0,
                _ => 1,
            },
            _ => 0,
        };
        events.iter().map(cost).sum()
    }

    /// Returns the number of events of each branch before the next common statement, or before both ends.
    fn gap(&self, yes: &[Event], no: &[Event]) -> Option<(usize, usize)> {
        let near = NEAR.min(yes.len() + no.len());
        (0..=near).flat_map(|both| (0..=both).map(move |i| (i, both - i))).find(|&(i, j)| {
            if i > yes.len() || j > no.len() {
                return false;
            }
            match (yes.get(i), no.get(j)) {
                (Some(a), Some(b)) => self.same_statement(a, b),
                (None, None) => {
                    let (yes_alone, no_alone) = (self.cost(yes), self.cost(no));
                    yes_alone + no_alone <= FEW && (yes_alone == 0 || no_alone == 0)
                }
                _ => false,
            }
        })
    }

    /// Returns one draft of the two branches of a decision.
    fn merged(&mut self, c: Id, at: &'static Location<'static>, yes: Draft, no: Draft) -> Draft {
        if let Some(draft) = self.joint(c, at, &yes, &no) {
            return draft;
        }
        let (mut of_yes, mut of_no) = (Becomes::new(), Becomes::new());
        let (mut i, mut j, mut events) = (0, 0, Vec::new());
        while let Some((skip_yes, skip_no)) = self.gap(&yes.events[i..], &no.events[j..]) {
            for event in &yes.events[i..i + skip_yes] {
                events.push(self.event(*event, &mut of_yes));
            }
            for event in &no.events[j..j + skip_no] {
                events.push(self.event(*event, &mut of_no));
            }
            (i, j) = (i + skip_yes, j + skip_no);
            let (Some(a), Some(b)) = (yes.events.get(i), no.events.get(j)) else { break };
            let (a, b) = (*a, *b);
            (i, j) = (i + 1, j + 1);
            let what = match (a.what, b.what) {
                (What::Compute(a), What::Compute(b)) => {
                    let mut others = self.graph.op(b).operands();
                    let op = self.graph.op(a).map(|operand| {
                        let other = others.next().expect("the same kind of operation");
                        let (yes, no) = (self.rewritten(operand, &mut of_yes), self.rewritten(other, &mut of_no));
                        self.either(c, yes, no)
                    });
                    let now = self.graph.value(op);
                    of_yes.set(a, now);
                    of_no.set(b, now);
                    What::Compute(now)
                }
                (What::Name { value: a, name, given }, What::Name { value: b, .. }) => {
                    let (yes, no) = (self.rewritten(a, &mut of_yes), self.rewritten(b, &mut of_no));
                    What::Name { value: self.either(c, yes, no), name, given }
                }
                _ => unreachable!("the same statement"),
            };
            events.push(Event { what, ..a });
        }
        let at_the_ends = i == yes.events.len() && j == no.events.len();
        let rest = |draft: Draft, from: usize| Draft { events: draft.events[from..].to_vec(), end: draft.end };
        let (yes, no) = (self.draft(rest(yes, i), &mut of_yes), self.draft(rest(no, j), &mut of_no));
        let end = match (yes.end.clone(), no.end.clone()) {
            (DraftEnd::Return(yes), DraftEnd::Return(no)) if at_the_ends => {
                DraftEnd::Return(yes.into_iter().zip(no).map(|(yes, no)| self.either(c, yes, no)).collect())
            }
            (
                DraftEnd::Branch { condition, at, yes: yes_yes, no: yes_no },
                DraftEnd::Branch { condition: other, yes: no_yes, no: no_no, .. },
            ) if at_the_ends && condition == other => DraftEnd::Branch {
                condition,
                at,
                yes: Box::new(self.merged(c, at, *yes_yes, *no_yes)),
                no: Box::new(self.merged(c, at, *yes_no, *no_no)),
            },
            _ => DraftEnd::Branch { condition: c, at, yes: Box::new(yes), no: Box::new(no) },
        };
        Draft { events, end }
    }

    /// Returns one decision for two nested ones: both must hold, or one of them.
    fn joint(&mut self, c: Id, at: &'static Location<'static>, yes: &Draft, no: &Draft) -> Option<Draft> {
        if let DraftEnd::Branch { condition: d, yes: inner, no: other, .. } = &yes.end
            && self.cost(&yes.events) <= FEW
            && same(other, no)
        {
            let condition = self.graph.value(Op::And(c, *d));
            let end = DraftEnd::Branch { condition, at, yes: inner.clone(), no: other.clone() };
            return Some(Draft { events: yes.events.clone(), end });
        }
        if let DraftEnd::Branch { condition: d, yes: other, no: inner, .. } = &no.end
            && self.cost(&no.events) <= FEW
            && same(other, yes)
        {
            let condition = self.graph.value(Op::Or(c, *d));
            let end = DraftEnd::Branch { condition, at, yes: other.clone(), no: inner.clone() };
            return Some(Draft { events: no.events.clone(), end });
        }
        None
    }
}

/// Returns whether both drafts have equal values in equal order.
fn same(a: &Draft, b: &Draft) -> bool {
    a.events.iter().map(|event| event.what).eq(b.events.iter().map(|event| event.what))
        && match (&a.end, &b.end) {
            (DraftEnd::Return(a), DraftEnd::Return(b)) => a == b,
            (
                DraftEnd::Branch { condition: a, yes: a_yes, no: a_no, .. },
                DraftEnd::Branch { condition: b, yes: b_yes, no: b_no, .. },
            ) => a == b && same(a_yes, b_yes) && same(a_no, b_no),
            _ => false,
        }
}

/// Places values where they are first needed and numbers them in that order.
fn placed(graph: Graph, results: Vec<Port>, draft: &Draft) -> Record {
    let (names, number) = (HashMap::new(), HashMap::new());
    let mut place = Place { graph: &graph, results: &results, names, number, values: Vec::new() };
    place.names(draft);
    let body = place.block(draft, &HashSet::new(), &HashMap::new());
    let (values, inputs) = (place.values, graph.inputs);
    Record { inputs, results, values, body }
}

struct Place<'a> {
    graph: &'a Graph,
    results: &'a [Port],
    names: HashMap<Id, (usize, bool)>,
    number: HashMap<Id, Id>,
    values: Vec<Value>,
}

impl Place<'_> {
    fn names(&mut self, draft: &Draft) {
        for event in &draft.events {
            if let What::Name { value, name, given } = event.what
                && ![recorder::ZERO, recorder::HALF].contains(&value)
            {
                let known = self.names.entry(value).or_insert((name, given));
                if given && !known.1 {
                    *known = (name, given);
                }
            }
        }
        if let DraftEnd::Branch { yes, no, .. } = &draft.end {
            self.names(yes);
            self.names(no);
        }
    }

    /// Returns the number of a value in the trace.
    fn numbered(&mut self, id: Id) -> Id {
        if let Some(number) = self.number.get(&id) {
            return *number;
        }
        let Value { op, name } = &self.graph.values[id.index()];
        let op = op.map(|operand| self.numbered(operand));
        let name = name.clone().or_else(|| self.names.get(&id).map(|(name, _)| self.graph.names[*name].clone()));
        self.values.push(Value { op, name });
        let number = Id(self.values.len() as u32 - 1);
        self.number.insert(id, number);
        number
    }

    /// Collects the values that a draft needs, including operands of operands.
    fn live(&self, draft: &Draft, live: &mut HashSet<Id>) {
        let mut open = match &draft.end {
            DraftEnd::Return(results) => results.clone(),
            DraftEnd::Branch { condition, yes, no, .. } => {
                self.live(yes, live);
                self.live(no, live);
                vec![*condition]
            }
        };
        while let Some(id) = open.pop() {
            if live.insert(id) {
                open.extend(self.graph.op(id).operands());
            }
        }
    }

    fn is_given(&self, id: Id) -> bool {
        matches!(self.graph.op(id), Op::Input(_) | Op::Constant(_) | Op::Truth(_) | Op::CountOf(_))
    }

    /// Returns the values that events of this draft need but no event computes: selects of values of two branches.
    fn between(&self, draft: &Draft, live: &HashSet<Id>) -> Vec<Id> {
        let computed = |event: &Event| match event.what {
            What::Compute(id) if live.contains(&id) => Some(id),
            _ => None,
        };
        let events: HashSet<Id> = draft.events.iter().filter_map(computed).collect();
        let mut open: Vec<Id> = events.iter().copied().collect();
        let (mut seen, mut between) = (HashSet::new(), Vec::new());
        while let Some(id) = open.pop() {
            if seen.insert(id) {
                open.extend(self.graph.op(id).operands());
                if !events.contains(&id) && !self.is_given(id) {
                    between.push(id);
                }
            }
        }
        between.sort();
        between
    }

    /// Leaves a state word unchanged if it is set to its known value.
    fn kept(&self, id: Id, port: &Port, known: &HashMap<Id, bool>) -> Id {
        let (Op::Truth(truth), Role::State) = (self.graph.op(id), port.role) else { return id };
        let own = |of: Id| matches!(self.graph.op(of), Op::Input(at) if self.graph.inputs[at].name == port.name);
        let same = known.iter().find(|(of, answer)| own(**of) && **answer == truth);
        same.map_or(id, |(of, _)| *of)
    }

    fn put(&mut self, id: Id, section: &'static str, ready: &mut HashSet<Id>, steps: &mut Vec<Step>) {
        let op = self.graph.op(id);
        if self.is_given(id) || !ready.insert(id) {
            return;
        }
        for operand in op.operands() {
            self.put(operand, section, ready, steps);
        }
        steps.push(Step { value: self.numbered(id), section });
    }

    /// `known` holds the answers of the decisions on the path to this block.
    fn block(&mut self, draft: &Draft, ready: &HashSet<Id>, known: &HashMap<Id, bool>) -> Block {
        let (mut ready, mut live, mut steps) = (ready.clone(), HashSet::new(), Vec::new());
        self.live(draft, &mut live);
        let between = self.between(draft, &live);
        let mut section = "";
        for event in &draft.events {
            section = event.section;
            let value = match event.what {
                What::Compute(id) => id,
                What::Name { value, .. } => value,
                What::Decide { .. } => unreachable!("decisions are ends"),
            };
            if live.contains(&value) {
                self.put(value, section, &mut ready, &mut steps);
            }
            // A select stands where its operands have been computed.
            for &id in &between {
                let computed = |id: &Id| ready.contains(id) || self.is_given(*id);
                if self.graph.op(id).operands().all(|operand| computed(&operand)) {
                    self.put(id, section, &mut ready, &mut steps);
                }
            }
        }
        let end = match &draft.end {
            DraftEnd::Return(results) => {
                for id in results {
                    self.put(*id, section, &mut ready, &mut steps);
                }
                let results = results.iter().zip(self.results).map(|(id, port)| self.kept(*id, port, known));
                let results: Vec<Id> = results.collect();
                End::Return(results.into_iter().map(|id| self.numbered(id)).collect())
            }
            DraftEnd::Branch { condition, yes, no, .. } => {
                self.put(*condition, section, &mut ready, &mut steps);
                let number = self.numbered(*condition);
                let mut arm = |draft: &Draft, answer| {
                    let known = known.iter().map(|(id, answer)| (*id, *answer)).chain([(*condition, answer)]).collect();
                    Box::new(self.block(draft, &ready, &known))
                };
                End::Branch { condition: number, yes: arm(yes, true), no: arm(no, false) }
            }
        };
        Block { steps, end }
    }
}
