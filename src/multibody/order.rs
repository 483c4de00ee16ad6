//! Elimination order: leaves before roots, depth first, fewest neighbours first.
//!
//! Ground is no node of the graph, so loops that close through anchors leave a tree and cost nothing. A depth-first
//! numbering gives a tree its order from the leaves to the root, with no fill. Where loops are left, depth first alone
//! depends on luck: on a ladder it may run up one rail and down the other, and every rung then fills the whole path. So the
//! body with the fewest remaining neighbours goes first, and the depth-first number breaks ties: the same order on
//! trees, and fronts of 2 or 3 bodies on chains, ladders, banks and stages, where the factorization is O(n+m).
//! A dense two-dimensional lattice is the exception: its front grows with its side.
//!
//! Reference: A. George, J. W. Liu, "The evolution of the minimum degree ordering algorithm", SIAM Review 31 (1989).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The elimination order of a graph on `count` vertices: `order[k]` is eliminated as the k-th.
///
/// Depends on nothing but the graph. Cost: O(blocks of the factor · log n).
pub fn elimination_order(count: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    let adjacency = Adjacency::new(count, edges);
    let depth_first = depth_first(count, &adjacency);
    let mut number = vec![0; count];
    for (k, &vertex) in depth_first.iter().enumerate() {
        number[vertex] = k;
    }
    let mut neighbours: Vec<Vec<usize>> = (0..count)
        .map(|v| {
            let mut list = adjacency.of(v).to_vec();
            list.dedup();
            list
        })
        .collect();
    let mut heap: BinaryHeap<Reverse<(usize, usize)>> =
        (0..count).map(|v| Reverse((neighbours[v].len(), number[v]))).collect();
    let mut done = vec![false; count];
    let mut order = Vec::with_capacity(count);
    while let Some(Reverse((degree, k))) = heap.pop() {
        let vertex = depth_first[k];
        if done[vertex] || degree != neighbours[vertex].len() {
            continue;
        }
        done[vertex] = true;
        order.push(vertex);
        let front = std::mem::take(&mut neighbours[vertex]);
        for &u in &front {
            let list = &mut neighbours[u];
            list.retain(|&w| w != vertex);
            list.extend(front.iter().filter(|&&w| w != u));
            list.sort_unstable();
            list.dedup();
            heap.push(Reverse((list.len(), number[u])));
        }
    }
    order
}

/// Depth-first numbering, leaves first. Roots are the far ends of breadth-first sweeps; neighbours come in ascending order.
fn depth_first(count: usize, adjacency: &Adjacency) -> Vec<usize> {
    let mut order = Vec::with_capacity(count);
    let mut seen = vec![false; count];
    let mut reached = vec![false; count];
    let mut stack: Vec<(usize, usize)> = Vec::new();
    for start in 0..count {
        if seen[start] {
            continue;
        }
        let root = adjacency.far_end(start, &mut reached);
        seen[root] = true;
        stack.push((root, 0));
        while let Some((vertex, next)) = stack.last_mut() {
            match adjacency.of(*vertex).get(*next) {
                Some(&neighbour) => {
                    *next += 1;
                    if !seen[neighbour] {
                        seen[neighbour] = true;
                        stack.push((neighbour, 0));
                    }
                }
                None => {
                    order.push(*vertex);
                    stack.pop();
                }
            }
        }
    }
    order
}

/// Neighbour lists in one array.
struct Adjacency {
    start: Vec<usize>,
    neighbour: Vec<usize>,
}

impl Adjacency {
    fn new(count: usize, edges: &[(usize, usize)]) -> Self {
        let mut start = vec![0; count + 1];
        for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
            start[a + 1] += 1;
            start[b + 1] += 1;
        }
        for k in 0..count {
            start[k + 1] += start[k];
        }
        let mut at = start.clone();
        let mut neighbour = vec![0; start[count]];
        for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
            neighbour[at[a]] = b;
            at[a] += 1;
            neighbour[at[b]] = a;
            at[b] += 1;
        }
        for k in 0..count {
            neighbour[start[k]..start[k + 1]].sort_unstable();
        }
        Self { start, neighbour }
    }

    fn of(&self, vertex: usize) -> &[usize] {
        &self.neighbour[self.start[vertex]..self.start[vertex + 1]]
    }

    /// The last vertex that a breadth-first sweep from `start` reaches. Marks the component in `reached`.
    fn far_end(&self, start: usize, reached: &mut [bool]) -> usize {
        let mut queue = vec![start];
        reached[start] = true;
        let mut head = 0;
        while head < queue.len() {
            for &neighbour in self.of(queue[head]) {
                if !reached[neighbour] {
                    reached[neighbour] = true;
                    queue.push(neighbour);
                }
            }
            head += 1;
        }
        queue[queue.len() - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::Pattern;

    /// The order is a permutation, and a tree in that order has no fill: one block below the diagonal per joint.
    #[test]
    fn trees_have_no_fill() {
        let edges: Vec<_> = (1..200).map(|k| ((k * 7 + 3) % k, k)).collect();
        let order = elimination_order(200, &edges);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..200).collect::<Vec<_>>());
        let pattern = Pattern::new(200, &renumber(&order, &edges));
        assert_eq!(pattern.off_blocks(), 199);
    }

    /// A ladder's front stays bounded, whatever its length: blocks grow linearly with its loops. Depth first alone gave
    /// 201,597 blocks here at 200 loops.
    #[test]
    fn ladders_stay_linear() {
        let blocks = |loops: usize| {
            // two rails of 5 bodies per cell and one rung body per cell
            let per = 11;
            let count = loops * per;
            let mut edges = Vec::new();
            for cell in 0..loops {
                let at = cell * per;
                for k in 0..4 {
                    edges.push((at + k, at + k + 1));
                    edges.push((at + 5 + k, at + 6 + k));
                }
                edges.push((at + 4, at + 10));
                edges.push((at + 9, at + 10));
                if cell + 1 < loops {
                    edges.push((at + 4, at + per));
                    edges.push((at + 9, at + per + 5));
                }
            }
            let order = elimination_order(count, &edges);
            let pattern = Pattern::new(count, &renumber(&order, &edges));
            assert!(pattern.widest_front() <= 3);
            pattern.off_blocks()
        };
        let (small, large) = (blocks(20), blocks(200));
        assert!(large <= 11 * small, "{small} {large}");
    }

    fn renumber(order: &[usize], edges: &[(usize, usize)]) -> Vec<(usize, usize)> {
        let mut place = vec![0; order.len()];
        for (k, &v) in order.iter().enumerate() {
            place[v] = k;
        }
        edges.iter().map(|&(a, b)| (place[a], place[b])).collect()
    }
}
