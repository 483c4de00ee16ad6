//! Potentials of a resistive network that ports and sources drive.
//!
//! Quasi-static: a displacement current is taken to flow without a voltage drop in the mechanism's own resistances, whose
//! RC times (10 kΩ × 1 pF = 10 ns) are far below mechanical ones. Then every potential is a fixed linear function of the
//! source voltages, found once by nodal analysis, and by reciprocity the same numbers divide displacement currents among the ports.
//!
//! Ideal sources form a forest: the nodes of a tree have one unknown potential, or none where it touches ground, and
//! differ by the sources between them. The remaining network consists of conductors (`laplacian`). The current of each
//! source is the current that leaves the part of its tree beyond it.

mod source_tree;

use super::laplacian::Laplacian;
use bimorph_base::sets::Sets;
use nalgebra::{DMatrix, DVector};
pub(super) use source_tree::KnownPotentials;
use thiserror::Error;

/// A network by node indices. Sources come in the order of the source vector.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ElectricalNetwork {
    /// Number of nodes.
    pub nodes: usize,
    /// Resistors (a, b, R (Ω)).
    pub resistors: Vec<(usize, usize, f64)>,
    /// Ideal voltage sources (plus, minus); no minus: ground.
    pub sources: Vec<(usize, Option<usize>)>,
    /// Nodes at ground.
    pub grounds: Vec<usize>,
}

/// The network's response to one volt on each source, the others at zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Potentials {
    /// ∂potential/∂source, nodes × sources (1).
    pub potential: DMatrix<f64>,
    /// ∂current/∂source, current into the network at a source's plus, sources × sources (S).
    pub conductance: DMatrix<f64>,
}

/// Why a network has no potentials.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CircuitError {
    /// Sources that contradict each other: a loop of ideal sources, or one across ground.
    #[error("voltage source or port {source_index} closes a loop of ideal sources")]
    SourceLoop {
        /// Index in [`ElectricalNetwork::sources`].
        source_index: usize,
    },
    /// Conductances whose sums or quotients are beyond what doubles hold.
    #[error("conductances are too large or too small to be computed with; the largest is that of resistor {resistor}")]
    Range {
        /// Index of the smallest resistance in [`ElectricalNetwork::resistors`].
        resistor: usize,
    },
}

impl ElectricalNetwork {
    /// Potentials that sources fix, and the conductors between the others.
    fn reduced(&self) -> Result<(KnownPotentials, Laplacian), CircuitError> {
        // spanning forest: sources first, to find loops of sources; then resistors, to find parts without ground
        let mut part = Sets::new(self.nodes + 1);
        let ground = self.nodes;
        for &node in &self.grounds {
            part.join(node, ground);
        }
        for (index, &(plus, minus)) in self.sources.iter().enumerate() {
            if !part.join(plus, minus.unwrap_or(ground)) {
                return Err(CircuitError::SourceLoop { source_index: index });
            }
        }
        for &(a, b, _) in &self.resistors {
            bimorph_base::budget::check();
            part.join(a, b);
        }
        let known = KnownPotentials::new((self.nodes, &self.grounds), &self.sources, &mut part, ground);
        let conductors = self.resistors.iter().map(|&(a, b, r)| (known.row[a], known.row[b], 1.0 / r));
        let laplacian = Laplacian::new(known.free, conductors).ok_or_else(|| self.out_of_range())?;
        Ok((known, laplacian))
    }

    /// Solves the network. A part that nothing ties to ground has its first node at 0 V.
    ///
    /// # Errors
    /// [`CircuitError`].
    pub fn solve(&self) -> Result<Potentials, CircuitError> {
        let (known, laplacian) = self.reduced()?;
        let count = self.sources.len();
        let free = known.free;
        // right-hand sides with their solutions, potentials with what sources fix of them, and conductances
        bimorph_base::budget::lay_out_matrix(free + 2 * self.nodes + 2 * count, count);
        let mut flows = vec![0.0; free * count];
        for &(a, b, r) in &self.resistors {
            bimorph_base::budget::check();
            for (from, to) in [(a, b), (b, a)] {
                let Some(row) = known.row[from] else { continue };
                for (s, sign) in known.offset(from) {
                    flows[s * free + row] -= sign / r;
                }
                for (s, sign) in known.offset(to) {
                    flows[s * free + row] += sign / r;
                }
            }
        }
        laplacian.solve(&mut flows);
        let mut potential = DMatrix::zeros(self.nodes, count);
        for node in 0..self.nodes {
            if let Some(row) = known.row[node] {
                for s in 0..count {
                    potential[(node, s)] = flows[s * free + row];
                }
            }
            for (s, sign) in known.offset(node) {
                potential[(node, s)] += sign;
            }
        }
        Ok(Potentials { conductance: self.conductance(&known, &potential), potential })
    }

