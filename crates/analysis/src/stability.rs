//! Whether a motion balances where it could not rest.
//!
//! A straight beam that is heated beyond its buckling load stays straight in an ideal computation: nothing pushes it
//! aside. The signs of the pivots of the tangent stiffness show it (Sylvester): each negative one is an unstable
//! direction. Such a direction is no fault while the motion goes along it, as in a snap or a pull-in; it is one while
//! the motion has no part in it.

use bimorph_domains::{Drive, System};
use bimorph_multibody::forces::add_inertia;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Model};

/// Fraction of displacement or rate in an unstable direction from which the motion counts as unstable (1).
const MOVING: f64 = 1e-2;
/// Inverse iterations towards the softest direction.
const ROUNDS: usize = 4;

/// An unstable place that a motion balances on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UnstableEquilibrium {
    /// When it was first seen (s).
    pub(crate) since: f64,
    /// Directions that run away.
    pub(crate) directions: usize,
    /// Body that moves most in the softest of them.
    pub(crate) body: String,
}

/// Checks the stability of some states of a run.
#[derive(Debug)]
pub(crate) struct StabilityMonitor {
    tangent: BodyMatrix,
    rest: Vec<Pose>,
    found: Option<UnstableEquilibrium>,
    /// Still so at the last look.
    lasts: bool,
}

impl StabilityMonitor {
    pub(crate) fn new(system: &System) -> Self {
        let rest = vec![Pose::zeros(); system.bodies()];
        Self { tangent: BodyMatrix::new(&system.model.pattern), rest, found: None, lasts: false }
    }

    /// Checks a state at time `t` (s).
    pub(crate) fn check(&mut self, system: &System, drive: &Drive, t: f64, (q, v): (&[Pose], &[Pose])) {
        let model = &system.model;
        self.stiffness(system, drive, q, 0.0);
        let directions = self.tangent.factor(&model.pattern).map_or(0, |inertia| inertia.negative);
        self.lasts = false;
        if directions == 0 {
            return;
        }
        let Some(shape) = self.softest(system, drive, q) else { return };
        let share = |x: &[Pose]| {
            let length = model.mass_product(x, x).sqrt();
            if length > 0.0 { model.mass_product(&shape, x).abs() / length } else { 0.0 }
        };
        if share(q) > MOVING || share(v) > MOVING {
            return;
        }
        self.lasts = true;
        if self.found.is_none() {
            let body = most(&shape).map_or_else(String::new, |k| model.bodies[k].name.to_string());
            self.found = Some(UnstableEquilibrium { since: t, directions, body });
        }
    }

    /// Warning about the run.
    pub(crate) fn warning(&self) -> Option<String> {
        let UnstableEquilibrium { since, directions, body } = self.found.as_ref()?;
        let many = if *directions == 1 {
            "a direction of the stiffness runs".to_owned()
        } else {
            format!("{directions} directions of the stiffness run")
        };
        let end = if self.lasts { "to the end" } else { "until rounding lets it leave" };
        Some(format!(
            "from t = {since:.3e} s {end} the motion balances on an unstable branch: {many} away, most at \
             \"{body}\", and nothing pushes it there, as beyond a buckling load; --imperfection 1e-3 lets it take a branch"
        ))
    }

    fn stiffness(&mut self, system: &System, drive: &Drive, q: &[Pose], mass: f64) {
        system.tangent(q, drive, &mut self.tangent, &mut self.rest);
        system.add_stress_stiffness(q, drive, &mut self.tangent);
        if mass > 0.0 {
            add_inertia(&system.model, mass, 0.0, &mut self.tangent);
        }
        system.model.project_matrix(&mut self.tangent);
    }

    /// The lowest mode, xᵀMx = 1, from K + sM with an s that is just enough.
    fn softest(&mut self, system: &System, drive: &Drive, q: &[Pose]) -> Option<Vec<Pose>> {
        let model = &system.model;
        let mut s = 1e-6 * fastest(model, &self.tangent);
        for _ in 0..40 {
            self.stiffness(system, drive, q, s);
            if self.tangent.factor(&model.pattern).is_ok_and(|inertia| inertia.negative == 0) {
                break;
            }
            s *= 4.0;
        }
        let mut x: Vec<Pose> = (0..q.len())
            .map(|j| Pose::new(1.0, 1.0 + 0.37 * ((j * 7) % 5) as f64, 0.0) / system.length_scale)
            .collect();
        for _ in 0..ROUNDS {
            for (j, x) in x.iter_mut().enumerate() {
                *x = model.mass(j).component_mul(x);
            }
            model.project(&mut x);
            self.tangent.solve(&model.pattern, &mut x);
            model.project(&mut x);
            let length = model.mass_product(&x, &x).sqrt();
            if !(length.is_finite() && length > 0.0) {
                return None;
            }
            x.iter_mut().for_each(|x| *x /= length);
        }
        Some(x)
    }
}

/// Smallest inverse diagonal entry times mass: no faster than the stiffest body alone (rad²/s²).
fn fastest(model: &Model, factor: &BodyMatrix) -> f64 {
    let rate = |j: usize| 1.0 / (factor.diagonal[j][(0, 0)].abs() * model.mass(j).x);
    (0..factor.diagonal.len()).map(rate).filter(|r| r.is_finite()).fold(1.0, f64::max)
}

fn most(x: &[Pose]) -> Option<usize> {
    let size = |k: &usize| x[*k].x.hypot(x[*k].y);
    (0..x.len()).max_by(|a, b| size(a).total_cmp(&size(b)))
}
