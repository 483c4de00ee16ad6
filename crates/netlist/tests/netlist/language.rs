//! The rules of the SUGAR 2 language, one test a rule: numbers, operators, scopes, layers, subnets, names, settings.
//! The expected values follow from the grammar (sugar.y, sugar.lex of SUGAR 2) and were seen in runs of it.

use bimorph_base::{Bundle, Diagnostics, Setting};
use bimorph_netlist::{load, parse_setting};
use bimorph_structure::LoadedNetlist;

/// The process most tests use.
const PROCESS: &str = "process p1 = [Youngsmodulus=165e9 Poisson=0.3 density=2300 h=2u viscosity=1.78e-5 fluid=2u]\n";

fn loaded(text: &str) -> LoadedNetlist {
    with(text, &[])
}

fn with(text: &str, set: &[(&str, f64)]) -> LoadedNetlist {
    let set: Vec<_> = set.iter().map(|(n, v)| ((*n).to_owned(), Setting::Number(*v))).collect();
    load(&Bundle::from_text("t.net", text), &set).unwrap_or_else(|d| panic!("{d}"))
}

fn refused(text: &str) -> Diagnostics {
    load(&Bundle::from_text("t.net", text), &[]).expect_err("the netlist should be refused")
}

/// Value of an expression after some statements.
fn after(statements: &str, expression: &str) -> f64 {
    let loaded = loaded(&format!("{statements}\nparam value = {expression}"));
    match loaded.parameters.last() {
        Some((_, Setting::Number(x))) => *x,
        other => panic!("{other:?}"),
    }
}

fn value(expression: &str) -> f64 {
    after("", expression)
}

/// Every suffix letter is a power of ten, rounded once.
#[test]
fn suffixes() {
    let table = [
        ("a", 1e-18),
        ("f", 1e-15),
        ("p", 1e-12),
        ("n", 1e-9),
        ("u", 1e-6),
        ("m", 1e-3),
        ("c", 1e-2),
        ("d", 1e-1),
        ("h", 1e2),
        ("k", 1e3),
        ("M", 1e6),
        ("G", 1e9),
        ("T", 1e12),
        ("P", 1e15),
        ("E", 1e18),
    ];
    for (letter, factor) in table {
        assert_eq!(value(&format!("1{letter}")), factor, "{letter}");
    }
    assert_eq!(value("5E"), 5e18);
    assert_eq!(value("30u"), 30e-6);
    assert_eq!(value("15.266u"), 15.266e-6);
}

/// A suffix after an exponent is legal and multiplies.
#[test]
fn suffix_after_exponent() {
    assert_eq!(value("1.5e-3u"), 1.5e-9);
    assert_eq!(value("2e3k"), 2e6);
}

/// All binary operators are left associative, `^` too.
#[test]
fn left_associative() {
    assert_eq!(value("2^3^2"), 64.0);
    assert_eq!(value("8/4/2"), 1.0);
    assert_eq!(value("8-4-2"), 2.0);
    assert_eq!(value("2^-1^2"), 2f64.powf(-1.0));
}

/// Unary minus binds below `^` and above `*`.
#[test]
fn unary_minus() {
    assert_eq!(value("-2^2"), -4.0);
    assert_eq!(value("-pi/2*2"), -std::f64::consts::PI);
    assert_eq!(value("2^-2"), 0.25);
    assert_eq!(value("--3"), 3.0);
}

/// Comparisons bind below sums, `&` below them, `|` lowest; truth is 1 and 0.
#[test]
fn logic_and_comparisons() {
    assert_eq!(value("1+2==3"), 1.0);
    assert_eq!(value("1 | 0 & 0"), 1.0);
    assert_eq!(value("!1 == 0"), 1.0);
    assert_eq!(value("~0"), 1.0);
    assert_eq!(value("3 ~= 4"), 1.0);
    assert_eq!(value("3 != 3"), 0.0);
    assert_eq!(value("2 >= 2 & 2 <= 2 & 1 < 2 & 2 > 1"), 1.0);
    assert_eq!(value("'ab' == \"ab\""), 1.0);
    assert_eq!(value("'ab' != 'abc'"), 1.0);
}

