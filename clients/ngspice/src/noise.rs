//! `.noise`: contribution of the part to the noise at the circuit's output.
//!
//! ngspice solves the circuit's adjoint at each frequency, which gives the effect on the output of a current into each
//! node and of a voltage in each branch, and asks every kind of device for its share. The table that the plug-in
//! registers is its own, so that this works on every version. Code models as such have noise from 47 on only, and there
//! without correlation. With g the adjoint at the ports and monitors and S their spectral densities
//! ([`bimorph::device::Device::noise`]), the share is gᵀ·S·ḡ: ports that swing together are taken together.

use crate::abi::ModelHead;
use crate::call;
use crate::circuit::HostCircuit;
use crate::instance::Instance;
use crate::layout::HostLayout;
use crate::registry::{RegisteredInstance, registry};
use bimorph::device::{DeviceError, Token};
use std::ffi::{c_int, c_void};

/// Request of the host: the density at a frequency, not the sums at the end.
const DENSITY: c_int = 1;
/// In the middle of an analysis: not at its begin or end.
const CALCULATE: c_int = 2;

/// Densities below this are nothing (V²/Hz or A²/Hz): the host takes no logarithms of less.
const LEAST: f64 = 1e-38;
/// Slopes of a density over the frequency, both in logarithms, below which they count as zero; and the same distance
/// from −1.
const FLAT: f64 = 1e-10;

/// The host's data of a noise analysis, in part: the same from SPICE 3 on.
#[repr(C)]
pub(crate) struct NoiseAnalysis {
    /// Frequency (Hz).
    frequency: f64,
    /// The one before it (Hz).
    before: f64,
    /// Their difference (Hz).
    step: f64,
    /// Noise at the output up to here, integrated.
    output: f64,
    /// The same, as if it came from the input.
    input: f64,
    /// From output to input, squared.
    to_input: f64,
}

/// ∫ of a density over a step of the frequency, a power of the frequency between the two.
fn integral(before: [f64; 2], now: [f64; 2]) -> f64 {
    let ([f0, s0], [f1, s1]) = (before, now);
    let slope = (s1 / s0).ln() / (f1 / f0).ln();
    if slope.abs() < FLAT || !slope.is_finite() {
        return s1 * (f1 - f0);
    }
    let up = slope + 1.0;
    if up.abs() < FLAT { s1 * f1 * (f1 / f0).ln() } else { s1 * f1 * (1.0 - (f0 / f1).powf(up)) / up }
}

/// Adds the share of these models' instances to `density` and to the integrals.
///
/// # Errors
/// The message for the user.
///
/// # Safety
/// The arguments are those with which the host called the plug-in, in its layout.
pub(crate) unsafe fn add(
    (mode, operation): (c_int, c_int),
    model: *mut ModelHead,
    circuit: *mut c_void,
    layout: &HostLayout,
    (analysis, density): (*mut NoiseAnalysis, *mut f64),
) -> Result<(), String> {
    if mode != DENSITY || operation != CALCULATE {
        return Ok(());
    }
    // SAFETY: by contract.
    let (circuit, analysis) = unsafe { (HostCircuit::new(circuit, layout), &mut *analysis) };
    if !circuit.noise() {
        return Err("the noise of .sp knows no electro-mechanical parts; use .noise".into());
    }
    let mut registry = registry();
    // SAFETY: the host's lists.
    for (_, instance) in unsafe { call::instances(model) } {
        let Some(entry) = registry.find(instance.conn as usize) else { continue };
        // SAFETY: a live instance, set up by the host, and nodes of its circuit.
        let gains: Vec<[f64; 2]> = unsafe { call::terminals(instance.conn, layout) }
            .into_iter()
            .map(|places| unsafe { circuit.adjoint(places) })
            .collect();
        let share = share(entry, &gains, analysis.frequency)?;
        // SAFETY: by contract.
        unsafe { *density += share };
        let now = share.max(LEAST);
        if analysis.step != 0.0 {
            let sum = integral([analysis.before, entry.density], [analysis.frequency, now]);
            analysis.output += sum;
            let of_input = analysis.to_input;
            analysis.input +=
                integral([analysis.before, entry.density * of_input], [analysis.frequency, now * of_input]);
        }
        entry.density = now;
    }
    Ok(())
}

/// The share of one instance in the density at the output.
fn share(entry: &mut RegisteredInstance, gains: &[[f64; 2]], frequency: f64) -> Result<f64, String> {
    let reported = |why: &dyn std::fmt::Display, name: &str| format!("instance {name}: {why}");
    let name = entry.instance.name().to_owned();
    let Some(token) = entry.balanced else {
        return Err(reported(&"noise needs an operating point first", &name));
    };
    let omega = 2.0 * std::f64::consts::PI * frequency;
    entry.instance.noise(token, omega, gains).map_err(|why| reported(&why, &name))
}

impl Instance {
    /// Spectral density that the part adds at an output on which its ports, then its monitors act by `gains` (complex).
    ///
    /// # Errors
    /// Those of the device.
    pub fn noise(&mut self, token: Token, omega: f64, gains: &[[f64; 2]]) -> Result<f64, DeviceError> {
        let mut densities = Vec::new();
        self.device.noise(token, omega, &mut densities)?;
        if densities.len() != gains.len() * gains.len() {
            return Ok(0.0);
        }
        let scales = self.scales.iter().map(|s| s.answered).chain(self.monitors.iter().map(|m| m.scale));
        let gains: Vec<[f64; 2]> = gains.iter().zip(scales).map(|(g, scale)| g.map(|x| x * scale)).collect();
        let mut sum = 0.0;
        for (row, a) in densities.chunks_exact(gains.len().max(1)).zip(&gains) {
            for (s, b) in row.iter().zip(&gains) {
                // the real part of a·s·b̄; the imaginary ones cancel
                sum += (a[0] * b[0] + a[1] * b[1]) * s[0] - (a[1] * b[0] - a[0] * b[1]) * s[1];
            }
        }
        Ok(sum.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Powers of the frequency are integrated exactly: flat, ∝ 1/f, and ∝ f³.
    #[test]
    fn powers_are_integrated() {
        let of = |s: fn(f64) -> f64| integral([2.0, s(2.0)], [3.0, s(3.0)]);
        assert!((of(|_| 5.0) - 5.0).abs() < 1e-14);
        assert!((of(|f| 4.0 / f) - 4.0 * 1.5f64.ln()).abs() < 1e-9);
        assert!((of(|f| f * f * f) - (81.0 - 16.0) / 4.0).abs() < 1e-12);
        assert_eq!(integral([0.0, 1.0], [1.0, 1.0]), 1.0);
    }
}
