//! Every message says what is wrong, where, and what to do; one run reports all errors.

use bimorph_base::{Bundle, Diagnostic, Diagnostics, Setting, Severity};
use bimorph_netlist::load;

const PROCESS: &str =
    "process p1 = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2e-6 thermcond=2.33 sheetresistance=20]\n";
const CANTILEVER: &str = "anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]\n";

fn all(text: &str) -> Diagnostics {
    match load(&Bundle::from_text("t.net", text), &[]) {
        Ok(loaded) => loaded.warnings,
        Err(diagnostics) => diagnostics,
    }
}

/// The only message of a netlist that has the process and `text`; its place is that within `text`.
#[track_caller]
fn only(text: &str) -> Diagnostic {
    let mut found = all(&format!("{PROCESS}{text}"));
    assert_eq!(found.items.len(), 1, "{found}");
    let mut item = found.items.remove(0);
    item.line = item.line.saturating_sub(1);
    item
}

#[track_caller]
fn error(text: &str, code: &str, place: (usize, usize), width: usize, message: &str, help: &str) {
    let item = only(text);
    assert_eq!((item.code.as_str(), item.severity), (code, Severity::Error), "{item:?}");
    assert_eq!((item.line, item.column, item.width), (place.0, place.1, width), "{item:?}");
    assert_eq!((item.message.as_str(), item.help.as_str()), (message, help));
}

#[track_caller]
fn warning(text: &str, code: &str, message: &str) {
    let item = only(text);
    assert_eq!((item.code.as_str(), item.severity), (code, Severity::Warning), "{item:?}");
    assert!(item.message.contains(message), "{item:?}");
}

/// Gas whose mean free path exceeds 880 gaps is beyond Veijola's law (Sens. Actuators A 48, 1995): 68 nm at 101 325 Pa are 880 gaps of 2 µm at 3.915 Pa. Vacuum and a
/// gap without viscosity have no film.
#[test]
fn rarefied_films_are_reported() {
    let film = |pressure: f64, viscosity: f64| {
        format!(
            "anchor * [f] []\nspring2d * [f a] [kx=1]\nmass2d * [a] [m=1e-10]\nguide2d * [a] []\nanchor * [b] []\n\
             g plategap2d * [a b] [l=100u w=100u gap=2u fringe=none pressure={pressure} viscosity={viscosity}]\n\
             eground * [b] []\ndrive port * [a b] []"
        )
    };
    warning(&film(3.8, 1.83e-5), "W027", "the mean free path of the gas in `g` is 907 gaps");
    for quiet in [film(4.0, 1.83e-5), film(3.8, 0.0), film(0.0, 1.83e-5)] {
        assert!(all(&quiet).items.is_empty(), "{}", all(&quiet));
    }
}

/// A rendered message shows the line, a caret under the word, and the way out.
#[test]
fn rendered() {
    let text = "process p1 = [Youngsmodulus=165e9 density=1 h=2u]\nanchor p1 [a] []\nbeam2d p1 [a b] [l=10um w=1u]\n";
    let want = "\
error[E001]: `10um` is not a number
 --> t.net:3:20
  |
3 | beam2d p1 [a b] [l=10um w=1u]
  |                    ^^^^
  |
  = help: units are not written, everything is SI: write `10u`
";
    assert_eq!(all(text).render(false), want);
    assert!(all(text).render(true).contains("\u{1b}["));
}

/// Numbers: units, unknown suffixes, a missing leading digit, a wrong exponent letter.
#[test]
fn numbers() {
    let l = |number: &str| format!("anchor p1 [a] []\nbeam2d p1 [a b] [l={number} w=1u]");
    let bare = "a number must begin with a digit, found `.5u`";
    error(&l(".5u"), "E001", (2, 20), 3, bare, "write `0.5u`");
    let exa = "an exponent is written with a small e: `1e5`; `E` is the suffix exa";
    error(&l("1E5"), "E001", (2, 20), 3, "`1E5` is not a number", exa);
    let grouped = "digits are not grouped: write `10u`";
    error(&l("1_0u"), "E001", (2, 20), 4, "`1_0u` is not a number", grouped);
    let upper = "suffixes are a f p n u m c d h k M G T P E, case matters: write `10u`";
    error(&l("10U"), "E001", (2, 20), 3, "`10U` is not a number", upper);
    error(&l("1."), "E002", (2, 20), 2, "digits must follow the decimal point", "write `1.0` or `1`");
}

