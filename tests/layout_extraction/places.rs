//! Messages about a layout name layer and place in the drawing, never a line of the netlist that was made of it. A body
//! that may be held by mistake is reported.

use bimorph::input::from_bytes;
use bimorph::netlist::load;

/// A body of 20 µm by 20 µm about the origin on four legs, 15 µm by 0.5 µm, to pads of 5 µm by 5 µm; units of 10 nm.
const CROSS: &str = "DS 1 1 1;\n9 CROSS;\nL P;\nB 2000 2000 0 0;\nB 1500 50 1750 0;\nB 1500 50 -1750 0;\nB 50 1500 0 1750;\nB 50 1500 0 -1750;\n\
    B 500 500 2750 0;\nB 500 500 -2750 0;\nB 500 500 0 2750;\nB 500 500 0 -2750;\n";

fn process(material: &str, layer: &str) -> String {
    format!(
        "name = \"mine\"\n[material.m]\n{material}\n[[layer]]\nname = \"p\"\ndrawn = [\"P\"]\nthickness = 2e-6\nmaterial = \"m\"\n{layer}\n"
    )
}

/// A process without a modulus, or without a density: the error and the warning name the layer and where the part is, and show no line.
#[test]
fn errors_name_the_drawing() {
    let drawing = format!("{CROSS}DF;\nC 1;\nE\n");
    let source = from_bytes(drawing.as_bytes(), "cross.cif", Some(&process("Youngsmodulus = 1e11", "")), None).unwrap();
    let text = load(&source.bundle, &[]).unwrap().warnings.to_string();
    assert!(text.contains("`density`") && text.contains("cross.cif: layer p at (0, 0) µm"), "{text}");
    let source = from_bytes(drawing.as_bytes(), "cross.cif", Some(&process("density = 2300", "")), None).unwrap();
    let error = load(&source.bundle, &[]).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("Youngsmodulus") && text.contains("cross.cif: layer p at (-17.5, 0) µm"), "{text}");
    assert!(!text.contains("beam2d p") && error.items.iter().all(|d| d.line == 0 && d.column == 0), "{text}");
    // a label of the drawing is a line of the netlist too
    let drawing = format!("{CROSS}94 \"x_nosuch_*_[plate1]_[F=1]\" 100 200 BIMORPH;\nDF;\nC 1;\nE\n").replace('_', " ");
    let material = "Youngsmodulus = 1e11\ndensity = 2300";
    let source = from_bytes(drawing.as_bytes(), "cross.cif", Some(&process(material, "")), None).unwrap();
    let text = load(&source.bundle, &[]).unwrap_err().to_string();
    assert!(text.contains("at (1, 2) µm") && !text.contains("cross.cif:1"), "{text}");
}

/// An undercut of 2 µm holds what is wider than 4 µm, so the body in the middle too: a note names it and the way out, which makes it the one
/// body that moves.
#[test]
fn a_body_that_an_undercut_holds() {
    let drawing = format!("{CROSS}DF;\nC 1;\nE\n");
    let material = "Youngsmodulus = 1e11\ndensity = 2300";
    let convert = |layer: &str| {
        let source = from_bytes(drawing.as_bytes(), "cross.cif", Some(&process(material, layer)), None).unwrap();
        source.converted.unwrap().report
    };
    let held = convert("undercut = 2e-6");
    let reported: Vec<&String> = held.notes.iter().filter(|n| n.contains("undercut")).collect();
    assert!(
        reported.len() == 1 && reported[0].contains("the body at (0, 0) µm is held") && reported[0].contains("4 limbs"),
        "{held:?}"
    );
    assert_eq!((held.counts["bodies"], held.counts["anchors"]), (0, 8));
    let free = convert("");
    assert_eq!((free.counts["bodies"], free.counts["anchors"]), (1, 4));
}
