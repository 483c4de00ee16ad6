//! Streams read to the polygons that their records draw; a broken one is one error with its byte and record.
//! Source: the format's documentation (Calma, release 6), coordinates by hand.

use super::record::real_to;
use super::*;
use crate::FlatLayout;
use crate::drawing::Polygon;
use crate::flatten::FlattenError;
use proptest::prelude::*;

/// A record.
fn r(kind: u8, data: &[u8]) -> Vec<u8> {
    let mut all = ((data.len() + 4) as u16).to_be_bytes().to_vec();
    all.extend([kind, 0]);
    all.extend(data);
    all
}

fn shorts(kind: u8, values: &[i32]) -> Vec<u8> {
    r(kind, &values.iter().flat_map(|v| (*v as i16).to_be_bytes()).collect::<Vec<_>>())
}

fn longs(kind: u8, values: &[i32]) -> Vec<u8> {
    r(kind, &values.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<_>>())
}

fn reals(kind: u8, values: &[f64]) -> Vec<u8> {
    r(kind, &values.iter().flat_map(|v| real_to(*v)).collect::<Vec<_>>())
}

fn text(kind: u8, value: &str) -> Vec<u8> {
    let even = if value.len() % 2 == 1 { "\0" } else { "" };
    r(kind, format!("{value}{even}").as_bytes())
}

fn element(kind: u8, records: &[Vec<u8>]) -> Vec<u8> {
    [r(kind, &[]), records.concat(), r(kind::ENDEL, &[])].concat()
}

fn shape(of: u8, more: &[Vec<u8>], xy: &[i32]) -> Vec<u8> {
    let datatype = if of == kind::BOX { kind::BOXTYPE } else { kind::DATATYPE };
    element(of, &[shorts(kind::LAYER, &[2]), shorts(datatype, &[0]), more.concat(), longs(kind::XY, xy)])
}

fn cell(name: &str, elements: &[Vec<u8>]) -> Vec<u8> {
    [shorts(kind::BGNSTR, &[0; 12]), text(kind::STRNAME, name), elements.concat(), r(kind::ENDSTR, &[])].concat()
}

fn stream(cells: &[Vec<u8>]) -> Vec<u8> {
    [
        shorts(kind::HEADER, &[600]),
        shorts(kind::BGNLIB, &[0; 12]),
        text(kind::LIBNAME, "LIB"),
        reals(kind::UNITS, &[1e-3, 1e-9]),
        cells.concat(),
        r(kind::ENDLIB, &[]),
    ]
    .concat()
}

