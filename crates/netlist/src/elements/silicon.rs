//! Elastic constants of a beam of single-crystal silicon, from its direction on the wafer.
//!
//! With the compliances s of the cubic crystal, J = s₁₁ − s₁₂ − s₄₄/2, the direction d of the beam and the direction n across it in the
//! plane of the wafer, both in crystal axes,
//! ```text
//! 1/E = s₁₁ − 2·J·(d₁²d₂² + d₂²d₃² + d₃²d₁²)      1/G = s₄₄ + 4·J·(d₁²n₁² + d₂²n₂² + d₃²n₃²)
//! ```
//! G is that of bending in the plane. ν is the contraction across the thickness, ν = −(s₁₂ + J·Σdᵢ²mᵢ²)·E with the normal m of the wafer.
//! Beams that lie along no symmetry axis also shear when they are stretched, which is left out.
//!
//! Source: M. A. Hopcroft, W. D. Nix, T. W. Kenny, "What is the Young's modulus of silicon?", J. MEMS 19 (2010) 229–238:
//! C₁₁ = 165.7 GPa, C₁₂ = 63.9 GPa, C₄₄ = 79.6 GPa, lightly doped, at room temperature. A layer may give others, as curves over temperature too: those of another doping, or of
//! another cubic crystal. They are taken at its ambient temperature.

use super::super::diagnostic_sink::Reported;
use super::arguments::ElementSite;
use bimorph_structure::Material;
use std::f64::consts::FRAC_1_SQRT_2;

/// Elastic constants C₁₁, C₁₂, C₄₄ (Pa).
const STIFFNESS: [f64; 3] = [165.7e9, 63.9e9, 79.6e9];
/// Their names in layers.
const CONSTANTS: [&str; 3] = ["C11", "C12", "C44"];

/// A direction in crystal axes, of length 1.
type CrystalDirection = [f64; 3];

/// A wafer: where its crystal axes lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wafer {
    /// Along the flat, across it in the plane, and normal to the plane.
    axes: [CrystalDirection; 3],
    /// Angle from x of the drawing to the flat (rad).
    angle: f64,
    /// C₁₁, C₁₂, C₄₄ (Pa).
    stiffness: [f64; 3],
}

/// Elastic constants of a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ElasticConstants {
    /// Young's modulus along the beam (Pa).
    pub(super) youngs_modulus: f64,
    /// Shear modulus in the plane of the wafer (Pa).
    shear_modulus: f64,
    /// Contraction across the thickness over stretch (1).
    poisson: f64,
}

impl Wafer {
    /// A (100) or (111) wafer, whose flat lies along ⟨110⟩.
    fn new(plane: f64, angle: f64) -> Option<Self> {
        const HALF: f64 = FRAC_1_SQRT_2;
        let flat = [HALF, -HALF, 0.0];
        let (across, normal) = if plane == 100.0 {
            ([HALF, HALF, 0.0], [0.0, 0.0, 1.0])
        } else if plane == 111.0 {
            let (sixth, third) = (f64::sqrt(1.0 / 6.0), f64::sqrt(1.0 / 3.0));
            ([sixth, sixth, -2.0 * sixth], [third; 3])
        } else {
            return None;
        };
        Some(Self { axes: [flat, across, normal], angle, stiffness: STIFFNESS })
    }

    /// The constants of a beam in the direction `angle` of the drawing (rad).
    pub(super) fn along(&self, angle: f64) -> ElasticConstants {
        let [c11, c12, c44] = self.stiffness;
        let split = (c11 - c12) * (c11 + 2.0 * c12);
        let (s11, s12, s44) = ((c11 + c12) / split, -c12 / split, 1.0 / c44);
        let anisotropy = s11 - s12 - 0.5 * s44;
        let [flat, across, normal] = &self.axes;
        let (sin, cos) = (angle - self.angle).sin_cos();
        let d: CrystalDirection = std::array::from_fn(|i| flat[i] * cos + across[i] * sin);
        let n: CrystalDirection = std::array::from_fn(|i| across[i] * cos - flat[i] * sin);
        let both =
            |a: &CrystalDirection, b: &CrystalDirection| a.iter().zip(b).map(|(a, b)| a * a * b * b).sum::<f64>();
        // Σ dᵢ²dⱼ² over the pairs is (1 − Σ dᵢ⁴)/2
        let youngs_modulus = 1.0 / (s11 - anisotropy * (1.0 - both(&d, &d)));
        ElasticConstants {
            youngs_modulus,
            shear_modulus: 1.0 / (s44 + 4.0 * anisotropy * both(&d, &n)),
            poisson: -(s12 + anisotropy * both(&d, normal)) * youngs_modulus,
        }
    }

