//! The product of a model's tangent with a displacement in extended precision, joint by joint.
//!
//! The assembled tangent of a mechanism of very stiff and very soft parts is wrong in the soft ones by rounding: with beams
//! of width 1 : 100 by some parts in a thousand. Strains taken joint by joint, with the slopes as they are, have no such
//! loss: slopes rounded to f64 are those of a geometry that differs by parts in 10¹⁶.

use super::forces::RestStrain;
use super::joint::{BodyId, Coupling};
use super::model::Model;
use super::planar::Pose;
use super::planar::factored::FactoredTangent;
use super::scalar::{Double, DoublePose};
use super::section::{NONE, PairSlot};

/// ∂²U/∂q² of the joints of a model at one configuration.
#[derive(Debug, Clone)]
pub struct PreciseTangent {
    joints: Vec<(PairSlot, FactoredTangent)>,
    couplings: Vec<Coupling>,
}

impl PreciseTangent {
    /// That of `model` at `q`.
    #[inline]
    pub fn new(model: &Model, q: &[Pose], rest: &RestStrain<'_>) -> Self {
        Self { joints: super::forces::factored(model, q, rest), couplings: model.couplings.clone() }
    }

    /// `y += K·x`.
    pub fn multiply_add(&self, x: &[DoublePose], y: &mut [DoublePose]) {
        const REST: DoublePose = [Double { high: 0.0, low: 0.0 }; 3];
        let at = |k: u32| if k == NONE { REST } else { x[k as usize] };
        for (place, tangent) in &self.joints {
            let (a, b) = (at(place.a), at(place.b));
            let pair = tangent.times([b[0] - a[0], b[1] - a[1]], a[2], b[2]);
            if place.a != NONE {
                let y = &mut y[place.a as usize];
                y[0] += -pair.force[0];
                y[1] += -pair.force[1];
                y[2] += pair.moment_a;
            }
            if place.b != NONE {
                let y = &mut y[place.b as usize];
                y[0] += pair.force[0];
                y[1] += pair.force[1];
                y[2] += pair.moment_b;
            }
        }
        let rotation = |id: BodyId| match id {
            BodyId::Ground => REST[2],
            BodyId::Free(k) => x[k][2],
        };
        for c in &self.couplings {
            let between = |(a, b): (BodyId, BodyId)| rotation(b) - rotation(a);
            let (first, second) = (between(c.first), between(c.second));
            for ((a, b), moment) in [(c.first, second), (c.second, first)] {
                for (id, side) in [(a, -c.stiffness), (b, c.stiffness)] {
                    if let BodyId::Free(k) = id {
                        y[k][2] += moment * side;
                    }
                }
            }
        }
    }
}
