//! Storage for a batch of equilibria.

use crate::equations::acted_bodies::ActedBodies;
use bimorph_domains::System;
use bimorph_multibody::batch::joint::LanePlaced;
use bimorph_multibody::batch::{LANES, Lane8, LaneMatrix, LaneModel, LanePose, ZERO_POSE};
use bimorph_multibody::scalar::has_lanes;

/// As many variants as there are lanes, with storage.
#[derive(Debug, Clone)]
pub struct LaneEquilibrium {
    pub(super) model: LaneModel,
    pub(super) tangent: LaneMatrix,
    pub(super) placed: Vec<LanePlaced>,
    pub(super) expansion: Vec<Lane8>,
    pub(super) rate: Vec<Lane8>,
    /// Fraction of built-in strains, and the change of it.
    pub(super) built_in: [f64; 2],
    pub(super) trial: Vec<LanePose>,
    /// Residual, then the step.
    pub(super) force: Vec<LanePose>,
    pub(super) residual: Vec<LanePose>,
    pub(super) prediction: Vec<LanePose>,
    /// Not zero for lanes that continue.
    pub(super) goes: Lane8,
    pub(super) negative: Lane8,
    pub(super) vanished: [bool; LANES],
    pub(super) acted: ActedBodies,
    pub(super) gaps: usize,
}

impl LaneEquilibrium {
    /// Lanes for variants like `first`; none where it has no lanes.
    pub fn new(first: &System) -> Option<Self> {
        let model = LaneModel::new(&first.model).filter(|_| has_lanes() && first.electrics.inputs.is_empty())?;
        let (n, pattern) = (first.bodies(), &first.model.pattern);
        let heaters = first.electrics.heating.heaters.len();
        Some(Self {
            tangent: LaneMatrix::new(pattern),
            placed: vec![LanePlaced::GROUND; n + 1],
            expansion: vec![Lane8::NONE; heaters],
            rate: vec![Lane8::NONE; heaters],
            built_in: [0.0; 2],
            trial: vec![ZERO_POSE; n],
            force: vec![ZERO_POSE; n],
            residual: vec![ZERO_POSE; n],
            prediction: vec![ZERO_POSE; n],
            goes: Lane8::of(1.0),
            negative: Lane8::NONE,
            vanished: [false; LANES],
            acted: ActedBodies::new(first),
            gaps: first.members.len(),
            model,
        })
    }

    /// True for a variant that differs from the first in numbers alone.
    pub fn fits(&self, system: &System) -> bool {
        self.model.fits(&system.model)
            && system.electrics.inputs.is_empty()
            && self.expansion.len() == system.electrics.heating.heaters.len()
            && self.gaps == system.members.len()
            && self.acted.fits(system)
    }
}