/// Brackets and lists.
#[test]
fn brackets() {
    let every = "every `[` needs its `]`";
    let never = "this `[` is never closed";
    error("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u\nanchor p1 [b] []", "E014", (2, 17), 1, never, every);
    error("for k=1:2 [ x=k", "E014", (1, 11), 1, never, every);
    error("x=1 ]", "E011", (1, 5), 1, "this `]` closes nothing", "");
    error("anchor p1 [a, b] []", "E017", (1, 13), 1, "node names are separated by blanks", "remove the comma");
    error("x = (1+2", "E010", (1, 9), 1, "expected `)`, found the end of the file", "");
    error("x = 1 +", "E010", (1, 8), 1, "expected a value, found the end of the file", "");
    error("x = 'abc", "E003", (1, 5), 4, "this string is never closed", "close it with `'` on the same line");
    let lists = "lists are written in `[ ]`; a SUGAR 3 (Lua) netlist must be turned into SUGAR 2 first";
    error("x = 1 }", "E004", (1, 7), 1, "`}` has no meaning here", lists);
}

/// A `]` that is missing above is looked for where the next top-level word stands inside a block.
#[test]
fn block_left_open() {
    let text = "for k=1:2 [ x=k\nparam y=1";
    error(
        text,
        "E012",
        (2, 1),
        5,
        "`param` stands inside a block",
        "is a `]` missing above? the block was opened in line 2",
    );
}

/// An element's head.
#[test]
fn element_heads() {
    let help = "an element is `[NAME] MODEL LAYER [nodes] [parameters]`, with `*` for no layer";
    error("anchor [a] []", "E015", (1, 8), 1, "expected an element's model and layer, found `[`", help);
    let message = "unknown element `baem2d`";
    error("anchor p1 [a] []\nbaem2d p1 [a b] [l=1u w=1u]", "E055", (2, 1), 6, message, "did you mean `beam2d`?");
    let message = "unknown process layer `p2`";
    error("anchor p2 [a] []", "E031", (1, 8), 2, message, "did you mean `p1`?");
    let message = "unknown process layer `parent`";
    error("anchor parent [a] []", "E031", (1, 8), 6, message, "`parent` is known inside subnets only");
    let message = "`beam2d` takes 2 nodes, 3 given";
    error("anchor p1 [a] []\nbeam2d p1 [a b c] [l=1u w=1u]", "E054", (2, 11), 7, message, "write `beam2d LAYER [a b]`");
    let reason = "it is in SUGAR's manual only; use `gap2d` or `gap2dforce`";
    error("gapV2 * [a b] []", "E056", (1, 1), 5, "the element `gapV2` is not supported", reason);
    let reason = "its file is not part of SUGAR; a support that lets its node turn is `hinge`";
    error("anchorrot p1 [a] []", "E056", (1, 1), 9, "the element `anchorrot` is not supported", reason);
}

/// Variables, functions, types and whole numbers.
#[test]
fn expressions() {
    let above = "a variable must be defined above its first use";
    error("x = 1+zebra", "E030", (1, 7), 5, "undefined variable `zebra`", above);
    error("length = 1\nx = lenght", "E030", (2, 5), 6, "undefined variable `lenght`", "did you mean `length`?");
    let beside = "the parameters of one list do not see each other: define `l` above";
    error("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=l/5]", "E030", (2, 26), 1, "undefined variable `l`", beside);
    error("x = sqr(2)", "E032", (1, 5), 6, "unknown function `sqr`", "did you mean `sqrt`?");
    error("x = sqrt(1, 2)", "E043", (1, 5), 10, "`sqrt` takes one number, got a number, a number", "");
    error("x = 1 + 'a'", "E040", (1, 9), 3, "`+` needs a number, this is a string", "");
    error("x = 1/0", "E041", (1, 5), 3, "division by zero", "");
    error("x = sqrt(-1)", "E043", (1, 5), 8, "`sqrt` has no real value here", "");
    let index = "an index must be a whole number, this is 1.5";
    error("anchor p1 [a(3/2)] []", "E047", (1, 14), 3, index, "use `round`, `floor` or `ceil`");
    let bound = "a loop bound must be a whole number, this is 2.5";
    error("for k=1:2.5 [ x=k ]", "E047", (1, 9), 3, bound, "use `round`, `floor` or `ceil`");
    error("call assert(1 > 2, 'too wide')", "E042", (1, 6), 25, "too wide", "the netlist's own `assert` failed");
}

