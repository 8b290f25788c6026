//! Control-flow analysis of a function and its callees: instructions, paths, cycles, stack and the properties that the
//! checks look for.
//!
//! Only paths that return count. An instruction that cannot reach a return (a panic, a trap, an endless loop) is
//! excluded from every figure and reported by the panic check. Code that the analysis cannot follow becomes a *refusal*
//! with address and reason. A function with a refused instruction has no bound.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::cycles::{self, Class, Reading, TABLE};
use crate::graph::{self, Edge, Graph, NoPath, Path};
use crate::image::{Function, Image};
use crate::instruction::{Decoder, Flow, Instruction};

/// An instruction that the analysis cannot follow, with address and reason.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Refusal {
    /// Address of the instruction that cannot be followed.
    pub(crate) address: u32,
    /// Text of the instruction, as in a listing.
    pub(crate) text: String,
    /// Reason of the refusal.
    pub(crate) reason: String,
}

/// An instruction and its outgoing control flow.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// The instruction of this node.
    pub(crate) instruction: Instruction,
    /// Target of the instruction if it is executed.
    pub(crate) flow: Flow,
    /// Targets of a table branch.
    table: Vec<u32>,
    /// Marks a tail call: a jump to another function, which returns to this function's caller.
    tail: bool,
    /// Address of the called function, and whether any of its paths returns; `None` without a call.
    called: Option<(u32, bool)>,
    refusal: Option<String>,
}

impl Node {
    /// Returns whether control can continue at the next address, after a call that returns or a failed condition.
    pub(crate) fn falls_through(&self) -> bool {
        let stays =
            matches!(self.flow, Flow::Next | Flow::Call(_) | Flow::Indirect(true) | Flow::Exception) && !self.tail;
        self.instruction.conditional || (stays && self.comes_back())
    }

    /// Returns the successor addresses within the function.
    pub(crate) fn successors(&self) -> Vec<u32> {
        let mut to = self.table.clone();
        match self.flow {
            Flow::Jump(target) if !self.tail => to.push(target),
            _ => {}
        }
        if self.falls_through() {
            to.push(self.instruction.next());
        }
        to
    }

    /// Returns whether the callee returns; true without a callee.
    fn comes_back(&self) -> bool {
        self.called.is_none_or(|(_, returns)| returns)
    }

    /// Returns whether the refused instruction might return to the caller.
    fn may_leave(&self) -> bool {
        // An unknown callee returns, if at all, to the next instruction.
        let stays = matches!(self.flow, Flow::Next | Flow::Call(_) | Flow::Indirect(true) | Flow::Exception);
        self.refusal.is_some() && (!stays || !self.falls_through() || self.instruction.open.is_some())
    }

    /// Returns whether the executed instruction returns control to the caller.
    pub(crate) fn leaves(&self) -> bool {
        self.flow == Flow::Return || (self.tail && self.comes_back())
    }

    /// Returns the address of the called function, also for a tail call.
    pub(crate) fn callee(&self) -> Option<u32> {
        match self.flow {
            Flow::Call(target) => Some(target),
            Flow::Jump(target) if self.tail => Some(target),
            _ => None,
        }
    }

    /// Returns the reason of the refusal, if the instruction is refused.
    pub(crate) fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// Returns whether the instruction is a tail call.
    pub(crate) fn is_tail(&self) -> bool {
        self.tail
    }
}

/// Analysis result of a function, as its callers use it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Summary {
    /// First address of the function.
    pub(crate) start: u32,
    /// Set if at least one path returns.
    pub(crate) returns: bool,
    /// Refusals in this function; callees keep their own.
    refusals: Vec<Refusal>,
    /// Set if neither this function nor a callee has a refusal other than an unbounded loop.
    is_followed: bool,
    /// Longest and shortest paths, if the function has a bound.
    pub(crate) paths: Option<Paths>,
    /// Maximum stack use in bytes, or the instruction that makes it unknown.
    pub(crate) stack: Option<Result<u32, Refusal>>,
    /// Called functions, including calls on paths that never return.
    calls_all: BTreeSet<u32>,
    /// Called functions that return, on paths that return.
    calls_living: BTreeSet<u32>,
    /// Instructions of the function, by address.
    pub(crate) nodes: BTreeMap<u32, Node>,
    /// First instructions of paths that never return.
    pub(crate) never_return: Vec<Refusal>,
    /// Calls and jumps out of the function.
    pub(crate) calls: Vec<Refusal>,
    /// Backward jumps.
    pub(crate) backward: Vec<Refusal>,
}

