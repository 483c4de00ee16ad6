//! Quality factors of modes with their shares.
//!
//! A mode of the frequency ω and the shape φ loses in a period what each cause takes:
//! ```text
//! 1/Q = Σ 1/Q_i,      drag: φᵀCφ/(ω·m),      gas in gaps: Re φᵀZ(ω)φ/(ω·m),      m = φᵀMφ
//! thermoelastic: Σ_beams 2U/(ω²·m)·Δ·f(ξ),    Δ = E·α²·T₀/(ρ·c_p),    ξ = w·√(ω·ρ·c_p/(2k))
//! f(ξ) = 6/ξ² − 6/ξ³·(sinh ξ + sin ξ)/(cosh ξ + cos ξ)
//! electrical: Re iᴴRi/(ω³·m),      i = iω·(V∘∂C·φ + C∘v),      v = −R·i
//! anchors: Σ_beams 2U/(ω²·m)/Q_a
//! ```
//! C is the drag and the dampers, Z the impedance of the gas at the frequency of the mode, and U the energy that the mode bends a beam with, without junctions. The heat of a bent
//! beam flows across its width w. The shape is that without damping: the sum is right to the order of 1/Q².
//!
//! i is the current through each gap under its voltage V at the operating point, and R the resistances of the netlist between electrodes, with all sources held. Of one gap
//! behind a resistance this is Q = ω·m/(η²·R)·(1 + (ωRC)²), η = V·∂C/∂x (Tilmans 1996). Q_a is given for a layer.
//!
//! References: R. Lifshitz, M. L. Roukes, "Thermoelastic damping in micro- and nanomechanical systems", Phys. Rev. B 61 (2000) 5600–5609; C. Zener, "Internal
//! friction in solids", Phys. Rev. 52 (1937) 230–235; H. A. C. Tilmans, "Equivalent circuit representation of electromechanical transducers: I. Lumped-parameter
//! systems", J. Micromech. Microeng. 6 (1996) 157–176.

use super::modes::{about_equilibrium, shapeless};
use super::statics::source_vector;
use super::{AnalysisError, PortVoltages};
use bimorph_domains::Drive;
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::ports::{ElectrodeResistances, electrode_resistances};
use bimorph_multibody::forces::{add_damping, resultants_change};
use bimorph_multibody::planar::Pose;
use bimorph_structure::{Beam, SolidHeat};
use nalgebra::{Complex, DMatrix, DVector};
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
    /// Current through resistances of the netlist.
    pub electrical: f64,
    /// Waves that leave through anchors, as layers give them.
    pub anchors: f64,
}

