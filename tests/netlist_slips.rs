//! Slips of the pen that leave a netlist readable: repeated, misspelt, overwritten or unused names are reported with
//! their place; impossible ones are errors.

use bimorph::analysis::mesh::static_fitted;
use bimorph::compile::{CompileOptions, compile};
use bimorph::netlist::{Bundle, Diagnostic, Setting, load};
use bimorph::structure::Structure;

const HEAD: &str = "process p1 = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p1 [a] []\n";
const BEAM: &str = "beam2d p1 [a b] [l=100u w=2u]\n";

fn reported_with(text: &str, set: &[(String, Setting)]) -> Vec<Diagnostic> {
    match load(&Bundle::from_text("t.net", text), set) {
        Ok(loaded) => loaded.warnings.items,
        Err(found) => found.items,
    }
}

/// The only message of a netlist: its code, line and column, and its text with the way out.
#[track_caller]
fn only(text: &str) -> (String, (usize, usize), String) {
    let found = reported_with(text, &[]);
    assert_eq!(found.len(), 1, "{found:?}");
    let one = &found[0];
    assert!(!one.help.is_empty(), "{one:?}");
    (one.code.clone(), (one.line, one.column), format!("{}; {}", one.message, one.help))
}

#[track_caller]
fn says(text: &str, code: &str, place: (usize, usize), words: &[&str]) {
    let (found, at, message) = only(text);
    assert_eq!((found.as_str(), at), (code, place), "{message}");
    for word in words {
        assert!(message.contains(word), "{message} lacks {word}");
    }
}

fn drawn(text: &str) -> Structure {
    load(&Bundle::from_text("t.net", text), &[]).unwrap_or_else(|d| panic!("{d}")).structure
}

/// A parameter, a formal or a node that occurs twice in one list is reported at its second place. Of parameters the
/// first is used, of angles too. A second list of definitions is no part of the element, and is reported.
#[test]
fn what_stands_twice() {
    let twice = format!("{HEAD}beam2d p1 [a b] [l=100u w=2u l=50u oz=pi/2]\n");
    says(&twice, "W018", (3, 30), &["`l`", "first holds", "remove"]);
    let turned = drawn(&format!("{HEAD}beam2d p1 [a b] [l=100u w=2u oz=0 oz=pi/2]\n"));
    assert_eq!((turned.beams[0].length, turned.beams[0].angle), (100e-6, 0.0));
    let entries = "process p1 = [Youngsmodulus=165e9 density=2300 h=2u h=3u]\nanchor p1 [a] []\n";
    says(&format!("{entries}{BEAM}"), "W018", (1, 53), &["`h`"]);
    says(&format!("{HEAD}{BEAM}subnet s [p q] [x=1 x=2] []\n"), "W018", (4, 21), &["`x`", "last holds"]);
    says(&format!("{HEAD}{BEAM}subnet s [p p] [] []\n"), "W018", (4, 13), &["node `p`"]);
    let stray = format!("{HEAD}beam2d p1 [a b] [l=100u w=2u] [oz=pi/2]\n");
    says(&stray, "W019", (3, 31), &["one list of parameters"]);
    assert!(reported_with(&format!("{HEAD}{BEAM}[x=1 beam2d p1 [b c] [l=x*1u w=1u]]\n"), &[]).is_empty());
}

/// A definition that replaces a parameter set from outside is reported; one made of it, or to the same value, is not.
#[test]
fn settings_are_not_overwritten_in_silence() {
    let set = [("w".to_owned(), Setting::Number(3e-6))];
    let with = |line: &str| reported_with(&format!("param w=2u\n{line}\n{HEAD}beam2d p1 [a b] [l=100u w=w]\n"), &set);
    let found = with("w=4u");
    assert_eq!(found.iter().map(|d| (d.code.as_str(), d.line)).collect::<Vec<_>>(), [("W023", 2)], "{found:?}");
    assert!(with("w=2*w").is_empty() && with("w=3u").is_empty());
}