/// `&`, `|` and `cond` evaluate only the operands that they need.
#[test]
fn lazy_evaluation() {
    assert_eq!(value("0 & 1/0"), 0.0);
    assert_eq!(value("1 | 1/0"), 1.0);
    assert_eq!(value("cond(0, 1/0, 7)"), 7.0);
}

/// The functions, angles in radians; `mod` has the sign of its first argument.
#[test]
fn functions() {
    assert_eq!(value("deg(90)"), std::f64::consts::FRAC_PI_2);
    assert_eq!(value("cos(pi)"), -1.0);
    assert_eq!(value("sqrt(16) + abs(-2) + floor(2.7) + ceil(2.2) + round(2.5)"), 14.0);
    assert_eq!(value("mod(9, 8)"), 1.0);
    assert_eq!(value("mod(-9, 8)"), -1.0);
    assert_eq!(value("min(3, 2) + max(3, 2)"), 5.0);
    assert_eq!(value("atan2(1, 1) - atan(1)"), 0.0);
    assert_eq!(value("sign(-3) + sign(0)"), -1.0);
    assert_eq!(value("log(exp(2)) + log10(1000)"), 5.0);
    assert_eq!(value("asin(1) - acos(0)"), 0.0);
    assert_eq!(value("sin(0) + tan(0)"), 0.0);
}

/// Lists are free form: `[l=a -b]` is one value, a difference.
#[test]
fn white_space_does_not_end_a_value() {
    let text = format!("{PROCESS} a=30u b=10u\nanchor p1 [n] []\nbeam2d p1 [n m] [l=a -b w=2u]");
    assert!((loaded(&text).structure.beams[0].length - 20e-6).abs() < 1e-18);
}

/// A loop runs over whole numbers, ends included; its variable keeps the last value; an empty loop leaves it alone.
#[test]
fn loops() {
    assert_eq!(after("x=1 for k=1:3 [ x=x*2 ]", "x"), 8.0);
    assert_eq!(after("for k=1:3 [ y=k ]", "k"), 3.0);
    assert_eq!(after("x=5 for k=3:1 [ x=0 ]", "x"), 5.0);
    assert_eq!(after("x=0 for i=1:3 [ for j=i:3 [ x=x+1 ] ]", "x"), 6.0);
}

/// A name first defined in a block ends with it; an assignment to an outer name stays.
#[test]
fn block_scope() {
    assert_eq!(after("x=1 [ x=2 y=3 ]", "x"), 2.0);
    let d = refused("[ y=3 ]\nz=y");
    assert_eq!(d.items[0].code, "E030");
    assert_eq!((d.items[0].line, d.items[0].column), (2, 3));
}

/// `if … else if … else` runs one branch.
#[test]
fn conditions() {
    assert_eq!(after("x=0 if 0 [x=1] else if 1 [x=2] else [x=3]", "x"), 2.0);
    assert_eq!(after("x=0 if 2 > 3 x=1 else x=9", "x"), 9.0);
}

/// A subnet reads globals as they are when it is instantiated, and never changes them.
#[test]
fn subnet_scope() {
    let text = format!(
        "{PROCESS} w0=1u\nsubnet s [a b] [] [ beam2d parent [a b] [l=10u w=w0] w0=9u ]\nw0=3u\nanchor p1 [n] []\n\
         s p1 [n m] []\ns p1 [m q] []"
    );
    let widths: Vec<f64> = loaded(&text).structure.beams.iter().map(|b| b.width).collect();
    assert_eq!(widths, [3e-6, 3e-6]);
}

