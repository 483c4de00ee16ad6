//! Orbits, constraints and failures.

use super::*;

/// A body on an ellipse of eccentricity 0.6 about a unit mass; fails beyond a given distance.
struct Orbit {
    limit: f64,
}

impl SecondOrder for Orbit {
    type Error = String;
    fn dimension(&self) -> usize {
        2
    }
    fn accelerations(&mut self, _: f64, q: &[f64], _: &[f64], a: &mut [f64]) -> Result<(), String> {
        let r = q[0].hypot(q[1]);
        if r > self.limit {
            return Err(format!("distance {r:.2}"));
        }
        (a[0], a[1]) = (-q[0] / (r * r * r), -q[1] / (r * r * r));
        Ok(())
    }
}

fn free() -> Orbit {
    Orbit { limit: f64::INFINITY }
}

/// Where the body is at `t`: Kepler's equation.
fn exact(t: f64) -> [f64; 2] {
    let mut e = t;
    for _ in 0..50 {
        e -= (e - 0.6 * e.sin() - t) / (1.0 - 0.6 * e.cos());
    }
    [e.cos() - 0.6, 0.8 * e.sin()]
}

fn start() -> ([f64; 2], [f64; 2]) {
    ([0.4, 0.0], [0.0, 2.0])
}

fn tolerances(rtol: f64) -> Tolerances {
    Tolerances { rtol, atol_q: vec![rtol; 2], atol_v: vec![rtol; 2] }
}

/// One revolution within every tolerance down to 1e-13: the error at its end, and between the steps by the continuous
/// extension, follows the tolerance. The work is pinned.
#[test]
fn an_orbit_at_every_tolerance() {
    let mut pinned = Vec::new();
    for (rtol, bound) in [(1e-4, 3e-2), (1e-7, 3e-5), (1e-10, 3e-8), (1e-13, 3e-11)] {
        let (mut q, mut v) = start();
        let mut method = DormandPrince::new(2);
        let (mut worst, mut x, mut y) = (0.0f64, [0.0; 2], [0.0; 2]);
        let end = 2.0 * std::f64::consts::PI;
        let mut h = 0.0;
        let stopped =
            method.integrate(&mut free(), (0.0, end), &mut q, &mut v, &mut h, &tolerances(rtol), 100_000, &mut |d| {
                for share in [0.3, 0.7, 1.0] {
                    let t = d.t + share * d.h;
                    d.at(t, &mut x, &mut y);
                    let e = exact(t);
                    worst = worst.max((x[0] - e[0]).hypot(x[1] - e[1]));
                }
                true
            });
        assert_eq!(stopped, Ok(None));
        assert!(worst < bound && worst > 1e-3 * bound, "{rtol}: {worst:e}");
        assert!((q[0] - 0.4).hypot(q[1]) < bound, "{rtol}: {q:?}");
        pinned.push((method.effort.steps, method.effort.rejected, method.effort.accelerations));
    }
    assert_eq!(pinned, [(16, 3, 116), (52, 7, 356), (198, 0, 1190), (784, 0, 4706)]);
}

/// Halving a step divides the error of one step by about 2⁶, and the embedded estimate by about 2⁵.
#[test]
fn order_five() {
    let (q, v) = start();
    let one = |h: f64| {
        let mut method = DormandPrince::new(2);
        let mut accelerate = |t: f64, q: &[f64], v: &[f64], a: &mut [f64]| free().accelerations(t, q, v, a);
        method.begin(&mut accelerate, 0.0, &q, &v).unwrap();
        method.attempt(&mut accelerate, (0.0, h), &q, &v).unwrap();
        let e = exact(h);
        ((method.next.q[0] - e[0]).hypot(method.next.q[1] - e[1]), method.error.q[0].hypot(method.error.q[1]))
    };
    let ((a, estimate_a), (b, estimate_b)) = (one(0.04), one(0.02));
    assert!(((a / b).log2() - 6.0).abs() < 0.4, "{}", (a / b).log2());
    assert!(((estimate_a / estimate_b).log2() - 5.0).abs() < 0.4, "{}", (estimate_a / estimate_b).log2());
}

/// A pendulum on a string of length 1 m, whose accelerations know the string only to second order: the projection
/// keeps its length to rounding.
#[test]
fn projection_keeps_a_constraint() {
    struct Pendulum;
    impl SecondOrder for Pendulum {
        type Error = String;
        fn dimension(&self) -> usize {
            2
        }
        fn accelerations(&mut self, _: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), String> {
            let pull = (v[0] * v[0] + v[1] * v[1] - 9.81 * q[1]) / (q[0] * q[0] + q[1] * q[1]);
            (a[0], a[1]) = (-pull * q[0], -pull * q[1] - 9.81);
            Ok(())
        }
        fn project(&mut self, _: f64, q: &mut [f64], v: &mut [f64]) -> Result<(), String> {
            let r = q[0].hypot(q[1]);
            q.iter_mut().for_each(|x| *x /= r);
            let along = q[0] * v[0] + q[1] * v[1];
            (v[0], v[1]) = (v[0] - along * q[0], v[1] - along * q[1]);
            Ok(())
        }
    }
    let (mut q, mut v, mut h) = ([1.0, 0.0], [0.0, 0.0], 0.0);
    let mut method = DormandPrince::new(2);
    let run =
        method.integrate(&mut Pendulum, (0.0, 10.0), &mut q, &mut v, &mut h, &tolerances(1e-6), 10_000, &mut |_| true);
    assert_eq!(run, Ok(None));
    assert!((q[0].hypot(q[1]) - 1.0).abs() < 1e-15, "{q:?}");
    let energy = 0.5 * (v[0] * v[0] + v[1] * v[1]) + 9.81 * q[1];
    assert!(energy.abs() < 9.81 * 1e-4, "{energy:e}");
}

/// Without accelerations of the formulation, the error names the time and the cause, and the motion stands at the last
/// accepted step.
#[test]
fn no_accelerations() {
    let (mut q, mut v, mut h) = (start().0, start().1, 0.0);
    let mut method = DormandPrince::new(2);
    let mut orbit = Orbit { limit: 1.5 };
    let run =
        method.integrate(&mut orbit, (0.0, 6.0), &mut q, &mut v, &mut h, &tolerances(1e-6), 10_000, &mut |_| true);
    match run {
        Err(IntegrationError::Accelerations { t, source, .. }) => {
            assert!((1.4..3.0).contains(&t) && source.starts_with("distance 1.5"), "{t} {source}");
            assert!((q[0].hypot(q[1]) - 1.5).abs() < 1e-3);
        }
        other => panic!("{other:?}"),
    }
}
