//! A hierarchy written in either format reads back to the same drawing, whatever is in it; and a large one reads whole.
//! Sources: the hierarchies are random; areas by hand.

use super::cells::{Cell, CellReference, CellShape, CellText, Library, Transform};
use super::drawing::FlatLayout;
use super::{from_bytes, regions, write_cif, write_gds};
use proptest::prelude::*;

/// A library in whole units: each cell calls earlier ones only.
fn library() -> impl Strategy<Value = Library> {
    let point = || [(-500..500i32).prop_map(f64::from), (-500..500i32).prop_map(f64::from)];
    let shape =
        (0..3u32, proptest::collection::vec(point(), 3..9)).prop_map(|(layer, points)| CellShape { layer, points });
    let turn = (0..4u8, any::<bool>(), point());
    let call = (any::<proptest::sample::Index>(), turn, 1..3u32, 1..3u32, [point(), point()]);
    let text = (0..3u32, "[a-z][a-z0-9_]{0,6}( [a-z=\\[\\]0-9.]{1,9})?", point());
    let text = text.prop_map(|(layer, text, at)| CellText { layer: Some(layer), text, at });
    let cell = (
        proptest::collection::vec(shape, 0..4),
        proptest::collection::vec(text, 0..3),
        proptest::collection::vec(call, 0..3),
    );
    proptest::collection::vec(cell, 1..5).prop_map(|cells| {
        let mut library = Library { source: "x".into(), unit_m: 1e-9, ..Library::default() };
        for layer in ["1/0", "2/0", "2/7"] {
            library.layer(layer);
        }
        for (k, (shapes, texts, calls)) in cells.into_iter().enumerate() {
            let call = |(which, (quarter, mirrored, origin), columns, rows, pitch): RandomCall| {
                let turn = Transform::turn_degrees(90.0 * f64::from(quarter));
                let transform = Transform::shift(origin).after(&turn).after(&Transform::mirror([false, mirrored]));
                let cell = format!("c{}", which.index(k));
                CellReference { cell, place: String::new(), transform, count: [columns, rows], pitch }
            };
            let calls = if k == 0 { Vec::new() } else { calls.into_iter().map(call).collect() };
            library.cells.push(Cell { name: format!("c{k}"), shapes, texts, calls });
        }
        library
    })
}

/// A call: which cell, turned how, where, how often and how far apart.
type RandomCall = (proptest::sample::Index, (u8, bool, [f64; 2]), u32, u32, [[f64; 2]; 2]);

/// Visible content of a drawing (nm): merged polygons by layer, labels.
type VisibleContent = (Vec<(String, Vec<Vec<Vec<[i64; 2]>>>)>, Vec<(String, [i64; 2])>);

fn shown(d: &FlatLayout) -> VisibleContent {
    let nm = |p: &[i32; 2]| p.map(|x| i64::from(x) * (d.unit_m / 1e-9).round() as i64);
    let merged = |all: &Vec<super::Polygon>| {
        let contours = |p: super::Polygon| p.contours.iter().map(|c| c.iter().map(nm).collect()).collect();
        regions::union(all).into_iter().map(contours).collect::<Vec<Vec<Vec<[i64; 2]>>>>()
    };
    let layers = d.layers.iter().map(|(name, all)| (super::process::canonical(name), merged(all)));
    let mut labels: Vec<_> = d.labels.iter().map(|l| (l.text.clone(), nm(&l.at))).collect();
    labels.sort();
    (layers.filter(|(_, all)| !all.is_empty()).collect(), labels)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    #[test]
    fn what_is_written_reads_back(library in library()) {
        let top = format!("c{}", library.cells.len() - 1);
        let direct = library.clone().flatten(Some(&top)).unwrap();
        let gds = from_bytes(&write_gds::write(&library).unwrap(), "x.gds", Some(&top)).unwrap();
        let cif = from_bytes(write_cif::write(&library).unwrap().as_bytes(), "x.cif", Some(&top)).unwrap();
        prop_assert_eq!(shown(&direct), shown(&gds));
        prop_assert_eq!(shown(&gds), shown(&cif));
    }
}

