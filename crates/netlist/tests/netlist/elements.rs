//! Additions of each element to the structure, with numbers worked out by hand from its equations in docs/reference/elements.md.

use bimorph_base::Bundle;
use bimorph_netlist::load;
use bimorph_structure::{ElectrodeShape, Fringe, GapVoltage, NodeId, Structure};

/// A layer with round numbers.
const P1: &str = "process p1 = [Youngsmodulus=160e9 Poisson=0.25 density=2000 h=2u viscosity=2e-5 fluid=1u permittivity=9e-12\n\
                  sheetresistance=20 thermcond=30 thermalexpansion=3e-6 ambienttemperature=300 stress=1M]\n";

fn drawn(text: &str) -> Structure {
    let loaded = load(&Bundle::from_text("t.net", &format!("{P1}{text}")), &[]).unwrap_or_else(|d| panic!("{d}"));
    loaded.structure
}

fn codes(text: &str) -> Vec<String> {
    let loaded = load(&Bundle::from_text("t.net", &format!("{P1}{text}")), &[]).unwrap_or_else(|d| panic!("{d}"));
    loaded.warnings.items.into_iter().map(|d| d.code).collect()
}

fn at(structure: &Structure, name: &str) -> [f64; 2] {
    structure.nodes[structure.node(name).expect(name).0].position
}

/// Two numbers that agree to rounding of a few sums and products.
#[track_caller]
fn same(got: f64, want: f64) {
    assert!((got - want).abs() <= 1e-12 * want.abs().max(1e-12), "{got:e} is not {want:e}");
}

#[track_caller]
fn same2(got: [f64; 2], want: [f64; 2]) {
    let size = want[0].abs().max(want[1].abs()).max(1e-6);
    assert!((got[0] - want[0]).abs() + (got[1] - want[1]).abs() <= 1e-12 * size, "{got:?} is not {want:?}");
}

/// A beam takes its section from itself and its material from the layer.
#[test]
fn beam2d() {
    let s = drawn("anchor p1 [a] []\nx beam2d p1 [a b] [l=100u w=3u oz=pi/2 T=350]");
    let beam = &s.beams[0];
    assert_eq!((beam.name.as_str(), beam.a, beam.b), ("x", NodeId(0), NodeId(1)));
    assert_eq!((beam.length, beam.width, beam.thickness), (100e-6, 3e-6, 2e-6));
    assert_eq!(beam.temperature, Some(350.0));
    same(beam.angle, std::f64::consts::FRAC_PI_2);
    let m = &beam.material;
    assert_eq!((m.youngs_modulus, m.poisson, m.density, m.stress), (160e9, 0.25, 2000.0, 1e6));
    assert_eq!((m.viscosity, m.fluid, m.thermal_expansion, m.ambient_temperature), (2e-5, 1e-6, 3e-6, 300.0));
    same2(at(&s, "b"), [0.0, 100e-6]);
}

/// Elastic constants of a crystal as numbers, and as curves at the ambient temperature: E is (C11 − C12)·(C11 + 2·C12)/(C11 + C12) along ⟨100⟩ and
/// 4/(2/(C11 + C12 − 2·C12²/C11) + 1/C44) along ⟨110⟩, by hand. Constants of no crystal, and constants without a crystal, are refused.
#[test]
fn crystals_have_constants_over_temperature() {
    let text = |layer: &str, oz: f64| {
        let layer = format!("process s = [{layer} density=2330 h=20u]");
        format!("{layer}\nanchor s [a] []\nbeam2d s [a b] [l=100u w=3u oz={oz}]")
    };
    let modulus =
        |layer: &str, degrees: f64| drawn(&text(layer, degrees.to_radians())).beams[0].material.youngs_modulus;
    let close = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-9, "{found:e} {wanted:e}");
    let both = |layer: &str, [c11, c12, c44]: [f64; 3]| {
        close(modulus(layer, 45.0), (c11 - c12) * (c11 + 2.0 * c12) / (c11 + c12));
        close(modulus(layer, 0.0), 4.0 / (2.0 / (c11 + c12 - 2.0 * c12 * c12 / c11) + 1.0 / c44));
    };
    both("crystal=100 C11=128.5e9 C12=48.3e9 C44=66.8e9", [128.5e9, 48.3e9, 66.8e9]);
    both("crystal=100 C12=64.5e9", [165.7e9, 64.5e9, 79.6e9]);
    let curves = "C11=polynomial(170e9, -12e6, -8e3) C12=polynomial(66e9, -6e6) C44=table(250, 80e9, 350, 79e9)";
    for (t, c44) in [(260.0, 79.9e9), (330.0, 79.2e9)] {
        let layer = format!("crystal=100 ambienttemperature={t} {curves}");
        both(&layer, [170e9 - 12e6 * t - 8e3 * t * t, 66e9 - 6e6 * t, c44]);
    }
    for (layer, code) in [
        ("crystal=100 C11=60e9", "below `C11`"),
        ("crystal=100 C44=-1e9", "`C44` (elastic constant of the crystal [Pa])"),
        ("crystal=100 ambienttemperature=500 C44=table(250, 80e9, 350, 79e9)", "does not cover"),
        ("Youngsmodulus=160e9 C44=79e9", "`crystal`"),
    ] {
        let refused = load(&Bundle::from_text("t.net", &text(layer, 0.0)), &[]).unwrap_err().to_string();
        assert!(refused.contains("E0") && refused.contains(code), "{layer}: {refused}");
    }
}

