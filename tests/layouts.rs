//! A netlist drawn as masks gives the same mechanism back, in both formats. A changed drawing gives the changed
//! mechanism, and areas only in the drawing are reported with their size. Sources: the examples of this repository,
//! sizes by hand.

use bimorph::analysis::modes::modes;
use bimorph::compile::{CompileOptions, compile};
use bimorph::input::from_bytes;
use bimorph::layout::drawing::Polygon;
use bimorph::layout::mask::{MaskError, mask};
use bimorph::layout::{self, LayoutFormat, Process, convert};
use bimorph::netlist::{Bundle, Setting, load, read_bundle};
use std::path::Path;

const EXAMPLES: [&str; 10] = [
    "arch/arch",
    "bank/bank",
    "chevron/chevron",
    "column/column",
    "comb_resonator/comb_resonator",
    "pivots/pivots",
    "quarter_stage/quarter_stage",
    "rotary_stage/rotary_stage",
    "single_bimorph/single_bimorph",
    "switch/switch",
];

fn polymumps() -> Process {
    Process::builtin("polymumps").unwrap()
}

/// Six modes of a bundle on a mesh of two segments a beam.
fn frequencies(bundle: &Bundle) -> Vec<f64> {
    let options = CompileOptions { segments: Some(2), ..CompileOptions::default() };
    let compiled = compile(bundle, &options).unwrap_or_else(|e| panic!("{}: {e}", bundle.root));
    let volts: Vec<(String, f64)> = Vec::new();
    modes(&compiled, 6, &volts).unwrap().frequencies_hz
}

#[test]
fn every_planar_example_comes_back_with_its_modes() {
    for name in EXAMPLES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/{name}.net"));
        let drawn = read_bundle(&path, &[]).unwrap();
        let before = frequencies(&drawn);
        let structure = load(&drawn, &[]).unwrap().structure;
        for (format, file) in [(LayoutFormat::Gds, "x.gds"), (LayoutFormat::Cif, "x.cif")] {
            let mask = mask(&structure, &polymumps(), format, file).unwrap();
            let source = from_bytes(&mask.bytes, file, None, None).unwrap();
            let report = source.converted.unwrap().report;
            assert_eq!((report.by.as_str(), report.areas.unrecognised_m2), ("labels", 0.0), "{name}: {report:?}");
            let back = load(&source.bundle, &[]).unwrap_or_else(|e| panic!("{name}: {e}")).structure;
            assert_eq!(back.ports.len(), structure.ports.len(), "{name}");
            let names = |s: &bimorph::structure::Structure| {
                let mut all: Vec<String> = s.nodes.iter().filter(|n| n.mechanical).map(|n| n.name.clone()).collect();
                all.sort();
                all
            };
            assert_eq!(names(&back), names(&structure), "{name}");
            let after = frequencies(&source.bundle);
            for (f, g) in before.iter().zip(&after) {
                assert!((f / g - 1.0).abs() < 1e-9, "{name} {file}: {f} became {g}");
            }
        }
    }
}

const BEAM: &str = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [root] [l=10u w=10u oz=pi]\n\
                    arm beam2d p [root tip] [l=100u w=2u oz=0.3]\n";

fn drawn_beam() -> layout::FlatLayout {
    let structure = load(&Bundle::from_text("beam.net", BEAM), &[]).unwrap().structure;
    let mask = mask(&structure, &polymumps(), LayoutFormat::Gds, "beam.gds").unwrap();
    layout::from_bytes(&mask.bytes, "beam.gds", None).unwrap()
}

