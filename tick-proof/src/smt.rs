//! Translation of a trace to SMT-LIB 2: one definition per value, over IEEE 754 binary32.
//!
//! | trace | SMT-LIB |
//! |---|---|
//! | number, f32 | `Float32`; `+ - * /` are `fp.add RNE`, .. : one rounding to nearest, ties to even |
//! | NaN | the one NaN of `Float32`; its bits have no meaning in a trace either |
//! | truth | `Bool` |
//! | count | `(_ BitVec 32)`, modulo 2^32 |
//! | a decision between two blocks | `ite`; every value is total, so values that are not executed may be defined |
//!
//! Nothing is simplified, so the text of a query can be checked operation by operation.

use std::fmt::Write as _;

use tick_record::{Block, End, Id, Op, Port, Record, Test, ValueKind, Word};

/// Text of a query: declarations, definitions and assumptions.
#[derive(Clone, Default)]
pub struct Script {
    text: String,
    /// Free names with their kinds.
    free: Vec<(String, ValueKind)>,
}

/// The results of a trace within a script, as terms.
#[derive(Clone)]
pub struct Results {
    ports: Vec<Port>,
    terms: Vec<String>,
}

impl Results {
    /// Returns the term of a result.
    ///
    /// # Panics
    /// If the trace has no such result; the statement is then a programming error.
    pub fn of(&self, name: &str) -> &str {
        let at = self.ports.iter().position(|port| port.name == name);
        &self.terms[at.unwrap_or_else(|| panic!("no result `{name}`"))]
    }

    /// Returns the ports with their terms.
    pub fn iter(&self) -> impl Iterator<Item = (&Port, &str)> {
        self.ports.iter().zip(self.terms.iter().map(String::as_str))
    }
}

impl Script {
    /// Declares a free name with any bits.
    pub fn any(&mut self, name: &str, kind: ValueKind) -> String {
        let _ = writeln!(self.text, "(declare-const {name} {})", sort(kind));
        self.free.push((name.into(), kind));
        name.into()
    }

    /// Returns the free names.
    pub fn free(&self) -> &[(String, ValueKind)] {
        &self.free
    }

    /// Gives a term a name.
    pub fn define(&mut self, name: &str, kind: ValueKind, term: &str) -> String {
        let _ = writeln!(self.text, "(define-fun {name} () {} {term})", sort(kind));
        name.into()
    }

    /// Adds an assumption.
    pub fn suppose(&mut self, claim: &str) {
        let _ = writeln!(self.text, "(assert {claim})");
    }

    /// Defines the values of a trace, each under `prefix` and its position. `input` returns the input terms.
    pub fn record(
        &mut self,
        prefix: &str,
        record: &Record,
        input: &mut dyn FnMut(&mut Self, &Port) -> String,
    ) -> Results {
        let inputs: Vec<String> = record.inputs.iter().map(|port| input(self, port)).collect();
        for (at, value) in record.values.iter().enumerate() {
            let kind = kind_at(record, at);
            let term = term(value.op, &inputs, &|operand| format!("{prefix}{}", operand.index()));
            self.define(&format!("{prefix}{at}"), kind, &term);
        }
        let terms: Vec<String> = (0..record.results.len()).map(|at| ended(&record.body, prefix, at)).collect();
        let named = record
            .results
            .iter()
            .zip(&terms)
            .map(|(port, term)| self.define(&format!("{prefix}{}", port.name), port.kind, term));
        Results { ports: record.results.clone(), terms: named.collect() }
    }

    /// Returns the query for a violation of the claim: `unsat` means that the claim always holds.
    pub fn question(&self, claim: &str) -> String {
        let free: Vec<&str> = self.free.iter().map(|(name, _)| name.as_str()).collect();
        let shown = if free.is_empty() { String::new() } else { format!("(get-value ({}))\n", free.join(" ")) };
        let head = "(set-logic QF_BVFP)\n(set-option :produce-models true)\n";
        format!("{head}{}(assert (not {claim}))\n(check-sat)\n{shown}", self.text)
    }
}

/// Returns the kind of the value at a position.
fn kind_at(record: &Record, at: usize) -> ValueKind {
    match record.values[at].op {
        Op::Input(input) => record.inputs[input].kind,
        Op::Truth(_) | Op::Compare(..) | Op::And(..) | Op::Or(..) | Op::Not(_) => ValueKind::Truth,
        Op::CountOf(_) | Op::CountSince(..) | Op::CountPlus(..) | Op::CountSigned(..) | Op::CountWhole(..) => {
            ValueKind::Count
        }
        Op::Select(_, a, _) => record.kind(a),
        _ => ValueKind::Number,
    }
}

