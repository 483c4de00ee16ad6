//! Currents and potentials at given rises.

use super::{Flows, HotNetwork, NodeMatrix};

impl HotNetwork {
    /// Currents and potentials at a state and source voltages.
    pub(super) fn conduct(&self, state: &[f64], u: &[f64]) -> Flows<f64> {
        let mut means = vec![0.0; self.values_of_a_beam() * self.bars.len()];
        self.means(state, &mut means);
        self.flows(&means, u, |_| 0.0)
    }

    /// Change of currents and potentials with the mean rises (K) and the source voltages (V), at mean rises and currents.
    pub(crate) fn flow_change(&self, means: &[f64], flows: &Flows<f64>, rises: &[f64], du: &[f64]) -> Flows<f64> {
        let beams = self.bars.len();
        self.flows(means, du, |k| {
            let cold = -flows.current[k] * self.bars[k].resistance;
            if self.curved { cold * rises[2 * beams + k] } else { cold * self.bars[k].coefficient * rises[k] }
        })
    }

    /// Currents and potentials at mean rises and source voltages, with a source in each beam: from `a` to `b` (V).
    pub(crate) fn flows(&self, means: &[f64], u: &[f64], inside: impl Fn(usize) -> f64) -> Flows<f64> {
        let layout = &*self.electrical.0;
        let mut matrix = NodeMatrix::default();
        matrix.clear(layout);
        let mut potential = vec![0.0; self.known.free];
        let hot: Vec<(f64, f64)> =
            (self.bars.iter().enumerate()).map(|(k, _)| (self.resistance(k, means), inside(k))).collect();
        let bars = self.ends.iter().zip(&hot).map(|(ends, (r, inside))| (*ends, *r, *inside));
        for ([a, b], r, inside) in self.resistors.iter().map(|&(a, b, r)| ([a, b], r, 0.0)).chain(bars) {
            let given = (self.offset([a, b], u) + inside) / r;
            for (near, far, sign) in [(a, b, 1.0), (b, a, -1.0)] {
                let Some(row) = self.known.row[near] else { continue };
                matrix.add(layout, (row, row), 1.0 / r);
                if let Some(column) = self.known.row[far] {
                    matrix.add(layout, (row, column), -1.0 / r);
                }
                potential[row] -= sign * given;
            }
        }
        matrix.factor(layout);
        matrix.solve(layout, &mut potential);
        let volts = |ends: &[usize; 2]| self.offset(*ends, u) + self.unknown(*ends, &potential);
        let through = |(ends, (r, inside)): (&[usize; 2], &(f64, f64))| (volts(ends) + inside) / r;
        Flows { current: self.ends.iter().zip(&hot).map(through).collect(), potential }
    }

    /// Current into the network at the plus of each source (A), of flows or of their changes with source voltages `u`.
    pub(crate) fn source_currents(&self, flows: &Flows<f64>, u: &[f64]) -> Vec<f64> {
        let mut leaves = vec![0.0; self.rise.len()];
        let through =
            |r: &(usize, usize, f64)| (self.offset([r.0, r.1], u) + self.unknown([r.0, r.1], &flows.potential)) / r.2;
        let wires = self.resistors.iter().map(|r| ([r.0, r.1], through(r)));
        for ([a, b], current) in wires.chain(self.ends.iter().copied().zip(flows.current.iter().copied())) {
            leaves[a] += current;
            leaves[b] -= current;
        }
        let mut currents = vec![0.0; self.sources];
        for step in self.known.order.iter().rev() {
            let Some((source, sign, parent)) = step.by else { continue };
            let here = leaves[step.node];
            currents[source] = here * sign;
            if let Some(parent) = parent {
                leaves[parent] += here;
            }
        }
        currents
    }
}
