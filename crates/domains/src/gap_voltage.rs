//! Voltages and charges of gaps at a configuration, with those of conductors that float ([`super::floating`]).
//!
//! The voltages of a [`super::drive::Drive`] are those with all of these conductors at 0 V. Without any, both are the same.

use super::domain::Domain;
use super::floating::FloatingGroup;
use super::system::System;
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyId, BodyMatrix};
use nalgebra::Matrix6;
use std::borrow::Cow;

impl System {
    /// Voltage of each gap at `q` (V), `volts` those with floating conductors at 0 V.
    #[inline]
    pub fn gap_voltages<'a>(&self, q: &[Pose], volts: &'a [f64]) -> Cow<'a, [f64]> {
        if self.electrics.floating.is_empty() { Cow::Borrowed(volts) } else { Cow::Owned(self.floated(q, volts)) }
    }

    /// Change of [`System::gap_voltages`] with a change of the configuration and of the voltages.
    #[inline]
    pub fn gap_voltage_slopes<'a>(
        &self,
        (q, volts): (&[Pose], &[f64]),
        (dq, change): (&[Pose], &'a [f64]),
    ) -> Cow<'a, [f64]> {
        if self.electrics.floating.is_empty() {
            return Cow::Borrowed(change);
        }
        let at_rest = self.floated(q, volts);
        let mut moved = change.to_vec();
        for group in self.electrics.floating.groups() {
            let mut phi = group.gathered(|gap| {
                -(self.capacitance_slope(gap, q, dq) * at_rest[gap] + self.capacitance(gap, q) * change[gap])
            });
            group.factor(|gap| self.capacitance(gap, q)).solve(&mut phi);
            group.spread(&phi, &mut moved);
        }
        Cow::Owned(moved)
    }

    /// Voltages whose squares give the discrete forces of a step with the configurations `q` at its start, middle and end.
    ///
    /// Where φ keeps charges, ½·ΔΣC·V² is ½·Σ ΔC·V₀·V₁, with the voltages V₀ and V₁ of the ends: their product stands for V². One below 0
    /// counts as 0.
    #[inline]
    pub(super) fn quotient_voltages<'a>(&self, q: [&[Pose]; 3], volts: &'a [f64]) -> Cow<'a, [f64]> {
        if self.electrics.floating.is_empty() {
            return Cow::Borrowed(volts);
        }
        let mut ends = self.floated(q[0], volts);
        let other = self.floated(q[2], volts);
        for (gap, (start, end)) in ends.iter_mut().zip(&other).enumerate() {
            if self.electrics.floating.of_gap(gap).is_some() {
                *start = (*start * end).max(0.0).sqrt();
            }
        }
        Cow::Owned(ends)
    }

    fn floated(&self, q: &[Pose], volts: &[f64]) -> Vec<f64> {
        let mut all = volts.to_vec();
        for group in self.electrics.floating.groups() {
            if group.gaps.iter().all(|of| volts[of.gap] == 0.0) {
                continue;
            }
            let mut phi = group.gathered(|gap| -self.capacitance(gap, q) * volts[gap]);
            group.factor(|gap| self.capacitance(gap, q)).solve(&mut phi);
            group.spread(&phi, &mut all);
        }
        all
    }

    /// Charge of a gap (C), `volts` those of the drive.
    #[inline]
    pub fn charge(&self, gap: usize, q: &[Pose], volts: &[f64]) -> f64 {
        let own = self.electrics.floating.of_gap(gap).map_or(volts[gap], |_| self.floated(q, volts)[gap]);
        self.capacitance(gap, q) * own
    }

    /// Change of that charge with a change of the configuration and of the voltages; none: they are held.
    #[inline]
    pub fn charge_slope(&self, gap: usize, about: (&[Pose], &[f64]), (dq, change): (&[Pose], Option<&[f64]>)) -> f64 {
        self.charge_slope_with(|| self.capacitance(gap, about.0), gap, about, (Some(dq), change))
    }

    /// The same with its capacitance (F), and with a configuration that may be held.
    #[inline]
    pub fn charge_slope_with(
        &self,
        capacitance: impl FnOnce() -> f64,
        gap: usize,
        (q, volts): (&[Pose], &[f64]),
        (dq, change): (Option<&[Pose]>, Option<&[f64]>),
    ) -> f64 {
        let moved = |volts: f64| match dq {
            Some(dq) if volts != 0.0 => self.capacitance_slope(gap, q, dq) * volts,
            _ => 0.0,
        };
        if self.electrics.floating.of_gap(gap).is_some() {
            let (held, still) = (vec![0.0; volts.len()], vec![Pose::zeros(); q.len()]);
            let change = self.gap_voltage_slopes((q, volts), (dq.unwrap_or(&still), change.unwrap_or(&held)));
            return capacitance() * change[gap] + moved(self.floated(q, volts)[gap]);
        }
        let changed = change.map_or(0.0, |change| change[gap]);
        let charged = if changed == 0.0 { 0.0 } else { capacitance() * changed };
        charged + moved(volts[gap])
    }

    /// `tangent +=` a fraction of k·S⁻¹·kᵀ, k the change of the forces with the potentials of floating conductors, at the voltages `volts` of gaps.
    pub(super) fn add_floating_tangent(&self, q: &[Pose], volts: &[f64], fraction: f64, tangent: &mut BodyMatrix) {
        for group in self.electrics.floating.groups() {
            if group.gaps.iter().any(|of| volts[of.gap] != 0.0) {
                self.add_group_tangent(group, (q, volts), fraction, tangent);
            }
        }
    }

    fn add_group_tangent(
        &self,
        group: &FloatingGroup,
        (q, volts): (&[Pose], &[f64]),
        fraction: f64,
        tangent: &mut BodyMatrix,
    ) {
        let (at, pattern) = (self.at(q), &self.model.pattern);
        let mut bodies: Vec<usize> = Vec::new();
        let mut see = |id: BodyId| {
            if let BodyId::Free(k) = id {
                bodies.push(k);
            }
        };
        group.gaps.iter().for_each(|of| self.members[of.gap].bodies(&mut see));
        bodies.sort_unstable();
        bodies.dedup();
        let n = group.conductors;
        bimorph_base::budget::lay_out_matrix(DOF * bodies.len(), n);
        // rows of k, one for each direction of each body
        let mut rows = vec![0.0; DOF * bodies.len() * n];
        let mut force = vec![Pose::zeros(); q.len()];
        for of in group.gaps.iter().filter(|of| volts[of.gap] != 0.0) {
            bimorph_base::budget::check();
            bodies.iter().for_each(|k| force[*k] = Pose::zeros());
            self.members[of.gap].add_force_change(at, volts[of.gap], 1.0, &mut force);
            for (side, sign) in of.sides.iter().zip([1.0, -1.0]) {
                let Some(conductor) = side else { continue };
                for (b, body) in bodies.iter().enumerate() {
                    (0..DOF).for_each(|d| rows[(DOF * b + d) * n + conductor] += sign * force[*body][d]);
                }
            }
        }
        let factor = group.factor(|gap| self.members[gap].capacitance(at));
        rows.chunks_exact_mut(n.max(1)).for_each(|row| factor.forward(row));
        let row = |b: usize, d: usize| &rows[(DOF * b + d) * n..(DOF * b + d + 1) * n];
        let dot = |(i, k): (usize, usize), (j, l): (usize, usize)| -> f64 {
            row(i, k).iter().zip(row(j, l)).map(|(x, y)| x * y).sum::<f64>() * fraction
        };
        for i in 0..bodies.len() {
            bimorph_base::budget::check();
            for k in 0..DOF {
                (0..DOF).for_each(|l| tangent.diagonal[bodies[i]][(k, l)] += dot((i, k), (i, l)));
            }
            for j in 0..i {
                let mut pair = Matrix6::zeros();
                for k in 0..DOF {
                    for l in 0..DOF {
                        let value = dot((i, k), (j, l));
                        pair[(k, DOF + l)] = value;
                        pair[(DOF + l, k)] = value;
                    }
                }
                locate(pattern, BodyId::Free(bodies[i]), BodyId::Free(bodies[j])).add(tangent, &pair);
            }
        }
    }
}
