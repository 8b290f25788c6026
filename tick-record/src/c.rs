//! Writes a trace as the body of a C99 function, which is valid C++11 too.
//!
//! Each line is one statement. A named value becomes a constant of that name; a sum that grows under one name becomes a
//! variable. A value without a name that is used once is written in place, in parentheses. Constants are declared in
//! the function that uses them, as decimals that give the number exactly. The order of the operations and every
//! rounding are kept from the trace. Two constructs are written differently, with an equal result for every bit
//! pattern: |a| <= b is `a >= -b && a <= b`, and a state word that rarely changes is assigned under `if`.
//!
//! C must not contract operations, use excess precision or reorder. The surrounding file ensures this.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::fmt::Write as _;

use crate::record::{Block, End, Id, Op, Port, Record, Role, Step, Test, Value, ValueKind};

/// A trace and the rules for writing it.
pub struct Function<'a> {
    /// The trace.
    pub record: &'a Record,
    /// Returns the expression of an input or a result: `state->a2`, `x[0]`, `output->u`. For a flag it returns the
    /// value as an unsigned constant. Not called for the answer.
    pub place: &'a dyn Fn(&Port) -> String,
    /// Returns the comment for a constant of this name; empty for none.
    pub meaning: &'a dyn Fn(&str) -> String,
    /// Selects `double` instead of `float`.
    pub double: bool,
    /// Name of the function that [`signed`] defines.
    pub signed: &'a str,
}

/// Returns a C function that converts a 32-bit count to a signed number (two's complement). A conversion to `int32_t`
/// is implementation-defined; compilers translate this function to no code.
pub fn signed(name: &str) -> String {
    format!(
        "static inline int32_t {name}(uint32_t count)
{{
    const uint32_t below = 0xffffffffu - count;
    return (count < 0x80000000u) ? (int32_t)count : (-(int32_t)below - 1);
}}
"
    )
}

impl Function<'_> {
    /// Returns the statements between the braces of the function, indented by four.
    ///
    /// Flags are returned as `unsigned`; without flags the answer is returned as `bool`.
    pub fn body(&self) -> String {
        let mut text = Text::new(self);
        text.block(&self.record.body, 1);
        let mut out = String::new();
        let t = self.number_type();
        for (name, number) in text.constants.values() {
            let meaning = (self.meaning)(name);
            let comment = if meaning.is_empty() { String::new() } else { format!(" /* {meaning} */") };
            let _ = writeln!(out, "    static const {t} {name} = {};{comment}", decimal(*number, self.double));
        }
        for (at, port) in self.record.inputs.iter().enumerate() {
            if text.samples.contains(&at) {
                let t = self.type_of(port.kind);
                let _ = writeln!(out, "    const {t} {} = {};", port.name, (self.place)(port));
            }
        }
        out + &text.lines
    }

    fn number_type(&self) -> &'static str {
        if self.double { "double" } else { "float" }
    }

    fn type_of(&self, kind: ValueKind) -> &'static str {
        match kind {
            ValueKind::Number => self.number_type(),
            ValueKind::Truth => "bool",
            ValueKind::Count => "uint32_t",
        }
    }
}

/// Returns a number, rounded to the precision, as a C decimal that gives it exactly. The result is exact whether a
/// compiler reads it directly or as a double first.
///
/// # Panics
/// If the number is not finite.
pub fn decimal(number: f64, double: bool) -> String {
    assert!(number.is_finite(), "{number} cannot be written in C");
    if double {
        return format!("{number:?}");
    }
    let single = number as f32;
    // The short form if it is exact; otherwise the nine digits that identify every f32.
    let short = format!("{single:?}");
    let text = if short.parse() == Ok(f64::from(single)) { short } else { format!("{single:.8e}") };
    let read: [f32; 2] = [text.parse().expect("a decimal"), text.parse::<f64>().expect("a decimal") as f32];
    assert!(read.iter().all(|read| read.to_bits() == single.to_bits()), "{text} is not {single:?}");
    text + "f"
}

/// Maximum width of a line.
const WIDTH: usize = 120;

struct Text<'a> {
    function: &'a Function<'a>,
    record: &'a Record,
    /// Number of uses of a value in the text if every operation is written once.
    uses: Vec<usize>,
    /// Names of the values that are statements.
    local: HashMap<Id, String>,
    /// Values that continue under the name of their first part: `v += ..`.
    grows: HashMap<Id, Id>,
    /// The first values of these sums.
    variable: HashSet<Id>,
    /// Constants, in the order of their first use.
    constants: BTreeMap<Id, (String, f64)>,
    samples: BTreeSet<usize>,
    section: &'static str,
    lines: String,
}