    /// Resistances between pairs of nodes (Ω): the voltage of each pair for a current that flows into the first node of another and out of its second,
    /// with all sources at 0 V.
    ///
    /// # Errors
    /// [`CircuitError`].
    pub fn resistances(&self, pairs: &[[usize; 2]]) -> Result<DMatrix<f64>, CircuitError> {
        let (known, laplacian) = self.reduced()?;
        let free = known.free;
        bimorph_base::budget::lay_out_matrix(free + pairs.len(), pairs.len());
        let mut flows = vec![0.0; free * pairs.len()];
        for (k, pair) in pairs.iter().enumerate() {
            for (node, sign) in pair.iter().zip([1.0, -1.0]) {
                if let Some(row) = known.row[*node] {
                    flows[k * free + row] += sign;
                }
            }
        }
        laplacian.solve(&mut flows);
        let potential = |node: usize, k: usize| known.row[node].map_or(0.0, |row| flows[k * free + row]);
        Ok(DMatrix::from_fn(pairs.len(), pairs.len(), |i, k| potential(pairs[i][0], k) - potential(pairs[i][1], k)))
    }

    /// Part of each node that no ground and none of the first `ports` sources fixes, and the number of these parts. The nodes of `held` count as
    /// ground.
    pub fn floating_parts(&self, ports: usize, held: impl Iterator<Item = usize>) -> (Vec<Option<usize>>, usize) {
        let ground = self.nodes;
        let mut part = Sets::new(self.nodes + 1);
        for node in self.grounds.iter().copied().chain(held) {
            part.join(node, ground);
        }
        for (k, &(plus, minus)) in self.sources.iter().enumerate() {
            part.join(plus, minus.unwrap_or(ground));
            if k < ports {
                part.join(plus, ground);
            }
        }
        for &(a, b, _) in &self.resistors {
            bimorph_base::budget::check();
            part.join(a, b);
        }
        let (mut number, mut count) = (vec![None; self.nodes + 1], 0);
        let of = (0..self.nodes).map(|node| {
            let root = part.first(node);
            (root != part.first(ground)).then(|| {
                *number[root].get_or_insert_with(|| {
                    count += 1;
                    count - 1
                })
            })
        });
        (of.collect(), count)
    }

    fn out_of_range(&self) -> CircuitError {
        let resistance = |k: &usize| self.resistors[*k].2;
        let smallest = (0..self.resistors.len()).min_by(|a, b| resistance(a).total_cmp(&resistance(b)));
        CircuitError::Range { resistor: smallest.unwrap_or(0) }
    }

    /// Current into the network at the plus of each source: the current that leaves the nodes beyond it.
    fn conductance(&self, known: &KnownPotentials, potential: &DMatrix<f64>) -> DMatrix<f64> {
        let count = self.sources.len();
        // what leaves each node that a source touches
        let mut place = vec![usize::MAX; self.nodes];
        for (k, node) in known.order.iter().map(|step| step.node).enumerate() {
            place[node] = k;
        }
        let mut leaves = DMatrix::<f64>::zeros(known.order.len(), count);
        for &(a, b, r) in &self.resistors {
            for (from, to) in [(a, b), (b, a)] {
                if place[from] != usize::MAX {
                    for s in 0..count {
                        leaves[(place[from], s)] += (potential[(from, s)] - potential[(to, s)]) / r;
                    }
                }
            }
        }
        let mut conductance = DMatrix::zeros(count, count);
        for (k, step) in known.order.iter().enumerate().rev() {
            let Some((source, sign, parent)) = step.by else { continue };
            let parent = parent.map(|node| place[node]).filter(|k| *k != usize::MAX);
            for s in 0..count {
                let leaves_here = leaves[(k, s)];
                conductance[(source, s)] = leaves_here * sign;
                if let Some(parent) = parent {
                    leaves[(parent, s)] += leaves_here;
                }
            }
        }
        conductance
    }
}