/// Fillets are radii of at least a twentieth of the width, and belong to the layer.
#[test]
fn fillets() {
    let with = |fillet: &str| {
        let text = format!(
            "process q = [Youngsmodulus=1e9 density=1 h=1u fillet={fillet}]\nanchor q [a] []\nbeam2d q [a b] [l=10u w=2u]"
        );
        load(&Bundle::from_text("t.net", &text), &[])
    };
    assert_eq!(with("0.1u").expect("a model").structure.beams[0].material.fillet, Some(0.1e-6));
    let refused = with("0.09u").unwrap_err().to_string();
    assert!(refused.contains("`fillet`") && refused.contains("a twentieth of the width"), "{refused}");
}

/// Without viscosity or film there is no damping.
#[test]
fn damping_needs_viscosity_and_film() {
    let s = drawn(
        "process q = [Youngsmodulus=1e9 density=1 h=1u viscosity=1e-5]\nanchor q [a] []\nbeam2d q [a b] [l=10u w=1u]",
    );
    assert_eq!(s.beams[0].material.viscosity, 0.0);
}

/// A beam without `l` is measured from positions that others give.
#[test]
fn beam_without_length() {
    let s = drawn("anchor p1 [a] []\npos * [a b] [x=30u y=40u]\nbeam2d p1 [a b] [w=2u]");
    same(s.beams[0].length, 50e-6);
    same(s.beams[0].angle, (4.0f64 / 3.0).atan());
}

/// `pos` alone makes no mechanical node.
#[test]
fn pos_only_places() {
    let s = drawn("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]\npos * [a mark] [x=1u y=2u]");
    let mark = s.node("mark").expect("mark");
    assert!(!s.nodes[mark.0].mechanical);
    same2(at(&s, "mark"), [1e-6, 2e-6]);
}

/// A quarter turn about its axis swaps a beam's width and thickness; a mirrored beam stays a beam.
#[test]
fn beam_turned_about_itself() {
    let s = drawn("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=5u ox=pi/2]\nbeam2d p1 [b c] [l=10u w=5u oy=pi]");
    assert_eq!((s.beams[0].width, s.beams[0].thickness), (2e-6, 5e-6));
    assert_eq!((s.beams[1].width, s.beams[1].thickness), (5e-6, 2e-6));
    same2(at(&s, "c"), [0.0, 0.0]);
}

/// Orientation composes as R = R_parent·Ry(oy)·Rz(oz)·Rx(ox): SUGAR 2 places l = 10 µm with oy = 0.4, oz = 0.5 at
/// (8.083, 4.794, −3.417) µm; here its shadow on the plane is seen through `pos`.
#[test]
fn rotation_order() {
    let s = drawn("anchor p1 [a] []\npos * [a b] [x=10u ox=0.3 oy=0.4 oz=0.5]");
    let [x, y] = at(&s, "b");
    assert!((x - 8.083e-6).abs() < 5e-10 && (y - 4.794e-6).abs() < 5e-10, "{x:e} {y:e}");
}

