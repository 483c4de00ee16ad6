//! Potentials of nodes that conductors join, for given flows into them, by star–mesh transforms: a node is taken out, and its
//! conductors g become one between each two of its neighbours, gᵢ·gⱼ/Σg. In the order and on the pattern of
//! [`bimorph_multibody`] that is O(n) for chains and trees.
//!
//! Nothing is subtracted: every conductance is exact to a few roundings, also in a network with milliohms and teraohms.
//! The elimination is that of a weighted Laplacian G, without the cancellation on its diagonal.
//!
//! Reference: S. Rosen, "A new network theorem", J. IEE 62 (1924); W. K. Grassmann, M. I. Taksar, D. P. Heyman, "Regenerative
//! analysis and steady state distributions for Markov chains", Operations Research 33 (1985), for what it does to rounding.

use bimorph_multibody::Pattern;
use bimorph_multibody::layout::EliminationLayout;
use std::sync::Arc;

/// Nodes between two checks of the budget.
const NODES_PER_CHECK: usize = 1024;

/// A network, taken apart.
pub(super) struct Laplacian {
    pattern: Arc<Pattern>,
    /// Node by node, when it is taken out.
    turn: Vec<usize>,
    /// Conductances between nodes as they are when the first of the two is taken out, column by column of the pattern.
    between: Vec<f64>,
    /// Sum of a node's conductances then, ground included, in order of elimination.
    sum: Vec<f64>,
}

impl Laplacian {
    /// Of `size` nodes whose potentials are not known, joined by conductors (a, b, conductance above 0); none: a node whose potential is
    /// 0. `None` where a node has no conductor, or numbers are beyond the range of doubles.
    pub(super) fn new(
        size: usize,
        conductors: impl Iterator<Item = (Option<usize>, Option<usize>, f64)>,
    ) -> Option<Self> {
        let mut to_ground = vec![0.0; size];
        let (mut edges, mut conductances) = (Vec::new(), Vec::new());
        for (a, b, g) in conductors {
            match (a, b) {
                (Some(a), Some(b)) if a != b => {
                    edges.push((a, b));
                    conductances.push(g);
                }
                (Some(node), None) | (None, Some(node)) => to_ground[node] += g,
                _ => {}
            }
        }
        let grounded: Vec<usize> = (0..size).filter(|k| to_ground[*k] > 0.0).collect();
        let layout = EliminationLayout::of_elimination(size, edges.clone(), grounded);
        let EliminationLayout { order, place: turn, pattern, .. } = &*layout;
        let mut between = vec![0.0; pattern.off_blocks()];
        for ((a, b), g) in edges.into_iter().map(|(a, b)| (turn[a], turn[b])).zip(conductances) {
            between[pattern.block(a.max(b), a.min(b))?] += g;
        }
        let mut ground: Vec<f64> = order.iter().map(|node| to_ground[*node]).collect();
        let mut sum = vec![0.0; size];
        for j in 0..size {
            if j.is_multiple_of(NODES_PER_CHECK) {
                bimorph_base::budget::check();
            }
            let column = pattern.column(j);
            sum[j] = ground[j] + between[column.clone()].iter().sum::<f64>();
            if !(sum[j] > 0.0 && sum[j].is_finite()) {
                return None;
            }
            for (k, &row) in column.clone().zip(pattern.rows(j)) {
                let share = between[k] / sum[j];
                ground[row as usize] += share * ground[j];
                // the rows below are among those of this row's own column: both ascend
                let own = &mut pattern.column(row as usize).zip(pattern.rows(row as usize));
                for i in k + 1..column.end {
                    let below = pattern.row(i) as u32;
                    if let Some((at, _)) = own.find(|(_, at)| **at == below) {
                        between[at] += share * between[i];
                    }
                }
            }
        }
        Some(Self { pattern: Arc::clone(pattern), turn: turn.clone(), between, sum })
    }

    /// Potentials for the flows into the nodes, in place, column after column.
    pub(super) fn solve(&self, flows: &mut [f64]) {
        let Self { pattern, turn, between, sum } = self;
        let mut now = vec![0.0; sum.len()];
        for column in flows.chunks_exact_mut(sum.len().max(1)) {
            bimorph_base::budget::check();
            column.iter().zip(turn).for_each(|(flow, k)| now[*k] = *flow);
            for j in 0..now.len() {
                now[j] /= sum[j];
                for (g, &row) in between[pattern.column(j)].iter().zip(pattern.rows(j)) {
                    now[row as usize] += g * now[j];
                }
            }
            for j in (0..now.len()).rev() {
                for (g, &row) in between[pattern.column(j)].iter().zip(pattern.rows(j)) {
                    now[j] += g / sum[j] * now[row as usize];
                }
            }
            column.iter_mut().zip(turn).for_each(|(potential, k)| *potential = now[*k]);
        }
    }
}

#[cfg(test)]
mod tests {
    //! A chain against what series and parallel say; a size that a dense matrix could not have, and sizes of conductors far apart.
    use super::*;

    /// A chain of 100 000 conductors of 1 S from ground to the last node: a flow of 1 there makes the potentials 1, 2, 3 ….
    #[test]
    fn chain() {
        let n: usize = 100_000;
        let conductors = (0..n).map(|k| (k.checked_sub(1), Some(k), 1.0));
        let laplacian = Laplacian::new(n, conductors).unwrap();
        let mut flow = vec![0.0; n];
        flow[n - 1] = 1.0;
        laplacian.solve(&mut flow);
        assert!(flow.iter().enumerate().all(|(k, v)| (v / (k + 1) as f64 - 1.0).abs() < 1e-9));
        // no fill
        assert_eq!(laplacian.between.len(), n - 1);
    }

    /// Two nodes joined by 1 kS, each on ground through 1e-15 S: a flow of 1 into the first puts both at 1/2e-15 V, to rounding, where the
    /// matrix 1000 + 1e-15 has lost the ground.
    #[test]
    fn milliohms_beside_teraohms() {
        let conductors = [(Some(0), Some(1), 1e3), (Some(0), None, 1e-15), (None, Some(1), 1e-15)];
        let laplacian = Laplacian::new(2, conductors.into_iter()).unwrap();
        let mut flow = [1.0, 0.0];
        laplacian.solve(&mut flow);
        assert!(flow.iter().all(|v| (v * 2e-15 - 1.0).abs() < 1e-14), "{flow:?}");
    }

    /// A flow into known potentials alone changes nothing; a node without a conductor has no potential.
    #[test]
    fn extremes() {
        Laplacian::new(0, std::iter::empty()).unwrap().solve(&mut []);
        assert!(Laplacian::new(2, [(Some(0), None, 1.0)].into_iter()).is_none());
        assert!(Laplacian::new(1, [(Some(0), None, f64::INFINITY)].into_iter()).is_none());
    }
}