/// Extreme paths of a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paths {
    /// Path of most cycles; `None` on a core without a cycle table.
    pub(crate) bound: Option<Path>,
    /// Path of fewest cycles; `None` on a core without a cycle table.
    pub(crate) least: Option<Path>,
    /// Path of most instructions.
    pub(crate) most: Path,
    /// Path of fewest instructions.
    pub(crate) fewest: Path,
}

/// Analyser of a firmware; reads each function once.
pub(crate) struct Analyst<'a> {
    image: &'a Image,
    decoder: Decoder,
    /// Largest number of executions of each loop header, per entry of the loop.
    loops: BTreeMap<u32, u64>,
    timed: bool,
    /// Largest barrier wait (B of Table 3-1) in cycles, if the user declares one.
    barrier: Option<u64>,
    done: BTreeMap<u32, Rc<Summary>>,
    /// Functions in analysis, with the number of functions around each; detects recursion.
    open: BTreeMap<u32, usize>,
}

/// A function whose analysis is in progress.
struct Unread<'f> {
    function: &'f Function,
    decoded: BTreeMap<u32, Instruction>,
    nodes: BTreeMap<u32, Node>,
    /// Addresses still to visit.
    ahead: Vec<u32>,
}

impl<'f> Unread<'f> {
    fn new(function: &'f Function) -> Self {
        Self { function, decoded: BTreeMap::new(), nodes: BTreeMap::new(), ahead: vec![function.start] }
    }
}

impl<'a> Analyst<'a> {
    /// Creates the analyser of a firmware. With `timed` it uses the cycle table of the Cortex-M4, otherwise it counts
    /// instructions only.
    pub(crate) fn new(image: &'a Image, decoder: Decoder, loops: BTreeMap<u32, u64>, timed: bool) -> Self {
        Self { image, decoder, loops, timed, barrier: None, done: BTreeMap::new(), open: BTreeMap::new() }
    }

    /// Sets the largest wait of a barrier, in cycles. Without a value a barrier has no bound.
    #[must_use]
    pub(crate) fn with_barrier(self, cycles: Option<u64>) -> Self {
        Self { barrier: cycles, ..self }
    }

    /// Returns the cycles of an instruction without the influence of its neighbours.
    fn own(&self, one: &Instruction, taken: bool, reading: Reading) -> Result<u64, String> {
        match (self.barrier, Class::of(one)) {
            (Some(waits), Some(Class::Barrier)) if reading == Reading::Worst => {
                // An ISB waits at least for the pipeline refill.
                let least = if one.stem() == "isb" { reading.refill() } else { 0 };
                Ok(waits.max(least).saturating_add(1))
            }
            _ => cycles::own(one, taken, reading),
        }
    }

    /// Analyses a function and all its callees, innermost first. An explicit list replaces recursion, because call
    /// chains may be long.
    pub(crate) fn read(&mut self, function: &Function) -> Rc<Summary> {
        let mut around = vec![Unread::new(function)];
        while let Some(mut unread) = around.pop() {
            let function = unread.function;
            self.open.insert(function.start, around.len());
            if let Some(callee) = self.collect(&mut unread).and_then(|callee| self.image.function_at(callee)) {
                around.extend([unread, Unread::new(callee)]);
                continue;
            }
            self.open.remove(&function.start);
            refuse_tables_entered_from_the_side(&mut unread.nodes);
            refuse_blocks_entered_from_the_side(&mut unread.nodes);
            let summary = self.summarise(function, unread.nodes);
            self.done.insert(function.start, Rc::new(summary));
        }
        Rc::clone(&self.done[&function.start])
    }

