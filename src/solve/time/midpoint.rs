//! The implicit midpoint rule: order 2, A-stable, symplectic. Forces are taken once, in the middle of the step's chord.
//! Energy is kept on average, but in a stiff nonlinear structure fast axial motion exchanges it with the slow one.
//!
//! Reference: E. Hairer, C. Lubich, G. Wanner, "Geometric Numerical Integration" (2006), §II.1.2.

use super::centred::{Centred, Rule};
use crate::solve::linear::Recursion;

/// The middle of the chord.
#[derive(Debug, Clone)]
pub struct MiddlePoint;

impl Rule for MiddlePoint {
    const POINTS: &'static [(f64, f64)] = &[(1.0, 0.5)];
}

/// The method with its storage.
pub type Midpoint<S = Recursion> = Centred<MiddlePoint, S>;
