//! Combs whose fingers lie aside of the middle of their gaps: side force, side pull-in, contact of the sides, misalignment, and a substrate.

use crate::{close, model};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::mesh::fitted_in_time;
use bimorph::analysis::modes::modes;
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::statics::{StaticResult, static_equilibrium};
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::domains::contact::Contact;
use bimorph::domains::system::ApartMembers;
use bimorph::multibody::BodyMatrix;
use bimorph::multibody::planar::Pose;
use bimorph::solve::time::event::Direction;
use std::f64::consts::TAU;

const EPS: f64 = 8.854e-12;
/// Gaps, gap, height and overlap of the combs here (1, m, m, m).
const COMB: [f64; 4] = [40.0, 2e-6, 10e-6, 8e-6];

/// A mass of 1 ng on springs of `kx` and `ky` (N/m) that does not turn, and a comb with `more`.
fn shuttle(kx: f64, ky: f64, more: &str) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-12 J=1e-21]
        spring2d * [f m] [kx={kx} ky={ky} krz=1]
        anchor * [e] []
        drive comb2de * [m e] [N=40 gap=2u h=10u l=8u L=60u permittivity=8.854e-12 {more}]
        eground * [e] []
        in port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

fn volts(volts: f64) -> Vec<(String, f64)> {
    vec![("in".to_owned(), volts)]
}

fn place(result: &StaticResult) -> [f64; 2] {
    let motion = result.nodes.iter().find(|(name, _)| name == "m").unwrap().1;
    [motion.x, motion.y]
}

/// The fingers snap to the side at V² = g²·k_x/(N·ε·h)·(√(2·k_y/k_x + l²/g²) − l/g), k_x along the fingers, by R. Legtenberg, A. W. Groeneveld and M. Elwenspoek (J. Micromech. Microeng. 6 (1996) 320),
/// for four ratios of the stiffnesses. They come to rest on each other's sides, on which statics beyond that voltage finds them, and are released where the side force at the touching distance
/// is that of the spring: within 3 %, since contact begins softly. The result names the comb that closes.
#[test]
fn fingers_snap_to_the_side() {
    let [n, g, h, l] = COMB;
    let room = g - 0.1e-6;
    for (kx, ky) in [(1.0, 30.0), (1.0, 300.0), (0.5, 500.0), (10.0, 20.0)] {
        let compiled = shuttle(kx, ky, "");
        let root = (2.0 * ky / kx + (l / g).powi(2)).sqrt() - l / g;
        let expected = (g * g * kx / (n * EPS * h) * root).sqrt();
        let found = pull_in(&compiled, None, 1.2 * expected).unwrap();
        close(found.pull_in_v, expected, 2e-5);
        assert!(found.held);
        let (near, far) = (1.0 / (g - room), 1.0 / (g + room));
        let [along, across] = [0.25 * n * EPS * h * (near + far), 0.25 * n * EPS * h * (near * near - far * far)];
        // k_y·y = across·V²·(l + along·V²/k_x), of the square of the voltage
        let (a, b) = (across * along / kx, across * l);
        let released = ((-b + (b * b + 4.0 * a * ky * room).sqrt()) / (2.0 * a)).sqrt();
        close(found.release_v.unwrap(), released, 3e-2);
        let beyond = place(&static_equilibrium(&compiled, &volts(1.05 * expected)).unwrap())[1].abs();
        assert!(beyond > room && beyond < room + 25e-9, "{beyond}");
        let below = place(&static_equilibrium(&compiled, &volts(0.99 * expected)).unwrap())[1].abs();
        assert!(below < 1e-12, "{below}");
    }
}

/// A force that pushes the fingers of 2 µm gaps aside rests on their sides, half of the gaps wide, with and without a voltage: F = k_y·y + A·p(g − y) less the side force, A = ½·N·h·o.
/// `touch` is where this begins. 150 N is beyond the law of contact, and refused with the comb.
#[test]
fn pushed_fingers_rest_on_their_sides() {
    let [n, g, h, l] = COMB;
    for (touch, more) in [(0.1e-6, ""), (0.3e-6, "touch=0.3u")] {
        let pushed = |force: &str| shuttle(1.0, 30.0, &format!("{more}]\n        f2d * [m] [F={force} oz=pi/2"));
        for v in [0.0, 5.0] {
            let [u, y] = place(&static_equilibrium(&pushed("90u"), &volts(v)).unwrap());
            let bears = Contact { touch, area: 0.5 * n * h * (l + u) }.force(g - y).0;
            let (near, far) = (1.0 / (g - y), 1.0 / (g + y));
            let pull = 0.25 * v * v * n * EPS * h * (l + u) * (near * near - far * far);
            // of the contact force, whose position statics finds to 1e-4 of its penetration
            close(30.0 * y + bears, 90e-6 + pull, 1e-3);
            assert!(y > g - touch && y < g - 0.9 * touch, "{y}");
        }
        let refused = static_equilibrium(&pushed("150"), &volts(1.0)).unwrap_err().to_string();
        assert!(refused.contains("gap \"drive\" is pressed shut"), "{refused}");
    }
    // below the touching distance nothing bears
    close(
        place(&static_equilibrium(&shuttle(1.0, 30.0, "]\n        f2d * [m] [F=56u oz=pi/2"), &volts(0.0)).unwrap())[1],
        56e-6 / 30.0,
        1e-9,
    );
}

