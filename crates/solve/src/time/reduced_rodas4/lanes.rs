//! A step of eight motions of one reduced model at once, with stages of polynomials.
//!
//! The motions have the same polynomials and different sources, times and lengths of steps. Each has a [`ReducedRodas4`] of its own, which places the
//! bodies at the end of a step, estimates errors, and compares the polynomials with the exact kinematics. Operations of a stage are those of that
//! method in their order.

// blocks of fixed size are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::ReducedRodas4;
use crate::reduced::polynomial::motion::PolynomialMotion;
use crate::reduced::polynomial::motion::lanes::{LanePolynomialForces, LaneReducedMotion};
use crate::time::method::{Motion, StepResult};
use crate::time::rodas4::lanes::heat::LaneHeat;
use crate::time::rodas4::tableau::{A, ALPHA, C, GAMMA, GAMMA_I};
use crate::time::rosenbrock::{self, RosenbrockStep};
use bimorph_domains::{Ramp, System};
use bimorph_multibody::batch::{Kernel, LANES, Lane8, SimdReal, across};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::scalar::{StoredReal, has_lanes};
use std::sync::Arc;

/// Stages of a step.
const STAGES: usize = ALPHA.len();

/// The method in lanes with its storage.
#[derive(Debug, Clone)]
pub struct LaneReducedRodas4 {
    of: Arc<PolynomialMotion>,
    forces: LanePolynomialForces,
    heat: LaneHeat,
    now: LaneReducedMotion,
    at: LaneReducedMotion,
    increments: Vec<LaneReducedMotion>,
    /// Cholesky's factor, by columns.
    factor: Vec<Lane8>,
    right: Vec<Lane8>,
    r1: Vec<Lane8>,
    r2: Vec<Lane8>,
    product: Vec<Lane8>,
    damped: bool,
    h: Lane8,
    active: [bool; LANES],
    /// Lanes whose matrix has no factor.
    vanished: [bool; LANES],
    /// Motion of the bodies per unit of each direction, those of a body together, and their masses (kg, kg·m²).
    moved: Vec<Pose>,
    mass: Vec<Pose>,
    /// Norms √(eᵀMe) of the error of the last step, of displacements and of rates.
    errors: [[f64; LANES]; 2],
}

impl LaneReducedRodas4 {
    /// For the model of a method; none where lanes cannot have it: without polynomials, with resistances that depend on temperature, with
    /// mechanical inputs, and on processors without vector instructions.
    pub fn new(method: &ReducedRodas4, system: &System) -> Option<Self> {
        let stages = method.polynomials.as_ref()?;
        let electrics = &system.electrics;
        if !has_lanes() || electrics.heating.is_hot() || !electrics.inputs.is_empty() || method.ports.is_some() {
            return None;
        }
        let m = method.space.size();
        let none = |count: usize| vec![Lane8::of(0.0); count];
        Some(Self {
            of: Arc::clone(&stages.of),
            forces: LanePolynomialForces::new(&stages.of),
            heat: LaneHeat::new(&electrics.heating.heaters),
            now: LaneReducedMotion::zeros(m),
            at: LaneReducedMotion::zeros(m),
            increments: vec![LaneReducedMotion::zeros(m); STAGES],
            factor: none(m * m),
            right: none(m),
            r1: none(m),
            r2: none(m),
            product: none(m),
            damped: method.damped,
            h: Lane8::of(1.0),
            active: [false; LANES],
            vanished: [false; LANES],
            moved: stages.moved.clone(),
            mass: (0..system.bodies()).map(|j| system.model.mass(j)).collect(),
            errors: [[0.0; LANES]; 2],
        })
    }

    /// Puts a run that has started into a lane. The sources of its ramp must hold their voltages.
    pub fn set_lane(&mut self, lane: usize, method: &ReducedRodas4, ramp: &Ramp<'_>) {
        debug_assert_eq!(ramp.from, ramp.to);
        for (to, from) in self.now.all().into_iter().zip(method.now.parts()) {
            to.iter_mut().zip(from).for_each(|(to, from)| to.set_lane(lane, *from));
        }
        self.heat.set_lane(lane, ramp);
        let mut drive = ramp.electrics.drive();
        ramp.at(0.0, &mut drive);
        self.forces.volts.iter_mut().zip(&drive.volts).for_each(|(to, volts)| to[lane] = *volts);
        self.active[lane] = true;
    }

