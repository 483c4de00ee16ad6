//! Backbending: hot arms that were heated too far are shorter ever after.

use crate::{close, model, node};
use bimorph::analysis::backbending::backbend;
use bimorph::analysis::mesh::static_backbent;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::{Setting, read_bundle};
use std::path::Path;

/// A stocky beam between two pads, of 100 MPa strength at 293 K and none at 1293 K.
const BAR: &str = "
anchor p1 [a] []
bar beam2det p1 [a b] [l=50u w=4u yieldstress=100e6 softening=1293]
anchor p1 [b] [oz=pi]
eground * [b] []
heat port * [a] []
";

fn volts(port: &str, v: f64) -> Vec<(String, f64)> {
    vec![(port.to_owned(), v)]
}

/// Clamped at both ends it is shortened by α·ΔT − σ_y(T̄)/E, to 1e-5, and by nothing while α·ΔT·E is below σ_y.
#[test]
fn a_clamped_bar_yields_to_its_strength() {
    let text = BAR.replace("[a b]", "[a m]").replace("l=50u", "l=25u").replace(
        "anchor p1 [b]",
        "other beam2det p1 [m b] [l=25u w=4u yieldstress=100e6 softening=1293]\nanchor p1 [b]",
    );
    let bar = model(&text, &CompileOptions::default());
    // ρ_el = 20 Ω/sq · 2 µm, k = 41 W/(m·K): the mean rise between the pads is V²/(12·ρ·k)
    let at = |rise: f64| (rise * 12.0 * 4e-5 * 41.0f64).sqrt();
    let strain = |rise: f64| -> f64 {
        let found = backbend(&bar, &volts("heat", at(rise))).unwrap();
        found.strains.iter().map(|(_, e)| 0.5 * e).sum()
    };
    assert_eq!(strain(100.0), 0.0);
    let free = 2.33e-6 * 400.0;
    close(strain(400.0), -(free - 100e6 * 0.6 / 165e9), 1e-5);
}

fn bank() -> CompiledModel {
    bank_with(CompileOptions::default())
}

fn bank_with(options: CompileOptions) -> CompiledModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bank/bank.net");
    let set = vec![("comb".to_owned(), Setting::Number(0.0))];
    compile(&read_bundle(&path, &[]).unwrap(), &CompileOptions { set, junctions: Junctions::Centreline, ..options })
        .unwrap()
}

/// The bank bends down while it is hot. After heating beyond the strength of its hot arms and cooling, it rests bent
/// up, by 6.9 µm for each µm of shortening within 3 % (independent frame solver, small displacements). Heated to the
/// temperature that the arms bear, it returns to the drawn position.
#[test]
fn a_bank_rests_bent_the_other_way() {
    let bank = bank();
    let rest = |bent: &CompiledModel| node(&static_equilibrium(bent, &[]).unwrap(), "yoke").y;
    let hot = static_equilibrium(&bank, &volts("heat", 3.2)).unwrap();
    assert!(node(&hot, "yoke").y < -1e-6);
    let bent = backbend(&bank, &volts("heat", 3.2)).unwrap();
    let shortest = bent.strains.iter().map(|(_, e)| *e).fold(0.0, f64::min);
    assert!(shortest < -1e-5, "{:?}", bent.strains);
    let arms = bent.strains.iter().filter(|(name, _)| name.ends_with(".hot")).map(|(_, e)| -e * 206e-6);
    let mean = arms.clone().sum::<f64>() / arms.count() as f64;
    close(rest(&bent.compiled) / mean, 6.9, 3e-2);
    let held = backbend(&bank, &volts("heat", 2.0)).unwrap();
    assert!(held.strains.iter().all(|(_, e)| *e == 0.0));
    assert_eq!(rest(&held.compiled), rest(&bank));
}

/// As above through the public interface, on the mesh that it chooses. At three tolerances the yoke rests where the
/// same bank rests on eight times the segments within the tolerance, and the estimate agrees.
#[test]
fn what_has_yielded_stays_on_every_mesh() {
    let at = |tol: f64, segments: Option<usize>| {
        let bank = bank_with(CompileOptions { tol, segments, ..CompileOptions::default() });
        let (fitted, found, _, strains) = static_backbent(&bank, &volts("heat", 3.2), &[]).unwrap();
        assert!(strains.iter().any(|(_, e)| *e < -1e-5), "{strains:?}");
        (node(&found, "yoke").y, fitted.order.estimated_error)
    };
    let (exact, _) = at(1e-3, Some(24));
    assert!(exact > 1e-7, "{exact}");
    for tol in [1e-2, 1e-3, 1e-4] {
        let (y, reported) = at(tol, None);
        assert!(reported.is_some_and(|reported| reported <= tol), "{tol}: {reported:?}");
        close(y, exact, tol);
    }
}

/// A mechanism without strengths causes a message that says so.
#[test]
fn nothing_can_yield() {
    let text = BAR
        .replace("yieldstress=100e6 softening=1293", "")
        .replace("[a b]", "[a m]")
        .replace("anchor p1 [b]", "beam2de p1 [m b] [l=25u w=4u]\nanchor p1 [b]");
    let bar = model(&text, &CompileOptions::default());
    let refused = backbend(&bar, &volts("heat", 1.0)).unwrap_err().to_string();
    assert!(refused.contains("yieldstress"), "{refused}");
}