/// Binding strength of an expression.
#[derive(Clone, Copy, PartialEq)]
enum Bond {
    /// A name, a literal or a call.
    Atom,
    /// Operands with an operator between them.
    Operation,
}

impl<'a> Text<'a> {
    fn new(function: &'a Function<'a>) -> Self {
        let record = function.record;
        let mut text = Text {
            function,
            record,
            uses: vec![0; record.values.len()],
            local: HashMap::new(),
            grows: HashMap::new(),
            variable: HashSet::new(),
            constants: BTreeMap::new(),
            samples: BTreeSet::new(),
            section: "",
            lines: String::new(),
        };
        let (mut steps, mut returns) = (Vec::new(), Vec::new());
        flatten(&record.body, &mut steps, &mut returns, &mut text.uses);
        for id in &steps {
            // In |a| < b, and in a count of whole units, a is written more than once.
            let twice = usize::from(matches!(record.value(*id).op, Op::Abs(_) | Op::CountWhole(..)));
            for operand in record.value(*id).op.operands() {
                text.uses[operand.index()] += 1 + twice;
            }
        }
        // State words that change under one condition are assigned under one `if`.
        for results in &returns {
            let mut groups: HashMap<Id, usize> = HashMap::new();
            for (port, id) in record.results.iter().zip(results.iter()) {
                if let Op::Select(c, a, b) = record.value(*id).op
                    && port.role == Role::State
                    && text.uses[id.index()] == 1
                    && [a, b].iter().any(|part| text.is_own(*part, port))
                {
                    *groups.entry(c).or_default() += 1;
                }
            }
            for (c, selects) in groups {
                text.uses[c.index()] -= selects - 1;
            }
        }
        text.names(&steps, &returns);
        text
    }

    fn op(&self, id: Id) -> Op {
        self.record.value(id).op
    }

    /// Returns whether the value is the input word of this result.
    fn is_own(&self, id: Id, port: &Port) -> bool {
        port.role == Role::State && matches!(self.op(id), Op::Input(at) if self.record.inputs[at].name == port.name)
    }

    /// Returns the values that are statements, with the names that they request.
    fn wanted(&self, steps: &[Id], returns: &[&[Id]]) -> HashMap<Id, String> {
        let named = |id: &Id| Some((*id, self.record.value(*id).name.clone()?));
        let mut wanted: HashMap<Id, String> = steps.iter().filter_map(named).collect();
        // A select takes over the name of its operand if no other value requests that name.
        for &id in steps {
            if let (Op::Select(_, a, b), false) = (self.op(id), wanted.contains_key(&id)) {
                let mut parts = [a, b].into_iter().filter(|part| self.uses[part.index()] == 1);
                if let Some(name) = parts.find_map(|part| wanted.remove(&part)) {
                    wanted.insert(id, name);
                }
            }
        }
        // A value that is used more than once needs a name: the name of a result, or any name.
        for &id in steps {
            let light = match self.op(id) {
                Op::Abs(_) => true,
                Op::Neg(a) => matches!(self.op(a), Op::Constant(_)),
                _ => false,
            };
            if self.uses[id.index()] > 1 && !light && !wanted.contains_key(&id) {
                let name = match (self.given_as(id, returns), self.record.kind(id)) {
                    (Some(port), _) => port.name.clone(),
                    (None, ValueKind::Truth) => "holds".into(),
                    (None, _) => "part".into(),
                };
                wanted.insert(id, name);
            }
        }
        wanted
    }

