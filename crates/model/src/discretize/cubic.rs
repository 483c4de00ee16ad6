//! The cubic beam element: stiffness, consistent mass, and the next term of its exact dynamic stiffness.
//!
//! Coordinates (u, w, θ) of the two ends along and across the element, of length h. With shear, Φ = 12EI/(G·As·h²), the
//! element is Timoshenko's and its mass knows Φ too.
//!
//! A beam between two ends that vibrate with λ = ω² has the dynamic stiffness D = K − λ·M − λ²·M₂ − …, of which the
//! cubic element is the first two terms. M₂ is what the beam adds by bending between its ends under its own inertia:
//! the work of the inertia of the element's shapes on the deflection that it causes in a beam clamped at both ends.
//! With it, the error of an element of bending wave number k is O((kh)⁸) instead of (kh)⁴/1440, and with shear O(h⁴)
//! instead of O(h²). M₂ leaves the rotary inertia out.
//!
//! Reference: J. S. Przemieniecki, "Theory of Matrix Structural Analysis" (1968), §5.6, §11.3 and §12.2 (quadratic
//! eigenvalue problem).

use super::scheme::Bar;
use nalgebra::{Matrix2, Matrix4, Matrix6};

const LONG: [usize; 2] = [0, 3];
const ACROSS: [usize; 4] = [1, 2, 4, 5];

/// Φ of an element of length `h`.
fn phi(bar: &Bar, h: f64) -> f64 {
    12.0 * bar.ei * bar.shear / (h * h)
}

/// Stiffness (N/m, N, N·m).
pub fn stiffness(bar: &Bar, h: f64) -> Matrix6<f64> {
    let phi = phi(bar, h);
    let (a, b) = (bar.ea / h, bar.ei / (h * h * h) / (1.0 + phi));
    let (near, far) = ((4.0 + phi) * b * h * h, (2.0 - phi) * b * h * h);
    #[rustfmt::skip]
    let k = Matrix6::new(
         a,   0.0,         0.0,         -a,   0.0,         0.0,
         0.0, 12.0 * b,    6.0 * b * h,  0.0, -12.0 * b,   6.0 * b * h,
         0.0, 6.0 * b * h, near,         0.0, -6.0 * b * h, far,
        -a,   0.0,         0.0,          a,   0.0,         0.0,
         0.0, -12.0 * b,  -6.0 * b * h,  0.0, 12.0 * b,   -6.0 * b * h,
         0.0, 6.0 * b * h, far,          0.0, -6.0 * b * h, near,
    );
    k
}

/// Consistent mass (kg, kg·m, kg·m²).
pub fn mass(bar: &Bar, h: f64) -> Matrix6<f64> {
    let p = phi(bar, h);
    let pp = p * p;
    let unit = bar.line_mass * h;
    let scale = unit / (1.0 + p).powi(2);
    let (ww, wt) = (13.0 / 35.0 + 0.7 * p + pp / 3.0, (11.0 / 210.0 + 11.0 / 120.0 * p + pp / 24.0) * h);
    let (wv, wr) = (9.0 / 70.0 + 0.3 * p + pp / 6.0, -(13.0 / 420.0 + 0.075 * p + pp / 24.0) * h);
    let tt = (1.0 / 105.0 + p / 60.0 + pp / 120.0) * h * h;
    let tr = -(1.0 / 140.0 + p / 60.0 + pp / 120.0) * h * h;
    #[rustfmt::skip]
    let mut across = Matrix4::new(
        ww,  wt,  wv, wr,
        wt,  tt, -wr, tr,
        wv, -wr,  ww, -wt,
        wr,  tr, -wt, tt,
    );
    if bar.rotary > 0.0 {
        let (ww, wt) = (1.2, (0.1 - 0.5 * p) * h);
        let tt = (2.0 / 15.0 + p / 6.0 + pp / 3.0) * h * h;
        let tr = (-1.0 / 30.0 - p / 6.0 + pp / 6.0) * h * h;
        #[rustfmt::skip]
        let rotary = Matrix4::new(
             ww,  wt, -ww,  wt,
             wt,  tt, -wt,  tr,
            -ww, -wt,  ww, -wt,
             wt,  tr, -wt,  tt,
        );
        across += rotary * (bar.rotary / (h * h));
    }
    join(&(Matrix2::new(2.0, 1.0, 1.0, 2.0) * (unit / 6.0)), &(across * scale))
}

