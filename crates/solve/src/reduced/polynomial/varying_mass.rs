//! Masses and damping of a file that vary with the coordinates.
//!
//! ```text
//! T/E = ½·Σ_j (M_j + Σ_l D_jl·x_l)·ẋ_j²      d/dt((M_j + Σ_l D_jl·x_l)·ẋ_j) − ½·Σ_i D_ij·ẋ_i²
//! ```
//! The first is the kinetic energy, the second its part of the equation of coordinate j. M_j are the masses at rest, where the mass matrix is
//! diagonal. Entries between two coordinates change a frequency in the second order only, and are left out. So are changes below a fiftieth of the
//! tolerance, and those of fast coordinates, whose masses are small beside their springs.
//!
//! Drag of bodies varies as their masses do:
//! ```text
//! F_j = Σ_k g_j·C_jk·g_k·ẋ_k      g_j = 1 + Σ_l G_jl·x_l
//! ```
//! C is the damping at rest. The product has no negative power wherever g is, and its noise is that of C with g as gains.

use super::fast_coordinates::FAST;
use crate::reduced::space::{ReducedForces, ReducedSpace, dot};
use bimorph_multibody::forces::add_damping;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::TreeKinematics;
use bimorph_multibody::planar::Pose;
use nalgebra::{DMatrix, DVector};

/// Step of the central differences, over the reach of a coordinate (1).
const STEP: f64 = 0.1;
/// Largest change for which a linear mass is taken (1): it stays positive beyond the reach.
const LARGE: f64 = 0.3;

/// D and G of coordinates with z = `scale`·R·x and these masses, which reach `reach`, without relative changes below `least` (s², 1).
pub(super) fn slopes(
    space: &ReducedSpace,
    (rotation, scale): (&DMatrix<f64>, f64),
    (mass, reach): (&[f64], &[f64]),
    least: f64,
) -> [DMatrix<f64>; 2] {
    let m = mass.len();
    let slowest = mass.iter().copied().fold(0.0, f64::max);
    let inert: Vec<usize> = (0..m).filter(|&j| mass[j] >= FAST * slowest).collect();
    let at = |l: usize, step: f64| {
        bimorph_base::budget::check();
        let z: DVector<f64> = rotation.column(l) * (scale * step);
        let (mass, damping) = matrices(space, z.as_slice());
        let own = |matrix: &DMatrix<f64>| -> Vec<f64> {
            (0..m).map(|j| rotation.column(j).dot(&(matrix * rotation.column(j)))).collect()
        };
        [own(&mass), own(&damping)]
    };
    let rest = at(0, 0.0);
    let mut slopes = [DMatrix::zeros(m, m), DMatrix::zeros(m, m)];
    for (l, reach) in reach.iter().enumerate() {
        let step = STEP * reach;
        let (ahead, behind) = (at(l, step), at(l, -step));
        for (k, slopes) in slopes.iter_mut().enumerate() {
            for &j in inert.iter().filter(|&&j| rest[k][j] > 0.0) {
                let slope = (ahead[k][j] - behind[k][j]) / (2.0 * step * rest[k][j]);
                if (slope * reach).abs() > least {
                    slopes[(j, l)] = slope;
                }
            }
        }
    }
    for mut row in slopes.iter_mut().flat_map(|slopes| slopes.row_iter_mut()) {
        let change: f64 = row.iter().zip(reach).map(|(slope, reach)| (slope * reach).abs()).sum();
        if change > LARGE {
            row.fill(0.0);
        }
    }
    let [mut of_mass, of_damping] = slopes;
    of_mass.row_iter_mut().zip(mass).for_each(|(mut row, mass)| row *= *mass);
    [of_mass, of_damping * 0.5]
}

/// Masses and damping over z at a state (s², s).
pub(super) fn matrices(space: &ReducedSpace, z: &[f64]) -> (DMatrix<f64>, DMatrix<f64>) {
    let model = &space.joints.closures.model;
    let mut forces = ReducedForces::new(space);
    forces.place_at_rest(space, z);
    let placed: &TreeKinematics = &forces.placed;
    let moved: Vec<Vec<Pose>> = (space.directions.iter())
        .map(|direction| {
            let mut moved = vec![Pose::zeros(); direction.len()];
            placed.spread(&space.joints.tree, direction, &mut moved);
            moved
        })
        .collect();
    let m = space.size();
    let mass = DMatrix::from_fn(m, m, |k, l| model.mass_product(&moved[k], &moved[l]));
    let dragged: Vec<Vec<Pose>> = (moved.iter())
        .map(|moved| {
            let mut drag = vec![Pose::zeros(); moved.len()];
            add_damping(model, moved, &mut drag);
            drag
        })
        .collect();
    let damping = DMatrix::from_fn(m, m, |k, l| dot(&moved[k], &dragged[l]));
    ((&mass + mass.transpose()) * 0.5, damping)
}
