//! Where a beam becomes flexible at one of its ends: a rigid offset, and a spring that stands for the junction's own give.
//!
//! The spring sits at the edge of the junction and carries normal force N, shear force V and moment M of the branch, seen
//! from the node outwards. It adds no body: its compliance goes in series with the first segment's joint, which lies half a
//! segment away. With d the distance from edge to joint, loads at the edge are N, V, M + d·V.
//!
//! Source of the numbers: [`super::junction_table`].

use super::junction_table::{self as table, Row};
use crate::structure::Beam;
use nalgebra::Matrix3;

/// What the junction at one end does to a beam.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct End {
    /// Length that belongs to the rigid body of the node [m].
    pub offset: f64,
    /// Compliance of the spring at the edge over (N, V, M) [m/N, rad/N, rad/(N·m)], of the branch seen from the node.
    pub spring: Matrix3<f64>,
    /// Nothing else is there: neither another beam nor something rigid.
    pub free: bool,
}

impl End {
    /// Adds what a row of the table says of a branch of `beam` that meets another of width `other`; `mirrored` when the
    /// junction is the row's seen in a mirror along the branch. The larger offset holds.
    pub fn add(&mut self, row: &Row, beam: &Beam, other: f64, mirrored: bool) {
        let unit = 1.0 / (beam.material.youngs_modulus * beam.thickness);
        let w = beam.width;
        let odd = if mirrored { -1.0 } else { 1.0 };
        let [edge, uu, ug, up, gg, gp, pp] = *row;
        let (ug, up) = (odd * ug, odd * up / w);
        let (gp, pp) = (gp / w, pp / (w * w));
        self.offset = self.offset.max(edge * other);
        self.spring += Matrix3::new(uu, ug, up, ug, gg, gp, up, gp, pp) * unit;
    }

    /// The spring's compliance over the stress of a joint at distance `d` [m] along the beam from the edge; `outwards`
    /// when the beam runs from this node, not towards it.
    pub fn at_joint(&self, d: f64, outwards: bool) -> Matrix3<f64> {
        // seen from the other end forces stay what they are, the moment changes sign
        let sign = if outwards { 1.0 } else { -1.0 };
        let carry = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, d, sign);
        carry.transpose() * self.spring * carry
    }
}

/// Row of a two-way table at a ratio of widths (other over own, by its logarithm) and an angle [°], linear in between and
/// constant outside.
pub fn interpolate<const N: usize>(rows: &[[Row; N]; 9], ratio: f64, angles: &[f64; N], angle: f64) -> Row {
    let (r, share) = place(&table::RATIOS, ratio.log2());
    let (a, part) = place(angles, angle);
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

    /// A table is met at its marks, halved in between, and constant outside.
    #[test]
    fn linear_between_marks() {
        assert_eq!(place(&[0.0, 1.0, 3.0], -1.0), (0, 0.0));
        assert_eq!(place(&[0.0, 1.0, 3.0], 2.0), (1, 0.5));
        assert_eq!(place(&[0.0, 1.0, 3.0], 9.0), (1, 1.0));
        let row = interpolate(&table::CORNER, 1.0, &table::TURNS, 90.0);
        assert_eq!(row, table::CORNER[4][6]);
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