/// Arms of a beam3dlink are rigid links, turned from the beam's own direction.
#[test]
fn beam_with_rigid_arms() {
    let s = drawn("anchor p1 [a] []\nk beam3dlink p1 [a b] [l=20u w=2u L1=5u L2=7u oz2=pi/2]");
    assert_eq!(s.links.len(), 2);
    same2(at(&s, "k.start"), [5e-6, 0.0]);
    same2(at(&s, "k.end"), [25e-6, 0.0]);
    same2(at(&s, "b"), [25e-6, 7e-6]);
    assert_eq!((s.beams[0].name.as_str(), s.beams[0].length), ("k", 20e-6));
    assert_eq!((s.beams[0].a, s.beams[0].b), (s.node("k.start").expect("start"), s.node("k.end").expect("end")));
}

/// anchor, hinge, slider and guide hold their directions; pinjoint holds none in the plane.
#[test]
fn supports() {
    let s = drawn(
        "anchor p1 [a] []\nhinge * [b] []\nslider * [c] []\nguide2d * [d] [oz=pi/2]\npinjoint * [d] []\n\
         beam2d p1 [a b] [l=1u w=1u]\nbeam2d p1 [b c] [l=1u w=1u]\nbeam2d p1 [c d] [l=1u w=1u]",
    );
    let held: Vec<[bool; 3]> = s.supports.iter().map(|s| s.held).collect();
    assert_eq!(held, [[true, true, true], [true, true, false], [false, false, true], [false, true, true]]);
    same(s.supports[3].angle, std::f64::consts::FRAC_PI_2);
}

/// f2d and f3d push along the local x axis; f2d turns about z, f3d about its own x axis.
#[test]
fn loads() {
    let s = drawn(
        "anchor p1 [a] []\nbeam2d p1 [a b] [l=1u w=1u]\nf2d * [b] [F=2u M=3n oz=pi/2]\nf3d * [b] [F=2u oz=pi]\nf3d * [b] [M=5n oy=-pi/2]",
    );
    same2(s.loads[0].force, [2e-6 * std::f64::consts::FRAC_PI_2.cos(), 2e-6]);
    assert_eq!(s.loads[0].moment, 3e-9);
    same2(s.loads[1].force, [-2e-6, 0.0]);
    assert_eq!(s.loads[2].force, [0.0, 0.0]);
    same(s.loads[2].moment, 5e-9);
}

/// A force or moment out of the plane is reported.
#[test]
fn loads_out_of_plane() {
    let base = "anchor p1 [a] []\nbeam2d p1 [a b] [l=1u w=1u]\n";
    assert_eq!(codes(&format!("{base}f3d * [b] [F=1u oy=-pi/2]")), ["W020"]);
    assert_eq!(codes(&format!("{base}f3d * [b] [M=1n]")), ["W020"]);
    assert!(codes(&format!("{base}f3d * [b] [F=1u oz=1]")).is_empty());
}

/// A plate's mass and inertia come from its size and density, its drag from the film under it.
#[test]
fn plate2d() {
    let s = drawn("anchor p1 [a] []\nlink2d * [a c] [l=5u]\nplate2d p1 [c] [l=60u w=40u oz=1]");
    let plate = &s.masses[0];
    same(plate.mass, 2000.0 * 60e-6 * 40e-6 * 2e-6);
    let radius2 = (60e-6f64.powi(2) + 40e-6f64.powi(2)) / 12.0;
    same(plate.inertia, plate.mass * radius2);
    same(plate.drag[0], 2e-5 / 1e-6 * 60e-6 * 40e-6);
    same(plate.drag[1], plate.drag[0] * radius2);
    assert_eq!(plate.outline, [60e-6, 40e-6, 1.0]);
}

/// A body of any outline is its area and second moment: those of a rectangle make the plate of that size. Less than a disk has is
/// refused.
#[test]
fn body2d() {
    let at = "anchor p1 [a] []\nlink2d * [a c] [l=5u]\n";
    let body = &drawn(&format!("{at}body2d p1 [c] [A=2400p Ip=2400p*(3600p+1600p)/12]")).masses[0];
    let plate = &drawn(&format!("{at}plate2d p1 [c] [l=60u w=40u]")).masses[0];
    same(body.mass, plate.mass);
    same(body.inertia, plate.inertia);
    same(body.drag[0], plate.drag[0]);
    same(body.drag[1], plate.drag[1]);
    let flat = format!("{P1}{at}body2d p1 [c] [A=2400p Ip=1e-20]");
    let refused = load(&Bundle::from_text("t.net", &flat), &[]).expect_err("no body turns so easily");
    assert_eq!(refused.items.iter().map(|d| d.code.as_str()).collect::<Vec<_>>(), ["E060"]);
}

