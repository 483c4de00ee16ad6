//! From a drawing to the members of a domain.

use super::approach::{Approach, MaterialPoint};
use super::domain::Domain;
use bimorph_multibody::Damper;
use bimorph_structure::{DomainElement, GapVoltage, NodeId, PlacedElement, Structure};
use nalgebra::Vector2;

/// A point along a beam that one body carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Distance from where the beam, or what lies along it, begins (m).
    pub at: f64,
    /// The material point.
    pub point: MaterialPoint,
}

/// A drawing, as domains read it.
#[derive(Clone, Copy)]
pub struct StructureView<'a, 'p> {
    /// The structure.
    pub structure: &'a Structure,
    /// The material point of a node.
    pub point: &'p dyn Fn(NodeId) -> MaterialPoint,
    /// Facing beams as SUGAR has them.
    pub chord: bool,
    /// For each beam, the points along it that its segments are joined at; empty where only nodes are known.
    pub stations: &'p [Vec<Station>],
    /// For each pair of lumped plates, the bodies whose coordinates are the states of the gas between them; empty where only nodes are known.
    pub film_states: &'p [Vec<MaterialPoint>],
}

impl<'a> StructureView<'a, '_> {
    /// Placed elements of the domain's own kind.
    pub fn placed<D: FromStructure>(&self) -> impl Iterator<Item = &'a PlacedElement> + use<'a, D> {
        self.structure.placed.iter().filter(|placed| D::ELEMENT.is_some_and(|element| placed.element == element.name))
    }

    /// The approach of node `a` towards `b` along `axis`.
    pub(super) fn approach(&self, a: NodeId, b: NodeId, axis: [f64; 2]) -> Approach {
        Approach { a: (self.point)(a), b: (self.point)(b), axis: Vector2::new(axis[0], axis[1]) }
    }
}

/// A domain whose members are drawn.
pub trait FromStructure: Domain<Given = f64> + Sized {
    /// Calls `put` for each member of the structure: its name, the voltage across it if it has a field, and itself.
    fn lay<'a>(drawing: &StructureView<'a, '_>, put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self));

    /// The element that netlists place it with, where that is its own and no other part of a drawing.
    const ELEMENT: Option<DomainElement> = None;

    /// Calls `put` for its dampers, before [`FromStructure::moved`]: damping is constant, and belongs to the mechanism.
    fn dampers(&self, put: impl FnMut(Damper)) {
        let _ = put;
    }

    /// The same with its points where `to` takes them.
    #[must_use]
    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self;
}

/// A member in its place.
#[derive(Debug, Clone)]
pub struct PlacedMember<'a, M> {
    /// Full element name.
    pub name: &'a str,
    /// The voltage across it; none: it has no field.
    pub voltage: Option<&'a GapVoltage>,
    /// The force element.
    pub member: M,
}
