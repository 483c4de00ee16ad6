//! Storage for a batch of modes.

use super::ritz::{MAX_ROWS, RitzMatrices};
use bimorph_domains::System;
use bimorph_multibody::batch::joint::LanePlaced;
use bimorph_multibody::batch::{LANES, Lane8, LaneMatrix, LaneModel, LanePose, LanePrecise, PrecisePose, ZERO_POSE};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::scalar::has_lanes;

/// Which factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Which {
    /// Of K.
    Plain,
    /// Of K − σM.
    Shifted,
}

/// Modes of as many variants as there are lanes, with storage.
#[derive(Debug, Clone)]
pub struct LaneModes {
    pub(super) model: LaneModel,
    pub(super) precise: LanePrecise,
    /// K, held directions not yet projected.
    pub(super) stiffness: LaneMatrix,
    pub(super) plain: LaneMatrix,
    pub(super) shifted: LaneMatrix,
    pub(super) placed: Vec<LanePlaced>,
    pub(super) still: Vec<LanePose>,
    pub(super) expansion: Vec<Lane8>,
    /// Shapes that every variant begins with.
    pub(super) start: Vec<Vec<Pose>>,
    pub(super) x: Vec<Vec<LanePose>>,
    /// K·x of each, as the last inverse iteration had it.
    pub(super) given: Vec<Vec<LanePose>>,
    pub(super) force: Vec<LanePose>,
    pub(super) product: Vec<PrecisePose>,
    pub(super) lambda: Vec<Lane8>,
    pub(super) residual: Vec<Lane8>,
    /// σ.
    pub(super) shift: Lane8,
    /// Modes below it.
    pub(super) below: Lane8,
    pub(super) vanished: [bool; LANES],
    pub(super) small: RitzMatrices,
}

impl LaneModes {
    /// Lanes for variants like `first`, beginning with these shapes; none where it has no lanes, or more shapes than they hold.
    pub fn new(first: &System, start: Vec<Vec<Pose>>) -> Option<Self> {
        let able = has_lanes() && first.model.couplings.is_empty() && (1..=MAX_ROWS).contains(&start.len());
        let model = LaneModel::new(&first.model).filter(|_| able)?;
        let (n, pattern) = (first.bodies(), &first.model.pattern);
        let block = vec![vec![ZERO_POSE; n]; start.len()];
        Some(Self {
            precise: LanePrecise::default(),
            stiffness: LaneMatrix::new(pattern),
            plain: LaneMatrix::new(pattern),
            shifted: LaneMatrix::new(pattern),
            placed: vec![LanePlaced::GROUND; n + 1],
            still: vec![ZERO_POSE; n],
            expansion: vec![Lane8::NONE; first.electrics.heating.heaters.len()],
            x: block.clone(),
            given: block,
            force: vec![ZERO_POSE; n],
            product: vec![[[Lane8::NONE; 2]; DOF]; n],
            lambda: vec![Lane8::NONE; start.len()],
            residual: vec![Lane8::NONE; start.len()],
            shift: Lane8::NONE,
            below: Lane8::NONE,
            vanished: [false; LANES],
            small: RitzMatrices::default(),
            start,
            model,
        })
    }

    /// True for a variant that differs from the first in numbers alone.
    pub fn fits(&self, system: &System) -> bool {
        self.model.fits(&system.model)
            && system.model.couplings.is_empty()
            && self.expansion.len() == system.electrics.heating.heaters.len()
    }

    /// λ of each shape, in each lane.
    pub fn lambda(&self) -> &[Lane8] {
        &self.lambda
    }

    /// The models, the factor of K, the shapes, and their λ.
    pub fn found(&self) -> (&LaneModel, &LaneMatrix, &[Vec<LanePose>], &[Lane8]) {
        (&self.model, &self.plain, &self.x, &self.lambda)
    }
}
