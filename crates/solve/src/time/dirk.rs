//! Diagonally implicit Runge–Kutta methods over any equations: TR-BDF2, SDIRK4, implicit midpoint, by their [`Tableau`].
//!
//! With v the rates and k the accelerations of the stages,
//! ```text
//! v_i = v₀ + h·Σ_{j<i} a_ij·k_j + h·a_ii·k_i      q_i = q₀ + h·Σ_{j<i} a_ij·v_j + h·a_ii·v_i
//! error = h·Σ e_i·(v_i, k_i), taken through (I − γ·J)⁻¹      γ = h·a_ii
//! ```
//! so that each stage is one equation for k_i, with γ and β = γ² ([`Stage`]); one with a_ii = 0 is an evaluation. Where
//! Rodas4 needs the Jacobian in its formula, here it only accelerates the iteration, so that the order does not depend
//! on it: joint coordinates with an approximate one use the same tableaus.
//!
//! A direction without inertia has no acceleration: its k is what the differences of its rates are, and no equation has it, since its
//! displacement follows from the springs and its rate from the displacements of the stages.

use super::method::{Method, Motion, StepResult};
use super::tableau::Tableau;
use crate::equations::{Stage, Staged, Unknown};
use bimorph_multibody::planar::Pose;

/// A method with its storage.
#[derive(Debug, Clone)]
pub struct Dirk<X = Pose> {
    tableau: &'static Tableau,
    /// Rates (q) and accelerations (v) of the stages.
    stages: Vec<Motion<X>>,
    /// Part of a stage without its own acceleration.
    base: Motion<X>,
    /// The place of the last stage.
    at: Motion<X>,
    near: Vec<X>,
}

impl<X: Unknown> Dirk<X> {
    /// Storage over some number of unknowns.
    pub fn new(unknowns: usize, tableau: &'static Tableau) -> Self {
        let zeros = Motion::zeros(unknowns);
        Self {
            tableau,
            stages: vec![zeros.clone(); tableau.a.len()],
            base: zeros.clone(),
            near: zeros.q.clone(),
            at: zeros,
        }
    }

    /// `out = from + h·Σ weights·stages`.
    fn sum(&self, h: f64, weights: &[f64], from: Option<&Motion<X>>, out: &mut Motion<X>) {
        for k in 0..out.q.len() {
            let (mut dq, mut dv) = (X::ZERO, X::ZERO);
            for (s, w) in self.stages.iter().zip(weights) {
                dq += s.q[k] * *w;
                dv += s.v[k] * *w;
            }
            let (q, v) = from.map_or((X::ZERO, X::ZERO), |m| (m.q[k], m.v[k]));
            (out.q[k], out.v[k]) = (q + dq * h, v + dv * h);
        }
    }

    /// Solves stage `i`, or evaluates it.
    fn stage<E: Staged<Unknown = X>>(
        &mut self,
        equations: &mut E,
        (i, t, h): (usize, f64, f64),
        now: &Motion<X>,
    ) -> StepResult {
        let Tableau { a, c, .. } = self.tableau;
        let gamma = h * a[i][i];
        let (before, rest) = self.stages.split_at_mut(i);
        let stage = &mut rest[0];
        for k in 0..now.q.len() {
            let (mut dq, mut dv) = (X::ZERO, X::ZERO);
            for (s, a) in before.iter().zip(a[i]) {
                dq += s.q[k] * *a;
                dv += s.v[k] * *a;
            }
            let v = now.v[k] + dv * h;
            (self.base.q[k], self.base.v[k]) = (now.q[k] + dq * h + v * gamma, v);
            // the last stage's place, moved on at its rate
            let (from, rate, by) = match before.last() {
                Some(last) => (self.at.q[k], last.q[k], c[i] - c[i - 1]),
                None => (now.q[k], now.v[k], c[i]),
            };
            self.near[k] = from + rate * (by * h);
        }
        let at = t + c[i] * h;
        if a[i][i] == 0.0 {
            equations.accelerations(at, &self.base.q, &self.base.v, &mut stage.v)?;
            self.at.copy(&self.base);
        } else {
            // nothing of an earlier step: a step is a function of its start
            match before.last() {
                Some(last) => stage.v.copy_from_slice(&last.v),
                None => stage.v.fill(X::ZERO),
            }
            let Motion { q, v } = &self.base;
            let asked = Stage { t: at, q, v, near: &self.near, beta: gamma * gamma, gamma };
            equations.stage(&asked, &mut stage.v, &mut self.at)?;
        }
        stage.q.copy_from_slice(&self.at.v);
        Ok(())
    }
}

impl<E: Staged> Method<E> for Dirk<E::Unknown> {
    fn error_order(&self) -> f64 {
        self.tableau.order
    }

    /// `error` receives zero where the tableau has no estimate.
    fn step(
        &mut self,
        equations: &mut E,
        t: f64,
        h: f64,
        motion: &mut Motion<E::Unknown>,
        error: &mut Motion<E::Unknown>,
    ) -> StepResult {
        let Tableau { a, b, error: weights, .. } = self.tableau;
        for i in 0..a.len() {
            self.stage(equations, (i, t, h), motion)?;
        }
        match b {
            // the last stage is the end
            None => motion.copy(&self.at),
            Some(b) => {
                self.base.copy(motion);
                self.sum(h, b, Some(&self.base), motion);
                equations.follow(h, &self.base.q, motion, &mut []);
            }
        }
        match weights {
            None => error.clear(),
            Some(weights) => {
                self.sum(h, weights, None, error);
                let last = a.len() - 1;
                equations.smooth((t + h, h * a[last][last]), &motion.q, error)?;
            }
        }
        Ok(())
    }
}
