//! Data that the six stages keep of one motion in joint coordinates, or of its derivative: the increments of the
//! coordinates, and the corresponding motions of the bodies. Everything else is a sum of these, see [`super::tableau`],
//! computed for eight bodies per vector.

use super::tableau::TABLEAU;
use crate::time::method::Motion;
use crate::time::rodas4::tableau::{A, GAMMA};
use bimorph_multibody::batch::{Kernel, LanePose, SimdReal, ZERO_POSE, add_scaled, everywhere, load, store};
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::kinematics::JointState;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::{LaneJointStates, place_of, tiles};
use bimorph_multibody::joint_coordinates::sprung_loops::{JointMatrix, Tree};
use bimorph_multibody::planar::{DOF, Pose};

/// Increments of eight bodies in the stages.
type Increments = [LanePose; 6];

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct JointStages {
    /// Increments of the coordinates.
    increments: Vec<Increments>,
    /// Motions of the bodies with them.
    moved: Vec<Increments>,
    /// Coordinates, rates and accelerations at the start of the step.
    start: Vec<LaneJointStates>,
    /// Motions of the bodies with the rates and the accelerations at the start of the step.
    rate: Vec<LanePose>,
    acceleration: Vec<LanePose>,
    /// Where the stage at hand takes the forces; after the last one the end of the step.
    pub(super) argument: Vec<LaneJointStates>,
    /// Motion of the bodies with r₁/(γh) + r₂: the argument of inertia.
    push: Vec<LanePose>,
    /// Motion of the bodies with r₁: the argument of damping, where needed.
    drift: Vec<LanePose>,
    /// r₁ itself, where needed.
    lag: Vec<LanePose>,
    /// Room for motions of the bodies.
    room: [Vec<Pose>; 2],
}

const LAST: usize = 5;

impl JointStages {
    pub(super) fn new(count: usize) -> Self {
        let (tiles, room) = (tiles(count), vec![Pose::zeros(); count]);
        let zeros = vec![ZERO_POSE; tiles];
        Self {
            increments: vec![[ZERO_POSE; 6]; tiles],
            moved: vec![[ZERO_POSE; 6]; tiles],
            start: vec![LaneJointStates::REST; tiles],
            rate: zeros.clone(),
            acceleration: zeros.clone(),
            argument: vec![LaneJointStates::REST; tiles],
            push: zeros.clone(),
            drift: zeros.clone(),
            lag: zeros,
            room: [room.clone(), room],
        }
    }

    /// Begins a step whose matrix has been factored: how the bodies move with rates `now.v` and accelerations `push.q`.
    pub(super) fn set_out(&mut self, tree: &Tree, w: &JointMatrix, now: &Motion, push: &Motion) {
        let [rate, acceleration] = &mut self.room;
        w.both_motions(tree, (&now.v, &push.q), (rate, acceleration));
        for (j, (rate, acceleration)) in rate.iter().zip(&*acceleration).enumerate() {
            set(&mut self.rate, j, rate);
            set(&mut self.acceleration, j, acceleration);
        }
    }

    /// The argument becomes the motion with coordinates and rates `now` and accelerations `push.q`. Returns whether it
    /// is unchanged.
    pub(super) fn begin_first(&mut self, now: &Motion, push: &Motion) -> bool {
        for (j, ((q, v), z)) in now.q.iter().zip(&now.v).zip(&push.q).enumerate() {
            let (tile, lane) = place_of(j);
            self.start[tile].set(lane, [q, v, z]);
        }
        let same = self.argument == self.start;
        self.argument.copy_from_slice(&self.start);
        same
    }

    /// Where stage `i` of a step of length `h` (s) from coordinates and rates `now` and accelerations `push.q` takes
    /// the forces. Returns whether the step before ended there.
    pub(super) fn begin(&mut self, i: usize, h: f64, now: &Motion, push: &Motion) -> bool {
        if i == 0 {
            return self.begin_first(now, push);
        }
        everywhere(Sums { stages: self, task: StageSum::Begin(i), h });
        false
    }

    /// r₁ over the coordinates in stage `i`.
    pub(super) fn fall_behind(&mut self, i: usize, h: f64) {
        everywhere(Sums { stages: self, task: StageSum::Lag(i), h });
    }

    /// r₁ of the coordinates of body `j`.
    #[inline(always)]
    pub(super) fn lag(&self, j: usize) -> Pose {
        get(&self.lag, j)
    }

    /// Arguments of inertia in stage `i`, and of damping where something `drags`.
    pub(super) fn move_bodies(&mut self, i: usize, h: f64, drags: bool) {
        everywhere(Sums { stages: self, task: StageSum::Move(i, drags), h });
    }

