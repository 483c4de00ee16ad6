//! A dashpot: a linear damper between a node and the ground.

use super::approach::MaterialPoint;
use super::domain::Domain;
use super::from_structure::{FromStructure, StructureView};
use bimorph_multibody::planar::JointFrame;
use bimorph_multibody::{BodyId, Damper};
use bimorph_structure::{DomainElement, GapVoltage};
use nalgebra::{Vector2, Vector3};

/// A dashpot.
#[derive(Debug, Clone, PartialEq)]
pub struct Dashpot {
    /// Where it holds its body.
    pub point: MaterialPoint,
    /// Its local x axis, a unit vector.
    pub axis: Vector2<f64>,
    /// Force per rate along local x and y, moment per rate about z (N·s/m, N·s/m, N·m·s).
    pub coefficients: Vector3<f64>,
}

impl FromStructure for Dashpot {
    const ELEMENT: Option<DomainElement> = Some(DomainElement::DASHPOT);

    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for placed in drawing.placed::<Self>() {
            let point = (drawing.point)(placed.nodes[0]);
            let axis = Vector2::new(placed.angle.cos(), placed.angle.sin());
            put(&placed.name, None, Self { point, axis, coefficients: Vector3::from_row_slice(&placed.values) });
        }
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { point: to(self.point), ..self }
    }

    fn dampers(&self, mut put: impl FnMut(Damper)) {
        let frame = JointFrame { arm_a: self.point.arm, arm_b: Vector2::zeros(), axis: self.axis };
        put(Damper { a: self.point.body, b: BodyId::Ground, frame, coefficients: self.coefficients });
    }
}

impl Domain for Dashpot {
    type Given = f64;

    fn is_gap(&self) -> bool {
        false
    }

    fn is_active(&self, _: f64) -> bool {
        false
    }

    fn bodies(&self, _: impl FnMut(BodyId)) {}
}