#[test]
fn a_beam_that_was_widened_in_the_drawing_is_wider_in_the_netlist() {
    let mut drawing = drawn_beam();
    // The same beam 3 um wide, over the one of 2 um.
    let at = |s: f64, n: f64| {
        let (sin, cos) = 0.3_f64.sin_cos();
        [s * cos - n * sin, s * sin + n * cos].map(|x| (x * 1e-6 / drawing.unit_m).round() as i32)
    };
    let wider = Polygon::from_contour(vec![at(0.0, -1.5), at(100.0, -1.5), at(100.0, 1.5), at(0.0, 1.5)]);
    drawing.layers.get_mut("45/0").unwrap().push(wider);
    let converted = convert::convert(&drawing, None).unwrap();
    assert!(converted.report.notes.iter().any(|n| n.contains("`arm` is drawn 3 µm wide")), "{:?}", converted.report);
    assert_eq!(converted.report.areas.unrecognised_m2, 0.0);
    let beam = load(&Bundle::from_text("x.net", &converted.netlist), &[]).unwrap().structure.beams.remove(0);
    assert!((beam.width / 3e-6 - 1.0).abs() < 2e-6, "{}", beam.width);
    assert_eq!(beam.length, 100e-6);
}

#[test]
fn a_node_that_was_moved_takes_its_beam_along() {
    let mut drawing = drawn_beam();
    let micron = (1e-6 / drawing.unit_m).round() as i32;
    let tip = drawing.labels.iter_mut().find(|l| l.text == "tip").unwrap();
    tip.at[0] += 5 * micron;
    let converted = convert::convert(&drawing, None).unwrap();
    assert!(converted.report.notes.iter().any(|n| n.contains("`arm` is drawn")), "{:?}", converted.report.notes);
    assert!(
        converted.report.notes.iter().any(|n| n.contains("in the mechanism, but not drawn")),
        "{:?}",
        converted.report.notes
    );
}

#[test]
fn what_is_only_in_the_drawing_is_reported_with_its_area_and_place() {
    let mut drawing = drawn_beam();
    let micron = (1e-6 / drawing.unit_m).round() as i32;
    let extra = Polygon::rectangle([200 * micron, 0], [210 * micron, 4 * micron]);
    drawing.layers.get_mut("45/0").unwrap().push(extra.clone());
    drawing.layers.insert("99/0".to_owned(), vec![extra]);
    let report = convert::convert(&drawing, None).unwrap().report;
    let areas: Vec<(String, f64)> = report.unrecognised.iter().map(|u| (u.layer.clone(), u.area_um2())).collect();
    assert_eq!(areas, [("p1".to_owned(), 40.0), ("99/0".to_owned(), 40.0)], "{report:?}");
    assert!((report.unrecognised[0].box_m[0][0] - 200e-6).abs() < 1e-12);
    assert!((report.areas.unrecognised_m2 - 80e-12).abs() < 1e-18);
}

#[test]
fn labels_that_say_too_little_are_one_error_with_its_place() {
    let without = |text: &str| {
        let mut drawing = drawn_beam();
        drawing.labels.retain(|l| !l.text.starts_with(text));
        convert::convert(&drawing, None).unwrap_err().to_string()
    };
    let error = without("tip");
    assert!(error.contains("beam.gds, label at") && error.contains("node `tip`, which has no label"), "{error}");
    let error = without("process");
    assert!(error.contains("`process p1 = [...]`"), "{error}");
    let mut drawing = drawn_beam();
    let line = drawing.labels.iter_mut().find(|l| l.text.contains("beam2d")).unwrap();
    line.text = "2: arm beam2d p1 [root".to_owned();
    let error = convert::convert(&drawing, None).unwrap_err().to_string();
    assert!(error.contains("is no netlist line: expected NAME MODEL PROCESS [nodes]"), "{error}");
    // a word of the language would make another statement of the line, and read a file called `arm`
    for line in ["2: uses arm * [root] []", "2: a.for mass2d * [root] [m=1]", "2: arm beam2d p1 [root if] []"] {
        let mut drawing = drawn_beam();
        drawing.labels.iter_mut().find(|l| l.text.contains("beam2d")).unwrap().text = line.to_owned();
        let error = convert::convert(&drawing, None).unwrap_err().to_string();
        assert!(error.contains("no words of the language"), "{line}: {error}");
    }
}

