//! The damper to the ground.

use crate::motion::released;
use crate::{balance, close, model, node};
use bimorph::analysis::harmonic::{HarmonicOptions, harmonic};
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::CompileOptions;
use bimorph::multibody::forces::add_damping;
use bimorph::multibody::planar::Pose;
use nalgebra::Vector3;

/// m = 1e-10 kg on k = 1 N/m with c = 1e-6 N·s/m along its guide: ω₀ = 1e5 rad/s, ζ = c/(2·√(km)) = 0.05. The dashpot is turned by a
/// quarter, so that its local y is along the guide.
const DAMPED: &str = "
    param F=0
    anchor * [f] [l=1u w=1u h=1u]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    spring2d * [f m] [kx=1]
    dashpot2d * [m] [bx=3e-6 by=1e-6 oz=pi/2]
    f2d * [m] [F=F]";

/// Released from 1 µm, the mass follows [`released`] within the tolerance of the steps; without damping it does
/// not, and its equilibrium is F/k with a dashpot and without.
#[test]
fn released_mass() {
    let start = model(&DAMPED.replace("F=0", "F=1u"), &CompileOptions::default());
    close(node(&balance(&start, &[]), "m").x, 1e-6, 1e-12);
    let worst = |options: CompileOptions| {
        let compiled = model(DAMPED, &options);
        let asked = TransientOptions {
            stop: 3e-4,
            signals: vec!["m.x".into()],
            points: 201,
            release: Some(&start),
            ..TransientOptions::default()
        };
        let run = transient(&compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap();
        run.t.iter().zip(&run.signals[0].2).map(|(t, x)| (x - released(*t)).abs()).fold(0.0, f64::max)
    };
    assert!(worst(CompileOptions::default()) < 1e-4 * 1e-6);
    assert!(worst(CompileOptions { undamped: true, ..CompileOptions::default() }) > 0.1e-6);
}

/// Nothing but a dashpot holds a mass: a force takes it to F/b, as 1 − e^{−bt/m}. Before, its node was taken for one that nothing touches.
#[test]
fn a_dashpot_alone() {
    let text = "mass2d * [m] [m=1e-10 J=1e-20]\ndashpot2d * [m] [bx=1e-6 by=1e-6 brz=1e-17]\nf2d * [m] [F=1u]\n";
    let compiled = model(text, &CompileOptions::default());
    let asked = TransientOptions { stop: 2e-4, signals: vec!["m.vx".into()], points: 3, ..TransientOptions::default() };
    let run = transient(&compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap();
    for (t, v) in run.t.iter().zip(&run.signals[0].2).skip(1) {
        close(*v, 1.0 - (-1e4 * t).exp(), 1e-3);
    }
}

/// At ω₀ a force moves the mass by 1/(2ζ) = 10 times what it does at rest, a quarter of a period late.
#[test]
fn peak_of_the_response() {
    let compiled = model(DAMPED, &CompileOptions::default());
    let natural = 1e5 / std::f64::consts::TAU;
    let asked = HarmonicOptions {
        drive: "m.fx".into(),
        signals: vec!["m.x".into()],
        from: natural,
        to: 2.0 * natural,
        points: 2,
        ..HarmonicOptions::default()
    };
    let found = harmonic(&compiled, &asked, &mut |_| true).unwrap();
    let [re, im] = found.signals[0].values[0];
    close(im, -10.0, 1e-9);
    assert!(re.abs() < 1e-9, "{re:e}");
}

/// On a node away from the centre of mass it resists the rate of that node: force −c·(v + θ̇ e×r) there, and its moment r×F about the
/// centre; the moment per rate comes on top. It is no gap.
#[test]
fn at_a_lever() {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-19]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        link2d * [m t] [l=30u oz=pi/2]
        d dashpot2d * [t] [bx=2e-6 by=5e-6 brz=7e-16]";
    let compiled = model(text, &CompileOptions::default());
    let system = &compiled.parts.system;
    assert_eq!((system.bodies(), compiled.parts.gap_names.len()), (1, 0));
    let (v, arm) = (Vector3::new(0.3, -0.2, 4e3), 30e-6);
    let mut force = [Pose::zeros()];
    add_damping(&system.model, &[v], &mut force);
    // e×r of r = (0, arm) is (−arm, 0)
    let at_node = [2e-6 * (v.x - arm * v.z), 5e-6 * v.y];
    close(force[0].x, at_node[0], 1e-12);
    close(force[0].y, at_node[1], 1e-12);
    close(force[0].z, -arm * at_node[0] + 7e-16 * v.z, 1e-12);
}
