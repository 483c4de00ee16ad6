//! Sets that join: which nodes, bodies or nets hang together.
//!
//! Reference: R. E. Tarjan, "Efficiency of a good but not linear set union algorithm" (1975); paths are halved, and of two
//! joined sets the smaller first member stands for both, so that nothing depends on the order of joining.

/// Disjoint sets of the numbers below a count.
#[derive(Debug, Clone)]
pub struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    /// Every number in a set of its own.
    #[inline]
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    /// The smallest member of the set of `of`.
    #[inline]
    pub fn first(&mut self, mut of: usize) -> usize {
        while self.parent[of] != of {
            self.parent[of] = self.parent[self.parent[of]];
            of = self.parent[of];
        }
        of
    }

    /// Joins two sets; false when they were one already.
    #[inline]
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.first(a), self.first(b));
        self.parent[a.max(b)] = a.min(b);
        a != b
    }

    /// Whether two numbers are in one set.
    #[inline]
    pub fn together(&mut self, a: usize, b: usize) -> bool {
        self.first(a) == self.first(b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joining in any order gives the same sets, each known by its smallest member.
    #[test]
    fn sets_do_not_depend_on_the_order() {
        let pairs = [(5, 3), (0, 6), (3, 1), (4, 6)];
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]] {
            let mut sets = Sets::new(7);
            assert!(order.iter().all(|&k| sets.join(pairs[k].0, pairs[k].1)));
            assert!(!sets.join(5, 1) && sets.together(4, 0) && !sets.together(2, 0));
            assert_eq!((0..7).map(|k| sets.first(k)).collect::<Vec<_>>(), [0, 1, 2, 1, 0, 1, 0]);
        }
    }
}
