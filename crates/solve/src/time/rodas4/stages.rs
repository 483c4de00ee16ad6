//! Data that the six stages keep of every body, and the sweep over the bodies between one solve and the next.
//!
//! On large models a step is as fast as the memory that it reads and writes. All operations of a body between the solve
//! of one stage and the forces of the next are therefore done in one sweep. The increments of a tile of bodies are
//! contiguous, so that the sweep reads one run of memory for any number of previous stages.

use super::body_stage::{BodyStage, BodyState, BodyTerms, StageScale, body_stage, increment};
use super::tableau::{C, GAMMA, IN_PLACE};
use crate::method::Motion;
use crate::time::gyration::{Gyration, skew};
use bimorph_multibody::batch::LaneBlock;
use bimorph_multibody::planar::{DOF, Pose, Vec3};
use bimorph_multibody::{Body, Model, forces};

/// Bodies of a tile.
const TILE: usize = 16;

/// Increments of a tile of bodies in each stage but the last, whose increments go into the result at once.
type TileIncrements = [[BodyState<f64>; TILE]; 5];

/// The stages of one motion.
#[derive(Debug, Clone)]
pub(super) struct Stages {
    /// Contribution of the current stage to the forces. Then the sum of both, with held directions removed. After the
    /// solve it is minus the increment of the displacements.
    pub(super) force: Vec<Pose>,
    /// ∂r/∂t at the start of the step.
    pub(super) forcing: Vec<Pose>,
    /// Displacements where the stages before [`IN_PLACE`] evaluate the forces.
    at: Vec<Pose>,
    /// r₁ of the stage at hand.
    r1: Vec<Pose>,
    tiles: Vec<TileIncrements>,
}

impl Stages {
    /// Storage for a model.
    pub(super) fn new(model: &Model) -> Self {
        let bodies = model.bodies.len();
        let zeros = vec![Pose::zeros(); bodies];
        let none = BodyState { q: [0.0; DOF], v: [0.0; DOF] };
        Self {
            force: zeros.clone(),
            forcing: zeros.clone(),
            at: zeros.clone(),
            r1: zeros,
            tiles: vec![[[none; TILE]; 5]; bodies.div_ceil(TILE)],
        }
    }

