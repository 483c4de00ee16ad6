//! `--out` writes what its extension says, whole; standard output takes what is left.

use crate::command::{Bench, CANTILEVER};
use bimorph::results::raw;
use std::process::Stdio;

const TRAN: &str = "tran c.net --set F=1u --release F --stop 8u --points 41 --signals b.y,b.rz";

/// Every analysis writes every format it has, and nothing else appears in the folder.
#[test]
fn every_format() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for verb in ["static c.net", "modes c.net --count 2", "ac c.net --drive b.fy --from 1k --to 1M --points 21", TRAN] {
        for (extension, start) in
            [("raw", "Title: c.net"), ("csv", ""), ("svg", "<svg"), ("png", "\u{fffd}PNG"), ("html", "<!doctype html>")]
        {
            let name = format!("out.{extension}");
            let ran = bench.run(&format!("{verb} --out {name}"));
            assert_eq!(ran.status, 0, "{verb} {name}: {}", ran.stderr);
            let bytes = std::fs::read(bench.path(&name)).expect("the file");
            assert!(String::from_utf8_lossy(&bytes).starts_with(start), "{verb} {name}");
            assert_eq!(bench.files(), ["c.net", &name]);
            std::fs::remove_file(bench.path(&name)).expect("removed");
        }
    }
}

/// A netlist's deck is written whole and not run, beside the netlist by its name; with the requested sources and
/// outputs in it.
#[test]
fn a_netlist_becomes_a_deck() {
    let netlist = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1]\n\
        param g=2u\nanchor * [e] [l=1u w=1u h=1u]\nplategap2d * [m e] [A=1e-8 gap=g]\neground * [e] []\n\
        bias Vsrc * [s e] [V=4]\nR * [s m] [R=1k]\nC * [m e] [C=1p]\n";
    let bench = Bench::new(&[("Plate.net", netlist)]);
    let words = "cosim Plate.net --emit plate.cir --op --signals m.x --tol 1e-4 --set g=3u --drive bias=SIN(1,1,1k)";
    let ran = bench.run(words);
    assert_eq!((ran.status, ran.stdout.as_str(), ran.stderr.as_str()), (0, "", ""));
    assert_eq!(bench.files(), ["Plate.net", "plate.cir"]);
    let deck = std::fs::read_to_string(bench.path("plate.cir")).expect("the deck");
    let lines: Vec<&str> = deck.lines().collect();
    for line in [
        "v_bias s 0 dc 4e0 ac 1 SIN(1,1,1k)",
        "A1 %gd [m 0] %v [m_x] device",
        ".model device bimorph(file=\"Plate.net\" without_circuit=true",
        "+ ports=[\"m\"]",
        "+ monitors=[\"m.x:1e6\"]",
        "+ tol=1e-4",
        "+ set=[\"g=3e-6\"]",
        ".op",
        ".end",
    ] {
        assert!(lines.contains(&line), "{line} in\n{deck}");
    }
    // every other analysis says what it leaves out, and sees none of it
    let ran = bench.run("static Plate.net");
    assert!(ran.status == 0 && ran.stderr.contains("W021"), "{}", ran.stderr);
}

/// The raw file of a transient holds the samples of its JSON, bit by bit, and `plot` draws and converts it.
#[test]
fn raw_csv_and_json_agree() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let json = bench.json(&format!("{TRAN} --out a.raw"));
    let plots = raw::read(&std::fs::read(bench.path("a.raw")).expect("the file")).expect("a raw file");
    let samples = plots[0].column("b.y").expect("the signal").samples.magnitudes();
    let expected: Vec<f64> =
        json["signals"]["b.y"].as_array().expect("samples").iter().filter_map(serde_json::Value::as_f64).collect();
    assert_eq!(samples, expected);

    let ran = bench.run("plot a.raw --out a.csv");
    assert_eq!((ran.status, ran.stdout.as_str()), (0, ""), "{}", ran.stderr);
    let csv = std::fs::read_to_string(bench.path("a.csv")).expect("the file");
    let column: Vec<f64> =
        csv.lines().skip(1).map(|l| l.split(',').nth(1).expect("b.y").parse().expect("a number")).collect();
    assert_eq!(column, expected);

    let ran =
        bench.command("plot a.raw --out a.svg --mechanism c.net --panel").arg("tip [m]=b.y").output().expect("runs");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let svg = std::fs::read_to_string(bench.path("a.svg")).expect("the file");
    assert!(svg.contains("tip [m]") && svg.contains("displacements ×"), "{svg}");
}

/// The same run writes the same bytes.
#[test]
fn runs_repeat_to_the_byte() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for name in ["a.raw", "a.svg", "a.png"] {
        let mut files = Vec::new();
        for _ in 0..2 {
            assert_eq!(bench.run(&format!("{TRAN} --out {name}")).status, 0);
            files.push(std::fs::read(bench.path(name)).expect("the file"));
        }
        assert!(files[0] == files[1], "{name}");
    }
}

/// A reader that goes away early (`bimorph … | head -1`) is no error.
#[test]
fn a_closed_pipe_is_no_error() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let mut child = bench
        .command("modes c.net --count 1 --json")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Ctrl-C ends a long run with status 130 and leaves neither a result nor a temporary file.
#[cfg(unix)]
#[test]
fn interrupted_work_leaves_nothing() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    bench.interrupt("tran c.net --set F=1u --release F --undamped --stop 100 --points 3 --out a.raw", &["c.net"]);
}
