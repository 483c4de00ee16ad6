//! The parts that go over all lanes, in the vector instructions of the processor.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::storage::{LaneModes, Which};
use super::vectors::{dot, mass_product, scale, weigh};
use bimorph_multibody::batch::forces::{self, LaneRestStrain};
use bimorph_multibody::batch::{Kernel, SimdReal, load, store};
use bimorph_multibody::planar::DOF;
use bimorph_multibody::scalar::Double;

/// A part that goes over all lanes.
#[derive(Debug, Clone, Copy)]
pub(super) enum ModesPass {
    /// K at the drawn geometry.
    Stiffness,
    /// Its factor, or that of K − σM, and how many pivots are negative.
    Factor(Which),
    /// One inverse iteration of a shape, and its λ.
    Invert(Which, usize),
    /// The best modes in the span of all shapes.
    Ritz,
    /// The shapes of these.
    Combine,
    /// λ and the residual of a shape, in extended precision.
    Measure(usize),
}

pub(super) struct ModesKernel<'a>(pub(super) &'a mut LaneModes, pub(super) ModesPass);

impl Kernel for ModesKernel<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let m = self.0;
        match self.1 {
            ModesPass::Stiffness => m.tangent::<W>(simd),
            ModesPass::Factor(which) => m.eliminate::<W>(simd, which),
            ModesPass::Invert(which, k) => m.invert::<W>(simd, which, k),
            ModesPass::Ritz => m.ritz::<W>(simd),
            ModesPass::Combine => m.small.combine::<W>(simd, &m.model, &mut m.x, &mut m.given),
            ModesPass::Measure(k) => m.measure::<W>(simd, k),
        }
    }
}

impl LaneModes {
    #[inline(always)]
    fn tangent<W: SimdReal>(&mut self, simd: W::Simd) {
        let Self { model, stiffness, placed, still, expansion, force, .. } = self;
        stiffness.clear();
        // nothing acts: neither heat nor built-in strain
        let rest = LaneRestStrain { expansion, built_in: 0.0 };
        forces::place::<W>(simd, still, placed);
        forces::add_tangent::<W>(simd, model, (still, placed), &rest, stiffness, force);
    }

    #[inline(always)]
    fn eliminate<W: SimdReal>(&mut self, simd: W::Simd, which: Which) {
        let Self { model, plain, shifted, vanished, below, .. } = self;
        let matrix = if which == Which::Plain { plain } else { shifted };
        if model.holds {
            matrix.project::<W>(simd, &model.pattern, &model.held);
        }
        *vanished = matrix.factor::<W>(simd, &model.pattern);
        matrix.negative::<W>(simd).store(below);
    }

    #[inline(always)]
    fn invert<W: SimdReal>(&mut self, simd: W::Simd, which: Which, k: usize) {
        let Self { model, plain, shifted, x, given, force, shift, lambda, .. } = self;
        let (x, given) = (&mut x[k], &mut given[k]);
        let (matrix, shift) = match which {
            Which::Plain => (plain, W::splat(simd, 0.0)),
            Which::Shifted => (shifted, W::load(simd, shift)),
        };
        weigh::<W>(simd, model, x, given);
        forces::project::<W>(simd, model, given);
        force.copy_from_slice(given);
        matrix.solve::<W>(simd, &model.pattern, force);
        forces::project::<W>(simd, model, force);
        let (work, size) = (dot::<W>(simd, force, given), mass_product::<W>(simd, model, force, force));
        // Rayleigh's quotient of what has been solved for
        (shift + work / size).store(&mut lambda[k]);
        let shorter = W::splat(simd, 1.0) / size.sqrt();
        scale(simd, force, shorter);
        scale(simd, given, shorter);
        x.copy_from_slice(force);
    }

    #[inline(always)]
    fn ritz<W: SimdReal>(&mut self, simd: W::Simd) {
        let Self { model, x, given, small, lambda, .. } = self;
        small.resize(x.len());
        for i in 0..x.len() {
            for j in 0..=i {
                let both = dot::<W>(simd, &x[i], &given[j]) + dot::<W>(simd, &x[j], &given[i]);
                (both * 0.5).store(small.a(i, j));
                mass_product::<W>(simd, model, &x[i], &x[j]).store(small.b(i, j));
            }
        }
        small.solve::<W>(simd, lambda);
    }

    #[inline(always)]
    fn measure<W: SimdReal>(&mut self, simd: W::Simd, k: usize) {
        let Self { model, precise, plain, x, force, product, lambda, residual, .. } = self;
        let none = W::splat(simd, 0.0);
        for product in product.iter_mut().flatten() {
            store([none; 2], product);
        }
        precise.multiply_add::<W>(simd, &x[k], product);
        let (mut sum, mut size) = (Double::from(none), Double::from(none));
        for ((x, product), body) in x[k].iter().zip(&*product).zip(&model.bodies) {
            let (x, m) = (load::<W, DOF>(simd, x), load::<W, DOF>(simd, &body.mass));
            for i in 0..DOF {
                let [high, low] = load::<W, 2>(simd, &product[i]);
                sum += Double { high, low } * x[i];
                size += Double::from(x[i]) * x[i] * m[i];
            }
        }
        let found = sum.high / size.high;
        found.store(&mut lambda[k]);
        for (((to, x), product), body) in force.iter_mut().zip(&x[k]).zip(&*product).zip(&model.bodies) {
            let (x, m) = (load::<W, DOF>(simd, x), load::<W, DOF>(simd, &body.mass));
            let mut rest = x;
            for i in 0..DOF {
                let [high, low] = load::<W, 2>(simd, &product[i]);
                rest[i] = (Double { high, low } - Double::from(x[i]) * m[i] * found).high;
            }
            store(rest, to);
        }
        forces::project::<W>(simd, model, force);
        plain.solve::<W>(simd, &model.pattern, force);
        forces::project::<W>(simd, model, force);
        mass_product::<W>(simd, model, force, force).sqrt().store(&mut residual[k]);
    }
}
