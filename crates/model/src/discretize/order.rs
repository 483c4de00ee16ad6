//! Model order before anything is computed: how many segments a beam gets.
//!
//! A chain of E4 segments of length h follows a wave of number k with the relative frequency error (kh)⁴/1440. With the
//! bending wave number at the edge of the band, k = (ρA·ω²/EI)^¼, the error stays below `tol` for
//! N = ⌈kL/(1440·tol)^¼⌉ segments. A beam longer than about a wavelength over two (kL > 3) gets at least two, so that its
//! first clamped mode has a body to move.
//!
//! Without a band only the shape decides: a slender beam gets enough segments for large static deflections.
//!
//! With a band this is where [`crate::refine::mesh_search`] starts from.

use super::error::{DiscretizeError, MAX_SEGMENTS};
use crate::options::CompileOptions;
use bimorph_base::ErrorBudget;
use bimorph_structure::{Beam, Structure};
use std::collections::HashSet;

/// Length over width above which a beam counts as slender.
const SLENDER: f64 = 8.0;
/// Segments of a slender beam when no band is given.
const STATIC_SEGMENTS: usize = 2;

/// Checks that a beam has length, section and stiffness.
///
/// # Errors
/// [`DiscretizeError::NotPositive`]
pub fn check(beam: &Beam) -> Result<(), DiscretizeError> {
    for (quantity, value) in [
        ("length", beam.length),
        ("width", beam.width),
        ("thickness", beam.thickness),
        ("Young's modulus", beam.material.youngs_modulus),
    ] {
        if value.is_nan() || value <= 0.0 {
            return Err(DiscretizeError::NotPositive { element: beam.name.clone(), quantity, value });
        }
    }
    Ok(())
}

/// Number of segments of every beam by the options.
///
/// # Errors
/// See [`check`].
pub fn a_priori(structure: &Structure, options: &CompileOptions) -> Result<Vec<usize>, DiscretizeError> {
    let held = held_at_both_ends(structure);
    let count = |(index, beam): (usize, &Beam)| {
        check(beam)?;
        let least = if held.contains(&index) { 2 } else { 1 };
        let count =
            options.segments.unwrap_or_else(|| segments(beam, options.band, options.errors().requested()).max(least));
        Ok(options.scheme.segments(count))
    };
    structure.beams.iter().enumerate().map(count).collect()
}

/// The beams with both ends anchored: nothing of a single segment moves there.
fn held_at_both_ends(structure: &Structure) -> HashSet<usize> {
    let mut anchored = vec![false; structure.nodes.len()];
    for support in structure.supports.iter().filter(|support| support.held == [true; 3]) {
        anchored[support.node.0] = true;
    }
    let held = |(_, beam): &(usize, &Beam)| [beam.a, beam.b].iter().all(|n| anchored[n.0]);
    structure.beams.iter().enumerate().filter(held).map(|(index, _)| index).collect()
}

/// kL at the edge of a band (Hz).
pub fn waves(beam: &Beam, band: f64) -> f64 {
    let omega = 2.0 * std::f64::consts::PI * band;
    // ρA/EI = 12ρ/(E·w²)
    let inverse = 12.0 * beam.material.density / (beam.material.youngs_modulus * beam.width * beam.width);
    (inverse * omega * omega).powf(0.25) * beam.length
}

/// Number of E4 segments of a beam that [`check`] has passed.
pub fn segments(beam: &Beam, band: Option<f64>, tol: f64) -> usize {
    let Some(band) = band else {
        return if beam.length / beam.width > SLENDER { STATIC_SEGMENTS } else { 1 };
    };
    let kl = waves(beam, band);
    // one beam beyond the limit of all is enough to be refused
    let count = ErrorBudget::of(tol).parts(kl, 1440.0).ceil().clamp(1.0, MAX_SEGMENTS as f64 + 1.0) as usize;
    if kl > 3.0 { count.max(2) } else { count }
}