/// Ranges and missing parameters of elements.
#[test]
fn element_parameters() {
    let beam = |list: &str| format!("anchor p1 [a] []\nbeam2d p1 [a b] [{list}]");
    let turned = "a part that runs the other way has its length, and `oz` half a turn on";
    error(&beam("l=-10u w=1u"), "E060", (2, 18), 6, "`l` (length [m]) must be positive, this is -1e-5", turned);
    error(&beam("l=10u w=0"), "E060", (2, 24), 3, "`w` (width [m]) must be positive, this is 0", "");
    let help = "give `w=` here or in the layer `p1`";
    error(&beam("l=10u"), "E053", (2, 1), 6, "`beam2d` needs `w` (width [m])", help);
    let text = "`w` (width [m]) must be a finite number, this is a string";
    error(&beam("l=10u w='a'"), "E050", (2, 24), 5, text, "");
    let plane = "models are planar (x, y, rotation about z): turn it with `oz` only";
    error(&beam("l=10u w=1u oy=1"), "E061", (2, 1), 6, "`anon2` leaves the drawing plane", plane);
}

/// A subnet's nodes and parameters, and recursion without end. The instance in which an error is met is named.
#[test]
fn subnets() {
    let subnet = "subnet s [a b] [l=*] [ beam2d parent [a b] [l=l w=0] ]\nanchor p1 [n] []\n";
    let nodes = "subnet `s` has 2 nodes, 1 given";
    error(&format!("{subnet}s p1 [n] [l=1u]"), "E051", (3, 6), 3, nodes, "its nodes are [a b]");
    let needs = "subnet `s` needs the parameter `l`";
    error(
        &format!("{subnet}s p1 [n m] []"),
        "E053",
        (3, 1),
        1,
        needs,
        "give `l=`, or take it from a layer that has it",
    );
    let item = only(&format!("{subnet}left s p1 [n m] [l=1u]"));
    assert_eq!((item.code.as_str(), item.help.as_str()), ("E060", "seen in the subnet instance `left`"));
    let endless = only("subnet s [a] [] [ s * [a] [] ]\ns * [q] []");
    assert_eq!((endless.code.as_str(), endless.line), ("E052", 1));
    assert!(endless.message.contains("calls itself without end"), "{endless:?}");
    // SUGAR's library holds such a gap2dV.
    let library = only("subnet gap2dV [a b c d] [V=*] [ gap2dV parent [a b c d] [V=V] ]\ngap2dV p1 [a b c d] [V=1]");
    assert!(library.help.starts_with("remove this subnet: the element `gap2dV` is built in"), "{library:?}");
}

/// Recursion that doubles, and loops that never seem to end, stop with a message.
#[test]
fn runaway_netlists() {
    let doubling = "subnet s [a] [n=*] [ if n > 0 [ s * [a] [n=n-1] s * [a] [n=n-1] ] ]\ns * [q] [n=40]";
    assert_eq!(only(doubling).code, "E046");
    assert_eq!(only("for k=1:2000000000 [ x=k ]").code, "E046");
}

/// A parameter without a default must be set; a name that is no parameter cannot be.
#[test]
fn settings() {
    let needed = "the parameter `V` has no default and was not set";
    error("param V", "E045", (1, 7), 1, needed, "give it from outside: `--set V=VALUE`");
    let set = [("gab".to_owned(), Setting::Number(1.0)), ("x".to_owned(), Setting::Number(1.0))];
    let found = load(&Bundle::from_text("t.net", "param gap=1 w=2"), &set).expect_err("neither is a parameter");
    let found: Vec<_> =
        found.items.iter().map(|d| (d.code.as_str(), d.line, d.message.as_str(), d.help.as_str())).collect();
    assert_eq!(
        found,
        [
            ("E048", 0, "the netlist has no parameter `gab` to set", "did you mean `gap`? its parameters are gap"),
            ("E048", 0, "the netlist has no parameter `x` to set", "its parameters are gap"),
        ]
    );
}

