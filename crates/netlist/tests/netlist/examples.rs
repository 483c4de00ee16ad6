//! Whole netlists: every file in tests/netlists loads without a message and holds what was drawn.

use bimorph_base::Setting;
use bimorph_netlist::{load, read_bundle};
use bimorph_structure::LoadedNetlist;
use std::path::Path;

fn loaded(name: &str, set: &[(&str, f64)]) -> LoadedNetlist {
    let path = Path::new(crate::ROOT).join("tests/netlists").join(name);
    let bundle = read_bundle(&path, &[]).expect("readable");
    let set: Vec<_> = set.iter().map(|(n, v)| ((*n).to_owned(), Setting::Number(*v))).collect();
    let loaded = load(&bundle, &set).unwrap_or_else(|d| panic!("{d}"));
    assert!(loaded.warnings.items.is_empty(), "{}", loaded.warnings);
    loaded
}

/// Each file loads as it is.
#[test]
fn all_load() {
    for name in ["bank.net", "switch.net", "comb.net"] {
        loaded(name, &[]);
    }
}

/// A bank of bimorphs: heaters only in the hot arms, one port each, the yoke between neighbours.
#[test]
fn bank() {
    let s = loaded("bank.net", &[("N", 4.0)]).structure;
    assert_eq!((s.beams.len(), s.supports.len(), s.ports.len(), s.resistors.len()), (4 * 5 + 3, 8, 4, 12));
    let heated: Vec<&str> = s.beams.iter().filter(|b| b.heater.is_some()).map(|b| b.name.as_str()).collect();
    assert_eq!(heated, ["b(1).hot", "b(2).hot", "b(3).hot", "b(4).hot"]);
    assert_eq!(s.ports[2].name, "in(3)");
    let y = |k: usize| s.nodes[s.node(&format!("y({k})")).expect("yoke").0].position[1];
    for k in 2..=4 {
        assert!((y(k) - y(k - 1) - 50e-6).abs() < 1e-18);
    }
}

/// Elaboration makes exactly one structure element for each netlist element: its size grows with N and nothing else.
#[test]
fn linear_growth() {
    let size = |n: f64| {
        let s = loaded("bank.net", &[("N", n)]).structure;
        (s.nodes.len(), s.beams.len())
    };
    let (nodes, beams) = size(1.0);
    let step = {
        let (n2, b2) = size(2.0);
        (n2 - nodes, b2 - beams)
    };
    assert_eq!(size(50.0), (nodes + 49 * step.0, beams + 49 * step.1));
}

/// A node is found by name in constant time, and after the structure has grown as well.
#[test]
fn nodes_by_name() {
    let mut s = loaded("bank.net", &[]).structure;
    let tip = s.node("y(2)").expect("tip");
    assert_eq!(s.nodes[tip.0].name, "y(2)");
    assert_eq!(s.node("nobody"), None);
    let mut extra = s.nodes[tip.0].clone();
    extra.name = "extra".into();
    s.nodes.push(extra);
    assert_eq!(s.node("extra").map(|n| n.0), Some(s.nodes.len() - 1));
    s.nodes.remove(0);
    assert_eq!(s.node("y(2)").map(|n| n.0 + 1), Some(tip.0));
}

/// A structure survives being written as JSON and read again.
#[test]
fn structure_as_json() {
    let s = loaded("switch.net", &[]).structure;
    let text = serde_json::to_string(&s).expect("written");
    assert_eq!(serde_json::from_str::<bimorph_structure::Structure>(&text).expect("read"), s);
}
