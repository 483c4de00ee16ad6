//! Displacements and rates over unknowns, whatever these are: numbers, or poses of bodies.

use bimorph_multibody::planar::Pose;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Mul, MulAssign, Sub, SubAssign};

/// Operations of an unknown that integrators require.
pub trait Unknown:
    Copy
    + Debug
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign<f64>
{
    /// 0.
    const ZERO: Self;
    /// The first of its directions that is not finite.
    fn not_finite(&self) -> Option<usize>;
}

impl Unknown for f64 {
    const ZERO: Self = 0.0;
    fn not_finite(&self) -> Option<usize> {
        (!self.is_finite()).then_some(0)
    }
}

impl Unknown for Pose {
    const ZERO: Self = Self::new(0.0, 0.0, 0.0);
    fn not_finite(&self) -> Option<usize> {
        self.iter().position(|x| !x.is_finite())
    }
}

/// Displacements and rates, or changes of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion<X = Pose> {
    /// Displacements.
    pub q: Vec<X>,
    /// Rates.
    pub v: Vec<X>,
}

impl<X: Unknown> Motion<X> {
    /// All zero.
    pub fn zeros(unknowns: usize) -> Self {
        Self { q: vec![X::ZERO; unknowns], v: vec![X::ZERO; unknowns] }
    }

    /// Takes the values of another one.
    pub fn copy(&mut self, from: &Self) {
        self.q.copy_from_slice(&from.q);
        self.v.copy_from_slice(&from.v);
    }

    /// Makes all zero.
    pub fn clear(&mut self) {
        self.q.fill(X::ZERO);
        self.v.fill(X::ZERO);
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        self.q.iter_mut().chain(&mut self.v).for_each(|x| *x *= factor);
    }

    /// Adds a multiple of another one.
    pub fn add(&mut self, factor: f64, other: &Self) {
        if factor != 0.0 {
            for (a, b) in self.q.iter_mut().zip(&other.q) {
                *a += *b * factor;
            }
            for (a, b) in self.v.iter_mut().zip(&other.v) {
                *a += *b * factor;
            }
        }
    }

    /// The first unknown that is not finite, and which direction of it.
    pub(crate) fn not_finite(&self) -> Option<(usize, usize)> {
        let pairs = self.q.iter().zip(&self.v).enumerate();
        pairs.into_iter().find_map(|(k, (q, v))| q.not_finite().or_else(|| v.not_finite()).map(|i| (k, i)))
    }
}
