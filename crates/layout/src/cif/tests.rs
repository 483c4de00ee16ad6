//! CIF reads to the polygons that its commands draw; what is wrong is one error with line and column.
//! Sources: Mead and Conway (1980), coordinates by hand.

use super::*;
use crate::FlatLayout;
use crate::drawing::Polygon;
use crate::regions;
use proptest::prelude::*;

fn drawing(text: &str) -> FlatLayout {
    read(text.as_bytes(), "x.cif").unwrap_or_else(|e| panic!("{e}")).flatten(None).unwrap_or_else(|e| panic!("{e}"))
}

fn fault(text: &str) -> String {
    match read(text.as_bytes(), "x.cif") {
        Err(e) => e.to_string(),
        Ok(library) => library.flatten(None).map(|_| String::new()).unwrap_or_else(|e| e.to_string()),
    }
}

fn only(d: &FlatLayout, layer: &str) -> Polygon {
    assert_eq!(d.layers[layer].len(), 1, "{d:?}");
    d.layers[layer][0].clone()
}

#[test]
fn boxes_have_a_length_along_their_direction_and_symbols_a_scale() {
    let d = drawing("(a (nested) comment); DS 1 2 10; 9 beam; L POLY1; B 1000 20 100,50 0 1; DF; C 1; E");
    // 200 by 4 centimicrons, upright about (20, 10).
    assert_eq!((d.unit_m, d.top.as_str()), (1e-8, "beam"));
    assert_eq!(only(&d, "POLY1"), Polygon::rectangle([18, -90], [22, 110]));
    // Half units and tenths get a finer grid.
    let d = drawing("DS 1 1 10; L NM; B 3 4 0 0; DF; C 1; E");
    assert_eq!(d.unit_m, 1e-10);
    assert_eq!(only(&d, "NM"), Polygon::rectangle([-15, -20], [15, 20]));
}

#[test]
fn calls_mirror_turn_and_shift_in_the_order_in_which_they_stand() {
    let symbol = "DS 7; L A; B 2 2 11 1; DF;";
    let at = |call: &str| only(&drawing(&format!("{symbol} {call} E")), "A");
    assert_eq!(at("C 7 T 100 0;"), Polygon::rectangle([110, 0], [112, 2]));
    assert_eq!(at("C 7 MX;"), Polygon::rectangle([-12, 0], [-10, 2]));
    assert_eq!(at("C 7 MY T0 100;"), Polygon::rectangle([10, 98], [12, 100]));
    assert_eq!(at("C 7 R 0 5 T 100,0;"), Polygon::rectangle([98, 10], [100, 12]));
    assert_eq!(at("C 7 T 100 0 R 0 5;"), Polygon::rectangle([-2, 110], [0, 112]));
    // Nested, each symbol with its own scale, which does not reach into the called one.
    let d = drawing("DS 1 3 1; C 2 T 10 0; DF; DS 2; L A; B 2 2 0 0; DF; C 1; E");
    assert_eq!(only(&d, "A"), Polygon::rectangle([29, -1], [31, 1]));
    assert_eq!(d.cells.iter().map(|c| (c.cell.as_str(), c.origin)).collect::<Vec<_>>(), [("2", [30.0, 0.0])]);
}

#[test]
fn a_turned_box_keeps_its_width_on_a_finer_grid() {
    // 10 um by 2 um, turned by atan(1/2): with integer centimicrons its corners would have errors of up to 5 nm.
    let d = drawing("L A; B 1000 200 0 0 2 1; E");
    assert_eq!(d.unit_m, 1e-12);
    let area = regions::area(&d.layers["A"]) * d.unit_m * d.unit_m;
    assert!((area / 20e-12 - 1.0).abs() < 1e-6, "{area}");
}

#[test]
fn wires_and_flashes_are_round() {
    let d = drawing("L A; W 200 0 0 1000 0; L B; R 200 0 0; E");
    let area = |layer: &str| regions::area(&d.layers[layer]) * d.unit_m * d.unit_m;
    let disc = std::f64::consts::PI * 1e-12;
    assert!((area("B") / disc - 1.0).abs() < 1e-6, "{}", area("B"));
    assert!((area("A") / (20e-12 + disc) - 1.0).abs() < 1e-6, "{}", area("A"));
}

#[test]
fn labels_names_and_redefined_symbols() {
    let d = drawing(
        "DS 1; 9 pad; L A; B 4 4 0 0; 94 root 2 2 A; 94 \"b1 beam2d; p1\" 1 -1; DF; C 1 T 10 0;\
         DD 1; DS 1; 9 pad; L A; B 6 6 0 0; DF; C 1; 0 remark of some program; E",
    );
    assert_eq!(d.layers["A"].len(), 2);
    assert_eq!(
        d.labels.iter().map(|l| (l.text.as_str(), l.at)).collect::<Vec<_>>(),
        [("root", [12, 2]), ("b1 beam2d; p1", [11, -1])]
    );
    assert_eq!(d.cells.iter().map(|c| c.cell.as_str()).collect::<Vec<_>>(), ["pad", "pad~2"]);
    assert!(d.notes[0].contains("1 user extensions passed over, the first at line 1: `0 remark"), "{:?}", d.notes);
}

