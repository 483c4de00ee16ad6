//! Reference speeds of impacts from statics.

use bimorph::compile::{CompileOptions, compile};
use bimorph::domains::Domain;
use bimorph::domains::contact_speed::WITHOUT_STATICS;
use bimorph::netlist::Bundle;

/// A plate on a spring, k = 1 N/m and m = 1e-10 kg, over a gap of 2 µm that touches at 0.1 µm: ω₀ = 1e5 rad/s, and the fall arrives with
/// 2e-6·√((8/27)·19 − 0.95²)·1e5 = 0.4349 m/s. A stop at 1.5 µm: 0.15 m/s. A mass that nothing holds: 1 m/s. Given ones stay.
#[test]
fn speeds_from_statics() {
    let text = "
        anchor * [f] [l=1u w=1u h=1u]
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] [l=1u w=1u h=1u]
        plategap2d * [m e] [A=1e-8 gap=2u]
        stop2d * [m] [gap=1.5u]
        stop2d * [m] [gap=1.5u speed=7]
        stop2d * [m] [gap=1.5u restitution=1]";
    let system = compile(&Bundle::from_text("plate", text), &CompileOptions::default()).unwrap().parts.system;
    let speeds: Vec<_> = system.members.iter().map(|m| m.loss().unwrap().speed).collect();
    let fall = 0.2 * (8.0 / 27.0 * 19.0 - 0.95f64.powi(2)).sqrt();
    for (speed, expected) in speeds.iter().zip([Some(fall), Some(0.15), Some(7.0), None]) {
        assert!((speed.unwrap_or(-1.0) - expected.unwrap_or(-1.0)).abs() < 1e-9, "{speeds:?}");
    }
    let free = "
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        damper2d * [f m] [bx=1e-7]
        anchor * [f] [l=1u w=1u h=1u]
        stop2d * [m] [gap=1.5u]";
    let system = compile(&Bundle::from_text("free", free), &CompileOptions::default()).unwrap().parts.system;
    assert_eq!(system.members[0].loss().unwrap().speed, Some(WITHOUT_STATICS));
}
