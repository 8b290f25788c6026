//! A function and all it calls: instructions, ways through them, cycles, stack, and what is not to be there.
//!
//! Only paths that return count. An instruction from which no return is reached (a panic, a trap, an endless loop) is
//! left out of every figure and told by the check of panics. Whatever cannot be followed is *refused*, with place and
//! reason, and a function with a refused instruction has no bound.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use crate::cycles::{self, Class, Reading, TABLE};
use crate::graph::{self, Edge, Graph, NoPath, Path};
use crate::image::{Function, Image};
use crate::instruction::{Decoder, Flow, Instruction};

/// Something that cannot be followed, where it is and why.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Refusal {
    /// Address.
    pub(crate) address: u32,
    /// The instruction there.
    pub(crate) text: String,
    /// Why.
    pub(crate) reason: String,
}

/// An instruction and the ways out of it.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// It.
    pub(crate) instruction: Instruction,
    /// Where it goes if it is executed.
    pub(crate) flow: Flow,
    /// Targets of a table branch.
    table: Vec<u32>,
    /// A jump to another function, which returns in its place.
    tail: bool,
    /// What the called function is worth; none if nothing is called.
    callee: Option<Rc<Summary>>,
    refusal: Option<String>,
}

impl Node {
    /// Is the instruction behind it executed after it, when it calls what returns?
    pub(crate) fn falls_through(&self) -> bool {
        let stays = matches!(self.flow, Flow::Next | Flow::Call(_) | Flow::Indirect(true)) && !self.tail;
        let comes_back = self.callee.as_ref().is_none_or(|callee| callee.returns);
        self.instruction.conditional || (stays && comes_back)
    }

    /// Addresses in the same function that it goes to.
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

    /// Does it give control back to the caller, if it is executed?
    pub(crate) fn leaves(&self) -> bool {
        self.flow == Flow::Return || (self.tail && self.callee.as_ref().is_none_or(|callee| callee.returns))
    }

    /// The function that it hands control to.
    pub(crate) fn callee(&self) -> Option<u32> {
        match self.flow {
            Flow::Call(target) => Some(target),
            Flow::Jump(target) if self.tail => Some(target),
            _ => None,
        }
    }

    /// Why it cannot be followed, if it cannot.
    pub(crate) fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// Does the callee return in its place?
    pub(crate) fn is_tail(&self) -> bool {
        self.tail
    }
}

/// What a function is worth to its caller.
#[derive(Clone, Debug, Default)]
pub(crate) struct Summary {
    /// First address.
    pub(crate) start: u32,
    /// Does any path return?
    pub(crate) returns: bool,
    /// What has no bound.
    pub(crate) refusals: Vec<Refusal>,
    /// Its longest and shortest paths, if it has a bound.
    pub(crate) paths: Option<Paths>,
    /// Bytes of stack at most, or where it cannot be told.
    pub(crate) stack: Option<Result<u32, Refusal>>,
    /// Functions reached, itself included, paths that never return too.
    pub(crate) reached: BTreeSet<u32>,
    /// Its instructions.
    pub(crate) nodes: BTreeMap<u32, Node>,
    /// First instructions of ways that never return, with what they do.
    pub(crate) never_return: Vec<Refusal>,
    /// Calls and jumps out of the function.
    pub(crate) calls: Vec<Refusal>,
    /// Jumps to where it has been.
    pub(crate) backward: Vec<Refusal>,
}

/// The paths of a function.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paths {
    /// Most cycles; none on a core without a table.
    pub(crate) bound: Option<Path>,
    /// Fewest cycles; none on a core without a table.
    pub(crate) best: Option<Path>,
    /// Most instructions.
    pub(crate) most: Path,
    /// Fewest instructions.
    pub(crate) fewest: Path,
}

/// Reads functions, each once.
pub(crate) struct Analyst<'a> {
    image: &'a Image,
    decoder: Decoder,
    /// Header of a loop to how often it is executed at most per entry.
    loops: BTreeMap<u32, u64>,
    timed: bool,
    /// B of Table 3-1 at most, if the user vouches for it.
    barrier: Option<u64>,
    done: BTreeMap<u32, Rc<Summary>>,
    /// Functions being read, the outermost first.
    open: Vec<u32>,
}

impl<'a> Analyst<'a> {
    /// For the code of an image; `timed`: with the table of the Cortex-M4, otherwise instructions are counted.
    pub(crate) fn new(image: &'a Image, decoder: Decoder, loops: BTreeMap<u32, u64>, timed: bool) -> Self {
        Self { image, decoder, loops, timed, barrier: None, done: BTreeMap::new(), open: Vec::new() }
    }