/// Unused entries of a layer that resemble others are reported; formals of subnets and parameters of elements are used.
/// A layer's own `T` is that of its beams.
#[test]
fn entries_of_layers() {
    for (slip, meant) in [("Stress", "stress"), ("strss", "stress"), ("viscocity", "viscosity"), ("Density", "density")]
    {
        let text = format!("process p1 = [Youngsmodulus=165e9 density=2300 h=2u {slip}=100]\nanchor p1 [a] []\n{BEAM}");
        says(&text, "W004", (1, 53), &[&format!("`{slip}`"), &format!("did you mean `{meant}`")]);
    }
    let layer = "process p1 = [Youngsmodulus=165e9 density=2300 h=2u stres=9 w=2u]\nanchor p1 [a] []\n";
    assert!(reported_with(&format!("{layer}subnet s [p] [stres=*] []\n{BEAM}"), &[]).is_empty());
    let warm =
        "process p1 = [Youngsmodulus=165e9 density=2300 h=2u T=500 thermalexpansion=2e-6 ambienttemperature=300]\n";
    assert_eq!(drawn(&format!("{warm}anchor p1 [a] []\n{BEAM}")).beams[0].temperature, Some(500.0));
}

/// Constants that no material has are refused.
#[test]
fn constants_of_no_material() {
    for (entry, name) in [
        ("Poisson=0.6", "Poisson"),
        ("Poisson=-1", "Poisson"),
        ("viscosity=1.8e-5 fluid=-2u", "fluid"),
        ("T=-100 thermalexpansion=2e-6 ambienttemperature=300", "`T`"),
    ] {
        let found = reported_with(&format!("{HEAD}beam2d p1 [a b] [l=100u w=2u {entry}]\n"), &[]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].code == "E060" && found[0].message.contains(name), "{found:?}");
    }
}

/// Gaps that take their voltage from nodes say so of a `V`; what has both ends on one node, of itself; a measured beam between nodes
/// in one place has no length, whatever rounding leaves between them.
#[test]
fn what_has_no_effect() {
    let beams =
        format!("{HEAD}{BEAM}anchor p1 [c] []\nbeam2d p1 [c d] [l=100u w=10u]\neground * [a] []\neground * [c] []\n");
    let gap = "gap2dforce p1 [a b c d] [l=100u w1=2u w2=10u gap=2u V=30]\n";
    says(&format!("{beams}{gap}"), "W004", (8, 53), &["`V`", "between its nodes", "gap2d"]);
    for element in ["spring2d * [b b] [kx=1]", "damper2d * [b b] [bx=1]"] {
        says(&format!("{HEAD}{BEAM}{element}\n"), "W006", (4, 1), &["both its ends are the node `b`"]);
    }
    let loop_ = "beam2d p1 [a b] [l=100u w=2u oz=pi/2]\nbeam2d p1 [b c] [l=100u w=2u oz=pi/2+2*pi/3]\n
        beam2d p1 [c d] [l=100u w=2u oz=pi/2+4*pi/3]\nbeam2d p1 [a d] [w=2u]\n";
    let found = reported_with(&format!("{HEAD}{loop_}"), &[]);
    assert!(found.iter().any(|d| d.code == "E064"), "{found:?}");
}

/// An exponent beyond any number is no 1: a tiny one is 0, a huge one is not finite.
#[test]
fn exponents_beyond_any_number() {
    let of = |force: &str| drawn(&format!("{HEAD}{BEAM}f2d * [b] [F={force}]\n")).loads[0].force[0];
    assert_eq!((of("1e-99999999999"), of("1e-3")), (0.0, 1e-3));
    let found = reported_with(&format!("{HEAD}{BEAM}f2d * [b] [F=1e99999999999]\n"), &[]);
    assert!(found.iter().any(|d| d.code == "E050"), "{found:?}");
}

/// Elements built again in a loop have names of their own, `anonN(2)` and so on, with all their parts; so do signals
/// and results of each.
#[test]
fn loops_name_what_they_build() {
    let text = format!(
        "{HEAD}subnet arm [root] [F=*] [ beam2d parent [root tip] [l=100u w=2u]\n f2d * [tip] [F=F oz=pi/2] ]
        for k=1:2 [ arm p1 [a] [F=k*1u oz=k] ]\n"
    );
    let structure = drawn(&text);
    let names: Vec<&str> = structure.nodes.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["a", "anon4.tip", "anon4(2).tip"]);
    assert_eq!(structure.beams[1].name, "anon4(2).anon2");
}

