//! Orientation of an element: R = R_parent · Ry(oy) · Rz(oz) · Rx(ox), local to global, all right-handed.

/// A rotation matrix, row-major: columns are the local axes in global coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotation(pub(crate) [[f64; 3]; 3]);

/// Components smaller than this count as zero when an axis is asked to lie in the drawing plane (1).
const IN_PLANE: f64 = 1e-6;

impl Rotation {
    pub(crate) const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    /// This orientation turned further by the angles of an element (rad).
    pub(crate) fn turned(self, ox: f64, oy: f64, oz: f64) -> Self {
        let mut r = self;
        if oy != 0.0 {
            let (s, c) = oy.sin_cos();
            r = r.times([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]);
        }
        if oz != 0.0 {
            let (s, c) = oz.sin_cos();
            r = r.times([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]);
        }
        if ox != 0.0 {
            let (s, c) = ox.sin_cos();
            r = r.times([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]);
        }
        r
    }

    fn times(self, b: [[f64; 3]; 3]) -> Self {
        let a = self.0;
        Self(std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum())))
    }

    /// A local vector in global coordinates.
    pub(crate) fn apply(self, v: [f64; 3]) -> [f64; 3] {
        self.0.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// The local x axis in global coordinates.
    pub(crate) fn x_axis(self) -> [f64; 3] {
        [self.0[0][0], self.0[1][0], self.0[2][0]]
    }

    /// Angle of the local x axis in the drawing plane (rad).
    pub(crate) fn angle(self) -> f64 {
        self.0[1][0].atan2(self.0[0][0])
    }

    /// True when the local x axis lies in the drawing plane.
    pub(crate) fn x_in_plane(self) -> bool {
        self.0[2][0].abs() < IN_PLANE
    }

    /// Direction of the local y axis when x lies in the plane: `Some(1)` in the plane and to the left of x, `Some(-1)`
    /// to the right (mirrored), `Some(0)` normal to the plane, `None` when oblique.
    pub(crate) fn side(self) -> Option<i8> {
        let z = self.0[2][2];
        if (z.abs() - 1.0).abs() < IN_PLANE {
            Some(if z > 0.0 { 1 } else { -1 })
        } else if z.abs() < IN_PLANE {
            Some(0)
        } else {
            None
        }
    }
}
