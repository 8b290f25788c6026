//! Paths through a function: the longest and the shortest way from its entry to a return.
//!
//! A node is an instruction, an edge a way to leave it with what that costs. A loop whose header is executed at most N
//! times per entry is worth N - 1 of its longest rounds at the header; with that, and without its backward edges, the
//! graph has no circle and the longest path is found node by node.

use std::collections::{BTreeMap, BTreeSet};

use crate::cycles::TABLE;

/// What lies on a path.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Path {
    /// Cycles of all its instructions.
    pub(crate) cycles: u64,
    /// Number of its instructions.
    pub(crate) instructions: u64,
    /// Instructions of each row of the table, and at the end those it does not have.
    pub(crate) classes: Vec<u64>,
}

impl Default for Path {
    fn default() -> Self {
        Self { cycles: 0, instructions: 0, classes: vec![0; TABLE.len() + 1] }
    }
}

impl Path {
    /// This path, and `next` behind it.
    #[must_use]
    pub(crate) fn then(&self, next: &Self) -> Self {
        let classes = self.classes.iter().zip(&next.classes).map(|(a, b)| a.saturating_add(*b)).collect();
        Self {
            cycles: self.cycles.saturating_add(next.cycles),
            instructions: self.instructions.saturating_add(next.instructions),
            classes,
        }
    }

    /// This path, so many times over.
    #[must_use]
    pub(crate) fn times(&self, count: u64) -> Self {
        Self {
            cycles: self.cycles.saturating_mul(count),
            instructions: self.instructions.saturating_mul(count),
            classes: self.classes.iter().map(|n| n.saturating_mul(count)).collect(),
        }
    }
}

/// A way to leave a node.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    /// To which node; none: the function returns.
    pub(crate) to: Option<usize>,
    /// What the node costs if it is left this way.
    pub(crate) cost: Path,
}

/// A function: ways out of each node; the entry is node 0.
pub(crate) type Graph = Vec<Vec<Edge>>;

/// Why there is no longest path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoPath {
    /// The loop with this header is not bounded.
    Unbounded(usize),
    /// This node is jumped to from inside a circle that it does not dominate.
    Irreducible(usize),
    /// No return is reached.
    NoReturn,
}

/// Nodes in an order in which every edge but the backward ones leads on.
struct Order {
    nodes: Vec<usize>,
    /// Of each node; none if the entry does not lead there.
    positions: Vec<Option<usize>>,
    /// Backward edges by the node they lead to.
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

/// Nodes in an order in which every edge leads on, but for those back to where a loop begins; of each loop the nodes in
/// that order, by the one that it begins with.
pub(crate) struct Loops {
    pub(crate) order: Vec<usize>,
    pub(crate) bodies: BTreeMap<usize, Vec<usize>>,
}

/// The loops of a graph, of which only is known where each node leads to; the entry is node 0.
///
/// # Errors
/// This node is jumped to from inside a circle that it does not dominate.
pub(crate) fn loops(edges: &[Vec<usize>]) -> Result<Loops, usize> {
    let edge = |&to: &usize| Edge { to: Some(to), cost: Path::default() };
    let graph: Graph = edges.iter().map(|out| out.iter().map(edge).collect()).collect();
    let (order, sources) = (Order::of(&graph), sources(&graph));
    let bodies = order.latches.keys().map(|&header| Ok((header, body(&order, &sources, header).map_err(|_| header)?)));
    let bodies = bodies.collect::<Result<_, usize>>()?;
    Ok(Loops { order: order.nodes, bodies })
}

/// From where each node is reached.
fn sources(graph: &Graph) -> Vec<Vec<usize>> {
    let mut sources = vec![Vec::new(); graph.len()];
    for (from, edges) in graph.iter().enumerate() {
        edges.iter().filter_map(|edge| edge.to).for_each(|to| sources[to].push(from));
    }
    sources
}

/// Nodes of the loop of `header`, in order: those from which a latch is reached without the header.
///
/// # Errors
/// There is a way from the entry to a latch around the header.
fn body(order: &Order, sources: &[Vec<usize>], header: usize) -> Result<Vec<usize>, NoPath> {
    let mut inside: BTreeSet<usize> = [header].into();
    let mut open: Vec<usize> = order.latches[&header].iter().copied().collect();
    while let Some(node) = open.pop() {
        if inside.insert(node) {
            // Backwards from a latch to the entry and never through the header.
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

/// The longest path from the entry to a return; `bound` says how often a header is executed at most per entry.
///
/// # Errors
/// Why there is none.
pub(crate) fn longest(graph: &Graph, bound: impl Fn(usize) -> Option<u64>) -> Result<Path, NoPath> {
    let (order, sources) = (Order::of(graph), sources(graph));
    let bodies = order.latches.keys().map(|&header| Ok((header, body(&order, &sources, header)?)));
    let mut bodies = bodies.collect::<Result<Vec<_>, _>>()?;
    // Inner loops first: a round of the outer one goes through them.
    bodies.sort_by_key(|(_, inside)| inside.len());
    let mut way = Way { graph, order: &order, rounds: BTreeMap::new(), reached: vec![None; graph.len()] };
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

/// The shortest path from the entry to a return, every loop left as early as its way out allows.
///
/// # Errors
/// Why there is none.
pub(crate) fn shortest(graph: &Graph) -> Result<Path, NoPath> {
    let order = Order::of(graph);
    let mut way = Way { graph, order: &order, rounds: BTreeMap::new(), reached: vec![None; graph.len()] };
    way.forward(&order.nodes, |a, b| a < b);
    way.finish(|a, b| a < b)
}

/// Paths found so far.
struct Way<'a> {
    graph: &'a Graph,
    order: &'a Order,
    /// What all rounds of a loop but the last are worth, by its header.
    rounds: BTreeMap<usize, Path>,
    /// The best path to each node.
    reached: Vec<Option<Path>>,
}

impl Way<'_> {
    /// From the first of these nodes, which are in order, to the others.
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

    /// The best path to a return.
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

    /// From each node: to which (none is a return), in how many cycles.
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
        // Two rounds of 1 + 3 * 7 + 2, the header once more on the way out; a third descent has no way back, so it
        // is no path.
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
