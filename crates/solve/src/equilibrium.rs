//! Static equilibrium r(q, drive(s)) = 0 along a path of loads, s from 0 to 1.
//!
//! Each step predicts along the tangent, then corrects by Newton. It is accepted only when the corrector converges,
//! ends on a stable equilibrium (no negative pivot), and corrects at most half of what it predicted: a Newton iteration
//! that wandered to another branch corrects more. Nor may it change the distance of electrodes under voltage by more
//! than half. Otherwise the step is halved. Where steps vanish beside the present load the branch loses its stability:
//! at a limit point (pull-in, release, snap-through) or at a bifurcation (`loss`). A little beyond, at 1.02 of that
//! load, the system falls to the next stable equilibrium (`fall`), and the path continues from there with steps of a
//! quarter of the present load. Falling at once under a load far beyond leads to states that a slowly growing load does
//! not reach.
//!
//! Reference: E. Riks, "An incremental approach to the solution of snapping and buckling problems", Int. J. Solids
//! Structures 15 (1979), for limit points.

pub mod batch;
mod fall;
mod loss;
mod newton_test;
pub mod path;
mod refusal;

pub use loss::{LossKind, StabilityLoss};

use super::SolveError;
use bimorph_domains::sticking::Sticking;
use bimorph_domains::{Drive, System};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::Pose;
use newton_test::{Corrections, leaps};
use path::LoadPath;

/// Largest residual force in such a place, as a fraction of the largest contact force, where parts touch. Contact softens towards
/// the touch, and Newton's method then takes a quarter of the way each time: that is no rounding.
const UNBALANCED: f64 = 1e-6;

/// Largest load step where friction holds parts at rest, and the largest one in which such parts come to bear (fractions of the path). They meet no friction in it,
/// so that anchors are off by this part of the motion at most.
const STICKING_STEPS: [f64; 2] = [1.0 / 32.0, 1e-6];

/// Smallest load step where the present load is next to nothing, as a fraction of the path.
const MIN_STEP: f64 = 1e-10;

/// How an equilibrium is searched. `Default` is the only place where the numbers stand.
#[derive(Debug, Clone, PartialEq)]
pub struct EquilibriumOptions {
    /// Newton stops when a correction is below this fraction of the displacement, default 1e-10. Smaller: one more iteration.
    pub tolerance: f64,
    /// Newton iterations per load step, default 12.
    pub iterations: usize,
    /// Smallest load step before a loss of stability is declared, default 1e-7 of the present load. Smaller: losses located more sharply.
    pub smallest_step: f64,
    /// Factorizations of a fall after a loss of stability, default 4000.
    pub fall_steps: usize,
    /// Stop at the first loss of stability instead of falling, default false.
    pub stop_at_fold: bool,
    /// Take the other one of the two sides of a bifurcation, default false.
    pub mirrored: bool,
}

impl Default for EquilibriumOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-10,
            iterations: 12,
            smallest_step: 1e-7,
            fall_steps: 4000,
            stop_at_fold: false,
            mirrored: false,
        }
    }
}

impl EquilibriumOptions {
    /// The defaults, with the other side of bifurcations where `mirrored`.
    pub fn with_side(mirrored: bool) -> Self {
        Self { mirrored, ..Self::default() }
    }
}

/// Result of a search along a path.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Path {
    /// Newton iterations.
    pub iterations: usize,
    /// Losses of stability that it passed, in this order.
    pub passed: Vec<StabilityLoss>,
    /// Fraction of the path that was reached: 1 unless it stopped at a loss of stability.
    pub reached: f64,
}

/// Solver with its storage. Nothing is allocated after [`Equilibrium::new`].
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Options.
    pub options: EquilibriumOptions,
    /// Friction of parts at rest: the history of the equilibrium.
    pub sticking: Sticking,
    tangent: BodyMatrix,
    residual: Vec<Pose>,
    step: Vec<Pose>,
    /// Where the tangent predicted the end of the step.
    prediction: Vec<Pose>,
    trial: Vec<Pose>,
    /// The softest motion at a loss of stability.
    soft: Vec<Pose>,
    /// The last stable equilibrium, and where a fall from there ended without one.
    before: Vec<Pose>,
    stopped: Vec<Pose>,
    held: Vec<ZeroPivot>,
    /// Motions are free where the path begins.
    free_from_start: bool,
    drive: Drive,
    slope: Drive,
}

