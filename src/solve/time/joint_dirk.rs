//! Diagonally implicit Runge–Kutta methods and generalized-α in joint coordinates.
//!
//! With k the accelerations and v the rates of the stages,
//! ```text
//! v_i = v₀ + h·Σ_{j<i} a_ij·k_j + h·a_ii·k_i      q_i = q₀ + h·Σ_{j<i} a_ij·v_j + h·a_ii·v_i
//! ```
//! so that each stage is one equation for k_i, with γ = h·a_ii and β = γ² ([`super::joint_stage`]). A stage with a_ii = 0
//! is an evaluation. Generalized-α and Newmark's rule come to the same equation.
//!
//! Coefficients, orders and sources are those of [`super::tableau`]; generalized-α is with an acceleration of its own (M. Arnold,
//! O. Brüls, Multibody System Dynamics 18 (2007) 185–202).

use super::dormand_prince::Pair;
use super::joint_stage::{ImplicitMotion, Loads, Stage, StageError};
use super::tableau::{Alpha, MIDPOINT, NEWMARK, SDIRK4, TR_BDF2, Tableau};

/// A method by name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Implicit midpoint.
    Midpoint,
    /// Newmark's rule with average acceleration.
    Newmark,
    /// TR-BDF2.
    TrBdf2,
    /// SDIRK4 of Hairer and Wanner.
    Sdirk4,
    /// Generalized-α; `rho` is the factor by which an infinitely fast motion shrinks in a step, 0 to 1.
    GeneralizedAlpha {
        /// ρ.
        rho: f64,
    },
}

/// A method with its storage.
#[derive(Debug, Clone)]
pub struct JointMethod {
    tableau: Option<&'static Tableau>,
    alpha: Alpha,
    stages: Vec<Pair>,
    base: Pair,
    /// What goes from step to step besides the motion: generalized-α's own acceleration (q) and the true one (v).
    pub carried: Pair,
}

impl JointMethod {
    /// Storage for `n` coordinates.
    pub fn new(rule: Rule, n: usize) -> Self {
        let (tableau, rho) = match rule {
            Rule::Midpoint => (Some(&MIDPOINT), 0.0),
            Rule::Newmark => (Some(&NEWMARK), 0.0),
            Rule::TrBdf2 => (Some(&TR_BDF2), 0.0),
            Rule::Sdirk4 => (Some(&SDIRK4), 0.0),
            Rule::GeneralizedAlpha { rho } => (None, rho),
        };
        let count = tableau.map_or(0, |t| t.a.len());
        Self {
            tableau,
            alpha: Alpha::damping(rho),
            stages: vec![Pair::zeros(n); count],
            base: Pair::zeros(n),
            carried: Pair::zeros(if tableau.is_none() { n } else { 0 }),
        }
    }

    /// Power of the step with which the error falls.
    pub fn order(&self) -> f64 {
        self.tableau.map_or(3.0, |t| t.order)
    }

    /// True for methods that tell their error.
    pub fn estimates(&self) -> bool {
        self.tableau.is_some_and(|t| t.error.is_some())
    }