/// A subnet's parameter is taken from the call, else its default (which sees earlier ones), else the layer.
#[test]
fn subnet_parameters() {
    let subnet = "subnet s [a b] [l=* w=l/8 h=* x=?]\n[ if isdef(x) [w=x] beam2d parent [a b] [l=l w=w h=h] ]\n";
    let text = format!("{PROCESS}{subnet}anchor p1 [n] []\ns p1 [n m] [l=40u]\ns p1 [m q] [l=40u x=7u h=3u]");
    let beams = loaded(&text).structure.beams;
    assert_eq!((beams[0].width, beams[0].thickness), (40e-6 / 8.0, 2e-6));
    assert_eq!((beams[1].width, beams[1].thickness), (7e-6, 3e-6));
}

/// A parameter of an instance reaches no inner element unless the subnet passes it on.
#[test]
fn subnet_parameters_stay_outside() {
    let text = format!(
        "{PROCESS}subnet s [a b] []\n[ beam2d parent [a b] [l=10u w=2u] ]\nanchor p1 [n] []\ns p1 [n m] [h=5u]"
    );
    assert_eq!(loaded(&text).structure.beams[0].thickness, 2e-6);
}

/// An instance's orientation turns everything in it; its nodes and elements carry its name.
#[test]
fn subnet_rotation_and_names() {
    let text = format!(
        "{PROCESS}subnet s [a b] [] [ arm beam2d parent [a m(1)] [l=10u w=2u]\n beam2d parent [m(1) b] [l=10u w=2u oz=pi/2] ]\n\
         anchor p1 [n] []\nleft(2) s p1 [n e] [oz=pi/2]"
    );
    let structure = loaded(&text).structure;
    let names: Vec<&str> = structure.nodes.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["n", "e", "left(2).m(1)"]);
    assert_eq!(structure.beams[0].name, "left(2).arm");
    assert_eq!(structure.beams[1].name, "left(2).anon1");
    let e = structure.nodes[1].position;
    assert!((e[0] + 10e-6).abs() < 1e-18 && (e[1] - 10e-6).abs() < 1e-18, "{e:?}");
}

/// Anonymous lines count in reading order over the whole netlist, those in subnet bodies included.
#[test]
fn anonymous_names() {
    let text = format!(
        "{PROCESS}subnet s [a b] [] [ beam2d parent [a b] [l=1u w=1u] ]\nanchor p1 [n] []\nbeam2d p1 [n m] [l=5u w=1u]"
    );
    let structure = loaded(&text).structure;
    assert_eq!(structure.supports[0].name, "anon2");
    assert_eq!(structure.beams[0].name, "anon3");
}

/// A layer's own entries come before its parent's, an element's before both.
#[test]
fn layers_inherit() {
    let text = "process base = [Youngsmodulus=100e9 density=2000 h=1u]\nprocess top : base = [h=3u]\nanchor top [n] []\n\
                beam2d top [n m] [l=10u w=1u density=5]";
    let beam = loaded(text).structure.beams[0].clone();
    assert_eq!((beam.material.youngs_modulus, beam.thickness, beam.material.density), (100e9, 3e-6, 5.0));
}

/// A layer is evaluated at each use: a later change of a variable it names reaches later elements only.
#[test]
fn layers_are_lazy() {
    let text = "t=3u\nprocess p = [Youngsmodulus=100e9 density=1 h=t]\nanchor p [n] []\nbeam2d p [n m] [l=10u w=1u]\nt=4u\n\
                beam2d p [m q] [l=10u w=1u]";
    let heights: Vec<f64> = loaded(text).structure.beams.iter().map(|b| b.thickness).collect();
    assert_eq!(heights, [3e-6, 4e-6]);
}

