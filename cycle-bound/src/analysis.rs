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
    /// Address of the instruction that cannot be followed.
    pub(crate) address: u32,
    /// The instruction there, as in a listing.
    pub(crate) text: String,
    /// Why it cannot be followed.
    pub(crate) reason: String,
}

/// An instruction and the ways out of it.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// The instruction of this node.
    pub(crate) instruction: Instruction,
    /// Where it goes if it is executed.
    pub(crate) flow: Flow,
    /// Targets of a table branch.
    table: Vec<u32>,
    /// A jump to another function, which returns in its place.
    tail: bool,
    /// The called function, and whether any path of it returns; none if nothing is called.
    called: Option<(u32, bool)>,
    refusal: Option<String>,
}

impl Node {
    /// Is the instruction behind it executed after it, when it calls what returns?
    pub(crate) fn falls_through(&self) -> bool {
        let stays =
            matches!(self.flow, Flow::Next | Flow::Call(_) | Flow::Indirect(true) | Flow::Exception) && !self.tail;
        self.instruction.conditional || (stays && self.comes_back())
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

    /// Does what it calls return? If it calls nothing, nothing is in the way.
    fn comes_back(&self) -> bool {
        self.called.is_none_or(|(_, returns)| returns)
    }

    /// Might it give control back to the caller, as nobody knows what it does?
    fn may_leave(&self) -> bool {
        // A call that cannot be followed comes back, if at all, to the next instruction.
        let stays = matches!(self.flow, Flow::Next | Flow::Call(_) | Flow::Indirect(true) | Flow::Exception);
        self.refusal.is_some() && (!stays || !self.falls_through() || self.instruction.open.is_some())
    }

    /// Does it give control back to the caller, if it is executed?
    pub(crate) fn leaves(&self) -> bool {
        self.flow == Flow::Return || (self.tail && self.comes_back())
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
    /// First address of the function.
    pub(crate) start: u32,
    /// Does any path return?
    pub(crate) returns: bool,
    /// What in it has no bound; that of the functions it calls is theirs.
    refusals: Vec<Refusal>,
    /// Nothing in it or in what it calls was refused, but for a loop.
    is_followed: bool,
    /// Its longest and shortest paths, if it has a bound.
    pub(crate) paths: Option<Paths>,
    /// Bytes of stack at most, or where it cannot be told.
    pub(crate) stack: Option<Result<u32, Refusal>>,
    /// Functions called, on paths that never return too.
    calls_all: BTreeSet<u32>,
    /// Functions called that return, on paths that do.
    calls_living: BTreeSet<u32>,
    /// Instructions of the function, by address.
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
    pub(crate) least: Option<Path>,
    /// The path of most instructions.
    pub(crate) most: Path,
    /// The path of fewest instructions.
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
    /// Functions being read: how many others are around each.
    open: BTreeMap<u32, usize>,
}

/// A function that is being read.
struct Unread<'f> {
    function: &'f Function,
    decoded: BTreeMap<u32, Instruction>,
    nodes: BTreeMap<u32, Node>,
    /// Addresses to look at.
    ahead: Vec<u32>,
}

impl<'f> Unread<'f> {
    fn new(function: &'f Function) -> Self {
        Self { function, decoded: BTreeMap::new(), nodes: BTreeMap::new(), ahead: vec![function.start] }
    }
}

impl<'a> Analyst<'a> {
    /// For the code of an image; `timed`: with the table of the Cortex-M4, otherwise instructions are counted.
    pub(crate) fn new(image: &'a Image, decoder: Decoder, loops: BTreeMap<u32, u64>, timed: bool) -> Self {
        Self { image, decoder, loops, timed, barrier: None, done: BTreeMap::new(), open: BTreeMap::new() }
    }

    /// With this for the cycles that a barrier waits at most; otherwise a barrier has no bound.
    #[must_use]
    pub(crate) fn with_barrier(self, cycles: Option<u64>) -> Self {
        Self { barrier: cycles, ..self }
    }

