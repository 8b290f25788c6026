//! Writes a trace as the text with which `cycle-bound --means` compares machine code: the location of each input and
//! result in registers and memory. The module `meaning` of `cycle-bound` defines the format.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::record::{Block, End, Id, Op, Port, Record, Test, ValueKind};

/// Returns the text of a function. `input` and `result` return the location of a port, `r1+44` or `s0`; a result can
/// have several. Inputs and results without a location are left out. `more` are additional lines of the head: `known`,
/// `pad`.
pub fn text(
    function: &str,
    record: &Record,
    input: &dyn Fn(&Port) -> Option<String>,
    result: &dyn Fn(&Port) -> Vec<String>,
    more: &str,
) -> String {
    let mut text = Text { record, out: format!("means 1\nfunction {function}\n{more}"), results: Vec::new() };
    for port in &record.inputs {
        if let Some(place) = input(port) {
            text.port("in", port, &place);
        }
    }
    for (at, port) in record.results.iter().enumerate() {
        for place in result(port) {
            text.port("out", port, &place);
            text.results.push(at);
        }
    }
    text.out.push_str("begin\n");
    let mut needed = BTreeSet::new();
    text.needs(&record.body, &mut needed);
    for id in needed {
        match record.value(id).op {
            Op::Constant(number) => text.line(id, &format!("number {:#010x}", (number as f32).to_bits())),
            Op::CountOf(count) => text.line(id, &format!("count {count}")),
            _ => {}
        }
    }
    text.block(&record.body);
    text.out
}

struct Text<'a> {
    record: &'a Record,
    out: String,
    /// Indices of the results with a location.
    results: Vec<usize>,
}

impl Text<'_> {
    /// Writes a port. A location may contain its kind: `either r2+0 0 1`.
    fn port(&mut self, way: &str, port: &Port, place: &str) {
        let kind = match port.kind {
            _ if place.starts_with("either ") => "",
            ValueKind::Number => "number ",
            ValueKind::Count => "count ",
            ValueKind::Truth => "truth ",
        };
        let _ = writeln!(self.out, "{way} {} {kind}{place}", port.name);
    }

    fn line(&mut self, id: Id, made: &str) {
        let _ = writeln!(self.out, "{} = {made}", self.name(id));
    }

    fn name(&self, id: Id) -> String {
        match self.record.value(id).op {
            Op::Input(at) => self.record.inputs[at].name.clone(),
            Op::Truth(truth) => truth.to_string(),
            _ => format!("v{}", id.index()),
        }
    }

    /// Returns the names in a row, each after a space.
    fn names(&self, ids: impl Iterator<Item = Id>) -> String {
        ids.fold(String::new(), |names, id| names + " " + &self.name(id))
    }

    /// Collects all values that a block needs.
    fn needs(&self, block: &Block, needed: &mut BTreeSet<Id>) {
        for step in &block.steps {
            needed.extend(self.record.value(step.value).op.operands());
        }
        match &block.end {
            End::Return(results) => needed.extend(self.results.iter().map(|at| results[*at])),
            End::Branch { condition, yes, no } => {
                needed.insert(*condition);
                self.needs(yes, needed);
                self.needs(no, needed);
            }
        }
    }

    fn block(&mut self, block: &Block) {
        for step in &block.steps {
            let op = self.record.value(step.value).op;
            if let Op::CountWhole(count, of, each) = op {
                let (count, name) = (self.name(count), self.name(step.value));
                let _ = writeln!(self.out, "{name}_of = count {of}\n{name}_each = count {each}");
                let _ = writeln!(self.out, "{name}_whole = quotient {count} {name}_of");
                self.line(step.value, &format!("times {name}_whole {name}_each"));
                continue;
            }
            let (name, more) = match op {
                Op::Input(_) | Op::Constant(_) | Op::Truth(_) | Op::CountOf(_) | Op::CountWhole(..) => continue,
                Op::Neg(_) => ("neg", None),
                Op::Abs(_) => ("abs", None),
                Op::Add(..) => ("add", None),
                Op::Sub(..) => ("sub", None),
                Op::Mul(..) => ("mul", None),
                Op::Div(..) => ("div", None),
                Op::Compare(test, ..) => (comparison(test), None),
                Op::And(..) => ("and", None),
                Op::Or(..) => ("or", None),
                Op::Not(_) => ("not", None),
                Op::Select(..) => ("select", None),
                Op::CountSince(..) => ("since", None),
                Op::CountPlus(..) => ("plus", None),
                Op::CountSigned(_, bits) => ("signed", Some(bits)),
                Op::NumberOf(_) => ("number_of", None),
            };
            let operands = self.names(op.operands());
            let more = more.map_or(String::new(), |bits| format!(" {bits}"));
            self.line(step.value, &format!("{name}{operands}{more}"));
        }
        match &block.end {
            End::Return(results) => {
                let names = self.names(self.results.iter().map(|at| results[*at]));
                let _ = writeln!(self.out, "return{names}");
            }
            End::Branch { condition, yes, no } => {
                let _ = writeln!(self.out, "if {}", self.name(*condition));
                self.block(yes);
                self.out.push_str("else\n");
                self.block(no);
                self.out.push_str("end\n");
            }
        }
    }
}

fn comparison(test: Test) -> &'static str {
    match test {
        Test::Less => "less",
        Test::LessOrEqual => "less_equal",
        Test::Greater => "greater",
        Test::GreaterOrEqual => "greater_equal",
        Test::Equal => "equal",
        Test::NotEqual => "not_equal",
    }
}
