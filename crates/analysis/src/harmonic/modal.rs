//! The response as a sum over modes, with static correction.
//!
//! ```text
//! q(s) = Σ_j φ_j·η_j + Σ_c f_c(s)·z_c,     (s² + s·D + Λ)·η = Σ_c f_c(s)·φᵀb_c,     z_c = K⁻¹b_c − Σ_j φ_j·(φ_jᵀb_c)/λ_j
//! ```
//! φ are the lowest undamped modes with φᵀMφ = 1, D = φᵀCφ. b_c are the parts of the input vector, and f_c(s) their
//! dependence on s. The static correction z is the static response of the omitted modes.
//!
//! Reference: R. R. Craig, A. J. Kurdila, "Fundamentals of Structural Dynamics" (2006), §11.4.

use super::exact::ExactResponse;
use super::named::ResponseRow;
use crate::AnalysisError;
use crate::readout::signal::Signal;
use crate::readout::small_signal::{Constituent, ForcedMotion, FrequencyDependence};
use bimorph_domains::{Drive, System};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::forces::{add_damping, add_inertia};
use bimorph_multibody::planar::Pose;
use bimorph_solve::eigen::{Modes, RELIABLE, lowest_modes};
use bimorph_solve::frequency::refined::{ROUNDING, Refined};
use bimorph_solve::subspace;
use nalgebra::{Complex, DMatrix, DVector};
use std::ops::Range;

/// Additional modes in a block iteration, and the change of λ at which it ends (1).
const GUARDS: usize = 6;
const SETTLED: f64 = 1e-14;
/// Fraction of what a row could see below which it sees nothing.
pub(crate) const UNSEEN: f64 = 1e-7;
/// Of a mechanism that floats the correction is taken at this fraction of the frequency up to which modes are known (1).
const ASIDE: f64 = 0.03;

/// The lowest modes of the small-signal problem, or all there are: about a nonlinear state those of its tangent; of a linear model those
/// of the tangent as it is, without what stress adds to it.
///
/// # Errors
/// [`AnalysisError::NotConverged`] rather than modes that cannot be trusted.
pub fn lowest(
    system: &System,
    (q, drive): (&[Pose], &Drive),
    tangent: &BodyMatrix,
    count: usize,
) -> Result<Modes, AnalysisError> {
    if system.model.linear {
        return linear(system, (q, drive), tangent, count);
    }
    let found = lowest_modes(system, (q, drive), tangent, count).map_err(AnalysisError::from)?;
    if found.lambda.is_empty() {
        return Err(massless());
    }
    let bad = found.residuals.iter().any(|r| r.is_nan() || *r > RELIABLE) || found.missed;
    if bad {
        return Err(unsettled(count));
    }
    Ok(found)
}

fn linear(
    system: &System,
    (q, drive): (&[Pose], &Drive),
    tangent: &BodyMatrix,
    count: usize,
) -> Result<Modes, AnalysisError> {
    let model = &system.model;
    if model.bodies.iter().all(|b| b.mass == 0.0 && b.inertia == 0.0) {
        return Err(massless());
    }
    let mut factor = tangent.clone();
    model.project_matrix(&mut factor);
    if factor.factor(&model.pattern).is_err() {
        return lowest_modes(system, (q, drive), tangent, count).map_err(AnalysisError::from);
    }
    let mut block = count + GUARDS;
    while block > 0 {
        let start = subspace::start(model.bodies.len(), block, system.length_scale);
        if let Some(found) = subspace::iterate(model, (&factor, 0.0), start, count.min(block), SETTLED) {
            let (mut lambda, mut shapes) = (found.lambda, found.shapes);
            lambda.truncate(count);
            shapes.truncate(count);
            let residuals = vec![0.0; lambda.len()];
            return Ok(Modes { lambda, shapes, residuals, missed: false, rounding: 0.0 });
        }
        // there are fewer
        block -= 1;
    }
    Err(unsettled(count))
}

fn massless() -> AnalysisError {
    let detail =
        "nothing that moves has mass, so there are no modes; give the layer a `density`, or the parts masses".into();
    AnalysisError::NotConverged { detail }
}

fn unsettled(count: usize) -> AnalysisError {
    let detail =
        format!("the {count} lowest modes at the operating point cannot be distinguished from rounding; request fewer");
    AnalysisError::NotConverged { detail }
}

