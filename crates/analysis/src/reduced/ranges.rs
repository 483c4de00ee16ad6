//! The box of inputs that a reduced model is trained for, from ranges of sources.

use bimorph_domains::{Drive, System};
use bimorph_solve::reduced::InputBox;

/// How far motion exceeds the statics of what is applied at once, and how far it swings back through rest (1).
pub(super) const FROM_REST: [f64; 2] = [-0.5, 2.0];
/// Ports of which all corners of the ranges are drives of the training.
const CORNERS: usize = 6;

/// The box of inputs for ranges of sources, in the unit of each; the others are at rest.
pub fn range_inputs(system: &System, sources: &[usize], ranges: &[[f64; 2]]) -> InputBox {
    let electrics = &system.electrics;
    let mut rest = vec![0.0; electrics.sources()];
    electrics.fill_sources(&vec![0.0; electrics.ports], &mut rest);
    inputs_beside(system, &rest, (sources, ranges))
}

/// The same where the others have the values of `held`.
pub(super) fn inputs_beside(system: &System, held: &[f64], (sources, ranges): (&[usize], &[[f64; 2]])) -> InputBox {
    let electrics = &system.electrics;
    let p = ranges.len();
    let corners = if p <= CORNERS { 1usize << p } else { 2 * p + 1 };
    let end = |corner: usize, q: usize| match p <= CORNERS {
        true => (corner >> q) & 1,
        false => usize::from(corner == 2 * p || corner == 2 * q),
    };
    let drives: Vec<Drive> = (0..corners)
        .map(|corner| {
            let mut u = held.to_vec();
            for (q, range) in ranges.iter().enumerate() {
                u[sources[q]] = range[end(corner, q)];
            }
            let mut drive = electrics.drive();
            electrics.steady(&u, &mut vec![0.0; electrics.heating.states()], &mut drive);
            drive
        })
        .collect();
    let mut inputs = InputBox::around(system, &drives, FROM_REST);
    // forces of both signs go as far back as ahead
    let lowest = |k: usize| drives.iter().map(|drive| drive.inputs[k]).fold(0.0, f64::min);
    let highest = |k: usize| drives.iter().map(|drive| drive.inputs[k]).fold(0.0, f64::max);
    for input in &mut inputs.inputs {
        let of = (0..input.unit.inputs.len()).find(|k| input.unit.inputs[*k] != 0.0);
        if of.is_some_and(|k| lowest(k) < 0.0 && highest(k) > 0.0) {
            input.range[0] = -FROM_REST[1];
        }
    }
    inputs
}