#[test]
fn what_is_wrong_is_reported_with_its_place() {
    let cases = [
        ("L A; B 10 10 0 0;", "line 1, column 18: the file ends without `E`"),
        ("L A;\n B 10 0 0 0; E", "line 2, column 8: the width of a box is 0"),
        ("B 10 10 0 0; E", "no layer is chosen"),
        ("L A; P 0 0 1 1; E", "a polygon has 2 points: expected 3"),
        ("L A; P 0 0 1 1 2; E", "expected a whole number, found `;`"),
        ("L A; B 10 10 0.5 0; E", "CIF has no others"),
        ("L A; B 10 10 0 0 0 0; E", "points nowhere"),
        ("L A; B 99999999999999999999999 1 0 0; E", "too large"),
        ("DS 1; L A; B 1 1 0 0; C 1; DF; C 1; E", "which calls"),
        ("DS 1; C 2; DF; DS 2; C 1; DF; C 1; E", "again"),
        ("C 5; E", "`(top)` calls `symbol 5`, which is not in the file"),
        ("DS 1; DS 2; E", "`DF;` is missing"),
        ("DF; E", "outside a symbol"),
        ("DS 1; DF; DS 1; DF; E", "symbol 1 was defined before"),
        ("DS 1 0 1; DF; E", "a of the scale a/b is 0"),
        ("(never closed; L A; E", "line 1, column 1: the file ends inside this comment"),
        ("94 \"open 1 2; E", "is missing"),
        ("Q; E", "no command begins with `Q`"),
        ("L ; E", "expected the name of a layer, found `;`"),
        ("\u{0}\u{6}", "the byte 0x00"),
        ("E", "there is no cell"),
        ("L A; B 10 10 99999999999 0; E", "from its origin"),
        ("DS 1; L A; B 1 1 0 0; DF; E L", ""),
    ];
    for (text, expected) in cases {
        let found = fault(text);
        assert!(found.contains(expected) && (expected.is_empty() == found.is_empty()), "{text}\n{found}");
    }
}

#[test]
fn a_bomb_of_calls_is_refused_before_anything_is_laid_out() {
    let mut text = "DS 0; L A; B 1 1 0 0; DF;".to_owned();
    for k in 1..60 {
        text += &format!("DS {k}; C {0}; C {0} T 5 5; DF;", k - 1);
    }
    let found = fault(&format!("{text} C 59; E"));
    assert!(found.contains("at most 2000000") && found.contains("--cell"), "{found}");
    // Empty symbols all the way down lay out nothing, and still take time.
    let empty = fault(&format!("{} C 59; E", text.replace("L A; B 1 1 0 0; ", "")));
    assert!(empty.contains("placed cells"), "{empty}");
    let mut deep = "DS 0; L A; B 1 1 0 0; DF;".to_owned();
    for k in 1..200 {
        deep += &format!("DS {k}; C {}; DF;", k - 1);
    }
    assert!(fault(&format!("{deep} C 199; E")).contains("at most 100"));
}

proptest! {
    #[test]
    fn garbage_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = read(&bytes, "x.cif").map(|library| library.flatten(None));
    }

    /// Words of CIF in any order reach deeper than bytes do.
    #[test]
    fn shuffled_commands_never_panic(words in proptest::collection::vec(
        prop_oneof![
            Just("DS 1 1 3;".to_owned()), Just("DF;".to_owned()), Just("DD 1;".to_owned()), Just("L A;".to_owned()),
            Just("E".to_owned()), Just("C 1 MX R 1 2;".to_owned()), Just("(".to_owned()), Just("9 n;".to_owned()),
            (any::<i32>(), any::<i16>(), any::<i16>()).prop_map(|(a, b, c)| format!("B {a} {b} {c} 0 {b} {c};")),
            proptest::collection::vec(-50..50i32, 0..20).prop_map(|v| format!("P {v:?};").replace(['[', ']'], "")),
            proptest::collection::vec(-50..50i32, 0..20).prop_map(|v| format!("W 7 {v:?};").replace(['[', ']'], "")),
        ], 0..30)) {
        let text = words.concat();
        if let Ok(library) = read(text.as_bytes(), "x.cif")
            && let Ok(drawing) = library.flatten(None)
        {
            let largest = crate::drawing::LARGEST_COORDINATE;
            let points = drawing.layers.values().flatten().flat_map(|p| p.contours.iter().flatten().flatten());
            prop_assert!(points.clone().all(|x| x.abs() <= largest));
            for polygons in drawing.layers.values() {
                prop_assert!(polygons.iter().all(|p| p.twice_area() > 0));
                regions::union(polygons);
            }
        }
    }
}