    /// Returns the summaries of all functions that a function reaches, itself included.
    pub(crate) fn reached(&self, summary: &Summary) -> Vec<Rc<Summary>> {
        self.follow(summary, |one| &one.calls_all)
    }

    /// Returns all refusals on paths that return.
    pub(crate) fn refusals(&self, summary: &Summary) -> Vec<Refusal> {
        let living = self.follow(summary, |one| &one.calls_living);
        let all: BTreeSet<&Refusal> = living.iter().flat_map(|one| &one.refusals).collect();
        all.into_iter().cloned().collect()
    }

    /// Returns the reached summaries in the order of their addresses.
    fn follow(&self, summary: &Summary, calls: fn(&Summary) -> &BTreeSet<u32>) -> Vec<Rc<Summary>> {
        let mut found: BTreeMap<u32, &Rc<Summary>> = BTreeMap::new();
        let mut ahead = vec![summary.start];
        while let Some(start) = ahead.pop() {
            let Some(one) = self.done.get(&start) else { continue };
            if found.insert(start, one).is_none() {
                ahead.extend(calls(one));
            }
        }
        found.into_values().cloned().collect()
    }

    /// Collects the instructions reachable from the entry. Returns the address of a callee that must be analysed first.
    fn collect(&mut self, unread: &mut Unread<'_>) -> Option<u32> {
        while let Some(address) = unread.ahead.pop() {
            if unread.nodes.contains_key(&address) {
                continue;
            }
            if !unread.decoded.contains_key(&address) {
                let code = self.image.bytes(address).filter(|_| !self.image.is_data(address));
                let block = code.map_or_else(Vec::new, |code| self.decoder.decode(code, address));
                unread.decoded.extend(block.into_iter().map(|one| (one.address, one)));
            }
            match self.node(unread.function, address, &unread.decoded) {
                Ok(node) => {
                    unread.ahead.extend(node.successors());
                    unread.nodes.insert(address, node);
                }
                Err(callee) => {
                    unread.ahead.push(address);
                    return Some(callee);
                }
            }
        }
        None
    }

    /// Returns the instruction at an address with its control flow.
    ///
    /// # Errors
    /// The address of the callee, if its analysis is still missing.
    fn node(&self, function: &Function, address: u32, decoded: &BTreeMap<u32, Instruction>) -> Result<Node, u32> {
        let unknown = |reason: String| Node {
            instruction: Instruction::from_text(address, 2, "?", "", None),
            flow: Flow::Indirect(false),
            table: Vec::new(),
            tail: false,
            called: None,
            refusal: Some(reason),
        };
        if self.is_elsewhere(function.start, address) {
            return Ok(unknown(ambiguous(address)));
        }
        if !(function.start..function.end).contains(&address) && self.image.function_at(address).is_some() {
            return Ok(unknown("runs on into the next function".into()));
        }
        let Some(instruction) = decoded.get(&address).cloned() else {
            let reason = if self.image.is_data(address) { "data instead of code" } else { "not a known instruction" };
            return Ok(unknown(reason.into()));
        };
        let flow = instruction.flow();
        let mut node = Node { instruction, flow, table: Vec::new(), tail: false, called: None, refusal: None };
        match flow {
            Flow::Call(target) => self.call(&mut node, target)?,
            Flow::Jump(target) if target != function.start && self.image.function_at(target).is_some() => {
                node.tail = true;
                self.call(&mut node, target)?;
            }
            Flow::Indirect(true) => node.refusal = Some("a call by a register: its target is unknown".into()),
            Flow::Indirect(false) => node.refusal = Some("a jump by a register: its target is unknown".into()),
            Flow::Exception => node.refusal = Some("an exception: its handler is unknown".into()),
            Flow::Table(width) => match self.table(&node.instruction, width, decoded) {
                Ok(targets) => node.table = targets,
                Err(reason) => node.refusal = Some(reason.into()),
            },
            _ => {}
        }
        if let Some(why) = node.instruction.open {
            node.refusal = Some(why.into());
        }
        if self.timed && flow != Flow::Trap && node.refusal.is_none() {
            node.refusal = self.own(&node.instruction, false, Reading::Worst).err();
        }
        Ok(node)
    }