    /// With this for the cycles that a barrier waits at most; otherwise a barrier has no bound.
    #[must_use]
    pub(crate) fn with_barrier(self, cycles: Option<u64>) -> Self {
        Self { barrier: cycles, ..self }
    }

    /// Cycles of an instruction without its neighbours.
    fn own(&self, one: &Instruction, taken: bool, reading: Reading) -> Result<u64, String> {
        match (self.barrier, Class::of(one)) {
            (Some(waits), Some(Class::Barrier)) if reading == Reading::Worst => Ok(waits.saturating_add(1)),
            _ => cycles::own(one, taken, reading),
        }
    }

    /// Reads a function and all it calls.
    pub(crate) fn read(&mut self, function: &Function) -> Rc<Summary> {
        if let Some(summary) = self.done.get(&function.start) {
            return Rc::clone(summary);
        }
        self.open.push(function.start);
        let nodes = self.collect(function);
        let summary = Rc::new(self.summarise(function, nodes));
        self.open.pop();
        self.done.insert(function.start, Rc::clone(&summary));
        summary
    }

    /// Summaries of all functions that one reaches, itself included.
    pub(crate) fn reached(&self, summary: &Summary) -> Vec<Rc<Summary>> {
        summary.reached.iter().filter_map(|start| self.done.get(start).cloned()).collect()
    }

    /// Every instruction that is reached from the entry.
    fn collect(&mut self, function: &Function) -> BTreeMap<u32, Node> {
        let mut decoded: BTreeMap<u32, Instruction> = BTreeMap::new();
        let mut nodes: BTreeMap<u32, Node> = BTreeMap::new();
        let mut open = vec![function.start];
        while let Some(address) = open.pop() {
            if nodes.contains_key(&address) {
                continue;
            }
            if !decoded.contains_key(&address) {
                let code = self.image.bytes(address).filter(|_| !self.image.is_data(address));
                let block = code.map_or_else(Vec::new, |code| self.decoder.decode(code, address));
                decoded.extend(block.into_iter().map(|one| (one.address, one)));
            }
            let node = self.node(function, address, &decoded);
            open.extend(node.successors());
            nodes.insert(address, node);
        }
        refuse_tables_entered_from_the_side(&mut nodes);
        nodes
    }

    fn node(&mut self, function: &Function, address: u32, decoded: &BTreeMap<u32, Instruction>) -> Node {
        let unknown = |reason: &str| Node {
            instruction: Instruction::from_text(address, 2, "?", "", None),
            flow: Flow::Indirect(false),
            table: Vec::new(),
            tail: false,
            callee: None,
            refusal: Some(reason.to_owned()),
        };
        if !(function.start..function.end).contains(&address) && self.image.function_at(address).is_some() {
            return unknown("runs on into the next function");
        }
        let Some(instruction) = decoded.get(&address).cloned() else {
            return unknown(if self.image.is_data(address) { "data among code" } else { "no instruction known here" });
        };
        let flow = instruction.flow();
        let mut node = Node { instruction, flow, table: Vec::new(), tail: false, callee: None, refusal: None };
        match flow {
            Flow::Call(target) => self.call(&mut node, target),
            Flow::Jump(target) if target != function.start && self.image.function_at(target).is_some() => {
                node.tail = true;
                self.call(&mut node, target);
            }
            Flow::Indirect(true) => node.refusal = Some("a call by a register: its target is not known".into()),
            Flow::Indirect(false) => node.refusal = Some("a jump by a register: its target is not known".into()),
            Flow::Table(width) => match self.table(&node.instruction, width, decoded) {
                Ok(targets) => node.table = targets,
                Err(reason) => node.refusal = Some(reason),
            },
            _ => {}
        }
        if self.timed && flow != Flow::Trap && node.refusal.is_none() {
            node.refusal = self.own(&node.instruction, false, Reading::Worst).err();
        }
        node
    }

    fn call(&mut self, node: &mut Node, target: u32) {
        let image = self.image;
        if let Some(at) = self.open.iter().position(|&start| start == target) {
            let name = image.function_at(target).map_or("", Function::name);
            let others = self.open.len() - at - 1;
            let way = if others == 0 { String::new() } else { format!(" by way of {others} more") };
            node.refusal = Some(format!("recursion: {name} calls itself{way}"));
        } else if let Some(callee) = image.function_at(target) {
            node.callee = Some(self.read(callee));
        } else {
            node.refusal = Some(format!("calls {target:#010x}, where no function of the file begins"));
        }
    }

