//! `layout` and `convert` from outside: files, reports, and layouts where netlists go.

use crate::command::{Bench, CANTILEVER};

/// A netlist becomes a layout, the layout a netlist and a picture, and every analysis takes it as it is.
#[test]
fn there_and_back() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for file in ["c.gds", "c.cif"] {
        let ran = bench.run(&format!("layout c.net -o {file}"));
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{file}");
        assert!(ran.stdout.contains("on the masks of polymumps"), "{}", ran.stdout);
        let ran = bench.run(&format!("convert {file} -o back.net --picture back.svg"));
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{file}");
        assert!(ran.stdout.contains("by labels") && ran.stdout.contains("not understood 0"), "{}", ran.stdout);
        let modes = |name: &str| {
            let ran = bench.run(&format!("modes {name} --count 2 --json"));
            assert_eq!(ran.status, 0, "{name}: {}", ran.stderr);
            let document: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
            document["frequencies_hz"].clone()
        };
        assert_eq!(modes("c.net"), modes("back.net"), "{file}");
        assert_eq!(modes("c.net"), modes(file), "{file}");
    }
}

/// Impossible requests are rejected with one message and without a file.
#[test]
fn refusals() {
    let bench = Bench::new(&[("c.net", CANTILEVER), ("broken.gds", "\0\u{6}\0\u{2}"), ("empty.cif", "E")]);
    for (words, expected) in [
        ("layout c.net -o c.txt", "a file that ends in .gds or .cif"),
        ("layout c.net -o no/c.gds", "no folder"),
        ("layout c.net -o c.gds --process other", "the known ones are polymumps, soi"),
        ("convert c.net -o x.net", "expected a file that ends in .json: c.net is no layout by its name"),
        ("convert broken.gds -o x.net", "byte 0"),
        ("convert empty.cif -o x.net", "there is no cell in it"),
        ("convert missing.gds", "cannot read missing.gds"),
        ("modes c.net --cell top", "--cell is for layouts"),
        ("convert empty.cif --picture x.raw", "expected a file that ends in .svg"),
    ] {
        let ran = bench.run(words);
        assert_eq!((ran.status, ran.stdout.as_str()), (1, ""), "{words}: {}", ran.stderr);
        assert!(ran.stderr.contains(expected) && ran.stderr.lines().count() == 1, "{words}: {}", ran.stderr);
    }
    assert_eq!(bench.files(), ["broken.gds", "c.net", "empty.cif"]);
}

/// A netlist or layout becomes a document, which every command reads with the same bits, and which converts to itself byte by byte.
#[test]
fn documents() {
    let bench = Bench::new(&[("c.net", CANTILEVER), ("broken.json", "{\"format\": \"other\"}")]);
    let ran = bench.run("convert c.net -o c.json");
    assert_eq!((ran.status, ran.stdout.as_str(), ran.stderr.as_str()), (0, "", ""));
    let ran = bench.run("convert c.json -o again.json");
    assert_eq!((ran.status, ran.stdout.as_str(), ran.stderr.as_str()), (0, "", ""));
    let text = |name: &str| std::fs::read_to_string(bench.path(name)).unwrap();
    assert_eq!(text("c.json"), text("again.json"));
    let result = |words: &str| {
        let ran = bench.run(words);
        assert_eq!(ran.status, 0, "{words}: {}", ran.stderr);
        let mut document: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        document["file"].take();
        document
    };
    for words in ["modes FILE --count 3 --json", "check FILE --json", "static FILE --json"] {
        assert_eq!(result(&words.replace("FILE", "c.net")), result(&words.replace("FILE", "c.json")), "{words}");
    }
    assert_eq!(bench.run("layout c.net -o c.gds").status, 0);
    assert_eq!(bench.run("convert c.gds -o drawn.json").status, 0);
    assert_eq!(
        result("modes c.gds --count 3 --json")["frequencies_hz"],
        result("modes drawn.json --count 3 --json")["frequencies_hz"]
    );
    for (words, expected) in [
        ("modes broken.json", "error[E081]: $.format: expected \"bimorph-structure\", got the text \"other\""),
        ("modes c.json --set w=2u", "error[E048]: a document has no parameter `w` to set"),
        ("convert c.net -o d.json --picture d.svg", "--picture: expected a layout"),
        ("convert c.net", "--out: expected a file that ends in .json"),
    ] {
        let ran = bench.run(words);
        assert_eq!((ran.status, ran.stdout.as_str()), (1, ""), "{words}: {}", ran.stderr);
        assert!(ran.stderr.contains(expected), "{words}: {}", ran.stderr);
    }
}