    /// A material with the constants of the direction `angle` of the drawing (rad).
    pub(super) fn turned(&self, material: Material, angle: f64) -> Material {
        let ElasticConstants { youngs_modulus, shear_modulus, poisson } = self.along(angle);
        Material { youngs_modulus, shear_modulus: Some(shear_modulus), poisson, ..material }
    }
}

impl ElementSite<'_, '_> {
    /// The wafer that the layer is cut from, where it says so.
    pub(super) fn wafer(&mut self) -> Result<Option<Wafer>, Reported> {
        let Some(plane) = self.number("crystal")? else {
            for name in CONSTANTS {
                if self.number(name)?.is_some() {
                    return Err(self.missing("crystal"));
                }
            }
            return Ok(None);
        };
        let angle = self.number_or("crystalangle", 0.0)?;
        let Some(mut wafer) = Wafer::new(plane, angle) else {
            return Err(self.out_of_range("crystal", plane, "100 or 111, the plane of a silicon wafer"));
        };
        for constant in ["Youngsmodulus", "shearmodulus", "Poisson"] {
            if self.number(constant)?.is_some() {
                let message = format!("both `crystal` and `{constant}` are given");
                let help = format!("`crystal` gives `{constant}` by the direction of each beam: leave one of them out");
                return Err(self.sink.error("E060", self.span_of(constant), message, help));
            }
        }
        for (constant, name) in wafer.stiffness.iter_mut().zip(CONSTANTS) {
            // of a curve, positive everywhere
            self.curve(name)?;
            *constant = self.positive_if_any(name)?.unwrap_or(*constant);
        }
        let [c11, c12, _] = wafer.stiffness;
        if c12 >= c11 {
            return Err(self.out_of_range("C12", c12, "below `C11`: no crystal that is stable has more"));
        }
        Ok(Some(wafer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, wanted: f64, tolerance: f64) {
        assert!((found / wanted - 1.0).abs() < tolerance, "{found} {wanted}");
    }

    /// E and G of a (100) wafer at 0, 15, 22.5, 30, 45° from [100], which is 45° from the flat: rotation of the full tensor of Hopcroft's
    /// constants (independent computation), to the digits given. Across the thickness of ⟨110⟩ beams ν = 0.3617.
    #[test]
    fn a_100_wafer() {
        let wafer = Wafer::new(100.0, 0.0).unwrap();
        let wanted = [
            (0.0, 130.13, 79.60),
            (15.0, 138.09, 69.77),
            (22.5, 147.08, 62.09),
            (30.0, 157.32, 55.94),
            (45.0, 169.10, 50.90),
        ];
        for (degrees, e, g) in wanted {
            for turn in [0.0, 90.0, 180.0, -90.0] {
                let found = wafer.along(f64::to_radians(degrees + 45.0 + turn));
                close(found.youngs_modulus, e * 1e9, 1e-4);
                close(found.shear_modulus, g * 1e9, 1e-4);
            }
        }
        close(wafer.along(0.0).poisson, 0.3617, 3e-4);
        let turned = Wafer::new(100.0, 0.3).unwrap();
        close(turned.along(0.3).youngs_modulus, 169.10e9, 1e-4);
    }

    /// A (111) wafer is isotropic in its plane: E 169.10 GPa, G 67.0 GPa, ν 0.162 across the thickness.
    #[test]
    fn a_111_wafer() {
        let wafer = Wafer::new(111.0, 0.1).unwrap();
        for k in 0..12 {
            let found = wafer.along(f64::from(k) * 0.55);
            close(found.youngs_modulus, 169.10e9, 1e-4);
            close(found.shear_modulus, 67.0e9, 1e-3);
            close(found.poisson, 0.162, 2e-3);
        }
    }

    /// Other planes are no wafers of the table.
    #[test]
    fn other_planes() {
        assert_eq!(Wafer::new(110.0, 0.0), None);
    }
}
