//! `bimorph export`: contents of the files, and rejected requests.

use crate::command::{Bench, CANTILEVER, PLATE, number};
use std::collections::BTreeSet;

/// A heated chevron with a comb and a plate: every kind of port.
const CHEVRON: &str = "process p = [Youngsmodulus=165e9 Poisson=0.3 density=2300 viscosity=1.78e-5 fluid=2u h=2u
  permittivity=8.854e-12 sheetresistance=20 thermcond=30 thermalexpansion=2.33e-6 ambienttemperature=293]
anchor p [a] [l=10u w=10u oz=pi]
left  beam2det p [a c] [l=120u w=2u oz=0.1 tau=20u]
right beam2det p [c b] [l=120u w=2u oz=-0.1]
anchor p [b] [l=10u w=10u]
rod beam2d p [c s] [l=40u w=4u oz=pi/2]
mass2d * [s] [m=2e-11 J=1e-20]
drive comb2de p [s k] [N=40 gap=2u l=10u L=30u oz=pi/2]
anchor p [k] [l=5u w=5u]
eground * [b] []
heat port * [a] []
sense port * [k] []
";

const ALL: &str =
    "--port heat=1 --port sense=12 --ports heat,sense,s.x,s.vy,c.rz,left.T,frame.ay --signals s.y:1M,left.T,drive.q";

fn bench() -> Bench {
    Bench::new(&[("chevron.net", CHEVRON), ("plate.net", PLATE), ("c.net", CANTILEVER)])
}

/// The same request gives the same bytes, on standard output and in a file; the document has the pins and an error
/// within the requested tolerance.
#[test]
fn the_same_bytes_every_time() {
    let bench = bench();
    for form in ["--spice", "--verilog-a"] {
        let words = format!("export chevron.net {form} {ALL}");
        let (one, two) = (bench.run(&words), bench.run(&words));
        assert_eq!((one.status, two.status), (0, 0), "{}", one.stderr);
        assert_eq!(one.stdout, two.stdout);
        let document = bench.json(&format!("{words} --out out.txt --within 1e-3"));
        assert!(number(&document["error"]) <= 1e-3);
        assert_eq!(document["pins"].as_array().unwrap().len(), 2 * 7 + 3);
        assert_eq!(bench.run(&format!("{words} --out out.txt")).status, 0);
        assert_eq!(std::fs::read_to_string(bench.path("out.txt")).unwrap(), one.stdout);
    }
}

/// A subcircuit holds resistors, capacitors, inductors and linear sources alone; its nodes are pins, ground, or nodes of at least two
/// connections.
#[test]
fn a_subcircuit_of_plain_parts() {
    let ran = bench().run(&format!("export chevron.net --spice {ALL}"));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(ran.stdout.is_ascii());
    let lines: Vec<Vec<&str>> =
        ran.stdout.lines().filter(|l| !l.starts_with('*')).map(|l| l.split_whitespace().collect()).collect();
    assert_eq!(lines[0][..2], [".subckt", "chevron"]);
    assert_eq!(lines.last().unwrap()[..], [".ends", "chevron"]);
    let pins: BTreeSet<&str> = lines[0][2..].iter().copied().collect();
    let mut met = std::collections::BTreeMap::<&str, usize>::new();
    let mut names = BTreeSet::new();
    for line in &lines[1..lines.len() - 1] {
        let nodes = match line[0].as_bytes()[0] {
            b'R' | b'C' | b'L' | b'V' | b'I' if line.len() == 4 => 2,
            b'F' if line.len() == 5 => 2,
            b'E' | b'G' if line.len() == 6 => 4,
            _ => panic!("{line:?}"),
        };
        assert!(names.insert(line[0]), "{} stands twice", line[0]);
        assert!(line.last().unwrap().parse::<f64>().unwrap().is_finite(), "{line:?}");
        line[1..=nodes].iter().for_each(|node| *met.entry(node).or_default() += 1);
    }
    for (node, count) in met {
        assert!(node == "0" || pins.contains(node) || count > 1, "{node} hangs on one connection");
    }
}

