//! SUGAR 3 netlists: they draw what their SUGAR 2 twins draw, say where they are wrong, and cannot reach out of their sandbox or run
//! without end.

use bimorph_base::{Bundle, Diagnostic, Setting};
use bimorph_netlist::load;
use bimorph_structure::{Fringe, Structure};
use std::time::{Duration, Instant};

const LAYER: &str =
    "p1 = material {Youngsmodulus=160e9, Poisson=0.3, density=2300, viscosity=1.78e-5, fluid=2u, stress=0, h=2u}\n";

fn drawn_with(text: &str, set: &[(&str, f64)]) -> (Structure, Vec<(String, Setting)>) {
    let set: Vec<_> = set.iter().map(|(name, x)| ((*name).to_owned(), Setting::Number(*x))).collect();
    let loaded = load(&Bundle::from_text("t.net", text), &set).unwrap_or_else(|d| panic!("{d}"));
    (loaded.structure, loaded.parameters)
}

fn drawn(text: &str) -> Structure {
    drawn_with(text, &[]).0
}

fn refused(text: &str) -> Diagnostic {
    load(&Bundle::from_text("t.net", text), &[]).expect_err("an error").items.remove(0)
}

/// The same mechanism: as many of everything, at the same places, of the same sizes, to 1e-12 of each.
#[track_caller]
fn same(a: &Structure, b: &Structure) {
    let near = |x: f64, y: f64, size: f64| assert!((x - y).abs() <= 1e-12 * size.max(1e-30), "{x:e} {y:e}");
    assert_eq!(a.nodes.len(), b.nodes.len());
    let extent = a.extent();
    for (m, n) in a.nodes.iter().zip(&b.nodes) {
        for k in 0..2 {
            near(m.position[k], n.position[k], extent);
        }
        assert_eq!((m.mechanical, m.electrical), (n.mechanical, n.electrical), "{} {}", m.name, n.name);
    }
    assert_eq!(a.beams.len(), b.beams.len());
    for (m, n) in a.beams.iter().zip(&b.beams) {
        assert_eq!((m.a, m.b, &m.material), (n.a, n.b, &n.material));
        let sizes = |b: &bimorph_structure::Beam| [b.length, b.width, b.thickness, b.angle.cos(), b.angle.sin()];
        for (x, y) in sizes(m).into_iter().zip(sizes(n)) {
            near(x, y, x.abs().max(1e-6));
        }
    }
    assert_eq!(a.supports.len(), b.supports.len());
    assert_eq!(a.beam_gaps.len(), b.beam_gaps.len());
    assert_eq!(
        a.resistors.iter().map(|r| r.resistance).collect::<Vec<_>>(),
        b.resistors.iter().map(|r| r.resistance).collect::<Vec<_>>()
    );
    assert_eq!(a.voltage_sources.len(), b.voltage_sources.len());
    for (m, n) in a.loads.iter().zip(&b.loads) {
        assert_eq!(m.node, n.node);
        near(m.force[0], n.force[0], 1e-6);
        near(m.force[1], n.force[1], 1e-6);
        near(m.moment, n.moment, 1e-9);
    }
}