/// How many modes lie below `omega` (rad/s): negative pivots of K − ω²M (Sylvester).
pub(crate) fn below(exact: &ExactResponse<'_>, omega: f64) -> usize {
    let model = &exact.system().model;
    let mut shifted = exact.tangent.clone();
    add_inertia(model, -omega * omega, 0.0, &mut shifted);
    model.project_matrix(&mut shifted);
    shifted.factor(&model.pattern).map_or(0, |inertia| inertia.negative)
}

/// The sum, with what each row sees of each mode.
#[derive(Debug, Clone)]
pub(crate) struct ModalSum {
    /// λ of each mode, ascending (rad²/s²).
    pub(super) lambda: Vec<f64>,
    /// D, modes × modes (1/s).
    pub(super) damping: DMatrix<f64>,
    /// How each part of the push depends on s.
    pub(super) laws: Vec<FrequencyDependence>,
    /// φᵀb, modes × parts.
    pub(super) push: DMatrix<f64>,
    /// Output factors of the modes, rows × modes.
    pub(super) seen: DMatrix<f64>,
    /// Output factors of the static correction, rows × parts.
    pub(super) rest: DMatrix<f64>,
    /// The same without what is rounding.
    added: DMatrix<f64>,
    /// Rows that see the rate of it.
    pub(super) rates: Vec<bool>,
    /// Conductance between drive and row (S).
    pub(super) conducted: Vec<f64>,
    /// Σ_j M·φ_j: a force that stirs every mode.
    pub(super) stir: Vec<Pose>,
}

/// A rest below this fraction of what the modes bring is rounding: some 5e-13 were seen where all modes are there.
const NOTHING_LEFT: f64 = 4e-12;

impl ModalSum {
    /// Over these modes.
    pub(crate) fn new(exact: &ExactResponse<'_>, found: &Modes) -> Result<Self, AnalysisError> {
        let (system, about) = (exact.system(), exact.perturbed());
        let model = &system.model;
        let constituents = about.constituents(exact.source());
        let n = found.lambda.len();
        let rests = rests(exact, found, &constituents)?;
        let mut drag = vec![Pose::zeros(); system.bodies()];
        let mut damping = DMatrix::zeros(n, n);
        for k in 0..n {
            bimorph_base::budget::check();
            drag.fill(Pose::zeros());
            add_damping(model, &found.shapes[k], &mut drag);
            exact.harmonic.add_loss(&found.shapes[k], &mut drag);
            for j in 0..n {
                damping[(j, k)] = dot(&found.shapes[j], &drag);
            }
        }
        let none = (vec![0.0; exact.drive.volts.len()], vec![0.0; exact.point.rise.len()]);
        let read = |row: &ResponseRow, moved: &ForcedMotion| match row {
            ResponseRow::Signal(Signal::Rate(point, direction)) => {
                about.signal_change(Signal::Displacement(*point, *direction), moved).re
            }
            ResponseRow::Signal(signal) => about.signal_change(*signal, moved).re,
            ResponseRow::Current(port) => about.charges(&[*port], moved)[0].re,
        };
        let rows = &exact.rows;
        let mut seen = DMatrix::zeros(rows.len(), n);
        for (j, shape) in found.shapes.iter().enumerate() {
            bimorph_base::budget::check();
            let moved = ForcedMotion::held(shape.clone(), none.0.clone(), none.1.clone());
            rows.iter().enumerate().for_each(|(r, row)| seen[(r, j)] = row.sum(|one| read(one, &moved)));
        }
        let mut rest = DMatrix::zeros(rows.len(), constituents.len());
        for (c, (part, z)) in constituents.iter().zip(rests).enumerate() {
            let moved = ForcedMotion::held(z, part.volts.clone(), part.rise.clone());
            rows.iter().enumerate().for_each(|(r, row)| rest[(r, c)] = row.sum(|one| read(one, &moved)));
        }
        let push = DMatrix::from_fn(n, constituents.len(), |j, c| dot(&found.shapes[j], &constituents[c].force));
        // what is left of a level that the modes make up is its rounding; far above them it would stand alone in the sum
        let mut added = rest.clone();
        for r in 0..rows.len() {
            for c in 0..constituents.len() {
                let level: f64 = (0..n).map(|j| (seen[(r, j)] * push[(j, c)] / found.lambda[j]).abs()).sum();
                if f64::abs(added[(r, c)]) <= NOTHING_LEFT * level {
                    added[(r, c)] = 0.0;
                }
            }
        }
        let conducted = |row: &ResponseRow| match row {
            ResponseRow::Current(port) => system.electrics.conductance[(*port, exact.source())],
            ResponseRow::Signal(_) => 0.0,
        };
        let mut stir = vec![Pose::zeros(); system.bodies()];
        for shape in &found.shapes {
            for (j, (s, x)) in stir.iter_mut().zip(shape).enumerate() {
                *s += model.mass(j).component_mul(x);
            }
        }
        // all parts of a row have its unit, and are rates or none is
        let rate = |r: &ResponseRow| matches!(r, ResponseRow::Current(_) | ResponseRow::Signal(Signal::Rate(..)));
        Ok(Self {
            lambda: found.lambda.clone(),
            damping,
            laws: constituents.iter().map(|c| c.law).collect(),
            push,
            seen,
            rest,
            added,
            rates: rows.iter().map(|row| row.quantities().any(rate)).collect(),
            conducted: rows.iter().map(|row| row.sum(conducted)).collect(),
            stir,
        })
    }

