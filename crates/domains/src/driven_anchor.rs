//! Anchors whose displacement and rotation are inputs.
//!
//! Stiff springs hold an anchor at its place d and at its rotation φ, x the displacement of its node and θ its rotation:
//! ```text
//! Π = ½·k·|x − d|² + ½·κ·(θ − φ)² = (½·k·|x|² + ½·κ·θ²) − (k·d·x + κ·φ·θ) + (½·k·|d|² + ½·κ·φ²)
//! ```
//! The first part is a joint to ground of the mechanism, alike in x and y, whatever the rotation. The second is that of dead loads k·d and κ·φ
//! among the inputs. All analyses have them with their derivatives. The body of an anchor has no inertia: displacements are those from
//! the drawing, not from the anchor, and other bodies feel its acceleration through the beams and dampers between them.
//!
//! The springs are a million times as stiff as the stiffest beam, so that x − d is rounding beside d. The force of an anchor follows
//! from all that acts on its body but these springs.

use super::MaterialPoint;

/// An anchor with a displacement and a rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenAnchor {
    /// Name of its node where they are inputs; none: they are those of the drawing.
    pub node: Option<String>,
    /// Its node.
    pub point: MaterialPoint,
    /// Its joint to ground.
    pub joint: u32,
    /// Stiffness of that joint along x and y (N/m), and about z (N·m/rad).
    pub stiffness: [f64; 3],
    /// Displacement and rotation of the drawing, which act as built-in strains do (m, rad).
    pub drawn: [f64; 3],
}
