//! Quality factors of modes with their shares.
//!
//! A mode of the frequency ω and the shape φ loses in a period what each cause takes:
//! ```text
//! 1/Q = Σ 1/Q_i,      drag: φᵀCφ/(ω·m),      gas in gaps: Re φᵀZ(ω)φ/(ω·m),      m = φᵀMφ
//! thermoelastic: Σ_beams 2U/(ω²·m)·Δ·f(ξ),    Δ = E·α²·T₀/(ρ·c_p),    ξ = w·√(ω·ρ·c_p/(2k))
//! f(ξ) = 6/ξ² − 6/ξ³·(sinh ξ + sin ξ)/(cosh ξ + cos ξ)
//! ```
//! C is the drag and the dampers, Z the impedance of the gas at the frequency of the mode, and U the energy that the mode bends a beam with. The heat of a bent
//! beam flows across its width w. The shape is that without damping: the sum is right to the order of 1/Q².
//!
//! References: R. Lifshitz, M. L. Roukes, "Thermoelastic damping in micro- and nanomechanical systems", Phys. Rev. B 61 (2000) 5600–5609; C. Zener, "Internal
//! friction in solids", Phys. Rev. 52 (1937) 230–235.

use super::modes::shapeless;
use super::{AnalysisError, PortVoltages};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::forces::add_damping;
use bimorph_multibody::planar::Pose;
use bimorph_structure::{Beam, SolidHeat};
use serde::Serialize;
use std::f64::consts::TAU;

/// Temperature where no layer gives one (K): 27 °C, as in noise.
const ROOM_TEMPERATURE: f64 = 300.15;

/// 1/Q of a mode by cause (1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ModeLoss {
    /// Frequency without damping (Hz).
    pub frequency_hz: f64,
    /// Drag under parts, dampers.
    pub drag: f64,
    /// Gas in gaps.
    pub gas: f64,
    /// Heat that flows across bent beams.
    pub thermoelastic: f64,
}

impl ModeLoss {
    /// Q (1); infinite without any loss.
    pub fn quality(&self) -> f64 {
        1.0 / (self.drag + self.gas + self.thermoelastic)
    }
}

/// Losses of the `count` lowest modes about the static equilibrium at these voltages.
///
/// # Errors
/// See [`super::modes::modes`].
pub fn mode_losses(
    compiled: &CompiledModel,
    count: usize,
    voltages: &PortVoltages,
) -> Result<Vec<ModeLoss>, AnalysisError> {
    let (found, q, shapes) = shapeless(compiled, count, voltages)?;
    let system = &compiled.parts.system;
    let model = &system.model;
    let of = |(frequency_hz, shape): (f64, &Vec<Pose>)| {
        bimorph_base::budget::check();
        let (omega, mass) = (TAU * frequency_hz, model.mass_product(shape, shape));
        let mut force = vec![Pose::zeros(); shape.len()];
        add_damping(model, shape, &mut force);
        let drag: f64 = force.iter().zip(shape).map(|(force, rate)| force.dot(rate)).sum();
        let bent = system.beams.iter().zip(&compiled.structure.beams).map(|(line, beam)| {
            let (energy, _) = line.bending(&q, shape, model.linear);
            2.0 * energy / (omega * omega * mass) * thermoelastic(beam, omega)
        });
        ModeLoss {
            frequency_hz,
            drag: drag / (omega * mass),
            gas: system.gas_damping(&q, shape, omega) / (omega * mass),
            thermoelastic: if compiled.options.undamped { 0.0 } else { bent.sum() },
        }
    };
    Ok(found.frequencies_hz.iter().copied().zip(&shapes).map(of).collect())
}

/// Δ·f(ξ) of a beam at an angular frequency (rad/s); 0 where its layer has no conductivity or specific heat.
fn thermoelastic(beam: &Beam, omega: f64) -> f64 {
    let material = &beam.material;
    let Some(SolidHeat { conductivity, specific_heat }) = material.heat else { return 0.0 };
    let ambient = if material.ambient_temperature > 0.0 { material.ambient_temperature } else { ROOM_TEMPERATURE };
    let capacity = material.density * specific_heat;
    let strength = material.youngs_modulus * material.thermal_expansion.powi(2) * ambient / capacity;
    let xi = beam.width * (omega * capacity / (2.0 * conductivity)).sqrt();
    if strength.is_finite() { strength * lifshitz_roukes(xi) } else { 0.0 }
}

/// f(ξ) (1).
pub fn lifshitz_roukes(xi: f64) -> f64 {
    if xi < 0.03 {
        return 0.2 * xi * xi; // cancels below; the next term is of order ξ⁶
    }
    // sinh and cosh over e^ξ/2, which overflow
    let decay = (-xi).exp();
    let upper = 1.0 - decay * decay + 2.0 * decay * xi.sin();
    let lower = 1.0 + decay * decay + 2.0 * decay * xi.cos();
    6.0 / (xi * xi) - 6.0 / (xi * xi * xi) * (upper / lower)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The law at small and large arguments, ξ²/5 and 6/ξ², and its maximum 0.494 at ξ = 2.225 (Lifshitz and Roukes 2000, below equation 40).
    #[test]
    fn limits() {
        for xi in [0.0299, 0.0301, 0.1] {
            assert!((lifshitz_roukes(xi) / (0.2 * xi * xi) - 1.0).abs() < 1e-5, "{xi}");
        }
        assert!((lifshitz_roukes(1e3) / (6e-6 * (1.0 - 1e-3)) - 1.0).abs() < 1e-9);
        assert!((lifshitz_roukes(2.225) - 0.494).abs() < 1e-3);
        assert!(lifshitz_roukes(2.0) < lifshitz_roukes(2.225) && lifshitz_roukes(2.5) < lifshitz_roukes(2.225));
    }
}
