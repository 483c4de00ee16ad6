//! The directions of a mechanism for a box of inputs and a tolerance.
//!
//! 1. Taylor terms of the statics at rest ([`super::taylor`]), made orthonormal in the energy at rest.
//! 2. Their polynomial at points of the box, compressed by the singular value decomposition in that energy.
//! 3. Moments K₀⁻¹·(M·K₀⁻¹)ʲ·f of every input, for motion.
//! 4. Reduced statics at corners and points of the box, checked by a Newton step of the full model. Where the estimate fails, or the
//!    branch ends, equilibria of the full model join the directions, and the check is repeated.
//!    For statics beyond a pull-in the branch there is followed back in the full model, and its equilibria are checked, too.
//! 5. Motions that the caller names, such as modes.
//!
//! Every step is deterministic: points, signs and orders depend on the mechanism, the box and the tolerance alone.

use super::ReductionError;
use super::branches::{BranchState, StaticBranch, branch_states};
use super::check::{FullCheck, StateCheck};
use super::energy::{EnergyProduct, EnergyVector};
use super::inputs::{InputBox, MAX_INPUTS};
use super::space::ReducedSpace;
use super::statics::ReducedStatics;
use super::taylor::{DriveRay, TaylorTerms};
use crate::equations::Joints;
use crate::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, System};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use nalgebra::DMatrix;
use std::cell::OnceCell;
use std::sync::Arc;

/// Points of the box at which the polynomial is sampled.
const POINTS: usize = 300;
/// Points of the box at which the reduced statics are checked, beside its corners.
const CHECKS: usize = 8;
/// Rounds of checks.
const ROUNDS: usize = 5;
/// The same with the states beyond a pull-in.
const ROUNDS_BEYOND: usize = 12;
/// Part of a moment or of an equilibrium that must be new (1).
const NEW: f64 = 1e-5;
/// Part of a Taylor term that must be new (1): below, it is rounding of the samples.
const INDEPENDENT: f64 = 1e-9;
/// Fraction of the strains that a reduced model may have as directions.
const WORTH: usize = 5;
/// Directions that are always allowed, however few strains there are.
const FEW: usize = 8;

/// Requirements on a training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainingOptions {
    /// Relative error of displacements.
    pub errors: ErrorBudget,
    /// Moments of each input; 0 for statics.
    pub moments: usize,
    /// Whether the statics beyond a pull-in count, down to where parts release.
    pub beyond: bool,
}

/// A system with the box of its inputs: what moves, or what it is released from. All have the bodies and joints of one tree.
#[derive(Debug, Clone)]
pub struct TrainingCase<'a> {
    /// The system.
    pub system: &'a System,
    /// Its inputs.
    pub inputs: InputBox,
    /// Motions of the bodies from rest that join the directions, the most important first, as far as the strains allow.
    pub motions: &'a [Vec<Pose>],
}

/// A trained space.
#[derive(Debug, Clone)]
pub struct Training {
    /// The space.
    pub space: ReducedSpace,
    /// Largest relative error of the statics in the box, by the last check (1).
    pub error: f64,
    /// Directions that came from full equilibria.
    pub added: usize,
    /// Motions of the cases that joined the directions, or were in them.
    pub motions: usize,
    /// Independent inputs.
    pub inputs: usize,
    /// z of stable equilibria in the box, by the last check.
    pub equilibria: Vec<Vec<f64>>,
}