/// Fingers that do not overlap have no sides that bear: without a voltage the part moves by F/k_y, with one it is refused.
#[test]
fn fingers_that_do_not_overlap_do_not_bear() {
    let pushed = shuttle(1.0, 30.0, "]\n        f2d * [m] [F=90u oz=pi/2]\n        f2d * [m] [F=-11u");
    close(place(&static_equilibrium(&pushed, &volts(0.0)).unwrap())[1], 3e-6, 1e-9);
    let refused = static_equilibrium(&pushed, &volts(1.0));
    assert!(refused.as_ref().is_err_and(|e| e.to_string().contains("do not overlap")), "{refused:?}");
}

/// A step of the voltage beyond side pull-in draws misaligned fingers to the side: contact is an event, bounces lose energy, and the motion ends at the equilibrium of statics; 0 V releases them.
/// Default steps and `avf` agree.
#[test]
fn fingers_snap_in_time() {
    let compiled = shuttle(1.0, 60.0, "misalign=0.25u]\n        damper2d * [f m] [bx=4e-7 by=4e-7");
    let v = 1.1 * pull_in(&compiled, None, 1e3).unwrap().pull_in_v;
    let rest = place(&static_equilibrium(&compiled, &volts(v)).unwrap())[1];
    for method in [Integrator::Rodas4, Integrator::AverageField] {
        let options = TransientOptions {
            stop: 40e-6,
            points: 11,
            voltages: volts(v),
            signals: vec!["m.y".into(), "drive.side".into(), "drive.N".into()],
            method,
            ..TransientOptions::default()
        };
        let result = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap();
        let touched = result.events.iter().find(|e| e.contact && e.direction == Direction::Down).unwrap();
        assert!(touched.signal == "drive.side" && touched.t > 1e-7 && touched.t < 20e-6, "{touched:?}");
        let [y, side, bears] = [0, 1, 2].map(|k| *result.signals[k].2.last().unwrap());
        assert!((y / rest - 1.0).abs() < 1e-3, "{method:?}: {y} {rest}");
        close(side, 1.9e-6 - 0.25e-6 - y, 1e-3);
        assert!(bears > 0.0 && side < 0.0);
    }
}

/// Fingers on a cantilever close in time beyond side pull-in, drawn aside or drawn in the middle and pushed aside. Sections then have rotary inertia, without which steps collapse at the impact.
/// The time of closing at 1e-2 is that at 1e-3 within 1e-2, and the fingers stay within 5 % of their closed equilibrium, about which they ring.
#[test]
fn fingers_on_a_beam_close_in_time() {
    let text = |more: &str, push: &str| {
        format!(
            "process p = [ Youngsmodulus=160e9 density=2330 h=10u ]
            anchor p [a] []
            beam2d p [a m] [l=200u w=2u]
            beam2d p [m r] [l=20u w=10u]
            sense comb2de p [r s] [N=20 gap=2u l=10u L=20u {more}]
            {push}
            anchor p [s] []
            eground * [r] []
            drive port * [s] []"
        )
    };
    for (drawn, volts) in [(text("misalign=0.1u", ""), 9.5), (text("", "f2d * [r] [F=20n oz=pi/2]"), 9.5)] {
        let voltages = vec![("drive".to_owned(), volts)];
        let closing = [1e-2, 1e-3].map(|tol| {
            let compiled = model(&drawn, &CompileOptions { tol, ..CompileOptions::default() });
            let options = TransientOptions {
                stop: 40e-6,
                points: 401,
                tol,
                voltages: voltages.clone(),
                signals: vec!["r.y".into()],
                ..TransientOptions::default()
            };
            let (moving, _) = fitted_in_time(&compiled, &options).unwrap();
            assert!(moving.options.rotary_inertia);
            let result = transient(&moving, &options, &mut |_, _| {}, &mut |_| true).unwrap();
            let rest = static_equilibrium(&moving, &voltages).unwrap();
            let rest = rest.nodes.iter().find(|(name, _)| name == "r").unwrap().1.y;
            let touched = result.events.iter().find(|e| e.contact && e.direction == Direction::Down).unwrap().t;
            assert!(touched < 30e-6 && rest > 1.5e-6, "{touched} {rest}");
            let y = *result.signals[0].2.last().unwrap();
            assert!((y / rest - 1.0).abs() < 0.05, "{y} {rest}");
            touched
        });
        close(closing[0], closing[1], 1e-2);
    }
}