    /// Cycles of an instruction without its neighbours.
    fn own(&self, one: &Instruction, taken: bool, reading: Reading) -> Result<u64, String> {
        match (self.barrier, Class::of(one)) {
            (Some(waits), Some(Class::Barrier)) if reading == Reading::Worst => {
                // An ISB waits for the pipeline at least.
                let least = if one.stem() == "isb" { reading.refill() } else { 0 };
                Ok(waits.max(least).saturating_add(1))
            }
            _ => cycles::own(one, taken, reading),
        }
    }

    /// Reads a function and all it calls, the innermost first. A chain of calls may be long: it is kept in a list.
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

    /// Summaries of all functions that one reaches, itself included.
    pub(crate) fn reached(&self, summary: &Summary) -> Vec<Rc<Summary>> {
        self.follow(summary, |one| &one.calls_all)
    }

    /// All that has no bound on the paths that return.
    pub(crate) fn refusals(&self, summary: &Summary) -> Vec<Refusal> {
        let living = self.follow(summary, |one| &one.calls_living);
        let all: BTreeSet<&Refusal> = living.iter().flat_map(|one| &one.refusals).collect();
        all.into_iter().cloned().collect()
    }

    /// In the order of their addresses.
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

    /// Every instruction that is reached from the entry; stops at a call of a function that is to be read first.
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

    /// The instruction at an address and its ways out.
    ///
    /// # Errors
    /// The function that it calls, if that has not been read.
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
            let reason = if self.image.is_data(address) { "data among code" } else { "no instruction known here" };
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
            Flow::Indirect(true) => node.refusal = Some("a call by a register: its target is not known".into()),
            Flow::Indirect(false) => node.refusal = Some("a jump by a register: its target is not known".into()),
            Flow::Exception => node.refusal = Some("a handler of an exception: what it does is not known".into()),
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

    /// Does more than one section lie at `address`, and is it not the one that runs?
    fn is_elsewhere(&self, from: u32, address: u32) -> bool {
        self.image.is_overlaid(address) && !self.image.is_beside(from, address)
    }

    /// # Errors
    /// The function, if it has not been read.
    fn call(&self, node: &mut Node, target: u32) -> Result<(), u32> {
        let image = self.image;
        if self.is_elsewhere(node.instruction.address, target) {
            node.refusal = Some(ambiguous(target));
        } else if let Some(at) = self.open.get(&target) {
            let name = image.function_at(target).map_or("", Function::name);
            let others = self.open.len() - at - 1;
            let way = if others == 0 { String::new() } else { format!(" by way of {others} more") };
            node.refusal = Some(format!("recursion: {name} calls itself{way}"));
        } else if image.function_at(target).is_some() {
            let callee = self.done.get(&target).ok_or(target)?;
            node.called = Some((target, callee.returns));
        } else {
            node.refusal = Some(format!("calls {target:#010x}, where no function of the file begins"));
        }
        Ok(())
    }

    /// What the called function is worth.
    fn callee(&self, node: &Node) -> Option<&Summary> {
        self.done.get(&node.called?.0).map(Rc::as_ref)
    }

