//! Functions of the configuration on which the forces of a mechanism depend: strains of the joints that close loops, approaches of
//! gaps, the work of loads, and what is read.

use crate::equations::Joints;
use bimorph_domains::{Domain, Input, PointLaw, System};
use bimorph_multibody::forces::resultants;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::section::PackedJoint;
use nalgebra::{DMatrix, Matrix3, SymmetricEigen, Vector3};

/// Part of a joint's largest stiffness below which a direction has none (1), the directions scaled to one stiffness each.
const SOFT: f64 = 1e-12;

/// A quantity that is read from a configuration.
pub type Probe<'a> = dyn Fn(&[Pose]) -> f64 + 'a;

/// The points of a member.
#[derive(Debug, Clone, PartialEq)]
pub struct MemberPoints {
    /// Its place among the members.
    pub member: usize,
    /// Places of the members that it stands for, which have one voltage.
    pub merged: Vec<usize>,
    /// Its first point among all.
    pub first: usize,
    /// Laws of its points.
    pub laws: Vec<PointLaw>,
}

impl MemberPoints {
    /// Its capacitance at the approaches of all points (F).
    pub fn capacitance(&self, approaches: &[f64]) -> f64 {
        let of = |(k, law): (usize, &PointLaw)| law.capacitance(&approaches[self.first + k..]);
        self.laws.iter().enumerate().map(of).sum()
    }
}

/// Variables of the laws of combs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CombMotion {
    /// The overlap alone: fingers stay in the middle of their gaps.
    Along,
    /// The overlap and the distance aside.
    AlongAndAcross,
}

/// Whether a system has combs whose fingers have a law of their distance aside.
pub(super) fn has_combs(system: &System) -> bool {
    system.members.iter().any(|member| member.point_laws().iter().any(|law| law.comb().is_some()))
}

/// Rows of a closure: its strains in which the energy is half the sum of their squares.
#[derive(Debug, Clone)]
struct ClosureRows<'a> {
    joint: &'a PackedJoint,
    /// Their factors of the stress.
    of_stress: Vec<Vector3<f64>>,
}

/// The functions of a system, in five blocks of rows.
pub(super) struct ShapeFunctions<'a> {
    joints: &'a Joints,
    system: &'a System,
    closures: Vec<ClosureRows<'a>>,
    /// Members with points.
    pub(super) members: Vec<MemberPoints>,
    probes: &'a [&'a Probe<'a>],
    /// Whether displacements of the bodies are among them.
    moves: bool,
    combs: CombMotion,
}

