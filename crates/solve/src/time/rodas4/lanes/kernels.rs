//! The parts of a step that go over all lanes, in the vector instructions of the processor.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::super::body_stage::{BodyState, BodyTerms, StageScale, body_stage, increment};
use super::super::tableau::{GAMMA, IN_PLACE};
use super::motion::{Norms, mass_norm};
use super::storage::LaneRodas4;
use bimorph_multibody::batch::forces::{self, LaneRestStrain};
use bimorph_multibody::batch::{Kernel, LaneModel, LanePose, SimdReal, ZERO_POSE, add, load, load_block, store};
use bimorph_multibody::planar::DOF;

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
        let scale = StageScale::of::<I>(W::load(simd, &self.h));
        let Self { model, motion, force, forcing, at, r1, increments, lags, .. } = self;
        for k in 0..model.bodies.len() {
            let (body, kept) = (model.bodies[k].load::<W>(simd), &mut increments[k]);
            if let Some(last) = I.checked_sub(1) {
                let last_change = change::<W>(simd, model, k, &force[k], &r1[k], scale.gh);
                last_change.store(&mut kept[last]);
            }
            let start = BodyState { q: load(simd, &motion.q[k]), v: load(simd, &motion.v[k]) };
            let drag = |v: &LanePose<W>| body.drag_force(v);
            let terms = BodyTerms { mass: body.mass, drag, forcing: load::<W, DOF>(simd, &forcing[k]) };
            let stage = body_stage::<W, I>(&scale, start, |j| kept[j].load::<W>(simd), terms);
            if I < IN_PLACE {
                store(stage.place.q, &mut at[k]);
            } else {
                store(stage.place.q, &mut motion.q[k]);
                store(stage.place.v, &mut motion.v[k]);
            }
            store(stage.r1, &mut r1[k]);
            store(stage.force, &mut force[k]);
        }
        for (k, lag) in lags.iter_mut().enumerate() {
            let mut sum = [W::splat(simd, 0.0); DOF];
            for j in 0..I {
                for i in 0..DOF {
                    sum[i] -= W::load(simd, &increments[k][j].q[i]) * scale.c[j];
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
            let last = change::<W>(simd, &self.model, k, &self.force[k], &self.r1[k], gh);
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
fn change<W: SimdReal>(
    simd: W::Simd,
    model: &LaneModel,
    k: usize,
    solved: &LanePose,
    r1: &LanePose,
    gh: W,
) -> BodyState<W> {
    let free = model.held[k].as_ref().map(|(free, _)| move || load_block::<W>(simd, free));
    increment(&load(simd, solved), &load(simd, r1), gh, free)
}
