//! Static equilibrium r(q, drive(s)) = 0 along a path of loads, s from 0 to 1.
//!
//! Each step predicts along the tangent, then corrects by Newton. It is accepted only when the corrector converges, ends on
//! a stable equilibrium (no negative pivot), and corrects at most half of what it predicted: a Newton iteration that
//! wandered to another branch corrects more. Nor may it change the distance of electrodes under voltage by more than half. Otherwise the step is halved. Where steps vanish the path has a fold: pull-in, release or
//! snap-through. From there the system falls, as an overdamped motion each step of which leads down in its potential, to the
//! next stable equilibrium, and the path goes on from that; the fold's place is reported.
//!
//! Reference: E. Riks, "An incremental approach to the solution of snapping and buckling problems", Int. J. Solids
//! Structures 15 (1979), for folds; Kelley & Keyes, "Convergence analysis of pseudo-transient continuation", SIAM J. Numer.
//! Anal. 35 (1998), for the fall.

mod fall;
pub mod path;
pub mod side_by_side;

use super::SolveError;
use crate::domains::{Domain, Drive, System};
use crate::multibody::BlockMatrix;
use crate::multibody::factor::ZeroPivot;
use crate::multibody::planar::Pose;
use path::LoadPath;

/// A body that gives way so many times as far as others hangs on next to nothing.
const UNHELD: f64 = 1e8;
/// Corrections below this share of the displacement that no longer shrink are rounding.
const STALLED: f64 = 1e-5;
/// Largest residual force in such a place, as a fraction of the largest contact force, where parts touch. Contact softens towards
/// the touch, and Newton's method then takes a quarter of the way each time: that is no rounding.
const UNBALANCED: f64 = 1e-6;

/// Share of the distance of electrodes that one step may change. A plate on a spring folds at a third.
const LEAP: f64 = 0.5;

/// How an equilibrium is searched. `Default` is the only place where the numbers stand.
#[derive(Debug, Clone, PartialEq)]
pub struct EquilibriumOptions {
    /// Newton stops when a correction is below this share of the displacement, default 1e-10. Smaller: one more iteration.
    pub tolerance: f64,
    /// Newton iterations per load step, default 12.
    pub iterations: usize,
    /// Smallest load step before a fold is declared, default 1e-7 of the path. Smaller: folds located more sharply.
    pub smallest_step: f64,
    /// How far past a fold the fall begins, default 1e-2 of the path. Smaller: closer to the fold, and slower.
    pub past_fold: f64,
    /// Steps of a fall after a fold, default 4000.
    pub fall_steps: usize,
    /// Stop at the first fold instead of falling, default false.
    pub stop_at_fold: bool,
}

impl Default for EquilibriumOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-10,
            iterations: 12,
            smallest_step: 1e-7,
            past_fold: 1e-2,
            fall_steps: 4000,
            stop_at_fold: false,
        }
    }
}

/// What a search along a path found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Path {
    /// Newton iterations.
    pub iterations: usize,
    /// Share of the path at the first fold; none when there was none.
    pub fold: Option<f64>,
    /// Share of the path that was reached: 1 unless it stopped at a fold.
    pub reached: f64,
}

/// Solver with its storage. Nothing is allocated after [`Equilibrium::new`].
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Options.
    pub options: EquilibriumOptions,
    tangent: BlockMatrix<f64, 3>,
    residual: Vec<Pose>,
    step: Vec<Pose>,
    /// Where the tangent predicted the end of the step.
    prediction: Vec<Pose>,
    trial: Vec<Pose>,
    held: Vec<ZeroPivot>,
    drive: Drive,
    slope: Drive,
}

enum Corrected {
    Stable,
    No,
    /// An equilibrium that a gap has gone far to in one step: perhaps not that of this branch.
    Leaps,
}