/// A Verilog-A module holds no state but its nodes: none of the words that make one; all nodes are declared, and brackets close.
#[test]
fn a_module_without_hidden_state() {
    let ran = bench().run(&format!("export chevron.net --verilog-a --name part {ALL}"));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let text = ran.stdout;
    for word in ["@", "$", "idt", "cross", "bound_step", "initial", "real ", "integer", "limexp", "laplace", "if"] {
        let code: String = text.lines().map(|l| l.split("//").next().unwrap()).collect::<Vec<_>>().join("\n");
        assert!(!code.contains(word), "\"{word}\" stands in the module");
    }
    assert_eq!(text.matches('(').count(), text.matches(')').count());
    assert!(text.contains("module part(") && text.trim_end().ends_with("endmodule"));
    let declared: BTreeSet<&str> = (text.lines())
        .filter_map(|l| l.trim().strip_prefix("electrical "))
        .flat_map(|l| l.trim_end_matches(';').split(", "))
        .collect();
    let branches: BTreeSet<&str> =
        text.lines().filter_map(|l| l.split(") b").nth(1)).map(|l| l.split(';').next().unwrap()).collect();
    let body = text.split("analog begin").nth(1).unwrap();
    let used = body.split(['(', ')', ' ', ';']).filter(|w| w.starts_with(['x', 'w', 'h', 's']));
    for node in used.filter(|word| *word != "white_noise") {
        assert!(declared.contains(node), "{node} is not declared");
    }
    for branch in body.split("(b").skip(1).map(|rest| rest.split(')').next().unwrap()) {
        assert!(branches.contains(branch), "b{branch} is no branch");
    }
    let every = declared.iter().filter(|n| n.starts_with(['x', 'w', 'h'])).copied();
    for node in every {
        assert!(body.contains(&format!("I({node}) <+")), "nothing determines {node}");
    }
}

/// The nonlinear form of a plate: the field of two plates, and contact, in B-sources; and as a module, without hidden state.
#[test]
fn the_nonlinear_form() {
    let bench = bench();
    let spice = bench.run("export plate.net --spice --nonlinear --signals m.x:1M");
    assert_eq!(spice.status, 0, "{}", spice.stderr);
    assert!(
        spice.stdout.is_ascii() && spice.stdout.contains("Bq1 ") && spice.stdout.contains("Bf1 "),
        "{}",
        spice.stdout
    );
    let module = bench.run("export plate.net --verilog-a --nonlinear --signals m.x:1M --name plate_cell");
    assert_eq!(module.status, 0, "{}", module.stderr);
    assert!(module.stdout.contains("module plate_cell(p_drive, n_drive, s_m_x);"), "{}", module.stdout);
    for word in ["@", "$", "idt", "bound_step", "real ", "integer", " if"] {
        assert!(!module.stdout.contains(word), "\"{word}\" stands in the module");
    }
    assert_eq!(module.stdout.matches('(').count(), module.stdout.matches(')').count());
}

/// Four chevrons in a row, each with its own drive beams between anchors, coupled by stiff links: eight modes lie within 2 %
/// of each other, and the search for a file continues until one is within the tolerance.
#[test]
fn modes_close_together_have_a_file() {
    let text =
        "process si = [Youngsmodulus=165e9 density=2300 h=10u thermalexpansion=2.7e-6 resistivity=2e-4 thermcond=60
      specificheat=712 ambienttemperature=300 viscosity=1.8e-5 fluid=2u]
    for i=1:4 [
      anchor si [a(i)] [l=10u w=10u]
      beam2det si [a(i) c(i)] [l=300u w=4u oz=deg(2)]
      beam2det si [c(i) b(i)] [l=300u w=4u oz=-deg(2)]
      anchor si [b(i)] [l=10u w=10u]
      R * [drive a(i)] [R=1]
      R * [b(i) gnd] [R=1]
    ]
    for i=1:3 [ beam2d si [c(i) c(i+1)] [l=12u w=20u oz=pi/2] ]
    eground * [gnd] []
    heat port * [drive] []
    ";
    let bench = Bench::new(&[("row.net", text)]);
    for within in ["1e-3", "1e-4", "1e-6"] {
        let words = format!("export row.net --spice --port heat=3 --signals c(2).y:1M --out row.lib --within {within}");
        let error = number(&bench.json(&words)["error"]);
        assert!(error <= within.parse::<f64>().unwrap(), "{error}");
    }
}