/// The two formats of one device, as programs export it: scaled symbols here, database units there.
#[test]
fn a_device_in_both_formats_is_one_drawing() {
    let cif = "(one device);\nDS 1 1 10;\n9 TOP;\nL L4D0;\nP -2190,-2190 -2190,-1590 1190,-1590 1190,-2190;\n\
               L L7D0;\nB 550 550 -1062,-19;\nB 551 550 758,-117;\nDF;\nC 1;\nE\n";
    let mut library = Library { source: "x".into(), unit_m: 1e-9, ..Library::default() };
    let (plate, cap) = (library.layer("4/0"), library.layer("7/0"));
    let boxed = |x: f64, y: f64, w: f64| {
        vec![[x - w / 2.0, y - 275.0], [x + w / 2.0, y - 275.0], [x + w / 2.0, y + 275.0], [x - w / 2.0, y + 275.0]]
    };
    let shapes = vec![
        CellShape {
            layer: plate,
            points: vec![[-2190.0, -2190.0], [-2190.0, -1590.0], [1190.0, -1590.0], [1190.0, -2190.0]],
        },
        CellShape { layer: cap, points: boxed(-1062.0, -19.0, 550.0) },
        // An odd width: half units.
        CellShape { layer: cap, points: boxed(758.0, -117.0, 552.0) },
    ];
    library.cells.push(Cell { name: "TOP".into(), shapes, ..Cell::default() });
    let gds = from_bytes(&write_gds::write(&library).unwrap(), "x.gds", None).unwrap();
    let cif = from_bytes(cif.as_bytes(), "x.cif", None).unwrap();
    let area = |d: &FlatLayout, layer: &str| {
        let all: Vec<_> = d
            .layers
            .iter()
            .filter(|(n, _)| super::process::canonical(n) == layer)
            .flat_map(|(_, p)| p.clone())
            .collect();
        regions::area(&regions::union(&all)) * d.unit_m * d.unit_m * 1e18
    };
    assert!((area(&gds, "4/0") - area(&cif, "4/0")).abs() < 1e-6);
    // The box of 551 nm against that of 552.
    assert!(
        (area(&gds, "7/0") - area(&cif, "7/0") - 550.0).abs() < 1e-6,
        "{} {}",
        area(&gds, "7/0"),
        area(&cif, "7/0")
    );
}

/// 100 000 polygons in two arrays: all are there, merged to what they make.
#[test]
fn a_hundred_thousand_polygons_read_whole() {
    let mut library = Library { source: "x".into(), unit_m: 1e-9, ..Library::default() };
    let layer = library.layer("45/0");
    let boxed = |w: f64| CellShape { layer, points: vec![[0.0, 0.0], [w, 0.0], [w, 1000.0], [0.0, 1000.0]] };
    library.cells.push(Cell { name: "bar".into(), shapes: vec![boxed(400.0)], ..Cell::default() });
    library.cells.push(Cell { name: "rail".into(), shapes: vec![boxed(1000.0)], ..Cell::default() });
    let call = |cell: &str, y: f64, count: [u32; 2]| CellReference {
        cell: cell.into(),
        place: String::new(),
        transform: Transform::shift([0.0, y]),
        count,
        pitch: [[1000.0, 0.0], [0.0, 2000.0]],
    };
    let calls = vec![call("bar", 0.0, [500, 100]), call("rail", 1000.0, [500, 100])];
    library.cells.push(Cell { name: "top".into(), calls, ..Cell::default() });
    let drawing = from_bytes(&write_gds::write(&library).unwrap(), "x.gds", None).unwrap();
    assert_eq!((drawing.polygons(), drawing.cells.len()), (100_000, 100_000));
    let merged = regions::union(&drawing.layers["45/0"]);
    // Bars stand between rails of 500 um: one piece with 99 rows of windows.
    assert_eq!(merged.len(), 1);
    assert_eq!(regions::twice_area_of(&merged), 2 * (100 * 500 * (400 * 1000) + 100 * 500_000 * 1000));
}
