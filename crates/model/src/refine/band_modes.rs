//! Evaluation of one mesh: the modes of its model within the band, and their estimated errors.
//!
//! Each evaluation starts the iteration of the modes from the shapes of the previous mesh, transferred.

use super::mesh_target::MeshTarget;
use super::mode_errors::{ModeErrors, of_modes};
use super::transfer::carried;
use crate::discretize::{Assembly, DiscretizeError, discretize_with};
use crate::options::CompileOptions;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_solve::subspace;
use bimorph_structure::Structure;

/// Modes within the band beyond which the rule of [`order`] stands as it is.
const MAX_MODES: usize = 64;

/// A model that was computed.
pub(super) struct MeshModes {
    pub(super) parts: Assembly,
    pub(super) lambda: Vec<f64>,
    pub(super) shapes: Vec<Vec<Pose>>,
    pub(super) modes: usize,
    pub(super) error: Option<ModeErrors>,
}

/// The drawing without what has no part in the modes of the drawn geometry.
pub(super) fn mechanics(structure: &Structure) -> Structure {
    let mut bare = Structure {
        nodes: structure.nodes.clone(),
        beams: structure.beams.clone(),
        masses: structure.masses.clone(),
        links: structure.links.clone(),
        supports: structure.supports.clone(),
        springs: structure.springs.clone(),
        ..Structure::default()
    };
    bare.supports.iter_mut().for_each(|support| support.motion = None);
    for beam in &mut bare.beams {
        beam.heater = None;
        beam.temperature = None;
        beam.material.stress = 0.0;
    }
    bare
}

/// Modes within the band and their errors; starts from the shapes of a model with other segments.
pub(super) fn solve_modes(
    structure: &Structure,
    options: &CompileOptions,
    aim: &MeshTarget,
    segments: &[usize],
    before: Option<&MeshModes>,
) -> Result<MeshModes, DiscretizeError> {
    let parts = discretize_with(structure, options, segments)?;
    let (modes, lambda, shapes, error) = modes_in_band(structure, options, aim, &parts, before).unwrap_or_default();
    Ok(MeshModes { parts, lambda, shapes, modes, error })
}

type ModesInBand = (usize, Vec<f64>, Vec<Vec<Pose>>, Option<ModeErrors>);

fn modes_in_band(
    structure: &Structure,
    options: &CompileOptions,
    aim: &MeshTarget,
    parts: &Assembly,
    before: Option<&MeshModes>,
) -> Option<ModesInBand> {
    let (system, model) = (&parts.system, &parts.system.model);
    let n = system.bodies();
    let mut k = BodyMatrix::new(&model.pattern);
    let (rest, mut residual) = (vec![Pose::zeros(); n], vec![Pose::zeros(); n]);
    system.tangent(&rest, &system.electrics.drive(), &mut k, &mut residual);
    let shifted = |sigma: f64| {
        let mut a = k.clone();
        for (j, block) in a.diagonal.iter_mut().enumerate() {
            for i in 0..DOF {
                block[(i, i)] -= sigma * model.mass(j)[i];
            }
        }
        model.project_matrix(&mut a);
        a
    };
    let edge = (std::f64::consts::TAU * aim.band).powi(2);
    let modes = shifted(edge).factor(&model.pattern).ok()?.negative;
    if modes == 0 || modes > MAX_MODES {
        return None;
    }
    let mut shift = 0.0;
    let mut factor = shifted(shift);
    if factor.factor(&model.pattern).is_err() {
        shift = -1e-3 * edge;
        factor = shifted(shift);
        factor.factor(&model.pattern).ok()?;
    }
    let massive: usize = (0..n).map(|j| model.mass(j).iter().filter(|m| **m > 0.0).count()).sum();
    let block = (modes + (4 + modes / 2).min(12)).min(massive);
    let fresh = subspace::start(n, block, system.length_scale);
    let start = match before {
        Some(before) if before.shapes.len() >= modes => {
            let mut start: Vec<Vec<Pose>> =
                (before.shapes.iter().take(block)).map(|x| carried(structure, &before.parts, parts, x, true)).collect();
            start.extend(fresh.into_iter().skip(start.len()));
            start
        }
        _ => fresh,
    };
    // far below the errors to be reported, which are twice as large in λ
    let tightest = (0..modes).map(|m| aim.tolerance(options, m)).fold(options.errors().requested(), f64::min);
    let settled = (0.05 * tightest).clamp(1e-9, 1e-3);
    let found = subspace::iterate(model, (&factor, shift), start, modes, settled)?;
    // two more than wanted, to separate the highest wanted one from its neighbours
    let some = (modes + 2).min(found.lambda.len());
    let rigid = parts.beams.iter().any(|points| points.len() == 2 && points[0].body == points[1].body);
    let error = if rigid {
        None // compared with the elastic model instead
    } else {
        of_modes(structure, options, parts, (&factor, shift), &found.lambda[..some], &found.shapes[..some])
    };
    Some((modes, found.lambda, found.shapes, error))
}
