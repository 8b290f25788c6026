//! Paths through a function: the longest and the shortest way from its entry to a return.
//!
//! A node is an instruction, an edge a way to leave it with what that costs. A loop whose header is executed at most N
//! times per entry is worth N - 1 of its longest rounds at the header; with that, and without its backward edges, the
//! graph has no circle and the longest path is found node by node.

use std::collections::BTreeMap;

use crate::cycles::TABLE;

/// What lies on a path.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Path {
    /// Cycles.
    pub(crate) cycles: u64,
    /// Instructions.
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
    /// This, then that.
    #[must_use]
    pub(crate) fn then(&self, next: &Self) -> Self {
        let classes = self.classes.iter().zip(&next.classes).map(|(a, b)| a.saturating_add(*b)).collect();
        Self {
            cycles: self.cycles.saturating_add(next.cycles),
            instructions: self.instructions.saturating_add(next.instructions),
            classes,
        }
    }

    /// This that many times.
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

/// Backward edges by the node they lead to.
type Latches = BTreeMap<usize, Vec<usize>>;

/// Nodes in an order in which every edge but the backward ones leads on, and the backward edges.
fn order(graph: &Graph) -> (Vec<usize>, Latches) {
    let mut state = vec![0_u8; graph.len()];
    let mut finished = Vec::new();
    let mut latches = Latches::new();
    let mut stack = vec![(0, 0)];
    state[0] = 1;
    while let Some((node, next)) = stack.pop() {
        let Some(edge) = graph[node].get(next) else {
            state[node] = 2;
            finished.push(node);
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
                let from = latches.entry(to).or_default();
                if !from.contains(&node) {
                    from.push(node);
                }
            }
            _ => {}
        }
    }
    finished.reverse();
    (finished, latches)
}

/// Is `node` reached from the entry on a way around `without`?
fn is_reached_around(graph: &Graph, node: usize, without: usize) -> bool {
    let mut seen = vec![false; graph.len()];
    let mut open = vec![0];
    while let Some(at) = open.pop() {
        if at == without || std::mem::replace(&mut seen[at], true) {
            continue;
        }
        open.extend(graph[at].iter().filter_map(|edge| edge.to));
    }
    seen[node]
}

/// Nodes of the loop of `header`: those from which a latch is reached without the header.
fn body(graph: &Graph, header: usize, latches: &[usize]) -> Vec<bool> {
    let mut inside = vec![false; graph.len()];
    inside[header] = true;
    let mut open = latches.to_vec();
    while let Some(node) = open.pop() {
        if std::mem::replace(&mut inside[node], true) {
            continue;
        }
        open.extend((0..graph.len()).filter(|&from| graph[from].iter().any(|edge| edge.to == Some(node))));
    }
    inside
}

/// The longest path from the entry to a return; `bound` says how often a header is executed at most per entry.
///
/// # Errors
/// Why there is none.
pub(crate) fn longest(graph: &Graph, bound: impl Fn(usize) -> Option<u64>) -> Result<Path, NoPath> {
    let (order, latches) = order(graph);
    for (&header, from) in &latches {
        if from.iter().any(|&node| is_reached_around(graph, node, header)) {
            return Err(NoPath::Irreducible(header));
        }
    }
    // Inner loops first: a round of the outer one goes through them.
    let mut bodies: Vec<(usize, Vec<bool>)> = latches.iter().map(|(&h, from)| (h, body(graph, h, from))).collect();
    bodies.sort_by_key(|(_, inside)| inside.iter().filter(|&&inside| inside).count());
    let mut rounds: BTreeMap<usize, Path> = BTreeMap::new();
    for (header, inside) in &bodies {
        let count = bound(*header).ok_or(NoPath::Unbounded(*header))?;
        let reached = forward(graph, &order, &latches, &rounds, *header, |node| inside[node], |a, b| a > b);
        let mut longest = Path::default();
        for &latch in &latches[header] {
            let Some(so_far) = &reached[latch] else { continue };
            for edge in graph[latch].iter().filter(|edge| edge.to == Some(*header)) {
                longest = longest.max(so_far.then(&edge.cost));
            }
        }
        rounds.insert(*header, longest.times(count.saturating_sub(1)));
    }
    finish(graph, &forward(graph, &order, &latches, &rounds, 0, |_| true, |a, b| a > b), |a, b| a > b)
}

/// The shortest path from the entry to a return, every loop left as early as its way out allows.
///
/// # Errors
/// Why there is none.
pub(crate) fn shortest(graph: &Graph) -> Result<Path, NoPath> {
    let (order, latches) = order(graph);
    finish(graph, &forward(graph, &order, &latches, &BTreeMap::new(), 0, |_| true, |a, b| a < b), |a, b| a < b)
}

fn forward(
    graph: &Graph,
    order: &[usize],
    latches: &Latches,
    rounds: &BTreeMap<usize, Path>,
    entry: usize,
    inside: impl Fn(usize) -> bool,
    better: impl Fn(&Path, &Path) -> bool,
) -> Vec<Option<Path>> {
    let mut reached: Vec<Option<Path>> = vec![None; graph.len()];
    reached[entry] = Some(rounds.get(&entry).cloned().unwrap_or_default());
    for &node in order {
        let Some(so_far) = reached[node].clone() else { continue };
        for edge in &graph[node] {
            let Some(to) = edge.to.filter(|&to| inside(to)) else { continue };
            if latches.get(&to).is_some_and(|from| from.contains(&node)) {
                continue;
            }
            let mut path = so_far.then(&edge.cost);
            if let Some(round) = rounds.get(&to) {
                path = path.then(round);
            }
            if reached[to].as_ref().is_none_or(|old| better(&path, old)) {
                reached[to] = Some(path);
            }
        }
    }
    reached
}

fn finish(graph: &Graph, reached: &[Option<Path>], better: impl Fn(&Path, &Path) -> bool) -> Result<Path, NoPath> {
    let mut best: Option<Path> = None;
    for (node, so_far) in reached.iter().enumerate() {
        let Some(so_far) = so_far else { continue };
        for edge in graph[node].iter().filter(|edge| edge.to.is_none()) {
            let path = so_far.then(&edge.cost);
            if best.as_ref().is_none_or(|old| better(&path, old)) {
                best = Some(path);
            }
        }
    }
    best.ok_or(NoPath::NoReturn)
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