/// Sides lose energy as other contacts do: a mass thrown at the sides of its fingers at the reference speed comes back with e² of the way, within 1 %.
#[test]
fn sides_have_the_restitution() {
    // 1 µN over 1.9 µm: √(2·F·w/m) = 0.19494 m/s
    let text = "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] [oz=pi/2]
        spring2d * [f m] [ky=1e-6]
        f2d * [m] [F=1u oz=pi/2]
        anchor * [e] []
        drive comb2de * [m e] [N=40 gap=2u h=10u l=8u L=60u restitution=0.6 speed=0.19494]
        eground * [e] []
        in port * [m e] []";
    let compiled = model(text, &CompileOptions::default());
    let options = TransientOptions {
        stop: 50e-6,
        points: 20_001,
        tol: 1e-3,
        signals: vec!["m.y".into()],
        ..TransientOptions::default()
    };
    let result = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap();
    let down: Vec<f64> = result.events.iter().filter(|e| e.direction == Direction::Down).map(|e| e.t).collect();
    let after = result.t.iter().zip(&result.signals[0].2).filter(|(t, _)| **t > down[0] && **t < down[1]);
    let came = 1.0 - after.map(|(_, y)| *y).fold(1.9e-6, f64::min) / 1.9e-6;
    close(came, 0.36, 1e-2);
}

/// The derivatives of the loss of sides are those of the force by central differences, with displacements the symmetric part, to 1e-5 of the largest.
#[test]
fn losses_of_sides_have_their_derivatives() {
    let text = "process p = [ density=2300 h=20u ]
        anchor p [f] [l=1u w=1u]
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        drive comb2de p [m e] [N=40 gap=2u l=10u L=30u misalign=1.69u touch=0.3u restitution=0.5 speed=0.1 oz=0.4]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [f e] [kx=1 ky=1 krz=1e-9]";
    let compiled = model(text, &CompileOptions::default());
    let system = &compiled.parts.system;
    let (n, pattern) = (system.bodies(), &system.model.pattern);
    let at = |q: &[f64]| -> Vec<Pose> { q.chunks(3).map(|c| Pose::new(c[0], c[1], c[2])).collect() };
    let force = |q: &[f64], v: &[f64]| -> Vec<f64> {
        let (q, v, mut r) = (at(q), at(v), vec![Pose::zeros(); n]);
        system.add_loss(&q, |k| v[k], &mut r);
        r.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
    };
    // across is to the left of oz
    let across = [-0.4f64.sin(), 0.4f64.cos()];
    let [mut q, mut v] = [vec![0.0; 3 * n], vec![0.0; 3 * n]];
    for k in 0..n {
        let sign = if system.model.bodies[k].name.to_string() == "m" { 1.0 } else { -1.0 };
        for i in 0..2 {
            q[3 * k + i] = sign * 30e-9 * across[i];
            v[3 * k + i] = sign * 0.03 * across[i] + 0.01;
        }
        (q[3 * k + 2], v[3 * k + 2]) = (1e-4, 30.0);
    }
    let (poses, rates) = (at(&q), at(&v));
    assert!(system.contact_energy(&poses) > 0.0);
    let [mut stiffness, mut damping] = [BodyMatrix::new(pattern), BodyMatrix::new(pattern)];
    assert!(system.add_loss_tangent((&poses, ApartMembers::default()), |k| rates[k], &mut stiffness, &mut damping));
    let dense = |matrix: &BodyMatrix, j: usize| -> Vec<f64> {
        let mut unit = vec![0.0; 3 * n];
        unit[j] = 1.0;
        let mut out = vec![Pose::zeros(); n];
        matrix.multiply_add(pattern, &at(&unit), &mut out);
        out.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
    };
    let difference = |of: &dyn Fn(&[f64]) -> Vec<f64>, x: &[f64], j: usize, e: f64| -> Vec<f64> {
        let moved =
            |d: f64| of(&x.iter().enumerate().map(|(k, x)| if k == j { x + d } else { *x }).collect::<Vec<_>>());
        moved(e).iter().zip(moved(-e)).map(|(a, b)| (a - b) / (2.0 * e)).collect()
    };
    let step = |j: usize, size: [f64; 2]| size[usize::from(j % 3 == 2)];
    let of_q: Vec<_> = (0..3 * n).map(|j| difference(&|q| force(q, &v), &q, j, step(j, [1e-12, 1e-7]))).collect();
    let of_v: Vec<_> = (0..3 * n).map(|j| difference(&|v| force(&q, v), &v, j, step(j, [1e-6, 1e-2]))).collect();
    // forces by metres: a rotation acts by its arm
    let unit = |j: usize| if j % 3 == 2 { 25e-6 } else { 1.0 };
    let largest = |of: &[Vec<f64>]| {
        let scaled = |j: usize, i: usize| (of[j][i] / (unit(i) * unit(j))).abs();
        (0..3 * n).flat_map(|j| (0..3 * n).map(move |i| (j, i))).map(|(j, i)| scaled(j, i)).fold(0.0, f64::max)
    };
    for j in 0..3 * n {
        for i in 0..3 * n {
            let scale = unit(i) * unit(j);
            let symmetric = 0.5 * (of_q[j][i] + of_q[i][j]);
            let off = (dense(&stiffness, j)[i] - symmetric).abs() / scale;
            assert!(off < 1e-5 * largest(&of_q), "{i} {j}: {} {symmetric}", dense(&stiffness, j)[i]);
            let off = (dense(&damping, j)[i] - of_v[j][i]).abs() / scale;
            assert!(off < 1e-5 * largest(&of_v), "{i} {j}: {} {}", dense(&damping, j)[i], of_v[j][i]);
        }
    }
}

