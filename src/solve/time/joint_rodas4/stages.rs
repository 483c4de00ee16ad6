//! What the six stages keep of one motion in joint coordinates, or of its derivative: the increments of the coordinates, and
//! the motions of the bodies that belong to each. Everything else is a sum of these, see [`super::tableau`].

use super::tableau::TABLEAU;
use crate::multibody::planar::Pose;
use crate::multibody::relative::{JointMatrix, Tree};
use crate::solve::time::method::Motion;
use crate::solve::time::rodas4::tableau::{A, GAMMA};

/// Coordinates, rates and accelerations of one body's joint, or their changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Change {
    pub(super) q: Pose,
    pub(super) v: Pose,
    pub(super) z: Pose,
}

pub(super) const STILL: Change =
    Change { q: Pose::new(0.0, 0.0, 0.0), v: Pose::new(0.0, 0.0, 0.0), z: Pose::new(0.0, 0.0, 0.0) };

const NONE: Pose = Pose::new(0.0, 0.0, 0.0);

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct Stages {
    /// Increments of the coordinates in the stages, body by body.
    increments: Vec<[Pose; 6]>,
    /// Motions of the bodies with them.
    moved: Vec<[Pose; 6]>,
    /// Motions of the bodies with the rates and the accelerations at the start of the step.
    rate: Vec<Pose>,
    acceleration: Vec<Pose>,
    /// Where the stage at hand takes the forces; after the last one the end of the step.
    pub(super) argument: Vec<Change>,
    /// Motion of the bodies with r₁/(γh) + r₂: what inertia acts on.
    pub(super) push: Vec<Pose>,
    /// Motion of the bodies with r₁: what damping acts on, where it was asked for.
    pub(super) drift: Vec<Pose>,
}

impl Stages {
    pub(super) fn new(count: usize) -> Self {
        let zeros = vec![NONE; count];
        Self {
            increments: vec![[NONE; 6]; count],
            moved: vec![[NONE; 6]; count],
            rate: zeros.clone(),
            acceleration: zeros.clone(),
            argument: vec![STILL; count],
            push: zeros.clone(),
            drift: zeros,
        }
    }

    /// Begins a step whose matrix has been factored: how the bodies move with rates `now.v` and accelerations `push.q`.
    pub(super) fn set_out(&mut self, tree: &Tree, w: &JointMatrix<f64>, now: &Motion, push: &Motion) {
        w.both_motions(tree, (&now.v, &push.q), (&mut self.rate, &mut self.acceleration));
    }

    /// Where stage `i` of a step of length `h` [s] from coordinates and rates `now` and accelerations `push.q` takes the
    /// forces. Tells whether that is where the step before ended.
    pub(super) fn begin(&mut self, i: usize, h: f64, now: &Motion, push: &Motion) -> bool {
        match i {
            0 => self.begin_first(now, push),
            1 => self.begin_stage::<1>(h, now, push),
            2 => self.begin_stage::<2>(h, now, push),
            3 => self.begin_stage::<3>(h, now, push),
            4 => self.begin_stage::<4>(h, now, push),
            _ => self.begin_stage::<5>(h, now, push),
        }
    }

    fn begin_first(&mut self, now: &Motion, push: &Motion) -> bool {
        let mut same = true;
        let start = now.q.iter().zip(&now.v).zip(&push.q);
        for (((q, v), z), argument) in start.zip(&mut self.argument) {
            let at = Change { q: *q, v: *v, z: *z };
            same &= *argument == at;
            *argument = at;
        }
        same
    }

    fn begin_stage<const I: usize>(&mut self, h: f64, now: &Motion, push: &Motion) -> bool {
        let (once, twice) = (1.0 / h, 1.0 / (h * h));
        let rate = TABLEAU.rate[I].map(|c| c * once);
        let acceleration = TABLEAU.acceleration[I].map(|c| c * twice);
        let (p, t, a) = (TABLEAU.rate_start[I], TABLEAU.acceleration_start[I], TABLEAU.acceleration_rate[I] * once);
        let start = now.q.iter().zip(&now.v).zip(&push.q);
        for ((u, ((q, v), z)), argument) in self.increments.iter().zip(start).zip(&mut self.argument) {
            let mut at = Change { q: *q, v: v * p, z: z * t + v * a };
            for k in 0..I {
                at.q += u[k] * A[I][k];
                at.v += u[k] * rate[k];
                at.z += u[k] * acceleration[k];
            }
            *argument = at;
        }
        false
    }