/// Beyond the maximum number of prints and warnings of one kind, others are still reported; the last line gives the
/// number of omitted ones.
#[test]
fn many_warnings_hide_no_other() {
    let many = "for k=1:150 [ call print(k) ]\n".to_owned()
        + &(0..30).map(|k| format!("beam2d p1 [a n{k}] [l=100u w=2u {}=1]\n", "q".repeat(k + 9))).collect::<String>();
    let found = reported_with(&format!("{HEAD}{many}beam2d p1 [x y] [l=100u w=2u]\n"), &[]);
    let count = |code: &str| found.iter().filter(|d| d.code == code).count();
    assert_eq!([count("W002"), count("W004"), count("W010"), count("W012")], [100, 20, 1, 1], "{found:?}");
    let last = found.last().unwrap();
    assert_eq!((last.code.as_str(), last.message.as_str()), ("W016", "left out: 50 more of W002, 10 more of W004"));
}

/// Angles of arms and curves that seem to be degrees are reported like those of `oz`.
#[test]
fn degrees_of_arms() {
    let text = format!("{HEAD}rigidlinkbeam p1 [a b] [l=100u w=2u]\nbeam3dlink p1 [a c] [l=100u w=2u L1=20u oz1=90]\n");
    assert!(
        reported_with(&text, &[]).iter().any(|d| d.code == "W003" && d.line == 4),
        "{:?}",
        reported_with(&text, &[])
    );
}

/// Junctions beyond their table are reported once, with their number: cut offsets, ratios of widths, beams shorter than
/// wide. Plain anchors, corners and arcs are not.
#[test]
fn junctions_beyond_their_table() {
    let reported = |text: &str| -> Vec<String> {
        let compiled =
            compile(&Bundle::from_text("t.net", &format!("{HEAD}{text}")), &CompileOptions::default()).unwrap();
        compiled.warnings.items.into_iter().filter(|d| d.code == "W017").map(|d| d.message).collect()
    };
    let bridge =
        "beam2d p1 [a b] [l=50u w=20u]\nneck beam2d p1 [b c] [l=12u w=2u oz=pi/2]\nbeam2d p1 [c d] [l=50u w=20u]\n";
    let found = reported(bridge);
    assert!(found.len() == 1 && found[0].contains("`neck`") && found[0].contains("nine tenths"), "{found:?}");
    assert!(reported("beam2d p1 [a b] [l=2u w=50u]")[0].contains("shorter than wide"));
    let plain = "beam2d p1 [a b] [l=20u w=10u]\nbeam2d p1 [b c] [l=50u w=5u oz=pi/2]\narc2d p1 [c d] [radius=10u alpha=pi w=8u]\n";
    assert_eq!(reported(plain), [""; 0]);
}

/// A comb whose fingers have passed its other side is reported with its travel: 5 µN at 0.1 N/m are 50 µm of 15 µm.
#[test]
fn fingers_that_go_through() {
    let text = |force: &str| {
        format!(
            "{HEAD}spring2d * [a m] [kx=0.1]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nanchor * [s] []\nf2d * [m] [F={force}]
            dr comb2d p1 [m s] [N=100 gap=2u l=5u L=20u V=0]\n"
        )
    };
    let reported = |force: &str| {
        let compiled = compile(&Bundle::from_text("t.net", &text(force)), &CompileOptions::default()).unwrap();
        let found = static_fitted(&compiled, &[]).unwrap().0.warnings.items;
        found.into_iter().filter(|d| d.code == "W024").map(|d| d.message).collect::<Vec<_>>()
    };
    let found = reported("5u");
    assert!(
        found.len() == 1 && ["`dr`", "50.000 µm", "15.000 µm"].iter().all(|part| found[0].contains(part)),
        "{found:?}"
    );
    assert_eq!(reported("1u"), [""; 0]);
}