    /// Prepares for a motion that begins at (`q`, `v`) at time `t` [s].
    ///
    /// # Errors
    /// See [`StageError`].
    pub fn start<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        t: f64,
        q: &[f64],
        v: &[f64],
    ) -> Result<(), StageError> {
        if self.tableau.is_none() {
            motion.accelerations(t, q, v, &mut self.carried.v)?;
            let Pair { q, v } = &mut self.carried;
            q.copy_from_slice(v);
        }
        Ok(())
    }

    /// One step of length `h` [s] at `t` from `now` to `end`; `error` receives its estimated error, if the method has
    /// one. Stages are solved to `tolerance`, see [`ImplicitMotion::stage`].
    ///
    /// # Errors
    /// See [`StageError`].
    #[allow(clippy::too_many_arguments)]
    pub fn step<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        (t, h): (f64, f64),
        tolerance: f64,
        now: &Pair,
        end: &mut Pair,
        error: &mut Pair,
    ) -> Result<(), StageError> {
        let Some(tableau) = self.tableau else { return self.alpha_step(motion, (t, h), tolerance, now, end) };
        let n = now.q.len();
        for (i, row) in tableau.a.iter().enumerate() {
            let gamma = h * row[i];
            let (before, rest) = self.stages.split_at_mut(i);
            let stage = &mut rest[0];
            for k in 0..n {
                let (mut dq, mut dv) = (0.0, 0.0);
                for (s, a) in before.iter().zip(*row) {
                    dq += a * s.q[k];
                    dv += a * s.v[k];
                }
                let v = now.v[k] + h * dv;
                (self.base.q[k], self.base.v[k]) = (now.q[k] + h * dq + gamma * v, v);
            }
            // a stage keeps its rates in q and its accelerations in v: the slopes of the motion
            if row[i] == 0.0 {
                motion.accelerations(t + tableau.c[i] * h, &self.base.q, &self.base.v, &mut stage.v)?;
            } else {
                // nothing of an earlier step: a step is a function of its start
                match before.last() {
                    Some(last) => stage.v.copy_from_slice(&last.v),
                    None => stage.v.fill(0.0),
                }
                let equation =
                    Stage { t: t + tableau.c[i] * h, q: &self.base.q, v: &self.base.v, beta: gamma * gamma, gamma };
                motion.stage(&equation, tolerance, &mut stage.v)?;
            }
            stage.q.copy_from_slice(&motion.v);
        }
        match tableau.b {
            None => end.copy(&motion.q, &motion.v),
            Some(b) => self.sum(h, b, Some(now), end),
        }
        if let Some(weights) = tableau.error {
            self.sum(h, weights, None, error);
            let last = tableau.a.len() - 1;
            let gamma = h * tableau.a[last][last];
            motion.smooth((t + h, gamma), &end.q, &mut error.q, &mut error.v)?;
        }
        Ok(())
    }

    /// `out = from + h·Σ weights·stages`.
    fn sum(&self, h: f64, weights: &[f64], from: Option<&Pair>, out: &mut Pair) {
        for k in 0..out.q.len() {
            let (mut dq, mut dv) = (0.0, 0.0);
            for (s, w) in self.stages.iter().zip(weights) {
                dq += w * s.q[k];
                dv += w * s.v[k];
            }
            let (q, v) = from.map_or((0.0, 0.0), |p| (p.q[k], p.v[k]));
            (out.q[k], out.v[k]) = (q + h * dq, v + h * dv);
        }
    }

    fn alpha_step<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        (t, h): (f64, f64),
        tolerance: f64,
        now: &Pair,
        end: &mut Pair,
    ) -> Result<(), StageError> {
        let Alpha { m, f, beta, gamma } = self.alpha;
        // its own acceleration at the end is known + share·(true acceleration at the end)
        let share = (1.0 - f) / (1.0 - m);
        let Pair { q: own, v: truly } = &mut self.carried;
        for k in 0..now.q.len() {
            let known = (f * truly[k] - m * own[k]) / (1.0 - m);
            self.base.q[k] = now.q[k] + h * now.v[k] + h * h * ((0.5 - beta) * own[k] + beta * known);
            self.base.v[k] = now.v[k] + h * ((1.0 - gamma) * own[k] + gamma * known);
            own[k] = known;
        }
        let equation =
            Stage { t: t + h, q: &self.base.q, v: &self.base.v, beta: h * h * beta * share, gamma: h * gamma * share };
        motion.stage(&equation, tolerance, truly)?;
        for (own, truly) in own.iter_mut().zip(truly.iter()) {
            *own += share * truly;
        }
        end.copy(&motion.q, &motion.v);
        Ok(())
    }
}
