//! Longest and shortest paths through a function, from its entry to a return.
//!
//! A node is an instruction. An edge is a successor with its cost. A loop whose header executes at most N times per
//! entry contributes N - 1 of its longest iterations at the header. With this contribution, and without its backward
//! edges, the graph is acyclic, and the longest path is found node by node.

use std::collections::{BTreeMap, BTreeSet};

use crate::cycles::TABLE;

/// Cost of a path.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Path {
    /// Cycles of all instructions on the path.
    pub(crate) cycles: u64,
    /// Number of instructions on the path.
    pub(crate) instructions: u64,
    /// Instructions per row of the cycle table; the last entry counts instructions outside the table.
    pub(crate) classes: Vec<u64>,
}

impl Default for Path {
    fn default() -> Self {
        Self { cycles: 0, instructions: 0, classes: vec![0; TABLE.len() + 1] }
    }
}

impl Path {
    /// Returns the cost of this path followed by `next`.
    #[must_use]
    pub(crate) fn then(&self, next: &Self) -> Self {
        let classes = self.classes.iter().zip(&next.classes).map(|(a, b)| a.saturating_add(*b)).collect();
        Self {
            cycles: self.cycles.saturating_add(next.cycles),
            instructions: self.instructions.saturating_add(next.instructions),
            classes,
        }
    }

    /// Returns the cost of `count` repetitions of this path.
    #[must_use]
    pub(crate) fn times(&self, count: u64) -> Self {
        Self {
            cycles: self.cycles.saturating_mul(count),
            instructions: self.instructions.saturating_mul(count),
            classes: self.classes.iter().map(|n| n.saturating_mul(count)).collect(),
        }
    }
}

/// A successor of a node.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    /// Target node; `None`: the function returns.
    pub(crate) to: Option<usize>,
    /// Cost of the node if control leaves it by this edge.
    pub(crate) cost: Path,
}

/// Control-flow graph of a function: the edges of each node; the entry is node 0.
pub(crate) type Graph = Vec<Vec<Edge>>;

/// Reason for a missing path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoPath {
    /// The loop with this header has no iteration limit.
    Unbounded(usize),
    /// The graph has a cycle with a second entry; this node does not dominate it.
    Irreducible(usize),
    /// No return is reachable.
    NoReturn,
}

/// Order of the nodes in which every edge except the backward ones leads forward.
struct Order {
    nodes: Vec<usize>,
    /// Position of each node; `None` if the node is unreachable.
    positions: Vec<Option<usize>>,
    /// Sources of the backward edges, by target node.
    latches: BTreeMap<usize, BTreeSet<usize>>,
}

impl Order {
    fn of(graph: &Graph) -> Self {
        let mut state = vec![0_u8; graph.len()];
        let mut nodes = Vec::new();
        let mut latches: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        let mut stack = vec![(0, 0)];
        state[0] = 1;
        while let Some((node, next)) = stack.pop() {
            let Some(edge) = graph[node].get(next) else {
                state[node] = 2;
                nodes.push(node);
                continue;
            };
            stack.push((node, next + 1));
            let Some(to) = edge.to else { continue };
            match state[to] {
                0 => {
                    state[to] = 1;
                    stack.push((to, 0));
                }
                1 => {
                    latches.entry(to).or_default().insert(node);
                }
                _ => {}
            }
        }
        nodes.reverse();
        let mut positions = vec![None; graph.len()];
        nodes.iter().enumerate().for_each(|(at, &node)| positions[node] = Some(at));
        Self { nodes, positions, latches }
    }

    fn is_backward(&self, from: usize, to: usize) -> bool {
        self.latches.get(&to).is_some_and(|latches| latches.contains(&from))
    }
}

/// Nodes in an order in which every edge except the backward ones leads forward, and the nodes of each loop in this
/// order, by loop header.
pub(crate) struct Loops {
    pub(crate) order: Vec<usize>,
    pub(crate) bodies: BTreeMap<usize, Vec<usize>>,
}