/// Loose ends of the drawing.
#[test]
fn loose_ends() {
    let node = "node `tpi` is connected to nothing: no beam, link or spring holds it";
    error(
        "anchor p1 [a] []\nbeam2d p1 [a tip] [l=10u w=1u]\nf2d * [tpi] [F=1u]",
        "E070",
        (3, 8),
        3,
        node,
        "did you mean `tip`?",
    );
    let positions = "`anon2` has no length, and its nodes have no distance";
    let help = "give `l=`, or place its nodes with `pos`";
    error("anchor p1 [a] []\nbeam2d p1 [a b] [w=1u]\npos * [a b] []", "E064", (2, 1), 6, positions, help);
    let help = "give the beam or link that leads to it its `l=`, or place it with `pos`";
    error("anchor p1 [a] []\nbeam2d p1 [a b] [w=1u]", "E065", (2, 14), 1, "nothing says where node `b` lies", help);
}

/// Ports and other named elements want names of their own; for ports it is an error.
#[test]
fn names_twice() {
    let ports = format!("{CANTILEVER}eground * [a] []\nheat port * [b a] []\nheat port * [b a] []");
    let found = all(&format!("{PROCESS}{ports}"));
    let codes: Vec<&str> = found.items.iter().map(|d| d.code.as_str()).collect();
    assert_eq!(codes, ["W007", "E063"]);
    warning("x anchor p1 [a] []\nx beam2d p1 [a b] [l=10u w=1u]", "W007", "there is an element `x` already");
}

/// Parts of the drawing that hang in the air, loops that do not close, potentials that float.
#[test]
fn drawing_warnings() {
    let text = format!("{PROCESS}{CANTILEVER}beam2d p1 [x y] [l=10u w=1u]");
    let found = all(&text);
    let found: Vec<_> = found.items.iter().map(|d| (d.code.as_str(), d.message.as_str())).collect();
    assert_eq!(
        found,
        [
            ("W010", "the part with node `x` is not connected to node `a`"),
            ("W012", "nothing holds the part with node `x`: it has no anchor"),
        ]
    );
    warning(
        &format!("{CANTILEVER}beam2d p1 [b c] [l=10u w=1u oz=pi/2]\nbeam2d p1 [c a] [l=33u w=1u oz=pi]"),
        "W011",
        "misses by x = 2.3e-5 m, y = -1e-5 m",
    );
    warning(&format!("{CANTILEVER}R * [a b] [R=1]"), "W013", "the potential of node `a` floats");
}

/// A closed loop of many beams is no open loop, whatever rounding does.
#[test]
fn closed_loops_are_silent() {
    let ring = "anchor p1 [n(0)] []\nfor k=0:358 [ beam2d p1 [n(k) n(k+1)] [l=10u w=1u oz=deg(k)] ]\nbeam2d p1 [n(359) n(0)] [l=10u w=1u oz=deg(359)]";
    let found = all(&format!("{PROCESS}{ring}"));
    assert!(found.items.is_empty(), "{found}");
}

/// Slips that load but mean something else.
#[test]
fn slips() {
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u oz=90]", "W003", "90 looks like degrees");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=100 w=1u]", "W005", "`l` is 100 m long");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u Youngsmodulus=165]", "W008", "165 Pa");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u density=2.3]", "W035", "2.3 kg/m³");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u stress=1e12]", "W036", "1e12 Pa");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u ambienttemperature=293 T=10293]", "W037", "10293 K");
    warning(
        "anchor p1 [a] []\nfor k=0:9 [ beam2d p1 [a b(k)] [l=10u w=1u oz=45] ]",
        "W003",
        "45 looks like degrees (10 elements)",
    );
    warning(
        "anchor p1 [a] []\nanchor p1 [b] []\nanchor p1 [c] []\nanchor p1 [d] []\n\
         gap2dforce p1 [a b c d] [l=100u w1=2u w2=2u gap=4u]\neground * [c] []\nv port * [a c] []",
        "W015",
        "bends nothing",
    );
    warning(
        "anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]\neground * [a] []\nport * [a] []",
        "W009",
        "called `anon4`",
    );
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u wdith=3u]", "W004", "takes no parameter `wdith`");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10e-6m w=1u]", "W001", "is milli");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u T=310]", "W032", "`T` = 310 is a temperature rise of 310 K");
    warning("anchor p1 [a] []\nbeam3d p1 [a b] [l=10u w=1u]", "W030", "out-of-plane");
    warning("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u straingradient=1]", "W031", "straingradient");
    warning("anchor p1 [a] []\neground * [a] []\nbeam2det p1 [a b] [l=10u w=1u]", "W034", "2.33");
    warning(
        "subnet s [a b] [width=1u] [ beam2d parent [a b] [l=1u w=width] ]\nanchor p1 [a] []\ns p1 [a b] [widht=2u]",
        "W004",
        "subnet `s` takes no parameter `widht`",
    );
}

