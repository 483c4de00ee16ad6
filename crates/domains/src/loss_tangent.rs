//! Where derivatives of forces that depend on rates are added.

use bimorph_multibody::{BodyMatrix, Pattern};

/// Matrices over the bodies of a system, on one pattern.
#[derive(Debug)]
pub struct LossTangent<'a> {
    /// Their pattern.
    pub pattern: &'a Pattern,
    /// Derivatives with displacements.
    pub stiffness: &'a mut BodyMatrix,
    /// Derivatives with rates.
    pub damping: &'a mut BodyMatrix,
}