/// Returns the loops of a graph, given the successors of each node; the entry is node 0.
///
/// # Errors
/// The header of a cycle that has a second entry.
pub(crate) fn loops(edges: &[Vec<usize>]) -> Result<Loops, usize> {
    let edge = |&to: &usize| Edge { to: Some(to), cost: Path::default() };
    let graph: Graph = edges.iter().map(|out| out.iter().map(edge).collect()).collect();
    let (order, sources) = (Order::of(&graph), sources(&graph));
    let bodies = order.latches.keys().map(|&header| Ok((header, body(&order, &sources, header).map_err(|_| header)?)));
    let bodies = bodies.collect::<Result<_, usize>>()?;
    Ok(Loops { order: order.nodes, bodies })
}

/// Returns the predecessors of each node.
fn sources(graph: &Graph) -> Vec<Vec<usize>> {
    let mut sources = vec![Vec::new(); graph.len()];
    for (from, edges) in graph.iter().enumerate() {
        edges.iter().filter_map(|edge| edge.to).for_each(|to| sources[to].push(from));
    }
    sources
}

/// Returns the nodes of the loop of `header` in order: all nodes that reach a backward edge without passing the header.
///
/// # Errors
/// A path leads from the entry to a backward edge around the header.
fn body(order: &Order, sources: &[Vec<usize>], header: usize) -> Result<Vec<usize>, NoPath> {
    let mut inside: BTreeSet<usize> = [header].into();
    let mut open: Vec<usize> = order.latches[&header].iter().copied().collect();
    while let Some(node) = open.pop() {
        if inside.insert(node) {
            // Walks backwards from the backward edges, never through the header.
            if node == 0 {
                return Err(NoPath::Irreducible(header));
            }
            open.extend(sources[node].iter().filter(|&&from| order.positions[from].is_some()));
        }
    }
    let mut nodes: Vec<usize> = inside.into_iter().collect();
    nodes.sort_by_key(|&node| order.positions[node]);
    Ok(nodes)
}

/// Returns the longest path from the entry to a return; `bound` is the largest number of executions of a loop header
/// per entry.
///
/// # Errors
/// The reason, if no longest path exists.
pub(crate) fn longest(graph: &Graph, bound: impl Fn(usize) -> Option<u64>) -> Result<Path, NoPath> {
    let (order, sources) = (Order::of(graph), sources(graph));
    let bodies = order.latches.keys().map(|&header| Ok((header, body(&order, &sources, header)?)));
    let mut bodies = bodies.collect::<Result<Vec<_>, _>>()?;
    // Inner loops first: an iteration of the outer loop contains them.
    bodies.sort_by_key(|(_, inside)| inside.len());
    let mut way = PathSearch { graph, order: &order, rounds: BTreeMap::new(), reached: vec![None; graph.len()] };
    for (header, inside) in &bodies {
        let count = bound(*header).ok_or(NoPath::Unbounded(*header))?;
        let mut longest = Path::default();
        way.forward(inside, |a, b| a > b);
        for &latch in &order.latches[header] {
            let Some(so_far) = &way.reached[latch] else { continue };
            for edge in graph[latch].iter().filter(|edge| edge.to == Some(*header)) {
                longest = longest.max(so_far.then(&edge.cost));
            }
        }
        for &node in inside {
            way.reached[node] = None;
        }
        way.rounds.insert(*header, longest.times(count.saturating_sub(1)));
    }
    way.forward(&order.nodes, |a, b| a > b);
    way.finish(|a, b| a > b)
}

/// Returns the shortest path from the entry to a return; it leaves every loop as early as possible.
///
/// # Errors
/// The reason, if no path exists.
pub(crate) fn shortest(graph: &Graph) -> Result<Path, NoPath> {
    let order = Order::of(graph);
    let mut way = PathSearch { graph, order: &order, rounds: BTreeMap::new(), reached: vec![None; graph.len()] };
    way.forward(&order.nodes, |a, b| a < b);
    way.finish(|a, b| a < b)
}

/// Best paths found so far.
struct PathSearch<'a> {
    graph: &'a Graph,
    order: &'a Order,
    /// Cost of all iterations of a loop except the last, by loop header.
    rounds: BTreeMap<usize, Path>,
    /// Best path to each node.
    reached: Vec<Option<Path>>,
}