    /// Returns whether `address` lies in an overlay and in another section than `from`.
    fn is_elsewhere(&self, from: u32, address: u32) -> bool {
        self.image.is_overlaid(address) && !self.image.is_beside(from, address)
    }

    /// Records the call of `target` in the node.
    ///
    /// # Errors
    /// The address of the callee, if its analysis is still missing.
    fn call(&self, node: &mut Node, target: u32) -> Result<(), u32> {
        let image = self.image;
        if self.is_elsewhere(node.instruction.address, target) {
            node.refusal = Some(ambiguous(target));
        } else if let Some(at) = self.open.get(&target) {
            let name = image.function_at(target).map_or("", Function::name);
            let others = self.open.len() - at - 1;
            let way = if others == 0 { String::new() } else { format!(" via {others} more") };
            node.refusal = Some(format!("recursion: {name} calls itself{way}"));
        } else if image.function_at(target).is_some() {
            let callee = self.done.get(&target).ok_or(target)?;
            node.called = Some((target, callee.returns));
        } else {
            node.refusal = Some(format!("calls {target:#010x}, where no function of the file begins"));
        }
        Ok(())
    }

    /// Returns the summary of the called function.
    fn callee(&self, node: &Node) -> Option<&Summary> {
        self.done.get(&node.called?.0).map(Rc::as_ref)
    }

