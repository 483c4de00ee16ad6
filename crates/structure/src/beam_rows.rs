//! Straight chains of beams along a gap, by the nodes that they share.

use crate::{BeamGap, NodeId, Structure};
use std::collections::HashMap;

/// Difference of lengths [of the gap's] and of directions (rad) that is rounding of the drawing.
pub const ALIKE: f64 = 1e-6;

/// The beams at each node of a drawing.
pub struct BeamRows<'d> {
    structure: &'d Structure,
    at: HashMap<NodeId, Vec<usize>>,
}

impl<'d> BeamRows<'d> {
    /// Of a drawing.
    #[inline]
    pub fn new(structure: &'d Structure) -> Self {
        let mut at: HashMap<NodeId, Vec<usize>> = HashMap::new();
        for (index, beam) in structure.beams.iter().enumerate() {
            for node in [beam.a, beam.b] {
                at.entry(node).or_default().push(index);
            }
        }
        Self { structure, at }
    }

    /// The chain of beams from one node to another along a gap, each with true where its direction is opposite to that
    /// of the gap. `None` where no straight chain of the gap's length connects the nodes.
    #[inline]
    pub fn row(&self, gap: &BeamGap, [from, to]: [NodeId; 2]) -> Option<Vec<(usize, bool)>> {
        let (mut row, mut node, mut at) = (Vec::new(), from, 0.0);
        let within = gap.length * (1.0 + ALIKE);
        while node != to && row.len() <= self.structure.beams.len() {
            let next = |&index: &usize| {
                let beam = &self.structure.beams[index];
                let against = beam.a != node;
                let other = if against { beam.a } else { beam.b };
                let turned = beam.angle - gap.angle;
                let along = if against { -turned.cos() } else { turned.cos() };
                let fits = other != node && along > 0.0 && turned.sin().abs() < ALIKE && at + beam.length <= within;
                fits.then_some((index, against, other))
            };
            let fitting = self.at.get(&node)?.iter().filter_map(next);
            // a beam that ends where the gap does comes before those that lead on
            let (index, against, other) = fitting.min_by_key(|(index, _, other)| (*other != to, *index))?;
            row.push((index, against));
            at += self.structure.beams[index].length;
            node = other;
        }
        (node == to && (at - gap.length).abs() <= ALIKE * gap.length).then_some(row)
    }

    /// The beams that a gap follows, on both sides, as indices.
    #[inline]
    pub fn along(&self, gap: &BeamGap) -> impl Iterator<Item = usize> {
        let [a, b, c, d] = gap.nodes;
        let rows = [[a, b], [c, d]].map(|nodes| self.row(gap, nodes).unwrap_or_default());
        rows.into_iter().flatten().map(|(index, _)| index)
    }
}