/// Subnets in subnets, turned instances, loops, parameters with defaults, layers that inherit: the same as in SUGAR 2.
#[test]
fn a_netlist_and_its_twin() {
    let two = "process poly = [Youngsmodulus=160e9 density=2300]\nprocess p1 : poly = [h=2u]\nparam n = 3, w = 2u\n\
        subnet leg [top foot] [l=* w=2u] [ beam2d parent [top knee] [l=l w=w oz=pi/2]\n beam2d parent [knee foot] [l=l/2 w=w]\n\
        anchor parent [foot] [l=5u w=5u] ]\n\
        subnet pair [a b] [l=*] [ leg parent [a f1] [l=l]\n leg parent [b f2] [l=l w=3u oz=pi] ]\n\
        beam2d p1 [c(0) c(1)] [l=10u w=w]\nfor k=1:n [ beam2d p1 [c(k) c(k+1)] [l=10u w=w] ]\n\
        pair p1 [c(0) c(n+1)] [l=40u oz=pi/6]\nf2d * [c(1)] [F=1u oz=-pi/2]\n";
    let three = "-- the same\npoly = material {Youngsmodulus=160e9, density=2300}\np1 = material {parent=poly, h=2u}\n\
        n = n or 3\nw = w or 2u\n\
        subnet leg(top, foot, material, l, w)\n  local knee = node \"knee\"\n  w = w or 2u\n  beam2d {top, knee; material=material, l=l, w=w, oz=90}\n\
        beam2d {knee, foot; material=material, l=l/2, w=w}\n  anchor {foot; material=material, l=5u, w=5u}\nend\n\
        subnet pair(a, b, material, l)\n  leg {a, node \"f1\"; material=material, l=l}\n  leg {b, node \"f2\", material; l=l, w=3u, oz=180}\nend\n\
        beam2d {node \"c_0\", node \"c_1\"; material=p1, l=10u, w=w}\n\
        for k = 1, n do beam2d {node {name=\"c_\"..k}, node {name=\"c_\"..(k + 1)}, p1; l=10u, w=w} end\n\
        pair {node \"c_0\", node(\"c_\"..(n + 1)); material=p1, l=40u, oz=30}\nf2d {node \"c_1\"; F=1u, oz=-90}\n";
    let twin = load(&Bundle::from_text("t.net", two), &[]).unwrap_or_else(|d| panic!("{d}"));
    let (own, parameters) = drawn_with(three, &[]);
    // nodes of a subnet are met in another order
    let sorted = |s: &Structure| {
        let mut at: Vec<_> = s.nodes.iter().map(|n| n.position.map(|x| (x * 1e15).round() as i64)).collect();
        at.sort_unstable();
        at
    };
    assert_eq!(sorted(&own), sorted(&twin.structure));
    let stiff = |s: &Structure| s.beams.iter().map(|b| (b.length, b.width, b.thickness)).collect::<Vec<_>>();
    assert_eq!(stiff(&own), stiff(&twin.structure));
    assert_eq!(parameters, twin.parameters);
    let (wide, _) = drawn_with(three, &[("w", 4e-6), ("n", 5.0)]);
    assert_eq!((wide.beams.len(), wide.beams[0].width), (10, 4e-6));
}

/// A netlist as SUGAR's converter writes it, with radians and `_n`, is its twin part for part.
#[test]
fn a_converted_netlist_and_its_twin() {
    let two = "process p1 = [Youngsmodulus=165e9 Poisson=0.3 density=2300 viscosity=1.78e-5 fluid=2u stress=0 h=2u]\n\
        subnet half [L R] [top=* w=2u] [ beam3d parent [topleft L] [l=top/3 w=w oz=-deg(90)]\n\
        beam3d parent [topleft R] [l=top w=w]\n anchor parent [R] [l=5u w=10u] ]\n\
        anchor p1 [A] [l=5u w=5u]\nbeam2de p1 [A b] [l=100u w=2u R=100]\nhalf p1 [b c] [top=90u oz=deg(180)]\n\
        gap2d p1 [c d e f] [l=90u w1=3u w2=3u gap=2u V=4]\neground * [A] []\nVsrc * [b g] [V=2]\neground * [g] []\nf3d * [b] [F=2u oz=pi/2]\n";
    let three = "use(\"std2cvt.net\")\npi = 3.1415926535897932385\np1 = material {Youngsmodulus=165e9, Poisson=0.3, density=2300, viscosity=1.78e-5, fluid=2u, stress=0, h=2u}\n\
        subnet mfhalf (L, R, material, top, w)\n  local parent = material\n  _currnodes[\"L\"] = L\n  _currnodes[\"R\"] = R\n\
        top = top or (material and material.top)\n  w = w or (2u) or (material and material.w)\n\
        mfbeam3d {_n(\"topleft\"), _n(\"L\"); material = parent, l = (top)/(3), w = w, oz = -(deg(90))}\n\
        mfbeam3d {_n(\"topleft\"), _n(\"R\"); material = parent, l = top, w = w}\n  mfanchor {_n(\"R\"); material = parent, l = 5u, w = 10u}\nend\n\
        mfanchor {_n(\"A\"); material = p1, l = 5u, w = 5u}\nmfbeam2de {_n(\"A\"), _n(\"b\"); material = p1, l = 100u, w = 2u, R = 100}\n\
        mfhalf {_n(\"b\"), _n(\"c\"); material = p1, top = 90u, oz = deg(180)}\n\
        mfgap2d {_n(\"c\"), _n(\"d\"), _n(\"e\"), _n(\"f\"); material = p1, l = 90u, w1 = 3u, w2 = 3u, gap = 2u, V = 4}\n\
        mfeground {_n(\"A\")}\nmfVsrc {_n(\"b\"), _n(\"g\"); V = 2}\nmfeground {_n(\"g\")}\nmff3d {_n(\"b\"); F = 2u, oz = (pi)/(2)}\nrelpos_treewalk()\n";
    let twin = load(&Bundle::from_text("t.net", two), &[]).unwrap_or_else(|d| panic!("{d}"));
    let found = drawn(three);
    same(&found, &twin.structure);
    // SUGAR 3's gap keeps SUGAR's fringe factor unless it names a law
    assert_eq!((found.beam_gaps[0].law, twin.structure.beam_gaps[0].law), (Some(Fringe::Sugar), None));
    let named = drawn(&three.replace("V = 4}", "V = 4, fringe = \"parallel\"}"));
    assert_eq!(named.beam_gaps[0].law, Some(Fringe::Parallel));
}

