//! Small-signal response at one complex frequency: (K + sC + s²M)·x = f; at one angular frequency, s = iω.
//!
//! The same block factorization over complex numbers; the matrix is symmetric. An undamped structure close to a local
//! resonance of one of its branches can have a small pivot, so each solution is refined once against its own residual.

use super::refined::Refined;
use crate::SolveError;
use bimorph_domains::System;
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::{DOF, Pose};
use nalgebra::{Complex, Vector3};

/// Corrections of a solution with K as it is.
const CORRECTIONS: usize = 2;

/// Complex displacement of one body.
pub type ComplexPose = Vector3<Complex<f64>>;

/// Solver with its storage.
#[derive(Debug, Clone)]
pub struct Harmonic {
    pub(super) matrix: BodyMatrix<Complex<f64>>,
    factor: BodyMatrix<Complex<f64>>,
    pub(super) damping: BodyMatrix,
    /// Linearized contact loss about the state at rest; `None` without loss.
    loss: Option<LossDerivatives>,
    rest: Vec<ComplexPose>,
}

impl Harmonic {
    /// Storage for a system.
    pub fn new(system: &System) -> Self {
        let pattern = &system.model.pattern;
        let matrix = BodyMatrix::new(pattern);
        let factor = matrix.clone();
        let mut damping = BodyMatrix::new(pattern);
        bimorph_multibody::forces::add_inertia(&system.model, 0.0, 1.0, &mut damping);
        Self {
            matrix,
            factor,
            damping,
            loss: LossDerivatives::of(system),
            rest: vec![ComplexPose::zeros(); system.bodies()],
        }
    }

    /// Takes the damping of contacts that are closed at displacements `q`, linearized at rest.
    pub fn about(&mut self, system: &System, q: &[Pose]) {
        let Some(loss) = &mut self.loss else { return };
        loss.at(system, q, |_| Pose::zeros());
        self.damping.clear();
        bimorph_multibody::forces::add_inertia(&system.model, 0.0, 1.0, &mut self.damping);
        if let Some(by_rate) = loss.damping() {
            by_rate.add_to(1.0, &mut self.damping);
        }
    }

    /// `y +=` the force of that damping at rates `x`.
    pub fn add_loss(&self, x: &[Pose], y: &mut [Pose]) {
        if let Some(loss) = &self.loss {
            loss.add_damping(|k| x[k], y);
        }
    }

    /// Factors K − ω²M + iωC for a tangent K (held directions not yet projected).
    ///
    /// # Errors
    /// [`SolveError::Singular`] at an undamped resonance.
    pub fn factor(&mut self, system: &System, stiffness: &BodyMatrix, omega: f64) -> Result<(), SolveError> {
        self.factor_at(system, stiffness, Complex::new(0.0, omega))
    }

    /// Factors K + sC + s²M, s in rad/s.
    ///
    /// # Errors
    /// [`SolveError::Singular`] at an eigenvalue.
    pub fn factor_at(&mut self, system: &System, stiffness: &BodyMatrix, s: Complex<f64>) -> Result<(), SolveError> {
        let model = &system.model;
        let blend = |k: &nalgebra::Matrix3<f64>, c: &nalgebra::Matrix3<f64>| {
            k.zip_map(c, |k, c| Complex::new(k + s.re * c, s.im * c))
        };
        let square = s * s;
        for (out, (k, c)) in self.matrix.diagonal.iter_mut().zip(stiffness.diagonal.iter().zip(&self.damping.diagonal))
        {
            *out = blend(k, c);
        }
        for (out, (k, c)) in self.matrix.below.iter_mut().zip(stiffness.below.iter().zip(&self.damping.below)) {
            *out = blend(k, c);
        }
        for (j, block) in self.matrix.diagonal.iter_mut().enumerate() {
            let m = model.mass(j);
            for i in 0..DOF {
                block[(i, i)] += square * m[i];
            }
        }
        model.project_matrix(&mut self.matrix);
        self.factor.diagonal.copy_from_slice(&self.matrix.diagonal);
        self.factor.below.copy_from_slice(&self.matrix.below);
        self.factor.factor(&model.pattern).map_err(|p| SolveError::singular(system, p))?;
        Ok(())
    }

    /// Solves for one force; `x` holds it and becomes the response.
    pub fn solve(&mut self, system: &System, x: &mut [ComplexPose]) {
        let pattern = &system.model.pattern;
        let force = x.to_vec();
        self.factor.solve(pattern, x);
        self.rest.fill(ComplexPose::zeros());
        self.matrix.multiply_add(pattern, x, &mut self.rest);
        for (r, f) in self.rest.iter_mut().zip(&force) {
            *r = f - *r;
        }
        self.factor.solve(pattern, &mut self.rest);
        for (x, r) in x.iter_mut().zip(&self.rest) {
            *x += r;
        }
    }

    /// Corrects a solution `x` at `s` for `force` by its residual with K as it is, unsummed: right to rounding also where the assembled K has
    /// lost what is soft beside what is stiff.
    pub fn refine(
        &mut self,
        system: &System,
        refined: &mut Refined<'_>,
        s: Complex<f64>,
        force: &[ComplexPose],
        x: &mut [ComplexPose],
    ) {
        let model = &system.model;
        for _ in 0..CORRECTIONS {
            let [stiff_re, stiff_im] = [false, true].map(|imaginary| refined.product(&component(x, imaginary)));
            let dragged = self.dragged(system, x);
            let square = s * s;
            for (j, rest) in self.rest.iter_mut().enumerate() {
                let m = model.mass(j);
                for i in 0..DOF {
                    let stiff = Complex::new(stiff_re[j][i], stiff_im[j][i]);
                    rest[i] = force[j][i] - stiff - s * dragged[j][i] - square * m[i] * x[j][i];
                }
                if let Some(free) = &model.bodies[j].free {
                    *rest = free.map(Complex::from) * *rest;
                }
            }
            self.factor.solve(&model.pattern, &mut self.rest);
            for (x, r) in x.iter_mut().zip(&self.rest) {
                *x += r;
            }
        }
    }

    /// C·x.
    pub(super) fn dragged(&self, system: &System, x: &[ComplexPose]) -> Vec<ComplexPose> {
        let [re, im] = [false, true].map(|imaginary| {
            let mut y = vec![Pose::zeros(); x.len()];
            self.damping.multiply_add(&system.model.pattern, &component(x, imaginary), &mut y);
            y
        });
        re.iter().zip(&im).map(|(re, im)| re.zip_map(im, Complex::new)).collect()
    }
}

/// The real or the imaginary parts.
fn component(x: &[ComplexPose], imaginary: bool) -> Vec<Pose> {
    x.iter().map(|x| x.map(|c| if imaginary { c.im } else { c.re })).collect()
}