impl PathSearch<'_> {
    /// Extends the paths from the first of these ordered nodes to the others.
    fn forward(&mut self, nodes: &[usize], better: impl Fn(&Path, &Path) -> bool) {
        let Some(&entry) = nodes.first() else { return };
        self.reached[entry] = Some(self.rounds.get(&entry).cloned().unwrap_or_default());
        let inside: BTreeSet<usize> = nodes.iter().copied().collect();
        for &node in nodes {
            let Some(so_far) = self.reached[node].clone() else { continue };
            for edge in &self.graph[node] {
                let Some(to) = edge.to.filter(|to| inside.contains(to)) else { continue };
                if self.order.is_backward(node, to) {
                    continue;
                }
                let mut path = so_far.then(&edge.cost);
                if let Some(round) = self.rounds.get(&to) {
                    path = path.then(round);
                }
                if self.reached[to].as_ref().is_none_or(|old| better(&path, old)) {
                    self.reached[to] = Some(path);
                }
            }
        }
    }

    /// Returns the best path to a return.
    fn finish(&self, better: impl Fn(&Path, &Path) -> bool) -> Result<Path, NoPath> {
        let mut best: Option<Path> = None;
        for (node, so_far) in self.reached.iter().enumerate() {
            let Some(so_far) = so_far else { continue };
            for edge in self.graph[node].iter().filter(|edge| edge.to.is_none()) {
                let path = so_far.then(&edge.cost);
                if best.as_ref().is_none_or(|old| better(&path, old)) {
                    best = Some(path);
                }
            }
        }
        best.ok_or(NoPath::NoReturn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Builds a graph from the edges of each node: target (`None` is a return) and cycles.
    fn graph(edges: &[&[(Option<usize>, u64)]]) -> Graph {
        let edge = |&(to, cycles)| Edge { to, cost: Path { cycles, instructions: 1, ..Path::default() } };
        edges.iter().map(|out| out.iter().map(edge).collect()).collect()
    }

    fn cycles(path: Result<Path, NoPath>) -> Result<u64, NoPath> {
        path.map(|path| path.cycles)
    }

    #[test]
    fn of_two_ways_the_longer_and_the_shorter_are_found() {
        let fork = graph(&[&[(Some(1), 1), (Some(2), 4)], &[(Some(3), 10)], &[(Some(3), 1)], &[(None, 2)]]);
        assert_eq!(cycles(longest(&fork, |_| None)), Ok(13));
        assert_eq!(cycles(shortest(&fork)), Ok(7));
    }

    #[test]
    fn a_loop_is_worth_its_rounds() {
        // 0 -> 1 (header) -> 2 -> 1, out of 1.
        let once = graph(&[&[(Some(1), 1)], &[(Some(2), 1), (None, 3)], &[(Some(1), 5)]]);
        assert_eq!(cycles(longest(&once, |_| None)), Err(NoPath::Unbounded(1)));
        assert_eq!(cycles(longest(&once, |_| Some(1))), Ok(1 + 3));
        assert_eq!(cycles(longest(&once, |_| Some(4))), Ok(1 + 3 * 6 + 3));
        assert_eq!(cycles(shortest(&once)), Ok(4));
    }

    #[test]
    fn a_loop_in_a_loop_multiplies() {
        // 0 -> 1 (outer) -> 2 (inner, to itself, 7) -> 1; out of 1.
        let nested = graph(&[&[(Some(1), 1)], &[(Some(2), 1), (None, 1)], &[(Some(2), 7), (Some(1), 2)]]);
        let bound = |header| Some(if header == 1 { 3 } else { 4 });
        // Two iterations of 1 + 3 * 7 + 2, and the header once more on the way out. A third iteration would not return
        // to the header, so it is not a path.
        assert_eq!(cycles(longest(&nested, bound)), Ok(1 + 2 * (1 + 21 + 2) + 1));
    }

    #[test]
    fn a_circle_entered_in_two_places_is_refused() {
        let tangled = graph(&[&[(Some(1), 1), (Some(2), 1)], &[(Some(2), 1), (None, 1)], &[(Some(1), 1)]]);
        assert!(matches!(longest(&tangled, |_| Some(2)), Err(NoPath::Irreducible(_))));
    }

    #[test]
    fn without_a_return_there_is_no_path() {
        let endless = graph(&[&[(Some(1), 1)], &[(Some(1), 1)]]);
        assert_eq!(cycles(longest(&endless, |_| Some(2))), Err(NoPath::NoReturn));
        assert_eq!(cycles(shortest(&endless)), Err(NoPath::NoReturn));
    }
}
