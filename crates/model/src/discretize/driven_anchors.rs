//! Anchors that are driven: their place in a model, and their inputs among its sources.

use super::rigid::PlacedAnchor;
use bimorph_domains::drive::Electrics;
use bimorph_domains::driven_anchor::DrivenAnchor;
use bimorph_domains::{Input, MaterialPoint};
use bimorph_structure::ANCHOR_MOTIONS;

/// The sources with a displacement along x and y and a rotation of each anchor behind them, named `NODE.ux`, `NODE.uy` and `NODE.urz`.
pub(super) fn give_inputs(mut electrics: Electrics, driven: &[PlacedAnchor]) -> Electrics {
    let mut inputs = Vec::new();
    for (anchor, placed) in driven.iter().enumerate() {
        let Some(node) = &placed.anchor.node else { continue };
        for (direction, quantity) in ANCHOR_MOTIONS.iter().enumerate() {
            electrics.names.push(format!("{node}.{quantity}"));
            inputs.push(Input::Motion { anchor, direction });
        }
    }
    if inputs.is_empty() { electrics } else { electrics.with_inputs(inputs) }
}

/// The anchors in the finished model, with the place of each joint.
pub(super) fn placed(
    driven: Vec<PlacedAnchor>,
    joints: &[u32],
    moved: &impl Fn(MaterialPoint) -> MaterialPoint,
) -> Vec<DrivenAnchor> {
    let one = |PlacedAnchor { anchor, joint }: PlacedAnchor| DrivenAnchor {
        point: moved(anchor.point),
        joint: joints[joint],
        ..anchor
    };
    driven.into_iter().map(one).collect()
}
