//! Where a beam becomes flexible at one of its ends: a rigid offset, and a spring that stands for the junction's own give.
//!
//! The spring sits at the edge of the junction and carries normal force N, shear force V and moment M of the branch, seen
//! from the node outwards. It adds no body: its compliance goes in series with the first segment's joint, which lies half a
//! segment away. With d the distance from edge to joint, loads at the edge are N, V, M + d·V.
//!
//! A junction that is stiffer than what its offset leaves out has a spring of negative compliance. In series with a
//! segment of a long mesh that does no harm; with a segment shorter than the spring stands for, nothing would be left.
//! The edge is therefore moved outwards, rod by rod ([`JunctionEnd::settle`]), until rod and spring together are
//! compliant under every load. The compliance of the whole stays the same for segments of any length.
//!
//! Source of the numbers: [`super::junction_table`].

use super::bar::bar;
use super::junction_table::{self as table, ComplianceRow};
use super::scheme::Bar;
use crate::options::{CompileOptions, Junctions};
use bimorph_structure::Beam;
use nalgebra::Matrix3;

/// Effect of the junction at one end of a beam.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JunctionEnd {
    /// Length that belongs to the rigid body of the node (m).
    pub offset: f64,
    /// Compliance of the spring at the edge over (N, V, M) (m/N, rad/N, rad/(N·m)), of the branch seen from the node.
    pub spring: Matrix3<f64>,
    /// The root of the beam at an elastic anchor, which is compliant with every kind of junction.
    pub elastic: bool,
    /// Nothing else is there: neither another beam nor something rigid.
    pub free: bool,
}

impl JunctionEnd {
    /// Adds what a row of the table says of a branch of `beam` that meets another of width `other`; `mirrored` when the
    /// junction is the row's seen in a mirror along the branch. The larger offset holds.
    pub fn add(&mut self, row: &ComplianceRow, beam: &Beam, other: f64, mirrored: bool) {
        let unit = 1.0 / (beam.material.youngs_modulus * beam.thickness);
        let w = beam.width;
        let odd = if mirrored { -1.0 } else { 1.0 };
        let [edge, uu, ug, up, gg, gp, pp] = *row;
        let (ug, up) = (odd * ug, odd * up / w);
        let (gp, pp) = (gp / w, pp / (w * w));
        self.offset = self.offset.max(edge * other);
        self.spring += Matrix3::new(uu, ug, up, ug, gg, gp, up, gp, pp) * unit;
    }

    /// Moves the edge outwards until the spring is compliant under every load, by at most `most` (m).
    ///
    /// A rod of length ℓ between the old and the new edge becomes rigid, and its compliance P = [ℓ/EA, 0, 0; 0, ℓ³/3EI + ℓ/κGA,
    /// ℓ²/2EI; 0, ℓ²/2EI, ℓ/EI] is added to the spring's, seen from the new edge. Compliance that is still negative after
    /// `most` is omitted, since so short a beam has no length for its junctions.
    pub fn settle(&mut self, beam: &Beam, most: f64) {
        let old = self.spring;
        let most = f64::min(most, MAX_WIDTHS * beam.width);
        let mut rod = 0.0;
        while rod < most && !gives(&self.spring, beam) {
            rod = f64::min(rod + ROD * beam.width, most);
            self.spring = moved(&old, rod) + rod_compliance(beam, rod);
        }
        self.offset += rod;
        if !gives(&self.spring, beam) {
            self.spring = positive_part(&self.spring, beam);
        }
    }

    /// The spring's compliance over the stress of a joint at distance `d` (m) along the beam from the edge; `outwards`
    /// when the beam runs from this node, not towards it.
    pub fn at_joint(&self, d: f64, outwards: bool) -> Matrix3<f64> {
        // seen from the other end forces stay what they are, the moment changes sign
        let sign = if outwards { 1.0 } else { -1.0 };
        let carry = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, d, sign);
        carry.transpose() * self.spring * carry
    }
}

/// The bar of a beam between its junctions, as the model has it: with springs at its ends it is flexible in shear.
pub(super) fn bar_between(beam: &Beam, options: &CompileOptions, ends: &[JunctionEnd; 2]) -> Bar {
    let bar = bar(beam, options.shear || has_springs(options, ends), options.rotary_inertia);
    Bar { length: beam.length - (ends[0].offset + ends[1].offset), ..bar }
}

