//! The parts that go over all lanes, in the vector instructions of the processor.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::storage::LaneEquilibrium;
use bimorph_multibody::batch::forces::{self, LaneRestStrain};
use bimorph_multibody::batch::{Kernel, SimdReal, ZERO_POSE, add, load, store};
use bimorph_multibody::planar::DOF;

/// A part that goes over all lanes.
#[derive(Debug, Clone, Copy)]
pub(super) enum EquilibriumPass {
    Tangent,
    Factor,
    Change,
    Predict,
    Correct,
}

pub(super) struct EquilibriumKernel<'a>(pub(super) &'a mut LaneEquilibrium, pub(super) EquilibriumPass);

impl Kernel for EquilibriumKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let m = self.0;
        match self.1 {
            EquilibriumPass::Tangent => m.lay_tangent::<W>(simd),
            EquilibriumPass::Factor => m.eliminate::<W>(simd),
            EquilibriumPass::Change => m.change::<W>(simd),
            EquilibriumPass::Predict => m.solve::<W>(simd, true),
            EquilibriumPass::Correct => m.solve::<W>(simd, false),
        }
    }
}

impl LaneEquilibrium {
    #[inline(always)]
    fn lay_tangent<W: SimdReal>(&mut self, simd: W::Simd) {
        self.tangent.clear();
        self.force.fill(ZERO_POSE);
        let rest = LaneRestStrain { expansion: &self.expansion, built_in: self.built_in[0] };
        forces::place::<W>(simd, &self.trial, &mut self.placed);
        let at = (self.trial.as_slice(), self.placed.as_slice());
        forces::add_tangent::<W>(simd, &self.model, at, &rest, &mut self.tangent, &mut self.force);
    }

    #[inline(always)]
    fn eliminate<W: SimdReal>(&mut self, simd: W::Simd) {
        forces::project::<W>(simd, &self.model, &mut self.force);
        if self.model.holds {
            self.tangent.project::<W>(simd, &self.model.pattern, &self.model.held);
        }
        self.vanished = self.tangent.factor::<W>(simd, &self.model.pattern);
        self.tangent.negative::<W>(simd).store(&mut self.negative);
    }

    /// Effect of a change of free strains, in `force`.
    #[inline(always)]
    fn change<W: SimdReal>(&mut self, simd: W::Simd) {
        self.force.fill(ZERO_POSE);
        let change = LaneRestStrain { expansion: &self.rate, built_in: self.built_in[1] };
        forces::add_rest_change::<W>(simd, &self.model, &self.placed, &change, &mut self.force);
    }

    /// The step from the change or from the residual in `force`, and where it leads.
    #[inline(always)]
    fn solve<W: SimdReal>(&mut self, simd: W::Simd, predicts: bool) {
        let Self { model, tangent, trial, force, residual, goes, .. } = self;
        if predicts {
            forces::project::<W>(simd, model, force);
            for (force, residual) in force.iter_mut().zip(&*residual) {
                let (mut step, rest) = (load::<W, DOF>(simd, force), load::<W, DOF>(simd, residual));
                for i in 0..DOF {
                    step[i] = step[i] * -1.0 - rest[i];
                }
                store(step, force);
            }
        }
        tangent.solve::<W>(simd, &model.pattern, force);
        let (goes, none) = (W::load(simd, goes), W::splat(simd, 0.0));
        for (trial, step) in trial.iter_mut().zip(&*force) {
            let mut step = load::<W, DOF>(simd, step);
            for i in 0..DOF {
                step[i] = goes.if_zero(none, if predicts { step[i] } else { -step[i] });
            }
            add(simd, trial, &step);
        }
    }
}