/// The lumped plate over its electrode: positions, axis, and the electrical side.
#[test]
fn lumped_plate() {
    let s = drawn(
        "anchor * [f] []\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1 l=4u]\nanchor * [e] []\n\
         plategap2d * [m e] [A=1e-8 gap=2u]\neground * [e] []\ndrive port * [m e] []",
    );
    let gap = &s.plate_gaps[0];
    assert_eq!((gap.area, gap.gap, gap.permittivity, gap.touch), (1e-8, 2e-6, 8.854e-12, None));
    assert_eq!(gap.axis, [1.0, 0.0]);
    let (m, e) = (s.node("m").expect("m"), s.node("e").expect("e"));
    assert_eq!(gap.voltage, GapVoltage::Nodes(m, e));
    same2(at(&s, "e"), [6e-6, 0.0]);
    assert_eq!(s.springs[0].stiffness, [1.0, 0.0, 0.0]);
    assert_eq!((s.ports[0].name.as_str(), s.ports[0].plus, s.ports[0].minus), ("drive", m, Some(e)));
    assert_eq!(s.electrical_grounds, [e]);
    assert!(s.nodes[m.0].mechanical && s.nodes[m.0].electrical);
}

/// `touch` says where the parts of a gap meet; not beyond where they are drawn.
#[test]
fn touching_distance() {
    let text =
        "anchor * [e] []\nmass2d * [m] [m=1e-10]\nspring2d * [e m] [kx=1]\nplategap2d * [m e] [A=1e-8 gap=2u touch=T]";
    assert_eq!(drawn(&text.replace("=T", "=0.3u")).plate_gaps[0].touch, Some(0.3e-6));
    let wrong = load(&Bundle::from_text("t.net", &text.replace("=T", "=3u")), &[]);
    let errors = wrong.err().map(|d| d.to_string()).unwrap_or_default();
    assert!(errors.contains("`touch`") && errors.contains("below `gap`"), "{errors}");
}

/// stop2d: along its axis on one side or both, against another node or the ground; rigid unless `k` says otherwise.
#[test]
fn stops() {
    let s = drawn(
        "anchor * [e] []\nmass2d * [m] [m=1e-10]\nspring2d * [e m] [kx=1]\nstop2d * [m e] [gap=1u oz=pi/2]\n\
         s stop2d * [m] [gap=2u back=3u k=5e3]\nstop2d * [m e] [back=1u A=4e-10]",
    );
    let (m, e) = (s.node("m").expect("m"), s.node("e").expect("e"));
    assert_eq!(
        (s.stops[0].a, s.stops[0].b, s.stops[0].ways, s.stops[0].stiffness),
        (m, Some(e), [Some(1e-6), None], None)
    );
    same2(s.stops[0].axis, [0.0, 1.0]);
    assert_eq!((s.stops[1].b, s.stops[1].ways, s.stops[1].stiffness), (None, [Some(2e-6), Some(3e-6)], Some(5e3)));
    assert_eq!((s.stops[2].ways, s.stops[2].area), ([None, Some(1e-6)], 4e-10));
    let none = load(&Bundle::from_text("t.net", "mass2d * [m] [m=1e-10]\nstop2d * [m] []"), &[]);
    assert!(none.err().is_some_and(|d| d.to_string().contains("`gap` or `back`")));
}

