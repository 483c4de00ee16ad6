//! Rodas4 over variants side by side: a step of each, with its own length, in the vector instructions of the processor.
//!
//! Everything that all bodies and joints go through is done for all lanes at once, in the order of [`super`] and of
//! `stages`; gaps and dead loads act on few bodies and have branches of their own, and go variant by variant.

mod acted;
mod motion;

pub use motion::{LaneMotion, Norms};

use super::{A, ALPHA, C, GAMMA, GAMMA_I};
use crate::gaps::{Drive, Ramp, System};
use crate::multibody::lanes::forces::{self, LaneRest};
use crate::multibody::lanes::joint::LanePlaced;
use crate::multibody::lanes::{LaneMatrix, LaneModel, LanePose, Lanes, Real, add, add_scaled, times, zero};
use crate::multibody::planar::Pose;
use crate::multibody::rcr::{across, has_lanes};
use crate::multibody::{BlockMatrix, Pattern};
use crate::solve::time::method::Motion;
use motion::mass_norm;
use pulp::{Simd, WithSimd};

/// From this stage on the motion itself carries the argument.
const IN_PLACE: usize = 4;

/// What a lane runs.
#[derive(Debug, Clone)]
pub struct Lane<'a> {
    /// The variant.
    pub system: &'a System,
    /// Its sources and heat.
    pub ramp: Ramp<'a>,
}

/// Change of the displacement and rate of one body.
#[derive(Debug, Clone, Copy)]
struct Change<const N: usize> {
    q: LanePose<N>,
    v: LanePose<N>,
}

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct LaneRodas4<const N: usize> {
    model: LaneModel<N>,
    w: LaneMatrix<N>,
    /// The motion; each lane begins its next step from here.
    pub motion: LaneMotion<N>,
    /// Where the last step began.
    pub before: LaneMotion<N>,
    /// Its estimated error.
    pub error: LaneMotion<N>,
    /// Norms in the mass of the displacements before and after it and of both parts of its error.
    pub norms: Norms<N>,
    force: Vec<LanePose<N>>,
    forcing: Vec<LanePose<N>>,
    at: Vec<LanePose<N>>,
    r1: Vec<LanePose<N>>,
    increments: Vec<[Change<N>; 5]>,
    placed: Vec<LanePlaced<N>>,
    expansion: Vec<Lanes<N>>,
    rate: Vec<Lanes<N>>,
    vanished: [bool; N],
    h: Lanes<N>,
    acted: Vec<usize>,
    acted_blocks: Vec<usize>,
    drives: Vec<Drive>,
    q: Vec<Pose>,
    r: Vec<Pose>,
    tangent: BlockMatrix<f64, 3>,
}

/// A part of a step that goes over all lanes.
#[derive(Debug, Clone, Copy)]
enum Task {
    Forcing,
    Begin(usize),
    Elastic(usize),
    Tangent,
    Factor,
    Solve,
    Finish,
}

struct Work<'a, const N: usize>(&'a mut LaneRodas4<N>, Task);

impl<const N: usize> WithSimd for Work<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let m = self.0;
        match self.1 {
            Task::Forcing => m.forcing(),
            Task::Begin(0) => m.begin::<0>(),
            Task::Begin(1) => m.begin::<1>(),
            Task::Begin(2) => m.begin::<2>(),
            Task::Begin(3) => m.begin::<3>(),
            Task::Begin(4) => m.begin::<4>(),
            Task::Begin(_) => m.begin::<5>(),
            Task::Elastic(i) => m.elastic(i),
            Task::Tangent => m.tangent(),
            Task::Factor => m.factor(),
            Task::Solve => m.solve(),
            Task::Finish => m.finish(),
        }
    }
}