impl ModeLoss {
    /// Q (1); infinite without any loss.
    pub fn quality(&self) -> f64 {
        1.0 / (self.drag + self.gas + self.thermoelastic + self.electrical + self.anchors)
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
    let (electrodes, drive) = electrodes(compiled, voltages)?;
    let of = |(frequency_hz, shape): (f64, &Vec<Pose>)| {
        bimorph_base::budget::check();
        let (omega, mass) = (TAU * frequency_hz, model.mass_product(shape, shape));
        let mut force = vec![Pose::zeros(); shape.len()];
        add_damping(model, shape, &mut force);
        let drag: f64 = force.iter().zip(shape).map(|(force, rate)| force.dot(rate)).sum();
        let (mut bent, mut anchors) = (0.0, 0.0);
        for (index, beam) in compiled.structure.beams.iter().enumerate() {
            let part = 2.0 * bending_energy(compiled, index, (&q, shape)) / (omega * omega * mass);
            bent += part * thermoelastic(beam, omega);
            anchors += part / beam.material.anchor_quality.unwrap_or(f64::INFINITY);
        }
        let lossless = compiled.options.undamped;
        ModeLoss {
            frequency_hz,
            drag: drag / (omega * mass),
            gas: system.gas_damping(&q, shape, omega) / (omega * mass),
            thermoelastic: if lossless { 0.0 } else { bent },
            electrical: if lossless {
                0.0
            } else {
                dissipated(compiled, (&electrodes, &drive), (&q, shape), omega) / mass
            },
            anchors: if lossless { 0.0 } else { anchors },
        }
    };
    Ok(found.frequencies_hz.iter().copied().zip(&shapes).map(of).collect())
}

/// Energy with which a motion `shape` about `q` bends a beam (J). Its moment is linear within a segment, so that the springs of calibrated junctions, in series
/// with the first and the last joint, have no part in it. Of joints with rigid directions it is that of the cubics between their ends.
fn bending_energy(compiled: &CompiledModel, beam: usize, (q, shape): (&[Pose], &[Pose])) -> f64 {
    let system = &compiled.parts.system;
    let (line, stressed) = (&system.beams[beam], &compiled.parts.stressed[beam]);
    if stressed.rigid || stressed.joints.is_empty() {
        return line.bending(q, shape, system.model.linear).0;
    }
    let of = |&(joint, length): &(u32, f64)| {
        let joint = &system.model.joints[joint as usize];
        let [_, shear, moment]: [f64; 3] = resultants_change(&system.model, joint, q, shape, |_| 0.0).into();
        0.5 * length / line.rigidity * (moment * moment + (shear * length).powi(2) / 12.0)
    };
    stressed.joints.iter().map(of).sum()
}

/// Resistances between electrodes at the operating point, and the voltages there.
fn electrodes(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
) -> Result<(ElectrodeResistances, Drive), AnalysisError> {
    let (parts, electrics) = (&compiled.parts, &compiled.parts.system.electrics);
    let sources = source_vector(compiled, voltages)?;
    let (mut rise, mut drive) = (electrics.heating.rest(), electrics.drive());
    if about_equilibrium(compiled, voltages) {
        electrics.steady(&sources, &mut rise, &mut drive);
    }
    let warm: Vec<f64> = (0..parts.heaters.len()).map(|k| electrics.heating.resistance(k, &rise)).collect();
    let found = electrode_resistances(&compiled.structure, &parts.gap_names, &parts.heaters, &warm);
    let refused = |error| AnalysisError::BadRequest { what: "resistances".into(), detail: format!("{error}") };
    Ok((found.map_err(refused)?, drive))
}

/// Power that resistances take from the motion `shape` about `q`, times 2/ω³ (kg·m²): with the mass of the mode 1/Q.
fn dissipated(
    compiled: &CompiledModel,
    (electrodes, drive): (&ElectrodeResistances, &Drive),
    (q, shape): (&[Pose], &[Pose]),
    omega: f64,
) -> f64 {
    let system = &compiled.parts.system;
    let ElectrodeResistances { gaps, between } = electrodes;
    if between.amax() == 0.0 || gaps.iter().all(|g| drive.volts[*g] == 0.0) {
        return 0.0;
    }
    let jw = Complex::new(0.0, omega);
    let moved = |g: &usize| jw * system.charge_slope(*g, (q, &drive.volts), (shape, None));
    let motional = DVector::from_iterator(gaps.len(), gaps.iter().map(moved));
    // i = motional + jω·C·v with v = −R·i; floating conductors share v among their gaps
    let n = gaps.len();
    bimorph_base::budget::lay_out_matrix(2 * n, n);
    let mut charges = DMatrix::zeros(n, n);
    let mut drops = vec![0.0; drive.volts.len()];
    for k in 0..n {
        drops.fill(0.0);
        gaps.iter().enumerate().for_each(|(i, gap)| drops[*gap] = between[(i, k)]);
        gaps.iter().enumerate().for_each(|(i, gap)| charges[(i, k)] = system.charge(*gap, q, &drops));
    }
    let matrix = DMatrix::from_fn(n, n, |i, k| Complex::from(if i == k { 1.0 } else { 0.0 }) + jw * charges[(i, k)]);
    let Some(current) = matrix.lu().solve(&motional) else { return 0.0 };
    let drop = between.map(Complex::from) * &current;
    let power: f64 = current.iter().zip(drop.iter()).map(|(i, v)| (i.conj() * v).re).sum();
    power / omega.powi(3)
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