#[test]
fn a_netlist_without_outlines_is_reported_as_such() {
    let text = "anchor * [f] []\nspring2d * [f m] [kx=1 l=5u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\n";
    let structure = load(&Bundle::from_text("x.net", text), &[]).unwrap().structure;
    // An anchor alone has a pad, and that is all that is drawn.
    let drawn = mask(&structure, &polymumps(), LayoutFormat::Gds, "x.gds").unwrap();
    assert!(drawn.notes.iter().any(|n| n == "1 spring2d has no outline"), "{:?}", drawn.notes);
    let loose = load(&Bundle::from_text("x.net", &text.replace("anchor", "hinge")), &[]).unwrap().structure;
    assert_eq!(mask(&loose, &polymumps(), LayoutFormat::Gds, "x.gds"), Err(MaskError::Empty));
}

/// Outlines alone, without a label, give the bank of the paper back: six anchors, seventeen beams, its frequencies.
#[test]
fn outlines_alone_give_the_bank_back() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bank/bank.net");
    let (drawn, bare) = (read_bundle(&path, &[]).unwrap(), vec![("comb".to_owned(), Setting::Number(0.0))]);
    let structure = load(&drawn, &bare).unwrap().structure;
    let bytes = mask(&structure, &polymumps(), LayoutFormat::Cif, "bank.cif").unwrap().bytes;
    let outlines: Vec<u8> =
        bytes.split_inclusive(|b| *b == b'\n').filter(|line| !line.starts_with(b"94")).flatten().copied().collect();
    let source = from_bytes(&outlines, "bank.cif", None, None).unwrap();
    let report = source.converted.unwrap().report;
    assert_eq!((report.by.as_str(), report.areas.unrecognised_m2), ("geometry", 0.0), "{report:?}");
    let back = load(&source.bundle, &[]).unwrap().structure;
    assert_eq!(back.beams.len(), structure.beams.len());
    let modes_of = |bundle: &Bundle, set: &[(String, Setting)]| {
        let options = CompileOptions { segments: Some(4), set: set.to_vec(), ..CompileOptions::default() };
        modes(&compile(bundle, &options).unwrap(), 3, &[]).unwrap().frequencies_hz
    };
    for (f, g) in modes_of(&drawn, &bare).iter().zip(modes_of(&source.bundle, &[])) {
        assert!((f / g - 1.0).abs() < 1e-3, "{f} became {g}");
    }
}

/// Bars across bars, and a star that crosses itself millions of times, are refused with a place before they are merged (they took
/// gigabytes); twenty across twenty are a mechanism.
#[test]
fn what_cuts_itself_too_often_is_refused() {
    let cif = |shapes: String| format!("DS 1 1 1;\n9 T;\nL POLY1;\n{shapes}L ANCHOR1;\nB 50 50 0 0;\nDF;\nC 1;\nE\n");
    let bars = |n: usize| -> String {
        let (long, middle) = (300 * n, 150 * n);
        (0..n).map(|k| format!("B {long} 100 {middle} {0};\nB 100 {long} {0} {middle};\n", 300 * k)).collect()
    };
    let corners = 6001;
    let star = (0..corners).map(|k| {
        let angle = std::f64::consts::TAU * f64::from(k * (corners / 2) % corners) / f64::from(corners);
        format!(" {:.0} {:.0}", 1e6 * angle.cos(), 1e6 * angle.sin())
    });
    let read = |text: String| from_bytes(text.as_bytes(), "x.cif", Some("polymumps"), None);
    for text in [cif(bars(3000)), cif(format!("P{};\n", star.collect::<String>()))] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains("cut one another") && error.contains("about point"), "{error}");
    }
    assert!(read(cif(bars(20))).is_ok());
}

