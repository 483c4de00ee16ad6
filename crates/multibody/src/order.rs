//! Elimination order: leaves before roots, depth first, fewest neighbours first.
//!
//! Ground has no column in the factor, so loops that close through anchors cost nothing. A depth-first numbering that
//! starts at ground gives a tree its order from the leaves to the root, with no fill. Where loops are left, depth first
//! alone depends on luck: on a ladder it may run up one rail and down the other, and every rung then fills the whole
//! path. The body with the fewest remaining neighbours is therefore eliminated first, with ground counted as one
//! neighbour; the depth-first number breaks ties. The order on trees is the same. Fronts have 2 or 3 bodies on chains,
//! ladders, banks and stages, where the factorization is O(n+m). Counting ground keeps what stands on it until the end,
//! so that joint coordinates can be counted from there. A dense two-dimensional lattice is the exception: its front
//! grows with its side.
//!
//! Reference: A. George, J. W. Liu, "The evolution of the minimum degree ordering algorithm", SIAM Review 31 (1989).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The elimination order of a graph on `count` vertices: `order[k]` is eliminated as the k-th. `grounded` lists the
/// vertices that ground holds too.
///
/// Depends on nothing but the graph. Cost: O(blocks of the factor · log n), hubs with any number of neighbours included.
pub fn elimination_order(count: usize, edges: &[(usize, usize)], grounded: &[usize]) -> Vec<usize> {
    let adjacency = Adjacency::new(count, edges);
    let depth_first = depth_first(count, &adjacency, grounded);
    let mut number = vec![0; count];
    for (k, &vertex) in depth_first.iter().enumerate() {
        number[vertex as usize] = k as u32;
    }
    let mut graph = Remaining::new(count, &adjacency, grounded);
    let key = |degree: u32, number: u32| Reverse((u64::from(degree) << 32) | u64::from(number));
    let mut heap: BinaryHeap<Reverse<u64>> = (0..count).map(|v| key(graph.held(v), number[v])).collect();
    let mut order = Vec::with_capacity(count);
    let mut front = Vec::new();
    while let Some(Reverse(entry)) = heap.pop() {
        let (degree, vertex) = ((entry >> 32) as u32, depth_first[entry as u32 as usize]);
        if graph.gone[vertex as usize] || degree != graph.held(vertex as usize) {
            continue;
        }
        order.push(vertex as usize);
        bimorph_base::budget::check();
        graph.eliminate(vertex, &mut front);
        for &u in &front {
            heap.push(key(graph.held(u as usize), number[u as usize]));
        }
    }
    order
}

/// The graph of the vertices that are left. Lists keep names of vertices that are gone until they are mostly that, so
/// that taking a leaf from a hub costs the same whatever the hub's size.
struct Remaining {
    neighbours: Vec<Vec<u32>>,
    degree: Vec<u32>,
    ground: Vec<bool>,
    gone: Vec<bool>,
    /// The vertex that last had each one among its neighbours, while a front is coupled.
    beside: Vec<u32>,
}

impl Remaining {
    fn new(count: usize, adjacency: &Adjacency, grounded: &[usize]) -> Self {
        let neighbours: Vec<Vec<u32>> = (0..count)
            .map(|v| {
                let mut list = adjacency.of(v as u32).to_vec();
                list.dedup();
                list
            })
            .collect();
        let degree = neighbours.iter().map(|list| list.len() as u32).collect();
        let mut ground = vec![false; count];
        for &vertex in grounded {
            ground[vertex] = true;
        }
        Self { neighbours, degree, ground, gone: vec![false; count], beside: vec![u32::MAX; count] }
    }

    /// Neighbours that are left, ground counted as one.
    fn held(&self, vertex: usize) -> u32 {
        self.degree[vertex] + u32::from(self.ground[vertex])
    }

