//! Two facing beams: C = ∫ ε·h·α/g(s) ds along their length, and contact along it.
//!
//! The gap is g(s) = g₀ + w(s), with w the cubic (Hermite) interpolation of the relative displacement and rotation of the
//! two pairs of ends: z = (w₁, φ₁, w₂, φ₂). Parallel beams get exactly SUGAR's nodal forces and moments, pl/2 and pl²/12
//! (its `gap2d`); tilted ones differ in second order, because here forces, stiffness and charge come from one potential.
//! With [`Facing::chord`] they do not: as SUGAR has it, the gap is then measured along the straight lines between the ends, while
//! its pressure acts through the cubics, so that the forces are the derivatives of no energy.
//! α is SUGAR's fringe factor 1 + 1.12·g₀/h. Quadrature of the field: Gauss–Legendre with six points; of the contact
//! pressure: Gauss–Lobatto with nine points, among them the ends, where tilted beams touch first, and the middle.

use super::contact::Contact;
use super::contact_loss::Loss;
use super::quotient::quotient;
use nalgebra::{Matrix4, Vector4};

/// Abscissae and weights of six-point Gauss–Legendre quadrature on 0…1.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_4, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// Abscissae and weights of nine-point Gauss–Lobatto quadrature on 0…1.
const LOBATTO: [(f64, f64); 9] = [
    (0.0, 0.013_888_888_888_888_89),
    (0.050_121_002_294_270_02, 0.082_747_680_780_404_59),
    (0.161_406_860_244_631_2, 0.137_269_356_250_081_2),
    (0.318_441_268_086_910_9, 0.173_214_255_486_522_97),
    (0.5, 0.185_759_637_188_208_62),
    (0.681_558_731_913_089_1, 0.173_214_255_486_522_97),
    (0.838_593_139_755_368_8, 0.137_269_356_250_081_2),
    (0.949_878_997_705_73, 0.082_747_680_780_404_59),
    (1.0, 0.013_888_888_888_888_89),
];

/// Constants of a pair of facing beams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Length [m].
    pub length: f64,
    /// Gap as drawn [m].
    pub gap: f64,
    /// ε·h·α, capacitance times gap per length [F].
    pub strength: f64,
    /// Electrode height h [m].
    pub height: f64,
    /// Distance at which the beams touch [m].
    pub touch: f64,
    /// The gap along the straight lines between the ends, as SUGAR measures it, instead of that along the cubics.
    pub chord: bool,
}

/// C(z) with gradient and Hessian.
#[derive(Debug, Clone, Copy)]
pub struct FacingCapacitance {
    /// C [F].
    pub value: f64,
    /// ∂C/∂z [F/m, F/rad]; along chords what the pressure exerts instead.
    pub gradient: Vector4<f64>,
    /// ∂²C/∂z²; along chords the symmetric part of the gradient's derivative.
    pub hessian: Matrix4<f64>,
}

impl Facing {
    /// Capacitance at the relative end displacements z = (w₁, φ₁, w₂, φ₂); positive w opens the gap.
    pub fn at(&self, z: &Vector4<f64>) -> FacingCapacitance {
        let mut c = FacingCapacitance { value: 0.0, gradient: Vector4::zeros(), hessian: Matrix4::zeros() };
        let closest = self.least();
        for (s, weight) in GAUSS {
            let (n, m) = (self.shape(s), self.measure(s));
            let g = self.gap + m.dot(z);
            let k = self.strength * self.length * weight;
            let d = g.max(closest);
            c.value += k * (1.0 / d + (d - g) / (d * d));
            c.gradient -= n * (k / (d * d));
            if g > closest {
                c.hessian += (n * m.transpose() + m * n.transpose()) * (k / (d * d * d));
            }
        }
        c
    }

    /// Least distance that the law of contact knows [m]; the field goes on along its tangent below.
    pub fn least(&self) -> f64 {
        Contact { touch: self.touch, area: 0.0 }.least()
    }

    /// The cubic's weights at the share `s` of the length: g(s) = g₀ + n·z.
    #[inline]
    fn shape(&self, s: f64) -> Vector4<f64> {
        let l = self.length;
        Vector4::new(
            1.0 - 3.0 * s * s + 2.0 * s * s * s,
            l * (s - 2.0 * s * s + s * s * s),
            3.0 * s * s - 2.0 * s * s * s,
            l * (s * s * s - s * s),
        )
    }

    /// The weights with which the gap is measured there: g(s) = g₀ + m·z.
    #[inline]
    fn measure(&self, s: f64) -> Vector4<f64> {
        if self.chord { Vector4::new(1.0 - s, 0.0, s, 0.0) } else { self.shape(s) }
    }