/// Whether the ends of a beam have springs: with calibrated junctions, and at elastic anchors.
pub(super) fn has_springs(options: &CompileOptions, ends: &[JunctionEnd; 2]) -> bool {
    options.junctions == Junctions::Calibrated || ends.iter().any(|end| end.elastic)
}

/// Step by which an edge is moved outwards, in widths.
const ROD: f64 = 1.0 / 64.0;
/// No junction reaches so far [widths].
const MAX_WIDTHS: f64 = 64.0;

/// A spring's compliance under loads at a distance `d` (m) outwards from its edge.
fn moved(spring: &Matrix3<f64>, d: f64) -> Matrix3<f64> {
    let carry = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, d, 1.0);
    carry.transpose() * spring * carry
}

/// Compliance of a rod of a beam, clamped at one end, under loads at the other.
fn rod_compliance(beam: &Beam, length: f64) -> Matrix3<f64> {
    let Bar { ea, ei, shear, .. } = bar(beam, true, false);
    let turned = length * length / (2.0 * ei);
    let across = length.powi(3) / (3.0 * ei) + length * shear;
    Matrix3::new(length / ea, 0.0, 0.0, 0.0, across, turned, 0.0, turned, length / ei)
}

/// The compliance in numbers of one size: strains (u, g, p·w) under (N, V, M/w), times E·t.
fn scaled(spring: &Matrix3<f64>, beam: &Beam) -> Matrix3<f64> {
    let (w, unit) = (beam.width, beam.material.youngs_modulus * beam.thickness);
    let scale = [1.0, 1.0, w];
    Matrix3::from_fn(|i, j| scale[i] * spring[(i, j)] * scale[j] * unit)
}

/// True where no load gains work from the spring, rounding aside: the pivots of its elimination are positive.
fn gives(spring: &Matrix3<f64>, beam: &Beam) -> bool {
    let a = scaled(spring, beam);
    let [first, second, third] = [0, 1, 2].map(|i| a[(i, i)] + 1e-9);
    let (l10, l20) = (a[(1, 0)] / first, a[(2, 0)] / first);
    let (second, beside) = (second - l10 * a[(1, 0)], a[(2, 1)] - l20 * a[(1, 0)]);
    let third = third - l20 * a[(2, 0)] - beside / second * beside;
    first > 0.0 && second > 0.0 && third > 0.0
}

/// The spring without what would gain work.
fn positive_part(spring: &Matrix3<f64>, beam: &Beam) -> Matrix3<f64> {
    let mut eigen = scaled(spring, beam).symmetric_eigen();
    eigen.eigenvalues.apply(|x| *x = x.max(0.0));
    let (w, unit) = (beam.width, beam.material.youngs_modulus * beam.thickness);
    let back = Matrix3::from_diagonal(&[1.0, 1.0, 1.0 / w].into());
    back * eigen.recompose() * back / unit
}

/// Row of [`table::CORNER`] at a ratio of widths (other over own, by its logarithm) and a turn (°), linear in between
/// and constant outside. For nearly equal widths, a step of the width in a straight beam counts by the square of its
/// logarithm. To first order the two beams already include it, so that a taper of many pieces converges to the beam
/// that it represents.
pub fn corner(ratio: f64, turn: f64) -> ComplianceRow {
    let (r, share) = place(&table::RATIOS, ratio.log2());
    let equal = table::RATIOS.len() / 2;
    let power = 1.0 + (1.0 - turn / 45.0).max(0.0);
    let share = match r {
        r if r == equal => share.powf(power),
        r if r + 1 == equal => 1.0 - (1.0 - share).powf(power),
        _ => share,
    };
    blend(&table::CORNER, (r, share), place(&table::TURNS, turn))
}

/// Row of a two-way table at a ratio of widths (other over own, by its logarithm) and an angle (°), linear in between and
/// constant outside.
pub fn interpolate<const N: usize>(
    rows: &[[ComplianceRow; N]; 9],
    ratio: f64,
    angles: &[f64; N],
    angle: f64,
) -> ComplianceRow {
    blend(rows, place(&table::RATIOS, ratio.log2()), place(angles, angle))
}

