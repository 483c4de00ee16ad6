//! Taylor terms of the statics at rest over the inputs, by least squares through equilibria at a few percent of their range.
//!
//! s(u) = Σ_α t_α·u^α over all exponents of degree 1 to the order. Close to rest the equilibria of any mechanism exist, and one or
//! two Newton iterations of the full model each find them.

use super::ReductionError;
use super::inputs::{InputBox, low_discrepancy};
use crate::equilibrium::{Equilibrium, EquilibriumOptions};
use crate::path::LoadPath;
use bimorph_domains::{Drive, System};
use bimorph_multibody::joint_coordinates::sprung_loops::Tree;
use bimorph_multibody::planar::Pose;
use nalgebra::DMatrix;

/// Largest sample, as a fraction of an input's range (1).
const FRACTION: f64 = 0.08;
/// Samples per term where there is more than one input.
const SAMPLES: usize = 2;

/// Terms and their exponents.
#[derive(Debug, Clone)]
pub struct TaylorTerms {
    /// Exponents of each term, by input.
    pub exponents: Vec<Vec<u32>>,
    /// The terms over the coordinates of the tree.
    pub terms: Vec<Vec<Pose>>,
}

/// Order of the expansion for a number of inputs: the fourth of one and two, the third of three and four, the second of more.
pub fn order(inputs: usize) -> u32 {
    match inputs {
        0..=2 => 4,
        3..=4 => 3,
        _ => 2,
    }
}

impl TaylorTerms {
    /// Those of a system on a tree.
    ///
    /// # Errors
    /// [`ReductionError::NoSample`].
    pub fn at_rest(system: &System, tree: &Tree, inputs: &InputBox) -> Result<Self, ReductionError> {
        let p = inputs.inputs.len();
        let exponents = exponents(p, order(p));
        let samples = samples(inputs, exponents.len());
        let mut solver = Equilibrium::new(system, EquilibriumOptions { stop_at_fold: true, ..Default::default() });
        let mut strains = Vec::with_capacity(samples.len());
        for u in &samples {
            let drive = inputs.drive(u);
            let mut q = vec![Pose::zeros(); system.bodies()];
            let found = solver.follow(system, &DriveRay { none: &inputs.none, to: &drive }, &mut q);
            match found {
                Ok(path) if path.reached == 1.0 => {}
                Ok(path) => {
                    let detail = format!("the branch ends at {:.3} of such a load", path.reached);
                    return Err(ReductionError::NoSample { detail });
                }
                Err(error) => return Err(ReductionError::NoSample { detail: error.to_string() }),
            }
            let mut s = vec![Pose::zeros(); q.len()];
            tree.coordinates_at(&q, &mut s);
            strains.push(s);
        }
        let (rows, columns) = (samples.len(), exponents.len());
        let scaled = DMatrix::from_fn(rows, columns, |k, c| monomial(&samples[k], &exponents[c], 1.0 / FRACTION));
        let inverse = scaled.pseudo_inverse(1e-13).map_err(|e| ReductionError::NoSample { detail: e.to_owned() })?;
        let term = |c: usize| {
            let degree: u32 = exponents[c].iter().sum();
            let unscaled = FRACTION.powi(-(degree as i32));
            let mut sum = vec![Pose::zeros(); system.bodies()];
            for (k, s) in strains.iter().enumerate() {
                let weight = inverse[(c, k)] * unscaled;
                sum.iter_mut().zip(s).for_each(|(sum, s)| *sum += s * weight);
            }
            sum
        };
        let terms = (0..columns).map(term).collect();
        Ok(Self { exponents, terms })
    }

    /// Values of the monomials at `u`.
    pub fn monomials(&self, u: &[f64]) -> Vec<f64> {
        self.exponents.iter().map(|exponents| monomial(u, exponents, 1.0)).collect()
    }
}

fn monomial(u: &[f64], exponents: &[u32], scale: f64) -> f64 {
    u.iter().zip(exponents).map(|(u, e)| (u * scale).powi(*e as i32)).product()
}

/// All exponents of `p` inputs of degree 1 to `order`, lower degrees first.
fn exponents(p: usize, order: u32) -> Vec<Vec<u32>> {
    fn of_degree(p: usize, degree: u32) -> Vec<Vec<u32>> {
        if p == 1 {
            return vec![vec![degree]];
        }
        let with =
            |first: u32| of_degree(p - 1, degree - first).into_iter().map(move |rest| [vec![first], rest].concat());
        (0..=degree).rev().flat_map(with).collect()
    }
    (1..=order).flat_map(|degree| of_degree(p, degree)).collect()
}

/// Samples near rest: along each input, and evenly between.
fn samples(inputs: &InputBox, terms: usize) -> Vec<Vec<f64>> {
    let p = inputs.inputs.len();
    let ends: Vec<[f64; 2]> = (0..p)
        .map(|i| {
            let most = FRACTION * inputs.inputs[i].range.iter().fold(0.0, |most: f64, end| most.max(end.abs()));
            // there are no negative squares
            if inputs.is_square(i) { [0.0, most] } else { [-most, most] }
        })
        .collect();
    let mut samples = Vec::new();
    for (i, [low, high]) in ends.iter().enumerate() {
        let steps: [f64; 4] = if *low == 0.0 { [0.25, 0.5, 0.75, 1.0] } else { [-1.0, -0.5, 0.5, 1.0] };
        samples
            .extend(steps.map(|share| (0..p).map(|k| if k == i { share * high } else { 0.0 }).collect::<Vec<f64>>()));
    }
    let more = (SAMPLES * terms).saturating_sub(samples.len());
    if p > 1 {
        let within = |x: Vec<f64>| x.into_iter().zip(&ends).map(|(x, [low, high])| low + x * (high - low)).collect();
        samples.extend(low_discrepancy(p, more).into_iter().map(within));
    }
    samples
}

/// A straight path from rest to a drive, voltages by the square root.
#[derive(Debug, Clone, Copy)]
pub struct DriveRay<'a> {
    /// Where it begins: no voltage, heat or load.
    pub none: &'a Drive,
    /// Where it ends.
    pub to: &'a Drive,
}

/// The smallest fraction of the path (1): nothing at all would have no slope.
const LEAST: f64 = 1e-30;

impl LoadPath for DriveRay<'_> {
    fn at(&self, s: f64, drive: &mut Drive) {
        let root = s.max(LEAST).sqrt();
        drive.clone_from(self.none);
        drive.load = s * self.to.load;
        drive.volts.iter_mut().zip(&self.to.volts).for_each(|(v, to)| *v = root * to);
        drive.expansion.iter_mut().zip(&self.to.expansion).for_each(|(x, to)| *x = s * to);
        drive.inputs.iter_mut().zip(&self.to.inputs).for_each(|(x, to)| *x = s * to);
    }

    fn slope(&self, s: f64, slope: &mut Drive) {
        let rate = 0.5 / s.max(LEAST).sqrt();
        slope.clone_from(self.to);
        slope.volts.iter_mut().for_each(|v| *v *= rate);
        (slope.turning, slope.load) = (0.0, self.to.load);
    }
}
