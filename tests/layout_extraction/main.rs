//! Drawings give back the mechanisms that they were drawn from. Each reference is the netlist that the drawing shows, written by hand
//! here; frequencies are compared without junctions (`centreline`), so that only the geometry counts.

mod draw;

use bimorph::analysis::modes::modes;
use bimorph::compile::{CompileOptions, Junctions, compile};
use bimorph::layout::drawing::Drawing;
use bimorph::layout::extract::{ExtractOptions, Extraction, extract, netlist};
use bimorph::layout::process::Process;
use bimorph::netlist::Bundle;
use draw::Sheet;

/// PolyMUMPs as the program has it, for netlists of references.
const POLY: &str = "process p1 = [ Poisson=0.3 Youngsmodulus=165e9 density=2300 h=2u viscosity=1.78e-5 fluid=2u ]\n";

fn extracted(drawing: &Drawing) -> Extraction {
    let process = Process::builtin("polymumps").unwrap();
    let found = extract(drawing, &process, &ExtractOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    for layer in &found.layers {
        let sum = layer.extracted + layer.anchored + layer.unrecognised;
        assert!((sum / (layer.drawn + layer.closed) - 1.0).abs() < 1e-9, "areas balance: {layer:?}");
    }
    found
}

fn frequencies(text: &str, count: usize) -> Vec<f64> {
    let options = CompileOptions { junctions: Junctions::Centreline, linear: true, ..CompileOptions::default() };
    let compiled = compile(&Bundle::from_text("model.net", text), &options).unwrap_or_else(|e| panic!("{e}\n{text}"));
    modes(&compiled, count, &[]).unwrap().frequencies_hz
}

/// The extracted netlist has the frequencies of another, each within a relative error.
fn agree(drawing: &Drawing, reference: &str, count: usize, relative: f64) -> String {
    let found = extracted(drawing);
    assert!(found.unrecognised.is_empty() && found.notes.is_empty(), "{:?} {:?}", found.unrecognised, found.notes);
    let text = netlist(&found);
    let (got, want) = (frequencies(&text, count), frequencies(&format!("{POLY}{reference}"), count));
    for (k, (got, want)) in got.iter().zip(&want).enumerate() {
        assert!((got / want - 1.0).abs() <= relative, "mode {}: {got} instead of {want}\n{text}", k + 1);
    }
    text
}

/// A folded flexure: a shuttle that hangs on four beams from two trusses, each of which hangs on two beams from pads.
fn folded(degrees: f64, shift: [f64; 2]) -> Sheet {
    let mut sheet = Sheet::new(degrees, shift);
    for side in [1.0, -1.0] {
        for x in [-40.0, -20.0, 20.0, 40.0] {
            sheet.beam([x, 10.0 * side], [x, 160.0 * side], [2.0; 2], [0.0, 2.0]);
        }
        sheet.beam([-40.0, 160.0 * side], [40.0, 160.0 * side], [4.0; 2], [1.0; 2]);
        for x in [-20.0, 20.0] {
            let (low, high) = (f64::min(10.0 * side, 2.0 * side), f64::max(10.0 * side, 2.0 * side));
            sheet.pad([x - 5.0, low], [x + 5.0, high]);
        }
        sheet.beam([40.0 * side, -10.0], [40.0 * side, 10.0], [8.0; 2], [0.0; 2]);
    }
    sheet.beam([-40.0, 0.0], [40.0, 0.0], [2.0; 2], [0.0; 2]);
    sheet
}

/// The same by hand: the uprights are short and thick, and beams stand on their ends.
const FOLDED: &str = "
subnet side [l r] [] [
  beam2d parent [l tl] [l=150u w=2u oz=pi/2]
  beam2d parent [r tr] [l=150u w=2u oz=pi/2]
  beam2d parent [tl al] [l=20u w=4u]
  beam2d parent [al ar] [l=40u w=4u]
  beam2d parent [ar tr] [l=20u w=4u]
  beam2d parent [pl al] [l=150u w=2u oz=pi/2]
  beam2d parent [pr ar] [l=150u w=2u oz=pi/2]
  anchor parent [pl] []
  anchor parent [pr] []
]
beam2d p1 [a b] [l=72u w=2u]
plate2d p1 [c] [l=8u w=20u]
plate2d p1 [d] [l=8u w=20u]
link2d * [c a] [l=4u]
link2d * [b d] [l=4u]
link2d * [c cu] [l=10u oz=pi/2]
link2d * [c cl] [l=10u oz=-pi/2]
link2d * [d du] [l=10u oz=pi/2]
link2d * [d dl] [l=10u oz=-pi/2]
side p1 [cu du] []
side p1 [dl cl] [oz=pi]
";

/// A Manhattan drawing gives its netlist back: lengths, widths and nodes are exact, and so are frequencies.
#[test]
fn a_folded_flexure_is_what_was_drawn() {
    let text = agree(folded(0.0, [0.0; 2]).drawing(), FOLDED, 6, 1e-9);
    assert_eq!(text.matches("\nbeam2d").count(), 15, "{text}");
    assert_eq!(text.matches("\nanchor").count(), 4, "{text}");
    assert!(text.contains("= 150u  % length of 8 beams"), "{text}");
}

/// Moved drawings give the same netlist but for nothing at all: places count from the first node.
#[test]
fn moving_a_drawing_changes_nothing() {
    let moved = |shift| netlist(&extracted(folded(0.0, shift).drawing()));
    assert_eq!(moved([0.0; 2]), moved([1234.567, -89.012]));
}

/// Turned by any angle, frequencies change by less than 1e-3: corners are rounded to 1 nm, 5e-4 of the beams' width.
#[test]
fn turning_a_drawing_changes_little() {
    for degrees in [0.01, 3.0, 37.0, 45.0, 89.9, 151.0, 270.0] {
        agree(folded(degrees, [0.0; 2]).drawing(), FOLDED, 6, 1e-3);
    }
}
