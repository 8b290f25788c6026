//! A statement: queries that a solver answers one by one; all must be proved.

use tick_record::{Port, Record, ValueKind};

use crate::smt::{Results, Script, number};

/// One query of a statement.
#[derive(Clone, Debug)]
pub struct Question {
    /// Name of the query within its statement.
    pub what: String,
    /// SMT-LIB text: `unsat` is a proof.
    pub text: String,
    free: Vec<(String, ValueKind)>,
}

impl Question {
    pub(crate) fn new(what: &str, script: &Script, claim: &str) -> Self {
        Self { what: what.into(), text: script.question(claim), free: script.free().to_vec() }
    }

    /// Assumes a value for each free name for which `is` returns one.
    pub(crate) fn suppose(&mut self, is: &dyn Fn(&str, ValueKind) -> Option<&'static str>) {
        let facts = self.free.iter().filter_map(|(name, kind)| is(name, *kind).map(|term| (name, term)));
        let facts = facts.map(|(name, term)| format!("(assert (= {name} {term}))\n")).collect::<Vec<_>>().concat();
        self.text = self.text.replace("(check-sat)", &format!("{facts}(check-sat)"));
    }
}

/// A claim as text and as queries.
#[derive(Clone, Debug)]
pub struct Statement {
    /// Text of the claim.
    pub name: &'static str,
    /// The queries; all must be proved.
    pub questions: Vec<Question>,
}

impl Statement {
    pub(crate) fn new(name: &'static str, questions: impl IntoIterator<Item = Question>) -> Self {
        Self { name, questions: questions.into_iter().collect() }
    }
}

/// Prefix of the values of the only trace in a query.
const PREFIX: &str = "t_";

/// One execution of a trace on any bits.
#[derive(Clone)]
pub(crate) struct Step {
    pub(crate) script: Script,
    results: Results,
}

impl Step {
    pub(crate) fn of(record: &Record) -> Self {
        let mut script = Script::default();
        let results = script.record(PREFIX, record, &mut |script, port| script.any(&port.name, port.kind));
        Self { script, results }
    }

    /// Returns the term of a result.
    pub(crate) fn after(&self, name: &str) -> &str {
        self.results.of(name)
    }

    /// Returns whether the trace has this result.
    pub(crate) fn gives(&self, name: &str) -> bool {
        self.results.iter().any(|(port, _)| port.name == name)
    }

    pub(crate) fn ask(&self, what: &str, claim: &str) -> Question {
        Question::new(what, &self.script, claim)
    }
}

/// Returns the last value of this name, as a term.
pub(crate) fn called(record: &Record, name: &str) -> Option<String> {
    let at = record.values.iter().rposition(|value| value.name.as_deref() == Some(name))?;
    Some(format!("{PREFIX}{at}"))
}

/// Returns the numbers among the words of a state.
pub(crate) fn numbers(state: &[Port]) -> impl Iterator<Item = &str> {
    state.iter().filter(|port| port.kind == ValueKind::Number).map(|port| port.name.as_str())
}

/// Term: equal bits, or both NaN.
pub(crate) fn same(a: &str, b: &str) -> String {
    format!("(= {a} {b})")
}

pub(crate) fn not(claim: &str) -> String {
    format!("(not {claim})")
}

/// Term: the first implies the second.
pub(crate) fn then(first: &str, second: &str) -> String {
    format!("(=> {first} {second})")
}

pub(crate) fn all(claims: impl IntoIterator<Item = String>) -> String {
    let claims: Vec<String> = claims.into_iter().collect();
    if claims.is_empty() { "true".into() } else { format!("(and true {})", claims.join(" ")) }
}

pub(crate) fn either(claims: impl IntoIterator<Item = String>) -> String {
    let claims: Vec<String> = claims.into_iter().collect();
    format!("(or false {})", claims.join(" "))
}

/// Term: neither NaN nor infinite.
pub(crate) fn finite(term: &str) -> String {
    format!("(not (or (fp.isNaN {term}) (fp.isInfinite {term})))")
}

/// Term: within both bounds; false for NaN.
pub(crate) fn within(term: &str, low: f32, high: f32) -> String {
    format!("(and (fp.leq {} {term}) (fp.leq {term} {}))", number(low), number(high))
}

/// Term: within ± the bound.
pub(crate) fn bounded(term: &str, bound: f32) -> String {
    within(term, -bound, bound)
}
