//! Meshes of frequency responses: the response of a row to unexcited or unobservable modes is rounding and requires no
//! mesh.

use bimorph::analysis::harmonic::HarmonicOptions;
use bimorph::analysis::mesh::harmonic_fitted;
use bimorph::compile::{CompileOptions, compile};
use bimorph::netlist::Bundle;

/// A plate between two beams in a line, turned as a whole by `turn` (rad).
fn plate(turn: f64) -> String {
    format!(
        "process p = [Youngsmodulus=160e9 density=2330 h=20u viscosity=1.8e-5 fluid=2u]\nplate2d p [s] [l=100u w=100u oz={turn}]\n\
         for k=0:1 [\nlink2d * [s q(k)] [l=50u oz=k*pi+pi/2+{turn}]\nbeam2d p [q(k) e(k)] [l=200u w=2u oz=k*pi+pi/2+{turn}]\n\
         anchor p [e(k)] []\n]\n"
    )
}

/// Two plates on a bent beam that nothing holds.
const FLOATS: &str = "process p = [Youngsmodulus=160e9 density=2330 h=2u viscosity=1.8e-5 fluid=2u]\nplate2d p [a] [l=50u w=50u]\n\
                      l1 beam2d p [a b] [l=100u w=2u]\nl2 beam2d p [b c] [l=100u w=2u]\nplate2d p [c] [l=50u w=50u]\n";

/// Across an axis of symmetry, beyond the modes of a band, and of a part that floats. Before, shares of modes that are rounding were compared with
/// each other: 6,165 to 588,699 unknowns, and warnings.
#[test]
fn rounding_asks_for_no_mesh() {
    type Case<'a> = (String, bool, &'a str, &'a [&'a str], f64, f64);
    let cases: [Case<'_>; 6] = [
        (plate(0.0), false, "s.fx", &["s.x", "s.y", "s.rz"], 1e3, 2e6),
        (plate(0.0), false, "s.fy", &["s.y"], 1e3, 5e5),
        (plate(0.3), false, "s.fx", &["s.rz"], 1e3, 5e5),
        (FLOATS.to_owned(), true, "a.fx", &["c.x"], 1e3, 2e5),
        (FLOATS.to_owned(), true, "a.fy", &["c.y"], 100.0, 5e3),
        (FLOATS.to_owned(), false, "a.fx", &["c.x"], 100.0, 5e3),
    ];
    for (text, undamped, drive, signals, from, to) in cases {
        let options = CompileOptions { undamped, ..CompileOptions::default() };
        let model = compile(&Bundle::from_text("plate.net", &text), &options).unwrap();
        let signals = signals.iter().map(|s| (*s).to_owned()).collect();
        let asked =
            HarmonicOptions { drive: drive.into(), signals, from, to, points: 61, ..HarmonicOptions::default() };
        let (fitted, found) = harmonic_fitted(&model, &asked, &mut |_| true).unwrap();
        println!("{drive} to {to:e}: {} unknowns, told {:?}", fitted.unknowns(), found.estimated_error);
        assert!(fitted.unknowns() <= 160, "{drive} to {to:e}: {} unknowns", fitted.unknowns());
        assert!(
            found.estimated_error.is_some_and(|error| error <= 1e-3),
            "{drive} to {to:e}: {:?}",
            found.estimated_error
        );
    }
}