/// Parameters that SUGAR's old netlists carry on elements that never used them raise no warning.
#[test]
fn stray_parameters_of_old_netlists() {
    let found = all(&format!("{PROCESS}anchor p1 [a] [l=5u w=10u R=100]\nbeam2d p1 [a b] [l=10u w=1u R=1000 Rs=10]"));
    assert!(found.items.is_empty(), "{found}");
}

/// One run reports the errors of many lines, in order, each once although a loop meets it many times.
#[test]
fn all_errors_in_one_run() {
    let text = "x = 1 + ]\nbeam2d p1 [a b\nanchor p1 [a] [l=]\nfor k=1:3 [ y = ( ]\nz = .5";
    let codes: Vec<String> = all(text).items.into_iter().map(|d| format!("{}:{}", d.code, d.line)).collect();
    assert_eq!(codes, ["E010:1", "E011:1", "E014:2", "E010:3", "E010:4", "E001:5"]);
    let text = format!("{PROCESS}for k=1:50 [ beam2d p1 [a(k) a(k+1)] [l=10u] ]\nbeam2d p1 [q r] [w=1u l=0]");
    let codes: Vec<String> = all(&text).items.into_iter().map(|d| format!("{}:{}", d.code, d.line)).collect();
    assert_eq!(codes, ["E053:2", "E060:3"]);
}

/// Columns count characters, not bytes.
#[test]
fn columns_are_characters() {
    let found = all("x = 'µm' + zebra");
    assert_eq!((found.items[0].column, found.items[0].width), (12, 5));
}

/// A SUGAR 3 netlist is recognised: it is run, or refused with one message where the build has no Lua.
#[test]
fn lua_netlists() {
    let found = all("use(\"mumps.net\")\np1 = material { h = 2u }\nbeam3d { node \"a\", node \"b\"; l=1u }");
    assert_eq!(found.items.len(), 1);
    let code = if cfg!(feature = "lua") { "E021" } else { "E005" };
    assert_eq!((found.items[0].code.as_str(), found.items[0].line), (code, 1));
}

/// A resistance whose conductance is no number is refused where it stands; it ended the program.
#[test]
fn resistances_without_a_conductance_are_refused() {
    let beam = "anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]\neground * [a] []\n";
    for resistance in ["R=1e-310", "R=1e-301", "R=1e301", "G=1e301"] {
        let item = only(&format!("{beam}r R * [a b] [{resistance}]\n"));
        assert_eq!((item.code.as_str(), item.severity), ("E060", Severity::Error), "{resistance}: {item:?}");
        assert!(item.message.contains("`r`"), "{item:?}");
    }
    let heated = "anchor p1 [a] []\nhot beam2det p1 [a b] [l=10u w=1u R=1e-310]\nanchor p1 [b] []\n";
    assert!(all(&format!("{PROCESS}{heated}")).items.iter().any(|d| d.code == "E060"), "{}", all(heated));
}

/// Impact losses are bounded: a restitution from 0.01 to 1 and a speed from 1e-9 to 1e6 m/s. A value next to a bound is
/// printed in full.
#[test]
fn impacts_are_bounded() {
    let stop = |value: &str| format!("anchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u]\nstop2d * [b] [gap=1u {value}]\n");
    for (value, message) in [
        ("restitution=0", "`restitution` is 0e0, expected 1e-2 to 1e0"),
        ("restitution=-1", "`restitution` is -1e0, expected 1e-2 to 1e0"),
        ("restitution=1.0000001", "`restitution` is 1.0000001e0, expected 1e-2 to 1e0"),
        ("speed=1e-300", "`speed` is 1e-300, expected 1e-9 to 1e6"),
        ("speed=0", "`speed` is 0e0, expected 1e-9 to 1e6"),
        ("speed=1e300", "`speed` is 1e300, expected 1e-9 to 1e6"),
    ] {
        let item = only(&stop(value));
        assert_eq!((item.code.as_str(), item.message.as_str(), item.line), ("E060", message, 3), "{item:?}");
        assert!(!item.help.is_empty());
    }
    for value in ["restitution=0.01", "restitution=1", "speed=1e-9", "speed=1e6"] {
        assert!(all(&format!("{PROCESS}{}", stop(value))).items.is_empty(), "{value}");
    }
}