    /// Takes a run out of its lane.
    pub fn clear_lane(&mut self, lane: usize) {
        self.active[lane] = false;
    }

    /// A step of each lane, of length `h` from the time `s` of its course (s). Returns the lanes whose matrix has no factor: their motion is nothing.
    pub fn step(&mut self, s: &[f64; LANES], h: &[f64; LANES]) -> [bool; LANES] {
        self.h.0 = *h;
        match rosenbrock::take(&mut LaneReducedStep { rodas: self, s, h }) {
            Ok(()) => self.vanished,
            Err(_) => [true; LANES],
        }
    }

    /// The end of the step of a lane goes to its own method, which places the bodies there.
    pub fn give(&self, lane: usize, method: &mut ReducedRodas4, motion: &mut Motion) {
        let last = &self.increments[STAGES - 1];
        let all = self.at.parts().into_iter().zip(last.parts()).zip(method.now.parts_mut());
        for ((at, u), now) in all {
            for ((at, u), now) in at.iter().zip(u).zip(now) {
                *now = at.lane(lane) + u.lane(lane);
            }
        }
        let [z, v, _] = method.increments[STAGES - 1].parts_mut();
        for (to, from) in [(z, &last.z), (v, &last.v)] {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from.lane(lane));
        }
        method.place_end(motion);
        method.work.forces += STAGES as u64;
        method.work.solves += STAGES as u64;
        method.work.factorizations += 1;
    }

    /// Norms √(eᵀMe) of the error of the last step in a lane, of displacements and of rates.
    pub fn error_norms(&self, lane: usize) -> [f64; 2] {
        self.errors.map(|norms| norms[lane])
    }

    /// The step of a lane is accepted: the next one begins at its end, and its own method has the matrices of this one.
    pub fn accept(&mut self, lane: usize, method: &mut ReducedRodas4) {
        for (to, from) in self.now.all().into_iter().zip(method.now.parts()) {
            to.iter_mut().zip(from).for_each(|(to, from)| to.set_lane(lane, *from));
        }
        let LanePolynomialForces { mass, damping, stiffness, .. } = &self.forces;
        let all = [(mass, &mut method.mass), (damping, &mut method.damping), (stiffness, &mut method.stiffness)];
        for (from, to) in all {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from.lane(lane));
        }
    }

    /// Free strains at a time of each lane (s).
    fn warm(&mut self, s: &[f64; LANES]) {
        self.heat.at(std::array::from_fn(|k| self.active[k].then_some(s[k])));
        across(Warm(self));
    }
}

impl ReducedRodas4 {
    /// Projects a motion, at which this method and its copies start next.
    pub fn start_at(&mut self, motion: &Motion) {
        self.project(motion);
        self.projected = true;
    }
}

/// Free strains in all lanes.
struct Warm<'a>(&'a mut LaneReducedRodas4);

impl Kernel for Warm<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let LaneReducedRodas4 { heat, forces, now, .. } = self.0;
        let (first, count) = (2 * now.z.len(), heat.count());
        heat.expansions::<W>(simd, &mut forces.given[first..first + count]);
        forces.given[first + count] = Lane8::of(1.0);
    }
}

/// A step of all lanes under way.
struct LaneReducedStep<'a> {
    rodas: &'a mut LaneReducedRodas4,
    /// Start and length in each lane (s).
    s: &'a [f64; LANES],
    h: &'a [f64; LANES],
}

impl RosenbrockStep for LaneReducedStep<'_> {
    fn begin(&mut self) -> StepResult {
        self.rodas.warm(self.s);
        across(Rates(self.rodas));
        Ok(())
    }

    fn drive_at(&mut self, alpha: f64) {
        let mut at = *self.s;
        for (at, h) in at.iter_mut().zip(self.h) {
            *at += alpha * h;
        }
        self.rodas.warm(&at);
    }

    fn argument(&mut self, i: usize) {
        across(StageArgument(self.rodas, i));
    }

    fn residual(&mut self, _: usize) {
        let LaneReducedRodas4 { of, forces, at, active, .. } = &mut *self.rodas;
        forces.residual(of, at, active);
    }

    /// A lane without a factor is marked, and the others go on.
    fn factor(&mut self) -> StepResult {
        self.rodas.forces.matrices(&self.rodas.of);
        across(Factor(self.rodas));
        Ok(())
    }

    fn solve(&mut self, i: usize) {
        across(StageSolve(self.rodas, i));
    }

    /// The end is given to each lane's own method.
    fn finish(&mut self) {
        across(ErrorNorms(self.rodas));
    }
}

