//! Cells that repeat come back as subnets, and the model is that of the flat drawing. Reference: the same drawing without its cells.

use super::{extracted, frequencies};
use bimorph::budget::{Allowance, Budget, within};
use bimorph::layout::convert::convert;
use bimorph::layout::drawing::FlatLayout;
use bimorph::layout::extract::netlist;
use bimorph::layout::{LayoutFormat, Process, from_bytes};
use bimorph::netlist::{Bundle, load};

/// An L of two beams on a pad, twice in a pair with a bar between their ends; units of 10 nm.
const CELLS: &str = "DS 1 1 1; 9 arm; L POLY1; B 2000 1000 -1000 0; B 10000 200 5000 0; B 300 6100 9950 2950; L ANCHOR1; B 1600 600 -1000 0; DF;
DS 2 1 1; 9 pair; C 1 T 0 0; C 1 MY T 0 20000; L POLY1; B 300 8200 9950 10000; DF;\n";

fn drawing(top: &str) -> FlatLayout {
    let text = format!("{CELLS}DS 3 1 1; 9 top; {top} DF;\nC 3;\nE\n");
    from_bytes(text.as_bytes(), "cells.cif", None).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The netlist with subnets has the modes of the flat one within 1e-9; answers it.
fn as_flat(drawing: &FlatLayout) -> String {
    let flat = FlatLayout { cells: Vec::new(), ..drawing.clone() };
    let (text, flat) = (netlist(&extracted(drawing)), netlist(&extracted(&flat)));
    assert!(!flat.contains("subnet"), "{flat}");
    let (got, want) = (frequencies(&text, 6), frequencies(&flat, 6));
    for (f, g) in got.iter().zip(&want) {
        assert!((f / g - 1.0).abs() < 1e-9, "{f} instead of {g}\n{text}\n{flat}");
    }
    let loaded = load(&Bundle::from_text("cells.net", &text), &[]).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert!(!loaded.warnings.to_string().contains("W011"), "{}\n{text}", loaded.warnings);
    text
}

/// Turned and mirrored, a cell is the same subnet; in a cell that repeats, those of its own are subnets of the subnet.
#[test]
fn cells_are_subnets() {
    let placed = "C 2 T 0 0; C 2 R 0 1 T 60000 0; C 2 MX R -1 0 T 120000 50000; C 2 R 0 -1 T 0 -40000;";
    let text = as_flat(&drawing(placed));
    assert_eq!((text.matches("subnet ").count(), text.matches(" pair_cell * [").count()), (2, 4), "{text}");
    // inside, one more of each
    assert_eq!(text.matches(" arm_cell * [").count(), 2, "{text}");
    assert!(text.contains("oz=pi/2") && text.contains("ox=pi"), "{text}");
}

/// Cells that a bar joins are subnets with a node for it.
#[test]
fn cells_hang_together_by_nodes() {
    let text = as_flat(&drawing("C 1 T 0 0; C 1 T 30000 0; C 1 T 60000 0; L POLY1; B 70000 200 45000 5950;"));
    assert_eq!(text.matches(" arm_cell * [").count(), 3, "{text}");
    assert!(text.contains("subnet arm_cell [t1]"), "{text}");
}

/// One that is drawn over is not the same any more, and stays flat; the others are subnets still.
#[test]
fn what_differs_stays_flat() {
    let text = as_flat(&drawing(
        "C 1 T 0 0; C 1 T 30000 0; C 1 T 60000 0; L POLY1; B 4000 200 65000 1000; B 200 1000 65000 500;",
    ));
    assert_eq!(text.matches(" arm_cell * [").count(), 2, "{text}");
}

/// The result, drawn and read again, is the same mechanism: modes within 1e-9.
#[test]
fn subnets_are_drawn_and_read_again() {
    let text = as_flat(&drawing("C 2 T 0 0; C 2 R 0 1 T 60000 0;"));
    let structure = load(&Bundle::from_text("cells.net", &text), &[]).unwrap().structure;
    let process = Process::builtin("polymumps").unwrap();
    let mask = bimorph::layout::mask::mask(&structure, &process, LayoutFormat::Gds, "cells.gds").unwrap();
    let again = convert(&from_bytes(&mask.bytes, "cells.gds", None).unwrap(), None).unwrap();
    assert!(again.netlist.contains("subnet"), "{}", again.netlist);
    for (f, g) in frequencies(&again.netlist, 6).iter().zip(frequencies(&text, 6)) {
        assert!((f / g - 1.0).abs() < 1e-9, "{f} instead of {g}");
    }
}

/// A text far away in a cell does not belong to its box: adjacent cells are subnets all the same. A label at no node
/// names nothing.
#[test]
fn a_text_far_away_is_no_part_of_a_cell() {
    let marked = CELLS.replace("9 arm;", "9 arm; 94 MARK 900000 900000 POLY1;");
    let text = format!("{marked}DS 3 1 1; 9 top; C 1 T 0 0; C 1 T 30000 0; C 1 T 60000 0; DF;\nC 3;\nE\n");
    let text = as_flat(&from_bytes(text.as_bytes(), "cells.cif", None).unwrap());
    assert_eq!(text.matches(" arm_cell * [").count(), 3, "{text}");
}

/// Cells that all overlap, because of a distant mark of metal in each, stay flat. Their memory is counted and does not
/// grow with their number times the content of each: 1600 cells over up to 3200 elements were some 10⁶ rows.
#[test]
fn cells_that_lie_over_each_other_stay_flat() {
    let place = |k: i32| format!("C 1 T {} {}; ", 12_000 * (k % 40), 2500 * (k / 40));
    let placed: String = (0..1600).map(place).collect();
    let text = format!(
        "DS 1 1 1; 9 arm; L POLY1; B 2000 1000 -1000 0; B 8000 200 4000 0; L ANCHOR1; B 1600 600 -1000 0; \
         L METAL; B 100 100 900000 900000; DF;\nDS 2 1 1; {placed} DF;\nC 2;\nE\n"
    );
    let drawing = from_bytes(text.as_bytes(), "marked.cif", None).unwrap();
    let flat = FlatLayout { cells: Vec::new(), ..drawing.clone() };
    let used = |drawing: &FlatLayout| {
        let budget = Budget::new(Allowance::default());
        let text = within(&budget, || netlist(&extracted(drawing))).unwrap();
        assert!(!text.contains("subnet"), "{text}");
        budget.used()
    };
    let more = used(&drawing) - used(&flat);
    assert!(more > 0 && more < 100_000_000, "{more} bytes");
}
