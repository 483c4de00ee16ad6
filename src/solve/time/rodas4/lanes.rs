//! Rodas4 over variants side by side: a step of each, with its own length, in the vector instructions of the processor.
//!
//! Everything that all bodies and joints go through is done for all lanes at once, in the order of [`super`] and of
//! `stages`; gaps and dead loads act on few bodies and have branches of their own, and go variant by variant.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

mod acted;
mod motion;

pub use motion::{LaneMotion, Norms};

use super::{A, ALPHA, C, GAMMA, GAMMA_I, moves_on};
use crate::gaps::{Drive, Lags, Ramp, System};
use crate::multibody::lanes::forces::{self, LaneRest};
use crate::multibody::lanes::joint::LanePlaced;
use crate::multibody::lanes::{
    Eight, Kernel, LANES, LaneMatrix, LaneModel, LanePose, Real, STILL, Wide, across, add, add_scaled, load,
    load_block, store, times,
};
use crate::multibody::planar::Pose;
use crate::multibody::rcr::has_lanes;
use crate::multibody::{BlockMatrix, Pattern};
use crate::solve::time::method::Motion;
use motion::mass_norm;

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
struct Change<T = Eight> {
    q: LanePose<T>,
    v: LanePose<T>,
}

impl Change {
    #[inline(always)]
    fn load<W: Wide>(&self, simd: W::Simd) -> Change<W> {
        Change { q: load(simd, &self.q), v: load(simd, &self.v) }
    }
}

/// The method with its storage.
#[derive(Debug, Clone)]
pub struct LaneRodas4 {
    model: LaneModel,
    w: LaneMatrix,
    /// The motion; each lane begins its next step from here.
    pub motion: LaneMotion,
    /// Where the last step began.
    pub before: LaneMotion,
    /// Its estimated error.
    pub error: LaneMotion,
    /// Norms in the mass of the displacements before and after it and of both parts of its error.
    pub norms: Norms,
    force: Vec<LanePose>,
    forcing: Vec<LanePose>,
    at: Vec<LanePose>,
    r1: Vec<LanePose>,
    increments: Vec<[Change; 5]>,
    /// Rates by which dampers lag, for each body; empty without dampers.
    lags: Vec<LanePose>,
    placed: Vec<LanePlaced>,
    expansion: Vec<Eight>,
    rate: Vec<Eight>,
    vanished: [bool; LANES],
    h: Eight,
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

struct Work<'a>(&'a mut LaneRodas4, Task);

impl Kernel for Work<'_> {
    #[inline(always)]
    fn run<W: Wide>(self, simd: W::Simd) {
        let m = self.0;
        match self.1 {
            Task::Forcing => m.forcing::<W>(simd),
            Task::Begin(0) => m.begin::<W, 0>(simd),
            Task::Begin(1) => m.begin::<W, 1>(simd),
            Task::Begin(2) => m.begin::<W, 2>(simd),
            Task::Begin(3) => m.begin::<W, 3>(simd),
            Task::Begin(4) => m.begin::<W, 4>(simd),
            Task::Begin(_) => m.begin::<W, 5>(simd),
            Task::Elastic(i) => m.elastic::<W>(simd, i),
            Task::Tangent => m.tangent::<W>(simd),
            Task::Factor => m.factor::<W>(simd),
            Task::Solve => m.solve::<W>(simd),
            Task::Finish => m.finish::<W>(simd),
        }
    }
}