impl Potentials {
    /// ∂(potential of a − potential of b)/∂source, one entry per source.
    #[inline]
    pub fn difference(&self, a: usize, b: usize) -> DVector<f64> {
        DVector::from_fn(self.potential.ncols(), |s, _| self.potential[(a, s)] - self.potential[(b, s)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A divider of 1 kΩ and 3 kΩ: a quarter of the drop, 0.25 mS into the port; a floating electrode is at 0 V.
    #[test]
    fn divider() {
        let circuit = ElectricalNetwork {
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

    /// Resistances between pairs of nodes: those of a star of 1, 2 and 3 Ω between a source and ground, by hand. A pair that sources hold has none, and a floating one,
    /// whose parts nothing joins, has none either.
    #[test]
    fn resistances_of_a_star() {
        let circuit = ElectricalNetwork {
            nodes: 6,
            resistors: vec![(0, 3, 1.0), (1, 3, 2.0), (2, 3, 3.0)],
            sources: vec![(0, Some(2))],
            grounds: vec![2],
        };
        let found = circuit.resistances(&[[1, 2], [3, 2], [0, 2], [1, 0], [4, 5]]).unwrap();
        // the middle sees 1 Ω and 3 Ω in parallel, and node 1 has 2 Ω in front of that
        let expected = [[2.75, 0.75, 0.0, 2.75, 0.0], [0.75, 0.75, 0.0, 0.75, 0.0]];
        for (row, expected) in expected.iter().enumerate() {
            for (column, expected) in expected.iter().enumerate() {
                assert!((found[(row, column)] - expected).abs() < 1e-14, "{found}");
                assert!((found[(column, row)] - expected).abs() < 1e-14, "{found}");
            }
        }
        assert!(found.row(2).amax() == 0.0 && found.row(4).amax() == 0.0, "{found}");
    }

    /// Sources in a chain above ground, one that floats between resistors, and one to ground the other way round: potentials and currents as
    /// by modified nodal analysis (Ho, Ruehli, Brennan 1975) with a dense matrix.
    #[test]
    fn like_modified_nodal_analysis() {
        let circuit = ElectricalNetwork {
            nodes: 9,
            resistors: vec![
                (1, 2, 1e3),
                (2, 3, 2e3),
                (4, 5, 500.0),
                (5, 0, 300.0),
                (3, 6, 50.0),
                (6, 1, 7e3),
                (7, 8, 1e3),
            ],
            sources: vec![(1, None), (2, Some(1)), (3, Some(4)), (0, Some(5)), (7, None)],
            grounds: vec![8],
        };
        let (n, count) = (circuit.nodes, circuit.sources.len());
        let mut a = DMatrix::<f64>::zeros(n + count, n + count);
        for &(i, k, r) in &circuit.resistors {
            for (p, q) in [(i, k), (k, i)] {
                a[(p, p)] += 1.0 / r;
                a[(p, q)] -= 1.0 / r;
            }
        }
        for (s, &(plus, minus)) in circuit.sources.iter().enumerate() {
            for (node, sign) in [(Some(plus), 1.0), (minus, -1.0)] {
                if let Some(node) = node {
                    a[(node, n + s)] -= sign;
                    a[(n + s, node)] += sign;
                }
            }
        }
        for k in 0..n + count {
            a[(8, k)] = if k == 8 { 1.0 } else { 0.0 };
        }
        let mut rhs = DMatrix::<f64>::zeros(n + count, count);
        (0..count).for_each(|s| rhs[(n + s, s)] = 1.0);
        let dense = a.lu().solve(&rhs).unwrap();
        let found = circuit.solve().unwrap();
        assert!((&found.potential - dense.rows(0, n)).amax() < 1e-12, "{} {}", found.potential, dense.rows(0, n));
        let currents = dense.rows(n, count);
        assert!((&found.conductance - currents).amax() < 1e-12 * currents.amax(), "{} {currents}", found.conductance);
    }

    /// A ladder of 100 000 nodes, 1 kΩ along and 1 MΩ to ground: far from its end it has its characteristic resistance
    /// R/2 + √(R²/4 + R·G⁻¹).
    #[test]
    fn a_long_ladder() {
        let n = 100_000;
        let mut resistors: Vec<(usize, usize, f64)> = (0..n - 1).map(|k| (k, k + 1, 1e3)).collect();
        resistors.extend((1..n).map(|k| (k, n, 1e6)));
        let circuit = ElectricalNetwork { nodes: n + 1, resistors, sources: vec![(0, Some(n))], grounds: vec![n] };
        let found = circuit.solve().unwrap();
        let characteristic = 500.0 + (500.0f64.powi(2) + 1e9).sqrt();
        assert!((found.conductance[(0, 0)] * characteristic - 1.0).abs() < 1e-12);
        let ratio = 1.0 - 1e3 / characteristic;
        assert!((found.potential[(50, 0)] - ratio.powi(50)).abs() < 1e-12);
    }

    /// A grid of 120 × 120 nodes of 1 Ω with a volt between two opposite corners: by symmetry the other diagonal is at half of it, and as much
    /// flows into one corner as out of the other.
    #[test]
    fn a_grid() {
        let side = 120;
        let at = |x: usize, y: usize| y * side + x;
        let along = (0..side).flat_map(|y| (0..side - 1).map(move |x| (at(x, y), at(x + 1, y), 1.0)));
        let across = (0..side - 1).flat_map(|y| (0..side).map(move |x| (at(x, y), at(x, y + 1), 1.0)));
        let corner = at(side - 1, side - 1);
        let circuit = ElectricalNetwork {
            nodes: side * side,
            resistors: along.chain(across).collect(),
            sources: vec![(0, Some(corner))],
            grounds: vec![corner],
        };
        let found = circuit.solve().unwrap();
        assert!((0..side).all(|x| (found.potential[(at(x, side - 1 - x), 0)] - 0.5).abs() < 1e-11));
        // two resistors leave the corner
        let out = 2.0 * (1.0 - found.potential[(1, 0)]);
        assert!((found.conductance[(0, 0)] / out - 1.0).abs() < 1e-12);
        let into = 2.0 * found.potential[(at(side - 2, side - 1), 0)];
        assert!((out / into - 1.0).abs() < 1e-9);
    }

    /// Parts that float: resistors and sources join nodes, and grounds, ports and held nodes tie them.
    #[test]
    fn parts_that_float() {
        let circuit = ElectricalNetwork {
            nodes: 9,
            resistors: vec![(0, 1, 1e3), (3, 4, 1e3), (5, 6, 1.0)],
            sources: vec![(1, Some(2)), (4, Some(7))],
            grounds: vec![5],
        };
        let (parts, count) = circuit.floating_parts(1, std::iter::once(8));
        assert_eq!(count, 1);
        assert_eq!(parts, [None, None, None, Some(0), Some(0), None, None, Some(0), None]);
    }

    /// Two ideal sources in parallel contradict each other and are refused by index.
    #[test]
    fn parallel_sources_are_refused() {
        let circuit = ElectricalNetwork {
            nodes: 2,
            resistors: vec![],
            sources: vec![(0, Some(1)), (1, Some(0))],
            grounds: vec![1],
        };
        assert_eq!(circuit.solve(), Err(CircuitError::SourceLoop { source_index: 1 }));
    }

    /// Infinite conductances, or conductances with an infinite sum, are reported by the smallest resistance, also
    /// without any source.
    #[test]
    fn conductances_out_of_range_are_reported() {
        for resistors in [vec![(0, 1, 1.0), (0, 1, 1e-310)], vec![(0, 1, 1.01e-308), (0, 1, 1e-308)]] {
            let circuit = ElectricalNetwork { nodes: 3, resistors, sources: vec![], grounds: vec![1] };
            assert_eq!(circuit.solve(), Err(CircuitError::Range { resistor: 1 }));
        }
    }
}