/// M₂, the second term of the dynamic stiffness (kg·s², kg·m·s², kg·m²·s²).
pub fn second_mass(bar: &Bar, h: f64) -> Matrix6<f64> {
    let phi = phi(bar, h);
    // shapes over ξ = x/h as polynomials: w₀, h·θ₀, w₁, h·θ₁
    #[rustfmt::skip]
    let hermite = Matrix4::new(
        1.0 + phi, -phi,            -3.0,              2.0,
        0.0,        1.0 + 0.5 * phi, -2.0 - 0.5 * phi, 1.0,
        0.0,        phi,              3.0,            -2.0,
        0.0,       -0.5 * phi,       -1.0 + 0.5 * phi, 1.0,
    ) / (1.0 + phi);
    // the load ξⁿ bends a clamped beam, EI = h = 1, to w = c₄·ξⁿ⁺⁴ + a·ξ³/6 + b·ξ²/2 − Φ/12·(c₂·ξⁿ⁺² + a·ξ) with
    // c_k = n!/(n + k)!, a and b from θ(1) = w(1) = 0
    let bent = Matrix4::from_fn(|m, n| {
        let (m, n) = (m as f64, n as f64);
        let c2 = 1.0 / ((n + 1.0) * (n + 2.0));
        let c3 = c2 / (n + 3.0);
        let c4 = c3 / (n + 4.0);
        let a = -(6.0 * c3 - 12.0 * c4 + phi * c2) / (1.0 + phi);
        let b = -c3 - 0.5 * a;
        let bending = c4 / (m + n + 5.0) + a / (6.0 * (m + 4.0)) + b / (2.0 * (m + 3.0));
        bending - phi / 12.0 * (c2 / (m + n + 3.0) + a / (m + 2.0))
    });
    let lengths = Matrix4::from_diagonal(&[1.0, h, 1.0, h].into());
    let shapes = lengths * hermite;
    let across = shapes * bent * shapes.transpose() * (bar.line_mass * bar.line_mass * h.powi(5) / bar.ei);
    // and stretches a held one by c·(ξ − ξⁿ⁺²), c = 1/((n + 1)(n + 2))
    let stretched = Matrix2::from_fn(|m, n| {
        let (m, n) = (m as f64, n as f64);
        (1.0 / (m + 2.0) - 1.0 / (m + n + 3.0)) / ((n + 1.0) * (n + 2.0))
    });
    let linear = Matrix2::new(1.0, -1.0, 0.0, 1.0);
    let long = linear * stretched * linear.transpose() * (bar.line_mass * bar.line_mass * h.powi(3) / bar.ea);
    join(&long, &across)
}

/// Contribution of an axial force N (tension positive) to the second term of the dynamic stiffness D = K + N·G − λ·(M +
/// A) − λ²·M₂ − B. Returns A = N·(…) (kg, kg·m, kg·m²) and B = N²·(…) (N/m, N, N·m). The load of the element's shapes
/// on the clamped beam is N·w″ + λ·m·w; shear is left out.
pub fn second_tension(bar: &Bar, h: f64, force: f64) -> (Matrix6<f64>, Matrix6<f64>) {
    #[rustfmt::skip]
    let cross = Matrix4::new(
        -8.0,  -20.0,  8.0,  15.0,
        -20.0, -8.0,  -15.0, 7.0,
        8.0,   -15.0, -8.0,  20.0,
        15.0,   7.0,   20.0, -8.0,
    ) / 25200.0;
    #[rustfmt::skip]
    let twice = Matrix4::new(
        18.0,  9.0,  -18.0,  9.0,
        9.0,   22.0, -9.0,  -13.0,
        -18.0, -9.0,  18.0, -9.0,
        9.0,  -13.0, -9.0,   22.0,
    ) / 12600.0;
    let lengths = Matrix4::from_diagonal(&[1.0, h, 1.0, h].into());
    let across = |m: Matrix4<f64>, factor: f64| join(&Matrix2::zeros(), &(lengths * m * lengths * (factor / bar.ei)));
    (across(cross, force * bar.line_mass * h.powi(3)), across(twice, force * force * h))
}