    /// Magnitudes of what modes and the rest bring to a row, added up: what its value is small against where they cancel.
    pub(super) fn reach(&self, s: Complex<f64>, row: usize) -> f64 {
        let mode = |j: usize| {
            let stiff = s * s + s * self.damping[(j, j)] + self.lambda[j];
            self.seen[(row, j)].abs() * self.pushed(s, j) / stiff.norm()
        };
        let level = self.left(s, row) + (0..self.lambda.len()).map(mode).sum::<f64>();
        if self.rates[row] { s.norm() * level + self.conducted[row].abs() } else { level }
    }

    /// Upper bound of a row: the product of its largest output factor and the largest input factor, at the nearest
    /// resonance. Values below the fraction [`UNSEEN`] of it are rounding, for example across the axis of a symmetric
    /// part.
    pub(crate) fn most(&self, s: Complex<f64>, row: usize) -> f64 {
        let nearest = (0..self.lambda.len())
            .map(|j| 1.0 / (s * s + s * self.damping[(j, j)] + self.lambda[j]).norm())
            .fold(0.0, f64::max);
        self.both(s, row) * nearest * if self.rates[row] { s.norm() } else { 1.0 }
    }

    /// Magnitudes of the parts of the push on a mode, added up.
    fn pushed(&self, s: Complex<f64>, mode: usize) -> f64 {
        let part = |(c, law): (usize, &FrequencyDependence)| law.factor(s).norm() * self.push[(mode, c)].abs();
        self.laws.iter().enumerate().map(part).sum()
    }

    /// The same of what a row sees of the rest.
    fn left(&self, s: Complex<f64>, row: usize) -> f64 {
        let part = |(c, law): (usize, &FrequencyDependence)| law.factor(s).norm() * self.rest[(row, c)].abs();
        self.laws.iter().enumerate().map(part).sum()
    }

    /// Product of the largest output factor and the largest input factor.
    fn both(&self, s: Complex<f64>, row: usize) -> f64 {
        let modes = 0..self.lambda.len();
        let seen = modes.clone().map(|j| self.seen[(row, j)].abs()).fold(0.0, f64::max);
        seen * modes.map(|j| self.pushed(s, j)).fold(0.0, f64::max)
    }

    /// Static contribution of a mode to a row, for the input at the mode's own frequency. Its peak is this times its
    /// quality factor. Not a number for one that there is not.
    pub(crate) fn share(&self, row: usize, mode: usize) -> Complex<f64> {
        let Some(lambda) = self.lambda.get(mode) else { return Complex::from(f64::NAN) };
        let s = Complex::new(0.0, lambda.max(0.0).sqrt());
        let force: Complex<f64> =
            self.laws.iter().enumerate().map(|(c, law)| law.factor(s) * self.push[(mode, c)]).sum();
        force * self.seen[(row, mode)] / *lambda
    }

    /// The same for the most that a row could see of a mode, whatever it sees: below a fraction [`UNSEEN`] of it, its own contribution is rounding.
    pub(crate) fn most_of(&self, row: usize, mode: usize) -> f64 {
        let Some(lambda) = self.lambda.get(mode) else { return 0.0 };
        self.both(Complex::new(0.0, lambda.max(0.0).sqrt()), row) / lambda
    }