/// Rates of free strains at the start of the step.
struct Rates<'a>(&'a mut LaneReducedRodas4);

impl Kernel for Rates<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let LaneReducedRodas4 { heat, forces, .. } = self.0;
        let count = heat.count();
        heat.rates::<W>(simd, &mut forces.warming[..count]);
    }
}

/// Norms of the last increment, which is the error of the step.
struct ErrorNorms<'a>(&'a mut LaneReducedRodas4);

impl Kernel for ErrorNorms<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let LaneReducedRodas4 { increments, moved, mass, errors, .. } = self.0;
        let last = &increments[STAGES - 1];
        for (u, norms) in [&last.z, &last.v].into_iter().zip(errors) {
            // a sum begins as that of `f64` does
            let mut sum = W::splat(simd, std::iter::empty::<f64>().sum());
            for (mass, moved) in mass.iter().zip(moved.chunks_exact(u.len())) {
                let mut error = [W::splat(simd, 0.0); DOF];
                for (moved, u) in moved.iter().zip(u) {
                    let u = W::load(simd, u);
                    for i in 0..DOF {
                        error[i] += W::splat(simd, moved[i]) * u;
                    }
                }
                let [x, y, turn] = error;
                let own = |i: usize, x: W| x * (W::splat(simd, mass[i]) * x);
                sum += own(0, x) + own(1, y) + own(2, turn);
            }
            let mut square = Lane8::of(0.0);
            sum.store(&mut square);
            *norms = square.0.map(f64::sqrt);
        }
    }
}

/// Where a stage evaluates the forces.
struct StageArgument<'a>(&'a mut LaneReducedRodas4, usize);

impl Kernel for StageArgument<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self(LaneReducedRodas4 { now, at, increments, .. }, i) = self;
        for (to, from) in at.all().into_iter().zip(now.parts()) {
            to.copy_from_slice(from);
        }
        for (a, u) in A[i].iter().zip(&increments[..i]) {
            for (to, u) in at.all().into_iter().zip(u.parts()) {
                for (to, u) in to.iter_mut().zip(u) {
                    (W::load(simd, to) + W::splat(simd, *a) * W::load(simd, u)).store(to);
                }
            }
        }
    }
}

/// Cholesky's factor of W = M/(γh)² + C/(γh) + K, column by column from the left.
struct Factor<'a>(&'a mut LaneReducedRodas4);

impl Kernel for Factor<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let LaneReducedRodas4 { forces, factor, damped, h, vanished, now, .. } = self.0;
        let m = now.z.len();
        let gh = W::splat(simd, GAMMA) * W::load(simd, h);
        let square = gh * gh;
        for (k, to) in factor.iter_mut().enumerate() {
            let mut w = W::load(simd, &forces.mass[k]) / square + W::load(simd, &forces.stiffness[k]);
            if *damped {
                w += W::load(simd, &forces.damping[k]) / gh;
            }
            w.store(to);
        }
        *vanished = [false; LANES];
        for j in 0..m {
            for k in 0..j {
                let share = -W::load(simd, &factor[k * m + j]);
                for i in j..m {
                    let more = share * W::load(simd, &factor[k * m + i]);
                    (more + W::load(simd, &factor[j * m + i])).store(&mut factor[j * m + i]);
                }
            }
            for (vanished, pivot) in vanished.iter_mut().zip(&factor[j * m + j].0) {
                // what is not a number has no factor either
                *vanished |= pivot.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater);
            }
            let root = W::load(simd, &factor[j * m + j]).sqrt();
            root.store(&mut factor[j * m + j]);
            for i in j + 1..m {
                (W::load(simd, &factor[j * m + i]) / root).store(&mut factor[j * m + i]);
            }
        }
    }
}

