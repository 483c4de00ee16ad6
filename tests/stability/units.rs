//! The same mechanism in SI and in micrometres, nanograms and microseconds: direct elimination gives the same digits; a
//! penalty of a fixed number does not.

use super::mechanism::Stream;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use bimorph::multibody::planar::{JointFrame, Pose};
use bimorph::multibody::{Body, BodyId, BodyMatrix, Joint, Model, forces};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Vector3};

/// Metres, kilograms and seconds in the unit used: 1e6, 1e12 and 1e6 for µm, ng and µs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Units {
    pub(crate) length: f64,
    pub(crate) mass: f64,
    pub(crate) time: f64,
}

pub(crate) const SI: Units = Units { length: 1.0, mass: 1.0, time: 1.0 };
pub(crate) const SMALL: Units = Units { length: 1e6, mass: 1e12, time: 1e6 };

impl Units {
    fn force(self) -> f64 {
        self.mass * self.length / (self.time * self.time)
    }
}

/// A ladder of two cells, 100 µm rods of 2 µm × 2 µm polysilicon, with springs in its pins.
fn ladder(u: Units) -> (Model, Vec<usize>) {
    let l = 100e-6 * u.length;
    let mass = 2300.0 * 4e-12 * 100e-6 * u.mass;
    let spring = 165e9 * (16e-24 / 12.0) / 100e-6 * u.force() * u.length;
    let (mut bodies, mut joints): (Vec<Body>, Vec<Joint>) = (Vec::new(), Vec::new());
    let mut rod = |from: [f64; 2], to: [f64; 2]| {
        bodies.push(Body {
            name: format!("b{}", bodies.len()).into(),
            center: [0.5 * l * (from[0] + to[0]), 0.5 * l * (from[1] + to[1])].into(),
            mass,
            inertia: mass * l * l / 12.0,
            drag: Default::default(),
            free: None,
        });
        BodyId::Free(bodies.len() - 1)
    };
    let mut pins = Vec::new();
    let mut below = BodyId::Ground;
    for k in 0..2 {
        let y = k as f64;
        let (l0, r0, l1, r1) =
            ([0.1 * y, y], [1.0 - 0.05 * y, y], [0.1 * (y + 1.0), y + 1.0], [0.95 - 0.05 * y, y + 1.0]);
        let (left, right, rung) = (rod(l0, l1), rod(r0, r1), rod(l1, r1));
        pins.extend([(below, left, l0), (below, right, r0), (left, rung, l1), (right, rung, r1)]);
        below = rung;
    }
    for (a, b, at) in pins {
        let arm = |id: BodyId| match id {
            BodyId::Ground => Default::default(),
            BodyId::Free(k) => nalgebra::Vector2::new(l * at[0], l * at[1]) - bodies[k].center,
        };
        joints.push(Joint {
            a,
            b,
            frame: JointFrame { arm_a: arm(a), arm_b: arm(b), axis: [1.0, 0.0].into() },
            // along and across as stiff as a rod of that section; the joint coordinates leave them out
            stiffness: Matrix3::from_diagonal(&Vector3::new(
                165e9 * 4e-12 / 100e-6 * u.force() / u.length,
                165e9 * 4e-12 / 100e-6 * u.force() / u.length,
                spring,
            )),
            second: Matrix2::zeros(),
            expansion: None,
            rest: 0.0,
            locked: [true, true, false],
        });
    }
    Model::new(bodies, joints, Vec::new(), &[], false)
}

fn push(model: &Model, u: Units) -> Vec<[f64; 3]> {
    let mut s = Stream(11);
    (0..model.bodies.len())
        .map(|_| {
            let f = 1e-6 * u.force();
            [f * s.next(), f * s.next(), f * 1e-4 * u.length * s.next()]
        })
        .collect()
}

/// Accelerations of all bodies in SI (m/s², rad/s²).
fn in_si(a: &[[f64; 3]], u: Units) -> Vec<[f64; 3]> {
    let t = u.time * u.time;
    a.iter().map(|a| [a[0] * t / u.length, a[1] * t / u.length, a[2] * t]).collect()
}

/// By the recursion: local pivots, and the path for singular configurations.
pub(crate) fn by_recursion(u: Units) -> [Vec<[f64; 3]>; 2] {
    let (model, _) = ladder(u);
    let linkage = Linkage::new(&model);
    let zeros = vec![0.0; linkage.coordinates];
    let mut r = Reduction::<f64>::new(&[&linkage]);
    r.place(&zeros, &zeros);
    r.force = push(&model, u);
    let mut out = zeros.clone();
    r.reduce(ReductionTask::Accelerations, &mut out);
    let local = in_si(&r.accelerations, u);
    r.reduce_singular(ReductionTask::Accelerations, &mut out);
    [local, in_si(&r.accelerations, u)]
}