/// Below that voltage the stiffness across is k_y − N·ε·h·o·V²/g³ (differentiated by hand): the square of the frequency across falls by it, that along does not change.
#[test]
fn voltage_softens_across_the_fingers() {
    let [n, g, h, l] = COMB;
    let (kx, ky, v) = (5.0, 30.0, 40.0);
    let compiled = shuttle(kx, ky, "");
    let u = 0.5 * v * v * n * EPS * h / g / kx;
    let found = modes(&compiled, 2, &volts(v)).unwrap();
    let stiffness: Vec<f64> = found.frequencies_hz.iter().map(|f| (TAU * f).powi(2) * 1e-12).collect();
    close(stiffness[0], kx, 1e-7);
    close(stiffness[1], ky - n * EPS * h * (l + u) * v * v / (g * g * g), 1e-7);
}

/// Misaligned fingers are in equilibrium where k_x·u and k_y·y balance the derivatives of ½V²·N/2·ε·h·o·(1/(g − y) + 1/(g + y)), by fixed-point iteration of these two
/// equations. They snap earlier than aligned ones, at a fold; to the left and to the right at the same voltage.
#[test]
fn misaligned_fingers() {
    let [n, g, h, l] = COMB;
    let (kx, ky, v, aside) = (1.0, 60.0, 60.0, 0.25e-6);
    let compiled = shuttle(kx, ky, "misalign=0.25u");
    let (mut u, mut y) = (0.0, 0.0);
    for _ in 0..500 {
        let (near, far) = (1.0 / (g - aside - y), 1.0 / (g + aside + y));
        let strength = 0.25 * v * v * n * EPS * h;
        (u, y) = (strength * (near + far) / kx, strength * (l + u) * (near * near - far * far) / ky);
    }
    let found = place(&static_equilibrium(&compiled, &volts(v)).unwrap());
    close(found[0], u, 1e-6);
    close(found[1], y, 1e-6);
    let snaps = |more: &str| pull_in(&shuttle(kx, ky, more), None, 1e3).unwrap().pull_in_v;
    let (aligned, left, right) = (snaps(""), snaps("misalign=0.25u"), snaps("misalign=-0.25u"));
    close(left, right, 1e-9);
    assert!(left < 0.95 * aligned && left > 0.5 * aligned, "{left} {aligned}");
}

/// κ of fingers over a substrate that is grounded with the rotor: 1.135 at w = g = h = d and 1.093 at w, g, h = 2, 3, 25 µm and d = h, by boundary elements (1e-4), within 1 %. Without a
/// substrate it is 2.049 and 1.110.
#[test]
fn a_substrate_takes_thrust() {
    for (w, g, h, kappa) in [(2.0, 2.0, 2.0, 1.135), (2.0, 3.0, 25.0, 1.093)] {
        let text = format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-12]
            guide2d * [m] []
            spring2d * [f m] [kx=1]
            anchor * [e] []
            comb2de * [m e] [N=20 gap={g}u h={h}u w={w}u l=40u L=200u substrate={h}u permittivity=8.854e-12]
            eground * [e] []
            in port * [m e] []"
        );
        let found = place(&static_equilibrium(&model(&text, &CompileOptions::default()), &volts(3.0)).unwrap())[0];
        close(found, 0.5 * 9.0 * kappa * 20.0 * EPS * h / g, 1e-2);
    }
}
