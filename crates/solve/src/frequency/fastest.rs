//! The highest natural frequency in joint coordinates, which sets the steps of an explicit method.
//!
//! Power iteration on x → −q̈(εx): the recursion gives the accelerations of a small displacement under the springs
//! alone, and they satisfy the loops. The quotient of the norms grows towards ω²; sixty iterations come within a few
//! percent, which is enough to foretell the number of steps.

use bimorph_multibody::forces::RestStrain;
use bimorph_multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};

/// Displacement of the iterates over the scale of a coordinate: small against 1, large against rounding.
const SMALL: f64 = 1e-7;
/// Iterations.
const ROUNDS: usize = 60;

/// The fastest motion about the drawn configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Fastest {
    /// Angular frequency (rad/s).
    pub omega: f64,
    /// Body whose coordinate moves most.
    pub body: usize,
}

/// Highest natural frequency; none where accelerations are not finite or nothing is elastic. `scale` is the size of each
/// coordinate, `groups` the number of heated groups.
pub fn fastest(linkage: &Linkage, scale: &[f64], groups: usize) -> Option<Fastest> {
    let n = linkage.coordinates;
    let mut reduction = Reduction::<f64>::new(&[linkage]);
    let expansion = vec![0.0; groups];
    let rest = RestStrain { expansion: &expansion, built_in: 0.0 };
    reduction.prescribe(linkage, &rest);
    let zeros = vec![0.0; n];
    // a fixed start with a share in every direction
    let mut x: Vec<f64> = (0..n).map(|k| scale[k] * (1.0 + 0.3 * ((7 * k) % 11) as f64) * sign(k)).collect();
    let mut a = vec![0.0; n];
    let mut omega2 = 0.0;
    for _ in 0..ROUNDS {
        let size = norm(&x, scale);
        for x in &mut x {
            *x *= SMALL / size;
        }
        reduction.place(&x, &zeros);
        reduction.force.fill([0.0; 3]);
        reduction.torque.fill(0.0);
        reduction.add_elastic(linkage, &x, &rest);
        reduction.solve(ReductionTask::Accelerations, &mut a);
        omega2 = norm(&a, scale) / SMALL;
        if !omega2.is_finite() || omega2 == 0.0 {
            return None;
        }
        for (x, a) in x.iter_mut().zip(&a) {
            *x = -a;
        }
    }
    let size = |k: usize| (x[k] / scale[k]).abs();
    let most = (0..n).fold(0, |best, k| if size(k) > size(best) { k } else { best });
    Some(Fastest { omega: omega2.sqrt(), body: linkage.body_of(most) })
}

fn sign(k: usize) -> f64 {
    if k % 3 == 1 { -1.0 } else { 1.0 }
}

fn norm(x: &[f64], scale: &[f64]) -> f64 {
    x.iter().zip(scale).map(|(x, s)| (x / s) * (x / s)).sum::<f64>().sqrt()
}