/// A stop whose adhesion, friction and stick stiffness are zero has none of them; negative ones are refused.
#[test]
fn zeros_of_stops_are_none() {
    let text = |values: &str| {
        format!("anchor * [e] []\nmass2d * [m] [m=1e-10]\nspring2d * [e m] [kx=1]\nstop2d * [m e] [gap=1u {values}]")
    };
    let s = drawn(&text("adhesion=0 friction=0 stickstiffness=0"));
    assert!(s.stops[0].adhesion.is_none() && s.stops[0].friction.is_none());
    let stuck = drawn(&text("friction=0.3 stickstiffness=0")).stops[0].friction.expect("friction");
    assert_eq!((stuck.coefficient, stuck.stick_stiffness), (0.3, None));
    assert!(drawn(&text("friction=0 stickstiffness=1e3")).stops[0].friction.is_none());
    for name in ["adhesion", "friction", "stickstiffness"] {
        let none = load(&Bundle::from_text("t.net", &text(&format!("{name}=-1"))), &[]);
        assert!(none.err().is_some_and(|d| d.to_string().contains("zero or positive")), "{name}");
    }
}

/// damper2d, and a spring turned by oz.
#[test]
fn springs_and_dampers() {
    let s = drawn(
        "anchor * [a] []\nspring2d * [a b] [kx=1 ky=2 krz=3 l=10u oz=pi/2]\ndamper2d * [a b] [bx=4 by=5 brz=6 l=10u oz=pi/2]\nmass2d * [b] [m=1p J=2]",
    );
    same2(at(&s, "b"), [0.0, 10e-6]);
    assert_eq!((s.springs[0].stiffness, s.springs[0].damping), ([1.0, 2.0, 3.0], [0.0; 3]));
    assert_eq!((s.springs[1].stiffness, s.springs[1].damping), ([0.0; 3], [4.0, 5.0, 6.0]));
    assert_eq!((s.masses[0].mass, s.masses[0].inertia), (1e-12, 2.0));
}

/// gap2d brings its two beams; c and d lie below a and b by gap + (w1 + w2)/2.
#[test]
fn gap2d() {
    let s = drawn(
        "anchor p1 [a] []\ng gap2d p1 [a b c d] [l=100u w1=10u w2=5u gap=2u V=8]\nanchor p1 [c] []\nanchor p1 [d] []",
    );
    assert_eq!((s.beams[0].name.as_str(), s.beams[0].width), ("g.upper", 10e-6));
    assert_eq!((s.beams[1].name.as_str(), s.beams[1].width), ("g.lower", 5e-6));
    same2(at(&s, "c"), [0.0, -9.5e-6]);
    same2(at(&s, "d"), [100e-6, -9.5e-6]);
    let gap = &s.beam_gaps[0];
    assert_eq!((gap.length, gap.gap, gap.height, gap.permittivity), (100e-6, 2e-6, 2e-6, 9e-12));
    assert_eq!((gap.widths, gap.law, gap.electrode), ([10e-6, 5e-6], None, None));
    same(gap.sugar_factor(), 1.0 + 1.12);
    assert_eq!((gap.side, gap.voltage.clone()), (1.0, GapVoltage::Fixed(8.0)));
}

/// `fringe` and `electrode` are words, from the element or its layer, with quotes or without; a variable of the word's name comes first. A permittivity below that
/// of vacuum keeps SUGAR's factor, with warning W025, unless a law is named.
#[test]
fn laws_of_gaps() {
    let gap = |layer: &str, more: &str| {
        let text = format!(
            "process p = [Youngsmodulus=165e9 density=2300 h=2u {layer}]\nparallel = 'none'\nanchor p [a] []\n\
             gap2d p [a b c d] [l=100u w=2u gap=2u V=1 {more}]\nanchor p [c] []\nanchor p [d] []"
        );
        let mut loaded = load(&Bundle::from_text("t.net", &text), &[]).unwrap_or_else(|d| panic!("{d}"));
        let codes: Vec<String> = loaded.warnings.items.iter().map(|item| item.code.clone()).collect();
        (loaded.structure.beam_gaps.remove(0), codes.join(" "))
    };
    for (layer, more, law, electrode, codes) in [
        ("", "", None, None, ""),
        ("", "fringe=exact electrode=plane", Some(Fringe::Exact), Some(ElectrodeShape::Plane), ""),
        ("fringe=sugar", "electrode='bar'", Some(Fringe::Sugar), Some(ElectrodeShape::Bar), ""),
        ("fringe=sugar", "fringe=\"parallel\"", Some(Fringe::Parallel), None, ""),
        ("", "fringe=parallel", Some(Fringe::None), None, ""),
        ("permittivity=8.8e-12", "", Some(Fringe::Sugar), None, "W025"),
        ("permittivity=8.8e-12", "fringe=none", Some(Fringe::None), None, ""),
        ("permittivity=8.8541878e-12", "", None, None, ""),
    ] {
        let (found, warned) = gap(layer, more);
        assert_eq!((found.law, found.electrode, warned.as_str()), (law, electrode, codes), "{layer} {more}");
    }
    let wrong = "gap2d p1 [a b c d] [l=9u w=2u gap=2u V=1 fringe=palmer]";
    let wrong =
        load(&Bundle::from_text("t.net", &format!("process p1=[Youngsmodulus=165e9 density=2300 h=2u]\n{wrong}")), &[]);
    let message = wrong.err().map(|d| d.items[0].clone()).expect("an error");
    assert_eq!((message.code.as_str(), message.line), ("E050", 2));
    assert_eq!(message.message, "`fringe` (law of the fringe field) is `palmer`");
    assert_eq!(message.help, "give one of none, parallel, exact, sugar");
}