fn join(long: &Matrix2<f64>, across: &Matrix4<f64>) -> Matrix6<f64> {
    let mut whole = Matrix6::zeros();
    for (i, &r) in LONG.iter().enumerate() {
        for (j, &c) in LONG.iter().enumerate() {
            whole[(r, c)] = long[(i, j)];
        }
    }
    for (i, &r) in ACROSS.iter().enumerate() {
        for (j, &c) in ACROSS.iter().enumerate() {
            whole[(r, c)] = across[(i, j)];
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    const SLENDER: Bar =
        Bar { length: 1.0, ea: 5.0, ei: 1.0, shear: 0.0, line_mass: 1.0, rotary: 0.0, end_excess: [0.0; 2] };

    /// A rigid motion has its exact kinetic energy and no strain, with and without shear and rotary inertia.
    #[test]
    fn rigid_motion() {
        let thick = Bar { shear: 0.3, rotary: 0.2, ..SLENDER };
        let h = 0.7;
        for bar in [SLENDER, thick] {
            let turn = Vector6::new(0.0, 0.0, 1.0, 0.0, h, 1.0);
            assert!((stiffness(&bar, h) * turn).norm() < 1e-12);
            let energy = turn.dot(&(mass(&bar, h) * turn));
            assert!((energy - (h.powi(3) / 3.0 + bar.rotary * h)).abs() < 1e-14, "{energy}");
            assert!((mass(&bar, h) - mass(&bar, h).transpose()).norm() < 1e-15);
        }
        for bar in [SLENDER, thick] {
            let second = second_mass(&bar, h);
            assert!((second - second.transpose()).norm() < 1e-15);
            assert!(second.symmetric_eigenvalues().min() > -1e-15);
        }
    }

    /// One element of a clamped-pinned column buckles at 20.19·EI/h² (tan x = x). The element alone says 30; with the term in
    /// N² it is 23.05, the root of 4 + 4·N/30 − 22·N²/12600.
    #[test]
    fn one_element_buckles() {
        let free = |force: f64| 4.0 + force * 4.0 / 30.0 - second_tension(&SLENDER, 1.0, force).1[(5, 5)];
        assert!(free(-23.0) > 0.0 && free(-23.1) < 0.0, "{} {}", free(-23.0), free(-23.1));
        // symmetric, and nothing for a rigid turn without force
        let (a, b) = second_tension(&SLENDER, 0.7, 3.0);
        assert!((a - a.transpose()).norm() < 1e-15 && (b - b.transpose()).norm() < 1e-15);
    }

    /// One element of a cantilever, with M₂: λ₁ of (1.875104)⁴ to 2.2e-4; without M₂ the element's error is 9.5e-3
    /// (root of cos·cosh = −1).
    #[test]
    fn one_element_of_a_cantilever() {
        let (k, m, m2) = (stiffness(&SLENDER, 1.0), mass(&SLENDER, 1.0), second_mass(&SLENDER, 1.0));
        let det = |lambda: f64, with: f64| {
            (k - m * lambda - m2 * (with * lambda * lambda)).fixed_view::<2, 2>(4, 4).determinant()
        };
        let root = |with: f64| {
            let (mut low, mut high) = (10.0, 14.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if det(middle, with) > 0.0 { low = middle } else { high = middle }
            }
            low
        };
        let exact = 1.875_104_068_711_961f64.powi(4);
        assert!((root(0.0) / exact - 1.0).abs() > 5e-3);
        assert!((root(1.0) / exact - 1.0).abs() < 2.5e-4, "{}", root(1.0) / exact - 1.0);
    }
}