    /// Returns the result that a value is, or becomes under a condition.
    fn given_as(&self, id: Id, returns: &[&[Id]]) -> Option<&'a Port> {
        let gives = |port: &Port, result: Id| {
            let selected = match self.op(result) {
                Op::Select(_, a, b) => (a == id && self.is_own(b, port)) || (b == id && self.is_own(a, port)),
                _ => false,
            };
            result == id || selected
        };
        let mut results = returns.iter().flat_map(|results| self.record.results.iter().zip(results.iter()));
        results.find(|(port, result)| gives(port, **result)).map(|(port, _)| port)
    }

    /// Gives every statement a unique name.
    fn names(&mut self, steps: &[Id], returns: &[&[Id]]) {
        let wanted = self.wanted(steps, returns);
        // A state word is never written by its bare name.
        let bare = |value: &&Value| match value.op {
            Op::Input(at) => self.record.inputs[at].role != Role::State,
            Op::Constant(_) => true,
            _ => false,
        };
        let known = self.record.values.iter().filter(bare).filter_map(|value| value.name.clone());
        let parameters = ["state", "x", "sample", "between", "output", "estimates", "d_hat"].map(String::from);
        let mut taken: HashSet<String> = known.chain(parameters).collect();
        for &id in steps {
            let Some(name) = wanted.get(&id) else { continue };
            if self.local.contains_key(&id) {
                continue;
            }
            if let Op::Add(from, _) | Op::Sub(from, _) = self.op(id)
                && wanted.get(&from) == Some(name)
                && self.uses[from.index()] == 1
            {
                self.grows.insert(id, from);
                let mut first = from;
                while let Some(before) = self.grows.get(&first) {
                    first = *before;
                }
                self.variable.insert(first);
                let name = self.local[&from].clone();
                self.local.insert(id, name);
                continue;
            }
            let mut unique = name.clone();
            let mut count = 1;
            while taken.contains(&unique) {
                count += 1;
                unique = format!("{name}_{count}");
            }
            taken.insert(unique.clone());
            self.local.insert(id, unique);
        }
    }

    /// Writes a statement. A long statement is broken where its parentheses are fewest.
    fn line(&mut self, depth: usize, text: &str) {
        let (mut rest, mut indent) = (text, 4 * depth);
        while indent + rest.len() > WIDTH {
            let mut parentheses = 0_usize;
            let mut best: Option<(usize, usize)> = None;
            for (at, c) in rest.char_indices().take_while(|(at, _)| indent + at < WIDTH) {
                match c {
                    '(' => parentheses += 1,
                    ')' => parentheses = parentheses.saturating_sub(1),
                    ' ' if best.is_none_or(|(least, _)| parentheses <= least)
                        && ["&& ", "|| ", "| ", "? ", ": ", "+ ", "- "]
                            .iter()
                            .any(|s| rest[at + 1..].starts_with(s)) =>
                    {
                        best = Some((parentheses, at));
                    }
                    _ => {}
                }
            }
            let Some((_, at)) = best else { break };
            let _ = writeln!(self.lines, "{:indent$}{}", "", &rest[..at]);
            (rest, indent) = (&rest[at + 1..], 4 * depth + 8);
        }
        let _ = writeln!(self.lines, "{:indent$}{rest}", "");
    }

    fn block(&mut self, block: &Block, depth: usize) {
        for Step { value, section } in &block.steps {
            if let Some(name) = self.local.get(value).cloned() {
                if *section != self.section {
                    self.section = section;
                    if !section.is_empty() {
                        self.lines.push_str(if self.lines.ends_with("{\n") { "" } else { "\n" });
                        self.line(depth, &format!("/* {section} */"));
                    }
                }
                self.statement(*value, &name, depth);
            }
        }
        match &block.end {
            End::Return(results) => self.give(results, depth),
            End::Branch { condition, yes, no } => {
                // The exceptional case goes inside, unless that is much longer.
                let negated = length(no) <= 2 * length(yes);
                let (inside, on) = if negated { (no, yes) } else { (yes, no) };
                let condition = self.condition(*condition, negated);
                self.line(depth, &format!("if ({condition}) {{"));
                let section = self.section;
                self.block(inside, depth + 1);
                self.section = section;
                self.line(depth, "}");
                self.block(on, depth);
            }
        }
    }

    fn statement(&mut self, id: Id, name: &str, depth: usize) {
        if let Some(from) = self.grows.get(&id).copied() {
            debug_assert_eq!(self.local[&from], name);
            let (sign, part) = match self.op(id) {
                Op::Add(_, part) => ("+", part),
                Op::Sub(_, part) => ("-", part),
                other => unreachable!("{other:?} does not grow"),
            };
            let part = self.shown(part);
            self.line(depth, &format!("{name} {sign}= {part};"));
            return;
        }
        let constant = if self.variable.contains(&id) { "" } else { "const " };
        let t = self.function.type_of(self.record.kind(id));
        let text = self.made(id).0;
        self.line(depth, &format!("{constant}{t} {name} = {text};"));
    }

    /// Writes the results, the state last, since the values computed here may still read the state.
    fn give(&mut self, results: &[Id], depth: usize) {
        let record = self.record;
        let given = || record.results.iter().zip(results.iter().copied());
        let changes: Vec<(&Port, Id)> =
            given().filter(|(port, id)| port.role == Role::State && !self.is_own(*id, port)).collect();
        let flags: Vec<(&Port, Id)> = given().filter(|(port, _)| matches!(port.role, Role::Flag(_))).collect();
        let answer = given().find(|(port, _)| port.role == Role::Answer).map(|(_, id)| id);
        let mut returned = self.returned(&flags, answer);
        let goes_out = |port: &Port| matches!(port.role, Role::Between | Role::Output | Role::Estimate(..));
        for (port, id) in given().filter(|(port, _)| goes_out(port)) {
            let place = (self.function.place)(port);
            let value = if port.kind == ValueKind::Count { self.signed(id) } else { self.shown(id) };
            self.line(depth, &format!("{place} = {value};"));
        }

        // A value that reads a word assigned earlier gets a name first.
        let changed: HashSet<&str> = changes.iter().map(|(port, _)| port.name.as_str()).collect();
        let mut answers = flags.iter().map(|(_, id)| *id).chain(answer);
        if answers.any(|id| self.reads(id).iter().any(|name| changed.contains(name.as_str()))) {
            let text = returned.take().expect("there is an answer");
            let t = if flags.is_empty() { "bool" } else { "unsigned" };
            self.line(depth, &format!("const {t} answer = {text};"));
            returned = Some("answer".into());
        }
        let groups = self.groups(changes);
        let late = self.late(&groups);
        for (k, id) in late.iter().enumerate() {
            let (t, name) = (self.function.type_of(self.record.kind(*id)), format!("next_{}", k + 1));
            let value = self.shown(*id);
            self.line(depth, &format!("const {t} {name} = {value};"));
            self.local.insert(*id, name);
        }
        for group in groups {
            self.assign(group, depth);
        }
        for id in late {
            self.local.remove(&id);
        }
        if let Some(returned) = returned {
            self.line(depth, &format!("return {returned};"));
        } else if depth > 1 {
            // On the exit of an `if`, the following statements are on another path.
            self.line(depth, "return;");
        }
    }

    /// Returns the flags as a sum of bits, or the answer.
    fn returned(&mut self, flags: &[(&Port, Id)], answer: Option<Id>) -> Option<String> {
        if flags.is_empty() {
            return answer.map(|id| self.shown(id));
        }
        let parts: Vec<String> = flags.iter().filter_map(|(port, id)| self.flag(port, *id)).collect();
        Some(match &parts[..] {
            [] => "0u".into(),
            [one] => one.clone(),
            many => many.iter().map(|part| format!("({part})")).collect::<Vec<_>>().join(" | "),
        })
    }

    /// Groups the state words by the condition under which they change.
    fn groups<'p>(&self, changes: Vec<(&'p Port, Id)>) -> Vec<Group<'p>> {
        let mut groups: Vec<Group<'p>> = Vec::new();
        for (port, id) in changes {
            let own = |id| self.is_own(id, port);
            let (condition, value) = match self.op(id) {
                _ if self.local.contains_key(&id) => (None, id),
                Op::Select(c, a, b) if own(b) => (Some((c, false)), a),
                Op::Select(c, a, b) if own(a) => (Some((c, true)), b),
                Op::Or(own_one, c) | Op::Or(c, own_one) if own(own_one) => (Some((c, false)), TRUE),
                Op::And(own_one, c) | Op::And(c, own_one) if own(own_one) => match self.op(c) {
                    Op::Not(c) => (Some((c, false)), FALSE),
                    _ => (Some((c, true)), FALSE),
                },
                _ => (None, id),
            };
            match groups.iter_mut().find(|(of, _)| *of == condition && condition.is_some()) {
                Some((_, group)) => group.push((port, value)),
                None => groups.push((condition, vec![(port, value)])),
            }
        }
        groups.sort_by_key(|(condition, _)| condition.is_none());
        groups
    }

    /// Returns the values that depend on a word assigned earlier.
    fn late(&self, groups: &[Group<'_>]) -> Vec<Id> {
        let (mut assigned, mut late) = (HashSet::new(), Vec::new());
        for (condition, group) in groups {
            let condition = condition.iter().map(|(id, _)| (None, *id));
            for (port, id) in condition.chain(group.iter().map(|(port, id)| (Some(*port), *id))) {
                if ![TRUE, FALSE].contains(&id) && self.reads(id).iter().any(|name| assigned.contains(name)) {
                    late.push(id);
                }
                assigned.extend(port.map(|port| port.name.clone()));
            }
        }
        late
    }

    /// Assigns the words of one group under their condition.
    fn assign(&mut self, (condition, group): Group<'_>, depth: usize) {
        let inside = depth + usize::from(condition.is_some());
        if let Some((condition, negated)) = condition {
            let condition = self.condition(condition, negated);
            self.line(depth, &format!("if ({condition}) {{"));
        }
        for (port, id) in group {
            let value = match id {
                TRUE => "true".into(),
                FALSE => "false".into(),
                _ => self.shown(id),
            };
            let place = (self.function.place)(port);
            self.line(inside, &format!("{place} = {value};"));
        }
        if condition.is_some() {
            self.line(depth, "}");
        }
    }

    /// Returns a count as a signed number.
    fn signed(&mut self, id: Id) -> String {
        if let Op::CountOf(count) = self.op(id) {
            return (count as i32).to_string();
        }
        format!("{}({})", self.function.signed, self.shown(id))
    }

    fn flag(&mut self, port: &Port, id: Id) -> Option<String> {
        let value = (self.function.place)(port);
        match self.op(id) {
            Op::Truth(false) => None,
            Op::Truth(true) => Some(format!("(unsigned){value}")),
            _ => Some(format!("{} ? (unsigned){value} : 0u", self.part(id))),
        }
    }

    /// Returns the state words that an expression reads in place.
    fn reads(&self, id: Id) -> BTreeSet<String> {
        match self.op(id) {
            _ if self.local.contains_key(&id) => BTreeSet::new(),
            Op::Input(at) if self.record.inputs[at].role == Role::State => {
                [self.record.inputs[at].name.clone()].into_iter().collect()
            }
            op => op.operands().flat_map(|operand| self.reads(operand)).collect(),
        }
    }

    fn condition(&mut self, id: Id, negated: bool) -> String {
        if negated { format!("!{}", parenthesised(self.shown_with_bond(id))) } else { self.shown(id) }
    }

    /// Returns the text of a value at its use.
    fn shown(&mut self, id: Id) -> String {
        self.shown_with_bond(id).0
    }

    /// Returns the text of a value as an operand.
    fn part(&mut self, id: Id) -> String {
        parenthesised(self.shown_with_bond(id))
    }

    fn shown_with_bond(&mut self, id: Id) -> (String, Bond) {
        match self.local.get(&id) {
            Some(name) => (name.clone(), Bond::Atom),
            None => self.made(id),
        }
    }

    /// Returns the expression that computes a value.
    fn made(&mut self, id: Id) -> (String, Bond) {
        let binary =
            |text: &mut Self, sign: &str, a, b| (format!("{} {sign} {}", text.part(a), text.part(b)), Bond::Operation);
        match self.op(id) {
            Op::Input(at) => {
                let port = &self.record.inputs[at];
                if let Role::Sample(_) = port.role {
                    self.samples.insert(at);
                    return (port.name.clone(), Bond::Atom);
                }
                ((self.function.place)(port), Bond::Atom)
            }
            Op::Constant(number) => {
                if let Some(name) = &self.record.value(id).name {
                    self.constants.insert(id, (name.clone(), number));
                    return (name.clone(), Bond::Atom);
                }
                let bond = if number.is_sign_negative() { Bond::Operation } else { Bond::Atom };
                (decimal(number, self.function.double), bond)
            }
            Op::Truth(truth) => (truth.to_string(), Bond::Atom),
            Op::CountOf(count) => (format!("{count}u"), Bond::Atom),
            Op::Neg(a) => (format!("-{}", self.part(a)), Bond::Operation),
            Op::Abs(a) => {
                let zero = decimal(0.0, self.function.double);
                let a = self.part(a);
                // For -0 the sum is +0, as required.
                (format!("({a} < {zero}) ? (-{a}) : ({a} + {zero})"), Bond::Operation)
            }
            Op::Add(a, b) | Op::CountPlus(a, b) => binary(self, "+", a, b),
            Op::Sub(a, b) | Op::CountSince(a, b) => binary(self, "-", a, b),
            Op::Mul(a, b) => binary(self, "*", a, b),
            Op::Div(a, b) => binary(self, "/", a, b),
            Op::Compare(test, a, b) => (self.comparison(test, a, b), Bond::Operation),
            Op::And(..) | Op::Or(..) => {
                let (sign, mut parts) = (if matches!(self.op(id), Op::And(..)) { " && " } else { " || " }, Vec::new());
                self.chain(id, self.op(id), &mut parts);
                let parts: Vec<String> = parts.into_iter().map(|part| self.part(part)).collect();
                (parts.join(sign), Bond::Operation)
            }
            Op::Not(a) => (format!("!{}", self.part(a)), Bond::Operation),
            Op::Select(c, a, b) => (format!("{} ? {} : {}", self.part(c), self.part(a), self.part(b)), Bond::Operation),
            Op::CountSigned(a, bits) => {
                assert!((1..=32).contains(&bits), "a count has 1 to 32 bits");
                let (mask, sign) = (u32::MAX >> (32 - bits), 1_u32 << (bits - 1));
                (format!("(({} & {mask:#x}u) ^ {sign:#x}u) - {sign:#x}u", self.part(a)), Bond::Operation)
            }
            Op::CountWhole(a, of, each) => {
                let a = self.part(a);
                let whole = |count: &str| format!("(({count} / {of}u) * {each}u)");
                let below = whole(&format!("(0u - {a})"));
                (format!("({a} < 0x80000000u) ? {} : (0u - {below})", whole(&a)), Bond::Operation)
            }
            Op::NumberOf(a) => (format!("({}){}", self.function.number_type(), self.signed(a)), Bond::Atom),
        }
    }

    /// Collects the parts of `a && b && ..`, or of `a || b || ..`.
    fn chain(&self, id: Id, like: Op, parts: &mut Vec<Id>) {
        match (self.op(id), like) {
            (Op::And(a, b), Op::And(..)) | (Op::Or(a, b), Op::Or(..))
                if self.op(id) == like || !self.local.contains_key(&id) =>
            {
                self.chain(a, like, parts);
                self.chain(b, like, parts);
            }
            _ => parts.push(id),
        }
    }

    fn comparison(&mut self, test: Test, a: Id, b: Id) -> String {
        if let (Op::Abs(inner), false) = (self.op(a), self.local.contains_key(&a)) {
            let (inner, limit) = (self.part(inner), self.part(b));
            let both =
                |low: &str, and: &str, high: &str| format!("({inner} {low} (-{limit})) {and} ({inner} {high} {limit})");
            match test {
                Test::LessOrEqual => return both(">=", "&&", "<="),
                Test::Less => return both(">", "&&", "<"),
                Test::Greater => return both("<", "||", ">"),
                Test::GreaterOrEqual => return both("<=", "||", ">="),
                Test::Equal | Test::NotEqual => {}
            }
        }
        let sign = match test {
            Test::Less => "<",
            Test::LessOrEqual => "<=",
            Test::Greater => ">",
            Test::GreaterOrEqual => ">=",
            Test::Equal => "==",
            Test::NotEqual => "!=",
        };
        format!("{} {sign} {}", self.part(a), self.part(b))
    }
}