/// The directions of a mechanism on its tree for the boxes of its cases.
///
/// # Errors
/// [`ReductionError`].
pub fn train(
    joints: &Arc<Joints>,
    cases: &[TrainingCase<'_>],
    options: TrainingOptions,
) -> Result<Training, ReductionError> {
    let count = cases.iter().map(|case| case.inputs.inputs.len()).sum();
    if count == 0 {
        return Err(ReductionError::NoInput);
    }
    if count > MAX_INPUTS {
        return Err(ReductionError::TooManyInputs { count, most: MAX_INPUTS });
    }
    let (product, basis) = (EnergyProduct::at_rest(joints), Vec::new());
    let mut trainer = Trainer { joints, cases, options, product, basis, beyond: vec![OnceCell::new(); cases.len()] };
    let mut samples = Vec::new();
    let acting = || cases.iter().filter(|case| !case.inputs.inputs.is_empty());
    for case in acting() {
        samples.extend(trainer.expand(case)?);
    }
    for case in acting() {
        trainer.add_moments(case)?;
    }
    trainer.affordable()?;
    let (mut added, mut space) = (0, trainer.space(&samples, &[]));
    let mut rounds = 0;
    let most = if options.beyond { ROUNDS_BEYOND } else { ROUNDS };
    loop {
        let BoxCheck { error, lacking, beyond, states } = trainer.check(&space);
        let before = trainer.basis.len();
        for s in lacking.into_iter().flatten().filter(|_| rounds < most) {
            trainer.product.extend(&mut trainer.basis, s, NEW);
        }
        // a state beyond a pull-in is worth a direction, but not the whole model
        if let Some((_, s)) = beyond.filter(|_| rounds < most && trainer.basis.len() < trainer.most()) {
            trainer.product.extend(&mut trainer.basis, s, NEW);
        }
        let more = trainer.basis.len() - before;
        space = trainer.space(&samples, &states);
        if more == 0 {
            let motions = trainer.add_motions();
            if motions > 0 {
                space = trainer.space(&samples, &states);
            }
            let equilibria = states.iter().map(|s| trainer.coordinates(s)).collect();
            return Ok(Training { space, error, added, motions, inputs: count, equilibria });
        }
        (added, rounds) = (added + more, rounds + 1);
        trainer.affordable()?;
    }
}

struct Trainer<'a> {
    joints: &'a Arc<Joints>,
    cases: &'a [TrainingCase<'a>],
    options: TrainingOptions,
    product: EnergyProduct<'a>,
    basis: Vec<EnergyVector>,
    /// Of each case the equilibria beyond a pull-in, once there is one.
    beyond: Vec<OnceCell<Vec<BranchState>>>,
}

/// Equilibria that the directions lack, over the coordinates of the tree.
type Lacking = Option<Vec<Vec<Pose>>>;

/// The statics of a space in the boxes; states are over the coordinates of the tree.
#[derive(Debug, Default)]
struct BoxCheck {
    /// The largest error (1).
    error: f64,
    /// The equilibria that are lacking at the worst point.
    lacking: Lacking,
    /// The worst state beyond a pull-in whose error is not within its part of the tolerance, with that error (1).
    beyond: Option<(f64, Vec<Pose>)>,
    /// All states.
    states: Vec<Vec<Pose>>,
}