impl<const N: usize> LaneRodas4<N> {
    /// Storage for a mechanism, with its numbers in every lane; none for a linear model, for one with inputs beside voltages,
    /// and on a processor without vectors.
    pub fn new(system: &System) -> Option<Self> {
        let model = LaneModel::new(&system.model).filter(|_| has_lanes() && system.electrics.inputs.is_empty())?;
        let (n, pattern) = (system.bodies(), &system.model.pattern);
        let acted = system.acted_on();
        let between = |&row: &usize| acted.iter().filter_map(move |&column| block(pattern, row, column));
        let none = Change { q: zero(), v: zero() };
        let heaters = system.electrics.heating.heaters.len();
        Some(Self {
            w: LaneMatrix::new(pattern),
            motion: LaneMotion::zeros(n),
            before: LaneMotion::zeros(n),
            error: LaneMotion::zeros(n),
            norms: Norms::default(),
            force: vec![zero(); n],
            forcing: vec![zero(); n],
            at: vec![zero(); n],
            r1: vec![zero(); n],
            increments: vec![[none; 5]; n],
            placed: vec![LanePlaced::GROUND; n + 1],
            expansion: vec![Lanes::ZERO; heaters],
            rate: vec![Lanes::ZERO; heaters],
            vanished: [false; N],
            h: Lanes::ONE,
            acted_blocks: acted.iter().flat_map(between).collect(),
            acted,
            drives: vec![system.electrics.drive(); N],
            q: vec![Pose::zeros(); n],
            r: vec![Pose::zeros(); n],
            tangent: BlockMatrix::new(pattern),
            model,
        })
    }

    /// True for a variant that differs in numbers alone.
    pub fn fits(&self, system: &System) -> bool {
        self.model.fits(&system.model)
            && system.electrics.inputs.is_empty()
            && self.expansion.len() == system.electrics.heating.heaters.len()
            && self.drives[0].volts.len() == system.gaps.len()
            && self.acted == system.acted_on()
    }

    /// Puts the numbers of a variant that fits, and its motion, into one lane. The sources of its ramp must hold their
    /// voltages.
    pub fn put(&mut self, lane: usize, system: &System, ramp: &Ramp<'_>, motion: &Motion) {
        debug_assert_eq!(ramp.from, ramp.to);
        self.model.put(lane, &system.model);
        self.motion.put(lane, motion);
        ramp.at(0.0, &mut self.drives[lane]);
        self.drives[lane].load = 1.0;
    }

