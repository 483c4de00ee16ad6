//! The fall from where a branch loses its stability to the next stable equilibrium: a trust region on the potential energy.
//!
//! Each step solves (K + μW)·d = −r, with W a diagonal of units (translations in mean segment lengths, rotations in radians). The damping μ
//! grows until the matrix is positive definite, the step is no longer than the trust region and the energy falls as predicted. It shrinks
//! after each accepted step, so that the last steps are Newton's. Without the test of energy, iterations cycle in stiff curved valleys and jump
//! in and out of stiff contacts.
//!
//! References: A. R. Conn, N. I. M. Gould, P. L. Toint, "Trust-Region Methods" (2000), ch. 6; C. T. Kelley, D. E. Keyes, "Convergence
//! analysis of pseudo-transient continuation", SIAM J. Numer. Anal. 35 (1998), for steps without the test.

use super::path::LoadPath;
use super::{Equilibrium, Path};
use crate::SolveError;
use bimorph_domains::{BeamLine, Domain, System};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::{Block, Pose};

/// Weight of rotations in W; that of translations is 1.
const TURN_WEIGHT: f64 = 0.1;
/// First and largest radius of the trust region, in mean segment lengths and radians.
const RADIUS: [f64; 2] = [0.05, 0.3];
/// Smallest radius: below it the energy no longer falls.
const MIN_RADIUS: f64 = 1e-11;
/// Steps below this are not tested for energy: rounding.
const UNTESTED: f64 = 1e-6;
/// A step without μ below this ends the fall.
const SETTLED: f64 = 1e-9;
/// First μ and the μ that counts as none, as fractions of the median stiffness.
const MIN_SHIFT: [f64; 2] = [1e-14, 1e-15];
/// A μ that rounding of the stiffness may require next to a loss of stability, in first μ.
const NEUTRAL: f64 = 10.0;
/// A μ that no finite stiffness needs, in median stiffnesses.
pub(super) const MAX_SHIFT: f64 = 1e20;
/// Fractions of the predicted decrease of energy: below the first a step is rejected, below the second the region shrinks, above the third it grows.
const RATIO: [f64; 3] = [0.05, 0.25, 0.75];
/// Rounding of the energy, as a fraction of it.
const ROUNDING: f64 = 1e-12;
/// Rotation between the ends of a segment beyond which a step is rejected (rad).
const OVERTURNED: f64 = 1.5;
/// Largest change of the distance of a gap in one step, as a fraction of the larger distance.
const CLOSING: f64 = 0.5;

/// Units of displacements.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    /// Mean segment length; where gaps may close, the length scale of the system (m).
    pub(super) length: f64,
}

impl Units {
    pub(super) fn of(system: &System) -> Self {
        let (mut length, mut segments) = (0.0, 0);
        for beam in
            system.beams.iter().filter(|beam| beam.points.first().map(|p| p.body) != beam.points.last().map(|p| p.body))
        {
            length += beam.length;
            segments += beam.segments();
        }
        let gaps = system.members.iter().any(|member| member.is_electrostatic() || member.touching().is_some());
        Self { length: if segments == 0 || gaps { system.length_scale } else { length / segments as f64 } }
    }

    /// Largest displacement of a body.
    pub(super) fn size(self, x: &[Pose]) -> f64 {
        let one = |p: &Pose| (p.x.hypot(p.y) / self.length).max(p.z.abs());
        // a comparison with NaN must not hide it
        let finite = |p: &Pose| if p.iter().all(|v| v.is_finite()) { one(p) } else { f64::INFINITY };
        x.iter().map(finite).fold(0.0, f64::max)
    }

    /// xᵀWx.
    fn weigh(self, x: &[Pose]) -> f64 {
        let square = self.length * self.length;
        x.iter().map(|p| (p.x * p.x + p.y * p.y) / square + TURN_WEIGHT * p.z * p.z).sum()
    }

    /// W·x.
    pub(super) fn weighted(self, x: &Pose) -> Pose {
        let square = self.length * self.length;
        Pose::new(x.x / square, x.y / square, TURN_WEIGHT * x.z)
    }