fn blend<const N: usize>(
    rows: &[[ComplianceRow; N]; 9],
    (r, share): (usize, f64),
    (a, part): (usize, f64),
) -> ComplianceRow {
    let mut row = [0.0; 7];
    for (k, value) in row.iter_mut().enumerate() {
        let along = |r: usize| rows[r][a][k] * (1.0 - part) + rows[r][a + 1][k] * part;
        *value = along(r) * (1.0 - share) + along(r + 1) * share;
    }
    row
}

/// The interval of a rising list that holds `x`, and where in it, 0 to 1.
fn place(marks: &[f64], x: f64) -> (usize, f64) {
    let k = marks.partition_point(|&m| m <= x).clamp(1, marks.len() - 1) - 1;
    (k, ((x - marks[k]) / (marks[k + 1] - marks[k])).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_structure::{Material, NodeId};

    /// A table is met at its marks, halved in between, and constant outside.
    #[test]
    fn linear_between_marks() {
        assert_eq!(place(&[0.0, 1.0, 3.0], -1.0), (0, 0.0));
        assert_eq!(place(&[0.0, 1.0, 3.0], 2.0), (1, 0.5));
        assert_eq!(place(&[0.0, 1.0, 3.0], 9.0), (1, 1.0));
        let row = interpolate(&table::CORNER, 1.0, &table::TURNS, 90.0);
        assert_eq!(row, table::CORNER[4][6]);
    }

    /// A settled spring is compliant under every load, and the compliance of spring and beam together is unchanged for
    /// any length of the beam that became rigid.
    #[test]
    fn settled_springs_give_way_and_change_nothing() {
        let material = Material {
            youngs_modulus: 160e9,
            poisson: 0.3,
            shear_modulus: None,
            density: 2300.0,
            viscosity: 0.0,
            fluid: 2e-6,
            thermal_expansion: 0.0,
            expansion_curve: None,
            ambient_temperature: 300.0,
            stress: 0.0,
            strength: None,
            fillet: None,
            anchor_quality: None,
            heat: None,
        };
        let beam = Beam {
            name: "arm".into(),
            a: NodeId(0),
            b: NodeId(1),
            length: 100e-6,
            angle: 0.0,
            width: 4e-6,
            thickness: 2e-6,
            material,
            temperature: None,
            heater: None,
        };
        let rows = table::CORNER.iter().flatten().chain(table::BAR.iter().flatten());
        for row in rows.chain(table::STEM.iter().flatten()).chain(table::CROSS.iter().flatten()) {
            let mut end = JunctionEnd::default();
            end.add(row, &beam, 4e-6, false);
            let (edge, raw) = (end.offset, end.spring);
            end.settle(&beam, 40e-6);
            assert!(gives(&end.spring, &beam), "{row:?}");
            let whole = |spring: &Matrix3<f64>, edge: f64| {
                let rest = 90e-6 - edge;
                moved(spring, rest) + rod_compliance(&beam, rest)
            };
            let (before, after) = (whole(&raw, edge), whole(&end.spring, end.offset));
            assert!((after - before).norm() < 1e-10 * before.norm(), "{row:?}");
        }
    }

    /// A straight taper cut into n pieces has in all less of a junction the finer it is cut.
    #[test]
    fn small_steps_of_the_width_add_up_to_nothing() {
        let total = |n: u32| f64::from(n) * corner(4f64.powf(1.0 / f64::from(n)), 0.0)[6];
        assert!(total(1024) < 0.02 * total(8), "{} {}", total(1024), total(8));
        assert_eq!(corner(2.0, 0.0), table::CORNER[6][0]);
    }

    /// No spring where nothing changes, and half a widths' offset at a right angle.
    #[test]
    fn landmarks() {
        assert_eq!(table::CORNER[4][0], [0.0; 7]);
        assert_eq!(
            [table::CORNER[4][6][0], table::STEM[0][0][0], table::BAR[8][3][0], table::CROSS[2][0][0]],
            [0.5; 4]
        );
    }
}