/// Where no voltage couples motion and circuit, a warning says so, and the circuit's part remains: R = 2400 Ω of two
/// beams of 60 squares of 20 Ω.
#[test]
fn no_motion_is_reported() {
    let ran = bench().run("export chevron.net --spice");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(ran.stderr.contains("no mode"), "{}", ran.stderr);
    let r: f64 = ran.stdout.lines().find_map(|l| l.strip_prefix("R1 p_heat n_heat ")).unwrap().parse().unwrap();
    assert!((r / 2400.0 - 1.0).abs() < 1e-9, "{r}");
}

/// A bias at which the plate has pulled in is reported, on the terminal and in the file.
#[test]
fn a_jump_is_reported() {
    let bench = bench();
    let ran = bench.run("export plate.net --spice --port drive=12");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let reported = "the part pulled in, snapped or buckled on the way to this operating point";
    assert!(ran.stderr.contains(reported) && ran.stdout.contains(&format!("* warning: {reported}")), "{}", ran.stderr);
    assert!(!bench.run("export plate.net --spice --port drive=1").stderr.contains(reported));
}

/// Impossible exports are rejected with one message that names the reason and a remedy.
#[test]
fn refusals() {
    let bench = bench();
    for (words, expected) in [
        ("export c.net --spice", "--ports"),
        ("export chevron.net --spice --ports frame.wz", "frame.wz"),
        ("export chevron.net --spice --ports nothing", "nothing"),
        ("export chevron.net --spice --ports s.x:0", "scale"),
        ("export chevron.net --spice --ports s.x,s.x", "\"s.x\" twice"),
        ("export chevron.net --spice --signals nothing.x", "nothing.x"),
        ("export chevron.net --spice --port nothing=1", "nothing"),
        ("export chevron.net --spice --to 0", "--to"),
        ("export chevron.net --spice --within 0", "--within"),
        ("export chevron.net --spice --count 0", "--count"),
        ("export chevron.net --spice --name 2a", "--name"),
        ("export chevron.net --spice --out gone/a.lib", "gone"),
        ("export chevron.net --spice --nonlinear", "beam \"left\" heats"),
        ("export c.net --verilog-a --nonlinear --ports b.y", "can turn"),
        ("export plate.net --spice --nonlinear --ports frame.wz", "frame.wz"),
        ("export plate.net --osdi --openvaf none", "--openvaf: none does not exist"),
    ] {
        let before = bench.files();
        let ran = bench.run(words);
        assert_eq!(ran.status, 1, "{words}: {}{}", ran.stdout, ran.stderr);
        assert_eq!((ran.stdout.as_str(), bench.files()), ("", before), "{words}");
        assert!(ran.stderr.contains(expected) && ran.stderr.matches("error").count() == 1, "{words}: {}", ran.stderr);
    }
    for words in [
        "export plate.net --spice --nonlinear --port drive=1",
        "export chevron.net",
        "export chevron.net --spice --verilog-a",
        "export chevron.net --spice --json",
        "export chevron.net --spice --osdi",
        "export chevron.net --verilog-a --osdi",
        "export chevron.net --verilog-a --openvaf openvaf-r",
    ] {
        assert_eq!(bench.run(words).status, 2, "{words}");
    }
}
