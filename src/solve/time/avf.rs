//! The average vector field method: order 2, A-stable, and it keeps the energy.
//! ```text
//! M·(v₁ − v₀)/h + C·(v₀ + v₁)/2 + ∫₀¹ r(q₀ + ξ·(q₁ − q₀)) dξ = 0,      q₁ − q₀ = h·(v₀ + v₁)/2
//! ```
//! The integral of a gradient along a chord, times the chord, is the difference of its potential (a discrete gradient):
//! multiplied by q₁ − q₀ the equation says that kinetic and potential energy change by what the damping takes, whatever
//! the step. Two Gauss points stand for the integral; they are exact where r is cubic along the chord, and what they miss
//! falls with the fourth power of the step.
//!
//! Reference: G. R. W. Quispel, D. I. McLaren, "A new class of energy-preserving numerical integration methods", J. Phys. A
//! 41 (2008) 045206, eq. 4; E. Hairer, "Energy-preserving variant of collocation methods", JNAIAM 5 (2010).

use super::centred::{Centred, Rule};
use crate::solve::linear::Recursion;

/// Half of 1/√3.
const HALF: f64 = 0.288_675_134_594_812_9;
/// Two Gauss points on the chord.
#[derive(Debug, Clone)]
pub struct TwoPoints;

impl Rule for TwoPoints {
    const POINTS: &'static [(f64, f64)] = &[(0.5, 0.5 - HALF), (0.5, 0.5 + HALF)];
}

/// The method with its storage.
pub type AverageField<S = Recursion> = Centred<TwoPoints, S>;