/// By the factor of an implicit step of 1 µs, M/h² + K with elastic pins: displacement over h².
pub(crate) fn by_factor(u: Units) -> Vec<[f64; 3]> {
    let (model, _) = ladder(u);
    let h = 1e-6 * u.time;
    let n = model.bodies.len();
    let q = vec![Pose::zeros(); n];
    let rest = forces::RestStrain { expansion: &[], built_in: 1.0 };
    let mut matrix = BodyMatrix::new(&model.pattern);
    let mut unused = q.clone();
    forces::add_tangent(&model, &q, &rest, &mut matrix, &mut unused);
    forces::add_inertia(&model, 1.0 / (h * h), 0.0, &mut matrix);
    matrix.factor(&model.pattern).unwrap();
    let mut x: Vec<Pose> = push(&model, u).into_iter().map(Pose::from).collect();
    matrix.solve(&model.pattern, &mut x);
    in_si(&x.iter().map(|x| [x.x / (h * h), x.y / (h * h), x.z / (h * h)]).collect::<Vec<_>>(), u)
}

/// By a penalty: (M + ρ·JᵀJ)·a = f, ρ the same bare number in all units.
pub(crate) fn by_penalty(u: Units, rho: f64) -> Vec<[f64; 3]> {
    let (model, _) = ladder(u);
    let n = 3 * model.bodies.len();
    let mut a = DMatrix::<f64>::zeros(n, n);
    for (k, body) in model.bodies.iter().enumerate() {
        for (i, x) in [body.mass, body.mass, body.inertia].into_iter().enumerate() {
            a[(3 * k + i, 3 * k + i)] = x;
        }
    }
    for joint in (0..model.joints.len()).map(|k| model.joint(k)) {
        for i in 0..2 {
            let mut row = DVector::<f64>::zeros(n);
            for (id, arm, sign) in [(joint.a, joint.frame.arm_a, -1.0), (joint.b, joint.frame.arm_b, 1.0)] {
                if let BodyId::Free(k) = id {
                    row[3 * k + i] = sign;
                    row[3 * k + 2] = sign * if i == 0 { -arm.y } else { arm.x };
                }
            }
            a += &row * row.transpose() * rho;
        }
    }
    let f = push(&model, u);
    let b = DVector::from_fn(n, |i, _| f[i / 3][i % 3]);
    let x = a.full_piv_lu().solve(&b).unwrap();
    in_si(&(0..n / 3).map(|k| [x[3 * k], x[3 * k + 1], x[3 * k + 2]]).collect::<Vec<_>>(), u)
}

/// Largest difference against the largest acceleration; rotations at a lever of 100 µm.
pub(crate) fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let unit = [1.0, 1.0, 1e-4];
    let largest = b.iter().flat_map(|x| (0..3).map(move |i| (x[i] * unit[i]).abs())).fold(0.0, f64::max);
    a.iter().zip(b).flat_map(|(x, y)| (0..3).map(move |i| ((x[i] - y[i]) * unit[i]).abs())).fold(0.0, f64::max)
        / largest
}

/// Accelerations agree to rounding between the two systems of units, by local pivots and by the path for singular
/// configurations; the factor of an implicit step agrees to rounding times its condition (1e6).
#[test]
fn same_digits() {
    let (si, small) = (by_recursion(SI), by_recursion(SMALL));
    assert!(apart(&small[0], &si[0]) < 1e-14 && apart(&small[1], &si[1]) < 1e-14);
    assert!(apart(&by_factor(SMALL), &by_factor(SI)) < 1e-9);
}

/// A penalty of 1e6, as good a number as any: seven digits lie between the two systems of units, and no choice from 1e-12 to
/// 1e12 is good to 1e-3 in both.
#[test]
fn penalties_have_units() {
    let right = &by_recursion(SI)[0];
    let errors = |rho: f64| [apart(&by_penalty(SI, rho), right), apart(&by_penalty(SMALL, rho), right)];
    let [si, small] = errors(1e6);
    assert!(si > 0.5 && small < 1e-5, "{si:e} {small:e}");
    for e in -12..=12 {
        let [si, small] = errors(10f64.powi(e));
        assert!(si.max(small) > 1e-3, "1e{e}: {si:e} {small:e}");
    }
}