    /// Returns the targets of a table branch `tbb [pc, rN]` behind `cmp rN, #k; bhi ..`, which limits the index to 0
    /// ..= k.
    fn table(
        &self,
        one: &Instruction,
        width: u32,
        decoded: &BTreeMap<u32, Instruction>,
    ) -> Result<Vec<u32>, &'static str> {
        let unbounded = "a table branch without `cmp rN, #k; bhi` before it: the length of its table is unknown";
        let index = one.operands.first().and_then(|operand| operand.strip_prefix("[pc, "));
        let index = index.map(|rest| rest.trim_end_matches(']').trim_end_matches(", lsl #1")).ok_or(unbounded)?;
        // Only direct predecessors count; `refuse_tables_entered_from_the_side` rejects jumps in between.
        let mut before = decoded.range(..one.address).rev().map(|(_, one)| one);
        let branch = before.next().filter(|branch| branch.next() == one.address).ok_or(unbounded)?;
        let compare = before.next().filter(|compare| compare.next() == branch.address).ok_or(unbounded)?;
        let entry = |code: &[u8]| u32::from(code[0]) | if width == 2 { u32::from(code[1]) << 8 } else { 0 };
        let guarded = compare.stem() == "cmp" && compare.operands.first().is_some_and(|register| register == index);
        // A BHI to the table branch itself would pass any index.
        if !guarded || !self.is_unsigned_greater(branch) || branch.flow() == Flow::Jump(one.address) {
            return Err(unbounded);
        }
        if compare.conditional {
            return Err("a table branch whose comparison is itself conditional: the length of its table is unknown");
        }
        let last = compare.operands.get(1).and_then(|k| k.strip_prefix('#'));
        let last =
            last.and_then(|k| k.strip_prefix("0x").map_or(k.parse().ok(), |hex| u32::from_str_radix(hex, 16).ok()));
        let last = last.filter(|last| *last < 0x1_0000).ok_or(unbounded)?;
        let base = one.next();
        let bytes = self.image.bytes(base).ok_or(unbounded)?;
        let entries = bytes.chunks_exact(width as usize).take(last as usize + 1).map(entry);
        let targets: Vec<u32> = entries.map(|half| base.wrapping_add(2 * half)).collect();
        if targets.len() as u32 == last + 1 { Ok(targets) } else { Err(unbounded) }
    }

    /// Returns whether the branch is a BHI, from its bits: encodings T1 and T3 carry the condition in the instruction.
    fn is_unsigned_greater(&self, branch: &Instruction) -> bool {
        let code = self.image.bytes(branch.address).and_then(|code| code.get(..branch.size as usize));
        branch.stem() == "b"
            && match code {
                Some(&[_, high]) => high == 0xd8,
                Some(&[low, high, _, last]) => {
                    (u16::from(high) << 8 | u16::from(low)) & 0x03c0 == 0x0200 && last & 0x10 == 0
                }
                _ => false,
            }
    }

    fn summarise(&self, function: &Function, nodes: BTreeMap<u32, Node>) -> Summary {
        let alive = alive(&nodes);
        let mut summary = Summary { start: function.start, is_followed: true, ..Summary::default() };
        let told = |node: &Node, reason: &str| Refusal {
            address: node.instruction.address,
            text: node.instruction.text(),
            reason: reason.to_owned(),
        };
        for (address, node) in &nodes {
            let lives = alive.contains(address);
            if let Some(reason) = node.refusal.as_deref().filter(|_| lives) {
                summary.refusals.push(told(node, reason));
            }
            if let Some(callee) = self.callee(node) {
                summary.calls_all.insert(callee.start);
                if lives && callee.returns {
                    summary.calls_living.insert(callee.start);
                    summary.is_followed &= callee.is_followed && callee.paths.is_some();
                }
            }
            if let Some(target) = node.callee() {
                summary.calls.push(told(node, self.image.function_at(target).map_or("", Function::name)));
            } else if matches!(node.flow, Flow::Indirect(_)) && node.instruction.name != "?" {
                summary.calls.push(told(node, "by a register"));
            }
            let jumps = node.table.iter().copied().chain(match node.flow {
                Flow::Jump(target) if !node.tail => Some(target),
                _ => None,
            });
            summary.backward.extend(jumps.filter(|to| to <= address).map(|_| told(node, "jumps backwards")));
            let dead_ends = node.successors().into_iter().filter(|to| lives && !alive.contains(to));
            summary.never_return.extend(dead_ends.filter_map(|to| Some(told(nodes.get(&to)?, "never returns"))));
            if lives && !node.comes_back() {
                summary.never_return.push(told(node, "calls a function that never returns"));
            }
        }
        if !alive.contains(&function.start) {
            summary.never_return.extend(nodes.get(&function.start).map(|node| told(node, "never returns")));
        }
        summary.returns = alive.contains(&function.start);
        summary.is_followed &= summary.refusals.is_empty();
        if summary.returns && summary.is_followed {
            match self.paths(&nodes, &alive, function.start) {
                Ok(paths) => summary.paths = Some(paths),
                Err(refusal) => summary.refusals.push(refusal),
            }
            summary.stack = Some(self.stack(&nodes, &alive, function.start));
        }
        summary.nodes = nodes;
        summary
    }

    /// Returns the maximum stack use in bytes over the paths that return, callees included.
    fn stack(&self, nodes: &BTreeMap<u32, Node>, alive: &BTreeSet<u32>, start: u32) -> Result<u32, Refusal> {
        // Per instruction: the stack depth before it, and the position of the frame pointer if r7 holds one.
        let mut before: BTreeMap<u32, (i64, Option<i64>)> = [(start, (0, None))].into();
        let mut open = vec![start];
        let mut deepest = 0;
        while let Some(address) = open.pop() {
            let (node, (depth, frame)) = (&nodes[&address], before[&address]);
            let refused = |reason: &str| Refusal { address, text: node.instruction.text(), reason: reason.to_owned() };
            let Some((after, frame_after)) = node.instruction.frame_after(depth, frame) else {
                return Err(refused("the stack pointer moves by an amount outside the instruction"));
            };
            let below = match self.callee(node) {
                Some(callee) if callee.returns => match callee.stack.clone() {
                    Some(Ok(bytes)) => i64::from(bytes),
                    Some(Err(refusal)) => return Err(refusal),
                    None => return Err(refused("the stack of the called function is unknown")),
                },
                _ => 0,
            };
            deepest = deepest.max(after).max(depth + below);
            // An instruction that is not executed leaves the stack unchanged.
            let on = if node.flow == Flow::Return && node.instruction.conditional { depth } else { after };
            if node.leaves() && node.flow == Flow::Return && after != 0 {
                return Err(refused("returns with a changed stack pointer"));
            }
            for to in node.successors().into_iter().filter(|to| alive.contains(to)) {
                let frame = match before.get(&to) {
                    None => frame_after,
                    Some((known, _)) if *known != on => {
                        return Err(refused("two paths join with different stack depths"));
                    }
                    // Different positions on two joining paths: r7 is not a frame pointer.
                    Some((_, known)) if known.is_some() && *known != frame_after => None,
                    Some(_) => continue,
                };
                before.insert(to, (on, frame));
                open.push(to);
            }
        }
        u32::try_from(deepest).map_err(|_| Refusal {
            address: start,
            text: nodes[&start].instruction.text(),
            reason: format!("takes {deepest} bytes of stack, more than the address space"),
        })
    }

    fn paths(&self, nodes: &BTreeMap<u32, Node>, alive: &BTreeSet<u32>, start: u32) -> Result<Paths, Refusal> {
        // The entry is node 0; the other nodes follow in address order.
        let rest = alive.iter().copied().filter(|&address| address != start);
        let addresses: Vec<u32> = std::iter::once(start).chain(rest).collect();
        let number: BTreeMap<u32, usize> = addresses.iter().enumerate().map(|(at, &address)| (address, at)).collect();
        let build = |reading, called: fn(&Paths) -> Option<&Path>| -> Graph {
            addresses.iter().map(|address| self.edges(nodes, &number, &nodes[address], reading, called)).collect()
        };
        let bound = |header: usize| self.loops.get(&addresses[header]).copied();
        let refused = |reason: NoPath| {
            let (at, reason) = match reason {
                NoPath::Unbounded(header) => {
                    let place = self.image.place(addresses[header]);
                    (
                        header,
                        format!(
                            "a loop begins here; limit its executions per entry: --loop {:#010x}=N, {place}",
                            addresses[header]
                        ),
                    )
                }
                NoPath::Irreducible(header) => (header, "a loop with two entries: it has no bound".to_owned()),
                NoPath::NoReturn => (0, "no path reaches a return".to_owned()),
            };
            let node = &nodes[&addresses[at]];
            Refusal { address: addresses[at], text: node.instruction.text(), reason }
        };
        let most = build(Reading::Count, |paths| Some(&paths.most));
        let mut paths = Paths { most: graph::longest(&most, bound).map_err(refused)?, ..Paths::default() };
        let fewest = build(Reading::Count, |paths| Some(&paths.fewest));
        paths.fewest = graph::shortest(&fewest).map_err(refused)?;
        if self.timed {
            let worst = build(Reading::Worst, |paths| paths.bound.as_ref());
            paths.bound = Some(graph::longest(&worst, bound).map_err(refused)?);
            let least = build(Reading::Least, |paths| paths.least.as_ref());
            paths.least = Some(graph::shortest(&least).map_err(refused)?);
        }
        Ok(paths)
    }

    /// Returns the edges of a node that lead to a return, with their costs.
    fn edges(
        &self,
        nodes: &BTreeMap<u32, Node>,
        number: &BTreeMap<u32, usize>,
        node: &Node,
        reading: Reading,
        called: fn(&Paths) -> Option<&Path>,
    ) -> Vec<Edge> {
        let one = &node.instruction;
        let class = Class::of(one).map_or(TABLE.len(), |class| class as usize);
        // Only priced instructions reach this point: `node` refuses an instruction without a price.
        let price = |taken| self.own(one, taken, reading).unwrap_or(u64::MAX);
        let cost = |cycles: u64| {
            let mut path = Path { cycles, instructions: 1, ..Path::default() };
            path.classes[class] = 1;
            path
        };
        let called = self.callee(node).and_then(|callee| called(callee.paths.as_ref()?));
        let away = |cycles: u64| match called {
            Some(callee) => cost(cycles).then(callee),
            None => cost(cycles),
        };
        let mut edges = Vec::new();
        if node.leaves() {
            edges.push(Edge { to: None, cost: away(price(true)) });
        }
        let jumps = node.table.iter().chain(match &node.flow {
            Flow::Jump(target) if !node.tail => Some(target),
            _ => None,
        });
        edges.extend(jumps.filter_map(|to| Some(Edge { to: Some(*number.get(to)?), cost: cost(price(true)) })));
        let Some(&next) = number.get(&one.next()).filter(|_| node.falls_through()) else { return edges };
        let stall = nodes.get(&one.next()).map_or(0, |after| cycles::after(one, &after.instruction, reading));
        let stalled = |cycles: u64| cycles.saturating_add_signed(stall);
        if matches!(node.flow, Flow::Call(_)) && node.called.is_some() && node.comes_back() {
            edges.push(Edge { to: Some(next), cost: away(price(true)) });
        }
        let counts_as_executed = !one.conditional || reading != Reading::Least;
        if node.flow == Flow::Next && counts_as_executed {
            edges.push(Edge { to: Some(next), cost: cost(stalled(price(false))) });
        } else if one.conditional {
            // Counted as executed, except in the least. An instruction with a false condition takes one cycle (Table
            // 3-1 note c).
            edges.push(Edge { to: Some(next), cost: cost(1) });
        }
        edges
    }
}