    /// Smallest distance among the points where contact is looked at [m], and its derivative with z.
    pub fn closest(&self, z: &Vector4<f64>) -> (f64, Vector4<f64>) {
        let at = LOBATTO.map(|(s, _)| (self.gap + self.shape(s).dot(z), s));
        let (g, s) = at.into_iter().fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a });
        (g, self.shape(s))
    }

    /// True when the cubic stays above the touching distance, as its Bernstein coefficients do.
    #[inline]
    fn apart(&self, z: &Vector4<f64>) -> bool {
        let third = self.length / 3.0;
        let least = z[0].min(z[0] + third * z[1]).min(z[2] - third * z[3]).min(z[2]);
        self.gap + least >= self.touch
    }

    fn piece(&self, weight: f64) -> Contact {
        Contact { touch: self.touch, area: self.height * self.length * weight }
    }

    /// Gradient and Hessian of the contact's potential with z.
    pub fn contact(&self, z: &Vector4<f64>) -> (Vector4<f64>, Matrix4<f64>) {
        let (mut first, mut second) = (Vector4::zeros(), Matrix4::zeros());
        if self.apart(z) {
            return (first, second);
        }
        for (s, weight) in LOBATTO {
            let n = self.shape(s);
            let g = self.gap + n.dot(z);
            if g < self.touch {
                let (force, slope) = self.piece(weight).force(g);
                first -= n * force;
                second -= n * n.transpose() * slope;
            }
        }
        (first, second)
    }

    /// Where the contact presses: the weights of z in the gap, the force [N] and its derivative with the gap [N/m].
    pub(super) fn pressed(&self, z: &Vector4<f64>) -> impl Iterator<Item = (Vector4<f64>, f64, f64)> {
        let points = if self.apart(z) { &LOBATTO[..0] } else { &LOBATTO[..] };
        points.iter().filter_map(|&(s, weight)| {
            let n = self.shape(s);
            let g = self.gap + n.dot(z);
            (g < self.touch).then(|| {
                let (force, slope) = self.piece(weight).force(g);
                (n, force, slope)
            })
        })
    }

    /// Discrete force over z and its derivative with the end of a step of length `h` [s] from `z0` to `z1`: of the field at `volts` [V], and of
    /// the contact with its `loss`.
    pub(super) fn quotient(
        &self,
        (z0, z1): (&Vector4<f64>, &Vector4<f64>),
        (volts, h): (f64, f64),
        loss: &Loss,
    ) -> (Vector4<f64>, Matrix4<f64>) {
        let (mut first, mut second) = (Vector4::zeros(), Matrix4::zeros());
        let closest = self.least();
        for (s, weight) in GAUSS.iter().filter(|_| volts != 0.0) {
            let (n, m) = (self.shape(*s), self.measure(*s));
            let k = -0.5 * volts * volts * self.strength * self.length * weight;
            let energy = |g: f64| {
                let d = g.max(closest);
                k * (1.0 / d + (d - g) / (d * d))
            };
            let slope = |g: f64| {
                let d = g.max(closest);
                (-k / (d * d), if g > closest { 2.0 * k / (d * d * d) } else { 0.0 })
            };
            let [g0, g1] = [z0, z1].map(|z| self.gap + m.dot(z));
            let (force, by_end) = quotient((g0, energy(g0)), (g1, energy(g1)), slope);
            first += n * force;
            second += (n * m.transpose() + m * n.transpose()) * (0.5 * by_end);
        }
        if self.apart(z0) && self.apart(z1) {
            return (first, second);
        }
        for (s, weight) in LOBATTO {
            let (n, piece) = (self.shape(s), self.piece(weight));
            let [g0, g1] = [z0, z1].map(|z| self.gap + n.dot(z));
            if g0.min(g1) >= self.touch {
                continue;
            }
            let slope = |g: f64| {
                let (force, slope) = piece.force(g);
                (-force, -slope)
            };
            let (force, by_end) = quotient((g0, piece.energy(g0)), (g1, piece.energy(g1)), slope);
            let (added, by_rate) = loss.fraction((g0 - g1) / h);
            first += n * (force * (1.0 + added));
            second += n * n.transpose() * (by_end * (1.0 + added) - force * by_rate / h);
        }
        (first, second)
    }

    /// Energy stored in the contact [J].
    pub fn contact_energy(&self, z: &Vector4<f64>) -> f64 {
        LOBATTO.iter().map(|&(s, weight)| self.piece(weight).energy(self.gap + self.shape(s).dot(z))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facing() -> Facing {
        Facing { length: 100e-6, gap: 2e-6, strength: 8.854e-12 * 2e-6, height: 2e-6, touch: 0.1e-6, chord: false }
    }

    /// Parallel beams: C = εhl/g, and the work-equivalent nodal loads of a uniform pressure, l/2 and l²/12 (SUGAR gap2d).
    #[test]
    fn parallel_beams_match_sugar() {
        let f = facing();
        let c = f.at(&Vector4::zeros());
        let line = f.strength / (f.gap * f.gap);
        assert!((c.value / (f.strength * f.length / f.gap) - 1.0).abs() < 1e-14);
        let expected = Vector4::new(0.5, f.length / 12.0, 0.5, -f.length / 12.0) * (-line * f.length);
        assert!((c.gradient - expected).abs().max() < 1e-14 * expected.abs().max());
    }

    /// Tilted beams along chords get the loads that SUGAR's `gap2dforce` integrates: the pressure k/(g₀ + (1 − s)·w₁ + s·w₂)² in
    /// the weights of a cubic (sums over 4000 intervals, by Simpson's rule).
    #[test]
    fn tilted_beams_along_chords_match_sugar() {
        let f = Facing { chord: true, ..facing() };
        let z = Vector4::new(-0.3e-6, 4e-3, -0.35e-6, -6e-3);
        let (n, mut sum) = (4000, Vector4::zeros());
        for k in 0..=n {
            let s = f64::from(k) / f64::from(n);
            let weight = if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
            let g = f.gap + (1.0 - s) * z[0] + s * z[2];
            sum -= f.shape(s) * (weight / (3.0 * f64::from(n)) * f.strength * f.length / (g * g));
        }
        let loads = f.at(&z).gradient;
        assert!((loads - sum).abs().component_div(&sum.abs()).max() < 1e-12, "{loads} {sum}");
        assert!((loads - facing().at(&z).gradient).norm() > 1e-3 * loads.norm());
    }

    /// Gradient and Hessian are the derivatives of C: central differences to their own error.
    #[test]
    fn derivatives_match_central_differences() {
        let f = facing();
        let z = Vector4::new(-0.3e-6, 4e-3, 0.2e-6, -6e-3);
        let c = f.at(&z);
        for i in 0..4 {
            let step = if i % 2 == 0 { 1e-11 } else { 1e-7 };
            let (mut lo, mut hi) = (z, z);
            lo[i] -= step;
            hi[i] += step;
            let (lo, hi) = (f.at(&lo), f.at(&hi));
            let slope = (hi.value - lo.value) / (2.0 * step);
            assert!((slope - c.gradient[i]).abs() < 1e-5 * c.gradient[i].abs());
            let column = (hi.gradient - lo.gradient) / (2.0 * step);
            assert!((column - c.hessian.column(i)).norm() < 1e-6 * c.hessian.column(i).norm());
        }
    }

    /// Contact's gradient is the derivative of its energy and its Hessian that of the gradient, on a tilted, bent pair that
    /// touches along a part: central differences. Parallel beams bear p·h·l whatever the length of the elements.
    #[test]
    fn contact_comes_from_one_potential() {
        let f = facing();
        let z = Vector4::new(-1.93e-6, 2e-4, -1.915e-6, 3e-4);
        let (first, second) = f.contact(&z);
        for i in 0..4 {
            let step = if i % 2 == 0 { 1e-12 } else { 1e-8 };
            let (mut lo, mut hi) = (z, z);
            lo[i] -= step;
            hi[i] += step;
            let slope = (f.contact_energy(&hi) - f.contact_energy(&lo)) / (2.0 * step);
            assert!((slope - first[i]).abs() < 1e-5 * first[i].abs(), "{i}: {slope} {}", first[i]);
            let column = (f.contact(&hi).0 - f.contact(&lo).0) / (2.0 * step);
            assert!((column - second.column(i)).norm() < 1e-5 * column.norm(), "{i}");
        }
        let flat = Vector4::new(-1.92e-6, 0.0, -1.92e-6, 0.0);
        let half = Facing { length: 50e-6, ..f };
        let sum = |f: &Facing| f.contact(&flat).0[0] + f.contact(&flat).0[2];
        let pressure = Contact { touch: 0.1e-6, area: 1.0 }.force(0.08e-6).0;
        assert!((sum(&f) / (-pressure * 2e-6 * 100e-6) - 1.0).abs() < 1e-9);
        assert!((2.0 * sum(&half) / sum(&f) - 1.0).abs() < 1e-9);
    }
}
