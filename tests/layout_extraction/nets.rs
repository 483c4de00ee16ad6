//! Labels on conductors name nets: ports, ground, and what carries current. References: netlists written by hand, Ohm's law.

use super::draw::Sheet;
use super::{POLY, extracted};
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::{CompileOptions, Compiled, Junctions, compile};
use bimorph::layout::extract::netlist;
use bimorph::netlist::Bundle;

/// PolyMUMPs' sheet resistance [Ω/square].
const SHEET: f64 = 20.0;

fn model(text: &str) -> Compiled {
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

/// A heated chevron drawn without labels of ours is the one of docs/netlist.md: its apex moves at 2 V as that of the netlist by hand, within
/// 0.5 %: pads are cut off at their edges, and the corner at the apex is rounded to 1 nm.
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
