//! Joins several traces into one trace without a branch.
//!
//! Some functions have too many paths to be recorded as a whole, because the paths of one part are multiplied by the
//! paths of the next. Such a function is joined from the traces of its parts. Each part is computed once, whatever its
//! decisions are. [`record`](crate::record()) allows this, because operations have no other effect. The decisions then
//! select one of the results.

use std::collections::HashMap;

use controller_core::Health;

use crate::record::{Block, End, Id, Op, Port, Record, Role, Step, Value, ValueKind};

/// A trace under construction.
#[derive(Default)]
pub struct Joined {
    inputs: Vec<(Port, Id)>,
    values: Vec<Value>,
    steps: Vec<Id>,
}

/// The results of a part.
pub struct Given(Vec<(Port, Id)>);

impl Given {
    /// Returns the value of a result; `None` if there is no such result.
    pub fn get(&self, name: &str, role: Role) -> Option<Id> {
        self.0.iter().find(|(port, _)| port.name == name && port.role == role).map(|(_, id)| *id)
    }

    /// Returns a status flag.
    pub(crate) fn get_flag(&self, flag: Health) -> Option<Id> {
        let bit = flag.bits().trailing_zeros() as u8;
        self.0.iter().find(|(port, _)| port.role == Role::Flag(bit)).map(|(_, id)| *id)
    }

    /// Returns all results.
    pub fn all(&self) -> impl Iterator<Item = &(Port, Id)> {
        self.0.iter()
    }
}

impl Joined {
    /// Returns an input of the joined trace; repeated calls return one input.
    pub fn input(&mut self, name: &str, role: Role, kind: ValueKind) -> Id {
        let port = Port { name: name.into(), role, kind };
        if let Some((_, id)) = self.inputs.iter().find(|(known, _)| *known == port) {
            return *id;
        }
        let id = self.value(Op::Input(self.inputs.len()), Some(name.into()));
        self.inputs.push((port, id));
        id
    }

    /// Adds an operation on existing values.
    pub fn op(&mut self, op: Op) -> Id {
        let id = self.value(op, None);
        self.steps.push(id);
        id
    }

    /// Returns the second value if the first is true, otherwise the third.
    pub fn select(&mut self, condition: Id, yes: Id, no: Id) -> Id {
        if yes == no { yes } else { self.op(Op::Select(condition, yes, no)) }
    }

    /// Adds a constant.
    pub fn constant(&mut self, op: Op) -> Id {
        self.value(op, None)
    }

    fn value(&mut self, op: Op, name: Option<String>) -> Id {
        self.values.push(Value { op, name });
        Id(self.values.len() as u32 - 1)
    }

    /// Adds a part and returns its results. An input that is not `given` becomes an input of the joined trace.
    pub fn call(&mut self, part: &Record, given: &dyn Fn(&Port) -> Option<Id>) -> Given {
        let one = |port: &Port| given(port).unwrap_or_else(|| self.input(&port.name, port.role, port.kind));
        let inputs: Vec<Id> = part.inputs.iter().map(one).collect();
        let mut known: HashMap<Id, Id> = HashMap::new();
        for (value, at) in part.values.iter().zip(0..) {
            let id = match value.op {
                Op::Input(at) => inputs[at],
                Op::Constant(_) | Op::Truth(_) | Op::CountOf(_) => self.value(value.op, value.name.clone()),
                _ => continue,
            };
            known.insert(Id(at), id);
        }
        let results = self.block(part, &part.body, &mut known);
        Given(part.results.iter().cloned().zip(results).collect())
    }

    fn block(&mut self, part: &Record, block: &Block, known: &mut HashMap<Id, Id>) -> Vec<Id> {
        for step in &block.steps {
            if !known.contains_key(&step.value) {
                let Value { op, name } = part.value(step.value);
                let id = self.value(op.map(|operand| known[&operand]), name.clone());
                self.steps.push(id);
                known.insert(step.value, id);
            }
        }
        match &block.end {
            End::Return(results) => results.iter().map(|id| known[id]).collect(),
            End::Branch { condition, yes, no } => {
                let (yes, no) = (self.block(part, yes, known), self.block(part, no, known));
                let condition = known[condition];
                yes.into_iter().zip(no).map(|(yes, no)| self.select(condition, yes, no)).collect()
            }
        }
    }

    /// Returns the joined trace with these results.
    pub fn record(self, results: Vec<(Port, Id)>) -> Record {
        let Self { inputs, values, mut steps } = self;
        let mut needed = vec![false; values.len()];
        let (results, ids): (Vec<Port>, Vec<Id>) = results.into_iter().unzip();
        for id in &ids {
            needed[id.index()] = true;
        }
        for at in (0..values.len()).rev() {
            if needed[at] {
                values[at].op.operands().for_each(|operand| needed[operand.index()] = true);
            }
        }
        steps.retain(|id| needed[id.index()]);
        let inputs = inputs.into_iter().map(|(port, _)| port).collect();
        let steps = steps.into_iter().map(|value| Step { value, section: "" }).collect();
        Record { inputs, results, values, body: Block { steps, end: End::Return(ids) } }
    }
}
