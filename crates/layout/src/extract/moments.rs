//! Area, first and second moment of polygons by Green's theorem.

use std::ops::{AddAssign, SubAssign};

/// Integrals over an area about the origin of its frame, in the units of its coordinates.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// ∫ dA.
    pub area: f64,
    /// ∫ (x, y) dA.
    pub first: [f64; 2],
    /// ∫ (x² + y²) dA.
    pub second: f64,
}

impl Moments {
    /// Of a polygon given by its corners in either direction; the area is positive.
    pub fn of(corners: &[[f64; 2]]) -> Self {
        let Some(origin) = corners.first().copied() else { return Self::default() };
        // About a corner, so that small cells far from the origin lose no digits.
        let local = |p: [f64; 2]| [p[0] - origin[0], p[1] - origin[1]];
        let mut sum = Self::default();
        for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let (p, q) = (local(*p), local(*q));
            let cross = p[0] * q[1] - q[0] * p[1];
            sum.area += cross / 2.0;
            let squares = |i: usize| p[i] * p[i] + p[i] * q[i] + q[i] * q[i];
            sum.second += cross * (squares(0) + squares(1)) / 12.0;
            for i in 0..2 {
                sum.first[i] += cross * (p[i] + q[i]) / 6.0;
            }
        }
        if sum.area < 0.0 {
            sum = Self { area: -sum.area, first: sum.first.map(|x| -x), second: -sum.second };
        }
        sum.moved(origin)
    }

    /// The same area with its frame's origin at `by` of the old frame's place: every point moves by `by`.
    pub fn moved(self, by: [f64; 2]) -> Self {
        let [x, y] = by;
        Self {
            area: self.area,
            first: [self.first[0] + x * self.area, self.first[1] + y * self.area],
            second: self.second + 2.0 * (x * self.first[0] + y * self.first[1]) + (x * x + y * y) * self.area,
        }
    }

    /// The same shape with `area` added: the remainder of rounding.
    pub(super) fn grow(&mut self, area: f64) {
        if self.area > 0.0 {
            let by = (self.area + area) / self.area;
            *self = Self { area: self.area + area, first: self.first.map(|m| m * by), second: self.second * by };
        }
    }

    /// Centroid; the origin for nothing.
    pub fn centroid(&self) -> [f64; 2] {
        if self.area > 0.0 { self.first.map(|m| m / self.area) } else { [0.0; 2] }
    }

    /// Polar second moment about the centroid.
    pub fn polar(&self) -> f64 {
        let [x, y] = self.centroid();
        (self.second - (x * x + y * y) * self.area).max(0.0)
    }
}

impl AddAssign for Moments {
    fn add_assign(&mut self, other: Self) {
        self.area += other.area;
        self.second += other.second;
        for i in 0..2 {
            self.first[i] += other.first[i];
        }
    }
}

impl SubAssign for Moments {
    fn sub_assign(&mut self, other: Self) {
        *self += Self { area: -other.area, first: other.first.map(|x| -x), second: -other.second };
    }
}

#[cfg(test)]
mod tests {
    //! A box b·h far from the origin has area b·h, its centre as centroid, and b·h·(b²+h²)/12 about it, in either direction.
    use super::*;

    #[test]
    fn a_box_far_away() {
        let mut corners = [[1000.0, 500.0], [1004.0, 500.0], [1004.0, 502.0], [1000.0, 502.0]];
        for _ in 0..2 {
            let m = Moments::of(&corners);
            assert_eq!((m.area, m.centroid()), (8.0, [1002.0, 501.0]));
            assert!((m.polar() - 8.0 * 20.0 / 12.0).abs() < 1e-7, "{}", m.polar());
            corners.reverse();
        }
    }
}