    /// The median of the translational stiffness of the bodies (J).
    pub(super) fn median_stiffness(self, tangent: &BodyMatrix) -> f64 {
        let one = |block: &Block| 0.5 * (block[(0, 0)] + block[(1, 1)]).abs() * self.length * self.length;
        let mut all: Vec<f64> = tangent.diagonal.iter().map(one).filter(|k| *k > 0.0).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(1.0)
    }

    /// `tangent += shift·W`.
    pub(super) fn add_shift(self, shift: f64, tangent: &mut BodyMatrix) {
        if shift > 0.0 {
            let translation = shift / (self.length * self.length);
            for block in &mut tangent.diagonal {
                block[(0, 0)] += translation;
                block[(1, 1)] += translation;
                block[(2, 2)] += shift * TURN_WEIGHT;
            }
        }
    }
}

/// A trust region.
struct TrustRegion {
    units: Units,
    shift: f64,
    least: [f64; 2],
    radius: f64,
    energy: f64,
}

/// A step that was taken.
#[derive(Debug, Clone, Copy)]
struct AcceptedStep {
    /// Its largest displacement, in the units of W.
    length: f64,
    /// True where the energy it gains is more than rounding.
    resolved: bool,
}

/// Why a fall ended without an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FallFailure {
    /// The energy falls without end.
    Budget,
    /// Numbers overflowed, or no step decreases the energy.
    Stuck,
}

impl Equilibrium {
    /// Lets the system fall at the loads of `s` from `q` to a stable equilibrium; `q` becomes that.
    ///
    /// # Errors
    /// [`SolveError::Lost`] where none was found.
    pub fn settle(&mut self, system: &System, path: &dyn LoadPath, s: f64, q: &mut [Pose]) -> Result<Path, SolveError> {
        let mut done = Path::default();
        path.at(s, &mut self.drive);
        let towards = self.softest(system, q).map(|_| self.judge(system, q));
        self.lean(q, towards.map_or(0.0, |towards| towards.sign));
        match self.fall(system, path, s, q, &mut done) {
            Ok(()) => Ok(done),
            Err(why) => Err(self.lost(system, s, why, &done, q)),
        }
    }

    /// Lets the system fall at fixed loads to a stable equilibrium.
    pub(super) fn fall(
        &mut self,
        system: &System,
        path: &dyn LoadPath,
        s: f64,
        q: &mut [Pose],
        done: &mut Path,
    ) -> Result<(), FallFailure> {
        path.at(s, &mut self.drive);
        let units = Units::of(system);
        let energy = system.potential(q, &self.drive);
        let mut region = TrustRegion { units, shift: 0.0, least: [0.0; 2], radius: RADIUS[0], energy };
        let mut last = f64::INFINITY;
        for _ in 0..self.options.fall_steps {
            bimorph_base::budget::check();
            done.iterations += 1;
            let Some(AcceptedStep { length, resolved }) = self.try_step(system, q, &mut region)? else { continue };
            for (q, step) in q.iter_mut().zip(&self.step) {
                *q += step;
            }
            // converged, or as close as rounding lets it come
            let neutral = region.shift <= NEUTRAL * region.least[0];
            if neutral && (length < SETTLED || (!resolved && length > 0.5 * last)) {
                return Ok(());
            }
            last = if neutral { length } else { f64::INFINITY };
            region.shift = if region.shift / 8.0 < region.least[1] { 0.0 } else { region.shift / 8.0 };
        }
        Err(FallFailure::Budget)
    }

