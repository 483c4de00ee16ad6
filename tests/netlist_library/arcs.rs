//! Curved beams: arcs as SUGAR draws them, and what they bear.

use super::*;

/// An arc under a dead force at its tip: displacement by Castigliano's theorem (thin curved bar: bending and stretch, no
/// shear). A polygon of 30 chords, or one that turns by 2.5° at most, is within 5e-4: 4.7e-4 for the lowest arc here, from the height
/// of its chords over the arc's.
#[test]
fn arcs_bend_as_curved_bars() {
    let r: f64 = 100e-6;
    for (alpha, tolerance) in [(0.5, 5e-4), (PI / 2.0, 5e-4), (PI, 5e-4), (1.75 * PI, 5e-4)] {
        for name in ["semicircularbeam", "circbeam7"] {
            let text = format!("{name} p1 [a b] [radius=100u alpha={alpha} w=2u]\nf3d * [b] [F=1n]");
            let tip = moved(&text, "b");
            // M(φ) = F·(y(alpha) − y(φ)), N = F·cos φ, summed by the midpoint rule
            let n = 20_000;
            let (mut x, mut y, mut rz) = (0.0, 0.0, 0.0);
            for k in 0..n {
                let (phi, ds) = (alpha * (f64::from(k) + 0.5) / f64::from(n), r * alpha / f64::from(n));
                let arm = [r * (alpha.sin() - phi.sin()), r * (phi.cos() - alpha.cos())];
                let moment = 1e-9 * arm[1];
                x += (moment * arm[1] / EI + 1e-9 * phi.cos().powi(2) / EA) * ds;
                y += (-moment * arm[0] / EI + 1e-9 * phi.cos() * phi.sin() / EA) * ds;
                rz -= moment / EI * ds;
            }
            let size = x.hypot(y);
            for (got, want, scale) in [(tip.x, x, size), (tip.y, y, size), (tip.rz, rz, rz.abs())] {
                assert!((got - want).abs() < tolerance * scale, "{alpha}: {got:e} is not {want:e}");
            }
        }
    }
}

/// Its far end lies at radius·(sin alpha, 1 − cos alpha), and arms stand between it and the nodes; mass is that of the chords.
#[test]
fn arcs_lie_as_drawn() {
    let s = drawn("x semicircularbeam p1 [a b] [radius=100u alpha=pi/2 w=2u oz=pi/2 L1=10u oz1=-pi/2 L2=-20u]");
    // arm 1 along x, then the quarter arc to the left of y, then arm 2 against y
    let b = at(&s, "b");
    near(b[0], 10e-6 - 100e-6, 1e-12);
    near(b[1], 100e-6 - 20e-6, 1e-12);
    assert_eq!((s.beams.len(), s.links.len()), (36, 2));
    let length: f64 = s.beams.iter().map(|b| b.length).sum();
    near(length, 100e-6 * PI / 2.0, 1e-4);
    assert_eq!((s.beams[0].name.as_str(), s.beams[35].name.as_str()), ("x.1", "x.36"));
}

/// A full turn as wide as its diameter is a disk of twice the radius, π·(2r)²·h of volume; wider, its inner edge would pass its centre.
#[test]
fn arcs_as_wide_as_their_diameter() {
    let s = drawn("semicircularbeam p1 [a b] [radius=100u alpha=2*pi w=200u]\nbeam2d p1 [a c] [l=10u w=2u]");
    let chords = s.beams.iter().filter(|b| b.width > 100e-6);
    let volume: f64 = chords.map(|b| b.length * b.width * b.thickness).sum();
    near(volume, PI * 4e-8 * 2e-6, 1e-3);
    let found = refused("semicircularbeam p1 [a b] [radius=100u alpha=pi w=201u]");
    assert_eq!(found[0].0, "E060", "{found:?}");
}

/// A ring of two half circles, free but for soft springs: its first flexural mode is that of a thin ring, 2.683·√(EI/(ρ·A))/R²
/// (Love, 1927), within 1 %.
#[test]
fn a_ring_rings() {
    let text = "spring2d * [a t] [kx=1u ky=1u krz=1e-16]\nspring2d * [a u] [kx=1u ky=1u]\npos * [t u] [x=200u]\n\
        semicircularbeam p1 [t u] [radius=100u alpha=pi w=2u oz=-pi/2 viscosity=0]\n\
        semicircularbeam p1 [u t] [radius=100u alpha=pi w=2u oz=pi/2 viscosity=0]";
    let compiled = compile(&bundle(text), &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let found = modes(&compiled, 6, &[]).unwrap_or_else(|e| panic!("{e}"));
    let ring = 2.683 * (EI / (2000.0 * 4e-12)).sqrt() / 1e-8 / (2.0 * PI);
    assert!(found.frequencies_hz.iter().any(|f| (f / ring - 1.0).abs() < 0.01), "{ring} {:?}", found.frequencies_hz);
}
