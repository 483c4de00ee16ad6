//! What the six stages keep of one motion in joint coordinates, or of its derivative.

use crate::multibody::planar::Pose;
use crate::solve::time::method::Motion;
use crate::solve::time::rodas4::{A, C, GAMMA};

/// Coordinates, rates and accelerations of one body's joint, or their changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change {
    pub(super) q: Pose,
    pub(super) v: Pose,
    pub(super) z: Pose,
}

pub(super) const STILL: Change =
    Change { q: Pose::new(0.0, 0.0, 0.0), v: Pose::new(0.0, 0.0, 0.0), z: Pose::new(0.0, 0.0, 0.0) };

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct Stages {
    /// Increments of the stages but the last, body by body.
    increments: Vec<[Change; 5]>,
    /// Where the stage at hand takes the forces.
    pub(super) argument: Vec<Change>,
    /// r₁; after the last stage the increment of the rates.
    pub(super) r1: Vec<Pose>,
    r2: Vec<Pose>,
    /// r₁/(γh) + r₂: what inertia acts on.
    pub(super) push: Vec<Pose>,
}

impl Stages {
    pub(super) fn new(count: usize) -> Self {
        let zeros = vec![Pose::zeros(); count];
        Self {
            increments: vec![[STILL; 5]; count],
            argument: vec![STILL; count],
            r1: zeros.clone(),
            r2: zeros.clone(),
            push: zeros,
        }
    }

    /// Begins stage `i` of a step of length `h` [s] from coordinates and rates `now` and accelerations `push.q`.
    pub(super) fn begin(&mut self, i: usize, h: f64, now: &Motion, push: &Motion) {
        match i {
            0 => self.begin_stage::<0>(h, now, push),
            1 => self.begin_stage::<1>(h, now, push),
            2 => self.begin_stage::<2>(h, now, push),
            3 => self.begin_stage::<3>(h, now, push),
            4 => self.begin_stage::<4>(h, now, push),
            _ => self.begin_stage::<5>(h, now, push),
        }
    }

    fn begin_stage<const I: usize>(&mut self, h: f64, now: &Motion, push: &Motion) {
        let gh = GAMMA * h;
        let c = C[I].map(|c| c / h);
        let start = now.q.iter().zip(&now.v).zip(&push.q);
        let out = self.argument.iter_mut().zip(self.r1.iter_mut().zip(self.r2.iter_mut().zip(&mut self.push)));
        for ((increments, ((q, v), z)), (argument, (r1, (r2, push)))) in self.increments.iter().zip(start).zip(out) {
            let mut a = Change { q: *q, v: *v, z: *z };
            let (mut lag_q, mut lag_v) = (Pose::zeros(), Pose::zeros());
            for j in 0..I {
                let u = &increments[j];
                a.q += u.q * A[I][j];
                a.v += u.v * A[I][j];
                a.z += u.z * A[I][j];
                lag_q += u.q * c[j];
                lag_v += u.v * c[j];
            }
            *r1 = a.v + lag_q;
            *r2 = a.z + lag_v;
            *push = *r1 / gh + *r2;
            *argument = a;
        }
    }

    /// Keeps the increment of stage `i` whose displacements the solve has left in `solved`; the last one goes into the
    /// argument, which is then the end of the step.
    pub(super) fn keep(&mut self, i: usize, gh: f64, solved: &[Pose]) {
        let stages = solved.iter().zip(self.r1.iter_mut().zip(&self.r2));
        for ((u, (r1, r2)), (increments, argument)) in stages.zip(self.increments.iter_mut().zip(&mut self.argument)) {
            let v = u / gh - *r1;
            let change = Change { q: *u, v, z: v / gh - r2 };
            if let Some(kept) = increments.get_mut(i) {
                *kept = change;
            } else {
                argument.q += change.q;
                argument.v += change.v;
                argument.z += change.z;
                *r1 = change.v;
            }
        }
    }

    /// The end of the step.
    pub(super) fn finish(&self, now: &mut Motion, push: &mut Motion) {
        for (j, argument) in self.argument.iter().enumerate() {
            (now.q[j], now.v[j], push.q[j]) = (argument.q, argument.v, argument.z);
        }
    }
}
