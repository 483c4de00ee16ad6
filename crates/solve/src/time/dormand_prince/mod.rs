//! The explicit Runge–Kutta pair of Dormand and Prince, order 5 with an embedded order 4, for q̈ = a(t, q, q̇).
//!
//! A step depends on no bodies or joints: any caller with accelerations can use it. [`super::explicit`] makes it one of
//! the methods of the common driver. Mechanisms without a system, with tolerances down to 1e-13, use
//! [`DormandPrince::integrate`] ([`SecondOrder`]). With y = (q, q̇) a step is
//! ```text
//! y_i = y + h·Σ_{j<i} a_ij·k_j      k_i = (q̇_i, a(t + c_i·h, q_i, q̇_i))        i = 1 … 7
//! y'  = y_7                         error = h·Σ e_i·k_i
//! ```
//! and the seventh stage of one step is the first of the next. Sums are compensated (Kahan), so that tolerances down to 1e-13 are met;
//! `integrate` controls steps by a PI rule and gives each a continuous extension of order 4.
//!
//! Reference: J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980); coefficients, continuous extension and step
//! control as in DOPRI5, E. Hairer, S. P. Nørsett, G. Wanner, "Solving Ordinary Differential Equations I" (1993), §II.4–6.

mod control;
#[cfg(test)]
mod tests;

use crate::equations::{Motion, Unknown};
pub use control::{IntegrationError, Tolerances};

/// Equations of motion solved for the accelerations.
pub trait SecondOrder {
    /// Why accelerations may be out of reach.
    type Error;

    /// Length of q, and of q̇.
    fn dimension(&self) -> usize;

    /// `a` becomes q̈ at time `t` (s), coordinates `q` and rates `v`.
    ///
    /// # Errors
    /// The formulation's own; the step is then tried again at a fifth of its length.
    fn accelerations(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), Self::Error>;

    /// Takes the end of an accepted step back to the constraints, if there are any.
    ///
    /// # Errors
    /// The formulation's own; the integration ends with it.
    fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64]) -> Result<(), Self::Error> {
        let _ = (t, q, v);
        Ok(())
    }
}

/// Nodes c_i.
const C: [f64; 7] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
/// Stage weights a_ij; the last row are the weights of order 5.
#[rustfmt::skip]
const A: [[f64; 6]; 7] = [
    [0.0; 6],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Weights of order 5 less those of order 4.
#[rustfmt::skip]
const E: [f64; 7] = [
    71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0,
];
/// Weights of the continuous extension's fifth coefficient.
#[rustfmt::skip]
const D: [f64; 7] = [
    -12_715_105_075.0 / 11_282_082_432.0, 0.0, 87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0, 701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0, 69_997_945.0 / 29_380_423.0,
];

/// Work done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Evaluations of the accelerations.
    pub accelerations: u64,
}

/// Coordinates and rates, or changes of them.
pub type PhasePoint = Motion<f64>;

/// The continuous extension of one accepted step.
#[derive(Debug, Clone, Copy)]
pub struct DenseOutput<'a> {
    /// Start of the step (s).
    pub t: f64,
    /// Its length (s); negative when time runs backwards.
    pub h: f64,
    terms: &'a [PhasePoint; 5],
}

impl DenseOutput<'_> {
    /// Coordinates and rates at time `t` within the step, with an error of order 5 in its length.
    pub fn at(&self, t: f64, q: &mut [f64], v: &mut [f64]) {
        let x = (t - self.t) / self.h;
        let y = 1.0 - x;
        let [a, b, c, d, e] = self.terms;
        let sum = |a: f64, b: f64, c: f64, d: f64, e: f64| a + x * (b + y * (c + x * (d + y * e)));
        for i in 0..q.len() {
            q[i] = sum(a.q[i], b.q[i], c.q[i], d.q[i], e.q[i]);
            v[i] = sum(a.v[i], b.v[i], c.v[i], d.v[i], e.v[i]);
        }
    }
}

/// The method with its storage, for some number of unknowns.
#[derive(Debug, Clone)]
pub struct DormandPrince<X = f64> {
    /// Slopes of the stages; after [`DormandPrince::attempt`] the last is the first of the next step.
    slopes: [Motion<X>; 7],
    at: Motion<X>,
    carry: Motion<X>,
    /// Coefficients of the continuous extension, where it is made.
    terms: [Motion<X>; 5],
    /// End of the step last attempted.
    pub next: Motion<X>,
    /// Its estimated error.
    pub error: Motion<X>,
    /// Work so far.
    pub effort: Effort,
}

