//! Effect of the options on a beam's section: a bar, with or without shear and rotary inertia.

use super::scheme::{Bar, POINT_EXCESS};
use bimorph_structure::Beam;

/// Shear coefficient of a rectangular section: G·As = κ·G·A.
pub const SHEAR_COEFFICIENT: f64 = 5.0 / 6.0;

/// The bar that models a beam: Euler–Bernoulli unless the options enable shear or rotary inertia.
pub fn bar(beam: &Beam, shear: bool, rotary: bool) -> Bar {
    let m = &beam.material;
    let area = beam.width * beam.thickness;
    let inertia = beam.thickness * beam.width.powi(3) / 12.0;
    Bar {
        length: beam.length,
        ea: m.youngs_modulus * area,
        ei: m.youngs_modulus * inertia,
        shear: if shear { shear_flexibility(beam) } else { 0.0 },
        line_mass: m.density * beam.width * beam.thickness,
        rotary: if rotary { beam.width * beam.width / 12.0 } else { 0.0 },
        end_excess: [POINT_EXCESS; 2],
    }
}

/// Shear flexibility 1/(G·As) of a beam's section (1/N).
fn shear_flexibility(beam: &Beam) -> f64 {
    let m = &beam.material;
    let shear_modulus = m.shear_modulus.unwrap_or_else(|| m.youngs_modulus / (2.0 * (1.0 + m.poisson)));
    1.0 / (SHEAR_COEFFICIENT * shear_modulus * beam.width * beam.thickness)
}