impl Equilibrium {
    /// Storage for a system.
    pub fn new(system: &System, options: EquilibriumOptions) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            options,
            tangent: BlockMatrix::new(&system.model.pattern),
            residual: zeros.clone(),
            step: zeros.clone(),
            prediction: zeros.clone(),
            trial: zeros,
            held: Vec::new(),
            drive: system.electrics.drive(),
            slope: system.electrics.drive(),
        }
    }

    /// Free motions that the last factorization held, because no load excites them: (body, direction).
    pub fn held(&self) -> &[ZeroPivot] {
        &self.held
    }

    /// The factored tangent of the last equilibrium.
    pub fn factor(&self) -> &BlockMatrix<f64, 3> {
        &self.tangent
    }

    /// Follows the path from the equilibrium `q` at s = 0 (or near it) to s = 1; `q` becomes the equilibrium there.
    ///
    /// # Errors
    /// [`SolveError::Singular`] where a body moves freely, [`SolveError::Lost`] where no equilibrium was found.
    pub fn follow(&mut self, system: &System, path: &dyn LoadPath, q: &mut [Pose]) -> Result<Path, SolveError> {
        let mut done = Path::default();
        let mut s = 0.0;
        let mut ds = 1.0;
        let mut free_at_first = None;
        while s < 1.0 {
            let station = path.station(s);
            let step = f64::min(ds, station - s);
            let to = if station - s - step < 1e-12 { station } else { s + step };
            self.predict(system, path, s, to - s, q)?;
            // held where the step begins; what a wild trial holds says nothing
            let free = self.held.first().copied();
            let from_the_first = *free_at_first.get_or_insert(free.is_some());
            match self.correct(system, path, to, q, &mut done) {
                Corrected::Stable => {
                    q.copy_from_slice(&self.trial);
                    s = to;
                    ds = 2.0 * step;
                }
                Corrected::Leaps if step > self.options.smallest_step => ds = 0.5 * step,
                Corrected::No if free.is_some() && !from_the_first => {
                    // what was held at first is so no more: bent or stretched so far that rounding hides what resists
                    return Err(self.too_far(system, s, &done, free));
                }
                Corrected::No if free.is_some() => {
                    // a free motion that a load excites never settles: there is no equilibrium to look for
                    return free.map_or(Ok(done), |pivot| Err(SolveError::singular(system, pivot)));
                }
                Corrected::No if step > self.options.smallest_step => ds = 0.5 * step,
                Corrected::No | Corrected::Leaps => {
                    done.fold.get_or_insert(s);
                    if self.options.stop_at_fold {
                        done.reached = s;
                        return Ok(done);
                    }
                    // a little past the fold, where the branch is gone; nearer to it the fall would take for ever
                    let to = f64::min(s + self.options.past_fold, 1.0);
                    self.fall(system, path, to, q, &mut done)?;
                    s = to;
                    ds = 0.25;
                }
            }
        }
        done.reached = 1.0;
        Ok(done)
    }

    /// Puts the tangent prediction for a step from `s` into `trial` and its increment into `step`.
    fn predict(&mut self, system: &System, path: &dyn LoadPath, s: f64, ds: f64, q: &[Pose]) -> Result<(), SolveError> {
        path.at(s, &mut self.drive);
        path.slope(s, &mut self.slope);
        system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
        system.model.project_matrix(&mut self.tangent);
        (system.model.factor_holding(&mut self.tangent, &mut self.held))
            .map_err(|p| SolveError::singular(system, p))?;
        system.drive_force(q, &self.drive, &self.slope, &mut self.step);
        for (step, r) in self.step.iter_mut().zip(&self.residual) {
            *step = *step * -ds - r;
        }
        self.tangent.solve(&system.model.pattern, &mut self.step);
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
        let mut last = f64::INFINITY;
        for _ in 0..self.options.iterations {
            crate::budget::check();
            done.iterations += 1;
            system.tangent(&self.trial, &self.drive, &mut self.tangent, &mut self.residual);
            system.model.project_matrix(&mut self.tangent);
            let Ok(inertia) = system.model.factor_holding(&mut self.tangent, &mut self.held) else {
                return Corrected::No;
            };
            let unbalanced = self.residual.iter().map(|r| r.xy().norm_squared()).fold(0.0, f64::max).sqrt();
            std::mem::swap(&mut self.step, &mut self.residual);
            self.tangent.solve(&system.model.pattern, &mut self.step);
            let correction = size(system, &self.step);
            if !correction.is_finite() || (correction > last && correction > 1e-3 * system.length_scale) {
                return Corrected::No;
            }
            for (trial, step) in self.trial.iter_mut().zip(&self.step) {
                *trial -= step;
            }
            let reach = size(system, &self.trial).max(1e-6 * system.length_scale);
            // converged, or as close as rounding lets it come: quadratic convergence that has come to a stand
            let stalled = correction <= STALLED * reach
                && correction > 0.1 * last
                && balanced(system.contact_scale(&self.trial, &self.drive.volts), unbalanced);
            last = correction;
            if correction <= self.options.tolerance * reach || stalled {
                if inertia.negative > 0 {
                    return Corrected::No;
                }
                let corrected = distance(system, &self.trial, &self.prediction);
                return match corrected <= 0.5 * predicted + 1e-3 * system.length_scale {
                    true if self.leaps(system, from) => Corrected::Leaps,
                    true => Corrected::Stable,
                    false => Corrected::No,
                };
            }
        }
        Corrected::No
    }

    /// True where the distance of electrodes changes by more than half of it in one step: a tangent that goes through the fold may come
    /// upon the closed branch by chance.
    fn leaps(&self, system: &System, from: &[Pose]) -> bool {
        let far = |(gap, volts): (usize, &f64)| {
            if *volts == 0.0 || !system.members[gap].closes() {
                return false;
            }
            let (before, after) = (system.distance(gap, from), system.distance(gap, &self.trial));
            (after - before).abs() > LEAP * before.max(after)
        };
        self.drive.volts.iter().enumerate().any(far)
    }

    /// A load that is far more than the part bears.
    fn too_far(&self, system: &System, share: f64, done: &Path, at: Option<ZeroPivot>) -> SolveError {
        let body = at.map_or(String::new(), |pivot| system.model.bodies[pivot.body].name.to_string());
        let residual = self.residual.iter().map(|r| r.amax()).fold(0.0, f64::max);
        let unheld = format!(
            "; \"{body}\" is deformed so far there that rounding hides what resists it: the load is too large for this part"
        );
        SolveError::Lost { share, iterations: done.iterations, residual, body, unheld }
    }

    fn lost(&mut self, system: &System, share: f64, iterations: usize, q: &[Pose]) -> SolveError {
        let unheld = self.unheld(system, q);
        let worst =
            (0..self.residual.len()).max_by(|&a, &b| self.residual[a].amax().total_cmp(&self.residual[b].amax()));
        let worst = worst.unwrap_or(0);
        SolveError::Lost {
            share,
            iterations,
            residual: self.residual[worst].amax(),
            body: system.model.bodies[worst].name.to_string(),
            unheld,
        }
    }

    /// Names the body that gives way most under a force on every body, if it does so far more than most.
    fn unheld(&mut self, system: &System, q: &[Pose]) -> String {
        let model = &system.model;
        let mut residual = self.residual.clone();
        system.tangent(q, &self.drive, &mut self.tangent, &mut residual);
        model.project_matrix(&mut self.tangent);
        if model.factor_holding(&mut self.tangent, &mut self.held).is_err() {
            return String::new();
        }
        for (j, x) in self.step.iter_mut().enumerate() {
            *x = Pose::new(1.0, 1.0 + 0.1 * (j % 7) as f64, 0.0);
        }
        model.project(&mut self.step);
        self.tangent.solve(&model.pattern, &mut self.step);
        let moved: Vec<f64> = self.step.iter().map(|p| p.x.hypot(p.y)).collect();
        let mut sorted = moved.clone();
        sorted.sort_by(f64::total_cmp);
        let typical = sorted[sorted.len() / 2].max(f64::MIN_POSITIVE);
        // the middle body may hang on the same threads: then all are soft, and the stiffest is what to compare with
        let stiff = sorted[sorted.len() / 20].max(f64::MIN_POSITIVE);
        let softest = (0..moved.len()).max_by(|&a, &b| moved[a].total_cmp(&moved[b])).unwrap_or(0);
        let over = moved[softest] / typical.min(stiff);
        if over < UNHELD {
            return String::new();
        }
        let name = &model.bodies[softest].name;
        format!("; the part with \"{name}\" is nearly unheld: it gives way {over:.0e} times as far as what is held")
    }
}

/// True where nothing touches, and where the largest force that is left over is small next to that of contact.
pub(super) fn balanced(contact: f64, unbalanced: f64) -> bool {
    contact == 0.0 || unbalanced <= UNBALANCED * contact
}

/// Largest displacement of a body: translation [m], or rotation times the length scale.
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
