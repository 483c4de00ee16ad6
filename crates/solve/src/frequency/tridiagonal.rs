//! Eigenvalues and vectors of a symmetric tridiagonal matrix, by the QL algorithm with implicit shifts.
//!
//! Reference: A. Dubrulle, R. S. Martin, J. H. Wilkinson, "The implicit QL algorithm", in: Handbook for Automatic Computation II (1971).

/// Steps for one eigenvalue at most; two or three are usual.
const MAX_STEPS: usize = 60;

/// All eigenvalues, unordered, and for each its vector of length 1. `beside` is the diagonal next to the main one.
pub(super) fn eigen(diagonal: &[f64], beside: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = diagonal.len();
    rotated(diagonal, beside, (0..n).map(|i| (0..n).map(|k| if i == k { 1.0 } else { 0.0 }).collect()).collect())
}

/// The same with the last entry of each vector alone, at a fraction of the cost.
pub(super) fn last_entries(diagonal: &[f64], beside: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = diagonal.len();
    rotated(diagonal, beside, (0..n).map(|i| vec![if i + 1 == n { 1.0 } else { 0.0 }]).collect())
}

/// All eigenvalues, and what the rotations that lead there make of `vectors`.
fn rotated(diagonal: &[f64], beside: &[f64], mut vectors: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = diagonal.len();
    // squares are taken: numbers about one
    let scale = diagonal.iter().chain(beside).fold(f64::MIN_POSITIVE, |m: f64, x| m.max(x.abs()));
    let mut d: Vec<f64> = diagonal.iter().map(|x| x / scale).collect();
    let mut e: Vec<f64> = beside.iter().map(|x| x / scale).chain([0.0]).collect();
    for l in 0..n {
        for _ in 0..MAX_STEPS {
            let end = (l..n - 1).find(|&m| e[m].abs() <= f64::EPSILON * (d[m].abs() + d[m + 1].abs())).unwrap_or(n - 1);
            if end == l {
                break;
            }
            sweep(&mut d, &mut e, (l, end), &mut vectors);
        }
    }
    d.iter_mut().for_each(|x| *x *= scale);
    (d, vectors)
}

/// One step on rows `first` to `end`, whose last off-diagonal entry is unused.
fn sweep(d: &mut [f64], e: &mut [f64], (first, end): (usize, usize), vectors: &mut [Vec<f64>]) {
    let half = (d[first + 1] - d[first]) / (2.0 * e[first]);
    let mut g = d[end] - d[first] + e[first] / (half + (half * half + 1.0).sqrt().copysign(half));
    let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
    for i in (first..end).rev() {
        let (f, b) = (s * e[i], c * e[i]);
        let r = (f * f + g * g).sqrt();
        e[i + 1] = r;
        if r == 0.0 {
            // it has come apart here
            d[i + 1] -= p;
            e[end] = 0.0;
            return;
        }
        (s, c) = (f / r, g / r);
        let shifted = d[i + 1] - p;
        let twice = (d[i] - shifted) * s + 2.0 * c * b;
        p = s * twice;
        d[i + 1] = shifted + p;
        g = c * twice - b;
        let (before, after) = vectors.split_at_mut(i + 1);
        for (x, y) in before[i].iter_mut().zip(&mut after[0]) {
            (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
        }
    }
    d[first] -= p;
    e[first] = g;
    e[end] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second difference of n points: λ_k = 2 − 2·cos(kπ/(n + 1)), vectors are sines; to rounding. One number, and a matrix that falls
    /// apart into equal halves.
    #[test]
    fn second_differences() {
        for n in [1, 2, 3, 17, 60] {
            let (mut values, vectors) = eigen(&vec![2.0; n], &vec![-1.0; n - 1]);
            let (same, last) = last_entries(&vec![2.0; n], &vec![-1.0; n - 1]);
            assert!(same == values && last.iter().zip(&vectors).all(|(last, x)| last[0] == x[n - 1]));
            for (value, x) in values.iter().zip(&vectors) {
                let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
                for i in 0..n {
                    let left = if i > 0 { x[i - 1] } else { 0.0 };
                    assert!((2.0 * x[i] - left - at(i + 1) - value * x[i]).abs() < 1e-14 * 4.0, "{n}");
                }
                assert!((x.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-13);
            }
            values.sort_by(f64::total_cmp);
            for (k, value) in values.iter().enumerate() {
                let angle = std::f64::consts::PI * (k + 1) as f64 / (n + 1) as f64;
                assert!((value - (2.0 - 2.0 * angle.cos())).abs() < 1e-14, "{n} {k}: {value}");
            }
        }
        let (mut values, _) = eigen(&[1e-9, 2e-9, 1e-9, 2e-9], &[3e-9, 0.0, 3e-9]);
        values.sort_by(f64::total_cmp);
        let root = 9.25f64.sqrt();
        for (value, exact) in values.iter().zip([1.5 - root, 1.5 - root, 1.5 + root, 1.5 + root]) {
            assert!((value - 1e-9 * exact).abs() < 1e-23, "{values:?}");
        }
    }
}
