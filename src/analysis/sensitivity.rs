//! How much faster frequencies move than the equilibrium that they are about.
//!
//! Next to a fold the lowest frequency goes to zero as the fourth root of what is left of the voltage: an error of the deflection there is
//! one of a hundred times that in the frequency. Seen by moving the equilibrium by a share of itself, mode by mode:
//! ```text
//! d ln f / d ln q = xᵀ·[K(q·(1 + δ)) − K(q·(1 − δ))]·x / (4·δ·λ),   xᵀMx = 1
//! ```
//! The shape stays as it is, by which the quotient changes in the second order only (Rayleigh).

use crate::compile::Compiled;
use crate::gaps::Drive;
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;

/// δ: far above rounding, far below what a gap closes by.
const STEP: f64 = 1e-5;
/// A mode below this share of the highest one is one without stiffness, whose frequency is rounding.
const FREE: f64 = 1e-9;

/// d ln f / d ln q of the worst of modes, and what of it the voltages across gaps bring [1].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensitivity {
    /// Of everything.
    pub all: f64,
    /// Of the field.
    pub field: f64,
}

/// That of the modes `shapes` with their λ, about the equilibrium `q` under `drive`; `stressed`: with the stiffness that stress adds.
pub(super) fn of_modes(
    compiled: &Compiled,
    (q, drive): (&[Pose], &Drive),
    stressed: bool,
    (lambda, shapes): (&[f64], &[Vec<Pose>]),
) -> Sensitivity {
    if q.iter().all(|q| *q == Pose::zeros()) {
        return Sensitivity::default();
    }
    let slopes = |drive: &Drive| -> Vec<f64> {
        let [more, less] =
            [1.0 + STEP, 1.0 - STEP].map(|factor| quotients(compiled, (q, drive), factor, stressed, shapes));
        more.iter().zip(less).map(|(more, less)| (more - less) / (4.0 * STEP)).collect()
    };
    let highest = lambda.iter().fold(0.0, |m: f64, l| m.max(l.abs()));
    let worst = |slopes: &[f64]| {
        let swings = slopes.iter().zip(lambda).filter(|(_, lambda)| lambda.abs() > FREE * highest);
        swings.map(|(slope, lambda)| (slope / lambda).abs()).fold(0.0, f64::max)
    };
    let all = slopes(drive);
    let field = if drive.volts.iter().all(|v| *v == 0.0) {
        0.0
    } else {
        let without = slopes(&Drive { volts: vec![0.0; drive.volts.len()], ..drive.clone() });
        worst(&all.iter().zip(without).map(|(all, without)| all - without).collect::<Vec<_>>())
    };
    Sensitivity { all: worst(&all), field }
}

/// xᵀ·K(factor·q)·x of each shape.
fn quotients(
    compiled: &Compiled,
    (q, drive): (&[Pose], &Drive),
    factor: f64,
    stressed: bool,
    shapes: &[Vec<Pose>],
) -> Vec<f64> {
    let system = &compiled.parts.system;
    let q: Vec<Pose> = q.iter().map(|q| q * factor).collect();
    let mut tangent = BlockMatrix::new(&system.model.pattern);
    let mut force = q.clone();
    system.tangent(&q, drive, &mut tangent, &mut force);
    if stressed {
        system.add_stress_stiffness(&q, drive, &mut tangent);
    }
    let quotient = |x: &Vec<Pose>| -> f64 {
        let mut product = vec![Pose::zeros(); x.len()];
        tangent.multiply_add(&system.model.pattern, x, &mut product);
        x.iter().zip(&product).map(|(x, y)| x.dot(y)).sum()
    };
    shapes.iter().map(quotient).collect()
}
