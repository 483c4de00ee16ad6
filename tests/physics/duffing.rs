//! Springs with quadratic and cubic terms, against closed forms.

use crate::model;
use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::solve::time::event::Direction;

fn part(spring: &str, force: f64) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        spring2d * [f m] [kx=1 {spring}]
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        f2d * [m] [F={force:e}]"
    );
    model(&text, &CompileOptions::default())
}

/// Free motion of Duffing's oscillator with k₃·a²/k₁ = 0.1 from the amplitude a = 2 µm: ω/ω₀ = 1.0367169071 (complete elliptic integral). Steps at tol = 1e-6: 1e-5.
#[test]
fn the_backbone_of_duffings_oscillator() {
    let spring = "kx3=2.5e10";
    let (start, moving) = (part(spring, 2.2e-6), part(spring, 0.0));
    let options = TransientOptions {
        stop: 200e-6,
        tol: 1e-6,
        signals: vec!["m.x".into()],
        release: Some(&start),
        events: vec![("m.x".into(), 0.0)],
        ..TransientOptions::default()
    };
    let result = transient(&moving, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert!((result.signals[0].2[0] / 2e-6 - 1.0).abs() < 1e-9);
    let down: Vec<f64> = result.events.iter().filter(|e| e.direction == Direction::Down).map(|e| e.t).collect();
    let omega = std::f64::consts::TAU * (down.len() - 1) as f64 / (down[down.len() - 1] - down[0]);
    assert!((omega / 1e5 / 1.036_716_907_1 - 1.0).abs() < 1e-5, "{}", omega / 1e5);
}

/// Statics and modes: k₁·x + k₂·x² + k₃·x³ = F, and about it a stiffness of k₁ + 2·k₂·x + 3·k₃·x²; for both signs of the force, so that k₂ is a side.
#[test]
fn statics_and_modes_about_a_load() {
    let (k2, k3) = (1e5, 4e10);
    for x in [3e-6, -2e-6] {
        let force = x + k2 * x * x + k3 * x * x * x;
        let compiled = part("kx2=1e5 kx3=4e10", force);
        let rest = static_equilibrium(&compiled, &Vec::new()).unwrap_or_else(|e| panic!("{e}"));
        let found = rest.nodes.iter().find(|(name, _)| name == "m").map_or(0.0, |(_, motion)| motion.x);
        assert!((found / x - 1.0).abs() < 1e-9, "{found} {x}");
        let f = modes(&compiled, 1, &Vec::new()).unwrap_or_else(|e| panic!("{e}")).frequencies_hz[0];
        let wanted = ((1.0 + 2.0 * k2 * x + 3.0 * k3 * x * x) / 1e-10_f64).sqrt() / std::f64::consts::TAU;
        assert!((f / wanted - 1.0).abs() < 1e-9, "{f} {wanted}");
    }
}
