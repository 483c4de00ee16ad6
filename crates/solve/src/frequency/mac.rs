//! Which mode of one model is which of another: pairing by the modal assurance criterion.
//!
//! MAC = (aᵀMb)² / (aᵀMa · bᵀMb) is 1 for the same shape and 0 for shapes without anything in common. Frequencies in order of
//! size pair wrong modes as soon as two of them cross.
//!
//! Reference: R. J. Allemang, "The modal assurance criterion: twenty years of use and abuse", Sound and Vibration 37 (2003).

use bimorph_multibody::Model;
use bimorph_multibody::planar::Pose;
use nalgebra::DMatrix;

/// MAC of every shape of `a` (rows) with every shape of `b` (columns), over the bodies of one model (1).
pub fn mac(model: &Model, a: &[Vec<Pose>], b: &[Vec<Pose>]) -> DMatrix<f64> {
    let norm = |x: &Vec<Pose>| model.mass_product(x, x);
    let (of_a, of_b): (Vec<f64>, Vec<f64>) = (a.iter().map(norm).collect(), b.iter().map(norm).collect());
    DMatrix::from_fn(a.len(), b.len(), |i, k| model.mass_product(&a[i], &b[k]).powi(2) / (of_a[i] * of_b[k]))
}

/// For each row its column, each column once, the likest first; the same matrix, the same pairs. Rows beyond the number of
/// columns get none.
pub fn pair(mac: &DMatrix<f64>) -> Vec<Option<usize>> {
    let mut all: Vec<(usize, usize)> = (0..mac.nrows()).flat_map(|i| (0..mac.ncols()).map(move |k| (i, k))).collect();
    // stable: equal ones stay in order of size
    all.sort_by(|&a, &b| mac[b].total_cmp(&mac[a]));
    let mut pairs = vec![None; mac.nrows()];
    let mut taken = vec![false; mac.ncols()];
    for (i, k) in all {
        if pairs[i].is_none() && !taken[k] {
            (pairs[i], taken[k]) = (Some(k), true);
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Crossed modes are paired by shape, not by place.
    #[test]
    fn crossed_modes() {
        let mac = DMatrix::from_row_slice(3, 3, &[0.1, 0.9, 0.0, 0.8, 0.2, 0.1, 0.1, 0.0, 0.95]);
        assert_eq!(pair(&mac), [Some(1), Some(0), Some(2)]);
        assert_eq!(pair(&mac.columns(0, 2).into_owned()), [Some(1), Some(0), None]);
    }
}