/// An insulation has the thickness `td`, or `touch`, and parts touch at its surface or above it. Impossible ones are refused.
#[test]
fn insulation_of_gaps() {
    let gap = |more: &str| {
        let text = format!(
            "anchor * [b] []\nspring2d * [b a] [kx=1]\nmass2d * [a] [m=1p]\nplategap2d * [a b] [A=1e-9 gap=1u {more}]"
        );
        load(&Bundle::from_text("t.net", &text), &[]).map(|mut loaded| loaded.structure.plate_gaps.remove(0))
    };
    for (more, layer, touch) in [
        ("", None, None),
        ("td=0.2u er=4", Some((0.2e-6, 4.0)), Some(0.2e-6)),
        ("touch=0.2u er=4", Some((0.2e-6, 4.0)), Some(0.2e-6)),
        ("touch=0.3u td=0.2u er=4", Some((0.2e-6, 4.0)), Some(0.3e-6)),
    ] {
        let found = gap(more).unwrap_or_else(|d| panic!("{d}"));
        assert_eq!((found.insulation.map(|l| (l.thickness, l.permittivity)), found.touch), (layer, touch), "{more}");
    }
    for (more, code) in [
        ("td=0.2u", "E053"),
        ("er=4", "E053"),
        ("td=0.2u er=0.5", "E060"),
        ("td=1.2u er=4", "E060"),
        ("td=0.2u touch=0.1u er=4", "E060"),
    ] {
        assert_eq!(gap(more).expect_err(more).items[0].code, code, "{more}");
    }
}

/// Fringe fields beyond the range of their law give W026: bars at a gap of 11 heights, a plate at six widths, fingers that are six gaps wide. A named law without
/// that range gives none.
#[test]
fn ranges_of_fringe_fields() {
    let head = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nanchor p [c] []\nanchor p [d] []\neground * [a] []\n\
                beam2d p [a b] [l=100u w=2u]\n";
    let warned = |element: &str| {
        let text = format!("{head}{element}\nport p [c a] []");
        let loaded = load(&Bundle::from_text("t.net", &text), &[]).unwrap_or_else(|d| panic!("{d}"));
        loaded.warnings.items.iter().any(|item| item.code == "W026")
    };
    for (element, beyond) in [
        ("gap2dforce p [a b c d] [l=100u w=2u gap=19u]", false),
        ("gap2dforce p [a b c d] [l=100u w=2u gap=22u]", true),
        ("gap2dforce p [a b c d] [l=100u w=2u gap=22u fringe=parallel]", false),
        ("gap2dforce p [a b c d] [l=100u w=30u gap=2u]", true),
    ] {
        assert_eq!(warned(element), beyond, "{element}");
    }
    for (element, beyond) in [
        ("plategap2d p [b e] [l=10u w=4u gap=19u]", false),
        ("plategap2d p [b e] [l=10u w=4u gap=24u]", true),
        ("comb2de p [b e] [N=8 gap=2u w=8u l=8u L=16u]", false),
        ("comb2de p [b e] [N=8 gap=2u w=12u l=8u L=16u]", true),
        ("comb2de p [b e] [N=8 gap=2u w=12u l=8u L=16u fringe=none]", false),
    ] {
        assert_eq!(warned(&format!("{element}\nanchor p [e] []")), beyond, "{element}");
    }
}