/// Nodes with coordinates lie where they are drawn; beams without a length are measured between them; `force` acts along the axes.
#[test]
fn nodes_with_coordinates() {
    let s = drawn(&format!(
        "use \"stdlib.net\"\n{LAYER}A = node {{name = \"A\"; 0, 0, 0}}\nb = node {{name = \"b\"; 100u, 0, 0}}\nc = node {{100u, 50u, 0}}\n\
         element {{A; model=\"anchor\", material=p1, w=10u}}\nelement {{A, b; model=\"beam2d\", material=p1, w=2u}}\n\
         beam2d {{b, c; material=p1, w=2u}}\nelement {{c; model=\"force\", x=10u, rz=1p}}\n"
    ));
    assert_eq!((s.beams[0].length, s.beams[1].length), (100e-6, 50e-6));
    assert!((s.beams[1].angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!((s.loads[0].force, s.loads[0].moment), ([10e-6, 0.0], 1e-12));
}

/// `constraint` holds two nodes in one rigid body where they are drawn, as SUGAR 3's multipliers do: the end of the
/// link goes along with the force on its other end. A call like a function is reported with the right form.
#[test]
fn constraints_are_rigid_links() {
    let text = |model: &str| {
        format!(
            "{LAYER}A = node {{0, 0, 0; name = \"A\"}}\nb = node {{100u, 0, 0; name = \"b\"}}\nc = node {{100u, 100u, 0; name = \"c\"}}\n\
             anchor {{A; material=p1}}\nbeam2d {{A, b; material=p1, w=2u}}\nelement {{b, c; model=\"{model}\"}}\n"
        )
    };
    for model in ["constraint", "constraint2d"] {
        let s = drawn(&text(model));
        assert_eq!((s.links.len(), s.nodes[s.links[0].b.0].position), (1, [100e-6, 100e-6]));
        assert_eq!((s.nodes[s.links[0].a.0].name.as_str(), s.nodes[s.links[0].b.0].name.as_str()), ("b", "c"));
    }
    let displaced = refused(&text("displace"));
    assert_eq!((displaced.code.as_str(), displaced.help.contains("`force`")), ("E056", true), "{displaced:?}");
    let called = refused(&format!("{LAYER}force {{node \"A\"; x=1u}}\n"));
    assert_eq!((called.code.as_str(), called.help.as_str()), ("E055", "write `element {…; model=\"force\"}`"));
}

/// Files are used once, and found by their name; a missing file, and one of SUGAR 2, are reported.
#[test]
fn files() {
    let root = "use(\"layers.net\")\nuse 'layers.net'\nanchor {node \"a\"; material=p1}\nbeam2d {node \"a\", node \"b\"; material=p1, l=10u, w=1u}\n";
    let bundle = Bundle::from_text("t.net", root).with_file("layers.net", LAYER);
    assert_eq!(load(&bundle, &[]).unwrap_or_else(|d| panic!("{d}")).structure.beams.len(), 1);
    let missing = refused("-- x\nuse(\"gone.net\")\n");
    assert_eq!((missing.code.as_str(), missing.line), ("E021", 2));
    let bundle = Bundle::from_text("t.net", root).with_file("layers.net", "process p1 = [h=2u]\n");
    let other = load(&bundle, &[]).expect_err("an error").items.remove(0);
    assert_eq!((other.code.as_str(), other.line), ("E071", 1));
    let mixed = Bundle::from_text("t.net", "uses layers.net\n").with_file("layers.net", LAYER);
    assert_eq!(load(&mixed, &[]).expect_err("an error").items[0].code, "E005");
}

/// Messages have the line of the netlist, in the subnet that is built.
#[test]
fn messages_have_their_line() {
    let text = format!(
        "{LAYER}subnet s(A, B)\n  beam2d {{A, B; material=p1, l=10u}}\nend\ninner = s\ns {{node \"a\", node \"b\"; name=\"x\"}}\n"
    );
    let found = refused(&text);
    assert_eq!((found.code.as_str(), found.line, found.column), ("E053", 3, 3));
    assert!(found.help.contains("seen in the subnet instance `x`"), "{}", found.help);
    let at = |text: &str| {
        let found = refused(text);
        (found.code, found.line, found.message)
    };
    let syntax = at("-- x\nx = 1 +\n");
    assert_eq!((syntax.0.as_str(), syntax.1), ("E071", 3));
    assert_eq!(at("-- x\n\nbaem2d {}\n"), ("E055".into(), 3, "unknown element `baem2d`".into()));
    assert_eq!(at("-- x\nx = nothing + 1\n").0, "E072");
    assert_eq!(at("-- x\nassert(nil, 'too wide')\n"), ("E042".into(), 2, "too wide".into()));
    assert_eq!(at("-- x\nanchor {3}\n").0, "E050");
    assert_eq!(at("-- x\nsubnet s(A) s {A} end\ns {node \"a\"}\n").0, "E052");
    assert_eq!(at("-- x\nfunction f() return %sin(1) end\n").0, "E071");
    let set = [("q".to_owned(), Setting::Number(1.0))];
    let unknown = load(&Bundle::from_text("t.net", LAYER), &set).expect_err("an error").items.remove(0);
    assert_eq!(unknown.code, "E048");
}

/// Nothing outside can be reached, and no function of Lua's is there that could run for long or give another order each time.
#[test]
fn the_sandbox_is_closed() {
    for name in [
        "os",
        "io",
        "require",
        "package",
        "debug",
        "load",
        "loadstring",
        "dofile",
        "loadfile",
        "string",
        "table",
        "coroutine",
        "utf8",
        "pcall",
        "xpcall",
        "setmetatable",
        "getmetatable",
        "rawset",
        "rawget",
        "next",
        "collectgarbage",
        "ffi",
        "jit",
        "_G",
        "_ENV._G",
        "warn",
    ] {
        let text = format!("-- x\nassert({name} == nil, 'is there')\n");
        let found = load(&Bundle::from_text("t.net", &text), &[]);
        assert!(found.is_ok(), "{name}: {found:?}");
    }
    let found = refused("-- x\nos.execute('true')\n");
    assert_eq!((found.code.as_str(), found.line), ("E072", 2));
    assert!(found.help.contains("no access to files"), "{}", found.help);
    assert_eq!(refused("-- x\nx = ('a'):rep(1e9)\n").code, "E072");
    // what is no text is no chunk
    assert_eq!(refused("-- \u{1b}Lua\nx =\n").code, "E071");
}

/// Loops without end, strings and tables that grow, deep recursion and long iterations end soon. The bound leaves room for a busy
/// machine; idle, each takes less than a tenth of a second.
#[test]
fn bombs_end_soon() {
    let bombs = [
        "while true do end",
        "s = 'a' while true do s = s .. s end",
        "t = {} i = 1 while true do t[i] = {} i = i + 1 end",
        "s = 'a' for i = 1, 21 do s = s .. s end while true do local t = s .. 'x' end",
        "local function f() return 1 + f() end f()",
        "local function f() return f() end f()",
        "t = {} for i = 1, 9000 do t[i] = i end while true do for k in pairs(t) do end end",
        "t = {} for i = 1, 900 do t['a' .. i] = i end while true do p = material {parent=t} end",
        "while true do x = tostring(1) .. 'a' end",
        "while true do print('a') end",
    ];
    for bomb in bombs {
        let start = Instant::now();
        let found = refused(&format!("-- x\n{bomb}\n"));
        assert_eq!(found.code, "E046", "{bomb}: {found:?}");
        assert!(start.elapsed() < Duration::from_secs(5), "{bomb}: {:?}", start.elapsed());
    }
}

/// The same netlist gives the same drawing each time, also where it goes over a table by its keys.
#[test]
fn the_order_is_always_the_same() {
    let text = format!(
        "{LAYER}t = {{}}\nfor i = 1, 50 do t['k' .. i] = i end\nlast = node 'a'\nanchor {{last}}\n\
         for k, v in t do local n = node(k) beam2d {{last, n; material=p1, l=v*1u, w=1u}} last = n end\n"
    );
    let names = |s: &Structure| s.nodes.iter().map(|n| n.name.clone()).collect::<Vec<_>>();
    let first = drawn(&text);
    assert_eq!(names(&first)[..4], ["a", "k1", "k10", "k11"]);
    for _ in 0..5 {
        assert_eq!(drawn(&text), first);
    }
}

/// Every angle is in degrees, those of arcs and arms too. Coordinates of an existing node hold where it had none, and
/// differing ones are reported. A string is no number of a material, and misspelt entries are reported.
#[test]
fn angles_coordinates_and_materials() {
    let arc = |alpha: f64| {
        drawn(&format!(
            "{LAYER}anchor {{node \"A\"; material=p1}}\narc2d {{node \"A\", node \"B\"; material=p1, w=2u, radius=100u, alpha={alpha}}}\n"
        ))
    };
    let end = arc(90.0).nodes[1].position;
    assert!((end[0] - 100e-6).abs() < 1e-12 && (end[1] - 100e-6).abs() < 1e-12, "{end:?}");
    let nodes = "O = node {0, 0; name=\"O\"}\nnode \"B\"\nB = node {0, 50u; name=\"B\"}\nanchor {O; material=p1}\n";
    let beam = drawn(&format!("{LAYER}{nodes}beam2d {{O, B; material=p1, w=2u}}\n"));
    assert_eq!(beam.beams[0].length, 50e-6);
    let warned = |text: &str| {
        let loaded = load(&Bundle::from_text("t.net", text), &[]).unwrap_or_else(|d| panic!("{d}"));
        loaded.warnings.items.into_iter().map(|d| (d.code, d.line, d.message)).collect::<Vec<_>>()
    };
    let again = "node {0, 60u; name=\"B\"}\n";
    let reported = warned(&format!("{LAYER}{nodes}{again}beam2d {{O, B; material=p1, w=2u}}\n"));
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert!(reported[0].0 == "W011" && reported[0].1 == 6 && reported[0].2.contains("`B`"), "{reported:?}");
    let cantilever = "anchor {node \"A\"; material=q}\nbeam2d {node \"A\", node \"B\"; material=q, l=100u, w=2u}\n";
    let text = format!("{LAYER}q = material {{parent=p1, stress=\"100M\"}}\n{cantilever}");
    let found = refused(&text);
    assert!(found.code == "E050" && found.message.contains("`stress`"), "{found:?}");
    let reported = warned(&format!("{LAYER}q = material {{parent=p1, strss=1}}\n{cantilever}"));
    assert!(reported.len() == 1 && reported[0].0 == "W004" && reported[0].2.contains("`strss`"), "{reported:?}");
}
