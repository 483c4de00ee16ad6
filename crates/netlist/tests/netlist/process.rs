//! Over-etch, inclined side walls and stress gradients of a layer, with numbers worked out by hand from docs/reference/netlist.md.

use bimorph_base::{Bundle, Setting};
use bimorph_netlist::load;
use bimorph_structure::Structure;

/// A layer with an over-etch `e` and walls inclined by `a`.
const P1: &str = "param e = 0, a = 0\nprocess p1 = [Youngsmodulus=160e9 density=2000 h=4u overetch=e sidewall=a resistivity=1e-5 viscosity=2e-5 fluid=1u]\n";

fn drawn(text: &str, e: f64, a: f64) -> Structure {
    let set = [("e", e), ("a", a)].map(|(name, value)| (name.to_owned(), Setting::Number(value)));
    load(&Bundle::from_text("t.net", &format!("{P1}{text}")), &set).unwrap_or_else(|d| panic!("{d}")).structure
}

fn refused(text: &str, e: f64, a: f64) -> String {
    let set = [("e", e), ("a", a)].map(|(name, value)| (name.to_owned(), Setting::Number(value)));
    load(&Bundle::from_text("t.net", &format!("{P1}{text}")), &set).err().map(|d| d.to_string()).unwrap_or_default()
}

/// Two numbers that agree to rounding of a few sums and products.
#[track_caller]
fn same(got: f64, want: f64) {
    assert!((got - want).abs() <= 1e-12 * want.abs(), "{got:e} is not {want:e}");
}

/// One parameter moves every edge: widths lose 2e, gaps between facing edges and stops gain 2e, tips of combs recede on both sides, plates and bodies
/// shrink, and holes grow; thickness, lengths and places of nodes stay.
#[test]
fn an_over_etch_moves_every_edge() {
    let text = "anchor p1 [a] []\nbeam2de p1 [a b] [l=100u w=3u]\nplate2d p1 [b] [l=40u w=20u]\n\
                jaw gap2de p1 [a2 b2 c2 d2] [l=50u w1=3u w2=2u gap=2u]\nanchor p1 [a2] []\n\
                comb2de p1 [b f] [N=10 gap=2u w=3u l=5u L=20u h=4u]\nanchor p1 [f] []\n\
                stop2d p1 [b] [gap=1u]\nbody2d p1 [b] [A=100p Ip=2e-21 perimeter=50u]\n\
                plategap2d p1 [b g] [l=40u w=30u gap=2u electrode=plane hole=1u pitch=8u h=4u pressure=1e5]\nanchor p1 [g] []\n\
                plategap2d p1 [b k] [A=4e-10 l=100u gap=2u fringe=none oz=pi]\nanchor p1 [k] []";
    let e = 0.1e-6;
    let (s, plain) = (drawn(text, e, 0.0), drawn(text, 0.0, 0.0));
    same(s.beams[0].width, 2.8e-6);
    assert_eq!((s.beams[0].thickness, s.beams[0].length), (4e-6, 100e-6));
    same(s.resistors[0].resistance, 1e-5 * 100e-6 / (2.8e-6 * 4e-6));
    same(s.masses[0].mass, 2000.0 * 4e-6 * 39.8e-6 * 19.8e-6);
    same(s.masses[1].mass, 2000.0 * 4e-6 * (100e-12 - e * 50e-6));
    let gap = &s.beam_gaps[0];
    same(gap.gap, 2.2e-6);
    same(gap.widths[0], 2.8e-6);
    same(gap.widths[1], 1.8e-6);
    let comb = &s.combs[0];
    same(comb.gap, 2.2e-6);
    same(comb.overlap, 4.8e-6);
    same(comb.finger[1], 2.8e-6);
    assert_eq!(comb.finger[0], 20e-6);
    same(s.stops[0].ways[0].unwrap_or(0.0), 1.2e-6);
    let over = &s.plate_gaps[0];
    assert_eq!(over.gap, 2e-6);
    same(over.sides[0], 39.8e-6);
    same(over.area, 39.8e-6 * 29.8e-6);
    same(over.gas.and_then(|gas| gas.holes).map_or(0.0, |holes| holes.radius), 1.1e-6);
    let beside = &s.plate_gaps[1];
    same(beside.gap, 2.2e-6);
    same(beside.area, 4e-10 * 99.8 / 100.0);
    let places = |s: &Structure| s.nodes.iter().map(|node| node.position).collect::<Vec<_>>();
    for (etched, drawn) in places(&s).iter().zip(&places(&plain)) {
        assert!((0..2).all(|k| (etched[k] - drawn[k]).abs() < 1e-15), "{etched:?} {drawn:?}");
    }
    // a beam that an arc or a taper is made of, too
    let curved = drawn(
        "anchor p1 [a] []\narc2d p1 [a b] [radius=50u alpha=1 w=3u]\ntaper2d p1 [b c] [l=30u w1=4u w2=4u]",
        e,
        0.0,
    );
    same(curved.beams[0].width, 2.8e-6);
    same(curved.beams[curved.beams.len() - 1].width, 3.8e-6);
}

