//! Thermal noise of a module: white sources of dampers, gas and resistors.
//!
//! Forces of drag C have the spectral density 4·k·T·C, and currents of conductance G have 4·k·T·G ([`bimorph_device`] computes the same). A symmetric matrix is a sum of
//! columns a·aᵀ, each of which is one source that acts on several equations with the gains a. Where it acts on one alone it is written there; otherwise it is the voltage of
//! a node of its own.

use bimorph_multibody::agitation::BOLTZMANN;
use nalgebra::{DMatrix, DVector};
use std::fmt::Write;

/// Part of the largest eigenvalue below which one is rounding (1).
const NONE: f64 = 1e-12;

/// 4·k·T at the temperature `t` (K), in joules.
pub(super) fn warm(t: f64) -> f64 {
    4.0 * BOLTZMANN * t
}

/// Columns whose outer products add up to a symmetric matrix without negative eigenvalues.
pub(super) fn columns(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let n = matrix.nrows();
    let coupled = (0..n).any(|i| (0..i).any(|j| matrix[(i, j)] != 0.0));
    if !coupled {
        let own = |j: usize| DVector::from_fn(n, |i, _| if i == j { matrix[(j, j)].max(0.0).sqrt() } else { 0.0 });
        return (0..n).filter(|&j| matrix[(j, j)] > 0.0).map(own).collect();
    }
    let eigen = (0.5 * (matrix + matrix.transpose())).symmetric_eigen();
    let least = NONE * eigen.eigenvalues.amax();
    let columns = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    columns.filter(|(value, _)| **value > least).map(|(value, vector)| vector * value.sqrt()).collect()
}

/// Contributions of noise, and the nodes that they take.
#[derive(Debug, Default)]
pub(super) struct NoiseText {
    /// The nodes.
    pub(super) nodes: Vec<String>,
    /// The contributions.
    pub(super) text: String,
}

impl NoiseText {
    /// A source of a spectral density `power`, an expression, that acts on each target with its gain, an expression.
    pub(super) fn source(&mut self, shares: &[(String, String)], power: &str, name: &str) {
        match shares {
            [] => {}
            [(target, gain)] => {
                let _ = writeln!(self.text, "    {target} <+ white_noise({gain} * {gain} * ({power}), \"{name}\");");
            }
            _ => {
                let node = self.node(power, name);
                for (target, gain) in shares {
                    let _ = writeln!(self.text, "    {target} <+ {gain} * V({node});");
                }
            }
        }
    }

    /// A node of its own whose voltage is a source of a spectral density `power`.
    fn node(&mut self, power: &str, name: &str) -> String {
        let node = format!("n{}", self.nodes.len() + 1);
        let _ = writeln!(self.text, "    I({node}) <+ V({node}) + white_noise({power}, \"{name}\");");
        self.nodes.push(node.clone());
        node
    }

    /// Sources of the spectral densities `sizes`² with a correlation. Each acts on its target; where its entry of `rates` is true by its rate of change.
    pub(super) fn correlated(
        &mut self,
        (sizes, correlation): (&DVector<f64>, &DMatrix<f64>),
        targets: &[(String, bool)],
        name: &str,
    ) {
        for column in columns(correlation) {
            let shares: Vec<(usize, f64)> = column
                .iter()
                .zip(sizes)
                .map(|(share, size)| share * size)
                .enumerate()
                .filter(|(_, x)| *x != 0.0)
                .collect();
            if let [(k, share)] = shares[..]
                && !targets[k].1
            {
                let _ = writeln!(self.text, "    {} <+ white_noise({:e}, \"{name}\");", targets[k].0, share * share);
                continue;
            }
            let node = self.node("1", name);
            for (k, share) in shares {
                let (target, rate) = &targets[k];
                let text = format!("{share:e} * V({node})");
                let text = if *rate { format!("ddt({text})") } else { text };
                let _ = writeln!(self.text, "    {target} <+ {text};");
            }
        }
    }

    /// The sources of a symmetric matrix, each row on its target with its unit, times the spectral density `power`.
    pub(super) fn matrix(&mut self, matrix: &DMatrix<f64>, targets: &[(String, f64)], power: &str, name: &str) {
        self.matrix_with_gains(matrix, (targets, &vec![None; targets.len()]), power, name);
    }

    /// The same with a further gain of each target, an expression.
    pub(super) fn matrix_with_gains(
        &mut self,
        matrix: &DMatrix<f64>,
        (targets, gains): (&[(String, f64)], &[Option<String>]),
        power: &str,
        name: &str,
    ) {
        for column in columns(matrix) {
            let shares = column.iter().zip(targets.iter().zip(gains)).filter(|(share, _)| **share != 0.0);
            let gain = |(share, ((target, unit), gain)): (&f64, (&(String, f64), &Option<String>))| {
                let gain = gain.as_ref().map_or(String::new(), |gain| format!(" * {gain}"));
                (target.clone(), format!("({:e}){gain}", share / unit))
            };
            let shares: Vec<_> = shares.map(gain).collect();
            self.source(&shares, power, name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of a coupled matrix, of a diagonal one and of one of rank 1 add up to it, and the latter two take one source an equation and one in all.
    #[test]
    fn columns_add_up() {
        let coupled = DMatrix::from_row_slice(3, 3, &[2.0, -1.0, 0.0, -1.0, 3.0, 0.5, 0.0, 0.5, 1.0]);
        let diagonal = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 0.0, 1e-9]));
        let single = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
        for (matrix, count) in [(coupled, 3), (diagonal, 2), (single, 1)] {
            let columns = columns(&matrix);
            assert_eq!(columns.len(), count);
            let sum =
                columns.iter().fold(DMatrix::zeros(matrix.nrows(), matrix.nrows()), |sum, a| sum + a * a.transpose());
            assert!((sum - &matrix).amax() < 1e-12 * matrix.amax());
        }
    }
}
