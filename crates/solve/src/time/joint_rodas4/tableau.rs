//! The coefficients of Rodas4 over increments of the coordinates alone.
//!
//! With u_k the increments of the coordinates, Uv_i = u_i/(γh) − r₁ and Uz_i = Uv_i/(γh) − r₂ are themselves sums of
//! the u_k, of the rates v and the accelerations z at the start of the step. So every stage reads only the u_k of the
//! stages before it: a third of the data otherwise required. The arguments of inertia follow from the motions that the
//! solves have stored for each u_k.
//! ```text
//! rate of a stage           p_i·v + Σ V_ik·u_k/h
//! acceleration of a stage   t_i·z + a_i·v/h + Σ Z_ik·u_k/h²
//! r₁                        p_i·v + Σ R_ik·u_k/h
//! r₁/(γh) + r₂              t_i·z + s_i·v/h + Σ S_ik·u_k/h²
//! ```

use crate::time::rodas4::tableau::{A, C, GAMMA};

type TableauRows = [[f64; 6]; 6];

/// See the module. Row i belongs to stage i.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointTableau {
    /// V: rates by increments.
    pub(super) rate: TableauRows,
    /// p: rates, and r₁, by the rate at the start.
    pub(super) rate_start: [f64; 6],
    /// Z: accelerations by increments.
    pub(super) acceleration: TableauRows,
    /// t: accelerations, and what inertia acts on, by the acceleration at the start.
    pub(super) acceleration_start: [f64; 6],
    /// a: accelerations by the rate at the start.
    pub(super) acceleration_rate: [f64; 6],
    /// R: r₁ by increments.
    pub(super) lag: TableauRows,
    /// S: argument of inertia by increments.
    pub(super) push: TableauRows,
    /// s: argument of inertia by the rate at the start.
    pub(super) push_rate: [f64; 6],
}

/// Those of the method.
pub(super) const TABLEAU: JointTableau = tableau();

const fn tableau() -> JointTableau {
    let none = [[0.0; 6]; 6];
    let mut t = JointTableau {
        rate: none,
        rate_start: [1.0; 6],
        acceleration: none,
        acceleration_start: [1.0; 6],
        acceleration_rate: [0.0; 6],
        lag: none,
        push: none,
        push_rate: [0.0; 6],
    };
    // increments of rates and accelerations: over u_k, and over v at the start
    let (mut uv, mut uz, mut uz_v) = (none, none, [0.0; 6]);
    let mut i = 0;
    while i < 6 {
        let mut j = 0;
        // increments of rates hold −p·v, those of accelerations −t·z − uz_v·v/h
        while j < i {
            t.rate_start[i] -= A[i][j] * t.rate_start[j];
            t.acceleration_start[i] -= A[i][j] * t.acceleration_start[j];
            t.acceleration_rate[i] -= A[i][j] * uz_v[j];
            t.push_rate[i] -= C[i][j] * t.rate_start[j];
            t.lag[i][j] += C[i][j];
            let mut k = 0;
            while k <= j {
                t.rate[i][k] += A[i][j] * uv[j][k];
                t.acceleration[i][k] += A[i][j] * uz[j][k];
                t.push[i][k] += C[i][j] * uv[j][k];
                k += 1;
            }
            j += 1;
        }
        let mut k = 0;
        while k < i {
            t.lag[i][k] += t.rate[i][k];
            t.push[i][k] += t.acceleration[i][k] + t.lag[i][k] / GAMMA;
            uv[i][k] = -t.lag[i][k];
            uz[i][k] = -t.push[i][k];
            k += 1;
        }
        t.push_rate[i] += t.acceleration_rate[i] + t.rate_start[i] / GAMMA;
        uv[i][i] = 1.0 / GAMMA;
        uz[i][i] = 1.0 / (GAMMA * GAMMA);
        uz_v[i] = t.push_rate[i];
        i += 1;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums are what the recursion over stages gives, for any increments (1e-13).
    #[test]
    fn sums_are_the_recursion() {
        let (h, v, z) = (0.3, 1.7, -2.9);
        let u = [0.4, -1.1, 0.8, 0.25, -0.6, 0.9];
        let (mut uv, mut uz) = ([0.0; 6], [0.0; 6]);
        for i in 0..6 {
            let sum = |x: &[f64; 6], c: &[f64; 5]| (0..i).map(|j| c[j] * x[j]).sum::<f64>();
            let (rate, acceleration) = (v + sum(&uv, &A[i]), z + sum(&uz, &A[i]));
            let (r1, r2) = (rate + sum(&u, &C[i]) / h, acceleration + sum(&uv, &C[i]) / h);
            let push = r1 / (GAMMA * h) + r2;
            uv[i] = u[i] / (GAMMA * h) - r1;
            uz[i] = uv[i] / (GAMMA * h) - r2;
            let t = &TABLEAU;
            let over = |c: &[f64; 6]| (0..i).map(|k| c[k] * u[k]).sum::<f64>();
            let reported = [
                t.rate_start[i] * v + over(&t.rate[i]) / h,
                t.acceleration_start[i] * z + t.acceleration_rate[i] * v / h + over(&t.acceleration[i]) / (h * h),
                t.rate_start[i] * v + over(&t.lag[i]) / h,
                t.acceleration_start[i] * z + t.push_rate[i] * v / h + over(&t.push[i]) / (h * h),
            ];
            for (reported, expected) in reported.into_iter().zip([rate, acceleration, r1, push]) {
                assert!((reported - expected).abs() <= 1e-13 * (1e4 + expected.abs()), "{i}: {reported} {expected}");
            }
        }
    }
}