    /// One factorization: the step from `q`, where it is accepted.
    fn try_step(
        &mut self,
        system: &System,
        q: &[Pose],
        region: &mut TrustRegion,
    ) -> Result<Option<AcceptedStep>, FallFailure> {
        let units = region.units;
        system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
        if region.least[0] == 0.0 {
            let median = units.median_stiffness(&self.tangent);
            region.least = MIN_SHIFT.map(|least| least * median);
        }
        let raise = |region: &mut TrustRegion, factor: f64| {
            region.shift = (factor * region.shift).max(region.least[0]);
            let bounded = region.shift < MAX_SHIFT / MIN_SHIFT[0] * region.least[0];
            if bounded { Ok(None) } else { Err(FallFailure::Stuck) }
        };
        units.add_shift(region.shift, &mut self.tangent);
        system.model.project_matrix(&mut self.tangent);
        if !self.is_definite(system) {
            return raise(region, 8.0);
        }
        for (step, r) in self.step.iter_mut().zip(&self.residual) {
            *step = -r;
        }
        self.tangent.solve(&system.model.pattern, &mut self.step);
        let length = units.size(&self.step);
        if length > 1.5 * region.radius {
            return raise(region, (length / region.radius).clamp(2.0, 8.0));
        }
        for ((trial, q), step) in self.trial.iter_mut().zip(q).zip(&self.step) {
            *trial = q + step;
        }
        let there = system.potential(&self.trial, &self.drive);
        if length < UNTESTED {
            // what noise of the energy made small may grow again
            region.radius = (2.0 * region.radius).min(RADIUS[1]);
            region.energy = there;
            return Ok(Some(AcceptedStep { length, resolved: false }));
        }
        let work: f64 = self.residual.iter().zip(&self.step).map(|(r, d)| -r.dot(d)).sum();
        let predicted = 0.5 * (work + region.shift * units.weigh(&self.step));
        let noise = ROUNDING * (region.energy.abs() + there.abs());
        let ratio = if predicted <= noise && there - region.energy <= noise {
            1.0
        } else {
            (region.energy - there) / predicted
        };
        if ratio.is_nan() || ratio < RATIO[0] || self.closes_too_far(system, q) || self.overturns(system, q) {
            region.radius = region.radius.min(length) / 3.0;
            if region.radius < MIN_RADIUS {
                return Err(FallFailure::Stuck);
            }
            return raise(region, 3.0);
        }
        if ratio > RATIO[2] {
            region.radius = (2.0 * region.radius).min(RADIUS[1]);
        } else if ratio < RATIO[1] {
            region.radius *= 0.5;
        }
        region.energy = there;
        Ok(Some(AcceptedStep { length, resolved: predicted > noise }))
    }

    /// Factors the tangent; true where it is positive definite, motions aside that are free from the start.
    pub(super) fn is_definite(&mut self, system: &System) -> bool {
        let pattern = &system.model.pattern;
        let inertia = if self.free_from_start {
            system.model.factor_holding(&mut self.tangent, &mut self.held)
        } else {
            self.tangent.factor(pattern)
        };
        inertia.is_ok_and(|inertia| inertia.negative == 0)
    }

    /// True where the step to `trial` turns the ends of a segment so far against each other, and further than at `from`, that its law has a
    /// valley of its own there: it stretches without strain.
    fn overturns(&self, system: &System, from: &[Pose]) -> bool {
        let turned =
            |beam: &BeamLine, k: usize, q: &[Pose]| (beam.points[k + 1].rotation(q) - beam.points[k].rotation(q)).abs();
        let over = |beam: &BeamLine, k: usize| {
            let there = turned(beam, k, &self.trial);
            there > OVERTURNED && there > turned(beam, k, from)
        };
        !system.model.linear && system.beams.iter().any(|beam| (0..beam.segments()).any(|k| over(beam, k)))
    }

    /// True where the step to `trial` changes the distance of a gap by so much that it may lead across.
    fn closes_too_far(&self, system: &System, from: &[Pose]) -> bool {
        let far = |gap: usize| {
            let (before, after) = (system.clearance(gap, from), system.clearance(gap, &self.trial));
            (after - before).abs() > CLOSING * before.abs().max(after.abs())
        };
        let acts = |gap: &usize| {
            let member = &system.members[*gap];
            member.touching().is_some()
                || (member.is_electrostatic() && system.electrics.is_charged(*gap, &self.drive.volts))
        };
        // from one side of a finger's gap to the other, too
        system.sides_leap([from, &self.trial], CLOSING, |a, b| a.abs().max(b.abs()))
            || (0..system.members.len()).filter(acts).any(far)
    }
}