/// A parameter of the netlist is set from outside whatever its default; the netlist may assign to it later.
#[test]
fn settings() {
    let text = "param theta = 10, gap = 2u\ntheta = theta*2\nparam value = theta";
    let parameters = with(text, &[("theta", 7.0)]).parameters;
    assert_eq!(parameters[0], ("theta".to_owned(), Setting::Number(7.0)));
    assert_eq!(parameters[1], ("gap".to_owned(), Setting::Number(2e-6)));
    assert_eq!(parameters[2], ("value".to_owned(), Setting::Number(14.0)));
}

/// Settings are read as the netlist language writes values.
#[test]
fn settings_from_text() {
    assert_eq!(parse_setting("2.1u"), Ok(Setting::Number(2.1e-6)));
    assert_eq!(parse_setting(" -pi/2 "), Ok(Setting::Number(-std::f64::consts::FRAC_PI_2)));
    assert_eq!(parse_setting("deg(180)"), Ok(Setting::Number(std::f64::consts::PI)));
    assert_eq!(parse_setting("poly"), Ok(Setting::Text("poly".into())));
    assert_eq!(parse_setting("'two words'"), Ok(Setting::Text("two words".into())));
    assert!(parse_setting("10um").is_err());
    assert!(parse_setting("1\nparam b = 2").is_err());
}

/// Comments run to the end of the line, also at the end of the text without a line end; CR LF counts as one line end.
#[test]
fn comments_and_line_ends() {
    assert_eq!(after("x=1 % x=2\r\n%%", "x"), 1.0);
    let d = refused("% one\r\n% two\r\nx = y");
    assert_eq!((d.items[0].line, d.items[0].column), (3, 5));
    assert!(load(&Bundle::from_text("t.net", "x=1 % no line end"), &[]).is_ok());
}

/// A name may be that of an element or a subnet.
#[test]
fn element_names_may_be_models() {
    let text = format!("{PROCESS}anchor anchor p1 [n] []\nbeam2d beam2d p1 [n m] [l=10u w=1u]");
    let structure = loaded(&text).structure;
    assert_eq!((structure.supports[0].name.as_str(), structure.beams[0].name.as_str()), ("anchor", "beam2d"));
}

/// A netlist's own subnet wins over the built-in element of the same name.
#[test]
fn own_subnets_win() {
    let text = format!(
        "{PROCESS}subnet beam2de [a b] [l=* w=*] [ beam2d parent [a b] [l=l w=3*w] ]\nanchor p1 [n] []\nbeam2de p1 [n m] [l=10u w=1u]"
    );
    let structure = loaded(&text).structure;
    assert!((structure.beams[0].width - 3e-6).abs() < 1e-18);
    assert!(structure.resistors.is_empty());
}

/// Recursion that ends is fine.
#[test]
fn recursion() {
    let text = format!(
        "{PROCESS}subnet chain [a z] [n=*] [\n if n > 1 [ beam2d parent [a m] [l=1u w=1u] chain parent [m z] [n=n-1] ]\n\
         else beam2d parent [a z] [l=1u w=1u] ]\nanchor p1 [n] []\nchain p1 [n tip] [n=20]"
    );
    let structure = loaded(&text).structure;
    let tip = structure.node("tip").expect("tip");
    assert_eq!(structure.beams.len(), 20);
    assert!((structure.nodes[tip.0].position[0] - 20e-6).abs() < 1e-17);
}

/// A print of a netlist is a message of its own, once for each time it runs.
#[test]
fn print() {
    let warnings = loaded("for k=1:2 [ call print('k=', k, ' ', 1.5u, ' ', 12345678) ]").warnings;
    let lines: Vec<&str> = warnings.items.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(lines, ["print: k=1 1.5e-6 1.23457e7", "print: k=2 1.5e-6 1.23457e7"]);
}

/// The same text loads to the same structure, bit for bit.
#[test]
fn deterministic() {
    let text = format!("{PROCESS}anchor p1 [n(0)] []\nfor k=0:20 [ beam2d p1 [n(k) n(k+1)] [l=10u w=1u oz=k/7] ]");
    assert_eq!(loaded(&text).structure, loaded(&text).structure);
}