/// A rigid body of any outline is a lumped mass in a drawing of ours, and keeps mass, inertia and the drag of its gas
/// film. A = 1e-8 m², Ip = 2e-17 m⁴, 2 µm of 2300 kg/m³ over 2 µm of air.
#[test]
fn a_body_keeps_its_mass_and_its_drag() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u viscosity=1.78e-5 fluid=2u]\nanchor p [root] []\n\
                beam2d p [root c] [l=100u w=2u]\nbody2d p [c] [A=1e-8 Ip=2e-17]\n";
    let structure = load(&Bundle::from_text("body.net", text), &[]).unwrap().structure;
    let drawn = mask(&structure, &polymumps(), LayoutFormat::Gds, "body.gds").unwrap();
    assert!(!drawn.notes.iter().any(|note| note.contains("drag")), "{:?}", drawn.notes);
    let source = from_bytes(&drawn.bytes, "body.gds", None, None).unwrap();
    let back = load(&source.bundle, &[]).unwrap().structure.masses.remove(0);
    let want = [2300.0 * 2e-6 * 1e-8, 2300.0 * 2e-6 * 2e-17, 8.9 * 1e-8, 8.9 * 2e-17];
    for (got, want) in [back.mass, back.inertia, back.drag[0], back.drag[1]].iter().zip(want) {
        assert!((got / want - 1.0).abs() < 1e-12, "{got} instead of {want}");
    }
}

/// The netlist drawn as masks in GDSII, and read again by its labels.
fn there_and_back(text: &str) -> (bimorph::structure::Structure, String) {
    let structure = load(&Bundle::from_text("t.net", text), &[]).unwrap_or_else(|e| panic!("{e}")).structure;
    let mask = mask(&structure, &polymumps(), LayoutFormat::Gds, "t.gds").unwrap();
    assert!(mask.notes.iter().all(|note| !note.contains("mirrored")), "{:?}", mask.notes);
    let again = from_bytes(&mask.bytes, "t.gds", None, None).unwrap_or_else(|e| panic!("{e}"));
    let text = again.converted.unwrap().netlist;
    (load(&again.bundle, &[]).unwrap_or_else(|e| panic!("{e}")).structure, text)
}

/// A wire may lead to nodes that are in the circuit alone, and have no place.
#[test]
fn wires_to_the_circuit_come_back() {
    let (back, text) = there_and_back(&format!(
        "{BEAM}anchor p [e] [l=10u w=10u]\npos * [tip e] [x=2u]\nplategap2d * [tip e] [A=1e-9 gap=2u]\neground * [e] []\n\
         wire * [tip x y] []\nR * [x s] [R=1k]\nbias Vsrc * [s e] [V=1]\n"
    ));
    assert!(back.wires.len() == 1 && back.wires[0].nodes.len() == 3, "{text}");
}

/// Gaps of mirrored instances come back with their lower beams on the other side: the same modes under voltage.
#[test]
fn mirrored_gaps_come_back() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\n\
        subnet half [a] [] [\nanchor p [a] [l=10u w=10u oz=pi]\nbeam2d p [a b] [l=60u w=2u]\n\
        gap2dforce p [b c d e] [l=60u w1=2u w2=6u gap=2u]\nbeam2d p [b c] [l=60u w=2u]\n\
        anchor p [d] [l=5u w=5u]\nanchor p [e] [l=5u w=5u]\neground * [d] []\neground * [e] []\nwire * [b c] []\ndrive port * [b] []\n]\n\
        subnet fixed [a] [] [\nanchor p [a] [l=10u w=10u oz=pi]\nbeam2d p [a b] [l=60u w=2u]\n\
        gap2d p [b c d e] [l=60u w1=2u w2=6u gap=2u V=8]\nanchor p [d] [l=5u w=5u]\nanchor p [e] [l=5u w=5u]\n]\n\
        top half * [a] []\nlow half * [f] [ox=pi]\nlast fixed * [g] [ox=pi]\n\
        pos * [a f] [y=-90u]\npos * [a g] [y=-180u]\n";
    let (back, again) = there_and_back(text);
    assert_eq!(back.beam_gaps.len(), 3, "{again}");
    let volts = [("top.drive".to_owned(), 12.0), ("low.drive".to_owned(), 8.0)];
    let modes = |text: &str| {
        let options = CompileOptions { segments: Some(2), ..CompileOptions::default() };
        let compiled = compile(&Bundle::from_text("t.net", text), &options).unwrap_or_else(|e| panic!("{e}\n{text}"));
        modes(&compiled, 6, &volts).unwrap().frequencies_hz
    };
    let (before, after) = (modes(text), modes(&again));
    // those of the two that differ only by their voltage differ by more than the tolerance
    assert!(before[1] / before[0] > 1.001, "{before:?}");
    for (f, g) in before.iter().zip(&after) {
        assert!((f / g - 1.0).abs() < 1e-9, "{before:?} became {after:?}\n{again}");
    }
}

