//! Permanent strain of heated beams after yield: a rest offset, like thermal expansion.

use super::Assembly;
use bimorph_structure::Yield;

/// The joints of a beam that can yield, each with the length that it stands for (m); none where nothing heats it.
pub type YieldingJoints = Vec<(usize, f64)>;

/// The arms in the order of `yields`.
pub fn arms(parts: &Assembly, yields: &[Yield]) -> Vec<YieldingJoints> {
    let model = &parts.system.model;
    let of = |y: &Yield| {
        let heater = parts.heaters.iter().position(|&beam| beam == y.beam)?;
        let joints = model.joints.iter().enumerate();
        let mine = joints.filter_map(|(k, j)| {
            model.section(j).expansion.filter(|(group, _)| *group == heater).map(|(_, length)| (k, length))
        });
        Some(mine.collect())
    };
    yields.iter().map(|y| of(y).unwrap_or_default()).collect()
}

/// Strains an arm by so much more, for good (1); negative: shorter.
pub fn strain(parts: &mut Assembly, arm: &YieldingJoints, change: f64) {
    if change != 0.0 {
        for &(k, length) in arm {
            parts.system.model.joints[k].rest += length * change;
        }
    }
}
