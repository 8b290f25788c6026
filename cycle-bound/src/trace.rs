//! Executed calls of a function, counted with the typical column of the cycle table.
//!
//! The input is an emulator log with the address of every executed instruction (QEMU:
//! `-singlestep -d exec,nochain -dfilter ADDRESS+LENGTH -D FILE`, with a range that contains the function and its
//! callees). Each step must be a possible successor of the previous instruction. A log of another firmware, or with an
//! interrupt, is therefore rejected.

use std::collections::BTreeMap;

use crate::analysis::Node;
use crate::cycles::{self, Class, Reading};
use crate::instruction::Flow;

/// An executed instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    /// Address of the executed instruction.
    pub(crate) address: u32,
    /// Typical cycles, including the interaction with the previous instruction.
    pub(crate) cycles: u64,
    /// Typical cycles, if VLDR and VSTR pipeline as LDR and STR do.
    pub(crate) pipelined: u64,
}

/// An executed call of the function.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Run {
    /// Executed instructions; an instruction with a false condition counts as one.
    pub(crate) instructions: u64,
    /// Typical cycles of the whole call.
    pub(crate) cycles: u64,
    /// Typical cycles of the whole call, if VLDR and VSTR pipeline as LDR and STR do.
    pub(crate) pipelined: u64,
    /// Float additions, subtractions, multiplications and conversions.
    pub(crate) arithmetic: u64,
    /// Executed instructions in order.
    pub(crate) steps: Vec<Step>,
}

/// Returns the addresses of a log in the order of execution.
///
/// A line is `Trace 0: HOST [BASE/ADDRESS/FLAGS/..] NAME`. The line
/// `Stopped execution of TB chain before HOST [ADDRESS] NAME` cancels the previous address, which was not executed.
pub fn addresses(log: &str) -> Vec<u32> {
    let mut executed = Vec::new();
    for line in log.lines() {
        let inside = || Some(line.split_once('[')?.1.split_once(']')?.0);
        let hex = |text: &str| u32::from_str_radix(text, 16).ok();
        if line.starts_with("Stopped execution") {
            let stopped = inside().and_then(hex);
            if stopped.is_some() && executed.last().copied() == stopped {
                executed.pop();
            }
        } else if line.starts_with("Trace ") {
            executed.extend(inside().and_then(|inside| hex(inside.split('/').nth(1)?)));
        }
    }
    executed
}

/// Returns the calls in a log of the function that begins at `start`; `nodes` holds all instructions that it reaches.
///
/// # Errors
/// A step that the function cannot make, or an instruction without a typical number.
pub(crate) fn runs(executed: &[u32], start: u32, nodes: &BTreeMap<u32, &Node>) -> Result<Vec<Run>, String> {
    let mut runs = Vec::new();
    let mut at = 0;
    while at < executed.len() {
        if executed[at] == start {
            match run(&executed[at..], nodes)? {
                Some((run, steps)) => {
                    runs.push(run);
                    at += steps;
                }
                // The log ends within a call.
                None => break,
            }
        } else {
            at += 1;
        }
    }
    Ok(runs)
}

fn run(executed: &[u32], nodes: &BTreeMap<u32, &Node>) -> Result<Option<(Run, usize)>, String> {
    let mut run = Run::default();
    // Return addresses of the open calls.
    let mut back: Vec<u32> = Vec::new();
    let mut before: Option<&Node> = None;
    for (at, address) in executed.iter().enumerate() {
        // The previous step was checked against its successors, which are all nodes.
        let Some(&node) = nodes.get(address) else { return Ok(None) };
        let one = &node.instruction;
        // The emulator restarts, and logs again, an instruction that accesses a peripheral.
        let to_itself = node.successors().contains(address) || node.callee() == Some(*address);
        if executed.get(at + 1) == Some(address) && !to_itself {
            continue;
        }
        let next = executed.get(at + 1).copied();
        let stays = next == Some(one.next()) && node.falls_through();
        let jumps = next.is_some_and(|next| node.successors().contains(&next));
        // A conditional jump or return is taken unless execution continues at the next address.
        let executed_out = !(one.conditional && stays);
        let mut taken = !matches!(node.flow, Flow::Next) && executed_out;
        let mut ends = false;
        let fine = match node.flow {
            Flow::Call(_) if executed_out => {
                back.push(one.next());
                next == node.callee()
            }
            Flow::Jump(_) if node.is_tail() && executed_out => next == node.callee(),
            Flow::Return if executed_out => {
                let to = back.pop();
                ends = to.is_none();
                ends || next == to
            }
            _ => {
                taken &= !stays || matches!(node.flow, Flow::Table(_));
                jumps
            }
        };
        let cost = |reading| {
            let own = cycles::own(one, taken, reading).map_err(|reason| format!("{address:#010x}: {reason}"))?;
            let own = if taken || matches!(node.flow, Flow::Next) { own } else { 1 };
            let beside = before.map_or(0, |before| cycles::after(&before.instruction, one, reading));
            Ok::<u64, String>(own.saturating_add_signed(beside))
        };
        run.instructions += 1;
        let step = Step { address: *address, cycles: cost(Reading::Typical)?, pipelined: cost(Reading::Pipelined)? };
        run.cycles += step.cycles;
        run.pipelined += step.pipelined;
        run.steps.push(step);
        run.arithmetic += u64::from(Class::of(one) == Some(Class::FloatArithmetic));
        if ends {
            return Ok(Some((run, at + 1)));
        }
        let Some(next) = next else { return Ok(None) };
        if !fine || !nodes.contains_key(&next) {
            let text = one.text();
            let interrupt = if nodes.contains_key(&next) { "" } else { ": an interrupt?" };
            return Err(format!(
                "{next:#010x} was executed after {address:#010x} `{text}`, which does not go there{interrupt}"
            ));
        }
        before = Some(node);
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_is_read_as_the_emulator_writes_it() {
        let log = "\
Trace 0: 0x7f0000000140 [00800400/080001e0/00000110/ff000201] tick
Trace 0: 0x7f0000000240 [00800400/080001e2/00000110/ff000201] tick
Stopped execution of TB chain before 0x7f0000000240 [080001e2] tick
Trace 0: 0x7f0000000240 [00800400/080001e2/00000110/ff000201] tick
";
        assert_eq!(addresses(log), [0x0800_01e0, 0x0800_01e2]);
        let other = "Trace 0: 0x7f [0/10/0/0] f\nStopped execution of TB chain before 0x7f [0000000c] f\n";
        assert_eq!(addresses(other), [0x10]);
        assert!(addresses("nothing\nTrace 0: bare\n").is_empty());
    }
}
