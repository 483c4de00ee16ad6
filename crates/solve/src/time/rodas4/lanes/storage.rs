//! Storage of a batched step.

use super::super::body_stage::BodyState;
use super::heat::LaneHeat;
use super::motion::{LaneMotion, Norms};
use crate::equations::acted_bodies::ActedBodies;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_domains::{Drive, Ramp, System};
use bimorph_multibody::batch::joint::LanePlaced;
use bimorph_multibody::batch::{LANES, Lane8, LaneMatrix, LaneModel, LanePose, SimdReal, ZERO_POSE, load, store};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::scalar::has_lanes;

/// Run of a lane.
#[derive(Debug, Clone)]
pub struct Lane<'a> {
    /// The variant.
    pub system: &'a System,
    /// Its sources and heat.
    pub ramp: Ramp<'a>,
}

impl BodyState<Lane8> {
    #[inline(always)]
    pub(super) fn load<W: SimdReal>(&self, simd: W::Simd) -> BodyState<W> {
        BodyState { q: load(simd, &self.q), v: load(simd, &self.v) }
    }
}

impl<W: SimdReal> BodyState<W> {
    #[inline(always)]
    pub(super) fn store(self, to: &mut BodyState<Lane8>) {
        store(self.q, &mut to.q);
        store(self.v, &mut to.v);
    }
}

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct LaneRodas4 {
    pub(super) model: LaneModel,
    pub(super) w: LaneMatrix,
    /// The motion; each lane begins its next step from here.
    pub motion: LaneMotion,
    /// Where the last step began.
    pub before: LaneMotion,
    /// Its estimated error.
    pub error: LaneMotion,
    /// Norms in the mass of the displacements before and after it and of both parts of its error.
    pub norms: Norms,
    pub(super) force: Vec<LanePose>,
    pub(super) forcing: Vec<LanePose>,
    pub(super) at: Vec<LanePose>,
    pub(super) r1: Vec<LanePose>,
    pub(super) increments: Vec<[BodyState<Lane8>; 5]>,
    /// Rates by which dampers lag, for each body; empty without dampers.
    pub(super) lags: Vec<LanePose>,
    pub(super) placed: Vec<LanePlaced>,
    pub(super) heat: LaneHeat,
    pub(super) expansion: Vec<Lane8>,
    pub(super) rate: Vec<Lane8>,
    pub(super) vanished: [bool; LANES],
    pub(super) h: Lane8,
    pub(super) acted: ActedBodies,
    pub(super) drives: Vec<Drive>,
    /// Contact losses, lane by lane; empty where parts cannot touch.
    pub(super) losses: Vec<LossDerivatives>,
    /// r₁ and rates of one lane.
    pub(super) rates: [Vec<Pose>; 2],
}

impl LaneRodas4 {
    /// Storage for a mechanism, with its numbers in every lane; none for a linear model, for one with inputs beside voltages or
    /// with gas that compresses, and on a processor without vectors.
    pub fn new(system: &System) -> Option<Self> {
        let electrics = &system.electrics;
        let suits =
            has_lanes() && electrics.inputs.is_empty() && !electrics.heating.is_hot() && !system.compresses_gas();
        let model = LaneModel::new(&system.model).filter(|_| suits)?;
        let (n, pattern) = (system.bodies(), &system.model.pattern);
        let none = BodyState { q: ZERO_POSE, v: ZERO_POSE };
        let heaters = system.electrics.heating.heaters.len();
        Some(Self {
            w: LaneMatrix::new(pattern),
            motion: LaneMotion::zeros(n),
            before: LaneMotion::zeros(n),
            error: LaneMotion::zeros(n),
            norms: Norms::default(),
            force: vec![ZERO_POSE; n],
            forcing: vec![ZERO_POSE; n],
            at: vec![ZERO_POSE; n],
            r1: vec![ZERO_POSE; n],
            increments: vec![[none; 5]; n],
            lags: vec![ZERO_POSE; if model.dampers.is_empty() { 0 } else { n }],
            placed: vec![LanePlaced::GROUND; n + 1],
            heat: LaneHeat::new(&system.electrics.heating.heaters),
            expansion: vec![Lane8::NONE; heaters],
            rate: vec![Lane8::NONE; heaters],
            vanished: [false; LANES],
            h: Lane8::of(1.0),
            acted: ActedBodies::new(system),
            drives: vec![system.electrics.drive(); LANES],
            losses: vec![LossDerivatives::new(system); if system.has_contacts() { LANES } else { 0 }],
            rates: [(); 2].map(|()| vec![Pose::zeros(); n]),
            model,
        })
    }
}