fn drawing(cells: &[Vec<u8>]) -> FlatLayout {
    let library = read(stream(cells).as_slice(), "x.gds", &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    library.flatten(None).unwrap_or_else(|e| panic!("{e}"))
}

fn boxed() -> Vec<u8> {
    shape(kind::BOUNDARY, &[], &[10, 0, 12, 0, 12, 2, 10, 2, 10, 0])
}

fn call(more: &[Vec<u8>], xy: &[i32]) -> Vec<u8> {
    element(kind::SREF, &[text(kind::SNAME, "part"), more.concat(), longs(kind::XY, xy)])
}

#[test]
fn boundaries_boxes_and_paths_of_all_types() {
    let width = longs(kind::WIDTH, &[4]);
    let path = |path_type: i32, more: &[Vec<u8>]| {
        let head = [shorts(kind::PATHTYPE, &[path_type]), width.clone(), more.concat()];
        drawing(&[cell("top", &[shape(kind::PATH, &head, &[0, 0, 10, 0])])]).layers["2/0"][0].clone()
    };
    let d = drawing(&[cell("top", &[boxed(), shape(kind::BOX, &[], &[0, 0, 5, 0, 5, 5, 0, 5, 0, 0])])]);
    assert_eq!(d.layers["2/0"], [Polygon::rectangle([10, 0], [12, 2]), Polygon::rectangle([0, 0], [5, 5])]);
    assert_eq!((d.unit_m, d.top.as_str(), d.notes.len()), (1e-9, "top", 0));
    assert_eq!(path(0, &[]), Polygon::rectangle([0, -2], [10, 2]));
    assert_eq!(path(2, &[]), Polygon::rectangle([-2, -2], [12, 2]));
    let extended = [longs(kind::BGNEXTN, &[1]), longs(kind::ENDEXTN, &[-3])];
    assert_eq!(path(4, &extended), Polygon::rectangle([-1, -2], [7, 2]));
    // Round ends leave the grid of the file: 1 pm.
    let round = path(1, &[]).twice_area() as f64 / 2e6;
    assert!((round / (40.0 + 4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{round}");
}

#[test]
fn calls_mirror_magnify_turn_and_shift() {
    let part = || cell("part", &[boxed()]);
    let at = |more: &[Vec<u8>], xy: &[i32]| {
        let d = drawing(&[part(), cell("top", &[call(more, xy)])]);
        (d.layers["2/0"][0].clone(), d.unit_m)
    };
    let strans = |bits: i32| shorts(kind::STRANS, &[bits]);
    assert_eq!(at(&[], &[100, 0]).0, Polygon::rectangle([110, 0], [112, 2]));
    assert_eq!(at(&[strans(-0x8000)], &[0, 0]).0, Polygon::rectangle([10, -2], [12, 0]));
    let turned = [strans(-0x8000), reals(kind::MAG, &[2.0]), reals(kind::ANGLE, &[90.0])];
    assert_eq!(at(&turned, &[0, 0]).0, Polygon::rectangle([0, 20], [4, 24]));
    let (skew, unit) = at(&[strans(0), reals(kind::ANGLE, &[30.0])], &[0, 0]);
    assert_eq!(unit, 1e-12);
    assert!((skew.twice_area() as f64 / 8e6 - 1.0).abs() < 1e-3);
    // An array: from column to column (20, 0), from row to row (0, 10).
    let array = [text(kind::SNAME, "part"), shorts(kind::COLROW, &[3, 2]), longs(kind::XY, &[0, 0, 60, 0, 0, 20])];
    let d = drawing(&[cell("top", &[element(kind::AREF, &array)]), part()]);
    assert_eq!(d.layers["2/0"].len(), 6);
    assert_eq!(d.layers["2/0"][5], Polygon::rectangle([50, 10], [52, 12]));
    assert_eq!(d.cells[5].origin, [40.0, 10.0]);
}

#[test]
fn texts_are_labels_and_nodes_are_reported() {
    let label = element(
        kind::TEXT,
        &[
            shorts(kind::LAYER, &[63]),
            shorts(kind::TEXTTYPE, &[1]),
            longs(kind::XY, &[7, 8]),
            text(kind::STRING, "yoke"),
            shorts(kind::PROPATTR, &[1]),
            text(kind::PROPVALUE, "ignored"),
        ],
    );
    let node =
        element(kind::NODE, &[shorts(kind::LAYER, &[1]), shorts(kind::NODETYPE, &[0]), longs(kind::XY, &[0, 0])]);
    let d = drawing(&[cell("top", &[label, node, shape(kind::PATH, &[], &[0, 0, 9, 9])])]);
    assert_eq!((d.labels[0].layer.as_str(), d.labels[0].text.as_str(), d.labels[0].at), ("63/1", "yoke", [7, 8]));
    assert_eq!(d.notes.len(), 2, "{:?}", d.notes);
}

#[test]
fn what_is_wrong_is_reported_with_its_byte_and_record() {
    let fault = |bytes: &[u8]| match read(bytes, "x.gds", &mut |_| true) {
        Err(e) => e.to_string(),
        Ok(library) => library.flatten(None).map(|_| String::new()).unwrap_or_else(|e| e.to_string()),
    };
    let whole = stream(&[cell("top", &[boxed()])]);
    assert_eq!(fault(&whole), "");
    for cut in 0..whole.len() {
        let found = fault(&whole[..cut]);
        assert!(found.contains("is it whole?") || (cut < 6 && found.contains("HEADER")), "{cut}: {found}");
    }
    let with = |element: Vec<u8>| stream(&[cell("top", &[element])]);
    let mut odd = whole.clone();
    odd[7] = 3;
    let cases = [
        (odd, "byte 6, record BGNLIB: its length is 3"),
        (vec![0; 64], "HEADER"),
        (b"%SEMI-OASIS\r\n".to_vec(), "no GDSII stream"),
        (with(shape(kind::BOUNDARY, &[], &[1, 2, 3])), "pairs of four-byte numbers"),
        (with(element(kind::BOUNDARY, &[shorts(kind::LAYER, &[1])])), "the BOUNDARY that ends here has no XY"),
        (with(element(kind::BOUNDARY, &[longs(kind::XY, &[1, 2])])), "has no LAYER"),
        (with(call(&[], &[0, 0])), "`top` calls `part`, which is not in the file"),
        (stream(&[cell("part", &[call(&[], &[0, 0])])]), "which calls `part` again"),
        (with(shape(kind::PATH, &[shorts(kind::PATHTYPE, &[3])], &[0, 0, 1, 1])), "0, 1, 2 or 4"),
        (with(call(&[reals(kind::MAG, &[0.0])], &[0, 0])), "a magnification is 0"),
        (with([r(kind::BOUNDARY, &[]), r(kind::BGNSTR, &[])].concat()), "ENDEL before it"),
        (stream(&[boxed()]), "a cell (BGNSTR) around it"),
        (
            stream(&[cell("a", &[boxed()]), cell("b", &[boxed()])]),
            "2 cells are called by no other, a, b: choose one with --cell",
        ),
        (stream(&[]), "there is no cell"),
        (
            with(element(kind::AREF, &[text(kind::SNAME, "top"), shorts(kind::COLROW, &[0, 2])])),
            "the number of columns is 0",
        ),
    ];
    for (bytes, expected) in cases {
        let found = fault(&bytes);
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn a_bomb_of_arrays_is_refused_before_anything_is_laid_out() {
    let array = |of: &str| {
        let xy = longs(kind::XY, &[0, 0, 32767, 0, 0, 32767]);
        element(kind::AREF, &[text(kind::SNAME, of), shorts(kind::COLROW, &[32767, 32767]), xy])
    };
    let cells = [cell("a", &[boxed()]), cell("b", &[array("a")]), cell("c", &[array("b")]), cell("d", &[array("c")])];
    let refused = read(stream(&cells).as_slice(), "x.gds", &mut |_| true).unwrap().flatten(None);
    assert!(matches!(refused, Err(FlattenError::Large { .. })), "{refused:?}");
}

#[test]
fn whoever_watches_can_stop() {
    let many: Vec<Vec<u8>> = (0..REPORT).map(|_| boxed()).collect();
    let stopped = read(stream(&[cell("top", &many)]).as_slice(), "x.gds", &mut |_| false);
    assert_eq!(stopped.unwrap_err().fault, GdsFault::Interrupted);
}

proptest! {
    #[test]
    fn garbage_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let mut headed = shorts(kind::HEADER, &[600]);
        headed.extend(&bytes);
        let _ = read(bytes.as_slice(), "x.gds", &mut |_| true);
        let _ = read(headed.as_slice(), "x.gds", &mut |_| true);
    }

    /// A right stream with some bytes changed reaches deeper than garbage does.
    #[test]
    fn damage_never_panics(changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..8)) {
        let strans = [shorts(kind::STRANS, &[0]), reals(kind::MAG, &[2.0]), reals(kind::ANGLE, &[10.0])];
        let path = shape(kind::PATH, &[shorts(kind::PATHTYPE, &[1]), longs(kind::WIDTH, &[4])], &[0, 0, 9, 0, 9, 9, 0, 1]);
        let mut bytes = stream(&[cell("part", &[boxed(), path]), cell("top", &[call(&strans, &[5, 5])])]);
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(library) = read(bytes.as_slice(), "x.gds", &mut |_| true)
            && let Ok(drawing) = library.flatten(None)
        {
            for polygons in drawing.layers.values() {
                prop_assert!(polygons.iter().all(|p| p.twice_area() > 0));
                crate::regions::union(polygons);
            }
        }
    }
}
