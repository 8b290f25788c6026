//! Injected faults that a reviewer might miss, each as one change of a trace. The statements must detect them.
//!
//! A statement that is still proved with a fault has no value.

use tick_record::{Block, End, Id, Op, Record, Role, Test, ValueKind};

use crate::instances::{CHAIN_WITH_FAULTS, DRIVE_WITH_FAULTS, Instance, MONITORS_WITH_FAULTS};
use crate::statement::Statement;
use crate::{Functions, claims};

/// A change, and the statement that it violates.
pub struct Fault {
    /// Description of the fault.
    pub name: &'static str,
    /// Beginning of the statement that detects the fault.
    notices: &'static str,
    instance: Instance,
    change: fn(&mut Record) -> bool,
}

/// All injected faults.
pub const FAULTS: [Fault; 7] = [
    Fault {
        name: "the guard looks at one side",
        notices: "a sample that is not finite",
        instance: CHAIN_WITH_FAULTS,
        change: one_sided,
    },
    Fault { name: "NaN passes the guard", notices: "u within", instance: CHAIN_WITH_FAULTS, change: nan_passes },
    Fault { name: "memory before the guard", notices: "every word", instance: CHAIN_WITH_FAULTS, change: early_memory },
    Fault {
        name: "u goes out without its limits",
        notices: "u within",
        instance: CHAIN_WITH_FAULTS,
        change: no_limits,
    },
    Fault {
        name: "a drive's u without its limits",
        notices: "u within",
        instance: DRIVE_WITH_FAULTS,
        change: no_limits,
    },
    Fault {
        name: "a lost sample is learned from",
        notices: "nothing is learned",
        instance: DRIVE_WITH_FAULTS,
        change: learns,
    },
    Fault {
        name: "a disturbance is not watched",
        notices: "what is too long over",
        instance: MONITORS_WITH_FAULTS,
        change: blind,
    },
];

impl Fault {
    /// Returns the statement that the fault violates. With `at_rest` the state is restricted to a started state of
    /// zeros: a counter-example is then found within a second and is valid, but a proof is not.
    ///
    /// # Errors
    /// If the change has no effect, or if no statement covers it.
    pub fn statement(&self, at_rest: bool) -> Result<Statement, String> {
        let mut functions = (self.instance.functions)();
        let broken = match &mut functions {
            Functions::Chain(all) | Functions::Measured(all) => [&mut all.tick, &mut all.running],
            Functions::Drive(all) => [&mut all.observe, &mut all.law],
            Functions::Monitors { stopping, telling, .. } => [stopping, telling],
        };
        let changed = broken.map(self.change).contains(&true);
        let noticing = claims(&functions).into_iter().find(|statement| statement.name.starts_with(self.notices));
        let mut noticing =
            noticing.filter(|_| changed).ok_or_else(|| format!("the fault \"{}\" changes nothing", self.name))?;
        if at_rest {
            noticing.questions.iter_mut().for_each(|question| question.suppose(&self::at_rest));
        }
        Ok(noticing)
    }
}

/// Returns the value of a free name in a started state of zeros. Entries of the sample and values between the parts of
/// a tick stay free.
fn at_rest(name: &str, kind: ValueKind) -> Option<&'static str> {
    let is_input = ["x", "begin", "end", "lost", "missing", "count", "other", "u", "law", "d1"];
    let given = is_input.iter().any(|start| name.starts_with(start)) && !name.ends_with("_prev");
    match kind {
        _ if given => None,
        ValueKind::Number => Some("(_ +zero 8 24)"),
        ValueKind::Truth => Some(if name == "started" { "true" } else { "false" }),
        ValueKind::Count => Some("#x00000000"),
    }
}

/// Returns the comparison with the constant of this name: its position and its operands.
fn compared_with(record: &Record, name: &str) -> Option<(usize, Id, Id)> {
    record.values.iter().enumerate().find_map(|(at, value)| match value.op {
        Op::Compare(Test::LessOrEqual, a, b) if record.value(b).name.as_deref() == Some(name) => Some((at, a, b)),
        _ => None,
    })
}