    /// Contribution of all other modes and of the static correction to a row, at the frequency of the given modes; in
    /// the unit of [`ModalSum::share`].
    pub(crate) fn beside(&self, row: usize, modes: &Range<usize>) -> f64 {
        let Some(&lambda) = self.lambda.get(modes.start) else { return 0.0 };
        let s = Complex::new(0.0, lambda.max(0.0).sqrt());
        let share = |j: usize| self.seen[(row, j)].abs() * self.pushed(s, j) / (self.lambda[j] - lambda).abs();
        let others = (0..self.lambda.len()).filter(|j| !modes.contains(j));
        self.left(s, row) + others.map(share).sum::<f64>()
    }

    /// One over the quality of a mode (1); not a number for one that there is not.
    pub(crate) fn loss(&self, mode: usize) -> f64 {
        let lambda = self.lambda.get(mode).copied().unwrap_or(f64::NAN);
        self.damping.get((mode, mode)).map_or(f64::NAN, |damping| damping.abs() / lambda.max(0.0).sqrt())
    }

    /// Nothing damps any of its modes.
    pub(super) fn undamped(&self) -> bool {
        self.damping.iter().all(|d| *d == 0.0)
    }

    /// Each row for a unit e^(st) of the drive; none at a pole.
    pub(crate) fn at(&self, s: Complex<f64>) -> Option<Vec<Complex<f64>>> {
        bimorph_base::budget::check();
        let n = self.lambda.len();
        let factors: Vec<Complex<f64>> = self.laws.iter().map(|law| law.factor(s)).collect();
        let force = DVector::from_fn(n, |j, _| factors.iter().zip(self.push.row(j).iter()).map(|(f, b)| f * b).sum());
        let shares: DVector<Complex<f64>> = if self.undamped() {
            DVector::from_fn(n, |j, _| force[j] / (s * s + self.lambda[j]))
        } else {
            let own = |j, k| if j == k { s * s + self.lambda[j] } else { Complex::from(0.0) };
            DMatrix::from_fn(n, n, |j, k| own(j, k) + s * self.damping[(j, k)]).lu().solve(&force)?
        };
        let value = |r: usize| {
            let modes: Complex<f64> = (0..n).map(|j| shares[j] * self.seen[(r, j)]).sum();
            let rest: Complex<f64> = factors.iter().enumerate().map(|(c, f)| f * self.added[(r, c)]).sum();
            let level = modes + rest;
            if self.rates[r] { s * level + self.conducted[r] } else { level }
        };
        let values: Vec<Complex<f64>> = (0..self.rates.len()).map(value).collect();
        values.iter().all(|v| v.re.is_finite() && v.im.is_finite()).then_some(values)
    }
}

/// z of each part of the push.
fn rests(exact: &ExactResponse<'_>, found: &Modes, parts: &[Constituent]) -> Result<Vec<Vec<Pose>>, AnalysisError> {
    let system = exact.system();
    let model = &system.model;
    let highest = found.lambda.last().map_or(0.0, |l| l.abs());
    let mut shift = 0.0;
    let mut factor = exact.tangent.clone();
    model.project_matrix(&mut factor);
    if exact.floats || factor.factor(&model.pattern).is_err() {
        shift = -ASIDE * ASIDE * highest;
        factor = exact.tangent.clone();
        add_inertia(model, -shift, 0.0, &mut factor);
        model.project_matrix(&mut factor);
        if let Err(pivot) = factor.factor(&model.pattern) {
            return Err(bimorph_solve::SolveError::singular(system, pivot).into());
        }
    }
    let mut refined = Refined::new(system, &exact.point.q, &exact.drive);
    let rest = |part: &Constituent| {
        bimorph_base::budget::check();
        let mut z = part.force.clone();
        if model.linear {
            model.project(&mut z);
            factor.solve(&model.pattern, &mut z);
            model.project(&mut z);
        } else {
            refined.solve(&factor, shift, &mut z, ROUNDING);
        }
        for (x, lambda) in found.shapes.iter().zip(&found.lambda) {
            let share = dot(x, &part.force) / (lambda - shift);
            z.iter_mut().zip(x).for_each(|(z, x)| *z -= x * share);
        }
        z
    };
    Ok(parts.iter().map(rest).collect())
}

fn dot(a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
