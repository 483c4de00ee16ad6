//! Conductors that no port, source or ground fixes. Each keeps its charge, which is 0.
//!
//! The voltage of a gap is V = v + B·φ: v of the sources, with such conductors at 0 V, and φ their potentials. No current reaches them:
//! ```text
//! Bᵀ·C·V = 0      φ = −S⁻¹·Bᵀ·C·v      S = Bᵀ·C·B
//! ```
//! This φ makes the potential Π stationary, so that forces and charges of sources are those of the voltages V. The tangent has k·S⁻¹·kᵀ more,
//! k the change of the forces with φ: fixed charge is stiffer than fixed voltage (S. D. Senturia, "Microsystem Design", 2001, section 6.3).

use bimorph_base::sets::Sets;

/// Pivot below which the capacitance of a conductor is rounding, of its diagonal (1).
const SMALLEST_PIVOT: f64 = 1e-12;

/// A gap with a conductor of the group at a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FloatingGap {
    /// Its number.
    pub gap: usize,
    /// Conductor of the group at its plus and at its minus; none: another potential.
    pub sides: [Option<usize>; 2],
}

/// Conductors whose potentials depend on each other.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FloatingGroup {
    /// Gaps between them, and to other potentials.
    pub gaps: Vec<FloatingGap>,
    /// Number of conductors.
    pub conductors: usize,
}

/// The number of a gap, and at either side its node, with the conductor of that where it floats.
pub type GapNodes = (usize, [(usize, Option<usize>); 2]);

/// All conductors that float.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FloatingConductors {
    groups: Vec<FloatingGroup>,
    /// Group of each gap.
    of_gaps: Vec<Option<usize>>,
}

impl FloatingConductors {
    /// Of `gaps` gaps; `drawn` lists their numbers with the nodes at either side and the floating conductors of these, of `count` in all.
    ///
    /// A group whose gaps lead to one other potential alone would be at that, without a field: it stays at 0 V. A group without another potential
    /// has its first conductor at 0 V.
    pub fn new((gaps, count): (usize, usize), drawn: &[GapNodes]) -> Self {
        let mut sets = Sets::new(count);
        for (_, sides) in drawn {
            if let [(_, Some(a)), (_, Some(b))] = *sides {
                sets.join(a, b);
            }
        }
        // other potentials that each group is at: one, or several
        let mut tied: Vec<Option<(usize, bool)>> = vec![None; count];
        for (_, sides) in drawn {
            let (side, node) = match *sides {
                [(node, None), (_, Some(side))] | [(_, Some(side)), (node, None)] => (side, node),
                _ => continue,
            };
            let tie = &mut tied[sets.first(side)];
            *tie = Some(tie.map_or((node, false), |(first, several)| (first, several || first != node)));
        }
        let mut all = Self { groups: Vec::new(), of_gaps: vec![None; gaps] };
        let (mut group_of, mut place) = (vec![None; count], vec![None; count]);
        for (gap, sides) in drawn.iter().map(|(gap, [(_, a), (_, b)])| (*gap, [*a, *b])).filter(|(_, [a, b])| a != b) {
            let Some(root) = sides[0].or(sides[1]).map(|side| sets.first(side)) else { continue };
            if tied[root].is_some_and(|(_, several)| !several) {
                continue;
            }
            let group = *group_of[root].get_or_insert_with(|| {
                all.groups.push(FloatingGroup::default());
                all.groups.len() - 1
            });
            let conductors = &mut all.groups[group].conductors;
            let sides = sides.map(|side| {
                let side = side.filter(|side| tied[root].is_some() || *side != root)?;
                Some(*place[side].get_or_insert_with(|| {
                    *conductors += 1;
                    *conductors - 1
                }))
            });
            all.groups[group].gaps.push(FloatingGap { gap, sides });
            all.of_gaps[gap] = Some(group);
        }
        all
    }

    /// True where no conductor of a gap floats.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// The groups.
    #[inline]
    pub fn groups(&self) -> &[FloatingGroup] {
        &self.groups
    }

    /// The group of a gap; none: its voltage is that of sources.
    #[inline]
    pub fn of_gap(&self, gap: usize) -> Option<&FloatingGroup> {
        self.of_gaps.get(gap).copied().flatten().map(|group| &self.groups[group])
    }
}

impl FloatingGroup {
    /// The factor of S at the capacitance of each gap (F).
    pub fn factor(&self, capacitance: impl Fn(usize) -> f64) -> FloatingFactor {
        let n = self.conductors;
        bimorph_base::budget::lay_out_matrix(n, n);
        let mut lower = vec![0.0; n * n];
        for FloatingGap { gap, sides } in &self.gaps {
            let c = capacitance(*gap);
            match *sides {
                [Some(a), Some(b)] => {
                    lower[a * n + a] += c;
                    lower[b * n + b] += c;
                    lower[a.max(b) * n + a.min(b)] -= c;
                }
                [Some(a), None] | [None, Some(a)] => lower[a * n + a] += c,
                [None, None] => {}
            }
        }
        FloatingFactor::new(n, lower)
    }

