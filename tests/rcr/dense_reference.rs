//! The judge: the same accelerations from one dense system in the bodies' own coordinates, by pivoted elimination.
//!
//! Every locked direction of every joint, tree or loop, is a constraint: [M Jᵀ; J 0]·[a; −λ] = [f; −J̇v], with J̇v from the
//! second derivatives of the strains. Of a pin the two material points must coincide, which is said along x and y: cut pins
//! of random coordinates stand open, and an open pin has other strains in its turning frame. Nothing of the recursion is used.

use bimorph::multibody::joint_coordinates::constrained_loops::Reduction;
use bimorph::multibody::planar::{Pose, Symmetric};
use bimorph::multibody::{BodyId, Joint, Model};
use nalgebra::{DMatrix, DVector, Rotation2, Vector6};

/// Accelerations of all bodies under `force`, at the configuration that `placed` holds; none where they are not unique.
pub(crate) fn accelerations(
    model: &Model,
    joints: &[Joint],
    placed: &Reduction<f64>,
    force: &[[f64; 3]],
) -> Option<Vec<[f64; 3]>> {
    let n = 3 * model.bodies.len();
    let constraints: usize = joints.iter().map(|j| j.locked.iter().filter(|&&l| l).count()).sum();
    let mut a = DMatrix::<f64>::zeros(n + constraints, n + constraints);
    let mut b = DVector::<f64>::zeros(n + constraints);
    for (k, body) in model.bodies.iter().enumerate() {
        for (i, m) in [body.mass, body.mass, body.inertia].into_iter().enumerate() {
            a[(3 * k + i, 3 * k + i)] = m;
            b[3 * k + i] = force[k][i];
        }
    }
    let of = |id: BodyId, f: &dyn Fn(usize) -> [f64; 3]| match id {
        BodyId::Ground => Pose::zeros(),
        BodyId::Free(k) => Pose::from(f(k)),
    };
    let mut at = n;
    for joint in joints {
        let (qa, qb) = (of(joint.a, &|k| placed.pose(k)), of(joint.b, &|k| placed.pose(k)));
        let (va, vb) = (of(joint.a, &|k| placed.rate(k)), of(joint.b, &|k| placed.rate(k)));
        let v = Vector6::new(va.x, va.y, va.z, vb.x, vb.y, vb.z);
        if joint.locked == [true, true, false] && joint.second[(1, 1)] == 0.0 {
            for axis in 0..2 {
                for (id, arm, sign) in [(joint.a, joint.frame.arm_a, -1.0), (joint.b, joint.frame.arm_b, 1.0)] {
                    if let BodyId::Free(k) = id {
                        let (turned, w) = (Rotation2::new(placed.pose(k)[2]) * arm, placed.rate(k)[2]);
                        let across = if axis == 0 { -turned.y } else { turned.x };
                        for (c, entry) in [(axis, sign), (2, sign * across)] {
                            a[(at, 3 * k + c)] += entry;
                            a[(3 * k + c, at)] += entry;
                        }
                        b[at] += sign * w * w * turned[axis];
                    }
                }
                at += 1;
            }
            continue;
        }
        let bend = [joint.second[(0, 0)], joint.second[(0, 1)], joint.second[(1, 1)]];
        let strain = joint.frame.kinematics(&qa, &qb, &bend);
        let rows = strain.rows();
        let scale = joint.frame.arm_a.norm().max(joint.frame.arm_b.norm());
        for i in 0..3 {
            if !joint.locked[i] {
                continue;
            }
            let unit = std::array::from_fn(|r| if r == i { 1.0 } else { 0.0 });
            let second = strain.tangent(&Symmetric::default(), &unit, &bend).matrix();
            let scale = if i == 2 { scale } else { 1.0 };
            for (id, first) in [(joint.a, 0), (joint.b, 3)] {
                if let BodyId::Free(k) = id {
                    for c in 0..3 {
                        a[(at, 3 * k + c)] += scale * rows[(i, first + c)];
                        a[(3 * k + c, at)] += scale * rows[(i, first + c)];
                    }
                }
            }
            b[at] = -scale * v.dot(&(second * v));
            at += 1;
        }
    }
    let matrix = a.clone();
    let lu = a.full_piv_lu();
    // a mechanism with more constraints than its loops can bear has no single answer
    let (last, first) = (lu.u().diagonal().amin(), lu.u().diagonal().amax());
    (last > 1e-9 * first).then(|| {
        let mut x = lu.solve(&b).unwrap();
        for _ in 0..3 {
            x += lu.solve(&residual(&matrix, &x, &b)).unwrap();
        }
        (0..model.bodies.len()).map(|k| [x[3 * k], x[3 * k + 1], x[3 * k + 2]]).collect()
    })
}

/// b − A·x in twice the precision, so that refinement leaves nothing of the judge's own rounding.
///
/// Reference: T. Ogita, S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005), algorithm 5.3.
fn residual(a: &DMatrix<f64>, x: &DVector<f64>, b: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(b.len(), |i, _| {
        let (mut sum, mut rest) = (b[i], 0.0);
        for j in 0..x.len() {
            let (p, y) = (-a[(i, j)] * x[j], sum);
            let lost = (-a[(i, j)]).mul_add(x[j], -p);
            sum += p;
            let back = sum - y;
            rest += ((y - (sum - back)) + (p - back)) + lost;
        }
        sum + rest
    })
}

/// Largest difference between two sets of accelerations against the largest acceleration; rotations times `lever`.
pub(crate) fn difference(a: &[[f64; 3]], b: &[[f64; 3]], lever: f64) -> f64 {
    let unit = [1.0, 1.0, lever];
    let largest = b.iter().flat_map(|x| (0..3).map(move |i| (x[i] * unit[i]).abs())).fold(0.0, f64::max);
    let apart = a.iter().zip(b).flat_map(|(x, y)| (0..3).map(move |i| ((x[i] - y[i]) * unit[i]).abs()));
    apart.fold(0.0, f64::max) / largest
}

/// A model's joints with both bodies given by their place in the model.
pub(crate) fn joints(model: &Model) -> Vec<Joint> {
    (0..model.joints.len()).map(|k| model.joint(k)).collect()
}