    /// Argument of inertia of body `j`.
    #[inline(always)]
    pub(super) fn push(&self, j: usize) -> Pose {
        get(&self.push, j)
    }

    /// Argument of damping of body `j`.
    #[inline(always)]
    pub(super) fn drift(&self, j: usize) -> Pose {
        get(&self.drift, j)
    }

    /// Keeps what the solve of stage `i` found: the increments of the coordinates, and the motions of the bodies with them.
    pub(super) fn keep(&mut self, i: usize, solved: &[Four], moved: &[Four]) {
        for (j, (solved, moved)) in solved.iter().zip(moved).enumerate() {
            let (tile, lane) = place_of(j);
            let (u, bodies) = (&mut self.increments[tile][i], &mut self.moved[tile][i]);
            for k in 0..DOF {
                (u[k].0[lane], bodies[k].0[lane]) = (solved.0[k], moved.0[k]);
            }
        }
    }

    /// After the last stage: the argument becomes the end of the step.
    pub(super) fn finish(&mut self, h: f64, now: &mut Motion, push: &mut Motion) {
        everywhere(Sums { stages: self, task: StageSum::Finish, h });
        for (j, ((q, v), z)) in now.q.iter_mut().zip(&mut now.v).zip(&mut push.q).enumerate() {
            let (tile, lane) = place_of(j);
            [*q, *v, *z] = self.argument[tile].of(lane);
        }
    }

    /// Motions of the bodies with the increments of the last stage: of the coordinates, and of the rates.
    pub(super) fn last(&mut self, h: f64, displacements: &mut [Pose], rates: &mut [Pose]) {
        everywhere(Sums { stages: self, task: StageSum::Drift(LAST), h });
        let gh = GAMMA * h;
        for (j, (displacement, rate)) in displacements.iter_mut().zip(rates).enumerate() {
            let (tile, lane) = place_of(j);
            let u = &self.moved[tile][LAST];
            *displacement = Pose::new(u[0].0[lane], u[1].0[lane], u[2].0[lane]);
            *rate = *displacement / gh - self.drift(j);
        }
        // models without drag multiply it by zero, and the NaN of a rejected step would stay
        self.drift.fill(ZERO_POSE);
    }
}

#[inline(always)]
fn get(from: &[LanePose], j: usize) -> Pose {
    let (tile, lane) = place_of(j);
    let [x, y, z] = &from[tile];
    Pose::new(x.0[lane], y.0[lane], z.0[lane])
}

#[inline(always)]
fn set(to: &mut [LanePose], j: usize, pose: &Pose) {
    let (tile, lane) = place_of(j);
    for i in 0..DOF {
        to[tile][i].0[lane] = pose[i];
    }
}

/// A sum over the stages.
#[derive(Debug, Clone, Copy)]
enum StageSum {
    /// The argument of a stage.
    Begin(usize),
    /// Arguments of inertia in a stage, and of damping.
    Move(usize, bool),
    /// Argument of damping.
    Drift(usize),
    /// r₁ over the coordinates.
    Lag(usize),
    /// The end of the step.
    Finish,
}

struct Sums<'a> {
    stages: &'a mut JointStages,
    task: StageSum,
    h: f64,
}

impl Kernel for Sums<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { stages, task, h } = self;
        match task {
            StageSum::Begin(1) => stages.begin_stage::<W, 1>(simd, h),
            StageSum::Begin(2) => stages.begin_stage::<W, 2>(simd, h),
            StageSum::Begin(3) => stages.begin_stage::<W, 3>(simd, h),
            StageSum::Begin(4) => stages.begin_stage::<W, 4>(simd, h),
            StageSum::Begin(_) => stages.begin_stage::<W, 5>(simd, h),
            StageSum::Move(i, drags) => {
                stages.push_stage::<W>(simd, i, h);
                if drags {
                    stages.drift_stage::<W>(simd, i, h);
                }
            }
            StageSum::Drift(i) => stages.drift_stage::<W>(simd, i, h),
            StageSum::Lag(i) => stages.lag_stage::<W>(simd, i, h),
            StageSum::Finish => stages.finish_step::<W>(simd, h),
        }
    }
}

/// `sum + Σ c_k·u_k` over the first stages.
#[inline(always)]
fn sum<W: SimdReal>(simd: W::Simd, mut sum: LanePose<W>, u: &[LanePose], c: &[f64]) -> LanePose<W> {
    for (u, c) in u.iter().zip(c) {
        add_scaled(&mut sum, &load(simd, u), W::splat(simd, *c));
    }
    sum
}