    /// Bᵀ·x of values on gaps.
    pub fn gathered(&self, of_gap: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.conductors];
        for FloatingGap { gap, sides } in &self.gaps {
            let x = of_gap(*gap);
            for (side, sign) in sides.iter().zip([1.0, -1.0]) {
                if let Some(conductor) = side {
                    sums[*conductor] += sign * x;
                }
            }
        }
        sums
    }

    /// `volts += B·φ`.
    pub fn spread(&self, phi: &[f64], volts: &mut [f64]) {
        for FloatingGap { gap, sides } in &self.gaps {
            for (side, sign) in sides.iter().zip([1.0, -1.0]) {
                if let Some(conductor) = side {
                    volts[*gap] += sign * phi[*conductor];
                }
            }
        }
    }
}

/// Factor L of S = L·Lᵀ. A conductor without capacitance stays at 0 V.
#[derive(Debug, Clone, PartialEq)]
pub struct FloatingFactor {
    n: usize,
    lower: Vec<f64>,
}

impl FloatingFactor {
    fn new(n: usize, mut lower: Vec<f64>) -> Self {
        for k in 0..n {
            bimorph_base::budget::check();
            let drawn = lower[k * n + k];
            let pivot = drawn - (0..k).map(|i| lower[k * n + i].powi(2)).sum::<f64>();
            if pivot <= SMALLEST_PIVOT * drawn {
                (0..=k).for_each(|i| lower[k * n + i] = 0.0);
                (k + 1..n).for_each(|row| lower[row * n + k] = 0.0);
                continue;
            }
            let root = pivot.sqrt();
            lower[k * n + k] = root;
            for row in k + 1..n {
                let dot: f64 = (0..k).map(|i| lower[row * n + i] * lower[k * n + i]).sum();
                lower[row * n + k] = (lower[row * n + k] - dot) / root;
            }
        }
        Self { n, lower }
    }

    /// `x = L⁻¹·x`.
    pub fn forward(&self, x: &mut [f64]) {
        for k in 0..self.n {
            let row = &self.lower[k * self.n..=k * self.n + k];
            let dot: f64 = row[..k].iter().zip(x.iter()).map(|(l, x)| l * x).sum();
            x[k] = if row[k] == 0.0 { 0.0 } else { (x[k] - dot) / row[k] };
        }
    }

    /// `x = S⁻¹·x`.
    pub fn solve(&self, x: &mut [f64]) {
        self.forward(x);
        for k in (0..self.n).rev() {
            let dot: f64 = (k + 1..self.n).map(|row| self.lower[row * self.n + k] * x[row]).sum();
            let pivot = self.lower[k * self.n + k];
            x[k] = if pivot == 0.0 { 0.0 } else { (x[k] - dot) / pivot };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three capacitors of 1, 2 and 4 F in series at 7 V have the voltages 4, 2 and 1 V, since their charges are equal. A conductor between gaps that nothing
    /// else joins stays at 0 V.
    #[test]
    fn capacitors_in_series() {
        let at = |node: usize| (node, None);
        let floats = |conductor: usize| (conductor, Some(conductor));
        let drawn = [
            (0, [at(8), floats(0)]),
            (1, [floats(0), floats(1)]),
            (2, [floats(1), at(9)]),
            (3, [floats(2), floats(3)]),
        ];
        let floating = FloatingConductors::new((4, 4), &drawn);
        assert_eq!(floating.groups().len(), 2);
        let (c, mut volts) = ([1.0, 2.0, 4.0, 8.0], [7.0, 0.0, 0.0, 0.0]);
        for group in floating.groups() {
            let mut phi = group.gathered(|gap| -c[gap] * volts[gap]);
            group.factor(|gap| c[gap]).solve(&mut phi);
            group.spread(&phi, &mut volts);
        }
        for (found, expected) in volts.iter().zip([4.0, 2.0, 1.0, 0.0]) {
            assert!((found - expected).abs() < 1e-14, "{volts:?}");
        }
    }

    /// A conductor without capacitance has no potential of its own, whatever the others have.
    #[test]
    fn a_conductor_without_capacitance_stays_at_zero() {
        let (one, other, middle) = ((8, None), (9, None), (0, Some(0)));
        let drawn = [(0, [one, middle]), (1, [middle, (1, Some(1))]), (2, [middle, other])];
        let floating = FloatingConductors::new((3, 2), &drawn);
        let (c, mut volts) = ([2.0, 0.0, 2.0], [3.0, 0.0, 0.0]);
        let group = &floating.groups()[0];
        let mut phi = group.gathered(|gap| -c[gap] * volts[gap]);
        group.factor(|gap| c[gap]).solve(&mut phi);
        group.spread(&phi, &mut volts);
        assert_eq!((volts[0], volts[2]), (1.5, 1.5));
        assert_eq!(phi[1], 0.0);
        // with one other potential there is no field
        assert!(FloatingConductors::new((3, 2), &drawn[..2]).is_empty());
    }
}
