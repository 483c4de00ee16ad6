//! Model order from a band and a tolerance: the fewest segments for which the estimate holds.
//!
//! Starts from the rule of [`order`], computes the modes within the band and their estimated errors
//! ([`mode_errors`](super::mode_errors)), and takes a beam's contribution to fall with the power of its scheme in the number
//! of its segments. From the fewest segments that the band allows upwards, the beams that gain most per body get one more
//! until every mode is predicted to hold. The prediction is then computed; what fails is refined, what holds may be coarsened
//! further. Beams of equal length, section and material get equal numbers, so that symmetric mechanisms stay symmetric.
//!
//! Then beams whose strain does not matter become rigid (`rigid_beams`).
//!
//! More than 64 modes in the band, or a start of more than ten thousand segments, keep what the rule of [`order`] gives.
//!
//! No segment is longer than kh = 3: a beam's own clamped modes (kh = 4.73) then lie above the band, and no mode within the
//! band can hide between nodes.
//!
//! Reference: J. O. Dow, "A Unified Approach to the Finite Element Method and Error Analysis Procedures" (1999), for
//! refinement led by an estimate.

use super::band_modes::{MeshModes, mechanics, solve_modes};
use super::groups::Groups;
pub use super::mesh_target::{Mesh, MeshTarget};
use super::mode_errors::ModeErrors;
use super::rigid_beams::stiffen;
use crate::discretize::{DiscretizeError, order};
use crate::options::{CompileOptions, Scheme};
use bimorph_base::ErrorBudget;
use bimorph_structure::Structure;

/// Largest kh of a segment at the edge of the band.
const LONGEST: f64 = 3.0;
/// Segments beyond which it does.
pub(super) const MAX_SEGMENTS: usize = 10_000;
/// Models tried.
const MAX_PASSES: usize = 24;
/// Models without an estimate that are refined as a whole.
const MAX_BLIND: usize = 3;

/// Chooses the numbers of segments for a band.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn choose(structure: &Structure, options: &CompileOptions, band: f64) -> Result<Mesh, DiscretizeError> {
    choose_for(structure, options, &MeshTarget { band, tolerances: Vec::new(), rigid: true })
}

/// Chooses the numbers of segments for an aim.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn choose_for(structure: &Structure, options: &CompileOptions, aim: &MeshTarget) -> Result<Mesh, DiscretizeError> {
    let (bare, band) = (mechanics(structure), aim.band);
    let options = &options.with_band(Some(band));
    let groups = Groups::new(&bare.beams);
    let floor: Vec<usize> = (bare.beams.iter())
        .map(|b| options.scheme.segments((order::waves(b, band) / LONGEST).ceil().max(1.0) as usize))
        .collect();
    let mut segments = order::a_priori(&bare, options)?;
    for (n, floor) in segments.iter_mut().zip(&floor) {
        *n = (*n).max(*floor);
    }
    if segments.iter().sum::<usize>() > MAX_SEGMENTS {
        return Ok(Mesh { segments, estimated_error: None, modes_in_band: 0, passes: 0 });
    }
    let mut holds: Option<(Mesh, MeshModes)> = None;
    let mut seen: Option<MeshModes> = None;
    for passes in 1..=MAX_PASSES {
        let before = seen.as_ref().or(holds.as_ref().map(|(_, seen)| seen));
        let now = solve_modes(&bare, options, aim, &segments, before)?;
        let Some(error) = &now.error else {
            if holds.is_some() {
                break;
            }
            if now.modes > 0 && options.scheme == Scheme::Es {
                return by_another_scheme(structure, options, aim);
            }
            // modes of so few segments may be indistinguishable: use more
            let finer: Vec<usize> = segments.iter().map(|&n| options.scheme.segments(2 * n)).collect();
            if now.modes > 0 && passes <= MAX_BLIND && finer != segments && finer.iter().sum::<usize>() <= MAX_SEGMENTS
            {
                segments = finer;
                continue;
            }
            return Ok(Mesh { segments, estimated_error: None, modes_in_band: now.modes, passes });
        };
        let worst = aim.worst(options, &error.relative[..now.modes]);
        let order = Mesh { segments: segments.clone(), estimated_error: Some(worst), modes_in_band: now.modes, passes };
        let mut next = predicted(options, aim, &groups, error, now.modes, (&segments, &floor));
        let total = |n: &[usize]| n.iter().sum::<usize>();
        if options.errors().holds(worst) {
            let done = total(&next) >= total(&segments);
            holds = Some((order, now));
            seen = None;
            if done {
                break;
            }
        } else {
            no_coarser(&mut next, &segments);
            if next == segments {
                // the shares of beams leave out what modes of nearly one frequency do to each other
                next = predicted(options, aim, &groups, &error.scaled_to_whole(), now.modes, (&segments, &floor));
                no_coarser(&mut next, &segments);
            }
            if holds.as_ref().is_some_and(|(h, _)| total(&next) >= total(&h.segments)) {
                break;
            }
            if next == segments || passes == MAX_PASSES || total(&next) > MAX_SEGMENTS {
                if holds.is_some() {
                    break;
                }
                return Ok(order);
            }
            seen = Some(now);
        }
        segments = next;
    }
    let (mut order, elastic) = holds.ok_or(DiscretizeError::NothingMoves)?;
    if aim.rigid {
        stiffen(structure, &bare, options, aim, &groups, &elastic, &mut order)?;
    }
    Ok(order)
}

/// Raises the segments of every beam to those of `than`.
fn no_coarser(segments: &mut [usize], than: &[usize]) {
    for (n, than) in segments.iter_mut().zip(than) {
        *n = (*n).max(*than);
    }
}

/// The segments that E4 needs for half of the tolerance, where Es has no estimate of its own. With as many segments its
/// error is one to two times as large, with the same order. Callers compare them with twice as many.
fn by_another_scheme(
    structure: &Structure,
    options: &CompileOptions,
    aim: &MeshTarget,
) -> Result<Mesh, DiscretizeError> {
    let finer = options.with_tolerance(options.errors().confirmation()).with_scheme(Scheme::E4);
    let tolerances = aim.tolerances.iter().map(|tol| ErrorBudget::of(*tol).confirmation()).collect();
    let order = choose_for(structure, &finer, &MeshTarget { tolerances, ..aim.clone() })?;
    Ok(Mesh { estimated_error: None, ..order })
}

/// The fewest segments for which every mode is predicted to hold.
fn predicted(
    options: &CompileOptions,
    aim: &MeshTarget,
    groups: &Groups,
    error: &ModeErrors,
    modes: usize,
    (segments, floor): (&[usize], &[usize]),
) -> Vec<usize> {
    let share = |mode: usize, g: &Vec<usize>| g.iter().map(|&b| error.shares[mode][b].abs()).sum::<f64>();
    let shares: Vec<Vec<f64>> = (0..modes).map(|m| groups.0.iter().map(|g| share(m, g)).collect()).collect();
    let goals: Vec<f64> = (0..modes).map(|m| ErrorBudget::of(aim.tolerance(options, m)).prediction()).collect();
    groups.fewest(options, &shares, &goals, segments, floor)
}
