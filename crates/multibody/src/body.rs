//! A rigid body: name, mass, gas drag, held directions. Ninety-six bytes, since a mechanism may have a million of them.

use super::planar::{Block, Pose};
use nalgebra::{Matrix3, Vector2};
use std::fmt;
use std::sync::Arc;

/// A rigid body. Coordinates are those of its centre of mass, so that the mass matrix is constant and diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name for messages: the node or the beam segment it stands for.
    pub name: BodyName,
    /// Centre of mass as drawn (m).
    pub center: Vector2<f64>,
    /// Mass (kg); 0 for a body that only joints hold.
    pub mass: f64,
    /// Moment of inertia about the centre of mass (kg·m²).
    pub inertia: f64,
    /// Gas damping.
    pub drag: Drag,
    /// Projector onto the directions that supports leave free; none: all.
    pub free: Option<Box<Block>>,
}

impl Body {
    /// The mass matrix' diagonal.
    #[inline]
    pub fn mass_diagonal(&self) -> Pose {
        Pose::new(self.mass, self.mass, self.inertia)
    }
}

/// A name that the bodies of one beam share, with the number of the segment: `beam[3]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BodyName {
    whole: Arc<str>,
    segment: Option<u32>,
}

impl BodyName {
    /// Segment `number` of `whole`.
    #[inline]
    pub fn segment(whole: &Arc<str>, number: usize) -> Self {
        Self { whole: Arc::clone(whole), segment: u32::try_from(number).ok() }
    }
}

impl<S: AsRef<str>> From<S> for BodyName {
    fn from(whole: S) -> Self {
        Self { whole: Arc::from(whole.as_ref()), segment: None }
    }
}

impl fmt::Display for BodyName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.segment {
            Some(number) => write!(f, "{}[{number}]", self.whole),
            None => f.write_str(&self.whole),
        }
    }
}

/// Gas drag of a rigid body about its drawn centre of mass: Stokes drag in proportion to a distributed amount, whose
/// zeroth, first and second moments are all that acts on a rigid body. Force = −matrix · rate.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Drag {
    /// On translation (N·s/m).
    pub amount: f64,
    /// First moment about the centre of mass (N·s).
    pub first: Vector2<f64>,
    /// Second moment about the centre of mass: on rotation (N·m·s).
    pub second: f64,
}

impl Drag {
    /// The symmetric matrix of force per rate, (x, y, θ).
    #[inline]
    pub fn matrix(&self) -> Block {
        let (c, s) = (self.amount, self.first);
        Matrix3::new(c, 0.0, -s.y, 0.0, c, s.x, -s.y, s.x, self.second)
    }

    /// Matrix times rate.
    #[inline]
    pub fn force(&self, v: &Pose) -> Pose {
        let (c, s) = (self.amount, self.first);
        Pose::new(c * v.x - s.y * v.z, c * v.y + s.x * v.z, -s.y * v.x + s.x * v.y + self.second * v.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body takes 96 bytes, and its name prints as the beam and the number of the segment.
    #[test]
    fn small_and_named() {
        assert_eq!(size_of::<Body>(), 96);
        let beam: Arc<str> = Arc::from("hot");
        assert_eq!(BodyName::segment(&beam, 3).to_string(), "hot[3]");
        assert_eq!(BodyName::from("tip").to_string(), "tip");
    }

    /// `force` is the product with `matrix`, in the same bits.
    #[test]
    fn force_is_the_matrix_times_the_rate() {
        let drag = Drag { amount: 3e-7, first: Vector2::new(2e-12, -5e-12), second: 7e-17 };
        let v = Pose::new(0.3, -0.7, 11.0);
        assert_eq!(drag.force(&v), drag.matrix() * v);
    }
}