/// `x·a + y·b`.
#[inline(always)]
fn both<W: SimdReal>(simd: W::Simd, (x, a): (&LanePose<W>, f64), (y, b): (&LanePose<W>, f64)) -> LanePose<W> {
    let (a, b) = (W::splat(simd, a), W::splat(simd, b));
    [x[0] * a + y[0] * b, x[1] * a + y[1] * b, x[2] * a + y[2] * b]
}

impl JointStages {
    #[inline(always)]
    fn begin_stage<W: SimdReal, const I: usize>(&mut self, simd: W::Simd, h: f64) {
        let (once, twice) = (1.0 / h, 1.0 / (h * h));
        let rate = TABLEAU.rate[I].map(|c| c * once);
        let acceleration = TABLEAU.acceleration[I].map(|c| c * twice);
        let (p, t, a) = (TABLEAU.rate_start[I], TABLEAU.acceleration_start[I], TABLEAU.acceleration_rate[I] * once);
        for ((u, start), argument) in self.increments.iter().zip(&self.start).zip(&mut self.argument) {
            let JointState { q, v, z } = start.load::<W>(simd);
            let mut at = JointState { q, v: v.map(|v| v * p), z: both(simd, (&z, t), (&v, a)) };
            for k in 0..I {
                let u = load::<W, DOF>(simd, &u[k]);
                add_scaled(&mut at.q, &u, W::splat(simd, A[I][k]));
                add_scaled(&mut at.v, &u, W::splat(simd, rate[k]));
                add_scaled(&mut at.z, &u, W::splat(simd, acceleration[k]));
            }
            argument.store(at);
        }
    }

    #[inline(always)]
    fn push_stage<W: SimdReal>(&mut self, simd: W::Simd, i: usize, h: f64) {
        let (once, twice) = (1.0 / h, 1.0 / (h * h));
        let pushed = TABLEAU.push[i].map(|c| c * twice);
        let (t, s) = (TABLEAU.acceleration_start[i], TABLEAU.push_rate[i] * once);
        for (((u, v), z), push) in self.moved.iter().zip(&self.rate).zip(&self.acceleration).zip(&mut self.push) {
            let start = both::<W>(simd, (&load(simd, z), t), (&load(simd, v), s));
            store(sum(simd, start, &u[..i], &pushed), push);
        }
    }

    #[inline(always)]
    fn drift_stage<W: SimdReal>(&mut self, simd: W::Simd, i: usize, h: f64) {
        let lag = TABLEAU.lag[i].map(|c| c / h);
        let p = TABLEAU.rate_start[i];
        for ((u, v), drift) in self.moved.iter().zip(&self.rate).zip(&mut self.drift) {
            let v = load::<W, DOF>(simd, v);
            store(sum(simd, v.map(|v| v * p), &u[..i], &lag), drift);
        }
    }

    #[inline(always)]
    fn lag_stage<W: SimdReal>(&mut self, simd: W::Simd, i: usize, h: f64) {
        let lag = TABLEAU.lag[i].map(|c| c / h);
        let p = TABLEAU.rate_start[i];
        for ((u, start), out) in self.increments.iter().zip(&self.start).zip(&mut self.lag) {
            let JointState { v, .. } = start.load::<W>(simd);
            store(sum(simd, v.map(|v| v * p), &u[..i], &lag), out);
        }
    }

    #[inline(always)]
    fn finish_step<W: SimdReal>(&mut self, simd: W::Simd, h: f64) {
        let (once, twice) = (1.0 / h, 1.0 / (h * h));
        let (lag, pushed) = (TABLEAU.lag[LAST].map(|c| c * once), TABLEAU.push[LAST].map(|c| c * twice));
        let (p, t, s) = (TABLEAU.rate_start[LAST], TABLEAU.acceleration_start[LAST], TABLEAU.push_rate[LAST] * once);
        let gh = GAMMA * h;
        for ((u, start), argument) in self.increments.iter().zip(&self.start).zip(&mut self.argument) {
            let JointState { v, z, .. } = start.load::<W>(simd);
            let rate = sum(simd, v.map(|v| v * p), &u[..LAST], &lag);
            let acceleration = sum(simd, both(simd, (&z, t), (&v, s)), &u[..LAST], &pushed);
            let (mut end, u) = (argument.load::<W>(simd), load::<W, DOF>(simd, &u[LAST]));
            for i in 0..DOF {
                end.q[i] += u[i];
                end.v[i] += u[i] * (1.0 / gh) - rate[i];
                end.z[i] += u[i] * (1.0 / (gh * gh)) - acceleration[i];
            }
            argument.store(end);
        }
    }
}