    /// Takes `vertex` out and couples its neighbours, which go to `front`, with each other.
    fn eliminate(&mut self, vertex: u32, front: &mut Vec<u32>) {
        self.gone[vertex as usize] = true;
        front.clear();
        let list = std::mem::take(&mut self.neighbours[vertex as usize]);
        front.extend(list.into_iter().filter(|&u| !self.gone[u as usize]));
        for &u in front.iter() {
            self.degree[u as usize] -= 1;
            self.ground[u as usize] |= self.ground[vertex as usize];
        }
        for (i, &u) in front.iter().enumerate() {
            bimorph_base::budget::check();
            // a hub's list is not read for the few that are left beside one of its leaves
            let read = self.neighbours[u as usize].len() <= READ * i;
            if read {
                for &w in &self.neighbours[u as usize] {
                    self.beside[w as usize] = u;
                }
            }
            for &w in &front[..i] {
                if !(if read { self.beside[w as usize] == u } else { self.coupled(u, w) }) {
                    for (from, to) in [(u, w), (w, u)] {
                        self.neighbours[from as usize].push(to);
                        self.degree[from as usize] += 1;
                    }
                }
            }
        }
        for &u in front.iter() {
            let list = &mut self.neighbours[u as usize];
            if list.len() > 2 * self.degree[u as usize] as usize + 4 {
                list.retain(|&w| !self.gone[w as usize]);
            }
        }
    }

    fn coupled(&self, u: u32, w: u32) -> bool {
        let (a, b) = (&self.neighbours[u as usize], &self.neighbours[w as usize]);
        if a.len() <= b.len() { a.contains(&w) } else { b.contains(&u) }
    }
}

/// A list of neighbours is read once where it is at most so many times as long as what is looked for in it.
const READ: usize = 8;

/// Depth-first numbering, leaves first. Roots stand on ground, or are the far ends of breadth-first sweeps where nothing
/// does; neighbours come in ascending order.
fn depth_first(count: usize, adjacency: &Adjacency, grounded: &[usize]) -> Vec<u32> {
    let mut order = Vec::with_capacity(count);
    let mut seen = vec![false; count];
    let mut reached = vec![false; count];
    let mut stack: Vec<(u32, u32)> = Vec::new();
    let mut queue = Vec::new();
    let starts = grounded.iter().map(|&v| (v, true)).chain((0..count).map(|v| (v, false)));
    for (start, stands) in starts {
        if seen[start] {
            continue;
        }
        let root = if stands { start as u32 } else { adjacency.far_end(start as u32, &mut reached, &mut queue) };
        seen[root as usize] = true;
        stack.push((root, 0));
        while let Some((vertex, next)) = stack.last_mut() {
            match adjacency.of(*vertex).get(*next as usize) {
                Some(&neighbour) => {
                    *next += 1;
                    if !seen[neighbour as usize] {
                        seen[neighbour as usize] = true;
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
    start: Vec<u32>,
    neighbour: Vec<u32>,
}

impl Adjacency {
    fn new(count: usize, edges: &[(usize, usize)]) -> Self {
        let mut start = vec![0u32; count + 1];
        for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
            start[a + 1] += 1;
            start[b + 1] += 1;
        }
        for k in 0..count {
            start[k + 1] += start[k];
        }
        let mut at = start.clone();
        let mut neighbour = vec![0u32; start[count] as usize];
        for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
            neighbour[at[a] as usize] = b as u32;
            at[a] += 1;
            neighbour[at[b] as usize] = a as u32;
            at[b] += 1;
        }
        for k in 0..count {
            neighbour[start[k] as usize..start[k + 1] as usize].sort_unstable();
        }
        Self { start, neighbour }
    }

    fn of(&self, vertex: u32) -> &[u32] {
        &self.neighbour[self.start[vertex as usize] as usize..self.start[vertex as usize + 1] as usize]
    }

    /// The last vertex that a breadth-first sweep from `start` reaches. Marks the component in `reached`.
    fn far_end(&self, start: u32, reached: &mut [bool], queue: &mut Vec<u32>) -> u32 {
        queue.clear();
        queue.push(start);
        reached[start as usize] = true;
        let mut head = 0;
        while head < queue.len() {
            for &neighbour in self.of(queue[head]) {
                if !reached[neighbour as usize] {
                    reached[neighbour as usize] = true;
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
    use crate::Pattern;

    /// The order is a permutation, and a tree in that order has no fill: one block below the diagonal per joint.
    #[test]
    fn trees_have_no_fill() {
        let edges: Vec<_> = (1..200).map(|k| ((k * 7 + 3) % k, k)).collect();
        let order = elimination_order(200, &edges, &[]);
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
            let order = elimination_order(count, &edges, &[0, 5]);
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
