//! The formulations by name: how bodies and joints become equations of motion.

use super::AnalysisError;
use crate::gaps::System;
use crate::multibody::rcr::{Linkage, Parent};
use crate::multibody::{BodyId, Model};
use std::borrow::Cow;

/// How bodies and joints become equations of motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Formulation {
    /// Every body has its own coordinates, joints are springs in all directions; implicit steps.
    #[default]
    Compliant,
    /// Relative joint coordinates, loops reduced in the recursion, joints of beams only turn: the paper's model.
    Rcr,
    /// The same with every direction as a coordinate that the discretization leaves elastic.
    RcrElastic,
}

impl Formulation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Compliant, Self::Rcr, Self::RcrElastic];
    /// Their names.
    pub const NAMES: [&str; 3] = ["compliant", "rcr", "rcr-elastic"];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Compliant => "compliant",
            Self::Rcr => "rcr",
            Self::RcrElastic => "rcr-elastic",
        }
    }

    /// The formulation of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }

    /// The model with the directions locked that this formulation locks.
    pub fn lock(self, model: &Model) -> Cow<'_, Model> {
        match self {
            Self::Rcr => Cow::Owned(model.rotary()),
            Self::Compliant | Self::RcrElastic => Cow::Borrowed(model),
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