/// Returns the term of a result, from the block in which a run ends.
fn ended(block: &Block, prefix: &str, at: usize) -> String {
    match &block.end {
        End::Return(results) => format!("{prefix}{}", results[at].index()),
        End::Branch { condition, yes, no } => {
            let (yes, no) = (ended(yes, prefix, at), ended(no, prefix, at));
            if yes == no { yes } else { format!("(ite {prefix}{} {yes} {no})", condition.index()) }
        }
    }
}

fn term(op: Op, inputs: &[String], of: &dyn Fn(Id) -> String) -> String {
    let rounded = |name, a, b| format!("(fp.{name} RNE {} {})", of(a), of(b));
    match op {
        Op::Input(at) => inputs[at].clone(),
        Op::Constant(number) => self::number(number as f32),
        Op::Truth(truth) => truth.to_string(),
        Op::CountOf(count) => format!("#x{count:08x}"),
        Op::Neg(a) => format!("(fp.neg {})", of(a)),
        Op::Abs(a) => format!("(fp.abs {})", of(a)),
        Op::Add(a, b) => rounded("add", a, b),
        Op::Sub(a, b) => rounded("sub", a, b),
        Op::Mul(a, b) => rounded("mul", a, b),
        Op::Div(a, b) => rounded("div", a, b),
        Op::Compare(test, a, b) => {
            let (a, b) = (of(a), of(b));
            match test {
                Test::Less => format!("(fp.lt {a} {b})"),
                Test::LessOrEqual => format!("(fp.leq {a} {b})"),
                Test::Greater => format!("(fp.gt {a} {b})"),
                Test::GreaterOrEqual => format!("(fp.geq {a} {b})"),
                Test::Equal => format!("(fp.eq {a} {b})"),
                Test::NotEqual => format!("(not (fp.eq {a} {b}))"),
            }
        }
        Op::And(a, b) => format!("(and {} {})", of(a), of(b)),
        Op::Or(a, b) => format!("(or {} {})", of(a), of(b)),
        Op::Not(a) => format!("(not {})", of(a)),
        Op::Select(condition, a, b) => format!("(ite {} {} {})", of(condition), of(a), of(b)),
        Op::CountSince(a, b) => format!("(bvsub {} {})", of(a), of(b)),
        Op::CountPlus(a, b) => format!("(bvadd {} {})", of(a), of(b)),
        Op::CountSigned(a, bits) => {
            format!("((_ sign_extend {}) ((_ extract {} 0) {}))", 32 - bits, bits - 1, of(a))
        }
        Op::CountWhole(a, whole, each) => format!("(bvmul (bvsdiv {} #x{whole:08x}) #x{each:08x})", of(a)),
        Op::NumberOf(a) => format!("((_ to_fp 8 24) RNE {})", of(a)),
    }
}

/// Returns the SMT-LIB sort of a kind.
pub const fn sort(kind: ValueKind) -> &'static str {
    match kind {
        ValueKind::Number => "Float32",
        ValueKind::Truth => "Bool",
        ValueKind::Count => "(_ BitVec 32)",
    }
}

/// Returns a number by its bits.
pub fn number(number: f32) -> String {
    let bits = number.to_bits();
    format!("(fp #b{} #b{:08b} #b{:023b})", bits >> 31, bits >> 23 & 0xff, bits & 0x7f_ffff)
}

/// Returns a value as a term.
pub fn word(word: Word<f32>) -> String {
    match word {
        Word::Number(number) => self::number(number),
        Word::Truth(truth) => truth.to_string(),
        Word::Count(count) => format!("#x{:08x}", count as u32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tick_record::{Role, record};

    /// Compares the text with a hand-written one.
    #[test]
    fn a_record_becomes_one_definition_per_value() {
        let guarded = record(|recorder| {
            let x = recorder.number("x", Role::Argument);
            let held = recorder.number("held", Role::State);
            let one = recorder.constant("one", 1.0);
            let twice = x + x;
            recorder.put("held", Role::State, if twice <= one { twice } else { held });
        });
        let mut script = Script::default();
        let results = script.record("t_", &guarded, &mut |script, port| script.any(&port.name, port.kind));
        let text = script.question(&format!("(fp.leq {} x)", results.of("held")));
        for line in [
            "(declare-const x Float32)",
            "(fp.add RNE",
            "(fp.leq ",
            "(fp #b0 #b01111111 #b00000000000000000000000)",
            "(ite ",
            "(assert (not (fp.leq t_held x)))",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
        // There is one definition per value, and one for the result.
        assert_eq!(text.matches("(define-fun ").count(), guarded.values.len() + 1);
    }

    #[test]
    fn numbers_are_written_by_their_bits() {
        assert_eq!(number(-1.5), "(fp #b1 #b01111111 #b10000000000000000000000)");
        assert_eq!(number(1e-45), "(fp #b0 #b00000000 #b00000000000000000000001)");
    }
}