/// oy = pi mirrors a gap: the lower beam then lies above when seen along a–b.
#[test]
fn gap_mirrored() {
    let s = drawn(
        "anchor p1 [a] []\ngap2d p1 [a b c d] [l=100u w=4u gap=2u V=1 oy=pi]\nanchor p1 [c] []\nanchor p1 [d] []",
    );
    assert_eq!(s.beam_gaps[0].side, -1.0);
    same2(at(&s, "b"), [-100e-6, 0.0]);
    same2(at(&s, "d"), [-100e-6, -6e-6]);
}

/// gap2de is two resistors, two beams and a field at the voltage of a over c; each plate has its own resistance.
#[test]
fn gap2de() {
    let s = drawn(
        "anchor p1 [a] []\ngap2de p1 [a b c d] [l=100u w1=10u w2=5u gap=2u R1=100 R2=300 h=4u]\nanchor p1 [c] []\nanchor p1 [d] []\n\
         eground * [c] []\nVsrc * [a c] [V=3]",
    );
    let resistances: Vec<f64> = s.resistors.iter().map(|r| r.resistance).collect();
    assert_eq!(resistances, [100.0, 300.0]);
    assert_eq!(s.beam_gaps[0].voltage, GapVoltage::Nodes(NodeId(0), NodeId(2)));
    assert_eq!((s.beam_gaps[0].height, s.beams[1].thickness), (4e-6, 4e-6));
    assert_eq!(s.voltage_sources[0].voltage, 3.0);
}

/// beam2de takes R, else G, else resistivity·l/(w·h), else the layer's sheet resistance.
#[test]
fn beam2de() {
    let one = |extra: &str| {
        drawn(&format!("anchor p1 [a] []\neground * [a] []\nbeam2de p1 [a b] [l=100u w=4u {extra}]")).resistors[0]
            .resistance
    };
    same(one("R=7"), 7.0);
    same(one("G=4"), 0.25);
    same(one("resistivity=2e-5"), 2e-5 * 100e-6 / (4e-6 * 2e-6));
    same(one(""), 20.0 * 100.0 / 4.0);
}

/// An electro-thermal beam: resistance, end-to-end conductance, and the heat capacity that delays it, unless `tau` is given.
#[test]
fn beam2det() {
    let one = |extra: &str| {
        drawn(&format!("anchor p1 [a] []\neground * [a] []\nhot beam2det p1 [a b] [l=100u w=4u {extra}]\nanchor p1 [b] []\nheat port * [b a] []"))
            .beams[0]
            .heater
            .clone()
            .expect("heater")
    };
    let plain = one("");
    same(plain.resistance, 500.0);
    same(plain.conductance, 30.0 * 4e-6 * 2e-6 / 100e-6);
    assert_eq!((plain.time_constant, plain.capacity), (Some(0.0), 0.0));
    let slow = one("specificheat=700 R=50");
    same(slow.resistance, 50.0);
    same(slow.capacity, 2000.0 * 700.0 * 100e-6 * 4e-6 * 2e-6);
    let given = one("tau=1m specificheat=700");
    assert_eq!((slow.time_constant, given.time_constant), (None, Some(1e-3)));
    same(given.capacity, slow.capacity);
}

/// A loss through gas: the conductance S·k·w/z·l with S = (h/w)·(2z/h + 1) + 1 by default (by hand: 2.5 at w = 4 µm, h = z = 2 µm), a
/// given shape factor in its place, and none without a conductivity.
#[test]
fn gas_around_a_heated_beam() {
    let one = |extra: &str| {
        let text = format!(
            "anchor p1 [a] []\neground * [a] []\nhot beam2det p1 [a b] [l=100u w=4u {extra}]\nanchor p1 [b] []\nheat port * [b a] []"
        );
        drawn(&text).beams[0].heater.clone().expect("heater").gas
    };
    assert_eq!((one("shapefactor=3"), one("gasconductivity=0 fluid=2u")), (None, None));
    let usual = one("gasconductivity=0.026 fluid=2u").expect("gas");
    same(usual.shape, 2.5);
    same(usual.conductance(4e-6, 100e-6), 2.5 * 0.026 * 4e-6 / 2e-6 * 100e-6);
    same(one("gasconductivity=0.026 fluid=2u shapefactor=4").expect("gas").shape, 4.0);
}

