//! Node positions: SUGAR's walk over the drawing (its `position.c`), and the checks of what it found.
//!
//! The first mechanical node by order of appearance goes to the origin; a depth-first walk lets each element carry its
//! other nodes along. A part that is not reached starts at the origin again. Nothing forces a loop of elements to
//! close: stiffness comes from lengths and angles, not from positions, so a loop that stays open is worth a warning.

use super::diagnostic_sink::DiagnosticSink;
use super::drawing::StructureBuilder;
use super::value::short;

/// A loop is open when it misses by more than this part of its largest element (1).
const OPEN_LOOP: f64 = 1e-6;
/// Nodes nearer to each other than this part of the drawing's size are in one place (1).
const ROUNDING: f64 = 1e-9;
/// Most open loops, and most unplaced parts, reported individually.
const MAX_REPORTED: usize = 3;

#[derive(Clone, Copy, PartialEq)]
enum PlacingState {
    /// Touched by no element that places.
    None,
    Unplaced,
    Waiting,
    Done,
}

/// Fills in the positions of all nodes, the lengths of beams that were left to be measured, and the warnings.
pub(crate) fn place(drawing: &mut StructureBuilder, sink: &mut DiagnosticSink) {
    let starts = walk(drawing);
    if unplaced_nodes(drawing, sink) {
        return;
    }
    unconnected_parts(drawing, &starts, sink);
    open_loops(drawing, sink);
    measure(drawing, sink);
}

/// Places every node; answers the nodes that started at the origin.
fn walk(drawing: &mut StructureBuilder) -> Vec<usize> {
    let mut nodes = std::mem::take(&mut drawing.structure.nodes);
    let mut marks = vec![PlacingState::None; nodes.len()];
    // the elements of each node, one node after the other
    let mut start = vec![0; nodes.len() + 1];
    let of = |placement| drawing.placed_by(placement);
    for (node, _) in drawing.placements.iter().flat_map(of) {
        start[node.0 + 1] += 1;
        marks[node.0] = PlacingState::Unplaced;
    }
    for k in 0..nodes.len() {
        start[k + 1] += start[k];
    }
    let (mut at, mut elements) = (start.clone(), vec![0; start[nodes.len()]]);
    for (index, placement) in drawing.placements.iter().enumerate() {
        for (node, _) in of(placement) {
            elements[at[node.0]] = index;
            at[node.0] += 1;
        }
    }
    let mut starts = Vec::new();
    for first in 0..nodes.len() {
        if marks[first] != PlacingState::Unplaced {
            continue;
        }
        starts.push(first);
        marks[first] = PlacingState::Waiting;
        let mut stack = vec![first];
        while let Some(node) = stack.pop() {
            marks[node] = PlacingState::Done;
            for &element in &elements[start[node]..start[node + 1]] {
                let placed = of(&drawing.placements[element]);
                // SUGAR takes the last node of the element that is done.
                let Some((known, from)) = placed.iter().rfind(|(n, _)| marks[n.0] == PlacingState::Done) else {
                    continue;
                };
                let at = nodes[known.0].position;
                for (other, offset) in placed {
                    if marks[other.0] == PlacingState::Unplaced {
                        nodes[other.0].position = [at[0] + offset[0] - from[0], at[1] + offset[1] - from[1]];
                        marks[other.0] = PlacingState::Waiting;
                        stack.push(other.0);
                    }
                }
            }
        }
    }
    drawing.structure.nodes = nodes;
    starts
}

