//! Members that leave the drawing plane. Whether one can be left out is known once everything is drawn:
//!
//! * between two anchored nodes it holds nothing that moves, and is left out;
//! * a post, normal to the plane and not longer than it is thick, joins what lies above each other: a rigid connection;
//! * any other belongs to a spatial model, and is an error.

use super::super::diagnostic_sink::{DiagnosticSink, Reported};
use super::super::drawing::{Fact, StructureBuilder, Upright};
use super::arguments::ElementSite;
use bimorph_structure::{Link, NodeId};

/// How far the direction of a post may be from the normal of the plane, as a part of its length (1).
const NORMAL: f64 = 1e-6;

impl ElementSite<'_, '_> {
    /// True when a beam of this element leaves the drawing plane, or its section is tilted against it.
    pub(super) fn leaves_plane(&self) -> bool {
        !self.instance.rotation.x_in_plane() || self.instance.rotation.side().is_none()
    }

    /// Keeps a member that leaves the plane until all anchors are known; `offset` is the way from its first node to its
    /// second (m), global axes.
    pub(super) fn upright(
        &mut self,
        name: String,
        nodes: [NodeId; 2],
        width: f64,
        offset: [f64; 3],
    ) -> Result<(), Reported> {
        let (length, thickness) = (self.positive("l")?, self.positive("h")?);
        let material = self.material()?;
        let thin = width.min(thickness);
        let [x, y, _] = self.instance.rotation.x_axis();
        self.drawing.lay(self.instance.span, &nodes, &[[0.0; 2], [offset[0], offset[1]]]);
        self.drawing.upright.push(Upright {
            span: self.instance.span,
            name,
            nodes,
            post: x.hypot(y) < NORMAL && length <= thin,
            // as a cantilever, across its weaker axis
            stiffness: 0.25 * material.youngs_modulus * width.max(thickness) * (thin / length).powi(3),
            tilted: self.instance.rotation.x_in_plane(),
        });
        Ok(())
    }
}

/// Decides on every member that leaves the plane.
pub(crate) fn settle(drawing: &mut StructureBuilder, sink: &mut DiagnosticSink) {
    if drawing.upright.is_empty() {
        return;
    }
    let mut anchored = vec![false; drawing.structure.nodes.len()];
    for support in drawing.structure.supports.iter().filter(|support| support.held == [true; 3]) {
        anchored[support.node.0] = true;
    }
    for Upright { span, name, nodes: [a, b], post, stiffness, tilted } in std::mem::take(&mut drawing.upright) {
        if anchored[a.0] && anchored[b.0] {
            drawing.note(Fact::BetweenAnchors, span);
        } else if post {
            drawing.note_number(Fact::Post, span, stiffness);
            drawing.mechanical(&[a, b]);
            drawing.structure.links.push(Link { name, a, b });
        } else if tilted {
            let message = format!("the section of `{name}` is tilted against the drawing plane");
            sink.error("E061", span, message, "turn it about its axis (`ox`) by quarter turns only");
        } else {
            let message = format!("`{name}` leaves the drawing plane");
            let help = "models are planar (x, y, rotation about z): turn it with `oz` only";
            sink.error("E061", span, message, help);
        }
    }
}
