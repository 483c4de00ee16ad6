//! Potentials of a resistive network that ports and sources drive.
//!
//! Quasi-static: a displacement current is taken to flow without a voltage drop in the mechanism's own resistances, whose
//! RC times (10 kΩ × 1 pF = 10 ns) are far below mechanical ones. Then every potential is a fixed linear function of the
//! source voltages, found once by modified nodal analysis (Ho, Ruehli, Brennan 1975), and by reciprocity the same numbers
//! divide displacement currents among the ports.

use crate::sets::Sets;
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// A network by node indices. Sources come in the order of the source vector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Circuit {
    /// Number of nodes.
    pub nodes: usize,
    /// Resistors (a, b, R [Ω]).
    pub resistors: Vec<(usize, usize, f64)>,
    /// Ideal voltage sources (plus, minus); no minus: ground.
    pub sources: Vec<(usize, Option<usize>)>,
    /// Nodes at ground.
    pub grounds: Vec<usize>,
}

/// The network's response to one volt on each source, the others at zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Potentials {
    /// ∂potential/∂source, nodes × sources [1].
    pub potential: DMatrix<f64>,
    /// ∂current/∂source, current into the network at a source's plus, sources × sources [S].
    pub conductance: DMatrix<f64>,
}

/// Sources that contradict each other: a loop of ideal sources, or one across ground.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("voltage source or port {source_index} closes a loop of ideal sources")]
pub struct SourceLoop {
    /// Index in [`Circuit::sources`].
    pub source_index: usize,
}

impl Circuit {
    /// Solves the network. A part that nothing ties to ground has its first node at 0 V.
    ///
    /// # Errors
    /// [`SourceLoop`].
    pub fn solve(&self) -> Result<Potentials, SourceLoop> {
        // spanning forest: sources first, to find loops of sources; then resistors, to find parts without ground
        let mut part = Sets::new(self.nodes + 1);
        let ground = self.nodes;
        for &node in &self.grounds {
            part.join(node, ground);
        }
        for (index, &(plus, minus)) in self.sources.iter().enumerate() {
            if !part.join(plus, minus.unwrap_or(ground)) {
                return Err(SourceLoop { source_index: index });
            }
        }
        for &(a, b, _) in &self.resistors {
            part.join(a, b);
        }
        let mut fixed = vec![false; self.nodes];
        for &node in &self.grounds {
            fixed[node] = true;
        }
        for (node, fix) in fixed.iter_mut().enumerate() {
            if !part.together(node, ground) {
                *fix = true;
                part.join(node, ground);
            }
        }
        let mut row = vec![usize::MAX; self.nodes];
        let mut free = 0;
        for (row, fixed) in row.iter_mut().zip(&fixed) {
            if !fixed {
                *row = free;
                free += 1;
            }
        }
        let size = free + self.sources.len();
        // the matrix and its factor, the right-hand sides and the solution, potentials and conductances
        let count = self.sources.len();
        crate::budget::lay_out_matrix(size, 2 * size + 2 * count);
        crate::budget::lay_out_matrix(self.nodes + count, count);
        let mut a = DMatrix::<f64>::zeros(size, size);
        for &(i, k, r) in &self.resistors {
            let (i, k, g) = (row[i], row[k], 1.0 / r);
            for (p, q) in [(i, k), (k, i)] {
                if p != usize::MAX {
                    a[(p, p)] += g;
                    if q != usize::MAX {
                        a[(p, q)] -= g;
                    }
                }
            }
        }
        for (s, &(plus, minus)) in self.sources.iter().enumerate() {
            for (node, sign) in [(Some(plus), 1.0), (minus, -1.0)] {
                if let Some(p) = node.map(|n| row[n]).filter(|&p| p != usize::MAX) {
                    a[(p, free + s)] -= sign;
                    a[(free + s, p)] += sign;
                }
            }
        }
        let mut rhs = DMatrix::<f64>::zeros(size, count);
        for s in 0..count {
            rhs[(free + s, s)] = 1.0;
        }
        let solution = if size == 0 { rhs } else { a.lu().solve(&rhs).ok_or(SourceLoop { source_index: 0 })? };
        let mut potential = DMatrix::zeros(self.nodes, count);
        for (node, &row) in row.iter().enumerate() {
            if row != usize::MAX {
                potential.set_row(node, &solution.row(row));
            }
        }
        Ok(Potentials { potential, conductance: solution.rows(free, count).into_owned() })
    }
}

impl Potentials {
    /// ∂(potential of a − potential of b)/∂source, one entry per source.
    pub fn difference(&self, a: usize, b: usize) -> DVector<f64> {
        (self.potential.row(a) - self.potential.row(b)).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A divider of 1 kΩ and 3 kΩ: a quarter of the drop, 0.25 mS into the port; a floating electrode is at 0 V.
    #[test]
    fn divider() {
        let circuit = Circuit {
            nodes: 4,
            resistors: vec![(0, 1, 1e3), (1, 2, 3e3)],
            sources: vec![(0, Some(2))],
            grounds: vec![2],
        };
        let p = circuit.solve().unwrap();
        assert!((p.potential[(1, 0)] - 0.75).abs() < 1e-14);
        assert!((p.conductance[(0, 0)] - 0.25e-3).abs() < 1e-17);
        assert_eq!(p.potential[(3, 0)], 0.0);
    }

    /// Two ideal sources in parallel contradict each other and are refused by index.
    #[test]
    fn parallel_sources_are_refused() {
        let circuit =
            Circuit { nodes: 2, resistors: vec![], sources: vec![(0, Some(1)), (1, Some(0))], grounds: vec![1] };
        assert_eq!(circuit.solve(), Err(SourceLoop { source_index: 1 }));
    }
}