    /// Targets of a table branch `tbb [pc, rN]` behind `cmp rN, #k; bhi ..`, which leaves 0 ..= k.
    fn table(
        &self,
        one: &Instruction,
        width: u32,
        decoded: &BTreeMap<u32, Instruction>,
    ) -> Result<Vec<u32>, &'static str> {
        let unbounded = "a table branch without `cmp rN, #k; bhi` before it: its table has no known length";
        let index = one.operands.first().and_then(|operand| operand.strip_prefix("[pc, "));
        let index = index.map(|rest| rest.trim_end_matches(']').trim_end_matches(", lsl #1")).ok_or(unbounded)?;
        // Straight up: a jump in between would be seen as a node that is not the one before the next.
        let mut before = decoded.range(..one.address).rev().map(|(_, one)| one);
        let branch = before.next().filter(|branch| branch.next() == one.address).ok_or(unbounded)?;
        let compare = before.next().filter(|compare| compare.next() == branch.address).ok_or(unbounded)?;
        let entry = |code: &[u8]| u32::from(code[0]) | if width == 2 { u32::from(code[1]) << 8 } else { 0 };
        let guarded = compare.stem() == "cmp" && compare.operands.first().is_some_and(|register| register == index);
        // To the table itself it would go with any index.
        if !guarded || !self.is_unsigned_greater(branch) || branch.flow() == Flow::Jump(one.address) {
            return Err(unbounded);
        }
        if compare.conditional {
            return Err("a table branch whose comparison is itself conditional: its table has no known length");
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

    /// BHI, in either width, by its bits: encodings T1 and T3, whose condition is in the instruction.
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
            summary.backward.extend(jumps.filter(|to| to <= address).map(|_| told(node, "goes back")));
            let dead_ends = node.successors().into_iter().filter(|to| lives && !alive.contains(to));
            summary.never_return.extend(dead_ends.filter_map(|to| Some(told(nodes.get(&to)?, "never returns"))));
            if lives && !node.comes_back() {
                summary.never_return.push(told(node, "calls what never returns"));
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

    /// Bytes of stack at most on a path that returns, callees included.
    fn stack(&self, nodes: &BTreeMap<u32, Node>, alive: &BTreeSet<u32>, start: u32) -> Result<u32, Refusal> {
        // Of each instruction how deep the stack is before it, and where the frame pointer stands, if it is one.
        let mut before: BTreeMap<u32, (i64, Option<i64>)> = [(start, (0, None))].into();
        let mut open = vec![start];
        let mut deepest = 0;
        while let Some(address) = open.pop() {
            let (node, (depth, frame)) = (&nodes[&address], before[&address]);
            let refused = |reason: &str| Refusal { address, text: node.instruction.text(), reason: reason.to_owned() };
            let Some((after, frame_after)) = node.instruction.frame_after(depth, frame) else {
                return Err(refused("the stack pointer moves by an amount that is not in the instruction"));
            };
            let below = match self.callee(node) {
                Some(callee) if callee.returns => match callee.stack.clone() {
                    Some(Ok(bytes)) => i64::from(bytes),
                    Some(Err(refusal)) => return Err(refusal),
                    None => return Err(refused("the stack of the called function is not known")),
                },
                _ => 0,
            };
            deepest = deepest.max(after).max(depth + below);
            // What is not executed leaves the stack as it is.
            let on = if node.flow == Flow::Return && node.instruction.conditional { depth } else { after };
            if node.leaves() && node.flow == Flow::Return && after != 0 {
                return Err(refused("returns with another stack pointer than it was called with"));
            }
            for to in node.successors().into_iter().filter(|to| alive.contains(to)) {
                let frame = match before.get(&to) {
                    None => frame_after,
                    Some((known, _)) if *known != on => {
                        return Err(refused("two ways come together with different stack depths"));
                    }
                    // Where two ways have it at different places it is no frame pointer.
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
            reason: format!("takes {deepest} bytes: no stack is as large"),
        })
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
            let least = build(Reading::Least, |paths| paths.least.as_ref());
            paths.least = Some(graph::shortest(&least).map_err(refused)?);
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
            // Counted as executed, but for the least; a condition that fails takes one cycle, whatever would have been
            // done (Table 3-1 note c).
            edges.push(Edge { to: Some(next), cost: cost(1) });
        }
        edges
    }
}

/// From where each address is reached.
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
    format!("more than one section lies at {address:#010x}: which one is loaded, the file does not say")
}

/// The comparison before a table branch bounds it only if there is no way around the comparison.
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
        node.refusal = Some("a table branch that is reached around its comparison".into());
    }
}

/// An instruction behind an IT is executed whatever its condition is, if it is jumped to.
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
        node.refusal = Some("an instruction behind an IT that is jumped to".into());
    }
}

/// Instructions from which a return is reached, or something unknown that might return.
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
