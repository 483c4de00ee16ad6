//! A stretch of two facing beams: C = ∫ ε·h·α·(1/g(s) + e(g(s))) ds along its length, and contact along it.
//!
//! The gap is g(s) = g₀ + w(s), with w the cubic (Hermite) interpolation of the relative displacement and rotation of the
//! two pairs of ends: z = (w₁, φ₁, w₂, φ₂). Parallel beams get exactly SUGAR's nodal forces and moments, pl/2 and pl²/12
//! (its `gap2d`); tilted ones differ in second order, because here forces, stiffness and charge come from one potential.
//! With [`FacingStretch::chord`] they do not. As in SUGAR, the gap is then measured along the straight lines between the
//! ends, while its pressure acts through the cubics, so that the forces do not derive from an energy.
//! α is 1, or SUGAR's fringe factor 1 + 1.12·g₀/h. Other laws of the fringe field add e(g) to 1/g ([`super::edge_field`]). Quadrature of the field is Gauss–Legendre, of the contact pressure Gauss–Lobatto,
//! whose points include the ends, where tilted beams touch first ([`super::quadrature`]): six and nine points on a gap of one
//! stretch, three and five on each of several.

use super::capacitor::Capacitor;
use super::contact::Contact;
use super::edge_field::EdgeField;
use super::point_law::{Law, PointLaw};
use super::quadrature::{Abscissa, GAUSS_3, GAUSS_6, LOBATTO_5, LOBATTO_9};
use bimorph_structure::InsulatingLayer;
use nalgebra::{Matrix4, Vector4};

/// Constants of a stretch of facing beams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacingStretch {
    /// Length (m).
    pub length: f64,
    /// Gap as drawn (m).
    pub gap: f64,
    /// ε·h·α, capacitance times gap per length without the field at the edges (F).
    pub strength: f64,
    /// Field at the edges.
    pub edges: EdgeField,
    /// Insulating layer between the beams.
    pub insulation: Option<InsulatingLayer>,
    /// Electrode height h (m).
    pub height: f64,
    /// Distance at which the beams touch (m).
    pub touch: f64,
    /// The gap along the straight lines between the ends, as SUGAR measures it, instead of that along the cubics.
    pub chord: bool,
    /// The gap consists of this stretch alone, which takes more points.
    pub alone: bool,
}

/// C(z) with gradient and Hessian.
#[derive(Debug, Clone, Copy)]
pub struct FacingCapacitance {
    /// C (F).
    pub value: f64,
    /// ∂C/∂z (F/m, F/rad); along chords what the pressure exerts instead.
    pub gradient: Vector4<f64>,
    /// ∂²C/∂z²; along chords the symmetric part of the gradient's derivative.
    pub hessian: Matrix4<f64>,
}

impl FacingStretch {
    /// Capacitance at the relative end displacements z = (w₁, φ₁, w₂, φ₂); positive w opens the gap.
    pub fn at(&self, z: &Vector4<f64>) -> FacingCapacitance {
        let (mut value, mut gradient, mut hessian) = (0.0, Vector4::zeros(), Matrix4::zeros());
        self.field(z, |node, [c, slope, curvature]| {
            let n = Vector4::from(node.shape);
            value += c;
            gradient += n * slope;
            if self.chord {
                let m = self.measure(node);
                hessian += (n * m.transpose() + m * n.transpose()) * (0.5 * curvature);
            } else {
                hessian += n * (n * curvature).transpose();
            }
        });
        let scale = self.scale();
        let hessian = Matrix4::from_fn(|i, j| hessian[(i, j)] * (scale[i] * scale[j]));
        FacingCapacitance { value, gradient: gradient.component_mul(&scale), hessian }
    }

    /// C(z) alone (F).
    #[inline]
    pub fn capacitance(&self, z: &Vector4<f64>) -> f64 {
        let mut value = 0.0;
        self.field(z, |_, [c, ..]| value += c);
        value
    }