/// The increments of a stage.
struct StageSolve<'a>(&'a mut LaneReducedRodas4, usize);

impl Kernel for StageSolve<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self(rodas, i) = self;
        rodas.combine::<W>(simd, i);
        rodas.fill_right::<W>(simd, i);
        rodas.solve_factored::<W>(simd);
        let LaneReducedRodas4 { increments, right, r1, r2, h, .. } = rodas;
        let gh = W::splat(simd, GAMMA) * W::load(simd, h);
        let LaneReducedMotion { z, v, w } = &mut increments[i];
        for k in 0..right.len() {
            let of_z = W::load(simd, &right[k]);
            let of_v = of_z / gh - W::load(simd, &r1[k]);
            let of_w = of_v / gh - W::load(simd, &r2[k]);
            of_z.store(&mut z[k]);
            of_v.store(&mut v[k]);
            of_w.store(&mut w[k]);
        }
    }
}

impl LaneReducedRodas4 {
    /// r₁ and r₂ of stage `i`.
    #[inline(always)]
    fn combine<W: SimdReal>(&mut self, simd: W::Simd, i: usize) {
        let Self { at, increments, r1, r2, h, .. } = self;
        let h = W::load(simd, h);
        r1.copy_from_slice(&at.v);
        r2.copy_from_slice(&at.w);
        for (c, u) in C[i].iter().zip(&increments[..i]) {
            let share = W::splat(simd, *c) / h;
            for (r, u) in [(&mut *r1, &u.z), (&mut *r2, &u.v)] {
                for (r, u) in r.iter_mut().zip(u) {
                    (W::load(simd, r) + share * W::load(simd, u)).store(r);
                }
            }
        }
    }

    /// M·(r₁/(γh) + r₂) + C·r₁ − force − γ_i·h·forcing.
    #[inline(always)]
    fn fill_right<W: SimdReal>(&mut self, simd: W::Simd, i: usize) {
        let Self { forces, right, r1, r2, product, damped, h, .. } = self;
        let (m, h) = (right.len(), W::load(simd, h));
        let gh = W::splat(simd, GAMMA) * h;
        for k in 0..m {
            (W::load(simd, &r1[k]) / gh + W::load(simd, &r2[k])).store(&mut product[k]);
        }
        right.fill(Lane8::of(0.0));
        let mut add = |a: &[Lane8], x: &[Lane8]| {
            for (column, x) in a.chunks_exact(m).zip(x) {
                for (to, a) in right.iter_mut().zip(column) {
                    (W::load(simd, to) + W::load(simd, a) * W::load(simd, x)).store(to);
                }
            }
        };
        add(&forces.mass, product);
        if *damped {
            add(&forces.damping, r1);
        }
        let shift = W::splat(simd, GAMMA_I[i]) * h;
        for k in 0..m {
            let off = W::load(simd, &forces.force[k]) + shift * W::load(simd, &forces.forcing[k]);
            (W::load(simd, &right[k]) - off).store(&mut right[k]);
        }
    }

    /// The right side becomes (L·Lᵀ)⁻¹ times itself.
    #[inline(always)]
    fn solve_factored<W: SimdReal>(&mut self, simd: W::Simd) {
        let Self { factor, right: x, .. } = self;
        let m = x.len();
        for j in 0..m {
            let column = &factor[j * m..(j + 1) * m];
            let own = W::load(simd, &x[j]) / W::load(simd, &column[j]);
            own.store(&mut x[j]);
            for i in j + 1..m {
                (W::load(simd, &x[i]) - W::load(simd, &column[i]) * own).store(&mut x[i]);
            }
        }
        // a sum begins as that of `f64` does
        let none: f64 = std::iter::empty::<f64>().sum();
        for j in (0..m).rev() {
            let column = &factor[j * m..(j + 1) * m];
            let mut known = W::splat(simd, none);
            for i in j + 1..m {
                known += W::load(simd, &column[i]) * W::load(simd, &x[i]);
            }
            ((W::load(simd, &x[j]) - known) / W::load(simd, &column[j])).store(&mut x[j]);
        }
    }
}