impl LaneRodas4 {
    /// Storage for a mechanism, with its numbers in every lane; none for a linear model, for one with inputs beside voltages,
    /// and on a processor without vectors.
    pub fn new(system: &System) -> Option<Self> {
        let model = LaneModel::new(&system.model).filter(|_| has_lanes() && system.electrics.inputs.is_empty())?;
        let (n, pattern) = (system.bodies(), &system.model.pattern);
        let acted = system.acted_on();
        let between = |&row: &usize| acted.iter().filter_map(move |&column| block(pattern, row, column));
        let none = Change { q: STILL, v: STILL };
        let heaters = system.electrics.heating.heaters.len();
        Some(Self {
            w: LaneMatrix::new(pattern),
            motion: LaneMotion::zeros(n),
            before: LaneMotion::zeros(n),
            error: LaneMotion::zeros(n),
            norms: Norms::default(),
            force: vec![STILL; n],
            forcing: vec![STILL; n],
            at: vec![STILL; n],
            r1: vec![STILL; n],
            increments: vec![[none; 5]; n],
            lags: vec![STILL; if model.dampers.is_empty() { 0 } else { n }],
            placed: vec![LanePlaced::GROUND; n + 1],
            expansion: vec![Eight::NONE; heaters],
            rate: vec![Eight::NONE; heaters],
            vanished: [false; LANES],
            h: Eight::of(1.0),
            acted_blocks: acted.iter().flat_map(between).collect(),
            acted,
            drives: vec![system.electrics.drive(); LANES],
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
    pub fn step(&mut self, lanes: &[Option<Lane<'_>>; LANES], s: &[f64; LANES], h: &[f64; LANES]) -> [bool; LANES] {
        self.h.0 = *h;
        let (expansion, rate) = (&mut self.expansion, &mut self.rate);
        for (k, lane) in lanes.iter().enumerate() {
            if let Some(lane) = lane {
                let mut lags = Lags::new(s[k]);
                lane.ramp.expansions(&mut lags, |j, x| expansion[j].set_lane(k, x));
                lane.ramp.expansion_rates(&mut lags, |j, x| rate[j].set_lane(k, x));
            }
        }
        self.run(Task::Forcing);
        for (i, alpha) in ALPHA.into_iter().enumerate() {
            if moves_on(i) {
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
    fn drive(&mut self, lanes: &[Option<Lane<'_>>; LANES], s: &[f64; LANES]) {
        let expansion = &mut self.expansion;
        for (k, lane) in lanes.iter().enumerate() {
            if let Some(lane) = lane {
                lane.ramp.expansions(&mut Lags::new(s[k]), |j, x| expansion[j].set_lane(k, x));
            }
        }
    }

    #[inline(always)]
    fn forcing<W: Wide>(&mut self, simd: W::Simd) {
        self.before.q.copy_from_slice(&self.motion.q);
        self.before.v.copy_from_slice(&self.motion.v);
        self.forcing.fill(STILL);
        let change = LaneRest { expansion: &self.rate, built_in: 0.0 };
        forces::place::<W>(simd, &self.motion.q, &mut self.placed);
        forces::add_rest_change::<W>(simd, &self.model, &self.placed, &change, &mut self.forcing);
        forces::project::<W>(simd, &self.model, &mut self.forcing);
    }

    #[inline(always)]
    fn begin<W: Wide, const I: usize>(&mut self, simd: W::Simd) {
        let h = W::load(simd, &self.h);
        let (gh, rate) = (h * GAMMA, h * GAMMA_I[I]);
        let mut c = [h; 5];
        for (c, of) in c.iter_mut().zip(C[I]) {
            *c = W::splat(simd, of) / h;
        }
        let Self { model, motion, force, forcing, at, r1, increments, lags, .. } = self;
        for k in 0..model.bodies.len() {
            let (body, kept) = (model.bodies[k].load::<W>(simd), &mut increments[k]);
            if let Some(last) = I.checked_sub(1) {
                let change = increment::<W>(simd, model, k, &force[k], &r1[k], gh);
                store(change.q, &mut kept[last].q);
                store(change.v, &mut kept[last].v);
            }
            let kept = |j: usize| kept[j].load::<W>(simd);
            let (mut place_q, mut place_v) = (load(simd, &motion.q[k]), load(simd, &motion.v[k]));
            for j in if I > IN_PLACE { IN_PLACE..I } else { 0..I } {
                add_scaled(&mut place_q, &kept(j).q, W::splat(simd, A[I][j]));
                add_scaled(&mut place_v, &kept(j).v, W::splat(simd, A[I][j]));
            }
            if I < IN_PLACE {
                store(place_q, &mut at[k]);
            } else {
                store(place_q, &mut motion.q[k]);
                store(place_v, &mut motion.v[k]);
            }
            let mut lag = [W::splat(simd, 0.0); 3];
            for j in 0..I {
                add_scaled(&mut lag, &kept(j).q, c[j]);
            }
            let (mut own, mut momentum) = (lag, lag);
            for i in 0..3 {
                own[i] = place_v[i] + lag[i];
                momentum[i] = own[i] / gh;
            }
            store(own, &mut r1[k]);
            for j in 0..I {
                add_scaled(&mut momentum, &kept(j).v, c[j]);
            }
            let (drag, forcing) = (body.drag_force(&lag), load::<W, 3>(simd, &forcing[k]));
            for i in 0..3 {
                (forcing[i] * rate - drag[i] - body.mass[i] * momentum[i]).store(&mut force[k][i]);
            }
        }
        for (k, lag) in lags.iter_mut().enumerate() {
            let mut sum = [W::splat(simd, 0.0); 3];
            for j in 0..I {
                for i in 0..3 {
                    sum[i] -= W::load(simd, &increments[k][j].q[i]) * c[j];
                }
            }
            store(sum, lag);
        }
        forces::add_dampers::<W>(simd, model, lags, force);
    }

    #[inline(always)]
    fn elastic<W: Wide>(&mut self, simd: W::Simd, i: usize) {
        let q = if i < IN_PLACE { &self.at } else { &self.motion.q };
        let rest = LaneRest { expansion: &self.expansion, built_in: 1.0 };
        forces::place::<W>(simd, q, &mut self.placed);
        forces::add_elastic_backwards::<W>(simd, &self.model, (q, &self.placed), &rest, &mut self.force);
    }

    #[inline(always)]
    fn tangent<W: Wide>(&mut self, simd: W::Simd) {
        self.w.clear();
        let rest = LaneRest { expansion: &self.expansion, built_in: 1.0 };
        // the first stage is where the step begins: the bodies have been placed there
        forces::add_tangent::<W>(simd, &self.model, (&self.at, &self.placed), &rest, &mut self.w, &mut self.force);
    }

    #[inline(always)]
    fn factor<W: Wide>(&mut self, simd: W::Simd) {
        let (gh, one) = (W::load(simd, &self.h) * GAMMA, W::splat(simd, 1.0));
        forces::add_inertia(simd, &self.model, one / (gh * gh), one / gh, &mut self.w);
        if self.model.holds {
            self.w.project::<W>(simd, &self.model.pattern, &self.model.held);
        }
        self.vanished = self.w.factor::<W>(simd, &self.model.pattern);
    }

    #[inline(always)]
    fn solve<W: Wide>(&mut self, simd: W::Simd) {
        forces::project::<W>(simd, &self.model, &mut self.force);
        self.w.solve::<W>(simd, &self.model.pattern, &mut self.force);
    }

    #[inline(always)]
    fn finish<W: Wide>(&mut self, simd: W::Simd) {
        let gh = W::load(simd, &self.h) * GAMMA;
        for k in 0..self.model.bodies.len() {
            let last = increment::<W>(simd, &self.model, k, &self.force[k], &self.r1[k], gh);
            add(simd, &mut self.motion.q[k], &last.q);
            add(simd, &mut self.motion.v[k], &last.v);
            store(last.q, &mut self.error.q[k]);
            store(last.v, &mut self.error.v[k]);
        }
        self.norms = Norms {
            before: mass_norm::<W>(simd, &self.model, &self.before.q),
            after: mass_norm::<W>(simd, &self.model, &self.motion.q),
            error_q: mass_norm::<W>(simd, &self.model, &self.error.q),
            error_v: mass_norm::<W>(simd, &self.model, &self.error.v),
        };
    }
}

fn block(pattern: &Pattern, row: usize, column: usize) -> Option<usize> {
    if row > column { pattern.block(row, column) } else { None }
}

/// Increment of a stage of body `k` whose solve left `solved`.
#[inline(always)]
fn increment<W: Wide>(
    simd: W::Simd,
    model: &LaneModel,
    k: usize,
    solved: &LanePose,
    r1: &LanePose,
    gh: W,
) -> Change<W> {
    let (solved, r1) = (load::<W, 3>(simd, solved), load::<W, 3>(simd, r1));
    let (mut q, mut v) = (solved, r1);
    for i in 0..3 {
        q[i] = -solved[i];
        v[i] = q[i] / gh - r1[i];
    }
    match &model.held[k] {
        Some((free, _)) => {
            let free = load_block::<W>(simd, free);
            Change { q: times(&free, &q), v: times(&free, &v) }
        }
        None => Change { q, v },
    }
}