/// A condition, and whether it is negated.
type Condition = (Id, bool);
/// State words that change under one condition, with their new values.
type Group<'a> = (Option<Condition>, Vec<(&'a Port, Id)>);

/// Placeholder for "true" where a state word is set.
const TRUE: Id = Id(u32::MAX);
/// Placeholder for "false" where a state word is cleared.
const FALSE: Id = Id(u32::MAX - 1);

fn parenthesised((text, bond): (String, Bond)) -> String {
    if bond == Bond::Atom { text } else { format!("({text})") }
}

fn length(block: &Block) -> usize {
    block.steps.len()
        + match &block.end {
            End::Return(_) => 0,
            End::Branch { yes, no, .. } => length(yes) + length(no),
        }
}

/// Collects every step once, every return, and the uses by decisions and returns.
fn flatten<'a>(block: &'a Block, steps: &mut Vec<Id>, returns: &mut Vec<&'a [Id]>, uses: &mut [usize]) {
    for step in &block.steps {
        if !steps.contains(&step.value) {
            steps.push(step.value);
        }
    }
    match &block.end {
        End::Return(results) => {
            for id in results {
                uses[id.index()] += 1;
            }
            returns.push(results);
        }
        End::Branch { condition, yes, no } => {
            uses[condition.index()] += 1;
            flatten(yes, steps, returns, uses);
            flatten(no, steps, returns, uses);
        }
    }
}