/// The conductivity of the gas as a curve over temperature: its value at ambient temperature counts, and the curve stays. A table that does not cover the substrate is refused.
#[test]
fn gas_conducts_by_a_curve() {
    let one = |extra: &str| {
        let text = format!(
            "anchor p1 [a] []\neground * [a] []\nhot beam2det p1 [a b] [l=100u w=4u fluid=2u {extra}]\nanchor p1 [b] []\nheat port * [b a] []"
        );
        load(&Bundle::from_text("t.net", &format!("{P1}{text}")), &[])
    };
    let air = "gasconductivity=table(300, 0.0263, 400, 0.0338, 600, 0.0469)";
    let heater = one(air).expect("a model").structure.beams[0].heater.clone().expect("heater");
    same(heater.gas.expect("gas").conductivity, 0.0263);
    same(heater.gas_curve.expect("a curve").at(600.0)[0], 0.0469);
    assert_eq!(
        one("gasconductivity=0.026").expect("a model").structure.beams[0].heater.as_ref().unwrap().gas_curve,
        None
    );
    let refused = one(&format!("{air} substratetemperature=280")).unwrap_err().to_string();
    assert!(refused.contains("does not cover the temperature of the substrate"), "{refused}");
    let refused = one("gasconductivity=table(300, 0.0263, 400, -1)").unwrap_err().to_string();
    assert!(refused.contains("must be positive"), "{refused}");
}

/// comb2d: constant force, b at 2L − l; comb2de: finite overlap between electrical nodes.
#[test]
fn combs() {
    let s = drawn(
        "anchor p1 [a] []\nanchor p1 [b] []\ncomb2d p1 [a b] [l=5u L=20u w=2u gap=3u N=10 V=15]\nanchor p1 [q] []\n\
         c comb2de p1 [a q] [l=4u L=20u gap=2u N=40 Cp=1f oz=pi]\nport * [a q] []",
    );
    same2(at(&s, "b"), [35e-6, 0.0]);
    same2(at(&s, "q"), [-36e-6, 0.0]);
    let (fixed, driven) = (&s.combs[0], &s.combs[1]);
    assert_eq!((fixed.gaps, fixed.gap, fixed.height, fixed.overlap), (10.0, 3e-6, 2e-6, 5e-6));
    assert_eq!((fixed.finite, fixed.voltage.clone()), (false, GapVoltage::Fixed(15.0)));
    assert_eq!((driven.finite, driven.parasitic, driven.permittivity), (true, 1e-15, 9e-12));
    same2(driven.axis, [-1.0, 0.0]);
}

/// Resistors by R or G; an inductor is a short, a capacitor is left out, both with a word.
#[test]
fn circuit() {
    let text = "R * [p q] [R=5]\nR * [q r] [G=4]\nL * [r s] [L=1n]\nC * [p r] [C=1p]\neground * [s] []\nVsrc * [p s] [V=1]\n\
                anchor p1 [a] []\nbeam2d p1 [a b] [l=1u w=1u]";
    let s = drawn(text);
    let resistances: Vec<f64> = s.resistors.iter().map(|r| r.resistance).collect();
    assert_eq!(resistances, [5.0, 0.25]);
    assert_eq!((s.voltage_sources[0].voltage, s.voltage_sources.len()), (0.0, 2));
    assert_eq!(codes(text), ["W021", "W021"]);
}

/// A link without a length joins nodes where others put them.
#[test]
fn link_without_length() {
    let s =
        drawn("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]\nbeam2d p1 [a c] [l=10u w=1u oz=1]\nlink2d * [b c] []");
    assert_eq!(s.links.len(), 1);
    same2(at(&s, "c"), [10e-6 * 1f64.cos(), 10e-6 * 1f64.sin()]);
}

/// The first mechanical node lies at the origin, also when a force names another one first.
#[test]
fn origin() {
    let s = drawn("f2d * [b] [F=1u]\nanchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]");
    same2(at(&s, "b"), [0.0, 0.0]);
    same2(at(&s, "a"), [-10e-6, 0.0]);
}