    /// Its gradient alone.
    #[inline]
    pub fn gradient(&self, z: &Vector4<f64>) -> Vector4<f64> {
        let mut gradient = Vector4::zeros();
        self.field(z, |node, [_, slope, _]| gradient += Vector4::from(node.shape) * slope);
        gradient.component_mul(&self.scale())
    }

    /// Change of ∂Π/∂z at `volts` where the distance at the fraction s of the stretch is smaller by `bent(s)` (m).
    #[inline]
    pub fn shape_force(&self, z: &Vector4<f64>, volts: f64, bent: impl Fn(f64) -> f64) -> Vector4<f64> {
        let mut change = Vector4::zeros();
        self.field(z, |node, [.., curvature]| {
            change += Vector4::from(node.shape) * (0.5 * volts * volts * curvature * bent(node.at));
        });
        change.component_mul(&self.scale())
    }

    /// `see` gets each point of the field's rule with what it adds to C (F), and the derivatives of that with the distance there.
    #[inline(always)]
    fn field(&self, z: &Vector4<f64>, mut see: impl FnMut(&Abscissa, [f64; 3])) {
        let (gap, closest) = self.open();
        let (scaled, along) = (z.component_mul(&self.scale()), self.strength * self.length);
        for node in self.gauss() {
            let n = self.measure(node);
            see(node, self.across(gap + n.dot(&scaled), along * node.weight, closest));
        }
    }

    /// Distance of the field as drawn, and that below which it continues along its tangent (m). An insulating layer shortens both, the second one to half of what the layer
    /// counts for.
    #[inline]
    pub(super) fn open(&self) -> (f64, f64) {
        match self.insulation {
            None => (self.gap, self.least()),
            Some(layer) => {
                let short = layer.shortening();
                (self.gap - short, (self.least() - short).max(0.5 * layer.series()))
            }
        }
    }

    /// Capacitance at the distance `g` of what has k = ε·h·α·length (F·m), and its first two derivatives with g; on below `closest` along the tangent.
    #[inline(always)]
    pub(super) fn across(&self, g: f64, k: f64, closest: f64) -> [f64; 3] {
        let d = g.max(closest);
        let inverse = 1.0 / d;
        let (mut value, mut slope) = (k * inverse, -k * inverse * inverse);
        let mut curvature = -2.0 * slope * inverse;
        if !matches!(self.edges, EdgeField::None) {
            let edges = self.edges.at(d);
            value += k * edges[0];
            slope += k * edges[1];
            curvature += k * edges[2];
        }
        [value + slope * (g - d), slope, if g > closest { curvature } else { 0.0 }]
    }

    /// Least distance of the law of contact (m); below it the field continues along its tangent.
    #[inline]
    pub fn least(&self) -> f64 {
        Contact { touch: self.touch, area: 0.0 }.least()
    }

    /// Factors from shape functions of unit length to z.
    #[inline]
    pub(super) fn scale(&self) -> Vector4<f64> {
        Vector4::new(1.0, self.length, 1.0, self.length)
    }

    /// The distance at a point of a rule (m).
    #[inline]
    pub(super) fn distance(&self, node: &Abscissa, z: &Vector4<f64>) -> f64 {
        self.gap + Vector4::from(node.shape).dot(&z.component_mul(&self.scale()))
    }

    /// Approach at a point of a rule: by how much the distance is smaller than drawn (m).
    #[inline]
    pub(super) fn approach(&self, node: &Abscissa, z: &Vector4<f64>) -> f64 {
        self.gap - self.distance(node, z)
    }

    /// The laws of the points of the field's rule, then of the contact's, which loses energy by χ = `loss` (s/m).
    pub(super) fn point_laws(&self, loss: f64) -> Vec<PointLaw> {
        let (open, closest) = self.open();
        let plates = |strength: f64| Capacitor::Plates {
            strength,
            edges: [self.edges, EdgeField::None],
            gap: self.gap,
            shortening: self.gap - open,
            closest,
        };
        let field = self.gauss().iter().map(|node| Law::Field(plates(self.strength * self.length * node.weight), None));
        let contact = self.lobatto().iter().map(|node| Law::Field(plates(0.0), Some(self.piece(node.weight))));
        field.map(PointLaw::of).chain(contact.map(|law| PointLaw { loss, ..PointLaw::of(law) })).collect()
    }