enum Corrected {
    Stable,
    No,
    /// An equilibrium that a gap has gone far to in one step: perhaps not that of this branch.
    Leaps,
}

impl Path {
    /// Fraction of the path at the first loss of stability; `None` without one.
    pub fn fold(&self) -> Option<f64> {
        self.passed.first().map(|passed| passed.share)
    }
}

impl Equilibrium {
    /// Storage for a system.
    pub fn new(system: &System, options: EquilibriumOptions) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            options,
            sticking: Sticking::new(system),
            tangent: BodyMatrix::new(&system.model.pattern),
            residual: zeros.clone(),
            step: zeros.clone(),
            prediction: zeros.clone(),
            trial: zeros.clone(),
            soft: zeros.clone(),
            before: zeros.clone(),
            stopped: zeros,
            held: Vec::new(),
            free_from_start: false,
            drive: system.electrics.drive(),
            slope: system.electrics.drive(),
        }
    }

    /// Free motions that the last factorization held, because no load excites them: (body, direction).
    pub fn held(&self) -> &[ZeroPivot] {
        &self.held
    }

    /// `f` becomes the change of the last equilibrium with a force −`f` (r = −f).
    pub fn solve(&self, system: &System, f: &mut [Pose]) {
        self.tangent.solve(&system.model.pattern, f);
        self.sticking.correct(&system.model, &self.tangent, f);
    }

    /// Follows the path from the equilibrium `q` at s = 0 (or near it) to s = 1; `q` becomes the equilibrium there.
    ///
    /// # Errors
    /// [`SolveError::Singular`] where a body moves freely, [`SolveError::Lost`] where no equilibrium was found.
    pub fn follow(&mut self, system: &System, path: &dyn LoadPath, q: &mut [Pose]) -> Result<Path, SolveError> {
        let mut done = Path::default();
        let mut s = 0.0;
        let longest = if self.sticking.is_empty() { 1.0 } else { STICKING_STEPS[0] };
        let mut ds = longest;
        let mut free_at_first = None;
        self.free_from_start = false;
        while s < 1.0 {
            let station = path.station(s);
            let step = f64::min(ds, station - s);
            let to = if station - s - step < 1e-12 { station } else { s + step };
            self.sticking.begin(system, q);
            self.predict(system, path, s, to - s, q)?;
            while !self.sticking.is_empty() && self.sticking.turns_back(system, q, &self.step) {
                self.predict(system, path, s, to - s, q)?;
            }
            // held where the step begins; what a wild trial holds says nothing
            let free = self.held.first().copied();
            let from_the_first = *free_at_first.get_or_insert(free.is_some());
            self.free_from_start = from_the_first;
            let smallest = match path.is_still() {
                true => f64::INFINITY,
                false => (self.options.smallest_step * to).max(MIN_STEP),
            };
            match self.correct(system, path, to, q, &mut done) {
                Corrected::Stable if step > STICKING_STEPS[1] && self.sticking.closes(system, &self.trial) => {
                    ds = 0.5 * step;
                }
                Corrected::Stable => {
                    q.copy_from_slice(&self.trial);
                    self.sticking.accept(system, q);
                    s = to;
                    ds = longest.min(2.0 * step);
                }
                Corrected::Leaps if step > smallest => ds = 0.5 * step,
                Corrected::No if free.is_some() && !from_the_first => {
                    // what was held at first is so no more: bent or stretched so far that rounding hides what resists
                    return Err(self.too_far(system, s, &done, free));
                }
                Corrected::No if free.is_some() => {
                    // a free motion that a load excites never settles: there is no equilibrium to look for
                    return free.map_or(Ok(done), |pivot| Err(SolveError::singular(system, pivot)));
                }
                Corrected::No if step > smallest => ds = 0.5 * step,
                Corrected::No | Corrected::Leaps => {
                    if self.options.stop_at_fold {
                        done.reached = s;
                        return Ok(done);
                    }
                    (s, ds) = self.pass(system, path, (s, to), q, &mut done)?;
                    ds = ds.min(longest);
                    self.sticking.release(system, q);
                }
            }
        }
        self.check_beams(system, s, &done, q)?;
        done.reached = 1.0;
        Ok(done)
    }

    /// Puts the tangent prediction for a step from `s` into `trial` and its increment into `step`.
    fn predict(&mut self, system: &System, path: &dyn LoadPath, s: f64, ds: f64, q: &[Pose]) -> Result<(), SolveError> {
        path.at(s, &mut self.drive);
        path.slope(s, &mut self.slope);
        system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
        if !self.sticking.is_empty() {
            self.sticking.add(system, q, true, &mut self.tangent, &mut self.residual);
        }
        system.model.project_matrix(&mut self.tangent);
        (system.model.factor_holding(&mut self.tangent, &mut self.held))
            .map_err(|p| SolveError::singular(system, p))?;
        system.drive_force(q, &self.drive, &self.slope, &mut self.step);
        for (step, r) in self.step.iter_mut().zip(&self.residual) {
            *step = *step * -ds - r;
        }
        self.tangent.solve(&system.model.pattern, &mut self.step);
        self.sticking.correct(&system.model, &self.tangent, &mut self.step);
        for ((trial, q), step) in self.trial.iter_mut().zip(q).zip(&self.step) {
            *trial = q + step;
        }
        self.prediction.copy_from_slice(&self.trial);
        Ok(())
    }

    /// Newton at `s` from the prediction in `trial`.
    fn correct(&mut self, system: &System, path: &dyn LoadPath, s: f64, from: &[Pose], done: &mut Path) -> Corrected {
        let predicted = size(system, &self.step);
        path.at(s, &mut self.drive);
        let mut corrections = Corrections::new(system.length_scale);
        for _ in 0..self.options.iterations {
            bimorph_base::budget::check();
            done.iterations += 1;
            system.tangent(&self.trial, &self.drive, &mut self.tangent, &mut self.residual);
            if !self.sticking.is_empty() {
                self.sticking.add(system, &self.trial, false, &mut self.tangent, &mut self.residual);
            }
            system.model.project_matrix(&mut self.tangent);
            let Ok(inertia) = system.model.factor_holding(&mut self.tangent, &mut self.held) else {
                return Corrected::No;
            };
            let unbalanced = self.residual.iter().map(|r| r.xy().norm_squared()).fold(0.0, f64::max).sqrt();
            std::mem::swap(&mut self.step, &mut self.residual);
            self.tangent.solve(&system.model.pattern, &mut self.step);
            self.sticking.correct(&system.model, &self.tangent, &mut self.step);
            let correction = size(system, &self.step);
            if corrections.diverge(correction) {
                return Corrected::No;
            }
            for (trial, step) in self.trial.iter_mut().zip(&self.step) {
                *trial -= step;
            }
            let reach = size(system, &self.trial);
            let settled = corrections.settle(correction, (reach, self.options.tolerance), || {
                balanced(system.contact_scale(&self.trial, &self.drive.volts), unbalanced)
            });
            if settled {
                if inertia.negative > 0 {
                    return Corrected::No;
                }
                let corrected = distance(system, &self.trial, &self.prediction);
                return match corrections.is_near(corrected, predicted) {
                    true if leaps(system, &self.drive.volts, from, || &self.trial[..]) => Corrected::Leaps,
                    true => Corrected::Stable,
                    false => Corrected::No,
                };
            }
        }
        Corrected::No
    }
}

/// True where nothing touches, and where the largest force that is left over is small next to that of contact.
pub(super) fn balanced(contact: f64, unbalanced: f64) -> bool {
    contact == 0.0 || unbalanced <= UNBALANCED * contact
}

/// Largest displacement of a body: translation (m), or rotation times the length scale.
fn size(system: &System, x: &[Pose]) -> f64 {
    x.iter().map(|p| extent(system, p)).fold(0.0, f64::max)
}

fn distance(system: &System, a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| extent(system, &(a - b))).fold(0.0, f64::max)
}

fn extent(system: &System, p: &Pose) -> f64 {
    // a comparison with NaN must not hide it
    let e = (p.x * p.x + p.y * p.y).sqrt().max(p.z.abs() * system.length_scale);
    if p.iter().all(|v| v.is_finite()) { e } else { f64::INFINITY }
}
