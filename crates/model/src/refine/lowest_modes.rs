//! The mesh for the lowest modes, by their number.
//!
//! The highest requested mode sets the band: the frequency at which the number of modes below it, which is the number
//! of negative pivots of K − ω²M (Sylvester), reaches the requested number. It is found by bisection on a first mesh.
//! Then [`mesh_search`] chooses the mesh for that band, and the band is determined again on it
//! until the requested modes lie within.
//!
//! On a mesh of few segments higher modes are too high or missing, and axial motions of slender beams are among the lowest. Where the frequency is below nine
//! tenths on twice the segments, these are the first mesh: a band of axial motions takes thousands of segments of a beam with a slenderness of 10⁸.

use super::band_modes::mechanics;
use super::mesh_search;
use super::mesh_target::{Mesh, MeshTarget};
use crate::discretize::{Assembly, DiscretizeError, discretize_with, order};
use crate::options::CompileOptions;
use bimorph_base::ErrorBudget;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::forces::add_inertia;
use bimorph_multibody::planar::Pose;
use bimorph_structure::Structure;
use std::f64::consts::TAU;

/// Meshes of which the band is looked up, at most.
const MAX_PASSES: usize = 12;
/// Fraction by which the band lies above the highest requested mode.
const ABOVE: f64 = 0.01;
/// Fraction of the frequency of a mesh below which that of twice the segments replaces it (1).
const FAR_BELOW: f64 = 0.9;
/// Frequencies within which modes are looked for (Hz).
const LOWEST: f64 = 1e-6;
const HIGHEST: f64 = 1e13;

/// Chooses the numbers of segments for the `count` lowest modes about the drawn geometry.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn choose(structure: &Structure, options: &CompileOptions, count: usize) -> Result<Mesh, DiscretizeError> {
    let bare = mechanics(structure);
    let options = &options.with_band(None);
    let mut segments = order::a_priori(&bare, options)?;
    let mut chosen = None;
    for _ in 0..MAX_PASSES {
        let parts = discretize_with(&bare, options, &segments)?;
        let Some(frequency) = highest_of(&parts, count) else {
            let finer: Vec<usize> = segments.iter().map(|&n| options.scheme.segments(2 * n)).collect();
            if finer == segments || finer.iter().sum::<usize>() > mesh_search::MAX_SEGMENTS {
                break;
            }
            segments = finer;
            continue;
        };
        if let Some(finer) = far_below((&bare, options), &segments, frequency, count)? {
            segments = finer;
            continue;
        }
        let tolerances = vec![options.errors().modes(); count];
        let aim = MeshTarget { band: frequency * (1.0 + ABOVE), tolerances, rigid: false };
        let order =
            mesh_search::choose_for(structure, options, &aim)?.with_estimate_times(ErrorBudget::of_modes_estimate(1.0));
        let done = order.estimated_error.is_none() || order.modes_in_band >= count;
        segments.clone_from(&order.segments);
        chosen = Some(order);
        if done {
            break;
        }
    }
    Ok(chosen.unwrap_or(Mesh { segments, estimated_error: None, modes_in_band: 0, passes: 0 }))
}

/// Twice the segments, where the `count`-th mode is at a fraction of its `frequency` (Hz) there.
fn far_below(
    (bare, options): (&Structure, &CompileOptions),
    segments: &[usize],
    frequency: f64,
    count: usize,
) -> Result<Option<Vec<usize>>, DiscretizeError> {
    let finer: Vec<usize> = segments.iter().map(|&n| options.scheme.segments(2 * n)).collect();
    if finer == segments || finer.iter().sum::<usize>() > mesh_search::MAX_SEGMENTS {
        return Ok(None);
    }
    let parts = discretize_with(bare, options, &finer)?;
    Ok(highest_of(&parts, count).filter(|of_finer| *of_finer < FAR_BELOW * frequency).map(|_| finer))
}

/// Frequency of the `count`-th mode as drawn (Hz), to half of [`ABOVE`]; none where the mesh has no such mode.
fn highest_of(parts: &Assembly, count: usize) -> Option<f64> {
    let (system, model) = (&parts.system, &parts.system.model);
    let rest = vec![Pose::zeros(); system.bodies()];
    let mut stiffness = BodyMatrix::new(&model.pattern);
    let mut residual = rest.clone();
    system.tangent(&rest, &system.electrics.drive(), &mut stiffness, &mut residual);
    let mut shifted = stiffness.clone();
    let mut below = |frequency: f64| {
        shifted.clone_from(&stiffness);
        add_inertia(model, -(TAU * frequency).powi(2), 0.0, &mut shifted);
        model.project_matrix(&mut shifted);
        // a zero pivot: the shift is the frequency of a mode; a nearby shift is not
        shifted.factor(&model.pattern).map_or(0, |inertia| inertia.negative)
    };
    let (mut low, mut high) = (LOWEST, 1e3);
    while below(high) < count {
        (low, high) = (high, 30.0 * high);
        if high > HIGHEST {
            return None;
        }
    }
    while high > low * (1.0 + 0.5 * ABOVE) {
        let middle = (low * high).sqrt();
        if below(middle) < count { low = middle } else { high = middle }
    }
    Some(high)
}
