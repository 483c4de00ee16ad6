//! What a formulation makes of bodies and joints: which directions it locks, and tree and loops.

use super::AnalysisError;
use crate::gaps::System;
use crate::multibody::rcr::{Linkage, Parent};
use crate::multibody::{BodyId, Model};
use std::borrow::Cow;

pub use crate::options::Formulation;

impl Formulation {
    /// The model with the directions locked that this formulation locks.
    pub fn lock(self, model: &Model) -> Cow<'_, Model> {
        match self {
            Self::Rcr => Cow::Owned(model.rotary()),
            Self::Auto | Self::Compliant | Self::RcrElastic => Cow::Borrowed(model),
        }
    }

    /// Tree and loops of a system in joint coordinates.
    ///
    /// # Errors
    /// [`AnalysisError::BadRequest`] where joint coordinates cannot describe it.
    pub fn linkage(self, system: &System) -> Result<Linkage, AnalysisError> {
        let refuse =
            |detail: String| Err(AnalysisError::BadRequest { what: format!("formulation {}", self.name()), detail });
        let model = self.lock(&system.model);
        if model.linear {
            return refuse(
                "joint coordinates are not small displacements; leave out --linear or take compliant".into(),
            );
        }
        if !model.couplings.is_empty() {
            return refuse(
                "joint coordinates know no coupling between joints, which --scheme c1 has; take another scheme, or \
                 compliant"
                    .into(),
            );
        }
        for (k, body) in model.bodies.iter().enumerate() {
            let touches = |(a, b)| a == BodyId::Free(k) || b == BodyId::Free(k);
            let mut joints = model.joints.iter().filter(|j| touches(j.bodies()));
            let elastic = |s: usize| model.sections[s].locked == [false; 3];
            if body.inertia == 0.0 && body.free.is_none() && joints.all(|j| elastic(j.section())) {
                return refuse(format!(
                    "body \"{}\" turns without inertia, and all its joints are elastic in every direction; \
                     take rcr, whose joints only turn, or compliant",
                    body.name
                ));
            }
        }
        Ok(Linkage::new(&model))
    }
}

/// Size of each coordinate: `length` [m] for a displacement, an angle that moves a body's end by as much for a rotation.
pub fn coordinate_scales(linkage: &Linkage, length: f64) -> Vec<f64> {
    let mut scale = vec![length; linkage.coordinates];
    for link in &linkage.links {
        let moving = (0..3).filter(|&i| link.parent == Parent::Free || link.moving[i]);
        for (next, i) in moving.enumerate() {
            if i == 2 {
                scale[link.first + next] = length / link.lever;
            }
        }
    }
    scale
}