    /// Targets of a table branch `tbb [pc, rN]` behind `cmp rN, #k; bhi ..`, which leaves 0 ..= k.
    fn table(&self, one: &Instruction, width: u32, decoded: &BTreeMap<u32, Instruction>) -> Result<Vec<u32>, String> {
        let unbounded =
            || "a table branch without `cmp rN, #k; bhi` before it: its table has no known length".to_owned();
        let index = one.operands.first().and_then(|operand| operand.strip_prefix("[pc, "));
        let index = index.map(|rest| rest.trim_end_matches(']').trim_end_matches(", lsl #1")).ok_or_else(unbounded)?;
        // Straight up: a jump in between would be seen as a node that is not the one before the next.
        let mut before = decoded.range(..one.address).rev().map(|(_, one)| one);
        let branch = before.next().filter(|branch| branch.next() == one.address).ok_or_else(unbounded)?;
        let compare = before.next().filter(|compare| compare.next() == branch.address).ok_or_else(unbounded)?;
        let entry = |code: &[u8]| u32::from(code[0]) | if width == 2 { u32::from(code[1]) << 8 } else { 0 };
        let guarded = compare.stem() == "cmp" && compare.operands.first().is_some_and(|register| register == index);
        if !guarded || !self.is_unsigned_greater(branch) {
            return Err(unbounded());
        }
        let last = compare.operands.get(1).and_then(|k| k.strip_prefix('#'));
        let last =
            last.and_then(|k| k.strip_prefix("0x").map_or(k.parse().ok(), |hex| u32::from_str_radix(hex, 16).ok()));
        let last = last.filter(|last| *last < 0x1_0000).ok_or_else(unbounded)?;
        let base = one.next();
        let bytes = self.image.bytes(base).ok_or_else(unbounded)?;
        let entries = bytes.chunks_exact(width as usize).take(last as usize + 1).map(entry);
        let targets: Vec<u32> = entries.map(|half| base.wrapping_add(2 * half)).collect();
        if targets.len() as u32 == last + 1 { Ok(targets) } else { Err(unbounded()) }
    }

    /// BHI, in either width, by its bits.
    fn is_unsigned_greater(&self, branch: &Instruction) -> bool {
        let Some(code) = self.image.bytes(branch.address) else { return false };
        let half = |at: usize| u16::from(code[at]) | u16::from(code[at + 1]) << 8;
        branch.stem() == "b"
            && branch.conditional
            && if branch.size == 2 { half(0) >> 8 == 0xd8 } else { half(0) & 0x03c0 == 0x0200 }
    }

    fn summarise(&self, function: &Function, nodes: BTreeMap<u32, Node>) -> Summary {
        let alive = alive(&nodes);
        let mut summary = Summary { start: function.start, reached: [function.start].into(), ..Summary::default() };
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
            if let Some(callee) = &node.callee {
                summary.reached.extend(&callee.reached);
                if lives && callee.returns {
                    summary.refusals.extend(callee.refusals.iter().cloned());
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
            summary.backward.extend(jumps.filter(|to| to <= address).map(|_| told(node, "goes back")));
            let dead_ends = node.successors().into_iter().filter(|to| lives && !alive.contains(to));
            summary.never_return.extend(dead_ends.filter_map(|to| Some(told(nodes.get(&to)?, "never returns"))));
            if lives && node.callee.as_ref().is_some_and(|callee| !callee.returns) {
                summary.never_return.push(told(node, "calls what never returns"));
            }
        }
        if !alive.contains(&function.start) {
            summary.never_return.extend(nodes.get(&function.start).map(|node| told(node, "never returns")));
        }
        summary.returns = alive.contains(&function.start);
        summary.refusals.sort();
        summary.refusals.dedup();
        if summary.returns && summary.refusals.is_empty() {
            match self.paths(&nodes, &alive, function.start) {
                Ok(paths) => summary.paths = Some(paths),
                Err(refusal) => summary.refusals.push(refusal),
            }
            summary.stack = Some(stack(&nodes, &alive, function.start));
        }
        summary.nodes = nodes;
        summary
    }

    fn paths(&self, nodes: &BTreeMap<u32, Node>, alive: &BTreeSet<u32>, start: u32) -> Result<Paths, Refusal> {
        // The entry is node 0, the others in the order of their addresses.
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
                            "a loop begins here; say how often at most: --loop {:#010x}=N, {place}",
                            addresses[header]
                        ),
                    )
                }
                NoPath::Irreducible(header) => (header, "a loop with two ways in: it cannot be bounded".to_owned()),
                NoPath::NoReturn => (0, "no return is reached".to_owned()),
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
            let best = build(Reading::Best, |paths| paths.best.as_ref());
            paths.best = Some(graph::shortest(&best).map_err(refused)?);
        }
        Ok(paths)
    }

    /// The ways out of a node that lead to a return, and what each costs.
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
        // Every instruction was priced when it was collected: none has no price here.
        let price = |taken| self.own(one, taken, reading).unwrap_or(u64::MAX);
        let cost = |cycles: u64| {
            let mut path = Path { cycles, instructions: 1, ..Path::default() };
            path.classes[class] = 1;
            path
        };
        let called = node.callee.as_ref().and_then(|callee| called(callee.paths.as_ref()?));
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
        if matches!(node.flow, Flow::Call(_)) && node.callee.as_ref().is_some_and(|callee| callee.returns) {
            edges.push(Edge { to: Some(next), cost: away(price(true)) });
        }
        let is_flow = !matches!(node.flow, Flow::Next);
        if !is_flow {
            edges.push(Edge { to: Some(next), cost: cost(stalled(price(false))) });
        } else if one.conditional {
            // A condition that fails takes one cycle, whatever would have been done (Table 3-1 note c).
            edges.push(Edge { to: Some(next), cost: cost(1) });
        }
        edges
    }
}