/// Without an over-etch and with walls that stand, structures are bit-identical to those of a layer without these entries.
#[test]
fn zero_changes_nothing() {
    let text = "anchor p1 [a] []\nbeam2de p1 [a b] [l=100u w=3u]\njaw gap2de p1 [a2 b2 c2 d2] [l=50u w1=3u w2=2u gap=2u]\nanchor p1 [a2] []\nplate2d p1 [b] [l=4u w=3u]";
    let with = drawn(text, 0.0, 0.0);
    let bare = format!("{}{text}", P1.replace("overetch=e sidewall=a ", ""));
    let without = load(&Bundle::from_text("t.net", &bare), &[]).unwrap_or_else(|d| panic!("{d}")).structure;
    assert_eq!(with, without);
}

/// Walls inclined by a = 0.05 rad through 4 µm: d = 4 µm·tan a. The mean width grows by d, and area and second moments are those of the trapezoid:
/// h·m and h·m·(m² + d²)/12 upright, m·h³/12·(1 − d²/(3m²)) where the thickness lies in the plane. Gaps lose d, and touch at their foot.
#[test]
fn inclined_walls() {
    let a: f64 = 0.05;
    let d = 4e-6 * a.tan();
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=3u]\nbeam2d p1 [b c] [l=100u w=3u ox=pi/2]\n\
                jaw gap2d p1 [a2 b2 c2 d2] [l=50u w=3u gap=2u V=1]\nanchor p1 [a2] []\nstop2d p1 [b] [gap=1u]";
    for a in [a, -a] {
        let (s, d) = (drawn(text, 0.0, a), d.copysign(a));
        let mean = 3e-6 + d;
        for (beam, second) in [
            (&s.beams[0], 4e-6 * mean * (mean * mean + d * d) / 12.0),
            (&s.beams[1], mean * 4e-6_f64.powi(3) / 12.0 * (1.0 - d * d / (3.0 * mean * mean))),
        ] {
            same(beam.width * beam.thickness, 4e-6 * mean);
            same(beam.thickness * beam.width.powi(3) / 12.0, second);
        }
        let gap = &s.beam_gaps[0];
        same(gap.gap, 2e-6 - d);
        // they touch 0.1 µm apart where they are nearest
        same(gap.touch.unwrap_or(0.0), 0.1e-6 + d.abs());
        same(s.stops[0].ways[0].unwrap_or(0.0), 1e-6 - d - d.abs());
    }
    let both = drawn("anchor p1 [a] []\ntrapezoidalbeam p1 [a b] [l=100u wbottom=4u wtop=3u]", 0.1e-6, 0.02);
    same(both.beams[0].width * both.beams[0].thickness, 4e-6 * 3.3e-6);
}

/// A part of which nothing is left, a gap that closes, walls in degrees, and an over-etch of parts that are drawn from their side are one error each, with
/// the name of the element.
#[test]
fn vanished_edges_are_errors() {
    let beam = "anchor p1 [a] []\narm beam2d p1 [a b] [l=100u w=2u]";
    let jaw = "anchor p1 [a] []\njaw gap2d p1 [a b c d] [l=50u w=3u gap=1u V=1]";
    let side = "anchor p1 [a] []\njaw gap2dforce p1 [a b c d] [l=50u w=3u gap=1u electrode=plane]\nbeam2d p1 [a b] [l=50u w=3u]";
    for (text, e, a, wanted) in [
        (beam, 1.1e-6, 0.0, "`overetch` leaves nothing of `w`: 2e-6 m as drawn, -2e-7 m as etched in `arm`"),
        (beam, 0.0, -0.3, "`sidewall` leaves nothing of `w`"),
        (beam, 0.0, 2.0, "degrees are written `deg(2)`"),
        (jaw, -0.6e-6, 0.0, "`overetch` leaves nothing of `gap`"),
        (jaw, 0.0, 0.2, "`sidewall` leaves nothing of `gap`"),
        (side, 0.1e-6, 0.0, "drawn from its side"),
    ] {
        let errors = refused(text, e, a);
        assert!(errors.contains(wanted) && errors.contains("E060"), "{wanted}: {errors}");
        assert_eq!(errors.matches("error[").count().max(1), 1, "{errors}");
    }
}

/// A stress that grows across the width bends free beams by −(dσ/dy)/E towards local y, as the same `curvature` does; `curvature` of an element takes
/// precedence.
#[test]
fn a_stress_gradient_bends() {
    let text = |extra: &str| {
        format!(
            "process q = [Youngsmodulus=160e9 density=2000 h=4u stressgradient=3.2e12]\nanchor q [a] []\nbeam2d q [a b] [l=100u w=3u{extra}]"
        )
    };
    let loads = |extra: &str| {
        let text = text(extra);
        load(&Bundle::from_text("t.net", &text), &[]).unwrap_or_else(|d| panic!("{d}")).structure.loads
    };
    let moment = 160e9 * 4e-6 * 3e-6_f64.powi(3) / 12.0 * -20.0;
    same(loads("")[1].moment, moment);
    same(loads(" curvature=10")[1].moment, -0.5 * moment);
}