impl<'a> ShapeFunctions<'a> {
    /// Of a system and what is read; where it `moves`, with the displacements of its bodies.
    pub(super) fn new(
        joints: &'a Joints,
        system: &'a System,
        probes: &'a [&'a Probe<'a>],
        (moves, combs): (bool, CombMotion),
    ) -> Self {
        let model = &joints.closures.model;
        let rows = |joint: &'a PackedJoint| {
            let columns = [0, 1, 2].map(|i| model.section(joint).stiffness.column(i));
            ClosureRows { joint, of_stress: whitening(&Matrix3::from_columns(&columns)) }
        };
        let mut first = 0;
        let mut members = Vec::new();
        for (member, of) in system.members.iter().enumerate() {
            let mut laws = of.point_laws();
            if combs == CombMotion::Along && laws.iter().any(|law| law.comb().is_some()) {
                laws = of.laws().into_iter().map(|(_, law)| PointLaw::of(law)).collect();
            }
            let count = laws.len();
            if count > 0 {
                members.push(MemberPoints { member, merged: vec![member], first, laws });
                first += count;
            }
        }
        Self {
            joints,
            system,
            closures: joints.tree.closures.iter().map(rows).collect(),
            members,
            probes,
            moves,
            combs,
        }
    }

    /// Rows of the blocks: closures, approaches, works, probes, and displacements times the roots of masses.
    pub(super) fn counts(&self) -> [usize; 5] {
        [
            self.closures.iter().map(|rows| rows.of_stress.len()).sum(),
            self.members.iter().map(|points| points.laws.len()).sum(),
            1 + self.system.electrics.inputs.len(),
            self.probes.len(),
            if self.moves { 3 * self.system.bodies() } else { 0 },
        ]
    }

    /// All rows at a configuration. A work is that of a unit of a load; those of inputs follow that of the dead loads.
    pub(super) fn values(&self, q: &[Pose]) -> Vec<f64> {
        let model = &self.joints.closures.model;
        let mut out = Vec::with_capacity(self.counts().iter().sum());
        for rows in &self.closures {
            let stress = resultants(model, rows.joint, q, 0.0, |_| 0.0);
            out.extend(rows.of_stress.iter().map(|of| of.dot(&stress)));
        }
        for points in &self.members {
            let first = out.len();
            self.system.point_approaches(points.member, q, |u| out.push(u));
            if self.combs == CombMotion::Along {
                out.truncate(first + points.laws.len());
            }
        }
        out.push(self.system.loads.iter().map(|load| work(load, q)).sum());
        for input in &self.system.electrics.inputs {
            out.push(match *input {
                Input::Force { point, direction: 2 } => point.rotation(q),
                Input::Force { point, direction } => point.displacement(q, false)[direction],
                Input::Acceleration { axis } => -(0..q.len()).map(|j| model.mass(j)[axis] * q[j][axis]).sum::<f64>(),
                Input::Motion { .. } | Input::Heat { .. } | Input::Rate => 0.0,
            });
        }
        out.extend(self.probes.iter().map(|probe| probe(q)));
        if self.moves {
            for (j, q) in q.iter().enumerate() {
                out.extend(model.mass(j).iter().zip(q).map(|(mass, q)| mass.sqrt() * q));
            }
        }
        out
    }

    /// Rest values of the closures' rows, per unit of the free strain of each heater, and of the built-in strains.
    pub(super) fn rests(&self) -> (DMatrix<f64>, Vec<f64>) {
        let model = &self.joints.closures.model;
        let heaters = self.system.electrics.heating.heaters.len();
        let mut thermal = DMatrix::zeros(self.counts()[0], heaters);
        let mut built_in = Vec::new();
        for rows in &self.closures {
            let section = model.section(rows.joint);
            let of_length = section.stiffness.column(0);
            for of in &rows.of_stress {
                if let Some((heater, length)) = section.expansion {
                    thermal[(built_in.len(), heater)] = of.dot(&of_length) * length;
                }
                built_in.push(of.dot(&of_length) * rows.joint.rest);
            }
        }
        (thermal, built_in)
    }
}

fn work(load: &bimorph_domains::DeadLoad, q: &[Pose]) -> f64 {
    load.force.dot(&load.point.displacement(q, false)) + load.moment * load.point.rotation(q)
}

/// W with ½·σᵀ·Wᵀ·W·σ the energy of the stress σ = K·e: rows of the strains in which it is half the sum of squares.
fn whitening(stiffness: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let inverse = stiffness.diagonal().map(|k| if k > 0.0 { 1.0 / k.sqrt() } else { 0.0 });
    let scaled = Matrix3::from_fn(|i, j| stiffness[(i, j)] * inverse[i] * inverse[j]);
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(scaled);
    let kept = (0..3).filter(|i| eigenvalues[*i] > SOFT);
    kept.map(|i| eigenvectors.column(i).component_mul(&inverse) / eigenvalues[i].sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half the sum of the squares is the energy ½·eᵀ·K·e of a stiffness in N/m, N and N·m, to 1e-12; a direction without stiffness has no row.
    #[test]
    fn squares_of_the_rows_are_the_energy() {
        let k = Matrix3::new(2e4, 0.0, 0.0, 0.0, 30.0, 2e-3, 0.0, 2e-3, 1e-6);
        let e = Vector3::new(1e-9, 2e-8, 1e-3);
        let rows = whitening(&k);
        let sum: f64 = rows.iter().map(|of| of.dot(&(k * e)).powi(2)).sum();
        assert!((sum / e.dot(&(k * e)) - 1.0).abs() < 1e-12);
        let mut hinge = k;
        hinge.column_mut(2).fill(0.0);
        hinge.row_mut(2).fill(0.0);
        assert_eq!((rows.len(), whitening(&hinge).len()), (3, 2));
    }
}