    /// The rule of the field.
    #[inline]
    pub(super) fn gauss(&self) -> &'static [Abscissa] {
        if self.alone { &GAUSS_6 } else { &GAUSS_3 }
    }

    /// The weights with which the gap is measured at a point of that rule, of a unit length.
    #[inline]
    pub(super) fn measure(&self, node: &Abscissa) -> Vector4<f64> {
        match self.chord {
            true => Vector4::new(1.0 - node.at, 0.0, node.at, 0.0),
            false => Vector4::from(node.shape),
        }
    }

    /// The rule of the contact.
    pub(super) fn lobatto(&self) -> &'static [Abscissa] {
        if self.alone { &LOBATTO_9 } else { &LOBATTO_5 }
    }

    /// Smallest distance among the points of the contact's rule (m), and its derivative with z.
    #[inline]
    pub fn closest(&self, z: &Vector4<f64>) -> (f64, Vector4<f64>) {
        let mut found = (f64::INFINITY, &self.lobatto()[0]);
        for node in self.lobatto() {
            let g = self.distance(node, z);
            if g < found.0 {
                found = (g, node);
            }
        }
        (found.0, Vector4::from(found.1.shape).component_mul(&self.scale()))
    }

    /// True when the cubic stays above the touching distance, as its Bernstein coefficients do.
    #[inline]
    pub fn apart(&self, z: &Vector4<f64>) -> bool {
        let third = self.length / 3.0;
        let least = z[0].min(z[0] + third * z[1]).min(z[2] - third * z[3]).min(z[2]);
        self.gap + least >= self.touch
    }

    /// The contact that a point of that rule of some weight stands for.
    pub(super) fn piece(&self, weight: f64) -> Contact {
        Contact { touch: self.touch, area: self.height * self.length * weight }
    }

    /// Gradient and Hessian of the contact's potential with z.
    pub fn contact(&self, z: &Vector4<f64>) -> (Vector4<f64>, Matrix4<f64>) {
        let (mut first, mut second) = (Vector4::zeros(), Matrix4::zeros());
        if self.apart(z) {
            return (first, second);
        }
        for node in self.lobatto() {
            let g = self.distance(node, z);
            if g < self.touch {
                let n = Vector4::from(node.shape).component_mul(&self.scale());
                let (force, slope) = self.piece(node.weight).force(g);
                first -= n * force;
                second -= n * n.transpose() * slope;
            }
        }
        (first, second)
    }

    /// ∂Π/∂z: the field at `volts`, and the contact.
    #[inline]
    pub fn load(&self, z: &Vector4<f64>, volts: f64) -> Vector4<f64> {
        let field = if volts == 0.0 { Vector4::zeros() } else { self.gradient(z) * (-0.5 * volts * volts) };
        if self.apart(z) { field } else { field + self.contact(z).0 }
    }

    /// ∂Π/∂z and ∂²Π/∂z²; none where nothing acts.
    #[inline]
    pub fn load_and_stiffness(&self, z: &Vector4<f64>, volts: f64) -> Option<(Vector4<f64>, Matrix4<f64>)> {
        let (apart, factor) = (self.apart(z), -0.5 * volts * volts);
        if apart && volts == 0.0 {
            return None;
        }
        let (mut first, mut second) = (Vector4::zeros(), Matrix4::zeros());
        if volts != 0.0 {
            let field = self.at(z);
            (first, second) = (field.gradient * factor, field.hessian * factor);
        }
        if !apart {
            let (force, stiffness) = self.contact(z);
            first += force;
            second += stiffness;
        }
        Some((first, second))
    }

    /// Energy stored in the contact (J).
    #[inline]
    pub fn contact_energy(&self, z: &Vector4<f64>) -> f64 {
        if self.apart(z) {
            return 0.0;
        }
        self.lobatto().iter().map(|node| self.piece(node.weight).energy(self.distance(node, z))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::quadrature::hermite;
    use super::*;

    fn facing() -> FacingStretch {
        FacingStretch {
            length: 100e-6,
            gap: 2e-6,
            strength: 8.854e-12 * 2e-6,
            edges: EdgeField::None,
            insulation: None,
            height: 2e-6,
            touch: 0.1e-6,
            chord: false,
            alone: true,
        }
    }

    fn shape(length: f64, s: f64) -> Vector4<f64> {
        Vector4::from(hermite(s)).component_mul(&Vector4::new(1.0, length, 1.0, length))
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
        let f = FacingStretch { chord: true, ..facing() };
        let z = Vector4::new(-0.3e-6, 4e-3, -0.35e-6, -6e-3);
        let (n, mut sum) = (4000, Vector4::zeros());
        for k in 0..=n {
            let s = f64::from(k) / f64::from(n);
            let weight = if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
            let g = f.gap + (1.0 - s) * z[0] + s * z[2];
            sum -= shape(f.length, s) * (weight / (3.0 * f64::from(n)) * f.strength * f.length / (g * g));
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

    /// Charge, force and stiffness belong to one energy under every law of the fringe field: gradient and Hessian are the derivatives of C, by differences of
    /// fourth order to 1e-7. The states are bent: open, near contact and below the least distance.
    #[test]
    fn every_law_has_one_energy() {
        let edges = [
            EdgeField::None,
            EdgeField::Parallel { factor: 0.65 / 2e-6, inverse: 1.0 / 2e-6 },
            EdgeField::between_bars(2e-6, 1e-6, 2e-6),
            EdgeField::over_plane(2e-6, 1e-6, 2e-6),
        ];
        let states = [
            [-0.3e-6, 4e-3, 0.2e-6, -6e-3],
            [-1.5e-6, 2e-3, -1.3e-6, 5e-3],
            [-1.95e-6, 0.0, -1.95e-6, 0.0],
            [3e-6, -2e-2, 1e-6, 1e-2],
        ];
        for (edges, state) in edges.iter().flat_map(|edges| states.map(|state| (*edges, state))) {
            let (f, z) = (FacingStretch { edges, ..facing() }, Vector4::from(state));
            let c = f.at(&z);
            assert!((f.capacitance(&z) / c.value - 1.0).abs() < 1e-14);
            assert!((f.gradient(&z) - c.gradient).norm() < 1e-14 * c.gradient.norm());
            for i in 0..4 {
                let step = if i % 2 == 0 { 1e-10 } else { 2e-6 };
                let [a, b, d, e] = [-2.0, -1.0, 1.0, 2.0].map(|n| {
                    let mut moved = z;
                    moved[i] += n * step;
                    f.at(&moved)
                });
                let slope = (a.value - e.value + 8.0 * (d.value - b.value)) / (12.0 * step);
                let scale = if i % 2 == 0 { 1.0 } else { f.length };
                assert!(
                    (slope - c.gradient[i]).abs() < 1e-7 * c.gradient[0].abs() * scale,
                    "{edges:?} {state:?} {i}: {slope} {}",
                    c.gradient[i]
                );
                let column = (a.gradient - e.gradient + (d.gradient - b.gradient) * 8.0) / (12.0 * step);
                let off = column - c.hessian.column(i);
                let bound = 1e-7 * scale * c.hessian[(0, 0)].abs().max(1e-9 * c.gradient[0].abs() / f.gap);
                assert!(off[0].abs() < bound && off[2].abs() < bound, "{edges:?} {state:?} {i}: {off}");
                assert!(off[1].abs().max(off[3].abs()) < bound * f.length, "{edges:?} {state:?} {i}: {off}");
            }
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
        let half = FacingStretch { length: 50e-6, ..f };
        let sum = |f: &FacingStretch| f.contact(&flat).0[0] + f.contact(&flat).0[2];
        let pressure = Contact { touch: 0.1e-6, area: 1.0 }.force(0.08e-6).0;
        assert!((sum(&f) / (-pressure * 2e-6 * 100e-6) - 1.0).abs() < 1e-9);
        assert!((2.0 * sum(&half) / sum(&f) - 1.0).abs() < 1e-9);
    }
}