/// Reports nodes that only beams and links without a length touch: nothing says where they lie.
fn unplaced_nodes(drawing: &StructureBuilder, sink: &mut DiagnosticSink) -> bool {
    let mut placed = vec![false; drawing.structure.nodes.len()];
    for (node, _) in drawing.placements.iter().flat_map(|p| drawing.placed_by(p)) {
        placed[node.0] = true;
    }
    let beams = drawing.structure.beams.iter().flat_map(|b| [b.a, b.b]);
    let links = drawing.structure.links.iter().flat_map(|l| [l.a, l.b]);
    let mut found = false;
    for node in beams.chain(links).filter(|n| !placed[n.0]) {
        found = true;
        let message = format!("nothing says where node `{}` lies", drawing.structure.nodes[node.0].name);
        let help = "give the beam or link that leads to it its `l=`, or place it with `pos`";
        sink.error("E065", drawing.first_named[node.0], message, help);
    }
    found
}

fn unconnected_parts(drawing: &StructureBuilder, starts: &[usize], sink: &mut DiagnosticSink) {
    let later = starts.get(1..).unwrap_or(&[]);
    for &start in later.iter().take(MAX_REPORTED) {
        let name = &drawing.structure.nodes[start].name;
        let first = &drawing.structure.nodes[starts[0]].name;
        let more =
            if later.len() > MAX_REPORTED { format!(" ({} such parts in all)", later.len()) } else { String::new() };
        let message = format!("the part with node `{name}` is not connected to node `{first}`{more}");
        let help =
            format!("it is drawn from the origin again; connect it, or place it with `pos * [{first} {name}] [x= y=]`");
        sink.warning("W010", drawing.first_named[start], message, help);
    }
}

/// Warns of elements that miss the drawn place of a node.
pub(crate) fn open_loops(drawing: &StructureBuilder, sink: &mut DiagnosticSink) {
    let mut open = Vec::new();
    for placement in &drawing.placements {
        let placed = drawing.placed_by(placement);
        let first = drawing.structure.nodes[placed[0].0.0].position;
        let misses = placed.iter().map(|(node, offset)| {
            let at = drawing.structure.nodes[node.0].position;
            [at[0] - first[0] - offset[0], at[1] - first[1] - offset[1]]
        });
        // Sums of many offsets round by a few units in the last place of the farthest position.
        let rounding = 1e-12 * (first[0].abs() + first[1].abs());
        if misses.clone().all(|miss| miss[0].abs() + miss[1].abs() <= rounding) {
            continue;
        }
        let largest = placed.iter().map(|(_, o)| o[0].hypot(o[1])).fold(0.0, f64::max);
        let worst = misses.fold([0.0, 0.0], |a: [f64; 2], b| if b[0].hypot(b[1]) > a[0].hypot(a[1]) { b } else { a });
        if worst[0].hypot(worst[1]) > OPEN_LOOP * largest + rounding {
            open.push((placement.span, worst));
        }
    }
    for (span, miss) in open.iter().take(MAX_REPORTED) {
        let more =
            if open.len() > MAX_REPORTED { format!(" ({} such elements in all)", open.len()) } else { String::new() };
        let message = format!(
            "this element does not reach the drawn place of its node: it misses by x = {} m, y = {} m{more}",
            short(miss[0]),
            short(miss[1])
        );
        let help = "the loop it closes stays open as drawn; check lengths and angles around it";
        sink.warning("W011", *span, message, help);
    }
}

/// Length and direction of beams without `l=`, from the positions of their nodes.
fn measure(drawing: &mut StructureBuilder, sink: &mut DiagnosticSink) {
    // what sums of offsets leave between two nodes in one place
    let rounding = if drawing.unmeasured.is_empty() { 0.0 } else { ROUNDING * drawing.structure.extent() };
    for unmeasured in &drawing.unmeasured {
        let beam = &mut drawing.structure.beams[unmeasured.beam];
        let (a, b) = (drawing.structure.nodes[beam.a.0].position, drawing.structure.nodes[beam.b.0].position);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        beam.length = dx.hypot(dy);
        beam.angle = dy.atan2(dx);
        if beam.length <= rounding {
            let message = format!("`{}` has no length, and its nodes have no distance", beam.name);
            sink.error("E064", unmeasured.span, message, "give `l=`, or place its nodes with `pos`");
        }
    }
}