    /// Displacements where stage `i` evaluates the forces.
    pub(super) fn place<'a>(&'a mut self, i: usize, motion: &'a Motion) -> (&'a [Pose], &'a mut [Pose]) {
        (if i < IN_PLACE { &self.at } else { &motion.q }, &mut self.force)
    }

    /// The same places alone.
    pub(super) fn at<'a>(&'a self, i: usize, motion: &'a Motion) -> &'a [Pose] {
        if i < IN_PLACE { &self.at } else { &motion.q }
    }

    /// Begins stage `i` of a step of length `h` (s) from `motion`; the stage before it has been solved.
    pub(super) fn begin(&mut self, model: &Model, i: usize, h: f64, motion: &mut Motion) {
        match i {
            0 => self.begin_stage::<0>(model, h, motion),
            1 => self.begin_stage::<1>(model, h, motion),
            2 => self.begin_stage::<2>(model, h, motion),
            3 => self.begin_stage::<3>(model, h, motion),
            4 => self.begin_stage::<4>(model, h, motion),
            _ => self.begin_stage::<5>(model, h, motion),
        }
    }

    fn begin_stage<const I: usize>(&mut self, model: &Model, h: f64, motion: &mut Motion) {
        let scale = StageScale::of::<I>(h);
        let tiles = self.tiles.iter_mut().zip(model.bodies.chunks(TILE));
        let forces = self.force.chunks_mut(TILE).zip(self.forcing.chunks(TILE)).zip(self.r1.chunks_mut(TILE));
        let motion = self.at.chunks_mut(TILE).zip(motion.q.chunks_mut(TILE).zip(motion.v.chunks_mut(TILE)));
        for (((tile, bodies), ((force, forcing), r1)), (at, (q, v))) in tiles.zip(forces).zip(motion) {
            let forces = force.iter_mut().zip(forcing).zip(r1);
            let motion = at.iter_mut().zip(q.iter_mut().zip(v));
            for (k, (body, (((force, forcing), r1), (at, (q, v))))) in
                (0..TILE).zip(bodies.iter().zip(forces.zip(motion)))
            {
                if let Some(last) = I.checked_sub(1) {
                    tile[last][k] = change(body, force, r1, scale.gh);
                }
                let terms = BodyTerms {
                    mass: body.mass_diagonal().into(),
                    drag: |v: &Vec3<f64>| -> Vec3<f64> { body.drag.force(&(*v).into()).into() },
                    forcing: (*forcing).into(),
                };
                let start = BodyState { q: (*q).into(), v: (*v).into() };
                let stage: BodyStage<f64> = body_stage::<_, I>(&scale, start, |j| tile[j][k], terms);
                let BodyState { q: place_q, v: place_v } = stage.place;
                if I < IN_PLACE {
                    *at = place_q.into();
                } else {
                    (*q, *v) = (place_q.into(), place_v.into());
                }
                (*r1, *force) = (stage.r1.into(), stage.force.into());
            }
        }
        if !model.dampers.is_empty() {
            let lag = |k: usize| {
                let tile = &self.tiles[k / TILE];
                (0..I).fold(Pose::zeros(), |lag, j| lag - Pose::from(tile[j][k % TILE].q) * scale.c[j])
            };
            forces::add_dampers(model, lag, &mut self.force);
        }
    }

    /// r₁ of the stage at hand.
    pub(super) fn r1(&self) -> &[Pose] {
        &self.r1
    }

    /// Rate of body `k` where stage `i` of a step of length `h` (s) takes the forces, which has begun.
    pub(super) fn speed(&self, i: usize, h: f64, k: usize) -> Pose {
        let tile = &self.tiles[k / TILE];
        (0..i).fold(self.r1[k], |speed, j| speed - Pose::from(tile[j][k % TILE].q) * (C[i][j] / h))
    }

    /// Adds Coriolis' force to that of stage `i`, with the frame's motion of `now` and, in the matrix, of the `start` of the
    /// step.
    pub(super) fn add_gyration(&mut self, model: &Model, (i, h): (usize, f64), now: Gyration, start: Gyration) {
        for (k, body) in model.bodies.iter().enumerate() {
            let force = skew(body, now.rate, &self.speed(i, h, k)) - skew(body, start.rate, &self.r1[k]);
            self.force[k] += force;
        }
    }

    /// Ends a step after the last solve: `motion` becomes the new one, and `error` its estimated error. Stiffly accurate:
    /// the last stage's argument plus its increment is the new value, the increment the error.
    pub(super) fn finish(&self, model: &Model, h: f64, motion: &mut Motion, error: Option<&mut Motion>) {
        let bodies = model.bodies.iter().zip(self.force.iter().zip(&self.r1));
        let last = bodies.map(|(body, (force, r1))| {
            let BodyState { q, v } = change(body, force, r1, GAMMA * h);
            [Pose::from(q), Pose::from(v)]
        });
        let motion = motion.q.iter_mut().zip(&mut motion.v);
        match error {
            Some(error) => {
                for (([last_q, last_v], (q, v)), (error_q, error_v)) in
                    last.zip(motion).zip(error.q.iter_mut().zip(&mut error.v))
                {
                    *q += last_q;
                    *v += last_v;
                    (*error_q, *error_v) = (last_q, last_v);
                }
            }
            None => {
                for ([last_q, last_v], (q, v)) in last.zip(motion) {
                    *q += last_q;
                    *v += last_v;
                }
            }
        }
    }
}

/// Increment of a stage of `body` whose solve left `solved`.
#[inline(always)]
fn change(body: &Body, solved: &Pose, r1: &Pose, gh: f64) -> BodyState<f64> {
    let free = body.free.as_ref().map(|free| move || -> LaneBlock<f64> { (**free).into() });
    increment(&(*solved).into(), &(*r1).into(), gh, free)
}