    /// One step of each lane, of length `h` from the time `s` of its course [s]; for lanes without one all is left as it comes.
    /// Returns the lanes whose matrix could not be factored: their motion is nothing.
    pub fn step(&mut self, lanes: &[Option<Lane<'_>>; N], s: &[f64; N], h: &[f64; N]) -> [bool; N] {
        self.h = Lanes(*h);
        self.drive(lanes, s);
        let rate = &mut self.rate;
        for (k, lane) in lanes.iter().enumerate() {
            if let Some(lane) = lane {
                lane.ramp.expansion_rates(s[k], |j, x| rate[j].set_lane(k, x));
            }
        }
        self.run(Task::Forcing);
        for (i, alpha) in ALPHA.into_iter().enumerate() {
            if i > 0 {
                let mut at = *s;
                for (at, h) in at.iter_mut().zip(h) {
                    *at += alpha * h;
                }
                self.drive(lanes, &at);
            }
            self.run(Task::Begin(i));
            if i == 0 {
                self.run(Task::Tangent);
                self.act(lanes, i);
                self.run(Task::Factor);
            } else {
                self.run(Task::Elastic(i));
                self.act(lanes, i);
            }
            self.run(Task::Solve);
        }
        self.run(Task::Finish);
        self.vanished
    }

    /// Takes one lane back to where its last step began.
    pub fn go_back(&mut self, lane: usize) {
        self.motion.copy_lane(lane, &self.before);
    }

    fn run(&mut self, task: Task) {
        across(Work(self, task));
    }

    /// Free strains at the time of each lane.
    fn drive(&mut self, lanes: &[Option<Lane<'_>>; N], s: &[f64; N]) {
        let expansion = &mut self.expansion;
        for (k, lane) in lanes.iter().enumerate() {
            if let Some(lane) = lane {
                lane.ramp.expansions(s[k], |j, x| expansion[j].set_lane(k, x));
            }
        }
    }

    #[inline(always)]
    fn forcing(&mut self) {
        self.before.q.copy_from_slice(&self.motion.q);
        self.before.v.copy_from_slice(&self.motion.v);
        self.forcing.fill(zero());
        let change = LaneRest { expansion: &self.rate, built_in: Lanes::ZERO };
        forces::place(&self.motion.q, &mut self.placed);
        forces::add_rest_change(&self.model, &self.placed, &change, &mut self.forcing);
        forces::project(&self.model, &mut self.forcing);
    }

    #[inline(always)]
    fn begin<const I: usize>(&mut self) {
        let h = self.h;
        let gh = Lanes::splat(GAMMA) * h;
        let rate = Lanes::splat(GAMMA_I[I]) * h;
        let c = C[I].map(|c| Lanes::splat(c) / h);
        let Self { model, motion, force, forcing, at, r1, increments, .. } = self;
        for k in 0..model.bodies.len() {
            let (body, kept) = (&model.bodies[k], &mut increments[k]);
            if let Some(last) = I.checked_sub(1) {
                kept[last] = increment(model, k, &force[k], &r1[k], gh);
            }
            let (mut place_q, mut place_v) = (motion.q[k], motion.v[k]);
            for j in if I > IN_PLACE { IN_PLACE..I } else { 0..I } {
                add_scaled(&mut place_q, &kept[j].q, Lanes::splat(A[I][j]));
                add_scaled(&mut place_v, &kept[j].v, Lanes::splat(A[I][j]));
            }
            if I < IN_PLACE {
                at[k] = place_q;
            } else {
                (motion.q[k], motion.v[k]) = (place_q, place_v);
            }
            let mut lag = zero();
            for j in 0..I {
                add_scaled(&mut lag, &kept[j].q, c[j]);
            }
            let own: LanePose<N> = std::array::from_fn(|i| place_v[i] + lag[i]);
            r1[k] = own;
            let mut momentum = own.map(|x| x / gh);
            for j in 0..I {
                add_scaled(&mut momentum, &kept[j].v, c[j]);
            }
            let drag = body.drag_force(&lag);
            force[k] = std::array::from_fn(|i| forcing[k][i] * rate - drag[i] - body.mass[i] * momentum[i]);
        }
        if !model.dampers.is_empty() {
            let lag = |k: usize| {
                (0..I)
                    .fold(zero(), |lag: LanePose<N>, j| std::array::from_fn(|i| lag[i] - increments[k][j].q[i] * c[j]))
            };
            forces::add_dampers(model, lag, force);
        }
    }

    #[inline(always)]
    fn elastic(&mut self, i: usize) {
        let q = if i < IN_PLACE { &self.at } else { &self.motion.q };
        let rest = LaneRest { expansion: &self.expansion, built_in: Lanes::ONE };
        forces::place(q, &mut self.placed);
        forces::add_elastic_backwards(&self.model, (q, &self.placed), &rest, &mut self.force);
    }

    #[inline(always)]
    fn tangent(&mut self) {
        self.w.clear();
        let rest = LaneRest { expansion: &self.expansion, built_in: Lanes::ONE };
        // the first stage is where the step begins: the bodies have been placed there
        forces::add_tangent(&self.model, (&self.at, &self.placed), &rest, &mut self.w, &mut self.force);
    }

    #[inline(always)]
    fn factor(&mut self) {
        let gh = Lanes::splat(GAMMA) * self.h;
        forces::add_inertia(&self.model, Lanes::ONE / (gh * gh), Lanes::ONE / gh, &mut self.w);
        if self.model.holds {
            self.w.project(&self.model.pattern, &self.model.held);
        }
        self.vanished = self.w.factor(&self.model.pattern);
    }

    #[inline(always)]
    fn solve(&mut self) {
        forces::project(&self.model, &mut self.force);
        self.w.solve(&self.model.pattern, &mut self.force);
    }

    #[inline(always)]
    fn finish(&mut self) {
        let gh = Lanes::splat(GAMMA) * self.h;
        for k in 0..self.model.bodies.len() {
            let last = increment(&self.model, k, &self.force[k], &self.r1[k], gh);
            add(&mut self.motion.q[k], &last.q);
            add(&mut self.motion.v[k], &last.v);
            (self.error.q[k], self.error.v[k]) = (last.q, last.v);
        }
        let norm = |x: &[LanePose<N>]| mass_norm(&self.model, x);
        self.norms = Norms {
            before: norm(&self.before.q),
            after: norm(&self.motion.q),
            error_q: norm(&self.error.q),
            error_v: norm(&self.error.v),
        };
    }
}

fn block(pattern: &Pattern, row: usize, column: usize) -> Option<usize> {
    if row > column { pattern.block(row, column) } else { None }
}

/// Increment of a stage of body `k` whose solve left `solved`.
#[inline(always)]
fn increment<const N: usize>(
    model: &LaneModel<N>,
    k: usize,
    solved: &LanePose<N>,
    r1: &LanePose<N>,
    gh: Lanes<N>,
) -> Change<N> {
    let q = solved.map(|x| -x);
    let v = std::array::from_fn(|i| q[i] / gh - r1[i]);
    match &model.held[k] {
        Some((free, _)) => Change { q: times(free, &q), v: times(free, &v) },
        None => Change { q, v },
    }
}