impl Trainer<'_> {
    /// Steps 1 and 2. Returns the samples over the coordinates of the tree.
    fn expand(&mut self, case: &TrainingCase<'_>) -> Result<Vec<Vec<Pose>>, ReductionError> {
        let taylor = TaylorTerms::at_rest(case.system, &self.joints.tree, &case.inputs)?;
        let points = case.inputs.points(POINTS, false);
        let mut frame: Vec<EnergyVector> = Vec::new();
        // terms at the size that they have at the end of the box, so that small ones are dropped against large ones
        let columns: Vec<Vec<f64>> =
            taylor.terms.iter().map(|term| self.product.extend(&mut frame, term.clone(), INDEPENDENT)).collect();
        let (r, n) = (frame.len(), points.len());
        if r == 0 {
            return Ok(Vec::new()); // loads of nothing
        }
        bimorph_base::budget::lay_out_matrix(r, n + columns.len());
        let values: Vec<Vec<f64>> = points.iter().map(|u| taylor.monomials(u)).collect();
        let weights: DMatrix<f64> = DMatrix::from_fn(r, n, |i, k| {
            columns.iter().zip(&values[k]).map(|(column, value)| column.get(i).map_or(0.0, |c| c * value)).sum()
        });
        let decomposed = nalgebra::SVD::new(weights.clone(), true, false);
        let (Some(u), sigma) = (decomposed.u, decomposed.singular_values) else { return Err(ReductionError::NoInput) };
        let mut order: Vec<usize> = (0..sigma.len()).collect();
        order.sort_by(|a, b| sigma[*b].total_cmp(&sigma[*a]));
        let most = order.first().map_or(0.0, |k| sigma[*k]);
        let blend = |weight: &dyn Fn(usize) -> f64| {
            let mut sum = vec![Pose::zeros(); case.system.bodies()];
            for (i, vector) in frame.iter().enumerate() {
                let weight = weight(i);
                sum.iter_mut().zip(&vector.x).for_each(|(sum, x)| *sum += x * weight);
            }
            sum
        };
        let least = self.options.errors.singular_value(self.options.moments > 0, most);
        let kept = order.into_iter().filter(|k| sigma[*k] > least && sigma[*k] > 0.0);
        let shapes: Vec<Vec<Pose>> = kept
            .map(|k| {
                let largest = (0..r).map(|i| u[(i, k)]).fold(0.0f64, |a, b| if b.abs() > a.abs() { b } else { a });
                blend(&|i| u[(i, k)] * largest.signum())
            })
            .collect();
        let samples = (0..n).map(|k| blend(&|i| weights[(i, k)])).collect();
        for shape in shapes {
            self.product.extend(&mut self.basis, shape, NEW);
        }
        Ok(samples)
    }

    /// Step 3.
    fn add_moments(&mut self, case: &TrainingCase<'_>) -> Result<(), ReductionError> {
        let (system, inputs) = (case.system, &case.inputs);
        let model = &system.model;
        let rest = vec![Pose::zeros(); system.bodies()];
        let (mut tangent, mut at_rest) = (BodyMatrix::new(&model.pattern), rest.clone());
        system.tangent(&rest, &inputs.none, &mut tangent, &mut at_rest);
        model.project_matrix(&mut tangent);
        let mut held = Vec::new();
        let factored = model.factor_holding(&mut tangent, &mut held);
        if let Some(pivot) = factored.err().or_else(|| held.first().copied()) {
            return Err(ReductionError::Free { body: model.bodies[pivot.body].name.to_string() });
        }
        for i in 0..inputs.inputs.len() {
            let mut y = inputs.force(system, i, &at_rest);
            tangent.solve(&model.pattern, &mut y);
            for _ in 0..self.options.moments {
                y.iter_mut().enumerate().for_each(|(j, y)| *y = model.mass(j).component_mul(y));
                model.project(&mut y);
                tangent.solve(&model.pattern, &mut y);
                let size = y.iter().map(|y| y.amax()).fold(0.0, f64::max);
                if size == 0.0 {
                    break;
                }
                y.iter_mut().for_each(|y| *y /= size);
                let mut s = rest.clone();
                self.joints.tree.rates_at(&rest, &y, &mut s);
                self.product.extend(&mut self.basis, s, NEW);
            }
        }
        Ok(())
    }

    /// The motions of the cases, as long as directions are affordable. Returns how many of them are among the directions.
    fn add_motions(&mut self) -> usize {
        let rest = vec![Pose::zeros(); self.joints.tree.links.len()];
        let mut taken = 0;
        for motion in self.cases.iter().flat_map(|case| case.motions) {
            if self.basis.len() >= self.most() {
                break;
            }
            let mut s = rest.clone();
            self.joints.tree.rates_at(&rest, motion, &mut s);
            self.product.extend(&mut self.basis, s, NEW);
            taken += 1;
        }
        taken
    }

    /// The most directions that cost less than the full model.
    fn most(&self) -> usize {
        let strains = self.joints.tree.coordinates;
        (strains / WORTH).max(FEW).min(strains)
    }

    /// Rejects what would cost more than the full model.
    fn affordable(&self) -> Result<(), ReductionError> {
        let (directions, strains) = (self.basis.len(), self.joints.tree.coordinates);
        if directions > self.most() {
            return Err(ReductionError::TooMany { directions, strains });
        }
        Ok(())
    }

    /// The space of the directions, with the reach of the samples and of further states (over the coordinates of the tree).
    fn space(&self, samples: &[Vec<Pose>], states: &[Vec<Pose>]) -> ReducedSpace {
        let (mut reach, mut amplitude) = (vec![0.0f64; self.basis.len()], 0.0f64);
        for s in samples.iter().chain(states) {
            let z = self.coordinates(s);
            reach.iter_mut().zip(&z).for_each(|(reach, z)| *reach = reach.max(z.abs()));
            amplitude = amplitude.max(z.iter().map(|z| z * z).sum::<f64>().sqrt());
        }
        let largest = reach.iter().fold(0.0f64, |a, b| a.max(*b));
        // a moment that no equilibrium has moves as far as the smallest that counts
        reach.iter_mut().for_each(|reach| *reach = reach.max(self.options.errors.within(largest)));
        let directions = self.basis.iter().map(|b| b.x.clone()).collect();
        ReducedSpace::new(Arc::clone(self.joints), directions, reach, amplitude)
    }

    /// z of a state over the coordinates of the tree.
    fn coordinates(&self, s: &[Pose]) -> Vec<f64> {
        let s = self.product.of(s.to_vec());
        self.basis.iter().map(|b| self.product.product(b, &s)).collect()
    }

    /// Step 4.
    fn check(&self, space: &ReducedSpace) -> BoxCheck {
        let (mut statics, mut found) = (ReducedStatics::new(space), BoxCheck::default());
        for (case, beyond) in self.cases.iter().zip(&self.beyond) {
            // the forces over z are those of one system alone: others have other loads
            let space = space.of_system(case.system);
            if self.check_case(&space, case, &mut statics, &mut found) && self.options.beyond {
                self.check_beyond(&space, case, (beyond, &mut statics), &mut found);
            }
        }
        found
    }

    /// Returns whether a branch from rest ends in the box.
    fn check_case(
        &self,
        space: &ReducedSpace,
        case: &TrainingCase<'_>,
        statics: &mut ReducedStatics,
        BoxCheck { error, lacking: worst, states, .. }: &mut BoxCheck,
    ) -> bool {
        let mut ends = false;
        let (system, inputs) = (case.system, &case.inputs);
        let mut full = FullCheck::new(system);
        let share = self.options.errors.reduced_statics();
        for u in inputs.points(CHECKS, true) {
            let drive = inputs.drive(&u);
            if drive == inputs.none {
                continue;
            }
            let mut z = vec![0.0; space.size()];
            let path = statics.follow(space, &DriveRay { none: &inputs.none, to: &drive }, &mut z);
            let at = &statics.forces.placed.at;
            let found = match path.reached >= 1.0 {
                true => full.of(system, at, &drive, None),
                false => StateCheck { error: f64::INFINITY, negative: 1 },
            };
            let stable = found.negative == 0;
            ends |= !stable;
            if stable {
                let mut s = vec![Pose::zeros(); system.bodies()];
                space.strains(&z, &mut s);
                states.push(s);
                *error = error.max(found.error);
            }
            let estimate = if stable { found.error } else { f64::INFINITY };
            if estimate > share && (estimate >= *error || worst.is_none()) {
                let lacking = self.lacking(case, &mut full, at, &drive, stable);
                if lacking.is_some() {
                    *worst = lacking;
                }
            }
        }
        ends
    }

    /// The same for the states beyond a pull-in, each at its place in the space.
    fn check_beyond(
        &self,
        space: &ReducedSpace,
        case: &TrainingCase<'_>,
        (beyond, statics): (&OnceCell<Vec<BranchState>>, &mut ReducedStatics),
        BoxCheck { error, beyond: worst, states, .. }: &mut BoxCheck,
    ) {
        let (system, inputs) = (case.system, &case.inputs);
        let beyond = beyond.get_or_init(|| {
            let mut found = branch_states(system, inputs, &inputs.points(CHECKS, true));
            found.retain(|state| state.branch != StaticBranch::Rest);
            found
        });
        let mut full = FullCheck::new(system);
        let share = self.options.errors.statics_beyond();
        for state in beyond {
            let mut s = vec![Pose::zeros(); system.bodies()];
            self.joints.tree.coordinates_at(&state.q, &mut s);
            statics.forces.place_at_rest(space, &self.coordinates(&s));
            let found = full.of(system, &statics.forces.placed.at, &state.drive, None).error;
            if found > worst.as_ref().map_or(share, |(error, _)| *error) {
                *worst = Some((found, s.clone()));
            }
            if state.branch != StaticBranch::Release {
                *error = error.max(found);
                states.push(s);
            }
        }
    }

    /// Equilibria of the full model at a drive: next to the reduced state, or the end of the branch from rest and where it falls from there.
    fn lacking(&self, case: &TrainingCase<'_>, full: &mut FullCheck, q: &[Pose], drive: &Drive, near: bool) -> Lacking {
        let system = case.system;
        let strains = |q: &[Pose]| {
            let mut s = vec![Pose::zeros(); q.len()];
            self.joints.tree.coordinates_at(q, &mut s);
            s
        };
        let mut at = q.to_vec();
        if near && full.corrected(system, &mut at, drive) {
            return Some(vec![strains(&at)]);
        }
        let path = DriveRay { none: &case.inputs.none, to: drive };
        let mut found = Vec::new();
        for stop_at_fold in [true, false] {
            let mut q = vec![Pose::zeros(); system.bodies()];
            let options = EquilibriumOptions { stop_at_fold, ..Default::default() };
            let Ok(path) = Equilibrium::new(system, options).follow(system, &path, &mut q) else { break };
            found.push(strains(&q));
            if stop_at_fold && path.reached == 1.0 {
                break;
            }
        }
        (!found.is_empty()).then_some(found)
    }
}