/// Arcs and tapers, with a name and without, come back as their pieces: the same modes.
#[test]
fn arcs_and_tapers_come_back() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] [l=10u w=10u oz=pi]\n\
        bow arc2d p [a b] [radius=40u alpha=pi/2 w=2u]\narc2d p [b c] [radius=30u alpha=-pi/3 w=2u oz=pi/2]\n\
        taper2d p [c d] [l=50u w1=2u w2=5u oz=0.2]\n";
    let (back, again) = there_and_back(text);
    assert!(back.beams.len() > 20, "{again}");
    for (f, g) in
        frequencies(&Bundle::from_text("t.net", text)).iter().zip(frequencies(&Bundle::from_text("t.net", &again)))
    {
        assert!((f / g - 1.0).abs() < 1e-9, "{f} became {g}\n{again}");
    }
}

/// A body whose outline is drawn keeps the moment of inertia that it was given: a disc of 100 µm radius drawn as a square, on three spokes (as
/// the square's plate its mode was 13 % off). A heated pair of beams keeps its specific heat, which delays both as one.
#[test]
fn outlines_and_specific_heats_come_back() {
    let hub = "process s = [Youngsmodulus=160e9 density=2330 h=2u viscosity=1.8e-5 fluid=2u]\n\
        hub body2d s [c] [A=pi*100u^2 Ip=pi*100u^4/2 l=200u w=200u]\n\
        for i=1:3 [\nlink2d * [c r(i)] [l=100u oz=2*pi*i/3]\nsp(i) beam2d s [r(i) a(i)] [l=200u w=3u oz=2*pi*i/3]\n\
        anchor s [a(i)] [l=20u w=20u oz=2*pi*i/3]\n]\n";
    let (before, text) = (load(&Bundle::from_text("hub.net", hub), &[]).unwrap().structure, there_and_back(hub));
    let (one, other) = (&before.masses[0], &text.0.masses[0]);
    for (a, b) in [
        (one.mass, other.mass),
        (one.inertia, other.inertia),
        (one.drag[0], other.drag[0]),
        (one.drag[1], other.drag[1]),
    ] {
        assert!((a / b - 1.0).abs() < 1e-9, "{a:e} became {b:e}: {}", text.1);
    }
    let hot = "process p = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.33e-6 sheetresistance=20 thermcond=41 specificheat=712]\n\
        anchor p [a] [l=10u w=10u]\none beam2det p [a m] [l=100u w=4u]\ntwo beam2det p [m b] [l=100u w=4u]\n\
        anchor p [b] [l=10u w=10u]\neground * [b] []\nheat port * [a b] []\n";
    let (back, text) = there_and_back(hot);
    let capacity = 2300.0 * 712.0 * 100e-6 * 4e-6 * 2e-6;
    for beam in &back.beams {
        let heater = beam.heater.as_ref().expect("a heater");
        assert!(
            (heater.capacity / capacity - 1.0).abs() < 1e-9 && heater.time_constant.is_none(),
            "{heater:?}: {text}"
        );
    }
}

/// Elements with an index that are two beams each come back with names that are names: the index stands last.
#[test]
fn inner_names_behind_an_index_come_back() {
    let text = "process p1 = [Youngsmodulus=165e9 density=2300 h=2u sheetresistance=10]\nanchor p1 [n(0)] [l=10u w=10u]\n\
        for k=1:2 [\nz(k) gap2de p1 [n(k-1) n(k) e(2*k) e(2*k+1)] [l=100u w1=2u w2=2u gap=2u]\n\
        anchor p1 [e(2*k)] [l=10u w=10u]\nanchor p1 [e(2*k+1)] [l=10u w=10u]\neground * [e(2*k)] []\n]\nv port * [n(0)] []\n";
    let (back, text) = there_and_back(text);
    assert_eq!((back.beams.len(), back.beam_gaps.len()), (4, 2), "{text}");
}
