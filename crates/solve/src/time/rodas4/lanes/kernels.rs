//! The parts of a step that go over all lanes, in the vector instructions of the processor.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::super::tableau::{A, C, GAMMA, GAMMA_I, IN_PLACE};
use super::motion::{Norms, mass_norm};
use super::storage::{LaneIncrement, LaneRodas4};
use bimorph_multibody::batch::forces::{self, LaneRestStrain};
use bimorph_multibody::batch::{
    Kernel, LaneModel, LanePose, SimdReal, ZERO_POSE, add, add_scaled, load, load_block, store, times,
};

/// A part of a step that goes over all lanes.
#[derive(Debug, Clone, Copy)]
pub(super) enum StepPass {
    Forcing,
    Expand,
    Begin(usize),
    Elastic(usize),
    Tangent,
    Factor,
    Solve,
    Finish,
}

pub(super) struct StepKernel<'a>(pub(super) &'a mut LaneRodas4, pub(super) StepPass);

impl LaneRodas4 {
    #[inline(always)]
    fn forcing<W: SimdReal>(&mut self, simd: W::Simd) {
        self.heat.expansions::<W>(simd, &mut self.expansion);
        self.heat.rates::<W>(simd, &mut self.rate);
        self.before.q.copy_from_slice(&self.motion.q);
        self.before.v.copy_from_slice(&self.motion.v);
        self.forcing.fill(ZERO_POSE);
        let change = LaneRestStrain { expansion: &self.rate, built_in: 0.0 };
        forces::place::<W>(simd, &self.motion.q, &mut self.placed);
        forces::add_rest_change::<W>(simd, &self.model, &self.placed, &change, &mut self.forcing);
        forces::project::<W>(simd, &self.model, &mut self.forcing);
    }

    #[inline(always)]
    fn begin<W: SimdReal, const I: usize>(&mut self, simd: W::Simd) {
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
    fn elastic<W: SimdReal>(&mut self, simd: W::Simd, i: usize) {
        let q = if i < IN_PLACE { &self.at } else { &self.motion.q };
        let rest = LaneRestStrain { expansion: &self.expansion, built_in: 1.0 };
        forces::place::<W>(simd, q, &mut self.placed);
        forces::add_elastic_backwards::<W>(simd, &self.model, (q, &self.placed), &rest, &mut self.force);
    }

    #[inline(always)]
    fn tangent<W: SimdReal>(&mut self, simd: W::Simd) {
        self.w.clear();
        let rest = LaneRestStrain { expansion: &self.expansion, built_in: 1.0 };
        // the first stage is where the step begins: the bodies have been placed there
        forces::add_tangent::<W>(simd, &self.model, (&self.at, &self.placed), &rest, &mut self.w, &mut self.force);
    }

    #[inline(always)]
    fn factor<W: SimdReal>(&mut self, simd: W::Simd) {
        let (gh, one) = (W::load(simd, &self.h) * GAMMA, W::splat(simd, 1.0));
        forces::add_inertia(simd, &self.model, one / (gh * gh), one / gh, &mut self.w);
        if self.model.holds {
            self.w.project::<W>(simd, &self.model.pattern, &self.model.held);
        }
        self.vanished = self.w.factor::<W>(simd, &self.model.pattern);
    }

    #[inline(always)]
    fn solve<W: SimdReal>(&mut self, simd: W::Simd) {
        forces::project::<W>(simd, &self.model, &mut self.force);
        self.w.solve::<W>(simd, &self.model.pattern, &mut self.force);
    }

    #[inline(always)]
    fn finish<W: SimdReal>(&mut self, simd: W::Simd) {
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

impl Kernel for StepKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let m = self.0;
        match self.1 {
            StepPass::Forcing => m.forcing::<W>(simd),
            StepPass::Expand => m.heat.expansions::<W>(simd, &mut m.expansion),
            StepPass::Begin(0) => m.begin::<W, 0>(simd),
            StepPass::Begin(1) => m.begin::<W, 1>(simd),
            StepPass::Begin(2) => m.begin::<W, 2>(simd),
            StepPass::Begin(3) => m.begin::<W, 3>(simd),
            StepPass::Begin(4) => m.begin::<W, 4>(simd),
            StepPass::Begin(_) => m.begin::<W, 5>(simd),
            StepPass::Elastic(i) => m.elastic::<W>(simd, i),
            StepPass::Tangent => m.tangent::<W>(simd),
            StepPass::Factor => m.factor::<W>(simd),
            StepPass::Solve => m.solve::<W>(simd),
            StepPass::Finish => m.finish::<W>(simd),
        }
    }
}

/// Increment of a stage of body `k` whose solve left `solved`.
#[inline(always)]
fn increment<W: SimdReal>(
    simd: W::Simd,
    model: &LaneModel,
    k: usize,
    solved: &LanePose,
    r1: &LanePose,
    gh: W,
) -> LaneIncrement<W> {
    let (solved, r1) = (load::<W, 3>(simd, solved), load::<W, 3>(simd, r1));
    let (mut q, mut v) = (solved, r1);
    for i in 0..3 {
        q[i] = -solved[i];
        v[i] = q[i] / gh - r1[i];
    }
    match &model.held[k] {
        Some((free, _)) => {
            let free = load_block::<W>(simd, free);
            LaneIncrement { q: times(&free, &q), v: times(&free, &v) }
        }
        None => LaneIncrement { q, v },
    }
}