/// The comparison before a table branch bounds it only if there is no way around the comparison.
fn refuse_tables_entered_from_the_side(nodes: &mut BTreeMap<u32, Node>) {
    let mut refused = Vec::new();
    for (&at, _) in nodes.iter().filter(|(_, node)| !node.table.is_empty()) {
        let before: Vec<u32> = nodes.range(..at).rev().take(2).map(|(&address, _)| address).collect();
        let [branch, compare] = before[..] else { continue };
        let from =
            |to: u32| nodes.iter().filter(move |(_, node)| node.successors().contains(&to)).map(|(&from, _)| from);
        if from(at).any(|from| from != branch) || from(branch).any(|from| from != compare) {
            refused.push(at);
        }
    }
    for (_, node) in nodes.iter_mut().filter(|(at, _)| refused.contains(at)) {
        node.refusal = Some("a table branch that is reached around its comparison".into());
    }
}

/// Instructions from which a return is reached, or something unknown that might return.
fn alive(nodes: &BTreeMap<u32, Node>) -> BTreeSet<u32> {
    let mut before: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut alive = BTreeSet::new();
    let mut open = Vec::new();
    for (address, node) in nodes {
        for to in node.successors() {
            before.entry(to).or_default().push(*address);
        }
        // A call that cannot be followed comes back, if at all, to the next instruction.
        let unknown = node.refusal.is_some() && !node.falls_through();
        if node.leaves() || unknown {
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

/// Bytes of stack at most on a path that returns, callees included.
fn stack(nodes: &BTreeMap<u32, Node>, alive: &BTreeSet<u32>, start: u32) -> Result<u32, Refusal> {
    let mut depths: BTreeMap<u32, i64> = [(start, 0)].into();
    let mut open = vec![start];
    let mut deepest = 0;
    while let Some(address) = open.pop() {
        let (node, depth) = (&nodes[&address], depths[&address]);
        let refused = |reason: &str| Refusal { address, text: node.instruction.text(), reason: reason.to_owned() };
        let Some(growth) = node.instruction.stack_growth() else {
            return Err(refused("the stack pointer moves by an amount that is not in the instruction"));
        };
        let below = match &node.callee {
            Some(callee) if callee.returns => match callee.stack.clone() {
                Some(Ok(bytes)) => i64::from(bytes),
                Some(Err(refusal)) => return Err(refusal),
                None => return Err(refused("the stack of the called function is not known")),
            },
            _ => 0,
        };
        let after = depth + growth;
        deepest = deepest.max(after).max(depth + below);
        // What is not executed leaves the stack as it is.
        let on = if node.flow == Flow::Return && node.instruction.conditional { depth } else { after };
        if node.leaves() && node.flow == Flow::Return && after != 0 {
            return Err(refused("returns with another stack pointer than it was called with"));
        }
        for to in node.successors().into_iter().filter(|to| alive.contains(to)) {
            match depths.insert(to, on) {
                None => open.push(to),
                Some(known) if known != on => {
                    return Err(refused("two ways come together with different stack depths"));
                }
                Some(_) => {}
            }
        }
    }
    Ok(u32::try_from(deepest).unwrap_or(0))
}