/// Returns the predecessors of each address.
fn sources(nodes: &BTreeMap<u32, Node>) -> BTreeMap<u32, Vec<u32>> {
    let mut before: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (address, node) in nodes {
        for to in node.successors() {
            before.entry(to).or_default().push(*address);
        }
    }
    before
}

fn ambiguous(address: u32) -> String {
    format!("more than one section lies at {address:#010x}: the file does not define which one is loaded")
}

/// Refuses table branches that another path reaches without their comparison.
fn refuse_tables_entered_from_the_side(nodes: &mut BTreeMap<u32, Node>) {
    let before = sources(nodes);
    let only = |to: u32, from: u32| before.get(&to).is_none_or(|all| all.iter().all(|&one| one == from));
    let is_refused = |at: u32| {
        let mut above = nodes.range(..at).rev().map(|(&address, _)| address);
        match (above.next(), above.next()) {
            (Some(branch), Some(compare)) => !only(at, branch) || !only(branch, compare),
            _ => false,
        }
    };
    let tables = nodes.iter().filter(|(_, node)| !node.table.is_empty()).map(|(&at, _)| at);
    let refused: BTreeSet<u32> = tables.filter(|&at| is_refused(at)).collect();
    for (_, node) in nodes.iter_mut().filter(|(at, _)| refused.contains(at)) {
        node.refusal = Some("a table branch with a path around its comparison".into());
    }
}

