//! Elimination order and pattern of a graph, looked up where the same graph was laid out just before.
//!
//! Variants of one drawing, and the two meshes that each of them is compared on, have the same graphs again and again.
//! Cached data depend on the graph alone, so that a cache hit changes no result.

use super::order::elimination_order;
use super::pattern::Pattern;
use std::cell::RefCell;
use std::sync::Arc;

/// Graphs that a thread keeps.
const CACHED_LAYOUTS: usize = 8;
/// Vertices of a graph that is kept, at most: of larger ones the numbers take longer anyway, and the memory counts.
const MAX_VERTICES: usize = 2000;

/// Order and pattern of a graph.
#[derive(Debug)]
pub struct EliminationLayout {
    count: usize,
    edges: Vec<(usize, usize)>,
    grounded: Vec<usize>,
    /// `order[k]` is eliminated as the k-th.
    pub order: Vec<usize>,
    /// When each vertex is eliminated.
    pub place: Vec<usize>,
    /// Pattern of the factor in that order.
    pub pattern: Arc<Pattern>,
}

thread_local! {
    static LAST: RefCell<Vec<Arc<EliminationLayout>>> = const { RefCell::new(Vec::new()) };
}

impl EliminationLayout {
    /// Of a graph on `count` vertices, of which ground holds those that are `grounded`.
    pub fn of(count: usize, edges: Vec<(usize, usize)>, grounded: Vec<usize>) -> Arc<Self> {
        if count > MAX_VERTICES {
            let Self { order, place, pattern, .. } = Self::new(count, edges, grounded, Pattern::new);
            return Arc::new(Self { count, edges: Vec::new(), grounded: Vec::new(), order, place, pattern });
        }
        let same = |l: &Arc<Self>| l.count == count && l.edges == edges && l.grounded == grounded;
        let known = LAST.with_borrow_mut(|last| {
            let at = last.iter().position(same)?;
            last[..=at].rotate_right(1);
            Some(Arc::clone(&last[0]))
        });
        if let Some(known) = known {
            bimorph_base::budget::lay_out(known.pattern.bytes());
            return known;
        }
        let new = Arc::new(Self::new(count, edges, grounded, Pattern::new));
        LAST.with_borrow_mut(|last| {
            last.truncate(CACHED_LAYOUTS - 1);
            last.insert(0, Arc::clone(&new));
        });
        new
    }

    /// The same for one elimination that finds the targets of its updates on its way: the pattern of a large graph has none.
    #[inline]
    pub fn of_elimination(count: usize, edges: Vec<(usize, usize)>, grounded: Vec<usize>) -> Arc<Self> {
        match count {
            ..=MAX_VERTICES => Self::of(count, edges, grounded),
            _ => Arc::new(Self::new(count, edges, grounded, Pattern::without_targets)),
        }
    }

    fn new(
        count: usize,
        edges: Vec<(usize, usize)>,
        grounded: Vec<usize>,
        pattern: fn(usize, &[(usize, usize)]) -> Pattern,
    ) -> Self {
        let order = elimination_order(count, &edges, &grounded);
        let mut place = vec![0; count];
        for (k, &vertex) in order.iter().enumerate() {
            place[vertex] = k;
        }
        let placed: Vec<(usize, usize)> = edges.iter().map(|&(a, b)| (place[a], place[b])).collect();
        let pattern = Arc::new(pattern(count, &placed));
        Self { count, edges, grounded, order, place, pattern }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A graph that was laid out before has the layout that it has anew, whatever came between, and others do not get it.
    #[test]
    fn looked_up_is_laid_out_anew() {
        let chain = |n: usize| (1..n).map(|k| (k - 1, k)).collect::<Vec<_>>();
        for n in [3, 4, 3, 5, 6, 7, 8, 9, 10, 11, 12, 3, 4] {
            for grounded in [vec![0], vec![n - 1], vec![0]] {
                let (found, anew) = (
                    EliminationLayout::of(n, chain(n), grounded.clone()),
                    EliminationLayout::new(n, chain(n), grounded, Pattern::new),
                );
                assert_eq!((&found.order, &found.place, &found.pattern), (&anew.order, &anew.place, &anew.pattern));
            }
        }
        let again = || EliminationLayout::of(4, chain(4), vec![0]);
        assert!(Arc::ptr_eq(&again(), &again()));
    }
}
