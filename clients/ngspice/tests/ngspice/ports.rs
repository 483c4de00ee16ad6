//! Ports that are not electrical, on every ngspice: forces, heat and the motion of the frame, against closed forms.

use crate::support::{deck, deviation, real, run, run_text, versions};
use bimorph::cosim::CosimOptions;
use std::path::Path;

fn options(name: &str, ngspice: &Path) -> CosimOptions {
    CosimOptions { deck: deck(name), ngspice: Some(ngspice.to_owned()), ..CosimOptions::default() }
}

/// After a step of 1 g the mass settles at x = −m·a/k = −9.80665 nm and the middle of the half bridge at 1 V·x/g.
/// During the motion both follow the closed form of the damped oscillator: 1e-4 of the end value.
#[test]
fn an_accelerometer_shows_one_g() {
    let (m, k, b, gap, a): (f64, f64, f64, f64, f64) = (1e-9, 1.0, 4.4e-5, 2e-6, 9.80665);
    let (omega, zeta) = ((k / m).sqrt(), b / (2.0 * (k * m).sqrt()));
    let turn = omega * (1.0 - zeta * zeta).sqrt();
    let exact = |t: f64| {
        let swing = (turn * t).cos() + zeta * omega / turn * (turn * t).sin();
        -m * a / k * (1.0 - (-zeta * omega * t).exp() * swing)
    };
    for (version, ngspice) in versions() {
        let run = run(options("accelerometer.cir", &ngspice)).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Transient");
        let (t, x, out) = (real(plot, "time"), real(plot, "v(x)"), real(plot, "v(out)"));
        let end = m * a / k;
        let mut worst = [0.0f64; 2];
        for i in (0..t.len()).filter(|&i| t[i] > 10.1e-6) {
            // the edge of a nanosecond begins at 10 us; its middle is the step
            let want = exact(t[i] - 10.0005e-6);
            worst[0] = worst[0].max((1e-9 * x[i] - want).abs() / end);
            worst[1] = worst[1].max((1e-3 * out[i] * gap - want).abs() / end);
        }
        println!("ngspice {version}: displacement within {:e} of 1 g, readout within {:e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-4 && worst[1] < 1e-4, "ngspice {version}: {worst:?}");
        let last = *out.last().unwrap();
        assert!((last / (-1e3 * end / gap) - 1.0).abs() < 1e-4, "ngspice {version}: settles at {last} V");
    }
}

/// Temperatures of a two-stage ladder of heat on a beam of resistance `r` that a power heats: (C₁, C₂) by the classical
/// Runge-Kutta method with steps of 10 ns, a thousandth of the shortest time constant and less.
fn ladder(r: f64, [r3, c3, r4, c4]: [f64; 4], power: impl Fn(f64) -> f64, times: &[f64]) -> Vec<f64> {
    // beam: (T − s3)/r3 = P − T/r
    let beam = |t: f64, s: [f64; 2]| (power(t) + s[0] / r3) / (1.0 / r + 1.0 / r3);
    let rate = |t: f64, s: [f64; 2]| {
        let through = (s[0] - s[1]) / r4;
        [((beam(t, s) - s[0]) / r3 - through) / c3, through / c4]
    };
    let (mut t, mut s, mut out) = (0.0, [0.0; 2], Vec::new());
    for &to in times {
        let count = ((to - t) / 1e-8).ceil().max(1.0);
        let h = (to - t) / count;
        for _ in 0..count as usize {
            let add = |s: [f64; 2], k: [f64; 2], h: f64| [s[0] + h * k[0], s[1] + h * k[1]];
            let k1 = rate(t, s);
            let k2 = rate(t + h / 2.0, add(s, k1, h / 2.0));
            let k3 = rate(t + h / 2.0, add(s, k2, h / 2.0));
            let k4 = rate(t + h, add(s, k3, h));
            for i in 0..2 {
                s[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
            t += h;
        }
        out.push(beam(t, s));
    }
    out
}

/// A capacitor τ/R on a beam's thermal port makes the lag that the built-in model makes with τ, 1e-4 of range; and with a
/// ladder of two stages the beam follows the ladder's own equations, 1e-4 of range.
#[test]
fn a_thermal_port_takes_a_ladder() {
    let volts = |t: f64| match t {
        t if t < 1e-6 => t / 1e-6,
        t if t < 40e-6 => 1.0,
        t if t < 41e-6 => 1.0 - 0.6 * (t - 40e-6) / 1e-6,
        _ => 0.4,
    };
    let r = 100e-6 / (12.0 * 34.0 * 4e-12);
    for (version, ngspice) in versions() {
        let run = run(options("thermal_port.cir", &ngspice)).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Transient");
        let t = real(plot, "time");
        let off = deviation((t, real(plot, "v(t1)")), (t, real(plot, "v(t2)")), 0.0, 100e-6);
        let exact = ladder(r, [40e3, 0.8e-9, 80e3, 0.2e-9], |t| volts(t).powi(2) / 1e3, t);
        let ladder = deviation((t, real(plot, "v(t3)")), (t, &exact), 0.0, 100e-6);
        println!("ngspice {version}: built-in lag {off:e} of range, ladder {ladder:e}");
        assert!(off < 1e-4 && ladder < 1e-4, "ngspice {version}: {off:e} {ladder:e}");
    }
}

/// Peaks of a ringing above zero, with their times, by a parabola through the three highest points.
fn peaks(t: &[f64], x: &[f64]) -> Vec<(f64, f64)> {
    (1..t.len() - 1)
        .filter(|&i| t[i] > 3e-6 && x[i] > x[i - 1] && x[i] >= x[i + 1] && x[i] > 0.0)
        .map(|i| {
            let (a, b) = (t[i - 1] - t[i], t[i + 1] - t[i]);
            let (p, q) = ((x[i - 1] - x[i]) / a, (x[i + 1] - x[i]) / b);
            let curve = (q - p) / (b - a);
            let slope = p - curve * a;
            (t[i] - slope / (2.0 * curve), x[i] - slope * slope / (4.0 * curve))
        })
        .collect()
}

/// A resistor on a velocity port, and a capacitor on a displacement port, damp as c = 1/R and c = 1e6·C. Q = √(km)/c =
/// 20 by the decrement π·√(1/Q² − 1/4Q⁴)…, 1e-3. A resistor on a displacement port is a spring, and the frequency that
/// of k + 1e6/R, 1e-4.
#[test]
fn circuit_elements_are_dampers_and_springs() {
    let (m, k): (f64, f64) = (1e-10, 1.0);
    let c = 5e-7;
    let (omega, quality) = ((k / m).sqrt(), (k * m).sqrt() / c);
    // between peaks n cycles apart: ln ratio = n·2π·ζ/√(1 − ζ²), ζ = 1/2Q
    let zeta = 0.5 / quality;
    let decrement = std::f64::consts::TAU * zeta / (1.0 - zeta * zeta).sqrt();
    for (version, ngspice) in versions() {
        let run = run(options("port_dampers.cir", &ngspice)).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Transient");
        let t = real(plot, "time");
        for name in ["v(x1)", "v(x2)"] {
            let peaks = peaks(t, real(plot, name));
            let (first, last) = (peaks[0], peaks[10]);
            let measured = (first.1 / last.1).ln() / 10.0;
            let period = (last.0 - first.0) / 10.0;
            let exact = std::f64::consts::TAU / (omega * (1.0 - zeta * zeta).sqrt());
            println!(
                "ngspice {version}: {name}: Q {:.5} of {quality}, period off by {:e}",
                quality * decrement / measured,
                period / exact - 1.0
            );
            assert!((measured / decrement - 1.0).abs() < 1e-3, "ngspice {version}: {name} {measured} {decrement}");
            assert!((period / exact - 1.0).abs() < 1e-4, "ngspice {version}: {name} {period:e} {exact:e}");
        }
        let peaks = peaks(t, real(plot, "v(x3)"));
        let period = (peaks[20].0 - peaks[0].0) / 20.0;
        let exact = std::f64::consts::TAU / ((k + 1.0) / m).sqrt();
        assert!((period / exact - 1.0).abs() < 1e-4, "ngspice {version}: spring {period:e} {exact:e}");
        assert!((peaks[20].1 / peaks[0].1 - 1.0).abs() < 1e-3, "a spring takes no energy");
    }
}

/// A mechanical port on `%gd`, an electrical one on `%hd`, and a scale on an electrical port are refused with the way out.
#[test]
fn wrong_connections_are_reported() {
    let (_, ngspice) = versions().swap_remove(0);
    for (instance, ports, words) in [
        ("A1 %gd [a 0] null plate", "\"m.x\"", "%hd before the nodes of \"m.x\""),
        ("A1 %hd [a 0] null plate", "\"drive\"", "%gd before the nodes of \"drive\""),
        ("A1 %gd [a 0] null plate", "\"drive:2\"", "without a scale"),
    ] {
        let text = format!(
            "* wrong\nVd a 0 1\nR1 a 0 1\n{instance}\n.model plate bimorph(file=\"plate.net\" ports=[{ports}])\n.op\n.end\n"
        );
        match run_text(&text, &ngspice) {
            Err(e) => assert!(e.to_string().contains(words), "{e}"),
            Ok(_) => panic!("{instance} with {ports} ran"),
        }
    }
}

/// A current given to a displacement port is a force: 1 µA is 1 µN and moves 1 µm on 1 N/m at DC; in small signals the
/// resonance is that of the mode.
#[test]
fn a_current_is_a_force() {
    for (version, ngspice) in versions() {
        let text = "* force\nI1 0 x dc 1u ac 1u\nA1 [%hd x 0] null place\n\
            .model place bimorph(file=\"mass.net\" ports=[\"m.x\"])\n.op\n.ac lin 3 10k 12k\n.end\n";
        let run = run_text(text, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let op = real(run.plot("Operating"), "v(x)")[0];
        assert!((op - 1.0).abs() < 1e-9, "ngspice {version}: {op}");
        let plot = run.plot("AC");
        for (x, f) in crate::support::complex(plot, "v(x)").iter().zip([10e3, 11e3, 12e3]) {
            let exact = 1.0 / (1.0 - (std::f64::consts::TAU * f).powi(2) * 1e-10);
            assert!((x[0] / exact - 1.0).abs() < 1e-9 && x[1].abs() < 1e-9, "ngspice {version}: {x:?} {exact}");
        }
    }
}

/// Amplitude and phase of the oscillation at `omega` (rad/s) in a wave, by least squares.
fn oscillation(t: &[f64], y: &[f64], omega: f64) -> (f64, f64) {
    // y = a·sin + b·cos + c
    let mut normal = [[0.0f64; 4]; 3];
    for (t, y) in t.iter().zip(y) {
        let row = [(omega * t).sin(), (omega * t).cos(), 1.0];
        for i in 0..3 {
            for j in 0..3 {
                normal[i][j] += row[i] * row[j];
            }
            normal[i][3] += row[i] * y;
        }
    }
    for k in 0..3 {
        for i in 0..3 {
            if i != k {
                let factor = normal[i][k] / normal[k][k];
                let pivot = normal[k];
                normal[i].iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    let (a, b) = (normal[0][3] / normal[0][0], normal[1][3] / normal[1][1]);
    (a.hypot(b), b.atan2(a))
}

/// A mass driven along x at its mode in a frame that turns at 35 rad/s (2000 °/s): drive and Coriolis' response along y have the
/// amplitude and the phase of the exact two degrees of freedom, 1e-3.
#[test]
fn a_gyroscope_feels_coriolis() {
    let (m, k, c, rate): (f64, [f64; 2], f64, f64) = (1e-9, [4.0, 4.2], 8e-7, 35.0);
    let omega = std::f64::consts::TAU * 10065.8;
    // [a −b; b d]·(x, y) = (F, 0), b = iω·2mΩ
    let a = k.map(|k| [k - m * (rate * rate + omega * omega), omega * c]);
    let b = 2.0 * m * rate * omega;
    let product = |p: [f64; 2], q: [f64; 2]| [p[0] * q[0] - p[1] * q[1], p[0] * q[1] + p[1] * q[0]];
    let both = product(a[0], a[1]);
    let determinant = [both[0] - b * b, both[1]];
    let over = |p: [f64; 2]| {
        let size = determinant[0].powi(2) + determinant[1].powi(2);
        product(p, [determinant[0] / size, -determinant[1] / size])
    };
    let exact = [over(a[1]), over([0.0, -b])].map(|z| (5e-9 * z[0].hypot(z[1]), z[1].atan2(z[0])));
    for (version, ngspice) in versions() {
        let run = run(options("gyro.cir", &ngspice)).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Transient");
        let t = real(plot, "time");
        for ((column, scale), (size, phase)) in [("v(x)", 1e-6), ("v(y)", 1e-9)].into_iter().zip(exact) {
            let (amplitude, angle) = oscillation(t, real(plot, column), omega);
            let turn = (angle - phase).rem_euclid(std::f64::consts::TAU);
            let turn = turn.min(std::f64::consts::TAU - turn);
            println!("ngspice {version}: {column} off by {:e}, phase by {turn:e}", amplitude * scale / size - 1.0);
            assert!((amplitude * scale / size - 1.0).abs() < 1e-3 && turn < 1e-3, "ngspice {version}: {column}");
        }
    }
}
