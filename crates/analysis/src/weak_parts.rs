//! Weakly constrained parts: the beams that hold them are so slender that rounding hides their stiffness. Some netlists place one part
//! beside another with such beams.
//!
//! The stiffness of such a beam is below the rounding of the stiffness that it joins. The equilibrium of the part is undetermined in double
//! precision. The part is held where it is drawn, by springs to the ground, and the force that they bear is reported.

use bimorph_base::sets::Sets;
use bimorph_domains::System;
use bimorph_multibody::planar::{Block, Pose};
use bimorph_multibody::{BodyId, BodyMatrix};

/// Bending stiffness of a joint, as a fraction of the largest, below which it holds nothing (1): rounding of the stiffness is 1e-16 of that, times
/// what elimination loses.
const WEAK: f64 = 1e-12;
/// Stiffness of what holds a part, as a fraction of the largest of a body (1).
const HOLDS: f64 = 1e-3;

/// The system with its weakly held parts held, and for each a body of it; none where there is no such part.
pub(super) fn held(system: &System) -> Option<(System, Vec<usize>)> {
    let model = &system.model;
    let ground = model.bodies.len();
    let bends = |k: usize| model.section(&model.joints[k]).stiffness.0[5];
    let stiffest = (0..model.joints.len()).map(bends).fold(0.0, f64::max);
    let index = |id: BodyId| if let BodyId::Free(k) = id { k } else { ground };
    let (mut firmly, mut weak) = (Sets::new(ground + 1), false);
    for (k, joint) in model.joints.iter().enumerate() {
        let (a, b) = joint.bodies();
        // a joint that resists no rotation is a pin, and meant
        if bends(k) == 0.0 || bends(k) > WEAK * stiffest {
            firmly.join(index(a), index(b));
        } else {
            weak = true;
        }
    }
    for (k, _) in model.held() {
        firmly.join(k, ground);
    }
    if !weak {
        return None;
    }
    // the last body of each part, which has more than one; pieces of the slender beams themselves have one
    let mut parts = std::collections::BTreeMap::new();
    for k in 0..ground {
        if !firmly.together(k, ground) {
            let part = parts.entry(firmly.first(k)).or_insert((k, 0));
            *part = (k, part.1 + 1);
        }
    }
    let mut last: Vec<usize> = parts.into_values().filter(|(_, bodies)| *bodies > 1).map(|(last, _)| last).collect();
    last.sort_unstable();
    if last.is_empty() {
        return None;
    }
    let (zeros, mut tangent) = (vec![Pose::zeros(); ground], BodyMatrix::new(&model.pattern));
    system.tangent(&zeros, &system.electrics.drive(), &mut tangent, &mut zeros.clone());
    let largest = |of: &dyn Fn(&Block) -> f64| HOLDS * tangent.diagonal.iter().map(of).fold(0.0, f64::max);
    // half of the trace does not depend on the directions of the axes
    let springs = [largest(&|block| 0.5 * (block[(0, 0)] + block[(1, 1)])), largest(&|block| block[(2, 2)])];
    Some((System { model: model.with_springs_to_ground(&last, springs), ..system.clone() }, last))
}

/// Sentences about parts that are held, with the force on each at `q` of the system that holds them.
pub(super) fn sentences(system: &System, held: &System, parts: &[usize], q: &[Pose]) -> Vec<String> {
    let springs = &held.model.joints[system.model.joints.len()..];
    let one = |(&body, joint): (&usize, &bimorph_multibody::section::PackedJoint)| {
        let force = held.model.section(joint).stiffness.0[0] * q[body].x.hypot(q[body].y);
        format!(
            "the part with body \"{}\" is held by beams so slender that rounding hides their stiffness; the net load on it is {force:.1e} N",
            system.model.bodies[body].name
        )
    };
    parts.iter().zip(springs).map(one).collect()
}
