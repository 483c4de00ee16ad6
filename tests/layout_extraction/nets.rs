//! Labels on conductors name nets: ports, ground, and what carries current. References: netlists written by hand, Ohm's law.

use super::draw::Sheet;
use super::{POLY, extracted};
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::layout::extract::netlist;
use bimorph::netlist::Bundle;

/// PolyMUMPs' sheet resistance (Ω/square).
const SHEET: f64 = 20.0;

fn model(text: &str) -> CompiledModel {
    let options = CompileOptions { junctions: Junctions::Centreline, ..CompileOptions::default() };
    compile(&Bundle::from_text("nets.net", text), &options).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// A chevron of two legs of 200 µm at 3° between pads, with a label on each pad.
fn chevron(left: &str, right: &str) -> Sheet {
    let mut sheet = Sheet::new(0.0, [0.0; 2]);
    let (s, c) = 3f64.to_radians().sin_cos();
    let (apex, end) = ([200.0 * c, 200.0 * s], [400.0 * c, 0.0]);
    sheet.beam([0.0; 2], apex, [2.0; 2], [2.0, 0.0]);
    sheet.beam(apex, end, [2.0; 2], [0.0, 2.0]);
    sheet.pad([-20.0, -10.0], [0.0, 10.0]);
    sheet.pad([end[0], -10.0], [end[0] + 20.0, 10.0]);
    sheet.label(left, [-10.0, 4.0]);
    sheet.label(right, [end[0] + 10.0, 4.0]);
    sheet.label("apex", apex);
    sheet
}

/// A heated chevron drawn without labels of ours is the one of docs/reference/elements.md. Its apex moves at 2 V as that of the
/// netlist by hand, within 0.5 %: pads are cut off at their edges, and the corner at the apex is rounded to 1 nm.
#[test]
fn a_heated_chevron() {
    let found = extracted(chevron("heat", "GND").drawing());
    assert!(found.unrecognised.is_empty() && found.notes.is_empty(), "{:?} {:?}", found.unrecognised, found.notes);
    let text = netlist(&found);
    assert_eq!(
        (text.matches("beam2det p1").count(), text.matches("\nheat port * [heat] []").count()),
        (2, 1),
        "{text}"
    );
    let warm = POLY.replace(
        " h=2u",
        " h=2u thermalexpansion=2.33e-6 sheetresistance=20 thermcond=30 specificheat=712 ambienttemperature=293",
    );
    let hand = format!(
        "{warm}anchor p1 [a] []\nbeam2det p1 [a apex] [l=200u w=2u oz=deg(3)]\n\
         beam2det p1 [apex b] [l=200u w=2u oz=-deg(3)]\nanchor p1 [b] []\neground * [b] []\nheat port * [a] []"
    );
    let apex = |text: &str| {
        let balance = static_equilibrium(&model(text), &[("heat".to_owned(), 2.0)]).unwrap();
        let moved = balance.nodes.iter().find(|(name, _)| name == "apex").unwrap().1;
        (moved.y, balance.currents_a[0].1)
    };
    let ((drawn, current), (want, _)) = (apex(&text), apex(&hand));
    assert!((drawn / want - 1.0).abs() < 5e-3 && drawn > 1e-7, "{drawn} instead of {want}\n{text}");
    // 200 squares
    assert!((current / (2.0 / (200.0 * SHEET)) - 1.0).abs() < 5e-3, "{current}");
}

/// Without a ground among the labels both pads are ports; one label alone on a part names a node, and no current flows.
#[test]
fn ports_and_single_labels() {
    let text = netlist(&extracted(chevron("a", "b").drawing()));
    assert!(text.contains("\na port * [a] []") && text.contains("\nb port * [b] []"), "{text}");
    let one = netlist(&extracted(chevron("a", "a").drawing()));
    assert!(one.contains("beam2d p1") && !one.contains("port") && !one.contains("det"), "{one}");
}

/// Current and heat go through a rigid block and through two legs on either side of it: twice the current of one pair, 200 squares long.
#[test]
fn current_through_a_rigid_block() {
    let mut sheet = Sheet::new(0.0, [0.0; 2]);
    for y in [-30.0, 30.0] {
        sheet.rectangle("POLY1", [0.0, y - 1.0], [200.0, y + 1.0]);
        sheet.rectangle("POLY1", [260.0, y - 1.0], [460.0, y + 1.0]);
    }
    sheet.rectangle("POLY1", [200.0, -50.0], [260.0, 50.0]);
    sheet.pad([-20.0, -50.0], [0.0, 50.0]);
    sheet.pad([460.0, -50.0], [480.0, 50.0]);
    // wiring under the left pad, with its label far away
    sheet.rectangle("POLY0", [-300.0, -5.0], [-10.0, 5.0]);
    sheet.label("hot", [-290.0, 0.0]);
    sheet.label("0", [470.0, -40.0]);
    let found = extracted(sheet.drawing());
    assert!(found.unrecognised.is_empty() && found.notes.is_empty(), "{:?} {:?}", found.unrecognised, found.notes);
    let text = netlist(&found);
    let compiled = model(&text);
    assert_eq!(compiled.structure.ports.len(), 1, "{text}");
    let balance = static_equilibrium(&compiled, &[("hot".to_owned(), 1.0)]).unwrap();
    let current = balance.currents_a[0].1;
    assert!((current / (2.0 / (200.0 * SHEET)) - 1.0).abs() < 1e-6, "{current}\n{text}");
    // at the block, half way, a bar heated evenly is warmest: its mean is two thirds of that, V²/(12 ρ k)
    let want = 1.0 / (12.0 * SHEET * 2e-6 * 30.0);
    for (name, kelvin) in &balance.temperatures_k {
        assert!(((kelvin - 293.0) / want - 1.0).abs() < 1e-6, "{name}: {kelvin}, not {want} above 293\n{text}");
    }
}

/// Of a comb drive the rotor's label grounds it or makes it a port, that of the stator names its port.
#[test]
fn labels_of_combs_are_ports() {
    for (rotor, ports) in [("gnd", vec!["drive"]), ("mass", vec!["drive", "mass"])] {
        let mut sheet = Sheet::new(0.0, [0.0; 2]);
        sheet.pad([-15.0, -5.0], [0.0, 5.0]);
        sheet.rectangle("POLY1", [0.0, -1.0], [100.0, 1.0]);
        sheet.rectangle("POLY1", [100.0, -40.0], [120.0, 40.0]);
        (-4..=4).map(|k| 8.0 * f64::from(k)).for_each(|y| sheet.rectangle("POLY1", [120.0, y - 1.0], [160.0, y + 1.0]));
        sheet.pad([180.0, -45.0], [200.0, 45.0]);
        (-5..5).map(|k| 8.0 * f64::from(k) + 4.0).for_each(|y| {
            sheet.rectangle("POLY1", [140.0, y - 1.0], [180.0, y + 1.0]);
        });
        sheet.label("drive", [190.0, 40.0]);
        sheet.label(rotor, [-10.0, 0.0]);
        let found = extracted(sheet.drawing());
        assert!(found.notes.is_empty(), "{:?}", found.notes);
        let text = netlist(&found);
        let mut named: Vec<String> = model(&text).structure.ports.iter().map(|p| p.name.clone()).collect();
        named.sort();
        assert_eq!(named, ports, "{text}");
    }
}

/// Ground is one by whatever names: two labels of ground on the pads of one part make no current between them.
#[test]
fn ground_has_many_names() {
    for other in ["GND", "vss", "0"] {
        let found = extracted(chevron("gnd", other).drawing());
        assert!(found.live.is_empty(), "{other}: {:?}", found.nets);
        let text = netlist(&found);
        assert!(text.matches("beam2d p1").count() == 2 && !text.contains("det"), "{other}: {text}");
    }
}

/// A label on a moving part, on its own layer, names a node of it and not the wiring or the pad of another layer
/// beneath. Where wiring alone lies under the label, or the label is on the wiring's layer, it names the wiring.
#[test]
fn a_label_on_what_moves_is_not_of_the_wiring_beneath() {
    let mut sheet = Sheet::new(0.0, [0.0; 2]);
    sheet.pad([-20.0, -10.0], [0.0, 10.0]);
    sheet.rectangle("POLY1", [0.0, -1.0], [100.0, 1.0]);
    sheet.rectangle("POLY1", [100.0, -20.0], [140.0, 20.0]);
    // a shield under all of the mass, and wiring from it to a pad of its own
    sheet.rectangle("POLY0", [90.0, -30.0], [300.0, 30.0]);
    sheet.pad([280.0, -10.0], [300.0, 10.0]);
    sheet.label("mass", [120.0, 0.0]);
    sheet.label("shield", [200.0, 0.0]);
    let found = extracted(sheet.drawing());
    assert!(found.notes.is_empty(), "{:?}", found.notes);
    let nets: Vec<&str> = found.nets.iter().map(|net| net.name.as_str()).collect();
    assert_eq!(nets, ["shield"]);
    let named: Vec<&str> = found.nodes.iter().filter(|n| n.labelled).map(|n| n.name.as_str()).collect();
    assert!(named.contains(&"mass"), "{named:?}");
}

/// A ground plane with holes joins the pads that it overlaps, one of two hundred here in a hole of it stands alone.
#[test]
fn a_perforated_plane_joins_what_it_overlaps() {
    let mut sheet = Sheet::new(0.0, [0.0; 2]);
    let at = |k: i32| 60.0 * f64::from(k);
    for (i, j) in (0..15).flat_map(|i| (0..15).map(move |j| (at(i), at(j)))) {
        // a frame of 60 by 60 with a hole of 30 by 30
        sheet.rectangle("POLY0", [i - 30.0, j - 30.0], [i + 30.0, j - 15.0]);
        sheet.rectangle("POLY0", [i - 30.0, j + 15.0], [i + 30.0, j + 30.0]);
        sheet.rectangle("POLY0", [i - 30.0, j - 15.0], [i - 15.0, j + 15.0]);
        sheet.rectangle("POLY0", [i + 15.0, j - 15.0], [i + 30.0, j + 15.0]);
    }
    for (i, j) in (0..14).flat_map(|i| (0..14).map(move |j| (i, j))) {
        let past = if (i, j) == (7, 7) { 0.0 } else { 20.0 };
        sheet.pad([at(i) - 10.0, at(j) - 10.0], [at(i) + 10.0 + past, at(j) + 10.0]);
    }
    sheet.label("plane", [at(2), at(3)]);
    sheet.label("alone", [at(7), at(7)]);
    let found = extracted(sheet.drawing());
    let pads: Vec<_> = found.nets.iter().map(|net| (net.name.as_str(), net.pads.len())).collect();
    assert_eq!(pads, [("plane", 195), ("alone", 1)]);
}

/// A bond pad twice as long as wide that stands alone is held like a square one, also at its ends. Its label names the
/// net of the pad that wiring joins with it; before, it was reported as floating.
#[test]
fn a_long_bond_pad() {
    let mut sheet = Sheet::new(0.0, [0.0; 2]);
    sheet.beam([0.0; 2], [200.0, 0.0], [2.0; 2], [2.0; 2]);
    sheet.pad([-20.0, -10.0], [0.0, 10.0]);
    sheet.pad([200.0, -10.0], [220.0, 10.0]);
    sheet.pad([-20.0, 100.0], [20.0, 120.0]);
    sheet.rectangle("POLY0", [-15.0, -5.0], [-5.0, 115.0]);
    sheet.label("heat", [12.0, 110.0]);
    sheet.label("gnd", [210.0, 0.0]);
    let found = extracted(sheet.drawing());
    assert!(found.unrecognised.is_empty() && found.notes.is_empty(), "{:?} {:?}", found.unrecognised, found.notes);
    // 400 + 400 + 800 µm², and the beam
    assert!((found.layers[0].anchored * 1e12 - 1600.0).abs() < 1e-3, "{:?}", found.layers[0]);
    let text = netlist(&found);
    assert!(text.contains("beam2det p1") && text.contains("heat port * "), "{text}");
}

/// Of labels without an object the first twenty are reported, and the number of the others.
#[test]
fn few_labels_are_reported() {
    let mut sheet = chevron("a", "b");
    (0..1000).for_each(|k| sheet.label("lost", [f64::from(k), 500.0]));
    let notes = extracted(sheet.drawing()).notes;
    assert!(notes.len() == 21 && notes[20].starts_with("980 more labels"), "{notes:?}");
}