    /// What inertia acts on in stage `i`, and damping where something `drags`.
    pub(super) fn move_bodies(&mut self, i: usize, h: f64, drags: bool) {
        match i {
            0 => self.move_in::<0>(h, drags),
            1 => self.move_in::<1>(h, drags),
            2 => self.move_in::<2>(h, drags),
            3 => self.move_in::<3>(h, drags),
            4 => self.move_in::<4>(h, drags),
            _ => self.move_in::<5>(h, drags),
        }
    }

    fn move_in<const I: usize>(&mut self, h: f64, drags: bool) {
        let (once, twice) = (1.0 / h, 1.0 / (h * h));
        let pushed = TABLEAU.push[I].map(|c| c * twice);
        let (t, s) = (TABLEAU.acceleration_start[I], TABLEAU.push_rate[I] * once);
        let start = self.rate.iter().zip(&self.acceleration);
        for ((u, (v, z)), push) in self.moved.iter().zip(start.clone()).zip(&mut self.push) {
            let mut sum = z * t + v * s;
            for k in 0..I {
                sum += u[k] * pushed[k];
            }
            *push = sum;
        }
        if drags {
            let lag = TABLEAU.lag[I].map(|c| c * once);
            let p = TABLEAU.rate_start[I];
            for ((u, (v, _)), drift) in self.moved.iter().zip(start).zip(&mut self.drift) {
                let mut sum = v * p;
                for k in 0..I {
                    sum += u[k] * lag[k];
                }
                *drift = sum;
            }
        }
    }

    /// Keeps what the solve of stage `i` found: the increments of the coordinates, and the motions of the bodies with them.
    pub(super) fn keep(&mut self, i: usize, solved: &[Pose], moved: &[Pose]) {
        let kept = self.increments.iter_mut().zip(&mut self.moved);
        for ((u, bodies), (solved, moved)) in kept.zip(solved.iter().zip(moved)) {
            (u[i], bodies[i]) = (*solved, *moved);
        }
    }

    /// After the last stage: the argument becomes the end of the step.
    pub(super) fn finish(&mut self, h: f64, now: &mut Motion, push: &mut Motion) {
        const LAST: usize = 5;
        let (once, twice) = (1.0 / h, 1.0 / (h * h));
        let (lag, pushed) = (TABLEAU.lag[LAST].map(|c| c * once), TABLEAU.push[LAST].map(|c| c * twice));
        let (p, t, s) = (TABLEAU.rate_start[LAST], TABLEAU.acceleration_start[LAST], TABLEAU.push_rate[LAST] * once);
        let gh = GAMMA * h;
        for (j, (u, argument)) in self.increments.iter().zip(&mut self.argument).enumerate() {
            let (v, z) = (now.v[j], push.q[j]);
            let (mut rate, mut acceleration) = (v * p, z * t + v * s);
            for k in 0..LAST {
                rate += u[k] * lag[k];
                acceleration += u[k] * pushed[k];
            }
            argument.q += u[LAST];
            argument.v += u[LAST] / gh - rate;
            argument.z += u[LAST] / (gh * gh) - acceleration;
            (now.q[j], now.v[j], push.q[j]) = (argument.q, argument.v, argument.z);
        }
    }

    /// Motions of the bodies with the increments of the last stage: of the coordinates, and of the rates.
    pub(super) fn last(&self, h: f64, displacements: &mut [Pose], rates: &mut [Pose]) {
        const LAST: usize = 5;
        let (once, gh) = (1.0 / h, GAMMA * h);
        let lag = TABLEAU.lag[LAST].map(|c| c * once);
        let p = TABLEAU.rate_start[LAST];
        let out = displacements.iter_mut().zip(rates);
        for ((u, v), (displacement, rate)) in self.moved.iter().zip(&self.rate).zip(out) {
            let mut sum = v * p;
            for k in 0..LAST {
                sum += u[k] * lag[k];
            }
            (*displacement, *rate) = (u[LAST], u[LAST] / gh - sum);
        }
    }
}