/// Refuses instructions behind an IT that are jump targets: they would execute regardless of their condition.
fn refuse_blocks_entered_from_the_side(nodes: &mut BTreeMap<u32, Node>) {
    let before = sources(nodes);
    let mut refused = BTreeSet::new();
    for (&at, node) in nodes.iter().filter(|(_, node)| node.instruction.is_it()) {
        let mut last = (at, node.instruction.next());
        for _ in 1..node.instruction.stem().len() {
            let Some(one) = nodes.get(&last.1) else { break };
            if before.get(&last.1).is_some_and(|all| all.iter().any(|&from| from != last.0)) {
                refused.insert(last.1);
            }
            last = (last.1, one.instruction.next());
        }
    }
    for (_, node) in nodes.iter_mut().filter(|(at, _)| refused.contains(at)) {
        node.refusal = Some("a jump target behind an IT".into());
    }
}

/// Returns the instructions that can reach a return, or a refused instruction that might return.
fn alive(nodes: &BTreeMap<u32, Node>) -> BTreeSet<u32> {
    let before = sources(nodes);
    let mut alive = BTreeSet::new();
    let mut open = Vec::new();
    for (address, node) in nodes {
        if node.leaves() || node.may_leave() {
            open.push(*address);
        }
    }
    while let Some(address) = open.pop() {
        if alive.insert(address) {
            open.extend(before.get(&address).into_iter().flatten());
        }
    }
    alive
}