fn one_sided(record: &mut Record) -> bool {
    let Some((at, magnitude, most)) = compared_with(record, "plausible") else { return false };
    let Op::Abs(demand) = record.value(magnitude).op else { return false };
    record.values[at].op = Op::Compare(Test::LessOrEqual, demand, most);
    true
}

/// Changes `|v| <= most || ..` to `!(|v| > most)`.
fn nan_passes(record: &mut Record) -> bool {
    let Some((at, magnitude, most)) = compared_with(record, "plausible") else { return false };
    let guard = record.values.iter().enumerate().find_map(|(or, value)| match value.op {
        Op::Or(a, _) if a.index() == at => Some((or, a)),
        _ => None,
    });
    let Some((or, a)) = guard else { return false };
    record.values[at].op = Op::Compare(Test::Greater, magnitude, most);
    record.values[or].op = Op::Not(a);
    true
}

/// Stores the last entry of the sample even if the sample is lost.
fn early_memory(record: &mut Record) -> bool {
    let place = |role: &dyn Fn(&str, Role) -> bool| record.results.iter().position(|port| role(&port.name, port.role));
    let Some(word) = place(&|name, role| name.ends_with("_prev") && role == Role::State) else { return false };
    let entry = record.results[word].name.trim_end_matches("_prev").to_string();
    let Some(input) = record.input(&entry) else { return false };
    let is_entry = |id: &Id| record.value(*id).op == Op::Input(input);
    let Some(id) = record.values.iter().flat_map(|value| value.op.operands()).find(is_entry) else { return false };
    each_return(&mut record.body, &mut |results| results[word] = id);
    true
}

/// Outputs the demanded u without limits.
fn no_limits(record: &mut Record) -> bool {
    let Some(u) = record.results.iter().position(|port| port.name == "u") else { return false };
    let demand = record.values.iter().flat_map(|value| value.op.operands()).find(|id| {
        matches!(record.value(*id).name.as_deref(), Some("asked" | "demand"))
            && matches!(record.value(*id).op, Op::Sub(..) | Op::Add(..))
    });
    let Some(demand) = demand else { return false };
    each_return(&mut record.body, &mut |results| results[u] = demand);
    true
}

/// Uses a count that fits, even if it is lost.
fn learns(record: &mut Record) -> bool {
    let Some(lost) = record.inputs.iter().position(|port| port.name.starts_with("lost")) else { return false };
    let mut changed = false;
    for at in 0..record.values.len() {
        let Op::And(a, b) = record.values[at].op else { continue };
        let says_lost = |id: Id| {
            let of = if let Op::Not(of) = record.value(id).op { of } else { id };
            record.value(of).op == Op::Input(lost)
        };
        let fits = if says_lost(a) {
            b
        } else if says_lost(b) {
            a
        } else {
            continue;
        };
        record.values[at].op = Op::And(fits, fits);
        changed = true;
    }
    changed
}

/// Compares the bound with itself.
fn blind(record: &mut Record) -> bool {
    let Some((at, _, bound)) = compared_with(record, "d1_bound") else { return false };
    record.values[at].op = Op::Compare(Test::LessOrEqual, bound, bound);
    true
}

fn each_return(block: &mut Block, change: &mut dyn FnMut(&mut Vec<Id>)) {
    match &mut block.end {
        End::Return(results) => change(results),
        End::Branch { yes, no, .. } => {
            each_return(yes, change);
            each_return(no, change);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_changes_a_record_and_a_statement_is_about_it() {
        for fault in FAULTS {
            let statement = fault.statement(true).expect(fault.name);
            let free = statement.questions[0].text.contains("(_ +zero 8 24)");
            assert!(statement.name.starts_with(fault.notices) && free, "{}", fault.name);
        }
    }
}