impl<X: Unknown> DormandPrince<X> {
    /// Storage for `n` unknowns and as many rates.
    pub fn new(n: usize) -> Self {
        Self {
            slopes: std::array::from_fn(|_| Motion::zeros(n)),
            at: Motion::zeros(n),
            carry: Motion::zeros(n),
            terms: std::array::from_fn(|_| Motion::zeros(0)),
            next: Motion::zeros(n),
            error: Motion::zeros(n),
            effort: Effort::default(),
        }
    }

    /// Evaluates the first stage at a new starting point: `accelerate(t, q, v, a)` fills in `a`.
    ///
    /// # Errors
    /// Those of `accelerate`.
    pub(super) fn begin<F>(
        &mut self,
        accelerate: &mut impl FnMut(f64, &[X], &[X], &mut [X]) -> Result<(), F>,
        t: f64,
        q: &[X],
        v: &[X],
    ) -> Result<(), F> {
        self.slopes[0].q.copy_from_slice(v);
        self.effort.accelerations += 1;
        accelerate(t, q, v, &mut self.slopes[0].v)
    }

    /// One step of length `h` from a point whose first stage is known ([`DormandPrince::begin`] or
    /// [`DormandPrince::advance`]): its end goes to `next`, its estimated error to `error`. `(q, v)` stays.
    ///
    /// # Errors
    /// Those of `accelerate`.
    pub(super) fn attempt<F>(
        &mut self,
        accelerate: &mut impl FnMut(f64, &[X], &[X], &mut [X]) -> Result<(), F>,
        (t, h): (f64, f64),
        q: &[X],
        v: &[X],
    ) -> Result<(), F> {
        let n = q.len();
        for i in 1..7 {
            for c in 0..n {
                let (mut dq, mut dv) = (X::ZERO, X::ZERO);
                for (slope, a) in self.slopes[..i].iter().zip(A[i]) {
                    dq += slope.q[c] * a;
                    dv += slope.v[c] * a;
                }
                let at = &mut self.at;
                if i < 6 {
                    (at.q[c], at.v[c]) = (q[c] + dq * h, v[c] + dv * h);
                } else {
                    // with the last stage goes what rounding has cut off the earlier steps; what it cuts off now waits in
                    // `at` until the step is accepted
                    let (dq, dv) = (dq * h + self.carry.q[c], dv * h + self.carry.v[c]);
                    (self.next.q[c], self.next.v[c]) = (q[c] + dq, v[c] + dv);
                    (at.q[c], at.v[c]) = (dq - (self.next.q[c] - q[c]), dv - (self.next.v[c] - v[c]));
                }
            }
            let at = if i == 6 { &self.next } else { &self.at };
            self.slopes[i].q.copy_from_slice(&at.v);
            self.effort.accelerations += 1;
            accelerate(t + C[i] * h, &at.q, &at.v, &mut self.slopes[i].v)?;
        }
        for c in 0..n {
            let (mut eq, mut ev) = (X::ZERO, X::ZERO);
            for (slope, e) in self.slopes.iter().zip(E) {
                eq += slope.q[c] * e;
                ev += slope.v[c] * e;
            }
            self.error.q[c] = eq * h;
            self.error.v[c] = ev * h;
        }
        Ok(())
    }

    /// Makes the last stage of the step just attempted the first of the next.
    pub fn advance(&mut self) {
        self.slopes.swap(0, 6);
        std::mem::swap(&mut self.carry, &mut self.at);
    }

    /// Drops the rounding remainder: the next step starts from another point.
    pub fn forget(&mut self) {
        self.carry.clear();
    }
}

/// Coefficients of the continuous extension of one component between `start` and `end`.
fn continuous(start: f64, end: f64, h: f64, slope: impl Fn(usize) -> f64) -> [f64; 5] {
    let difference = end - start;
    let first = h * slope(0) - difference;
    let last = difference - h * slope(6) - first;
    let fifth = h * D.iter().enumerate().map(|(i, d)| d * slope(i)).sum::<f64>();
    [start, difference, first, last, fifth]
}
